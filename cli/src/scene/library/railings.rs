//! A drive over a bridge, past its railings.

use super::*;
use std::f32::consts::FRAC_PI_2;

/// Bars about a pixel wide; the camera drives past them at 15 m/s, and from frame 12 looks out at
/// one side and slides along it.
pub(super) fn scene() -> Scene {
    let mut objects = bridge();
    objects.extend(railings());
    objects.extend(lanterns());
    objects.extend(traffic());
    Scene {
        name: "railings",
        description: "Very fast drive over a wet bridge between railings of bars a pixel wide; \
                      cut at frame 12 to a view across them that slides sideways.",
        objects,
        sky: Sky {
            zenith: vec3(0.05, 0.07, 0.16),
            horizon: vec3(0.42, 0.24, 0.2),
            ground: vec3(0.04, 0.05, 0.07),
            sun: None,
        },
        ambient: vec3(0.35, 0.33, 0.36),
        shots: vec![
            Shot {
                eye: vec3(0.5, 1.5, 6.0),
                target: vec3(0.1, 0.9, 0.0),
                travel: vec3(0.0, 0.0, -15.0),
                fov_y: 58_f32.to_radians(),
                ..Shot::default()
            },
            Shot {
                first: 12,
                eye: vec3(0.5, 1.1, -12.0),
                target: vec3(-2.6, 0.65, -13.0),
                travel: vec3(0.0, 0.0, 7.0),
                ..Shot::default()
            },
        ],
        frames_per_second: FRAMES_PER_SECOND,
    }
}

/// The deck, and boards beyond the railings for it to reflect.
fn bridge() -> Vec<Object> {
    let planks = Pattern::Checker { colors: [vec3(0.36, 0.33, 0.3), vec3(0.2, 0.19, 0.19)], size: 1.1 };
    let wet = Finish::Patches { range: [0.04, 0.33], size: 1.2 };
    let board = |z: f32, side: f32, seed| {
        let picture = Pattern::Mosaic { size: 0.55, seed };
        Object::wall(vec3(4.6 * side, 1.9, z), vec2(2.0, 1.3), -90.0 * side, picture, Finish::Even(0.3))
    };
    vec![
        Object::floor(vec3(0.0, 0.0, -12.0), vec2(3.2, 22.0), planks, wet),
        board(-3.5, -1.0, 4),
        board(-9.0, 1.0, 9),
        board(-13.5, -1.0, 15),
        board(1.5, 1.0, 23),
    ]
}

/// Upright bars under a rail, on either side.
fn railings() -> Vec<Object> {
    let steel = plain(0.72, 0.7, 0.66);
    let mut objects = Vec::new();
    for side in [-1.0, 1.0] {
        let bar = |k: i32| cylinder(vec3(2.6 * side, 0.55, 4.5 - 0.7 * k as f32), 0.018, 0.55, steel, 0.2);
        objects.extend((0..32).map(bar));
        let rail = cylinder(vec3(2.6 * side, 1.12, -7.0), 0.03, 13.0, plain(0.6, 0.16, 0.1), 0.1);
        objects.push(rail.turned(Quat::from_rotation_x(FRAC_PI_2)));
    }
    objects
}

/// Lamps on thin posts beside the way.
fn lanterns() -> impl Iterator<Item = Object> {
    let colors = [vec3(85.0, 58.0, 30.0), vec3(34.0, 56.0, 85.0), vec3(80.0, 74.0, 62.0)];
    (0..6).flat_map(move |k| {
        let (x, z) = (if k % 2 == 0 { -1.7 } else { 1.9 }, 2.0 - 3.2 * k as f32);
        [
            cylinder(vec3(x, 1.2, z), 0.022, 1.2, plain(0.5, 0.5, 0.52), 0.15),
            Object::lamp(vec3(x, 2.47, z), 0.08, colors[k % 3]),
        ]
    })
}

/// A van that comes towards the camera, turning signs and a mirror ball.
fn traffic() -> Vec<Object> {
    let stripes = Pattern::Stripes { colors: [vec3(0.85, 0.78, 0.6), vec3(0.7, 0.14, 0.1)], size: 0.3 };
    vec![
        cuboid(vec3(-1.0, 0.75, -8.0), vec3(0.55, 0.65, 1.1), stripes, 0.12).moving(Movement {
            sway: vec3(0.0, 0.0, 2.5),
            sway_rate: 0.6,
            ..Movement::default()
        }),
        cuboid(vec3(0.9, 1.0, -5.6), vec3(0.5, 0.5, 0.03), Pattern::Mosaic { size: 0.25, seed: 6 }, 0.08)
            .moving(Movement { spin: Vec3::Y * 4.0, ..Movement::default() }),
        cuboid(vec3(-3.7, 0.9, -12.4), vec3(0.45, 0.5, 0.45), stripes, 0.15)
            .moving(Movement { spin: Vec3::Y * 3.0, ..Movement::default() }),
        sphere(vec3(-0.4, 0.4, -3.0), 0.4, plain(0.95, 0.95, 0.95), 0.0),
    ]
}
