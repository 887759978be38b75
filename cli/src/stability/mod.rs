//! Numerical stability: cases that try to break the denoiser, and verdicts by criteria.
//!
//! A [`Case`] is settings, a camera and a function from frame and pixel to what the images hold there. [`library`]
//! has all of them, [`run::run_case`] carries one out on a backend and judges every [`Criterion`].

mod case;
mod extremes;
pub mod figure;
mod geometry;
mod known;
pub mod library;
pub mod probe;
mod report;
pub mod run;
#[cfg(test)]
mod tests;
mod time;

pub use case::{Case, Criterion, Paint, Pixel, Step};
pub use report::{Report, Verdict, Worst};
