//! A drive through thin poles, with a cut.

use super::*;

/// Thin poles at dusk; the camera rushes past them and cuts at frame 12.
pub(super) fn scene() -> Scene {
    let mut objects = vec![road()];
    objects.extend(poles());
    objects.extend(lanterns());
    objects.extend(landmarks());
    let travel = vec3(0.0, 0.0, -3.0);
    Scene {
        name: "dolly",
        description: "Forward dolly through thin poles over a wet road at dusk, with a camera \
                      cut at frame 12.",
        objects,
        sky: Sky {
            zenith: vec3(0.1, 0.14, 0.32),
            horizon: vec3(0.85, 0.48, 0.3),
            ground: vec3(0.1, 0.09, 0.1),
            sun: None,
        },
        ambient: vec3(0.4, 0.36, 0.38),
        shots: vec![
            Shot { eye: vec3(0.15, 1.35, 6.5), target: vec3(0.0, 1.0, 0.0), travel, ..Shot::default() },
            Shot { first: 12, eye: vec3(-2.4, 0.9, 4.2), target: vec3(0.6, 0.9, -2.0), travel, ..Shot::default() },
        ],
        frames_per_second: FRAMES_PER_SECOND,
    }
}

/// Wet asphalt.
fn road() -> Object {
    let asphalt = Pattern::Clouds { colors: [vec3(0.16, 0.16, 0.17), vec3(0.34, 0.33, 0.32)], size: 1.0 };
    let wet = Finish::Patches { range: [0.05, 0.38], size: 1.6 };
    Object::floor(Vec3::ZERO, vec2(24.0, 24.0), asphalt, wet)
}

/// Two loose rows of thin poles in changing colours.
fn poles() -> impl Iterator<Item = Object> {
    let colors = [plain(0.8, 0.78, 0.7), plain(0.75, 0.2, 0.12), plain(0.15, 0.4, 0.65), plain(0.85, 0.6, 0.15)];
    (0..18).map(move |k| {
        let step = k as f32;
        let side = if k % 2 == 0 { -1.0 } else { 1.0 };
        let x = side * (0.75 + 0.42 * (k % 5) as f32);
        let z = 4.6 - 0.85 * step;
        cylinder(vec3(x, 1.2, z), 0.045, 1.2, colors[k % 4], 0.2)
    })
}

/// Small lamps on some of the way.
fn lanterns() -> Vec<Object> {
    vec![
        Object::lamp(vec3(-1.25, 2.2, 1.6), 0.1, vec3(90.0, 62.0, 34.0)),
        Object::lamp(vec3(1.35, 2.1, -1.8), 0.1, vec3(90.0, 62.0, 34.0)),
        Object::lamp(vec3(-1.6, 2.1, -5.4), 0.1, vec3(40.0, 70.0, 95.0)),
        Object::lamp(vec3(0.9, 0.9, 0.4), 0.03, vec3(420.0, 170.0, 90.0)),
    ]
}

/// Larger things between the poles.
fn landmarks() -> Vec<Object> {
    let checks = Pattern::Checker { colors: [vec3(0.8, 0.75, 0.65), vec3(0.12, 0.3, 0.3)], size: 0.25 };
    vec![
        sphere(vec3(0.3, 0.45, 0.2), 0.45, plain(0.95, 0.95, 0.95), 0.0),
        sphere(vec3(-0.9, 0.3, 2.6), 0.3, plain(0.85, 0.45, 0.2), 0.1),
        cuboid(vec3(-0.7, 0.5, -2.6), Vec3::splat(0.5), checks, 0.15)
            .moving(Movement { spin: Vec3::Y * 1.5, ..Movement::default() }),
        cuboid(vec3(3.4, 1.2, -4.0), vec3(0.8, 1.2, 1.2), checks, 0.3),
        cuboid(vec3(-4.0, 1.0, -1.5), vec3(0.9, 1.0, 1.6), plain(0.6, 0.3, 0.25), 0.35),
    ]
}
