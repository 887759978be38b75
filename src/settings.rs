//! Everything that can be chosen: conventions of the caller's data, coverage, and the constants of each pass.

use glam::{Mat3, Vec2};
use serde::{Deserialize, Serialize};

use crate::{DebugView, Error};

/// A named set of settings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Preset {
    /// The recommendation, for surfaces of every roughness.
    Default,
    /// The same with fewer taps and one history, for tight budgets.
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
                settings.features.wide_taps = 2;
                settings.features.both_histories = false;
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

/// How the caller's `depth` is to be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DepthEncoding {
    /// Depth buffer, 0 at the near plane, 1 at the far plane (which may be infinite). 1 is sky.
    #[default]
    Device,
    /// Depth buffer, 1 at the near plane, 0 at the far plane (which may be infinite). 0 is sky.
    ReversedDevice,
    /// Distance along the view direction in world units, positive. 0 or less is sky.
    Linear,
}

/// How the caller's `normal` is to be read. Normals are in world space and need not have unit length.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum NormalEncoding {
    /// `xyz` as they are, from a float or snorm format.
    #[default]
    Signed,
    /// `xyz * 2 - 1`, from a unorm format.
    Unsigned,
    /// Octahedral map in `xy`, -1 to 1.
    Octahedral,
    /// Octahedral map in `xy`, 0 to 1.
    OctahedralUnsigned,
}

/// How the caller's `roughness` is to be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RoughnessEncoding {
    /// Perceptual roughness, the square root of GGX alpha.
    #[default]
    Perceptual,
    /// GGX alpha.
    Alpha,
}

/// Channel of a texture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Channel {
    /// First.
    #[default]
    Red,
    /// Second.
    Green,
    /// Third.
    Blue,
    /// Fourth.
    Alpha,
}

/// Direction of `y` in normalised device coordinates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum NdcY {
    /// Up, as in Direct3D, Metal and WebGPU.
    #[default]
    Up,
    /// Down, as in Vulkan with a viewport of positive height.
    Down,
}

/// How the caller's data is encoded. See the crate documentation for spaces and signs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[non_exhaustive]
pub struct Conventions {
    /// Encoding of `depth`.
    pub depth: DepthEncoding,
    /// Linear depth from which a pixel is sky, in world units, above 0. Only for [`DepthEncoding::Linear`].
    pub sky_distance: f32,
    /// Encoding of `normal`.
    pub normal: NormalEncoding,
    /// Encoding of `roughness`.
    pub roughness: RoughnessEncoding,
    /// Channel of the `roughness` texture that holds it.
    pub roughness_channel: Channel,
    /// Factor from the caller's `motion` to `uv_now - uv_before`, uv with its origin at the top left and `y`
    /// down. `(1, 1)` for exactly that; `(0.5, -0.5)` for `ndc_now - ndc_before`; `(-1, -1)` for vectors that
    /// point to where the surface was; `1 / size` for vectors in pixels.
    pub motion_scale: Vec2,
    /// Whether `motion` contains the difference of the two frames' jitter.
    pub motion_includes_jitter: bool,
    /// Direction of `y` in clip space.
    pub ndc_y: NdcY,
}

impl Default for Conventions {
    fn default() -> Self {
        Self {
            depth: DepthEncoding::default(),
            sky_distance: f32::MAX,
            normal: NormalEncoding::default(),
            roughness: RoughnessEncoding::default(),
            roughness_channel: Channel::default(),
            motion_scale: Vec2::ONE,
            motion_includes_jitter: false,
            ndc_y: NdcY::default(),
        }
    }
}

/// What a pixel holds in the output that is left out: sky, or rougher than the threshold.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Fallback {
    /// No radiance. Tiles that are left out altogether are written in two frames only, and cost nothing after.
    #[default]
    Black,
    /// The noisy input as it is. Where only listed rays are traced, that is whatever the renderer left there.
    Input,
    /// Black in the sky; elsewhere the `environment` input in the mirror direction, blurred by roughness.
    Environment,
}

/// Share of pixels that the renderer traces a ray for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RaysPerQuad {
    /// One ray for each 2x2 pixels.
    One,
    /// Two rays on the diagonal of each 2x2 pixels.
    Two,
    /// A ray for every pixel that is denoised.
    #[default]
    Four,
}

/// The list of rays that the classify pass makes for the renderer.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[non_exhaustive]
pub struct RayList {
    /// Rays in each quad. Mirrors always get one of their own.
    pub rays_per_quad: RaysPerQuad,
    /// Pixels whose variance in the last output was above this, 0 to 1, get a ray of their own.
    /// `None` leaves the check out.
    pub variance_threshold: Option<f32>,
}

/// Which pixels are denoised and what the others get.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[non_exhaustive]
pub struct Coverage {
    /// Roughest surface that is denoised: perceptual roughness, 0 to 1. 1 denoises all; the published value is
    /// 0.4472, GGX alpha 0.2.
    pub roughness_threshold: f32,
    /// Surfaces up to this perceptual roughness, 0 to 1, count as mirrors: their rays hold no noise of the
    /// lobe, so the prefilter leaves them alone.
    pub mirror_roughness: f32,
    /// Output of pixels that are left out.
    pub fallback: Fallback,
    /// Level of the environment map's mip chain at GGX alpha 1, 0 to 16. Only for [`Fallback::Environment`].
    pub environment_mip_scale: f32,
    /// Rotation from world space into the axes of the environment map (equirectangular, `y` up, `-z` at the
    /// centre). Only for [`Fallback::Environment`].
    pub environment_from_world: Mat3,
    /// Makes a list of the rays to trace. `None`: the renderer traces every pixel.
    pub ray_list: Option<RayList>,
}

impl Default for Coverage {
    fn default() -> Self {
        Self {
            roughness_threshold: 1.0,
            mirror_roughness: 0.01,
            fallback: Fallback::default(),
            environment_mip_scale: 9.0,
            environment_from_world: Mat3::IDENTITY,
            ray_list: None,
        }
    }
}

/// A setting that is a number.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Number {
    /// Where in [`Settings`], such as `reproject.max_history`.
    pub path: &'static str,
    /// Default; for constants of the published pipeline the published value.
    pub default: f32,
    /// Smallest value.
    pub low: f32,
    /// Largest value.
    pub high: f32,
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

/// What is done at all. What is off leaves kernels, bindings, passes and memory; `docs/features.md` says what each
/// saves and costs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[non_exhaustive]
pub struct Features {
    /// Looks for history where the reflected point was, as if it lay behind the surface by the hit distance. For
    /// mirror-like and flat surfaces. Without it `radiance` needs no hit distance.
    pub mirror_parallax: bool,
    /// Looks for history where the surface was. For rough and curved surfaces and moving objects. Without it there
    /// is no `motion` input, and no comparison with the neighbourhood's colour.
    pub surface_motion: bool,
    /// Footprint pipeline, with `mirror_parallax` and `surface_motion`: looks for history in both places, and mixes what it
    /// finds by how well it fits. Without it one of them has to do: where the reflected point was for smooth surfaces,
    /// where the surface was for others.
    pub both_histories: bool,
    /// Published pipeline: looks at the 3x3 places around history that does not fit well.
    pub history_search: bool,
    /// Published pipeline: at edges takes those of four texels that show the same surface.
    pub edge_repair: bool,
    /// Filters over space. A scene of mirrors whose reflections hold no noise has nothing to filter. Without it the
    /// published pipeline has no prefilter pass; the other keeps what was accumulated as it is.
    pub spatial_filter: bool,
    /// Clips history to what the neighbourhood makes plausible; in the published pipeline of all surfaces, and new
    /// colour too, else of smooth ones. A scene in which neither light nor objects move has nothing to clip. Without
    /// it what changes leaves trails.
    pub history_clip: bool,
    /// Published pipeline: mixes the 8x8 average into the colour where history is short. Less noise after
    /// disocclusion, less detail.
    pub average_mixing: bool,
    /// Footprint pipeline, with `mirror_parallax`: reads how far what the reflected ray hit has moved, from the input
    /// `hit_motion`, and looks for history of the reflected point there. For mirrors that show moving things.
    pub hit_motion: bool,
    /// Footprint pipeline: forgets history where the light changed.
    pub light_change: bool,
    /// Footprint pipeline: cuts outliers off and adds what was cut off, spread, up to a limit. An input without
    /// fireflies needs none of it.
    pub outlier_spread: bool,
    /// Footprint pipeline: compares history with averages of this frame's input over blocks around the pixel, and takes
    /// hit distances from there where single ones say little. Mirrors, whose samples hold no noise, need none. Only
    /// without `outlier_spread` too is it left out, which needs them.
    pub block_statistics: bool,
    /// Footprint pipeline: filters over blocks where the footprint is wider than a few pixels. A scene of smooth
    /// surfaces has no such footprints.
    pub wide_filter: bool,
    /// Footprint pipeline: pixels that each is filtered with besides, 0 to 64.
    pub near_taps: u32,
    /// Footprint pipeline: most blocks on either side of a block, along and across the footprint, that filters over
    /// blocks read, 1 to 16. What lies between is passed over where footprints are wider.
    pub wide_taps: u32,
    /// Footprint pipeline, with `wide_filter` and `block_statistics`: works on blocks of 4x4 pixels as a whole where
    /// all of a block shows one surface and the footprint is wider than blocks are. A scene of smooth surfaces has no such
    /// blocks.
    pub whole_blocks: bool,
    /// Reads normals from the input `normal`. Without it they are the slope of `depth`, found once: only with
    /// `gbuffer_copy` and `packed_guide`. Normal maps and smooth shading are lost then, and `depth` has to be as precise as
    /// 32 bits are.
    pub normal_input: bool,
    /// Perceptual roughness, 0 to 1, where it is the same everywhere: then there is no `roughness` input.
    pub constant_roughness: Option<f32>,
    /// Keeps what the next frame needs of the G-buffer. Without it the renderer, which double-buffers its own,
    /// supplies last frame's as `prev_normal`, `prev_roughness` and `prev_depth`.
    pub gbuffer_copy: bool,
    /// Decodes the G-buffer once, into 8 bytes a pixel that all other passes read. Without it they decode `normal`,
    /// `roughness` and `depth` themselves. In the published pipeline only together with `gbuffer_copy`, as there the
    /// packed guide is the copy.
    pub packed_guide: bool,
    /// Shows in colours what limpid finds out about each pixel, in one more pass and texture.
    pub debug_view: Option<DebugView>,
}

impl Default for Features {
    fn default() -> Self {
        Self {
            mirror_parallax: true,
            surface_motion: true,
            both_histories: true,
            history_search: true,
            edge_repair: true,
            spatial_filter: true,
            history_clip: true,
            average_mixing: true,
            hit_motion: false,
            light_change: true,
            outlier_spread: true,
            block_statistics: true,
            wide_filter: true,
            near_taps: 12,
            wide_taps: 4,
            whole_blocks: true,
            normal_input: true,
            constant_roughness: None,
            gbuffer_copy: true,
            packed_guide: true,
            debug_view: None,
        }
    }
}

impl Features {
    /// Whether any pass of the published pipeline uses the 8x8 averages.
    pub(crate) fn uses_average(&self) -> bool {
        self.spatial_filter || self.history_clip || self.average_mixing
    }

    /// Whether `classify` packs what it decodes. The published pipeline's copy of the G-buffer is the packed guide.
    pub(crate) fn packs_guide(&self, pipeline: Pipeline) -> bool {
        self.packed_guide || pipeline == Pipeline::Published && self.gbuffer_copy
    }

    /// Whether `accumulate` reads the blocks of the input.
    pub(crate) fn compares_with_blocks(&self) -> bool {
        self.block_statistics || self.outlier_spread
    }

    fn validate(&self, pipeline: Pipeline) -> Result<(), Error> {
        let refuse = |reason| Err(Error::Features { reason });
        if !self.mirror_parallax && !self.surface_motion {
            return refuse("without mirror_parallax and surface_motion there is no history to find");
        }
        let keeps_normals = self.gbuffer_copy && self.packs_guide(pipeline);
        if !self.normal_input && !keeps_normals {
            return refuse(
                "without normal_input normals are found once and kept: gbuffer_copy and packed_guide have to be on",
            );
        }
        if self.debug_view == Some(DebugView::MotionError) && !self.surface_motion {
            return refuse("the debug view motion-error needs motion vectors, which are read with surface_motion only");
        }
        if self.debug_view == Some(DebugView::Average) && pipeline == Pipeline::Published && !self.uses_average() {
            return refuse(
                "the debug view average needs an average: spatial_filter, history_clip or average_mixing has to be on",
            );
        }
        if self.debug_view == Some(DebugView::Average)
            && pipeline == Pipeline::Footprint
            && !self.compares_with_blocks()
        {
            return refuse("the debug view average needs an average: block_statistics or outlier_spread has to be on");
        }
        check_range("features.near_taps", self.near_taps as f32, 0.0, 64.0, "0 to 64")?;
        check_range("features.wide_taps", self.wide_taps as f32, 1.0, 16.0, "1 to 16")?;
        if let Some(roughness) = self.constant_roughness {
            check_range("features.constant_roughness", roughness, 0.0, 1.0, "0 to 1")?;
        }
        Ok(())
    }
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
            const NUMBERS: &[Number] = &[$(Number {
                path: concat!($path, ".", stringify!($field)),
                default: $default,
                low: $low as f32,
                high: $high as f32,
            },)*];

            fn validate(&self) -> Result<(), Error> {
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
    /// Constants of accumulation over time, for [`Pipeline::Footprint`]. Colours are exposed radiance.
    Accumulate in "accumulate" {
        /// Longest history on rough surfaces, in seconds. Between 1 and 31 frames.
        max_history_seconds = 0.5, 0.0 to 10.0;
        /// Longest history on mirrors, in seconds. Between 1 and 31 frames.
        mirror_history_seconds = 0.13, 0.0 to 10.0;
        /// Perceptual roughness below which history is clipped to the 3x3 pixels, and from which on it may be as long
        /// as `max_history_seconds`.
        clip_roughness = 0.15, 0.001 to 1.0;
        /// Half size of what it is clipped to, in deviations of the 3x3 pixels.
        clip_scale = 1.3, 0.0 to 1000.0;
        /// A sample is an outlier beyond so many times the brightest other one of its 4x4 pixels.
        outlier_factor = 6.0, 1.0 to 65504.0;
        /// What was cut off from outliers comes back up to so many times the mean radiance around.
        excess_limit = 8.0, 0.0 to 65504.0;
        /// How long history may be where the surface's motion and the reflected point's lie one footprint apart, in
        /// frames.
        disagreement_limit = 0.25, 0.0 to 1000.0;
        /// Standard errors of brightness by which light has to change for history to be forgotten.
        light_change_sigma = 3.25, 0.1 to 1000.0;
        /// Share of the brightness that it has to change by besides.
        light_change_share = 0.15, 0.0 to 1000.0;
        /// Time constant of the brightness that it is compared with, in seconds.
        light_change_seconds = 0.1, 0.0 to 10.0;
    }
}

numeric_settings! {
    /// Sizes of filters for [`Pipeline::Footprint`], in footprints of the specular lobe: GGX alpha times hit distance,
    /// as the camera sees it.
    Footprint in "footprint" {
        /// Half axis of the filter of what was accumulated.
        filter_scale = 0.65, 0.0 to 10.0;
        /// Half axis over which the excess of outliers is spread.
        excess_scale = 1.0, 0.0 to 10.0;
        /// Least width at grazing angles, as a share of the length. 1 is round, less follows the lobe.
        grazing_width = 0.5, 0.01 to 1.0;
    }
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
        let coverage = &self.coverage;
        let unit = "0 to 1";
        check_range("coverage.roughness_threshold", coverage.roughness_threshold, 0.0, 1.0, unit)?;
        check_range("coverage.mirror_roughness", coverage.mirror_roughness, 0.0, 1.0, unit)?;
        check_range("coverage.environment_mip_scale", coverage.environment_mip_scale, 0.0, 16.0, "0 to 16")?;
        for value in coverage.environment_from_world.to_cols_array() {
            check_range("coverage.environment_from_world", value, -1.001, 1.001, "a rotation")?;
        }
        if let Some(threshold) = coverage.ray_list.as_ref().and_then(|list| list.variance_threshold) {
            check_range("coverage.ray_list.variance_threshold", threshold, 0.0, 1.0, unit)?;
        }
        if self.reproject.min_history_cap > self.reproject.max_history {
            return Err(Error::Setting {
                field: "reproject.min_history_cap",
                value: self.reproject.min_history_cap,
                expected: "at most reproject.max_history",
            });
        }
        let conventions = &self.conventions;
        check_range("conventions.sky_distance", conventions.sky_distance, f32::MIN_POSITIVE, f32::MAX, "above 0")?;
        for scale in conventions.motion_scale.to_array() {
            check_range("conventions.motion_scale", scale, f32::MIN, f32::MAX, "a finite number")?;
        }
        Ok(())
    }
}
