//! The score of one frame.

use serde::Serialize;

use super::{flip, srgb_encode, tone_map};
use crate::sequence::Frame;

/// The largest finite half float, taken for an output of +infinity.
const HALF_MAX: f64 = 65504.0;

/// How one frame, or a sequence on average, differs from its reference.
///
/// "Tone-mapped" is `x / (1 + x)`. All but `non_finite` skip sky pixels.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Metrics {
    /// PSNR of the tone-mapped images in dB, peak 1; 120 for equal images.
    pub psnr: f64,
    /// PSNR of exposed radiance in dB, peak 1; 120 for equal images. A few fireflies decide it.
    pub psnr_linear: f64,
    /// Relative mean squared error of exposed radiance: mean of `(a - b)^2 / (b^2 + 0.01)`.
    pub relmse: f64,
    /// The same of the tone-mapped images.
    pub relmse_tone_mapped: f64,
    /// Mean LDR-FLIP of the tone-mapped, sRGB-encoded images, 0 to 1.
    pub flip: f64,
    /// Mean radiance over the reference's: 1 is unbiased, below 1 too dark.
    pub energy: f64,
    /// Mean signed tone-mapped error: 0 is unbiased, below 0 too dark.
    pub bias: f64,
    /// Mean change of a pixel's tone-mapped error since the previous frame, 0 is steady. `None`
    /// where there is no previous frame to compare with: at the start and at a reset.
    pub flicker: Option<f64>,
    /// Output values that are NaN or infinite, over the whole image. They are scored as 0 (NaN and
    /// -infinity) and 65504 (+infinity).
    pub non_finite: usize,
}

/// The score of one frame.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FrameScore {
    /// The frame's number in its sequence.
    pub frame: u32,
    /// Whether the frame had no history to use.
    pub reset: bool,
    /// Pixels compared: those that are not sky. With none every metric is NaN.
    pub surface_pixels: usize,
    /// The scores.
    #[serde(flatten)]
    pub metrics: Metrics,
}

/// Scores the frames of a sequence, one after the other.
#[derive(Clone, Debug)]
pub struct Scorer {
    exposure: f64,
    previous: Option<Errors>,
}

/// Signed tone-mapped error of a frame and where it is defined.
#[derive(Clone, Debug)]
struct Errors {
    error: Vec<[f32; 3]>,
    surface: Vec<bool>,
}

impl Scorer {
    /// A scorer for a sequence viewed at `exposure`, a factor on radiance.
    pub fn new(exposure: f32) -> Self {
        Self { exposure: f64::from(exposure), previous: None }
    }

    /// Compares linear radiance `denoised` with `frame.reference`.
    ///
    /// # Panics
    /// When the frame has no reference, or the images or depths are not of the frame's size.
    pub fn score(&mut self, denoised: &[[f32; 3]], frame: &Frame) -> FrameScore {
        let reference = frame.reference.as_deref().expect("a scored frame has a reference");
        let pixels = frame.pixels();
        assert!(
            denoised.len() == pixels && reference.len() == pixels && frame.depth.len() == pixels,
            "image sizes must agree"
        );
        let surface: Vec<bool> = frame.depth.iter().map(|&z| z != 0.0).collect();
        let mut sums = Sums::default();
        let mut error = vec![[0.0; 3]; pixels];
        let mut shown = [vec![[0.0; 3]; pixels], vec![[0.0; 3]; pixels]];
        for i in (0..pixels).filter(|&i| surface[i]) {
            for c in 0..3 {
                let a = usable(denoised[i][c]) * self.exposure;
                let b = f64::from(reference[i][c]) * self.exposure;
                sums.add(a, b);
                error[i][c] = (tone_map(a) - tone_map(b)) as f32;
                shown[0][i][c] = srgb_encode(tone_map(b)).clamp(0.0, 1.0) as f32;
                shown[1][i][c] = srgb_encode(tone_map(a)).clamp(0.0, 1.0) as f32;
            }
        }
        let flip = flip(&shown[0], &shown[1], frame.size);
        let flip = mean_where(&surface, |i| f64::from(flip[i]));
        let previous = self.previous.take().filter(|_| !frame.reset);
        let current = Errors { error, surface };
        let flicker = previous.and_then(|previous| current.change_since(&previous));
        let surface_pixels = current.surface.iter().filter(|&&s| s).count();
        self.previous = Some(current);

        let n = 3.0 * surface_pixels as f64;
        FrameScore {
            frame: frame.number,
            reset: frame.reset,
            surface_pixels,
            metrics: Metrics {
                psnr: psnr(sums.tone_mapped_square / n),
                psnr_linear: psnr(sums.square / n),
                relmse: sums.relative / n,
                relmse_tone_mapped: sums.tone_mapped_relative / n,
                flip: flip.unwrap_or(f64::NAN),
                energy: (sums.a / n) / at_least(sums.b / n, 1e-12),
                bias: sums.signed / n,
                flicker,
                non_finite: denoised.iter().flatten().filter(|x| !x.is_finite()).count(),
            },
        }
    }
}

impl Errors {
    fn change_since(&self, previous: &Errors) -> Option<f64> {
        if previous.error.len() != self.error.len() {
            return None;
        }
        let both: Vec<bool> = self.surface.iter().zip(&previous.surface).map(|(a, b)| *a && *b).collect();
        mean_where(&both, |i| {
            let change = |c| f64::from(self.error[i][c] - previous.error[i][c]).abs();
            (change(0) + change(1) + change(2)) / 3.0
        })
    }
}

/// Sums over the values of a frame, `a` the output and `b` the reference.
#[derive(Default)]
struct Sums {
    a: f64,
    b: f64,
    square: f64,
    relative: f64,
    signed: f64,
    tone_mapped_square: f64,
    tone_mapped_relative: f64,
}

impl Sums {
    fn add(&mut self, a: f64, b: f64) {
        let (ta, tb) = (tone_map(a), tone_map(b));
        let (square, tone_mapped) = ((a - b).powi(2), (ta - tb).powi(2));
        self.a += a;
        self.b += b;
        self.square += square;
        self.relative += square / (b * b + 1e-2);
        self.signed += ta - tb;
        self.tone_mapped_square += tone_mapped;
        self.tone_mapped_relative += tone_mapped / (tb * tb + 1e-2);
    }
}

/// An output value as it is scored: finite and not negative.
fn usable(x: f32) -> f64 {
    match f64::from(x) {
        f64::INFINITY => HALF_MAX,
        x => x.max(0.0), // NaN too
    }
}

fn psnr(mean_square: f64) -> f64 {
    -10.0 * at_least(mean_square, 1e-12).log10()
}

/// `f64::max` that keeps NaN.
fn at_least(x: f64, low: f64) -> f64 {
    if x < low { low } else { x }
}

fn mean_where(mask: &[bool], value: impl Fn(usize) -> f64) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0usize);
    for i in (0..mask.len()).filter(|&i| mask[i]) {
        sum += value(i);
        count += 1;
    }
    (count > 0).then(|| sum / count as f64)
}
