//! Positions and reprojections of the constants against the camera's own matrices, for every kind of
//! projection.

use glam::{Mat4, UVec2, Vec2, Vec3, Vec3Swizzles, Vec4, Vec4Swizzles, camera::lh, camera::rh};
use limpid::settings::{DepthEncoding, NdcY};
use limpid::{Camera, Denoiser, FrameConstants, FrameInputs, Settings};
use proptest::prelude::*;

const SIZE: UVec2 = UVec2::new(320, 200);

#[derive(Debug, Clone, Copy)]
struct Projection {
    name: &'static str,
    view_to_clip: Mat4,
    depth: DepthEncoding,
    ndc_y: NdcY,
    left_handed: bool,
}

fn projections() -> Vec<Projection> {
    use DepthEncoding::{Device, Linear, ReversedDevice};
    let p =
        |name, view_to_clip, depth, ndc_y, left_handed| Projection { name, view_to_clip, depth, ndc_y, left_handed };
    let (fov, aspect, near, far) = (1.0, 1.6, 0.1, 500.0);
    let mut off_center = rh::proj::directx::perspective(fov, aspect, near, far);
    off_center.z_axis.x = 0.3;
    off_center.z_axis.y = -0.2;
    let mut flipped = rh::proj::directx::perspective(fov, aspect, near, far);
    flipped.y_axis.y *= -1.0;
    vec![
        p("rh", rh::proj::directx::perspective(fov, aspect, near, far), Device, NdcY::Up, false),
        p("rh linear", rh::proj::directx::perspective(fov, aspect, near, far), Linear, NdcY::Up, false),
        p("rh infinite", rh::proj::directx::perspective_infinite(fov, aspect, near), Device, NdcY::Up, false),
        p(
            "rh infinite reversed",
            rh::proj::directx::perspective_infinite_reverse(fov, aspect, near),
            ReversedDevice,
            NdcY::Up,
            false,
        ),
        p("rh off centre", off_center, Device, NdcY::Up, false),
        p("rh vulkan", flipped, Device, NdcY::Down, false),
        p("lh", lh::proj::directx::perspective(fov, aspect, near, far), Device, NdcY::Up, true),
        p(
            "lh infinite reversed",
            lh::proj::directx::perspective_infinite_reverse(fov, aspect, near),
            ReversedDevice,
            NdcY::Up,
            true,
        ),
        p("rh orthographic", rh::proj::directx::orthographic(-8.0, 8.0, -5.0, 5.0, near, far), Device, NdcY::Up, false),
        p(
            "rh orthographic reversed",
            rh::proj::directx::orthographic(-8.0, 8.0, -5.0, 5.0, far, near),
            ReversedDevice,
            NdcY::Up,
            false,
        ),
        p("lh orthographic", lh::proj::directx::orthographic(-9.0, 8.0, -5.0, 6.0, near, far), Device, NdcY::Up, true),
    ]
}

/// What `world_position` of kernels/shared/frame.wgsl computes.
fn world_position(c: &FrameConstants, pixel: Vec2, depth: f32) -> Vec3 {
    let w = c.clip_w[0] + c.clip_w[1] * depth;
    (Mat4::from_cols_array_2d(&c.world_from_pixel) * Vec4::new(pixel.x * w, pixel.y * w, depth, 1.0)).xyz()
}

fn any_vec3(range: f32) -> impl Strategy<Value = Vec3> {
    prop::array::uniform3(-range..range).prop_map(Vec3::from_array)
}

proptest! {
    #[test]
    fn pixels_and_depths_lead_back_to_the_point_they_show(
        projection in prop::sample::select(projections()),
        eye in any_vec3(50.0),
        toward in any_vec3(1.0).prop_filter("a direction across the up vector", |d| d.xz().length() > 0.2),
        prev_shift in any_vec3(0.5),
        place in (0.05f32..0.95, 0.05f32..0.95, 1.0f32..60.0),
        jitter in (-0.5f32..0.5, -0.5f32..0.5),
    ) {
        let look = |eye: Vec3| {
            if projection.left_handed { lh::view::look_to_mat4(eye, toward.normalize(), Vec3::Y) }
            else { rh::view::look_to_mat4(eye, toward.normalize(), Vec3::Y) }
        };
        let mut settings = Settings::default();
        settings.conventions.depth = projection.depth;
        settings.conventions.ndc_y = projection.ndc_y;
        let mut denoiser = Denoiser::new(&settings, SIZE).unwrap();
        let jitter = Vec2::from(jitter);
        let before = Camera { world_to_view: look(eye + prev_shift), view_to_clip: projection.view_to_clip, jitter: Vec2::ZERO };
        let now = Camera { world_to_view: look(eye), jitter, ..before };
        denoiser.next_frame(&FrameInputs::new(before, SIZE)).unwrap();
        denoiser.finish_frame();
        let c = denoiser.next_frame(&FrameInputs::new(now, SIZE)).unwrap().constants;

        let depth = place.2;
        let pixel = Vec2::new(place.0, place.1) * SIZE.as_vec2();
        let relative = world_position(&c, pixel, depth);
        let world = relative + eye;

        // Through the camera's own matrices the point is at the pixel plus jitter, at that depth.
        let y_flip = if projection.ndc_y == NdcY::Up { -0.5 } else { 0.5 };
        let uv = |camera: &Camera| {
            let clip = camera.view_to_clip * camera.world_to_view * world.extend(1.0);
            let ndc = clip.xyz() / clip.w;
            (Vec2::new(0.5 + 0.5 * ndc.x, 0.5 + y_flip * ndc.y), ndc.z)
        };
        let (uv_now, device_depth) = uv(&now);
        let shown = uv_now * SIZE.as_vec2() - jitter;
        prop_assert!((shown - pixel).length() < 0.02, "{}: {shown} for {pixel}", projection.name);
        let view_z = now.world_to_view.transform_point3(world).z.abs();
        prop_assert!((view_z - depth).abs() < 2e-4 * depth, "{}: depth {view_z} for {depth}", projection.name);

        // The supplied depth gives the linear one.
        let supplied = if projection.depth == DepthEncoding::Linear { depth } else { device_depth };
        let [x, y, z, w] = c.depth_from_device;
        let linear = ((x + y * supplied) / (z + w * supplied)).abs();
        prop_assert!((linear - depth).abs() < 0.01 * depth, "{}: linear {linear} for {depth}", projection.name);
        prop_assert!(supplied > c.sky_depth[0] && supplied < c.sky_depth[1]);

        // Last frame's camera saw it where the constants say.
        let projected = Mat4::from_cols_array_2d(&c.prev_uv_from_world) * relative.extend(1.0);
        let (prev_uv, _) = uv(&before);
        let error = (Vec2::new(projected.x, projected.y) / projected.w - prev_uv) * SIZE.as_vec2();
        prop_assert!(error.length() < 0.02, "{}: {error} pixels off", projection.name);

        // The view direction is the ray through the point.
        let forward = Vec4::from_array(c.forward).xyz();
        prop_assert!((forward - toward.normalize()).length() < 1e-4);
        prop_assert_eq!(c.clip_w[1] == 0.0, projection.name.contains("orthographic"));
    }
}

#[test]
fn sky_is_the_far_plane_of_each_encoding() {
    for (depth, sky, surface) in [
        (DepthEncoding::Device, vec![1.0, 1.5], vec![0.0, 0.5, 0.999_999]),
        (DepthEncoding::ReversedDevice, vec![0.0, -1.0], vec![1.0, 0.5, 1e-6]),
        (DepthEncoding::Linear, vec![0.0, -1.0], vec![1e-6, 1.0, 1e20]),
    ] {
        let mut settings = Settings::default();
        settings.conventions.depth = depth;
        let mut denoiser = Denoiser::new(&settings, SIZE).unwrap();
        let camera = Camera {
            world_to_view: Mat4::IDENTITY,
            view_to_clip: rh::proj::directx::perspective(1.0, 1.6, 0.1, 10.0),
            jitter: Vec2::ZERO,
        };
        let [low, high] = denoiser.next_frame(&FrameInputs::new(camera, SIZE)).unwrap().constants.sky_depth;
        assert!(sky.iter().all(|d| *d <= low || *d >= high), "{depth:?}");
        assert!(surface.iter().all(|d| *d > low && *d < high), "{depth:?}");
    }
}
