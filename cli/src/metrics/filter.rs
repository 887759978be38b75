//! Separable convolution of one image plane; outside the image its edge pixels repeat.

use glam::UVec2;
use rayon::prelude::*;

/// One value per pixel, row by row.
pub(super) struct Plane {
    pub(super) size: UVec2,
    pub(super) values: Vec<f32>,
}

/// A kernel of `2 * radius + 1` weights, symmetric in extent about its middle one.
pub(super) struct Kernel(Vec<f32>);

impl Kernel {
    /// The kernel with weight `f(x)` at distance `x`, -radius to radius pixels. Its positive
    /// weights are scaled to sum to 1, its negative ones, where it has any, to -1.
    pub(super) fn new(radius: i32, f: impl Fn(f64) -> f64) -> Self {
        let weights: Vec<f64> = (-radius..=radius).map(|x| f(f64::from(x))).collect();
        let positive: f64 = weights.iter().filter(|&&w| w > 0.0).sum();
        let negative: f64 = -weights.iter().filter(|&&w| w < 0.0).sum::<f64>();
        let normalise = |w: f64| {
            if w > 0.0 { w / positive } else { w / negative.max(f64::MIN_POSITIVE) }
        };
        Self(weights.into_iter().map(|w| normalise(w) as f32).collect())
    }
}

impl Plane {
    /// Convolved along rows.
    pub(super) fn rows(&self, kernel: &Kernel) -> Plane {
        let width = self.size.x as usize;
        let radius = kernel.0.len() / 2;
        let mut values = vec![0.0; self.values.len()];
        values.par_chunks_exact_mut(width).zip(self.values.par_chunks_exact(width)).for_each_init(
            Vec::new,
            |padded: &mut Vec<f32>, (out, row)| {
                padded.clear();
                padded.resize(radius, row[0]);
                padded.extend_from_slice(row);
                padded.resize(width + 2 * radius, row[width - 1]);
                for (tap, &weight) in kernel.0.iter().enumerate() {
                    accumulate(out, &padded[tap..tap + width], weight);
                }
            },
        );
        Plane { size: self.size, values }
    }

    /// Convolved along columns.
    pub(super) fn columns(&self, kernel: &Kernel) -> Plane {
        let (width, height) = (self.size.x as usize, self.size.y as usize);
        let radius = kernel.0.len() / 2;
        let mut values = vec![0.0; self.values.len()];
        values.par_chunks_exact_mut(width).enumerate().for_each(|(y, out)| {
            for (tap, &weight) in kernel.0.iter().enumerate() {
                let source = (y + tap).saturating_sub(radius).min(height - 1);
                accumulate(out, &self.values[source * width..][..width], weight);
            }
        });
        Plane { size: self.size, values }
    }
}

fn accumulate(out: &mut [f32], source: &[f32], weight: f32) {
    for (o, s) in out.iter_mut().zip(source) {
        *o += weight * s;
    }
}
