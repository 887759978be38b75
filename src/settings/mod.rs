//! Everything that can be chosen: conventions of the caller's data, coverage, and the constants of each pass.

mod conventions;
mod coverage;
mod features;
mod numbers;

use serde::{Deserialize, Serialize};

pub use self::conventions::{Channel, Conventions, DepthEncoding, NdcY, NormalEncoding, RoughnessEncoding};
pub use self::coverage::{Coverage, Fallback, RayList, RaysPerQuad};
pub use self::features::Features;
pub use self::numbers::{Accumulate, Footprint, Number, Prefilter, Reproject, Resolve};
use crate::Error;

/// A named set of settings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Preset {
    /// The recommendation, for surfaces of every roughness.
    Default,
    /// The same with fewer taps, one history and three quarters of the memory, for tight budgets.
    Fast,
    /// The pipeline that AMD published in 2021, with the constants it was published with, for a ray a pixel.
    Reference,
}

impl Preset {
    /// All presets, with the names that the command line uses.
    pub const ALL: &[(&str, Preset)] =
        &[("default", Preset::Default), ("fast", Preset::Fast), ("reference", Preset::Reference)];

    /// The settings that the preset stands for.
    pub fn settings(self) -> Settings {
        match self {
            Preset::Default => Settings::default(),
            Preset::Fast => {
                let mut settings = Settings::default();
                settings.features.near_taps = 4;
                settings.features.young_taps = 7;
                settings.features.wide_taps = 2;
                settings.features.both_histories = false;
                settings.features.block_interpolation = false;
                // Few taps decode what they need in no more time than it takes to store and load it.
                settings.features.packed_guide = false;
                settings
            }
            Preset::Reference => {
                let mut settings = Settings { pipeline: Pipeline::Published, ..Settings::default() };
                // GGX alpha 0.2. Rougher surfaces keep their noise.
                settings.coverage.roughness_threshold = 0.447_213_6;
                settings.coverage.fallback = Fallback::Input;
                settings
            }
        }
    }
}

/// Which passes denoise.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Pipeline {
    /// Accumulates first, then filters over the footprint of the specular lobe: `docs/algorithm.md`.
    #[default]
    Footprint,
    /// As AMD published it in 2021: `docs/reference.md`.
    Published,
}

/// Everything that can be chosen. `Default` is the recommendation.
///
/// Settings can be read from TOML or JSON; whatever is not named keeps its default.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[non_exhaustive]
pub struct Settings {
    /// Encodings of the caller's data.
    pub conventions: Conventions,
    /// Which pixels are denoised.
    pub coverage: Coverage,
    /// Which passes denoise.
    pub pipeline: Pipeline,
    /// What is done at all.
    pub features: Features,
    /// Constants of accumulation.
    pub accumulate: Accumulate,
    /// Sizes of filters.
    pub footprint: Footprint,
    /// Constants of the reproject pass.
    pub reproject: Reproject,
    /// Constants of the prefilter pass.
    pub prefilter: Prefilter,
    /// Constants of the temporal resolve pass.
    pub resolve: Resolve,
}

fn check_range(field: &'static str, value: f32, low: f32, high: f32, expected: &'static str) -> Result<(), Error> {
    // Not a number fails both comparisons.
    if value >= low && value <= high { Ok(()) } else { Err(Error::Setting { field, value, expected }) }
}

impl Settings {
    /// The constants of the passes, with their ranges.
    pub fn numbers() -> impl Iterator<Item = &'static Number> {
        let groups =
            [Accumulate::NUMBERS, Footprint::NUMBERS, Reproject::NUMBERS, Prefilter::NUMBERS, Resolve::NUMBERS];
        groups.into_iter().flatten()
    }

    /// Checks every number against its documented range.
    ///
    /// # Errors
    ///
    /// [`Error::Setting`] for the first one outside.
    pub fn validate(&self) -> Result<(), Error> {
        self.features.validate(self.pipeline)?;
        self.accumulate.validate()?;
        self.footprint.validate()?;
        self.reproject.validate()?;
        self.prefilter.validate()?;
        self.resolve.validate()?;
        self.coverage.validate()?;
        if self.reproject.min_history_cap > self.reproject.max_history {
            return Err(Error::Setting {
                field: "reproject.min_history_cap",
                value: self.reproject.min_history_cap,
                expected: "at most reproject.max_history",
            });
        }
        self.conventions.validate()
    }
}
