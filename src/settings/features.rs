//! What is done at all.

use serde::{Deserialize, Serialize};

use super::{Pipeline, check_range};
use crate::{DebugView, Error};

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
    /// Footprint pipeline: compares with all four blocks around a pixel, by how near they are. Without it with the one that
    /// the pixel is in: edges of blocks may show where outliers are spread over footprints narrower than blocks.
    pub block_interpolation: bool,
    /// Footprint pipeline: filters over blocks where the footprint is wider than a few pixels. A scene of smooth
    /// surfaces has no such footprints.
    pub wide_filter: bool,
    /// Footprint pipeline: pixels that each is filtered with besides, 0 to 64.
    pub near_taps: u32,
    /// Footprint pipeline: the same for pixels without history, as all are in the first frame and after a cut, 0 to 64.
    /// Has no effect where `near_taps` is 0, or as many or more. How far taps reach depends on `near_taps` alone.
    pub young_taps: u32,
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
            block_interpolation: true,
            wide_filter: true,
            near_taps: 12,
            young_taps: 12,
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

    pub(super) fn validate(&self, pipeline: Pipeline) -> Result<(), Error> {
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
        check_range("features.young_taps", self.young_taps as f32, 0.0, 64.0, "0 to 64")?;
        check_range("features.wide_taps", self.wide_taps as f32, 1.0, 16.0, "1 to 16")?;
        if let Some(roughness) = self.constant_roughness {
            check_range("features.constant_roughness", roughness, 0.0, 1.0, "0 to 1")?;
        }
        Ok(())
    }
}
