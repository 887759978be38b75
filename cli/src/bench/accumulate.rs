//! The simplest denoiser there is, as a baseline: reproject by motion vectors and average.

use super::history::History;
use crate::sequence::Frame;

/// Longest history, in frames: that of the Reference preset.
const MAX_HISTORY: f32 = 32.0;

/// Averages what each surface point received over the last frames.
#[derive(Debug, Default)]
pub struct Accumulation {
    previous: Option<(Frame, Vec<[f32; 3]>, Vec<f32>)>,
}

impl Accumulation {
    /// The average including this frame's radiance, row by row.
    pub fn add(&mut self, frame: &Frame) -> Vec<[f32; 3]> {
        let last = self.previous.take();
        let history = History::new(frame, last.as_ref().map(|(frame, ..)| frame));
        let mut result = Vec::with_capacity(frame.pixels());
        let mut lengths = Vec::with_capacity(frame.pixels());
        for (index, &[r, g, b, _]) in frame.radiance.iter().enumerate() {
            let input = [r, g, b].map(|value| if value.is_finite() { value } else { 0.0 });
            let (mut sum, mut length, mut weights) = ([0.0; 3], 0.0, 0.0);
            if let (Some(history), Some((_, radiance, frames))) = (&history, &last)
                && let Some(place) = history.place(index)
            {
                for (tap, weight) in history.taps(place) {
                    weights += weight;
                    length += weight * frames[tap];
                    (0..3).for_each(|c| sum[c] += weight * radiance[tap][c]);
                }
            }
            if weights < 1e-3 {
                result.push(input);
                lengths.push(1.0);
                continue;
            }
            let length = (length / weights + 1.0).min(MAX_HISTORY);
            result.push([0, 1, 2].map(|c| {
                let old = sum[c] / weights;
                old + (input[c] - old) / length
            }));
            lengths.push(length);
        }
        let mut guides = frame.clone();
        // Only depth and camera are looked at.
        (guides.radiance, guides.reference) = (Vec::new(), None);
        self.previous = Some((guides, result.clone(), lengths));
        result
    }
}
