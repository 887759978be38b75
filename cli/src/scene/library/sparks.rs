//! A dark workshop full of sparks.

use super::*;
use std::f32::consts::FRAC_PI_2;

/// Sources so small and bright that a single ray hits one in a thousand pixels.
pub(super) fn scene() -> Scene {
    let mut objects = workshop();
    objects.extend(metal());
    objects.extend(sparks());
    Scene {
        name: "sparks",
        description: "Dark workshop with sparks of 6 to 20 mm radius and radiance 100 to 2000 \
                      over floor and metal of roughness 0 to 0.6; some of them fly.",
        objects,
        sky: NO_SKY,
        ambient: vec3(0.3, 0.28, 0.26),
        shots: vec![Shot {
            eye: vec3(0.3, 1.35, 3.2),
            target: vec3(0.0, 0.55, -0.4),
            turn: 14_f32.to_radians(),
            ..Shot::default()
        }],
        frames_per_second: FRAMES_PER_SECOND,
    }
}

/// A closed room with a dim ceiling light.
fn workshop() -> Vec<Object> {
    let floor = Pattern::Checker { colors: [vec3(0.42, 0.4, 0.38), vec3(0.2, 0.19, 0.18)], size: 0.45 };
    let tiles = Finish::Tiles { range: [0.04, 0.6], size: 0.45 };
    let brushed = Finish::Tiles { range: [0.15, 0.45], size: 0.8 };
    let side = vec2(4.0, 1.5);
    let posters = Pattern::Mosaic { size: 0.4, seed: 12 };
    vec![
        Object::floor(Vec3::ZERO, vec2(4.0, 4.0), floor, tiles),
        Object::floor(Vec3::Y * 3.0, vec2(4.0, 4.0), plain(0.4, 0.38, 0.36), Finish::Even(0.5)),
        Object::wall(vec3(0.0, 1.5, -2.4), side, 0.0, plain(0.5, 0.52, 0.55), brushed),
        Object::wall(vec3(0.0, 1.5, 4.0), side, 180.0, posters, brushed),
        Object::wall(vec3(-2.8, 1.5, 0.0), side, 90.0, plain(0.5, 0.24, 0.14), brushed),
        Object::wall(vec3(2.8, 1.5, 0.0), side, -90.0, plain(0.16, 0.32, 0.4), brushed),
        Object::floor(vec3(0.0, 2.96, 0.8), vec2(0.9, 0.6), plain(0.8, 0.8, 0.8), Finish::Even(0.4))
            .turned(Quat::from_rotation_x(FRAC_PI_2))
            .glowing(vec3(2.6, 2.8, 3.2)),
    ]
}

/// Curved and flat metal of several finishes.
fn metal() -> Vec<Object> {
    let steel = plain(0.75, 0.76, 0.78);
    vec![
        sphere(vec3(-0.95, 0.42, -0.5), 0.42, steel, 0.0),
        sphere(vec3(0.95, 0.36, 0.35), 0.36, plain(0.85, 0.6, 0.3), 0.1),
        sphere(vec3(-0.25, 0.22, 0.9), 0.22, plain(0.8, 0.45, 0.35), 0.3),
        cylinder(vec3(1.3, 0.6, -1.0), 0.35, 0.6, steel, 0.2),
        cuboid(vec3(0.1, 0.25, -0.7), vec3(0.4, 0.25, 0.25), plain(0.4, 0.42, 0.45), 0.08)
            .moving(Movement { spin: Vec3::Y * 2.0, ..Movement::default() }),
    ]
}

/// A fountain of sparks: golden angle around, brighter where smaller. Every second one flies.
fn sparks() -> impl Iterator<Item = Object> {
    let colors = [vec3(1.0, 0.72, 0.4), vec3(1.0, 0.5, 0.2), vec3(0.7, 0.85, 1.0)];
    (0..10).map(move |k| {
        let step = k as f32 / 9.0;
        let (angle, reach) = (2.4 * k as f32, 0.35 + 1.3 * step);
        let place = vec3(reach * angle.cos(), 0.5 + 0.15 * (k * 3 % 10) as f32, 0.2 + reach * angle.sin());
        let flight = Movement { sway: vec3(0.25, 0.3, -0.2), sway_rate: 0.8 + step, ..Movement::default() };
        let movement = if k % 2 == 0 { flight } else { Movement::default() };
        let radiance = 100.0 * 20_f32.powf(1.0 - step);
        Object::lamp(place, 0.006 + 0.014 * step, colors[k % 3] * radiance).moving(movement)
    })
}
