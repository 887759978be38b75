use ash::vk;
use glam::UVec2;
use limpid::resource::input_size;

use crate::Error;

/// An image of the caller, as kernels see it.
#[derive(Debug, Clone, Copy)]
pub struct Input {
    /// A two-dimensional view of one mip level (of all, for `environment`), with one sample a texel, whose texels
    /// read as floats: any float or normalised format, or the depth aspect alone of a depth format. The image
    /// has `VK_IMAGE_USAGE_SAMPLED_BIT`. No sampler is needed, nor linear filtering.
    pub view: vk::ImageView,
    /// The layout that the image is in while kernels read it: `SHADER_READ_ONLY_OPTIMAL`, `GENERAL`, or a
    /// read-only depth layout. limpid never changes it.
    pub layout: vk::ImageLayout,
    /// Its size in pixels.
    pub size: UVec2,
}

/// Last frame's G-buffer, encoded as this frame's and as large as that frame was. In the first frame, after a camera cut
/// and after a resize it may be anything of any size.
#[derive(Debug, Clone, Copy)]
pub struct PrevGbuffer {
    /// World-space normal.
    pub normal: Input,
    /// Roughness, in the channel that the settings name.
    pub roughness: Input,
    /// Depth.
    pub depth: Input,
}

/// The caller's images of one frame. Encodings are set in
/// [`Settings::conventions`](limpid::settings::Conventions). The same view may serve several inputs.
///
/// What the settings leave out, such as `normal` without the feature `normal_input`, is not looked at: anything will do there.
#[derive(Debug, Clone, Copy)]
pub struct Inputs {
    /// `rgb`: noisy radiance, `a`: hit distance.
    pub radiance: Input,
    /// World-space normal.
    pub normal: Input,
    /// Roughness, in the channel that the settings name.
    pub roughness: Input,
    /// Depth.
    pub depth: Input,
    /// Motion vectors in `rg`.
    pub motion: Input,
    /// World-space motion of what was hit, in `rgb`. Only for the feature `hit_motion`.
    pub hit_motion: Option<Input>,
    /// Equirectangular radiance with its mip chain. Only for `Fallback::Environment`.
    pub environment: Option<Input>,
    /// Last frame's G-buffer. Only without the feature `gbuffer_copy`.
    pub previous: Option<PrevGbuffer>,
}

impl Inputs {
    /// An input of the plan, with the name of its field.
    pub(crate) fn find(&self, name: &str) -> Option<(&'static str, Option<Input>)> {
        Some(match name {
            "radiance" => ("radiance", Some(self.radiance)),
            "normal" => ("normal", Some(self.normal)),
            "roughness" => ("roughness", Some(self.roughness)),
            "depth" => ("depth", Some(self.depth)),
            "motion" => ("motion", Some(self.motion)),
            "hit_motion" => ("hit_motion", self.hit_motion),
            "environment" => ("environment", self.environment),
            "prev_normal" => ("previous.normal", self.previous.map(|previous| previous.normal)),
            "prev_roughness" => ("previous.roughness", self.previous.map(|previous| previous.roughness)),
            "prev_depth" => ("previous.depth", self.previous.map(|previous| previous.depth)),
            _ => return None,
        })
    }

    pub(crate) fn check<'n>(
        &self,
        names: impl Iterator<Item = &'n str>,
        size: UVec2,
        prev_size: UVec2,
    ) -> Result<(), Error> {
        for (name, (field, input)) in names.filter_map(|name| Some((name, self.find(name)?))) {
            let input = input.filter(|input| input.view != vk::ImageView::null());
            let input = input.ok_or(Error::InputMissing { input: field })?;
            let expected = input_size(name, size, prev_size);
            if input.size.cmplt(expected).any() {
                return Err(Error::InputSize { input: field, actual: input.size, expected });
            }
            let is_readable = matches!(
                input.layout,
                vk::ImageLayout::GENERAL
                    | vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL
                    | vk::ImageLayout::DEPTH_STENCIL_READ_ONLY_OPTIMAL
                    | vk::ImageLayout::DEPTH_READ_ONLY_OPTIMAL
                    | vk::ImageLayout::DEPTH_READ_ONLY_STENCIL_ATTACHMENT_OPTIMAL
                    | vk::ImageLayout::READ_ONLY_OPTIMAL
            );
            if !is_readable {
                return Err(Error::InputLayout { input: field, actual: input.layout });
            }
        }
        Ok(())
    }
}
