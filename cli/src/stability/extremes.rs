//! Extreme values of radiance, hit distance, roughness and normals.

use glam::{UVec2, Vec3};
use limpid::Settings;
use limpid::settings::Number;

use super::case::{Case, Criterion, Pixel, Step, noise};

/// The largest finite half float.
const HALF_MAX: f32 = 65504.0;
/// The smallest half float above 0, and the smallest that has all its digits.
const HALF_DENORMAL: f32 = 5.960_464_5e-8;
const HALF_TINY: f32 = 6.103_515_6e-5;

/// Where single pixels differ.
const SPOT: UVec2 = UVec2::new(19, 11);
/// How far a pixel's value may reach in the frame it appears in: its tile's average reaches three tiles, and their
/// neighbourhoods four pixels more.
const REACH: u32 = 24;

fn is_on(p: UVec2, block: u32) -> bool {
    (p.x / block + p.y / block).is_multiple_of(2)
}

/// A calm, slightly noisy wall.
fn calm(frame: usize, p: UVec2) -> Pixel {
    Pixel::lit(0.75 + 0.5 * noise(frame, p))
}

fn spoilt(value: f32) -> impl Fn(usize, UVec2) -> Pixel + Sync {
    move |frame, p| if frame == 3 && p == SPOT { Pixel::lit(value) } else { calm(frame, p) }
}

/// Radiance.
pub(super) fn radiance() -> Vec<Case> {
    const GROUP: &str = "radiance";
    let constant = |name: &str, value: f32| {
        Case::new(GROUP, name, move |_, _| Pixel::lit(value)).must(Criterion::Energy(0.995, 1.005))
    };
    let spot = |name: &str, value: f32| {
        Case::new(GROUP, name, spoilt(value)).lasting(44).against(spoilt(0.0)).must(Criterion::Contained {
            at: SPOT,
            frame: 3,
            reach: 0,
            lifetime: 0,
        })
    };
    let mut cases = vec![
        constant("the smallest half float above 0", HALF_DENORMAL).must(Criterion::AtRest),
        constant("the smallest normal half float", HALF_TINY),
        constant("one", 1.0).must(Criterion::AtRest),
        constant("257, whose square no half float holds", 257.0),
        constant("the largest half float", HALF_MAX),
        Case::new(GROUP, "beyond the largest half float", |_, _| Pixel::lit(1e9)),
        Case::new(GROUP, "black", |_, _| Pixel::lit(0.0)).must(Criterion::AtRest),
        Case::new(GROUP, "negative", |_, _| Pixel::lit(-3.0)),
        Case::new(GROUP, "negative zero", |_, _| Pixel::lit(-0.0)),
        Case::new(GROUP, "negative and positive pixel by pixel", |_, p| {
            Pixel::lit(if is_on(p, 1) { -5.0 } else { 5.0 })
        }),
        Case::new(GROUP, "contrast of 1e10 pixel by pixel", |_, p| {
            Pixel::lit(if is_on(p, 1) { HALF_MAX } else { 6e-6 })
        }),
        Case::new(GROUP, "contrast of 1e10 in blocks of 5", |_, p| {
            Pixel::lit(if is_on(p, 5) { HALF_MAX } else { 6e-6 })
        }),
        Case::new(GROUP, "contrast of 1e10, channel by channel", |_, p| {
            let channel = |c: u32| if (p.x + p.y + c).is_multiple_of(3) { HALF_MAX } else { 6e-6 };
            Pixel { radiance: [channel(0), channel(1), channel(2), 3.0], ..Pixel::WALL }
        }),
        Case::new(GROUP, "half of the pixels the largest half float, at random", |frame, p| {
            Pixel::lit(if noise(frame, p) < 0.5 { HALF_MAX } else { 0.0 })
        })
        .lasting(24)
        .must(Criterion::Energy(0.9, 1.1)),
        Case::new(GROUP, "noise of a factor of 30 at exposures near 1", |frame, p| {
            Pixel::lit(0.1 * 30f32.powf(noise(frame, p)))
        })
        .lasting(40)
        .must(Criterion::Energy(0.9, 1.1)),
        Case::new(GROUP, "NaN everywhere", |_, _| Pixel::lit(f32::NAN)),
        Case::new(GROUP, "infinity everywhere", |_, _| Pixel::lit(f32::INFINITY)),
        Case::new(GROUP, "a twentieth NaN, a twentieth infinite", |frame, p| match noise(frame, p) {
            n if n < 0.05 => Pixel::lit(f32::NAN),
            n if n < 0.1 => Pixel::lit(f32::INFINITY),
            _ => calm(frame, p),
        }),
        Case::new(GROUP, "the largest half float at an exposure of 1e-4", |_, _| Pixel::lit(HALF_MAX))
            .stepped(|_| exposed(1e-4))
            .must(Criterion::Energy(0.995, 1.005)),
        Case::new(GROUP, "the smallest normal half float at an exposure of 1e4", |_, _| Pixel::lit(HALF_TINY))
            .stepped(|_| exposed(1e4))
            .must(Criterion::Energy(0.995, 1.005)),
        Case::new(GROUP, "exposed radiance above all half floats", |_, _| Pixel::lit(1e3)).stepped(|_| exposed(1e3)),
        Case::new(GROUP, "the smallest exposure", calm).stepped(|_| exposed(f32::MIN_POSITIVE)),
        Case::new(GROUP, "exposure that jumps by 1e4 every frame", |_, _| Pixel::lit(1.0))
            .lasting(24)
            .stepped(|frame| exposed(if frame % 2 == 0 { 1e-2 } else { 1e2 }))
            .must(Criterion::Energy(0.9, 1.1)),
        // Of what is cut off up to 8 times the mean comes back, into a mean of up to 32 frames: a quarter when that
        // is full, and a twentieth 51 frames later.
        Case::new(GROUP, "a firefly of the largest half float", spoilt(HALF_MAX))
            .lasting(100)
            .against(calm)
            .must(Criterion::Contained { at: SPOT, frame: 3, reach: REACH, lifetime: 90 }),
        Case::new(GROUP, "fireflies at random in every frame", |frame, p| {
            Pixel::lit(if noise(frame, p) < 0.002 { 3e4 } else { 0.01 })
        })
        .lasting(32)
        .must(Criterion::Energy(0.9, 1.1)),
    ];
    for (name, value) in [("NaN", f32::NAN), ("infinity", f32::INFINITY), ("minus infinity", f32::NEG_INFINITY)] {
        cases.push(spot(&format!("{name} at one pixel, the same as black there"), value));
        cases.push(
            Case::new(GROUP, format!("{name} at one pixel, soon forgotten"), spoilt(value))
                .lasting(44)
                .against(calm)
                .must(Criterion::Contained { at: SPOT, frame: 3, reach: REACH, lifetime: 40 }),
        );
    }
    cases
}

fn exposed(exposure: f32) -> Step {
    Step { exposure, ..Step::still(UVec2::new(40, 24)) }
}

/// Hit distance.
pub(super) fn hit_distance() -> Vec<Case> {
    let values = [0.0, -1.0, 1e-7, 1e4, HALF_MAX, f32::INFINITY, f32::NEG_INFINITY, f32::NAN];
    let case = |value: f32| {
        Case::new("hit distance", format!("{value:e}"), move |frame, p| {
            let Pixel { radiance: [r, g, b, _], .. } = calm(frame, p);
            // Smooth enough for the mirrored point to count.
            Pixel { radiance: [r, g, b, value], roughness: 0.1, ..Pixel::WALL }
        })
        .lasting(16)
        // The camera moves, or both places of history would be the same.
        .stepped(|frame| Step::still(UVec2::new(40, 24)).at(Vec3::X * 0.02 * frame as f32))
    };
    values.into_iter().map(case).collect()
}

/// Roughness, at and next to every threshold.
pub(super) fn roughness() -> Vec<Case> {
    // Mirrors end, the Reference preset ends, all roughness ends.
    let thresholds = [0.01f32, 0.447_213_6, 1.0];
    let around = thresholds.into_iter().flat_map(|value| [value.next_down(), value, value.next_up()]);
    let values = [0.0, 1e-4, 1e-20, 0.05, -0.1, 7.0, f32::NAN, f32::INFINITY].into_iter().chain(around);
    let uniform = |value: f32| {
        Case::new("roughness", format!("{value:?}"), move |frame, p| Pixel { roughness: value, ..calm(frame, p) })
            .lasting(16)
    };
    let mixed = Case::new("roughness", "0 and 1 pixel by pixel, swapped every frame", |frame, p| Pixel {
        roughness: if is_on(p + frame as u32, 1) { 0.0 } else { 1.0 },
        ..calm(frame, p)
    });
    values.map(uniform).chain([mixed.lasting(16)]).collect()
}

/// Normals.
pub(super) fn normals() -> Vec<Case> {
    const GROUP: &str = "normals";
    let uniform = |name: &str, normal: [f32; 3]| {
        Case::new(GROUP, name, move |frame, p| Pixel { normal, ..calm(frame, p) }).lasting(12)
    };
    let grazing = |angle: f32| [angle.cos(), 0.0, angle.sin()];
    vec![
        Case::new(GROUP, "zero beside one that is not", |frame, p| {
            let normal = if p == UVec2::ZERO { [0.0, 0.0, 1.0] } else { [0.0; 3] };
            Pixel { normal, ..calm(frame, p) }
        })
        .lasting(12),
        uniform("NaN", [f32::NAN; 3]),
        uniform("infinite", [f32::INFINITY, 0.0, 0.0]),
        uniform("1e-20 long", [0.0, 0.0, 1e-20]),
        uniform("1e19 long", [0.0, 0.0, 1e19]),
        uniform("at a right angle to the view", grazing(0.0)),
        uniform("1e-4 above grazing", grazing(1e-4)),
        uniform("turned away", [0.0, 0.0, -1.0]),
        uniform("along an axis of the octahedral map", [-1.0, 0.0, -0.0]),
        Case::new(GROUP, "turned around every frame", |frame, p| {
            let z = if frame % 2 == 0 { 1.0 } else { -1.0 };
            Pixel { normal: [0.0, 0.0, z], ..calm(frame, p) }
        })
        .lasting(12),
        Case::new(GROUP, "turned around pixel by pixel", |frame, p| Pixel {
            normal: [0.0, 0.0, if is_on(p, 1) { 1.0 } else { -1.0 }],
            ..calm(frame, p)
        }),
        Case::new(GROUP, "noise of 8-bit quantisation in every frame", |frame, p| {
            let step = |seed: usize| (noise(frame + seed, p) - 0.5) / 127.0;
            Pixel { normal: [step(50), step(90), 1.0], ..Pixel::lit(1.0) }
        })
        .lasting(24)
        .must(Criterion::Energy(0.995, 1.005))
        .must(Criterion::AtRest),
        Case::new(GROUP, "at random", |frame, p| {
            let value = |seed: usize| noise(frame + seed, p) * 2.0 - 1.0;
            Pixel { normal: [value(50), value(90), value(130)], ..calm(frame, p) }
        }),
    ]
}

/// Every constant of every pass at an end of its range.
fn with_all(settings: &mut Settings, value: fn(&Number) -> f32) {
    let mut json = serde_json::to_value(&*settings).expect("settings can be serialised");
    for number in Settings::numbers() {
        let pointer = format!("/{}", number.path.replace('.', "/"));
        *json.pointer_mut(&pointer).expect("the path is a setting") = value(number).into();
    }
    *settings = serde_json::from_value(json).expect("a number is still a number");
}

type Painter = (&'static str, fn(usize, UVec2) -> Pixel);
type Change = (&'static str, fn(&mut Settings));

/// Settings.
pub(super) fn settings() -> Vec<Case> {
    let paints: [Painter; 3] = [
        ("calm", calm),
        ("contrast of 1e10", |_, p| Pixel::lit(if is_on(p, 3) { HALF_MAX } else { 6e-6 })),
        ("sprinkled with NaN", |frame, p| if noise(frame, p) < 0.05 { Pixel::lit(f32::NAN) } else { calm(frame, p) }),
    ];
    let ends: [Change; 2] = [
        ("least", |settings| with_all(settings, |number| number.low)),
        ("most", |settings| with_all(settings, |number| number.high)),
    ];
    let case = |(end, change): Change, (name, paint): Painter| {
        Case::new("settings", format!("every constant at its {end}, {name}"), paint).lasting(16).with(change)
    };
    ends.into_iter().flat_map(|end| paints.into_iter().map(move |paint| case(end, paint))).collect()
}
