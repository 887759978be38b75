//! What happens over time: long runs, sudden changes, and changes by rounding.

use glam::{UVec2, Vec3};
use limpid::Settings;

use super::case::{Case, Criterion, Pixel, Step, noise};

const SIZE: UVec2 = UVec2::new(16, 16);

fn noisy(frame: usize, p: UVec2) -> Pixel {
    let value = 0.25 + 1.5 * noise(frame, p);
    Pixel { radiance: [value, 0.5 * value, 0.25 * value, 3.0], ..Pixel::WALL }
}

/// Runs of many frames. `frames` is how many.
pub(super) fn long(frames: usize) -> Vec<Case> {
    const GROUP: &str = "long runs";
    let case = |name: &str, paint: fn(usize, UVec2) -> Pixel| {
        Case::new(GROUP, format!("{name}, {frames} frames"), paint)
            .sized(SIZE.x, SIZE.y)
            .lasting(frames)
            .must(Criterion::NoDrift { from: 100.min(frames / 2), within: 0.02 })
    };
    vec![
        case("constant", |_, _| Pixel::lit(0.7)).must(Criterion::Energy(0.998, 1.002)).must(Criterion::AtRest),
        case("constant and hardly brighter than black", |_, _| Pixel::lit(1.3e-5)).must(Criterion::Energy(0.98, 1.02)),
        case("the same noise in every frame", |_, p| noisy(0, p)).must(Criterion::AtRest),
        case("noise", noisy),
        case("constant, drifting by a thousandth of a pixel a frame", |_, _| Pixel {
            motion: [0.001 / 16.0, 0.0007 / 16.0],
            ..Pixel::lit(0.7)
        })
        .must(Criterion::Energy(0.998, 1.002)),
        case("noise, the camera drifting by a thousandth of a unit a frame", noisy)
            .stepped(|frame| Step::still(SIZE).at(Vec3::X * 0.001 * frame as f32)),
    ]
}

fn short_history(settings: &mut Settings) {
    settings.reproject.max_history = 1.0;
    settings.reproject.min_history_cap = 1.0;
}

/// The largest count of frames, stored in the finest steps.
fn long_history(settings: &mut Settings) {
    settings.reproject.max_history = 255.0;
}

/// Sudden changes.
pub(super) fn changes() -> Vec<Case> {
    const GROUP: &str = "sudden changes";
    let step = |name: &str, before: f32, after: f32| {
        Case::new(GROUP, name, move |frame, _| Pixel::lit(if frame < 40 { before } else { after }))
            .lasting(120)
            .must(Criterion::Settles { from: 40, within: 32 })
    };
    let alternating = |name: &str, settings: fn(&mut Settings)| {
        Case::new(GROUP, name, |frame, _| Pixel::lit(if frame % 2 == 0 { 1e-2 } else { 1e2 }))
            .lasting(60)
            .with(settings)
    };
    vec![
        step("brighter by 1e4", 1e-2, 1e2),
        step("darker by 1e4", 1e2, 1e-2),
        step("to 1 from 1e4 times as much", 1e4, 1.0),
        step("from black to the largest half float", 0.0, 65504.0),
        step("from the largest half float to almost black", 65504.0, 1e-2),
        step("brighter by 1e4, history of 255 frames", 1e-2, 1e2).with(long_history),
        step("darker by 1e4, history of 255 frames", 1e2, 1e-2).with(long_history),
        Case::new(GROUP, "noise brighter by 1e4", |frame, p| {
            Pixel::lit((0.5 + noise(frame, p)) * if frame < 40 { 1e-2 } else { 1e2 })
        })
        .lasting(120)
        .must(Criterion::Settles { from: 40, within: 40 }),
        Case::new(GROUP, "noise darker by 1e4", |frame, p| {
            Pixel::lit((0.5 + noise(frame, p)) * if frame < 40 { 1e2 } else { 1e-2 })
        })
        .lasting(120)
        .must(Criterion::Settles { from: 40, within: 40 }),
        alternating("alternating by 1e4", |_| ()),
        alternating("alternating by 1e4, history of a frame", short_history),
        alternating("alternating by 1e4, history of 255 frames", long_history),
        Case::new(GROUP, "a reset in every frame", noisy)
            .lasting(40)
            .stepped(|_| Step { reset: true, ..Step::still(UVec2::new(40, 24)) }),
        Case::new(GROUP, "a reset in every frame, constant", |_, _| Pixel::lit(0.3))
            .lasting(40)
            .stepped(|_| Step { reset: true, ..Step::still(UVec2::new(40, 24)) })
            .must(Criterion::Energy(0.995, 1.005)),
    ]
}

/// Inputs that differ from each other by rounding.
pub(super) fn sensitivity() -> Vec<Case> {
    const GROUP: &str = "rounding";
    // The next half float, as far as one lies above a value near 1.
    const HALF_STEP: f32 = 1.0 + 1.0 / 1024.0;
    // The camera moves, so that places in the frame before depend on everything.
    let moving = |frame: usize| Step::still(UVec2::new(40, 24)).at(Vec3::X * 0.03 * frame as f32);
    let case = |name: &str, twin: fn(usize, UVec2) -> Pixel| {
        Case::new(GROUP, name, noisy).lasting(24).against(twin).stepped(moving)
    };
    let shifted =
        |shift: f32| move |frame: usize, p: UVec2| Pixel { motion: [shift, 0.0], roughness: 0.44, ..noisy(frame, p) };
    vec![
        case("radiance a half-float step brighter", |frame, p| {
            let pixel = noisy(frame, p);
            let [r, g, b, hit] = pixel.radiance;
            Pixel { radiance: [r * HALF_STEP, g * HALF_STEP, b * HALF_STEP, hit], ..pixel }
        })
        // The step itself, and as much again where rounding decides.
        .must(Criterion::Insensitive(2.0 / 1024.0)),
        case("depth a float step farther", |frame, p| Pixel { depth: 4f32.next_up(), ..noisy(frame, p) })
            .must(Criterion::Insensitive(1e-4)),
        case("normal a ten-thousandth off", |frame, p| Pixel { normal: [1e-4, 0.0, 1.0], ..noisy(frame, p) })
            .must(Criterion::Insensitive(5e-3)),
        case("hit distance a half-float step longer", |frame, p| {
            let pixel = noisy(frame, p);
            let [r, g, b, hit] = pixel.radiance;
            Pixel { radiance: [r, g, b, hit * HALF_STEP], ..pixel }
        })
        .must(Criterion::Insensitive(1e-4)),
        case("roughness a float step rougher", |frame, p| Pixel { roughness: 0.4f32.next_up(), ..noisy(frame, p) })
            .must(Criterion::Insensitive(0.0)),
        Case::new(GROUP, "motion of half a pixel, a float step longer", shifted(0.5 / 40.0))
            .lasting(24)
            .against(shifted((0.5f32 / 40.0).next_up()))
            .must(Criterion::Insensitive(1e-3)),
    ]
}
