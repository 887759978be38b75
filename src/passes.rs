//! What a plan is made of: every pass and resource that a pipeline can have, and which resource each binding is.

use crate::plan::Stage;
use crate::resource::Copy::{self, Current, Previous};
use crate::resource::{Count, Extent, Format, Kind, Lifetime, Resource};
use crate::settings::{
    Channel, Fallback, Features, NormalEncoding, Pipeline, RaysPerQuad, RoughnessEncoding, Settings,
};

/// The denoised image, in templates: see [`resource_of`].
const OUTPUT: &str = "output";
/// Last frame's, before this frame writes anything.
const LAST_OUTPUT: &str = "last output";

/// Where a pipeline keeps what templates call by a name.
pub(crate) fn resource_of(pipeline: Pipeline, name: &'static str, copy: Copy) -> (&'static str, Copy) {
    match (pipeline, name) {
        (Pipeline::Published, LAST_OUTPUT) => (OUTPUT, Current),
        // Once a frame's history has been read the denoised image takes its place.
        (Pipeline::Footprint, OUTPUT) => ("history", Previous),
        (Pipeline::Footprint, LAST_OUTPUT) => ("history", Current),
        _ => (name, copy),
    }
}

/// Name of the texture that holds the debug view.
pub(crate) const DEBUG_VIEW: &str = "debug_view";

/// Averages over blocks of pixels, of which there are two.
pub(crate) const BLOCKS: &str = "blocks";
pub(crate) const OTHER_BLOCKS: &str = "other_blocks";
/// Those that the next pass over blocks writes, in templates of passes that write a part of them ahead.
pub(crate) const NEXT_BLOCKS: &str = "next blocks";

/// Variable of the denoised image in the kernels that write it.
pub(crate) const OUTPUT_VARIABLE: &str = "out_output";

/// What the caller reads besides the denoised image: the debug view, and the ray list with its length.
pub(crate) const EXPORTED: &[&str] = &[DEBUG_VIEW, "rays", "args"];

/// What variables are that several kernels share.
pub(crate) const SHARED_BINDINGS: &[(&str, &str, Copy)] = &[
    ("frame", "frame", Current),
    ("in_normal", "normal", Current),
    ("in_roughness", "roughness", Current),
    ("in_depth", "depth", Current),
    ("in_prev_normal", "prev_normal", Current),
    ("in_prev_roughness", "prev_roughness", Current),
    ("in_prev_depth", "prev_depth", Current),
    ("in_guide", "guide", Current),
];

/// Overrides of `kernels/shared/gbuffer.wgsl`.
pub(crate) const GBUFFER_OVERRIDES: &[&str] = &[
    "NORMAL_ENCODING",
    "ROUGHNESS_CHANNEL",
    "ROUGHNESS_IS_ALPHA",
    "ROUGHNESS_IS_CONSTANT",
    "GUIDE_IS_PACKED",
    "GBUFFER_IS_COPIED",
    "NORMAL_IS_INPUT",
];

/// A pass before it is known which of its bindings the specialised kernel keeps.
pub(crate) struct PassTemplate {
    pub(crate) name: &'static str,
    pub(crate) kernel: &'static str,
    pub(crate) is_needed: fn(&Settings) -> bool,
    pub(crate) stage: Stage,
    pub(crate) grid: GridTemplate,
    pub(crate) overrides: &'static [&'static str],
    pub(crate) bindings: &'static [(&'static str, &'static str, Copy)],
}

pub(crate) enum GridTemplate {
    One,
    /// A workgroup for each square of so many tiles a side.
    Tiles(u32),
    /// A list of `args`.
    List(u64),
    /// The list of tiles, by quad of 2x2 pixels; where there are lists of blocks, those of them that are not whole.
    Quads,
    /// The list of tiles, by block; where there are lists of blocks, those of them that are not whole.
    OtherBlocks,
    /// A list of `block_args`.
    Blocks(u64),
}

/// Gives tiles without work their fallback value, in both pipelines.
const FILL: PassTemplate = PassTemplate {
    name: "fill",
    kernel: "fill",
    is_needed: always,
    stage: Stage::Denoise,
    grid: GridTemplate::List(1),
    overrides: &["FALLBACK", "PREV_GUIDE_IS_KEPT", "GUIDE_IS_CLEARED"],
    bindings: &[
        ("in_radiance", "radiance", Current),
        ("in_environment", "environment", Current),
        ("in_tiles", "tiles", Current),
        ("in_args", "args", Current),
        ("out_guide", "guide", Current),
        ("out_prev_guide", "prev_guide", Current),
        ("out_output", OUTPUT, Current),
    ],
};

/// The published pipeline. `signal` holds reprojected history this frame (`Current`); last frame's copy is
/// read for the history length and then holds the prefiltered radiance. `output` is history until it is
/// written.
const PASSES: &[PassTemplate] = &[
    PassTemplate {
        name: "classify",
        kernel: "classify",
        is_needed: always,
        stage: Stage::Classify,
        grid: GridTemplate::Tiles(4),
        overrides: &["RAYS_PER_QUAD", "RAYS_FOLLOW_VARIANCE", "GUIDE_IS_COMPLETE"],
        bindings: &[
            ("in_history", LAST_OUTPUT, Current),
            ("out_guide", "guide", Current),
            ("inout_idle_frames", "idle_frames", Current),
            ("out_rays", "rays", Current),
            ("out_counters", "counters", Current),
        ],
    },
    PassTemplate {
        name: "list_tiles",
        kernel: "list_tiles",
        is_needed: always,
        stage: Stage::Classify,
        grid: GridTemplate::Tiles(8),
        overrides: &["AVERAGE_IS_USED", "BLOCKS_ARE_USED", "LIGHT_CHANGE", "FALLBACK_IS_BLACK"],
        bindings: &[
            ("in_idle_frames", "idle_frames", Current),
            ("out_tiles", "tiles", Current),
            ("inout_counters", "counters", Current),
            ("out_average", "average", Current),
            ("out_blocks", BLOCKS, Current),
            ("out_other_blocks", OTHER_BLOCKS, Current),
            ("out_light", "light", Current),
        ],
    },
    PassTemplate {
        name: "indirect_args",
        kernel: "indirect_args",
        is_needed: always,
        stage: Stage::Classify,
        grid: GridTemplate::One,
        overrides: &[],
        bindings: &[("inout_counters", "counters", Current), ("out_args", "args", Current)],
    },
    PassTemplate {
        name: "reproject",
        kernel: "reproject",
        is_needed: always,
        stage: Stage::Denoise,
        grid: GridTemplate::List(0),
        overrides: &["MIRROR_PARALLAX", "SURFACE_MOTION", "HISTORY_SEARCH", "EDGE_REPAIR", "AVERAGE_IS_USED"],
        bindings: &[
            ("in_radiance", "radiance", Current),
            ("in_motion", "motion", Current),
            ("in_prev_guide", "guide", Previous),
            ("in_history", OUTPUT, Current),
            ("in_prev_signal", "signal", Previous),
            ("in_tiles", "tiles", Current),
            ("in_args", "args", Current),
            ("out_reprojected", "signal", Current),
            ("out_average", "average", Current),
        ],
    },
    // While last frame's textures are what `reproject` saw.
    PassTemplate {
        name: DEBUG_VIEW,
        kernel: "debug_view_published",
        is_needed: has_debug_view,
        stage: Stage::Denoise,
        grid: GridTemplate::Tiles(1),
        overrides: &["VIEW", "MIRROR_PARALLAX", "SURFACE_MOTION", "HISTORY_SEARCH", "EDGE_REPAIR"],
        bindings: &[
            ("in_radiance", "radiance", Current),
            ("in_motion", "motion", Current),
            ("in_prev_guide", "guide", Previous),
            ("in_history", OUTPUT, Current),
            ("in_reprojected", "signal", Current),
            ("in_average", "average", Current),
            ("out_debug_view", DEBUG_VIEW, Current),
        ],
    },
    PassTemplate {
        name: "prefilter",
        kernel: "prefilter",
        is_needed: |settings| settings.features.spatial_filter,
        stage: Stage::Denoise,
        grid: GridTemplate::List(0),
        overrides: &[],
        bindings: &[
            ("in_radiance", "radiance", Current),
            ("in_reprojected", "signal", Current),
            ("in_average", "average", Current),
            ("in_tiles", "tiles", Current),
            ("in_args", "args", Current),
            ("out_prefiltered", "signal", Previous),
        ],
    },
    FILL,
    PassTemplate {
        name: "resolve_temporal",
        kernel: "resolve_temporal",
        is_needed: always,
        stage: Stage::Denoise,
        grid: GridTemplate::List(0),
        overrides: &["FALLBACK", "SPATIAL_FILTER", "HISTORY_CLIP", "AVERAGE_MIXING", "AVERAGE_IS_READ"],
        bindings: &[
            ("in_radiance", "radiance", Current),
            ("in_environment", "environment", Current),
            ("in_reprojected", "signal", Current),
            ("in_prefiltered", "signal", Previous),
            ("in_average", "average", Current),
            ("in_tiles", "tiles", Current),
            ("in_args", "args", Current),
            ("out_output", OUTPUT, Current),
        ],
    },
];

const ACCUMULATE_BINDINGS: &[(&str, &str, Copy)] = &[
    ("in_radiance", "radiance", Current),
    ("in_motion", "motion", Current),
    ("in_hit_motion", "hit_motion", Current),
    ("in_prev_guide", "prev_guide", Current),
    ("in_history", "history", Previous),
    ("in_blocks", BLOCKS, Current),
    ("in_samples", "samples", Current),
    ("in_light", "light", Current),
    ("in_tiles", "tiles", Current),
    ("in_args", "args", Current),
    ("in_block_list", "block_list", Current),
    ("in_block_args", "block_args", Current),
    ("out_history", "history", Current),
    ("out_blocks", NEXT_BLOCKS, Current),
];

const LOBE_FILTER_BINDINGS: &[(&str, &str, Copy)] = &[
    ("in_radiance", "radiance", Current),
    ("in_environment", "environment", Current),
    ("in_history", "history", Current),
    ("in_blocks", BLOCKS, Current),
    ("in_tiles", "tiles", Current),
    ("in_args", "args", Current),
    ("in_block_list", "block_list", Current),
    ("in_block_args", "block_args", Current),
    ("out_prev_guide", "prev_guide", Current),
    ("out_output", OUTPUT, Current),
];

/// Accumulates first, filters over the lobe's footprint after. Follows the first three of `PASSES`. Passes over blocks
/// read the `blocks` that the last such pass wrote and write the other ones.
const FOOTPRINT_PASSES: &[PassTemplate] = &[
    PassTemplate {
        name: "block_average",
        kernel: "block_average",
        is_needed: has_blocks,
        stage: Stage::Denoise,
        grid: GridTemplate::List(3),
        overrides: &["OUTLIER_SPREAD", "SAMPLES_ARE_USED", "WHOLE_BLOCKS"],
        bindings: &[
            ("in_radiance", "radiance", Current),
            ("in_tiles", "tiles", Current),
            ("in_args", "args", Current),
            ("out_blocks", BLOCKS, Current),
            ("out_samples", "samples", Current),
        ],
    },
    PassTemplate {
        name: "block_statistics",
        kernel: "block_statistics",
        is_needed: has_block_statistics,
        stage: Stage::Denoise,
        grid: GridTemplate::List(3),
        overrides: &["LIGHT_CHANGE", "SURFACE_MOTION"],
        bindings: &[
            ("in_motion", "motion", Current),
            ("in_blocks", BLOCKS, Current),
            ("in_samples", "samples", Current),
            ("in_prev_light", "light", Previous),
            ("in_tiles", "tiles", Current),
            ("in_args", "args", Current),
            ("out_blocks", BLOCKS, Current),
            ("out_light", "light", Current),
        ],
    },
    PassTemplate {
        name: "list_blocks",
        kernel: "list_blocks",
        is_needed: has_whole_blocks,
        stage: Stage::Denoise,
        grid: GridTemplate::List(3),
        overrides: &[],
        bindings: &[
            ("in_blocks", BLOCKS, Current),
            ("in_tiles", "tiles", Current),
            ("in_args", "args", Current),
            ("inout_block_counters", "block_counters", Current),
            ("out_block_list", "block_list", Current),
        ],
    },
    // While `block_spread` runs.
    PassTemplate {
        name: "block_args",
        kernel: "block_args",
        is_needed: has_whole_blocks,
        stage: Stage::Denoise,
        grid: GridTemplate::One,
        overrides: &[],
        bindings: &[("inout_block_counters", "block_counters", Current), ("out_block_args", "block_args", Current)],
    },
    PassTemplate {
        name: "block_spread",
        kernel: "block_spread",
        is_needed: |settings| settings.features.outlier_spread,
        stage: Stage::Denoise,
        grid: GridTemplate::List(3),
        overrides: &["WIDE_TAPS"],
        bindings: &[
            ("in_blocks", BLOCKS, Current),
            ("in_tiles", "tiles", Current),
            ("in_args", "args", Current),
            ("out_blocks", BLOCKS, Current),
        ],
    },
    PassTemplate {
        name: "accumulate",
        kernel: "accumulate",
        is_needed: always,
        stage: Stage::Denoise,
        grid: GridTemplate::Quads,
        overrides: &[
            "MIRROR_PARALLAX",
            "SURFACE_MOTION",
            "BOTH_HISTORIES",
            "HIT_MOTION",
            "HISTORY_CLIP",
            "LIGHT_CHANGE",
            "OUTLIER_SPREAD",
            "BLOCK_STATISTICS",
            "BLOCK_TAPS",
            "WHOLE_BLOCKS",
        ],
        bindings: ACCUMULATE_BINDINGS,
    },
    PassTemplate {
        name: "accumulate_blocks",
        kernel: "accumulate_blocks",
        is_needed: has_whole_blocks,
        stage: Stage::Denoise,
        grid: GridTemplate::Blocks(2),
        overrides: &[
            "MIRROR_PARALLAX",
            "SURFACE_MOTION",
            "BOTH_HISTORIES",
            "HIT_MOTION",
            "LIGHT_CHANGE",
            "OUTLIER_SPREAD",
            "BLOCK_TAPS",
        ],
        bindings: ACCUMULATE_BINDINGS,
    },
    // While last frame's textures and the blocks are what `accumulate` saw.
    PassTemplate {
        name: DEBUG_VIEW,
        kernel: "debug_view",
        is_needed: has_debug_view,
        stage: Stage::Denoise,
        grid: GridTemplate::Tiles(1),
        overrides: &[
            "VIEW",
            "MIRROR_PARALLAX",
            "SURFACE_MOTION",
            "BOTH_HISTORIES",
            "HIT_MOTION",
            "OUTLIER_SPREAD",
            "BLOCK_STATISTICS",
            "BLOCK_TAPS",
            "WHOLE_BLOCKS",
        ],
        bindings: &[
            ("in_radiance", "radiance", Current),
            ("in_motion", "motion", Current),
            ("in_hit_motion", "hit_motion", Current),
            ("in_prev_guide", "prev_guide", Current),
            ("in_history", "history", Previous),
            ("in_blocks", BLOCKS, Current),
            ("in_samples", "samples", Current),
            ("in_accumulated", "history", Current),
            ("in_idle_frames", "idle_frames", Current),
            ("out_debug_view", DEBUG_VIEW, Current),
        ],
    },
    PassTemplate {
        name: "block_average_accumulated",
        kernel: "block_average_accumulated",
        is_needed: has_wide_filter,
        stage: Stage::Denoise,
        grid: GridTemplate::OtherBlocks,
        overrides: &["WHOLE_BLOCKS"],
        bindings: &[
            ("in_history", "history", Current),
            ("in_blocks", BLOCKS, Current),
            ("in_samples", "samples", Current),
            ("in_tiles", "tiles", Current),
            ("in_args", "args", Current),
            ("in_block_list", "block_list", Current),
            ("in_block_args", "block_args", Current),
            ("out_blocks", BLOCKS, Current),
        ],
    },
    PassTemplate {
        name: "block_spread_accumulated",
        kernel: "block_spread",
        is_needed: has_wide_filter,
        stage: Stage::Denoise,
        grid: GridTemplate::List(3),
        overrides: &["ACCUMULATED", "WIDE_TAPS"],
        bindings: &[
            ("in_blocks", BLOCKS, Current),
            ("in_tiles", "tiles", Current),
            ("in_args", "args", Current),
            ("out_blocks", BLOCKS, Current),
        ],
    },
    FILL,
    PassTemplate {
        name: "lobe_filter",
        kernel: "lobe_filter",
        is_needed: always,
        stage: Stage::Denoise,
        grid: GridTemplate::Quads,
        overrides: &["FALLBACK", "NEAR_TAPS", "YOUNG_TAPS", "WIDE_FILTER", "WHOLE_BLOCKS"],
        bindings: LOBE_FILTER_BINDINGS,
    },
    PassTemplate {
        name: "lobe_filter_blocks",
        kernel: "lobe_filter_blocks",
        is_needed: has_whole_blocks,
        stage: Stage::Denoise,
        grid: GridTemplate::Blocks(1),
        overrides: &[],
        bindings: LOBE_FILTER_BINDINGS,
    },
];

/// The passes that a pipeline can have, in the order of execution.
pub(crate) fn templates(pipeline: Pipeline) -> Vec<&'static PassTemplate> {
    match pipeline {
        Pipeline::Published => PASSES.iter().collect(),
        Pipeline::Footprint => PASSES[..3].iter().chain(FOOTPRINT_PASSES).collect(),
    }
}

fn always(_: &Settings) -> bool {
    true
}

/// Whether a pass uses blocks.
fn has_blocks(settings: &Settings) -> bool {
    has_block_statistics(settings) || has_wide_filter(settings)
}

/// Whether a pass uses averages of the input over blocks.
fn has_block_statistics(settings: &Settings) -> bool {
    settings.features.compares_with_blocks() || settings.features.light_change
}

fn near_taps(features: &Features) -> u32 {
    if features.spatial_filter { features.near_taps } else { 0 }
}

fn has_wide_filter(settings: &Settings) -> bool {
    settings.features.spatial_filter && settings.features.wide_filter
}

/// Whether blocks that show one rough surface are worked on as a whole.
pub(crate) fn has_whole_blocks(settings: &Settings) -> bool {
    let features = &settings.features;
    features.whole_blocks && features.compares_with_blocks() && has_wide_filter(settings)
}

fn has_debug_view(settings: &Settings) -> bool {
    settings.features.debug_view.is_some()
}

/// The published pipeline's copy of the G-buffer is the packed guide.
fn is_guide_packed(settings: &Settings) -> bool {
    settings.features.packs_guide(settings.pipeline)
}

/// The published pipeline looks at last frame's surfaces, denoised or not.
fn is_guide_complete(settings: &Settings) -> bool {
    settings.pipeline == Pipeline::Published || settings.coverage.fallback == Fallback::Environment
}

/// All resources that passes can name.
pub(crate) fn all_resources() -> Vec<Resource> {
    let resource = |name: &str, kind, lifetime, ping_pong| Resource {
        name: name.to_owned(),
        kind,
        lifetime,
        ping_pong,
        exported: false,
    };
    let texture = |format, extent| Kind::Texture { format, extent };
    let buffer = |stride, count, indirect| Kind::Buffer { stride, count, indirect };
    let input = |name| resource(name, Kind::Input, Lifetime::External, false);
    vec![
        resource("frame", Kind::Constants, Lifetime::External, false),
        input("radiance"),
        input("normal"),
        input("roughness"),
        input("depth"),
        input("motion"),
        input("hit_motion"),
        input("environment"),
        input("prev_normal"),
        input("prev_roughness"),
        input("prev_depth"),
        resource("guide", texture(Format::Rg32Uint, Extent::Full), Lifetime::Persistent, true),
        resource("prev_guide", texture(Format::R32Uint, Extent::Full), Lifetime::Persistent, false),
        resource("signal", texture(Format::Rg32Uint, Extent::Full), Lifetime::Persistent, true),
        resource(OUTPUT, texture(Format::Rgba16Float, Extent::Full), Lifetime::Persistent, false),
        resource(DEBUG_VIEW, texture(Format::Rgba16Float, Extent::Full), Lifetime::Transient, false),
        resource("average", texture(Format::Rgba16Float, Extent::Tile), Lifetime::Transient, false),
        resource("history", texture(Format::Rgba16Float, Extent::Full), Lifetime::Persistent, true),
        resource(BLOCKS, texture(Format::Rgba32Uint, Extent::Block), Lifetime::Transient, false),
        resource(OTHER_BLOCKS, texture(Format::Rgba32Uint, Extent::Block), Lifetime::Transient, false),
        resource("samples", texture(Format::Rg32Uint, Extent::Block), Lifetime::Transient, false),
        resource("light", texture(Format::R32Uint, Extent::Block), Lifetime::Persistent, true),
        resource("idle_frames", buffer(4, Count::Per(Extent::Tile), false), Lifetime::Persistent, false),
        resource("tiles", buffer(4, Count::Per(Extent::Tile), false), Lifetime::Transient, false),
        resource("rays", buffer(4, Count::Per(Extent::Full), false), Lifetime::Transient, false),
        resource("counters", buffer(4, Count::Fixed(4), false), Lifetime::Persistent, false),
        resource("args", buffer(16, Count::Fixed(5), true), Lifetime::Transient, false),
        resource("block_list", buffer(4, Count::Per(Extent::Block), false), Lifetime::Transient, false),
        resource("block_counters", buffer(4, Count::Fixed(2), false), Lifetime::Persistent, false),
        resource("block_args", buffer(16, Count::Fixed(4), true), Lifetime::Transient, false),
    ]
}

/// Index in `args` of the rays' grid.
pub(crate) const RAY_ARGS: u64 = 2;
/// Bytes of one entry of `args`: workgroups in x, y and z, and the length of the list.
pub(crate) const ARGS_STRIDE: u64 = 16;

pub(crate) fn override_value(settings: &Settings, name: &str) -> f64 {
    let (ray_list, features) = (settings.coverage.ray_list.as_ref(), &settings.features);
    match name {
        "NORMAL_ENCODING" => match settings.conventions.normal {
            NormalEncoding::Signed => 0.0,
            NormalEncoding::Unsigned => 1.0,
            NormalEncoding::Octahedral => 2.0,
            NormalEncoding::OctahedralUnsigned => 3.0,
        },
        "ROUGHNESS_CHANNEL" => match settings.conventions.roughness_channel {
            Channel::Red => 0.0,
            Channel::Green => 1.0,
            Channel::Blue => 2.0,
            Channel::Alpha => 3.0,
        },
        "ROUGHNESS_IS_ALPHA" => f64::from(settings.conventions.roughness == RoughnessEncoding::Alpha),
        "RAYS_PER_QUAD" => match ray_list.map(|list| list.rays_per_quad) {
            None => 0.0,
            Some(RaysPerQuad::One) => 1.0,
            Some(RaysPerQuad::Two) => 2.0,
            Some(RaysPerQuad::Four) => 4.0,
        },
        "RAYS_FOLLOW_VARIANCE" => f64::from(ray_list.is_some_and(|list| list.variance_threshold.is_some())),
        "ROUGHNESS_IS_CONSTANT" => f64::from(features.constant_roughness.is_some()),
        "GUIDE_IS_PACKED" => f64::from(is_guide_packed(settings)),
        "GBUFFER_IS_COPIED" => f64::from(features.gbuffer_copy),
        "NORMAL_IS_INPUT" => f64::from(features.normal_input),
        "AVERAGE_IS_USED" => f64::from(settings.pipeline == Pipeline::Published && features.uses_average()),
        "PREV_GUIDE_IS_KEPT" => f64::from(settings.pipeline == Pipeline::Footprint && features.gbuffer_copy),
        "BLOCKS_ARE_USED" => f64::from(settings.pipeline == Pipeline::Footprint && has_blocks(settings)),
        "GUIDE_IS_COMPLETE" => f64::from(is_guide_complete(settings)),
        "GUIDE_IS_CLEARED" => f64::from(is_guide_packed(settings) && !is_guide_complete(settings)),
        "FALLBACK_IS_BLACK" => f64::from(settings.coverage.fallback == Fallback::Black),
        // The template that names it means it.
        "ACCUMULATED" => 1.0,
        "LIGHT_CHANGE" => f64::from(features.light_change),
        "OUTLIER_SPREAD" => f64::from(features.outlier_spread),
        "BLOCK_STATISTICS" => f64::from(features.compares_with_blocks()),
        "BLOCK_TAPS" => f64::from(if features.block_interpolation { 4 } else { 1 }),
        "SAMPLES_ARE_USED" => f64::from(features.light_change || features.outlier_spread || has_wide_filter(settings)),
        "NEAR_TAPS" => f64::from(near_taps(features)),
        "YOUNG_TAPS" => match near_taps(features) {
            0 => 0.0,
            near => f64::from(near.max(features.young_taps)),
        },
        "WIDE_TAPS" => f64::from(features.wide_taps),
        "WHOLE_BLOCKS" => f64::from(has_whole_blocks(settings)),
        "WIDE_FILTER" => f64::from(has_wide_filter(settings)),
        "AVERAGE_IS_READ" => f64::from(features.history_clip || features.average_mixing),
        "MIRROR_PARALLAX" => f64::from(features.mirror_parallax),
        "SURFACE_MOTION" => f64::from(features.surface_motion),
        "BOTH_HISTORIES" => f64::from(features.mirror_parallax && features.surface_motion && features.both_histories),
        "HIT_MOTION" => f64::from(features.hit_motion),
        "HISTORY_SEARCH" => f64::from(features.history_search),
        "EDGE_REPAIR" => f64::from(features.edge_repair),
        "SPATIAL_FILTER" => f64::from(features.spatial_filter),
        // Only templates of the debug view name it.
        "VIEW" => features.debug_view.map_or(0.0, |view| f64::from(view as u8)),
        "HISTORY_CLIP" => f64::from(features.history_clip),
        "AVERAGE_MIXING" => f64::from(features.average_mixing),
        "FALLBACK" => match settings.coverage.fallback {
            Fallback::Black => 0.0,
            Fallback::Input => 1.0,
            Fallback::Environment => 2.0,
        },
        _ => unreachable!("templates name no other override"),
    }
}
