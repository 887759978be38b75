//! How far a denoised sequence is from its reference.
//!
//! A [`Scorer`] compares one frame after the other and gives a [`FrameScore`] each; [`mean`] and
//! [`late`] sum a sequence up, [`table`] prints it. Every metric is taken on exposed radiance
//! (`x * exposure`) over the surface pixels of the frame: sky (depth 0) never counts.

mod colour;
mod filter;
mod flip;
mod score;
mod summary;
#[cfg(test)]
mod tests;

pub use flip::flip;
pub use score::{FrameScore, Metrics, Scorer};
pub use summary::{late, mean, table};

/// Radiance to display-referred brightness: `x / (1 + x)`, 0 to 1 for radiance 0 to infinity.
pub fn tone_map(x: f64) -> f64 {
    x / (1.0 + x)
}

/// Linear light to the sRGB transfer curve, both 0 to 1.
pub fn srgb_encode(x: f64) -> f64 {
    if x < 0.003_130_8 { x * 12.92 } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 }
}
