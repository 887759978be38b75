//! Extreme depth, motion, cameras, units and sizes.

use glam::{Mat4, UVec2, Vec2, Vec3, camera::rh};
use limpid::Settings;
use limpid::settings::DepthEncoding;

use super::case::{Case, Criterion, Pixel, Step, noise};

const SIZE: UVec2 = UVec2::new(40, 24);

fn lit(frame: usize, p: UVec2) -> Pixel {
    Pixel::lit(0.5 + noise(frame, p))
}

fn device(settings: &mut Settings) {
    settings.conventions.depth = DepthEncoding::Device;
}

fn reversed(settings: &mut Settings) {
    settings.conventions.depth = DepthEncoding::ReversedDevice;
}

fn projected(view_to_clip: Mat4) -> Step {
    let mut step = Step::still(SIZE);
    step.camera.view_to_clip = view_to_clip;
    step
}

/// Depth, linear and as buffers hold it.
pub(super) fn depth() -> Vec<Case> {
    const GROUP: &str = "depth";
    let uniform = |name: &str, depth: f32| {
        Case::new(GROUP, format!("linear {name}"), move |frame, p| Pixel { depth, ..lit(frame, p) }).lasting(12)
    };
    let in_buffer = |name: &str, depth: f32| {
        Case::new(GROUP, format!("device {name}"), move |frame, p| Pixel { depth, ..lit(frame, p) })
            .lasting(12)
            .with(device)
    };
    let infinite = |name: &str, depth: f32| {
        Case::new(GROUP, format!("reversed infinite {name}"), move |frame, p| Pixel { depth, ..lit(frame, p) })
            .lasting(12)
            .with(reversed)
            .stepped(|_| projected(rh::proj::directx::perspective_infinite_reverse(1.0, 40.0 / 24.0, 0.1)))
    };
    vec![
        uniform("1e-30", 1e-30),
        uniform("1e-38", 1e-38),
        uniform("1e-6", 1e-6),
        uniform("1e6", 1e6),
        uniform("1e29", 1e29),
        uniform("3e38", 3e38),
        uniform("-1", -1.0),
        uniform("NaN", f32::NAN),
        uniform("infinite", f32::INFINITY),
        in_buffer("0, the near plane", 0.0),
        in_buffer("smallest above 0", f32::MIN_POSITIVE),
        in_buffer("just below 1", 1f32.next_down()),
        in_buffer("1, the far plane", 1.0),
        in_buffer("beyond the far plane", 1.5),
        in_buffer("before the near plane", -0.5),
        infinite("just above 0", 1e-30),
        infinite("1e-7", 1e-7),
        infinite("0", 0.0),
        infinite("1, the near plane", 1.0),
        infinite("before the near plane", 7.0),
        Case::new(GROUP, "from 1e-3 to 1e6 across the image", |frame, p| Pixel {
            depth: 10f32.powf(p.x as f32 / 39.0 * 9.0 - 3.0),
            ..lit(frame, p)
        })
        .lasting(12),
        Case::new(GROUP, "1e-3 and 1e6 pixel by pixel", |frame, p| Pixel {
            depth: if (p.x + p.y).is_multiple_of(2) { 1e-3 } else { 1e6 },
            ..lit(frame, p)
        })
        .lasting(12),
        Case::new(GROUP, "surface and sky pixel by pixel, swapped every frame", |frame, p| {
            let is_sky = (p.x as usize + p.y as usize + frame).is_multiple_of(2);
            Pixel { depth: if is_sky { 0.0 } else { 4.0 }, ..lit(frame, p) }
        })
        .lasting(12),
        Case::new(GROUP, "a floor up to the horizon", |frame, p| {
            // One unit below the eye.
            let below = (p.y as f32 + 0.5 - 12.0) / 12.0 * 0.5f32.tan();
            let depth = if below > 0.0 { 1.0 / below } else { 0.0 };
            Pixel { depth, normal: [0.0, 1.0, 0.0], ..lit(frame, p) }
        })
        .lasting(12),
    ]
}

/// Motion vectors.
pub(super) fn motion() -> Vec<Case> {
    let case = |name: &str, motion: [f32; 2]| {
        Case::new("motion", name, move |frame, p| Pixel { motion, ..lit(frame, p) }).lasting(12)
    };
    let pixel = [1.0 / 40.0, 1.0 / 24.0];
    vec![
        case("NaN", [f32::NAN; 2]),
        case("infinite", [f32::INFINITY, f32::NEG_INFINITY]),
        case("3e38", [3e38, -3e38]),
        case("1e-40", [1e-40, -1e-40]),
        case("exactly half a pixel", [0.5 * pixel[0], 0.5 * pixel[1]]),
        case("exactly a pixel", pixel),
        case("off screen", [1.5, 0.0]),
        case("exactly to the border", [1.0, 1.0]),
        Case::new("motion", "at random, up to 1000 pixels", |frame, p| {
            let value = |seed: usize| (noise(frame + seed, p) - 0.5) * 50.0;
            Pixel { motion: [value(7), value(9)], ..lit(frame, p) }
        })
        .lasting(12),
        Case::new("motion", "exactly half a pixel, constant radiance", move |_, _| Pixel {
            motion: [0.5 * pixel[0], 0.5 * pixel[1]],
            ..Pixel::lit(0.3)
        })
        .lasting(64)
        .must(Criterion::Energy(0.995, 1.005)),
    ]
}

/// World units: everything, the depth falloff included, means the same at every scale.
fn scaled(unit: f32, frame: usize, p: UVec2) -> Pixel {
    let Pixel { radiance: [r, g, b, hit], depth, .. } = lit(frame, p);
    Pixel { radiance: [r, g, b, hit * unit], depth: depth * unit, ..Pixel::WALL }
}

/// Cameras and units.
pub(super) fn cameras() -> Vec<Case> {
    const GROUP: &str = "cameras";
    let units = |unit: f32| {
        Case::new(GROUP, format!("{unit:e} world units a metre"), move |frame, p| scaled(unit, frame, p))
            .lasting(12)
            .stepped(move |frame| {
                let mut step = Step::still(SIZE).at(Vec3::new(0.01 * frame as f32, 0.0, 0.0) * unit);
                step.camera.view_to_clip = rh::proj::directx::perspective(1.0, 40.0 / 24.0, 0.1 * unit, 500.0 * unit);
                step
            })
    };
    let refused = |name: &str, message: &'static str, camera: fn(&mut limpid::Camera)| {
        Case::new(GROUP, name, lit).lasting(3).must(Criterion::Refused(message)).stepped(move |frame| {
            let mut step = Step::still(SIZE);
            if frame == 2 {
                camera(&mut step.camera);
            }
            step
        })
    };
    let opening = |name: &str, angle: f32| {
        Case::new(GROUP, name, lit)
            .lasting(12)
            .stepped(move |_| projected(rh::proj::directx::perspective(angle, 40.0 / 24.0, 0.1, 500.0)))
    };
    vec![
        units(1e-4),
        units(1e-2),
        units(1e3),
        units(1e6),
        opening("field of view of 0.001 degrees", 1.7e-5),
        opening("field of view of 179.9 degrees", 179.9f32.to_radians()),
        Case::new(GROUP, "near and far plane almost the same", lit)
            .lasting(12)
            .with(device)
            .stepped(|_| projected(rh::proj::directx::perspective(1.0, 40.0 / 24.0, 4.0, 4.0001))),
        Case::new(GROUP, "near plane 1e-6, far plane 1e9", |frame, p| Pixel { depth: 0.999_999_9, ..lit(frame, p) })
            .lasting(12)
            .with(device)
            .stepped(|_| projected(rh::proj::directx::perspective(1.0, 40.0 / 24.0, 1e-6, 1e9))),
        Case::new(GROUP, "1e7 units from the origin, moving", lit)
            .lasting(12)
            .stepped(|frame| Step::still(SIZE).at(Vec3::splat(1e7) + Vec3::X * frame as f32)),
        Case::new(GROUP, "leaping by 1e9 units every frame", lit)
            .lasting(12)
            .stepped(|frame| Step::still(SIZE).at(Vec3::Z * 1e9 * (frame % 2) as f32)),
        Case::new(GROUP, "jittered by half a pixel to and fro", lit).lasting(24).stepped(|frame| {
            let mut step = Step::still(SIZE);
            step.camera.jitter = Vec2::splat(if frame % 2 == 0 { 0.5 } else { -0.5 });
            step
        }),
        refused("singular projection", "singular", |camera| camera.view_to_clip.z_axis.w = 0.0),
        refused("NaN in the view matrix", "not finite", |camera| camera.world_to_view.w_axis.x = f32::NAN),
        refused("view matrix that scales", "rigid", |camera| camera.world_to_view.x_axis.x = 2.0),
        refused("infinite jitter", "jitter", |camera| camera.jitter.x = f32::INFINITY),
    ]
}

/// Image sizes.
pub(super) fn sizes() -> Vec<Case> {
    const GROUP: &str = "sizes";
    let fixed = |x: u32, y: u32| Case::new(GROUP, format!("{x}x{y}"), lit).sized(x, y).lasting(4);
    let mut cases: Vec<Case> =
        [(1, 1), (1, 9), (7, 5), (8, 8), (9, 1), (63, 65), (16384, 1), (1, 16384)].map(|(x, y)| fixed(x, y)).into();
    cases.push(Case::new(GROUP, "another size in every frame", lit).lasting(24).stepped(|frame| {
        let share = |seed| noise(frame, UVec2::splat(seed));
        let size = (SIZE.as_vec2() * Vec2::new(share(1), share(2))).as_uvec2().max(UVec2::ONE);
        Step::still(size)
    }));
    cases.push(
        Case::new(GROUP, "1x1 and the largest size in turn", |_, _| Pixel::lit(0.7))
            .lasting(12)
            .must(Criterion::Energy(0.995, 1.005))
            .stepped(|frame| Step::still(if frame % 2 == 0 { UVec2::ONE } else { SIZE })),
    );
    cases
}
