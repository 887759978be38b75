//! What changes from frame to frame, and the constants that the kernels see of it.

use glam::{DMat4, DVec2, DVec3, DVec4, Mat3, Mat4, UVec2, Vec2};
use serde::{Deserialize, Serialize};

use crate::settings::{DepthEncoding, NdcY, Settings};
use crate::{Error, MAX_SIZE};

/// A camera at one frame. Matrices are for column vectors and without jitter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// World to view space: a rigid motion, either handedness.
    pub world_to_view: Mat4,
    /// View to clip space: perspective or orthographic, depth 0 to 1 standard or reversed, the far plane
    /// finite or infinite, off-centre allowed, no skew. An orthographic one with depth supplied as
    /// [`DepthEncoding::Linear`] has to be of standard depth, as nothing else tells where it looks.
    pub view_to_clip: Mat4,
    /// Where in its pixel the camera sampled, from the pixel's centre, in pixels, `x` right, `y` down,
    /// usually within -0.5 to 0.5.
    pub jitter: Vec2,
}

/// The caller's inputs of one frame that are not images.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct FrameInputs {
    /// This frame's camera. Last frame's is remembered.
    pub camera: Camera,
    /// Size of the rectangle at the top left of all images that this frame uses, at most the allocated size.
    /// May change every frame (dynamic resolution).
    pub size: UVec2,
    /// History is of no use: first frame, camera cut, teleport. The first frame of a denoiser always is one.
    pub reset: bool,
    /// Factor that brings radiance near 1, where the published constants were tuned. Above 0. Input and
    /// output are not exposed; it may change every frame. Output is half float: where exposed radiance near 1
    /// stands for more than 65504 or less than 0.0001, scale the input instead.
    pub exposure: f32,
    /// Time since the frame before, in seconds. Above 0. Settings in seconds are counted in frames of this length.
    pub frame_seconds: f32,
    /// Camera of the preceding frame, where it is not the one that was denoised last (frames were skipped). A G-buffer of
    /// last frame that the caller supplies is of this camera.
    pub previous_camera: Option<Camera>,
}

impl FrameInputs {
    /// A frame that continues the last one, at exposure 1 and 60 frames per second.
    pub fn new(camera: Camera, size: UVec2) -> Self {
        Self { camera, size, reset: false, exposure: 1.0, frame_seconds: 1.0 / 60.0, previous_camera: None }
    }
}

/// Declares the constant buffer, and the table of its fields for tests and other languages.
macro_rules! constants {
    ($(#[$outer:meta])* $name:ident { $($field:ident: $ty:ty,)* }) => {
        $(#[$outer])*
        #[repr(C)]
        #[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
        pub struct $name {
            $(#[allow(missing_docs, reason = "documented in kernels/shared/frame.wgsl")] pub $field: $ty,)*
        }

        impl $name {
            /// Name, offset in bytes and size in bytes of each field.
            pub const FIELDS: &[(&str, usize, usize)] = &[
                $((stringify!($field), std::mem::offset_of!($name, $field), std::mem::size_of::<$ty>()),)*
            ];
        }
    };
}

constants! {
    /// The constant buffer of all kernels, `Frame` in `kernels/shared/frame.wgsl`.
    FrameConstants {
        world_from_pixel: [[f32; 4]; 4],
        prev_uv_from_world: [[f32; 4]; 4],
        world_from_prev_pixel: [[f32; 4]; 4],
        environment_from_world: [[f32; 4]; 4],
        depth_from_device: [f32; 4],
        prev_depth_from_device: [f32; 4],
        neighborhood_weights: [f32; 4],
        forward: [f32; 4],
        clip_w: [f32; 2],
        prev_clip_w: [f32; 2],
        sky_depth: [f32; 2],
        motion_scale: [f32; 2],
        motion_offset: [f32; 2],
        jitter_uv: [f32; 2],
        size: [u32; 2],
        prev_size: [u32; 2],
        exposure: f32,
        inverse_exposure: f32,
        pixels_per_unit: f32,
        roughness_threshold: f32,
        mirror_roughness: f32,
        ray_variance_threshold: f32,
        environment_mip_scale: f32,
        parallax_normal_cosine: f32,
        parallax_normal_margin: f32,
        parallax_roughness_margin: f32,
        surface_color_gate: f32,
        disocclusion_normal_falloff: f32,
        disocclusion_depth_falloff: f32,
        disocclusion_threshold: f32,
        disocclusion_tap_fraction: f32,
        max_history: f32,
        min_history_cap: f32,
        history_roughness_falloff: f32,
        variance_luminance_floor: f32,
        average_history_blend: f32,
        average_luminance_falloff: f32,
        average_weight_floor: f32,
        prefilter_radiance_falloff: f32,
        prefilter_radiance_variance_falloff: f32,
        prefilter_radiance_weight_floor: f32,
        prefilter_normal_power: f32,
        prefilter_depth_falloff: f32,
        prefilter_variance_falloff: f32,
        prefilter_variance_weight_floor: f32,
        stability: f32,
        clip_scale: f32,
        clip_average_pull: f32,
        clip_extent_floor: f32,
        accumulate_max_history: f32,
        accumulate_mirror_history: f32,
        accumulate_clip_roughness: f32,
        accumulate_clip_scale: f32,
        outlier_factor: f32,
        excess_limit: f32,
        disagreement_limit: f32,
        light_change_sigma: f32,
        light_change_share: f32,
        light_change_rate: f32,
        filter_scale: f32,
        excess_scale: f32,
        grazing_width: f32,
        history_length_steps: f32,
        constant_roughness: f32,
    }
}

/// Frames that `kernels/shared/history.wgsl` can count.
const LONGEST_HISTORY: f32 = 31.0;

/// What the denoiser remembers of the frame before.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Previous {
    pub(crate) camera: Camera,
    pub(crate) size: UVec2,
}

fn check_camera(camera: &Camera) -> Result<(), Error> {
    let fail = |matrix, problem, value| Err(Error::Camera { matrix, problem, value });
    let view = camera.world_to_view;
    if !view.is_finite() {
        return fail("world_to_view", "has entries that are not finite", view);
    }
    let axes = Mat3::from_mat4(view);
    let is_rotation = (axes * axes.transpose()).abs_diff_eq(Mat3::IDENTITY, 1e-3);
    if !is_rotation || view.row(3).to_array() != [0.0, 0.0, 0.0, 1.0] {
        return fail("world_to_view", "is not a rigid motion", view);
    }
    let clip = camera.view_to_clip;
    if !clip.is_finite() {
        return fail("view_to_clip", "has entries that are not finite", clip);
    }
    let m = |row: usize, column: usize| clip.col(column)[row];
    if [m(0, 1), m(1, 0), m(2, 0), m(2, 1), m(3, 0), m(3, 1)].iter().any(|&entry| entry != 0.0) {
        return fail("view_to_clip", "is skewed or has an oblique near plane", clip);
    }
    if clip.as_dmat4().determinant() == 0.0 {
        return fail("view_to_clip", "is singular", clip);
    }
    for (field, value) in [("camera.jitter.x", camera.jitter.x), ("camera.jitter.y", camera.jitter.y)] {
        if !value.is_finite() {
            return Err(Error::FrameInput { field, value, expected: "a finite number" });
        }
    }
    Ok(())
}

/// Sign of view-space z in front of the camera.
fn forward_sign(view_to_clip: &DMat4, reversed: bool) -> f64 {
    let w_per_z = view_to_clip.z_axis.w;
    if w_per_z != 0.0 { w_per_z.signum() } else { view_to_clip.z_axis.z.signum() * if reversed { -1.0 } else { 1.0 } }
}

/// (x w, y w, depth, 1) to view space, with w = clip_w.x + clip_w.y depth.
fn pixel_to_view(camera: &Camera, size: DVec2, ndc_y: f64, sign: f64) -> (DMat4, DVec2) {
    let p = camera.view_to_clip.as_dmat4();
    let clip_w = DVec2::new(p.w_axis.w, p.z_axis.w * sign);
    // ndc = scale * pixel + offset
    let scale = DVec2::new(2.0, -2.0 * ndc_y) / size;
    let offset = scale * camera.jitter.as_dvec2() + DVec2::new(-1.0, ndc_y);
    // view.xy = (ndc * w - p.z_axis.xy * z - p.w_axis.xy) / diagonal, z = sign * depth
    let diagonal = DVec2::new(p.x_axis.x, p.y_axis.y);
    let per_depth = (offset * clip_w.y - DVec2::new(p.z_axis.x, p.z_axis.y) * sign) / diagonal;
    let constant = (offset * clip_w.x - DVec2::new(p.w_axis.x, p.w_axis.y)) / diagonal;
    let matrix = DMat4::from_cols(
        DVec4::new(scale.x / diagonal.x, 0.0, 0.0, 0.0),
        DVec4::new(0.0, scale.y / diagonal.y, 0.0, 0.0),
        DVec4::new(per_depth.x, per_depth.y, sign, 0.0),
        DVec4::new(constant.x, constant.y, 0.0, 1.0),
    );
    (matrix, clip_w)
}

/// Linear depth of a depth `d` as it is supplied: `|(x + y d) / (z + w d)|`.
fn depth_from_device(encoding: DepthEncoding, camera: &Camera) -> [f32; 4] {
    let p = camera.view_to_clip;
    match encoding {
        DepthEncoding::Device | DepthEncoding::ReversedDevice => [p.w_axis.z, -p.w_axis.w, -p.z_axis.z, p.z_axis.w],
        DepthEncoding::Linear => [0.0, 1.0, 1.0, 0.0],
    }
}

fn columns(matrix: DMat4) -> [[f32; 4]; 4] {
    matrix.as_mat4().to_cols_array_2d()
}

fn check_frame(inputs: &FrameInputs, allocated: UVec2) -> Result<(), Error> {
    if inputs.size.min_element() == 0 || inputs.size.cmpgt(allocated).any() {
        return Err(Error::Size { what: "frame input `size`", size: inputs.size, limit: allocated });
    }
    for (field, value) in [("exposure", inputs.exposure), ("frame_seconds", inputs.frame_seconds)] {
        if !(value.is_normal() && value > 0.0) {
            return Err(Error::FrameInput { field, value, expected: "a finite number above 0" });
        }
    }
    check_camera(&inputs.camera)?;
    inputs.previous_camera.as_ref().map_or(Ok(()), check_camera)
}

/// Checks that a denoiser may be allocated at `size`.
pub(crate) fn check_allocation(size: UVec2) -> Result<(), Error> {
    if size.min_element() == 0 || size.max_element() > MAX_SIZE {
        return Err(Error::Size { what: "size", size, limit: UVec2::splat(MAX_SIZE) });
    }
    Ok(())
}

/// The constants of a frame.
pub(crate) fn constants(
    settings: &Settings,
    inputs: &FrameInputs,
    allocated: UVec2,
    previous: Option<Previous>,
) -> Result<FrameConstants, Error> {
    check_frame(inputs, allocated)?;
    let camera = &inputs.camera;
    let conventions = &settings.conventions;
    let size = inputs.size.as_dvec2();
    let ndc_y = match conventions.ndc_y {
        NdcY::Up => 1.0,
        NdcY::Down => -1.0,
    };
    let reversed = conventions.depth == DepthEncoding::ReversedDevice;
    let p = camera.view_to_clip.as_dmat4();
    let sign = forward_sign(&p, reversed);
    let view_to_world = camera.world_to_view.as_dmat4().inverse();
    let eye = view_to_world.w_axis.truncate();
    let (view_from_pixel, clip_w) = pixel_to_view(camera, size, ndc_y, sign);
    // Relative to the eye, so that coordinates stay small in large worlds.
    let mut view_to_relative = view_to_world;
    view_to_relative.w_axis = DVec4::W;

    let (prev_camera, prev_size) = match (inputs.previous_camera, previous) {
        (Some(camera), Some(previous)) => (camera, previous.size),
        (None, Some(previous)) => (previous.camera, previous.size),
        (_, None) => (*camera, inputs.size),
    };
    let uv_from_ndc =
        DMat4::from_translation(DVec3::new(0.5, 0.5, 0.0)) * DMat4::from_scale(DVec3::new(0.5, -0.5 * ndc_y, 1.0));
    let prev_uv_from_world = uv_from_ndc
        * prev_camera.view_to_clip.as_dmat4()
        * prev_camera.world_to_view.as_dmat4()
        * DMat4::from_translation(eye);

    let prev_sign = forward_sign(&prev_camera.view_to_clip.as_dmat4(), reversed);
    let (view_from_prev_pixel, prev_clip_w) = pixel_to_view(&prev_camera, prev_size.as_dvec2(), ndc_y, prev_sign);
    let world_from_prev_pixel =
        DMat4::from_translation(-eye) * prev_camera.world_to_view.as_dmat4().inverse() * view_from_prev_pixel;

    let sky_depth = match conventions.depth {
        DepthEncoding::Device => [f32::MIN, 1.0],
        DepthEncoding::ReversedDevice => [0.0, f32::MAX],
        DepthEncoding::Linear => [0.0, conventions.sky_distance],
    };
    let jitter = camera.jitter.as_dvec2();
    let prev_jitter = prev_camera.jitter.as_dvec2();
    let motion_offset = if conventions.motion_includes_jitter {
        // A jittered image moves against the jitter.
        jitter / size - prev_jitter / prev_size.as_dvec2()
    } else {
        DVec2::ZERO
    };
    let environment = settings.coverage.environment_from_world.as_dmat3();
    let (reproject, prefilter, resolve) = (&settings.reproject, &settings.prefilter, &settings.resolve);
    let (accumulate, footprint) = (&settings.accumulate, &settings.footprint);
    let ray_list = settings.coverage.ray_list.as_ref();
    let frames = |seconds: f32| (seconds / inputs.frame_seconds).clamp(1.0, LONGEST_HISTORY);
    let neighborhood = |i: f32| (-reproject.neighborhood_falloff * i * i / 25.0).exp();
    Ok(FrameConstants {
        world_from_pixel: columns(view_to_relative * view_from_pixel),
        prev_uv_from_world: columns(prev_uv_from_world),
        world_from_prev_pixel: columns(world_from_prev_pixel),
        environment_from_world: columns(DMat4::from_mat3(environment)),
        depth_from_device: depth_from_device(conventions.depth, camera),
        prev_depth_from_device: depth_from_device(conventions.depth, &prev_camera),
        neighborhood_weights: [1.0, 2.0, 3.0, 4.0].map(neighborhood),
        forward: (view_to_relative * DVec4::new(0.0, 0.0, sign, 0.0)).normalize().as_vec4().to_array(),
        clip_w: clip_w.as_vec2().to_array(),
        prev_clip_w: prev_clip_w.as_vec2().to_array(),
        sky_depth,
        motion_scale: conventions.motion_scale.to_array(),
        motion_offset: motion_offset.as_vec2().to_array(),
        jitter_uv: (jitter / size).as_vec2().to_array(),
        size: inputs.size.to_array(),
        prev_size: if previous.is_some() && !inputs.reset { prev_size.to_array() } else { [0, 0] },
        exposure: inputs.exposure,
        inverse_exposure: 1.0 / inputs.exposure,
        pixels_per_unit: (size.y * p.y_axis.y.abs() / 2.0) as f32,
        roughness_threshold: settings.coverage.roughness_threshold,
        mirror_roughness: settings.coverage.mirror_roughness,
        ray_variance_threshold: ray_list.and_then(|list| list.variance_threshold).unwrap_or(1.0),
        environment_mip_scale: settings.coverage.environment_mip_scale,
        parallax_normal_cosine: reproject.parallax_normal_cosine,
        parallax_normal_margin: reproject.parallax_normal_margin,
        parallax_roughness_margin: reproject.parallax_roughness_margin,
        surface_color_gate: reproject.surface_color_gate,
        disocclusion_normal_falloff: reproject.disocclusion_normal_falloff,
        disocclusion_depth_falloff: reproject.disocclusion_depth_falloff,
        disocclusion_threshold: reproject.disocclusion_threshold,
        disocclusion_tap_fraction: reproject.disocclusion_tap_fraction,
        max_history: reproject.max_history,
        min_history_cap: reproject.min_history_cap,
        history_roughness_falloff: reproject.history_roughness_falloff,
        variance_luminance_floor: reproject.variance_luminance_floor,
        average_history_blend: reproject.average_history_blend,
        average_luminance_falloff: reproject.average_luminance_falloff,
        average_weight_floor: reproject.average_weight_floor,
        prefilter_radiance_falloff: prefilter.radiance_falloff,
        prefilter_radiance_variance_falloff: prefilter.radiance_variance_falloff,
        prefilter_radiance_weight_floor: prefilter.radiance_weight_floor,
        prefilter_normal_power: prefilter.normal_power,
        prefilter_depth_falloff: prefilter.depth_falloff,
        prefilter_variance_falloff: prefilter.variance_falloff,
        prefilter_variance_weight_floor: prefilter.variance_weight_floor,
        stability: resolve.stability,
        clip_scale: resolve.clip_scale,
        clip_average_pull: resolve.clip_average_pull,
        clip_extent_floor: resolve.clip_extent_floor,
        accumulate_max_history: frames(accumulate.max_history_seconds),
        accumulate_mirror_history: frames(accumulate.mirror_history_seconds),
        accumulate_clip_roughness: accumulate.clip_roughness,
        accumulate_clip_scale: accumulate.clip_scale,
        outlier_factor: accumulate.outlier_factor,
        excess_limit: accumulate.excess_limit,
        disagreement_limit: accumulate.disagreement_limit,
        light_change_sigma: accumulate.light_change_sigma,
        light_change_share: accumulate.light_change_share,
        light_change_rate: 1.0 - (-inputs.frame_seconds / accumulate.light_change_seconds).exp(),
        filter_scale: footprint.filter_scale,
        excess_scale: footprint.excess_scale,
        grazing_width: footprint.grazing_width,
        history_length_steps: (255.0 / reproject.max_history).floor(),
        constant_roughness: settings.features.constant_roughness.unwrap_or(0.0),
    })
}
