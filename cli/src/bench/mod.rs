//! Error against run time: what `limpid bench` measures and how it is shown.
//!
//! A [`Subject`] is a sequence of frames with references, a [`Variant`] a way to denoise it. [`measure::run_group`]
//! runs variants side by side and gives a [`Run`] each; a [`Report`] holds everything that was found and is what
//! [`page`], [`table`] and [`compare`] work on.

pub mod accumulate;
pub mod compare;
pub mod counts;
pub mod error;
mod figures;
pub mod history;
mod markdown;
pub mod measure;
mod page;
mod plot;
pub mod record;
pub mod scaling;
pub mod subject;
pub mod table;
#[cfg(test)]
mod tests;
pub mod variant;
pub mod yardstick;

pub use figures::figures;
pub use markdown::markdown;
pub use page::page;
pub use record::{Config, Report, Run};
pub use subject::Subject;
pub use variant::Variant;
