//! A room whose light is switched off and on.

use super::*;
use std::f32::consts::FRAC_PI_2;

/// Between frames 8 and 24 only a small lamp and a window are left.
pub(super) fn scene() -> Scene {
    let mut objects = room();
    objects.extend(furniture());
    objects.extend(lamps());
    Scene {
        name: "switch",
        description: "Room in which ceiling light, screen and lamp go off at frame 8 and on at \
                      frame 24, while the camera orbits slowly and a box turns.",
        objects,
        sky: NO_SKY,
        ambient: vec3(0.06, 0.06, 0.07),
        shots: vec![Shot {
            eye: vec3(1.0, 1.6, 4.2),
            target: vec3(0.0, 0.8, -0.6),
            turn: 10_f32.to_radians(),
            ..Shot::default()
        }],
        frames_per_second: FRAMES_PER_SECOND,
    }
}

/// Seconds without light.
const DARK: [f32; 2] = [8.0 / FRAMES_PER_SECOND, 24.0 / FRAMES_PER_SECOND];

/// Walls, pictures and a floor of changing gloss.
fn room() -> Vec<Object> {
    let floor = Pattern::Checker { colors: [vec3(0.6, 0.45, 0.3), vec3(0.35, 0.22, 0.14)], size: 0.6 };
    let polish = Finish::Tiles { range: [0.05, 0.45], size: 0.6 };
    let stripes = Pattern::Stripes { colors: [vec3(0.75, 0.72, 0.65), vec3(0.25, 0.4, 0.5)], size: 0.45 };
    let picture = Pattern::Mosaic { size: 0.3, seed: 17 };
    let side = vec2(5.0, 1.6);
    let matt = Finish::Even(0.4);
    vec![
        Object::floor(Vec3::ZERO, vec2(4.5, 5.0), floor, polish),
        Object::floor(Vec3::Y * 3.2, vec2(4.5, 5.0), plain(0.7, 0.68, 0.64), matt),
        Object::wall(vec3(0.0, 1.6, -3.0), side, 0.0, plain(0.7, 0.66, 0.55), matt),
        Object::wall(vec3(0.0, 1.6, 5.0), side, 180.0, stripes, matt),
        Object::wall(vec3(-3.4, 1.6, 0.0), side, 90.0, plain(0.55, 0.2, 0.16), matt),
        Object::wall(vec3(3.4, 1.6, 0.0), side, -90.0, plain(0.2, 0.4, 0.26), matt),
        Object::wall(vec3(1.7, 1.6, -2.96), vec2(0.9, 0.7), 0.0, picture, Finish::Even(0.15)),
    ]
}

/// Balls, a table and a box that turns.
fn furniture() -> Vec<Object> {
    let checks = Pattern::Checker { colors: [vec3(0.85, 0.7, 0.2), vec3(0.15, 0.2, 0.4)], size: 0.2 };
    vec![
        sphere(vec3(-1.2, 0.5, -0.8), 0.5, plain(0.94, 0.94, 0.94), 0.0),
        sphere(vec3(1.1, 0.38, 0.7), 0.38, plain(0.8, 0.55, 0.3), 0.14),
        cuboid(vec3(1.6, 0.35, -1.4), vec3(0.8, 0.35, 0.5), plain(0.3, 0.2, 0.14), 0.1),
        cylinder(vec3(-2.2, 0.8, -1.8), 0.3, 0.8, plain(0.6, 0.65, 0.7), 0.25),
        cuboid(vec3(-0.1, 0.4, 0.1), Vec3::splat(0.36), checks, 0.2)
            .moving(Movement { spin: Vec3::Y * 1.5, ..Movement::default() }),
    ]
}

/// What is switched, and what stays on.
fn lamps() -> Vec<Object> {
    let frame = plain(0.1, 0.1, 0.1);
    let ceiling = Object::floor(vec3(0.0, 3.15, 0.4), vec2(1.0, 0.8), plain(0.8, 0.8, 0.8), Finish::Even(0.4));
    let screen = Object::wall(vec3(-1.0, 1.7, -2.95), vec2(1.0, 0.6), 0.0, frame, Finish::Even(0.2));
    let window = Object::wall(vec3(3.35, 1.8, 1.0), vec2(0.5, 0.7), -90.0, frame, Finish::Even(0.2));
    vec![
        ceiling.turned(Quat::from_rotation_x(FRAC_PI_2)).glowing(vec3(9.0, 8.6, 7.8)).dark_within(DARK),
        screen.glowing(vec3(3.0, 4.5, 7.0)).dark_within(DARK),
        Object::lamp(vec3(1.9, 0.95, -1.5), 0.12, vec3(70.0, 48.0, 24.0)).dark_within(DARK),
        Object::lamp(vec3(-2.2, 1.75, -1.8), 0.06, vec3(60.0, 14.0, 10.0)),
        window.glowing(vec3(0.5, 0.7, 1.1)),
    ]
}
