use glam::UVec2;
use limpid::Settings;
use limpid::resource::input_size;
use limpid::settings::{Channel, NormalEncoding};

use crate::Error;

/// Last frame's G-buffer, encoded as this frame's and as large as that frame was. In the first frame, after a camera cut
/// and after a resize it may be anything of any size.
#[derive(Debug, Clone, Copy)]
pub struct PrevGbuffer<'a> {
    /// World-space normal.
    pub normal: &'a wgpu::TextureView,
    /// Roughness, in the channel that the settings name.
    pub roughness: &'a wgpu::TextureView,
    /// Depth.
    pub depth: &'a wgpu::TextureView,
}

/// The caller's images of one frame. Encodings are set in [`Settings::conventions`]; any format whose texels
/// read as float will do. The same view may serve several inputs.
///
/// Views must show one mip level, and the depth aspect alone of formats that have a stencil.
///
/// What the settings leave out, such as `normal` without the feature `normal_input`, is not looked at: anything will do there.
#[derive(Debug, Clone, Copy)]
pub struct Inputs<'a> {
    /// `rgb`: noisy radiance, `a`: hit distance.
    pub radiance: &'a wgpu::TextureView,
    /// World-space normal.
    pub normal: &'a wgpu::TextureView,
    /// Roughness, in the channel that the settings name.
    pub roughness: &'a wgpu::TextureView,
    /// Depth.
    pub depth: &'a wgpu::TextureView,
    /// Motion vectors in `rg`.
    pub motion: &'a wgpu::TextureView,
    /// World-space motion of what was hit, in `rgb`. Only for the feature `hit_motion`.
    pub hit_motion: Option<&'a wgpu::TextureView>,
    /// Equirectangular radiance with its mip chain. Only for `Fallback::Environment`.
    pub environment: Option<&'a wgpu::TextureView>,
    /// Last frame's G-buffer. Only without the feature `gbuffer_copy`.
    pub previous: Option<PrevGbuffer<'a>>,
}

impl<'a> Inputs<'a> {
    /// The view of an input of the plan.
    pub(crate) fn view(&self, name: &str) -> Option<&'a wgpu::TextureView> {
        match name {
            "radiance" => Some(self.radiance),
            "normal" => Some(self.normal),
            "roughness" => Some(self.roughness),
            "depth" => Some(self.depth),
            "motion" => Some(self.motion),
            "hit_motion" => self.hit_motion,
            "environment" => self.environment,
            "prev_normal" => self.previous.map(|previous| previous.normal),
            "prev_roughness" => self.previous.map(|previous| previous.roughness),
            "prev_depth" => self.previous.map(|previous| previous.depth),
            _ => None,
        }
    }

    /// Checks every input that a plan uses.
    pub(crate) fn check<'n>(
        &self,
        names: impl Iterator<Item = &'n str>,
        settings: &Settings,
        size: UVec2,
        prev_size: UVec2,
    ) -> Result<(), Error> {
        for name in names {
            let (input, channels) = requirement(name, settings);
            let view = self.view(name).ok_or(Error::InputMissing { input })?;
            check_texture(input, view.texture(), channels, input_size(name, size, prev_size))?;
        }
        Ok(())
    }
}

/// Field name of an input and how many channels it must have.
fn requirement(name: &str, settings: &Settings) -> (&'static str, u8) {
    let of_normal = match settings.conventions.normal {
        NormalEncoding::Signed | NormalEncoding::Unsigned => 3,
        NormalEncoding::Octahedral | NormalEncoding::OctahedralUnsigned => 2,
    };
    let of_roughness = match settings.conventions.roughness_channel {
        Channel::Red => 1,
        Channel::Green => 2,
        Channel::Blue => 3,
        Channel::Alpha => 4,
    };
    match name {
        "radiance" => ("radiance", 4),
        "normal" => ("normal", of_normal),
        "roughness" => ("roughness", of_roughness),
        "depth" => ("depth", 1),
        "motion" => ("motion", 2),
        "hit_motion" => ("hit_motion", 3),
        "prev_normal" => ("previous.normal", of_normal),
        "prev_roughness" => ("previous.roughness", of_roughness),
        "prev_depth" => ("previous.depth", 1),
        _ => ("environment", 3),
    }
}

fn check_texture(input: &'static str, texture: &wgpu::Texture, channels: u8, expected: UVec2) -> Result<(), Error> {
    if texture.dimension() != wgpu::TextureDimension::D2 || texture.sample_count() != 1 {
        let actual = format!("{:?} with {} samples", texture.dimension(), texture.sample_count());
        return Err(Error::InputShape { input, actual });
    }
    if !texture.usage().contains(wgpu::TextureUsages::TEXTURE_BINDING) {
        return Err(Error::InputUsage { input, actual: texture.usage() });
    }
    let format = texture.format();
    let aspect = if format.has_depth_aspect() { wgpu::TextureAspect::DepthOnly } else { wgpu::TextureAspect::All };
    let is_float = matches!(
        format.sample_type(Some(aspect), None),
        Some(wgpu::TextureSampleType::Float { .. } | wgpu::TextureSampleType::Depth)
    );
    if !is_float || format.components_with_aspect(aspect) < channels {
        let expected = format!("a format with float texels and at least {channels} channels");
        return Err(Error::InputFormat { input, actual: format, expected });
    }
    let actual = UVec2::new(texture.width(), texture.height());
    if actual.cmplt(expected).any() {
        return Err(Error::InputSize { input, actual, expected });
    }
    Ok(())
}
