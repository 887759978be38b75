//! What the `limpid` command is made of: sequences on disk, built-in scenes, metrics, pictures, and the
//! backends that denoise.

#![forbid(unsafe_code)]

pub mod analyze;
pub mod backend;
pub mod bench;
pub mod commands;
pub mod cost;
pub mod export;
mod legend;
pub mod metrics;
pub mod picture;
pub mod scene;
pub mod sequence;
pub mod stability;
