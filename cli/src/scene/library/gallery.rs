//! An exhibition room.

use super::*;
use std::f32::consts::FRAC_PI_2;

/// Closed room, small lamps, a floor whose roughness changes tile by tile.
pub(super) fn scene() -> Scene {
    let mut objects = room();
    objects.extend(exhibits());
    objects.extend(columns());
    objects.extend(lamps());
    Scene {
        name: "gallery",
        description: "Room with a floor of roughness 0.05 to 0.6 tile by tile, a mirror ball, \
                      curved metal, a sliding and turning box, and small lamps, one of them tiny \
                      and very bright; the camera orbits slowly past columns.",
        objects,
        sky: NO_SKY,
        ambient: vec3(0.9, 0.86, 0.8),
        shots: vec![Shot {
            eye: vec3(-0.6, 1.75, 4.6),
            target: vec3(0.0, 0.95, -0.6),
            turn: 22_f32.to_radians(),
            fov_y: 52_f32.to_radians(),
            ..Shot::default()
        }],
        frames_per_second: FRAMES_PER_SECOND,
    }
}

/// Six panels and what hangs on them.
fn room() -> Vec<Object> {
    let floor = Pattern::Checker { colors: [vec3(0.75, 0.7, 0.62), vec3(0.2, 0.16, 0.13)], size: 0.9 };
    let tiles = Finish::Tiles { range: [0.05, 0.6], size: 0.9 };
    let plaster = Finish::Tiles { range: [0.35, 0.5], size: 1.3 };
    let stripes = Pattern::Stripes { colors: [vec3(0.85, 0.8, 0.72), vec3(0.3, 0.42, 0.5)], size: 0.5 };
    let painting = |x: f32, z: f32, half: Vec2, degrees, seed| {
        let picture = Pattern::Mosaic { size: 0.31, seed };
        Object::wall(vec3(x, 1.75, z), half, degrees, picture, Finish::Even(0.2))
    };
    let side = vec2(6.0, 2.0);
    vec![
        Object::floor(Vec3::ZERO, vec2(6.0, 6.0), floor, tiles),
        Object::floor(Vec3::Y * 4.0, vec2(6.0, 6.0), plain(0.34, 0.29, 0.25), Finish::Even(0.5)),
        Object::wall(vec3(0.0, 2.0, -4.0), side, 0.0, plain(0.55, 0.55, 0.58), plaster),
        Object::wall(vec3(0.0, 2.0, 6.0), side, 180.0, stripes, plaster),
        Object::wall(vec3(-5.0, 2.0, 0.0), side, 90.0, plain(0.75, 0.22, 0.13), plaster),
        Object::wall(vec3(5.0, 2.0, 0.0), side, -90.0, plain(0.1, 0.42, 0.4), plaster),
        painting(-2.2, -3.97, vec2(0.9, 0.7), 0.0, 3),
        painting(2.4, -3.97, vec2(0.7, 0.9), 0.0, 8),
        painting(-2.0, 5.97, vec2(1.4, 1.0), 180.0, 5),
        painting(2.2, 5.97, vec2(1.2, 1.0), 180.0, 21),
    ]
}

/// What is on show.
fn exhibits() -> Vec<Object> {
    let checks = Pattern::Checker { colors: [vec3(0.85, 0.65, 0.1), vec3(0.1, 0.12, 0.4)], size: 0.2 };
    let capsule = Shape::Capsule { radius: 0.22, half_height: 0.45 };
    vec![
        sphere(vec3(-1.25, 0.75, -0.9), 0.75, plain(0.95, 0.95, 0.95), 0.0),
        sphere(vec3(1.35, 0.45, 0.7), 0.45, plain(0.85, 0.6, 0.25), 0.12),
        sphere(vec3(0.1, 0.28, 1.75), 0.28, plain(0.8, 0.2, 0.25), 0.2),
        cylinder(vec3(1.9, 0.9, -1.7), 0.6, 0.9, plain(0.7, 0.72, 0.75), 0.16),
        Object::new(capsule, vec3(-1.5, 0.22, 1.3), plain(0.2, 0.45, 0.75), Finish::Even(0.1))
            .turned(Quat::from_rotation_y(0.6) * Quat::from_rotation_z(FRAC_PI_2)),
        cuboid(vec3(0.35, 0.4, -0.3), Vec3::splat(0.4), checks, 0.15).moving(Movement {
            spin: Vec3::Y * 1.6,
            sway: vec3(0.45, 0.0, 0.15),
            sway_rate: 0.5,
        }),
    ]
}

/// Slender columns at several depths, which uncover what is behind them.
fn columns() -> impl Iterator<Item = Object> {
    [(-2.9, -2.6), (2.9, -2.7), (-2.7, 0.9), (2.6, 1.5)]
        .into_iter()
        .map(|(x, z)| cylinder(vec3(x, 2.0, z), 0.16, 2.0, plain(0.82, 0.8, 0.74), 0.3))
}

/// A ceiling light, three lamps, and a tiny one.
fn lamps() -> Vec<Object> {
    let ceiling = Object::floor(vec3(0.0, 3.96, 0.6), vec2(1.1, 0.8), plain(0.8, 0.8, 0.8), Finish::Even(0.4));
    vec![
        ceiling.turned(Quat::from_rotation_x(FRAC_PI_2)).glowing(vec3(9.0, 8.7, 8.0)),
        Object::lamp(vec3(-2.1, 1.5, -1.9), 0.13, vec3(70.0, 40.0, 17.0)),
        Object::lamp(vec3(2.9, 1.7, -0.7), 0.11, vec3(24.0, 48.0, 75.0)),
        Object::lamp(vec3(0.4, 2.3, -2.6), 0.11, vec3(62.0, 52.0, 38.0)),
        Object::lamp(vec3(0.8, 1.0, -0.6), 0.03, vec3(560.0, 470.0, 360.0)),
    ]
}
