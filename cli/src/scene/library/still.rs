//! A still life.

use super::*;

/// Nothing moves: balls of rising roughness on a tiled table.
pub(super) fn scene() -> Scene {
    let mut objects = backdrop();
    objects.extend(balls());
    objects.extend(lamps());
    Scene {
        name: "still",
        description: "Balls of roughness 0 to 0.6 and simple solids under small lamps; nothing \
                      moves, for convergence tests.",
        objects,
        sky: Sky {
            zenith: vec3(0.32, 0.36, 0.42),
            horizon: vec3(0.22, 0.23, 0.26),
            ground: vec3(0.08, 0.08, 0.08),
            sun: None,
        },
        ambient: vec3(0.7, 0.68, 0.66),
        shots: vec![Shot {
            eye: vec3(0.0, 1.9, 4.6),
            target: vec3(0.0, 0.6, 0.0),
            fov_y: 42_f32.to_radians(),
            ..Shot::default()
        }],
        frames_per_second: FRAMES_PER_SECOND,
    }
}

/// The table and what stands around it.
fn backdrop() -> Vec<Object> {
    let table = Pattern::Checker { colors: [vec3(0.72, 0.68, 0.6), vec3(0.25, 0.12, 0.08)], size: 0.5 };
    let tiles = Finish::Tiles { range: [0.05, 0.6], size: 1.0 };
    let screen = Pattern::Mosaic { size: 0.45, seed: 2 };
    let folds = Pattern::Stripes { colors: [vec3(0.2, 0.42, 0.5), vec3(0.75, 0.72, 0.65)], size: 0.35 };
    vec![
        Object::floor(Vec3::ZERO, vec2(8.0, 8.0), table, tiles),
        Object::wall(vec3(0.0, 1.5, -2.6), vec2(5.0, 1.5), 0.0, folds, Finish::Even(0.35)),
        Object::wall(vec3(0.0, 1.5, 6.5), vec2(6.0, 1.5), 180.0, screen, Finish::Even(0.4)),
        Object::wall(vec3(-4.0, 1.5, 0.0), vec2(4.0, 1.5), 90.0, plain(0.7, 0.25, 0.15), Finish::Even(0.25)),
    ]
}

/// A row of balls from mirror to matt, and a few solids.
fn balls() -> Vec<Object> {
    let finishes = [0.0, 0.05, 0.12, 0.25, 0.4, 0.6];
    let ball = |(k, roughness): (usize, f32)| {
        let place = vec3(-1.9 + 0.76 * k as f32, 0.36, 0.35 - 0.25 * (k % 2) as f32);
        sphere(place, 0.36, plain(0.85, 0.7, 0.4), roughness)
    };
    let mut objects: Vec<_> = finishes.into_iter().enumerate().map(ball).collect();
    objects.push(
        cuboid(vec3(-1.2, 0.55, -1.3), Vec3::splat(0.55), plain(0.15, 0.35, 0.6), 0.1)
            .turned(Quat::from_rotation_y(0.4)),
    );
    objects.push(cylinder(vec3(0.3, 0.7, -1.4), 0.4, 0.7, plain(0.3, 0.5, 0.2), 0.15));
    objects.push(sphere(vec3(1.7, 0.65, -1.2), 0.65, plain(0.7, 0.2, 0.3), 0.3));
    objects
}

/// Three small lamps and a tiny one.
fn lamps() -> Vec<Object> {
    vec![
        Object::lamp(vec3(-2.2, 2.5, 1.2), 0.14, vec3(62.0, 48.0, 32.0)),
        Object::lamp(vec3(2.4, 2.3, 0.6), 0.14, vec3(34.0, 48.0, 70.0)),
        Object::lamp(vec3(0.3, 2.7, -0.4), 0.1, vec3(70.0, 64.0, 55.0)),
        Object::lamp(vec3(0.7, 0.95, 0.9), 0.025, vec3(500.0, 400.0, 280.0)),
    ]
}
