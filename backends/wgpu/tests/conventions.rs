//! The same surfaces in every encoding give the same image, and wrong ones do not.

mod support;

use glam::{DMat4, DVec3, Mat4, UVec2, Vec2, Vec3, camera::lh, camera::rh};
use limpid::settings::{Channel, DepthEncoding, NdcY, NormalEncoding, RoughnessEncoding};
use limpid::{Camera, FrameInputs, Settings};
use support::{Denoised, Gpu, HALF_STEP, Pixel, Run, Scene, by_motion_only, jitter_of, noise, pipelines};

const SIZE: UVec2 = UVec2::new(72, 56);
const FRAMES: u32 = 6;
const NEAR: f32 = 0.1;
const FAR: f32 = 200.0;
const FIELD_OF_VIEW: f32 = 1.0;
const ASPECT: f32 = SIZE.x as f32 / SIZE.y as f32;

/// How a renderer encodes what it shows.
struct Renderer {
    name: &'static str,
    tell: fn(&mut Settings),
    view_to_clip: Mat4,
    left_handed: bool,
    roughness_channel: usize,
    jittered: bool,
    motion_includes_jitter: bool,
    /// From linear depth, uv motion and the rest as they are, and device depth.
    encode: fn(Pixel, f32) -> Pixel,
}

fn plain(name: &'static str) -> Renderer {
    Renderer {
        name,
        tell: |_| (),
        view_to_clip: rh::proj::directx::perspective(FIELD_OF_VIEW, ASPECT, NEAR, FAR),
        left_handed: false,
        roughness_channel: 0,
        jittered: false,
        motion_includes_jitter: false,
        encode: |pixel, _| pixel,
    }
}

/// World axes that favour none of the view's: the plane's normal points down, to the left and away from +z.
fn world_axes() -> DMat4 {
    DMat4::from_rotation_y(0.7) * DMat4::from_rotation_x(2.6)
}

fn right_handed_view(frame: u32) -> DMat4 {
    let step = f64::from(frame);
    let eye = DVec3::new(0.04 * step, 0.03 * step, 0.05 * step);
    DMat4::from_rotation_y(0.004 * step) * DMat4::from_rotation_x(-0.003 * step) * DMat4::from_translation(-eye)
}

/// The uv at which the plain renderer shows a point.
fn shown_at(frame: u32, world: DVec3) -> Vec2 {
    let clip = plain("").view_to_clip.as_dmat4() * right_handed_view(frame) * world.extend(1.0);
    Vec2::new((0.5 + 0.5 * clip.x / clip.w) as f32, (0.5 - 0.5 * clip.y / clip.w) as f32)
}

/// A slanted, textured, noisy plane. What lies in front of the camera is the same for all renderers.
fn plane(renderer: &Renderer, frame: u32) -> (Scene, FrameInputs) {
    let normal = DVec3::new(0.3, 0.5, 1.0).normalize();
    let view_to_world = right_handed_view(frame).inverse();
    let eye = view_to_world.w_axis.truncate();
    let jitter = if renderer.jittered { jitter_of(frame) } else { Vec2::ZERO };
    let jitter_before = if renderer.jittered { jitter_of(frame.saturating_sub(1)) } else { Vec2::ZERO };
    // What the camera sees beside the centre of a pixel is shown at the centre: images move against the jitter.
    let jitter_motion = (jitter_before - jitter) / SIZE.as_vec2();
    let handedness = DMat4::from_scale(DVec3::new(1.0, 1.0, if renderer.left_handed { -1.0 } else { 1.0 }));
    let camera = Camera {
        world_to_view: (handedness * right_handed_view(frame) * world_axes().inverse()).as_mat4(),
        view_to_clip: renderer.view_to_clip,
        jitter,
    };
    let projection = plain("").view_to_clip.as_dmat4();
    let mut scene = Scene::new(SIZE, |p| {
        let uv = (p.as_dvec2() + 0.5 + jitter.as_dvec2()) / SIZE.as_dvec2();
        let on_view =
            DVec3::new((2.0 * uv.x - 1.0) / projection.x_axis.x, (1.0 - 2.0 * uv.y) / projection.y_axis.y, -1.0);
        let ray = view_to_world.transform_vector3(on_view);
        let depth = (DVec3::new(0.0, 0.0, -5.0) - eye).dot(normal) / ray.dot(normal);
        let world = eye + ray * depth;
        let motion = shown_at(frame, world) - shown_at(frame.saturating_sub(1), world);
        let texture = 1.0 + 0.5 * (2.0 * world.x).sin() * (3.0 * world.y).cos();
        let clip = renderer.view_to_clip.as_dmat4() * handedness * right_handed_view(frame) * world.extend(1.0);
        let pixel = Pixel {
            radiance: Vec3::new(1.0, 0.8, 0.5) * texture as f32 * (0.8 + 0.4 * noise(frame, p)),
            hit_distance: 1.5,
            normal: world_axes().transform_vector3(normal).as_vec3(),
            roughness: 0.6,
            depth: depth as f32,
            motion: if renderer.motion_includes_jitter { motion + jitter_motion } else { motion },
        };
        (renderer.encode)(pixel, (clip.z / clip.w) as f32)
    });
    scene.roughness_channel = renderer.roughness_channel;
    (scene, FrameInputs::new(camera, SIZE))
}

fn render(gpu: &Gpu, base: &Settings, renderer: &Renderer) -> Vec<Denoised> {
    let mut settings = base.clone();
    (renderer.tell)(&mut settings);
    let mut run = Run::new(gpu, &settings, SIZE);
    let frames = (0..FRAMES).map(|frame| {
        let (scene, inputs) = plane(renderer, frame);
        run.frame(&scene, &inputs)
    });
    frames.collect()
}

/// Largest relative difference of radiance in the last frame, and the mean one.
fn difference(a: &[Denoised], b: &[Denoised]) -> (f32, f32) {
    let (a, b) = (&a[a.len() - 1].output, &b[b.len() - 1].output);
    let differences: Vec<f32> =
        a.iter().zip(b).flat_map(|(a, b)| (0..3).map(move |i| (a[i] / b[i] - 1.0).abs())).collect();
    (differences.iter().copied().fold(0.0, f32::max), differences.iter().sum::<f32>() / differences.len() as f32)
}

fn assert_all_agree(bases: &[Settings], plain: &Renderer, others: &[Renderer], wrong: &[Renderer]) {
    let Some(gpu) = Gpu::open() else { return };
    bases.iter().for_each(|base| assert_agree(&gpu, base, plain, others, wrong));
}

fn assert_agree(gpu: &Gpu, base: &Settings, plain: &Renderer, others: &[Renderer], wrong: &[Renderer]) {
    let expected = render(gpu, base, plain);
    expected.iter().for_each(|frame| frame.assert_usable(plain.name));
    for renderer in others {
        let (largest, mean) = difference(&render(gpu, base, renderer), &expected);
        // Decoding rounds, which moves history by less than 1/1000 pixel: now and then a half is stored one
        // step off, and goes into the next frame.
        let agrees = largest < 2.5 * HALF_STEP && mean < 0.05 * HALF_STEP;
        assert!(agrees, "{}: largest {largest}, mean {mean}", renderer.name);
    }
    for renderer in wrong {
        let (largest, mean) = difference(&render(gpu, base, renderer), &expected);
        // More than 1 % in the mean, where agreement is a hundred times better.
        assert!(mean > 10.0 * HALF_STEP, "{} goes unnoticed: largest {largest}, mean {mean}", renderer.name);
    }
}

#[test]
fn depth_and_clip_space_may_be_encoded_in_any_way() {
    use DepthEncoding::{Device, ReversedDevice};
    let mut flipped = rh::proj::directx::perspective(FIELD_OF_VIEW, ASPECT, NEAR, FAR);
    flipped.y_axis.y *= -1.0;
    let device = |name, view_to_clip| Renderer {
        tell: |settings| settings.conventions.depth = Device,
        view_to_clip,
        encode: |pixel, depth| Pixel { depth, ..pixel },
        ..plain(name)
    };
    let reversed = |name, view_to_clip| Renderer {
        tell: |settings| settings.conventions.depth = ReversedDevice,
        ..device(name, view_to_clip)
    };
    assert_all_agree(
        &pipelines(),
        &plain("plain"),
        &[
            device("standard", rh::proj::directx::perspective(FIELD_OF_VIEW, ASPECT, NEAR, FAR)),
            device("infinite", rh::proj::directx::perspective_infinite(FIELD_OF_VIEW, ASPECT, NEAR)),
            reversed("reversed", rh::proj::directx::perspective(FIELD_OF_VIEW, ASPECT, FAR, NEAR)),
            reversed("reversed infinite", rh::proj::directx::perspective_infinite_reverse(FIELD_OF_VIEW, ASPECT, NEAR)),
            Renderer {
                left_handed: true,
                ..reversed(
                    "left-handed reversed infinite",
                    lh::proj::directx::perspective_infinite_reverse(FIELD_OF_VIEW, ASPECT, NEAR),
                )
            },
            Renderer {
                tell: |settings| {
                    settings.conventions.depth = Device;
                    settings.conventions.ndc_y = NdcY::Down;
                },
                ..device("y down", flipped)
            },
        ],
        &[Renderer {
            tell: |settings| settings.conventions.ndc_y = NdcY::Down,
            ..plain("y down, but told so wrongly")
        }],
    );
}

/// Octahedral map after Meyer et al. 2010, -1 to 1.
fn octahedral(n: Vec3) -> Vec3 {
    let p = n / (n.x.abs() + n.y.abs() + n.z.abs());
    if p.z >= 0.0 {
        return Vec3::new(p.x, p.y, f32::NAN);
    }
    Vec3::new((1.0 - p.y.abs()) * 1f32.copysign(p.x), (1.0 - p.x.abs()) * 1f32.copysign(p.y), f32::NAN)
}

#[test]
fn normal_and_roughness_may_be_encoded_in_any_way() {
    assert_all_agree(
        &pipelines(),
        &plain("plain"),
        &[
            Renderer { encode: |p, _| Pixel { normal: 3.0 * p.normal, ..p }, ..plain("normals of length 3") },
            Renderer {
                tell: |settings| settings.conventions.normal = NormalEncoding::Unsigned,
                encode: |p, _| Pixel { normal: p.normal * 0.5 + 0.5, ..p },
                ..plain("unsigned normals")
            },
            Renderer {
                tell: |settings| settings.conventions.normal = NormalEncoding::Octahedral,
                encode: |p, _| Pixel { normal: octahedral(p.normal), ..p },
                ..plain("octahedral normals")
            },
            Renderer {
                tell: |settings| {
                    settings.conventions.normal = NormalEncoding::OctahedralUnsigned;
                    settings.conventions.roughness_channel = Channel::Blue;
                },
                encode: |p, _| Pixel { normal: octahedral(p.normal) * 0.5 + 0.5, ..p },
                roughness_channel: 2,
                ..plain("unsigned octahedral normals, roughness in blue")
            },
            Renderer {
                tell: |settings| {
                    settings.conventions.roughness = RoughnessEncoding::Alpha;
                    settings.conventions.roughness_channel = Channel::Alpha;
                },
                encode: |p, _| Pixel { roughness: p.roughness * p.roughness, ..p },
                roughness_channel: 3,
                ..plain("GGX alpha in alpha")
            },
            Renderer {
                tell: |settings| settings.conventions.roughness_channel = Channel::Green,
                roughness_channel: 1,
                ..plain("roughness in green")
            },
        ],
        &[],
    );
}

#[test]
fn motion_may_have_any_scale_and_a_wrong_one_shows() {
    assert_all_agree(
        &pipelines().map(by_motion_only),
        &plain("plain"),
        &[
            Renderer {
                tell: |settings| settings.conventions.motion_scale = Vec2::new(0.5, -0.5),
                encode: |p, _| Pixel { motion: p.motion * Vec2::new(2.0, -2.0), ..p },
                ..plain("ndc")
            },
            Renderer {
                tell: |settings| settings.conventions.motion_scale = -1.0 / SIZE.as_vec2(),
                encode: |p, _| Pixel { motion: -p.motion * SIZE.as_vec2(), ..p },
                ..plain("pixels, backwards")
            },
        ],
        &[
            Renderer { encode: |p, _| Pixel { motion: -p.motion, ..p }, ..plain("motion with the wrong sign") },
            Renderer { encode: |p, _| Pixel { motion: Vec2::ZERO, ..p }, ..plain("no motion") },
        ],
    );
}

#[test]
fn motion_may_include_jitter() {
    let jittered = |name| Renderer { jittered: true, ..plain(name) };
    assert_all_agree(
        &pipelines().map(by_motion_only),
        &jittered("jittered"),
        &[Renderer {
            tell: |settings| settings.conventions.motion_includes_jitter = true,
            motion_includes_jitter: true,
            ..jittered("motion includes jitter")
        }],
        &[Renderer { motion_includes_jitter: true, ..jittered("motion includes jitter untold") }],
    );
}
