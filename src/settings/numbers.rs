//! The constants of each pass, with their ranges.

use serde::{Deserialize, Serialize};

use super::check_range;
use crate::Error;

/// A setting that is a number.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Number {
    /// Where in [`Settings`](super::Settings), such as `reproject.max_history`.
    pub path: &'static str,
    /// Default; for constants of the published pipeline the published value.
    pub default: f32,
    /// Smallest value.
    pub low: f32,
    /// Largest value.
    pub high: f32,
}

/// Declares a group of numeric settings: documentation, name, default, range.
macro_rules! numeric_settings {
    ($(#[$outer:meta])* $group:ident in $path:literal {
        $($(#[$doc:meta])* $field:ident = $default:literal, $low:literal to $high:literal;)*
    }) => {
        $(#[$outer])*
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
        #[serde(default, deny_unknown_fields)]
        #[non_exhaustive]
        pub struct $group {
            $($(#[$doc])*
            #[doc = concat!("\n\nRange ", $low, " to ", $high, ", default ", $default, ".")]
            pub $field: f32,)*
        }

        impl Default for $group {
            fn default() -> Self {
                Self { $($field: $default,)* }
            }
        }

        impl $group {
            pub(super) const NUMBERS: &[Number] = &[$(Number {
                path: concat!($path, ".", stringify!($field)),
                default: $default,
                low: $low as f32,
                high: $high as f32,
            },)*];

            pub(super) fn validate(&self) -> Result<(), Error> {
                $(check_range(concat!($path, ".", stringify!($field)), self.$field, $low, $high,
                    concat!($low, " to ", $high))?;)*
                Ok(())
            }
        }
    };
}

numeric_settings! {
    /// Constants of the reproject pass. Colours are exposed radiance.
    Reproject in "reproject" {
        /// How fast the Gaussian of the 9x9 neighbourhood falls: the weight at `i` pixels is
        /// `exp(-falloff * i * i / 25)`.
        neighborhood_falloff = 3.0, 0.0 to 100.0;
        /// Cosine between a pixel's normal and last frame's normal at its mirror-parallax position from which
        /// that position may be taken.
        parallax_normal_cosine = 0.9999, -1.0 to 1.0;
        /// By how much that cosine may be below the one at the surface-motion position.
        parallax_normal_margin = 0.001, 0.0 to 2.0;
        /// By how much GGX alpha may fit worse there than at the surface-motion position.
        parallax_roughness_margin = 0.001, 0.0 to 1.0;
        /// Squared distance of surface-motion history to the neighbourhood's mean, as a multiple of the
        /// length of its variance, from which that history is dropped.
        surface_color_gate = 1.5, 0.0 to 10000.0;
        /// How much one minus the cosine between normals lowers the trust in history, as an exponent.
        disocclusion_normal_falloff = 1.4, 0.0 to 1000.0;
        /// How much relative difference of depth lowers the trust in history, as an exponent.
        disocclusion_depth_falloff = 1.0, 0.0 to 1000.0;
        /// Trust, 0 to 1, below which there is no history. At 1 rounding rejects static pixels.
        disocclusion_threshold = 0.9, 0.0 to 1.0;
        /// The same for single texels at edges, as a fraction of the threshold.
        disocclusion_tap_fraction = 0.5, 0.0 to 1.0;
        /// Longest history on rough surfaces, in frames. Stored in steps of `1 / floor(255 / max_history)`.
        max_history = 32.0, 1.0 to 255.0;
        /// Longest history on mirrors, in frames, not above `max_history`.
        min_history_cap = 8.0, 1.0 to 255.0;
        /// How fast the longest history grows with GGX alpha, as an exponent.
        history_roughness_falloff = 100.0, 0.0 to 100000.0;
        /// Luminance below which differences count as absolute, not relative.
        variance_luminance_floor = 0.5, 0.000001 to 65504.0;
        /// Share of history in the 8x8 average.
        average_history_blend = 0.3, 0.0 to 1.0;
        /// How much luminance lowers a pixel's weight in the 8x8 average, as an exponent. Above 0 it darkens.
        average_luminance_falloff = 0.3, 0.0 to 1000.0;
        /// Smallest weight in the 8x8 average.
        average_weight_floor = 0.01, 0.000001 to 1.0;
    }
}

numeric_settings! {
    /// Constants of the prefilter pass.
    Prefilter in "prefilter" {
        /// How much distance to the 8x8 average lowers a tap's weight, as an exponent. Above 0 it darkens.
        radiance_falloff = 0.6, 0.0 to 1000.0;
        /// What a variance of 1 adds to that.
        radiance_variance_falloff = 0.1, 0.0 to 1000.0;
        /// Smallest weight by radiance.
        radiance_weight_floor = 0.01, 0.000001 to 1.0;
        /// Power of the cosine between normals.
        normal_power = 512.0, 0.0 to 65536.0;
        /// How much depth difference times depth lowers a tap's weight, as an exponent, per square world unit
        /// (tuned for metres).
        depth_falloff = 4.0, 0.0 to 1000000000000.0;
        /// How fast the weight of neighbours grows with a pixel's variance, as an exponent.
        variance_falloff = 4.4, 0.0 to 1000.0;
        /// Smallest weight of neighbours by variance.
        variance_weight_floor = 0.1, 0.0 to 1.0;
    }
}

numeric_settings! {
    /// Constants of the temporal resolve pass.
    Resolve in "resolve" {
        /// Size of the box that history and, around the 8x8 average, the new colour are clipped to: 0 is
        /// responsive, 1 stable and slow.
        stability = 0.7, 0.0 to 1.0;
        /// Factor on that size.
        clip_scale = 1.4, 0.0 to 1000.0;
        /// How far the box moves from the neighbourhood's mean to the 8x8 average.
        clip_average_pull = 0.2, 0.0 to 1.0;
        /// Added to the half size of the box, in exposed radiance.
        clip_extent_floor = 0.001, 0.000001 to 65504.0;
    }
}

numeric_settings! {
    /// Constants of accumulation over time, for [`Pipeline::Footprint`](super::Pipeline::Footprint). Colours are exposed radiance.
    Accumulate in "accumulate" {
        /// Longest history on rough surfaces, in seconds. Between 1 and 31 frames.
        max_history_seconds = 0.5, 0.0 to 10.0;
        /// Longest history on mirrors, in seconds. Between 1 and 31 frames.
        mirror_history_seconds = 0.13, 0.0 to 10.0;
        /// Perceptual roughness below which history is clipped to the pixels around, and from which on it may be as long
        /// as `max_history_seconds`.
        clip_roughness = 0.15, 0.001 to 1.0;
        /// Half size of what it is clipped to, in deviations of the pixels around.
        clip_scale = 1.3, 0.0 to 1000.0;
        /// A sample is an outlier beyond so many times the brightest other one of its 4x4 pixels.
        outlier_factor = 6.0, 1.0 to 65504.0;
        /// What was cut off from outliers comes back up to so many times the mean radiance around.
        excess_limit = 7.0, 0.0 to 65504.0;
        /// How long history may be where the surface's motion and the reflected point's lie one footprint apart, in
        /// frames.
        disagreement_limit = 0.2, 0.0 to 1000.0;
        /// Standard errors of brightness by which light has to change for history to be forgotten.
        light_change_sigma = 3.25, 0.1 to 1000.0;
        /// Share of the brightness that it has to change by besides.
        light_change_share = 0.15, 0.0 to 1000.0;
        /// Time constant of the brightness that it is compared with, in seconds.
        light_change_seconds = 0.1, 0.0 to 10.0;
    }
}

numeric_settings! {
    /// Sizes of filters for [`Pipeline::Footprint`](super::Pipeline::Footprint), in footprints of the specular lobe: GGX alpha times hit distance,
    /// as the camera sees it.
    Footprint in "footprint" {
        /// Half axis of the filter of what was accumulated.
        filter_scale = 0.65, 0.0 to 10.0;
        /// Half axis over which the excess of outliers is spread.
        excess_scale = 0.85, 0.0 to 10.0;
        /// Least width at grazing angles, as a share of the length. 1 is round, less follows the lobe.
        grazing_width = 0.5, 0.01 to 1.0;
    }
}
