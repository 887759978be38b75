//! A hall of mirrors at rest, with a fair behind the camera.

use super::*;

/// Neither camera nor mirrors move, but most of what the mirrors show does, so that motion
/// vectors say nothing about the reflections.
pub(super) fn scene() -> Scene {
    let mut objects = hall();
    objects.extend(mirrors());
    objects.extend(movers());
    Scene {
        name: "carousel",
        description: "Camera, floor and flat and curved mirrors at rest; turning and sliding \
                      objects, most of them seen only in reflections, and a swinging lamp.",
        objects,
        sky: NO_SKY,
        ambient: vec3(0.8, 0.78, 0.75),
        shots: vec![Shot {
            eye: vec3(0.2, 1.6, 1.9),
            target: vec3(0.0, 1.0, -2.0),
            fov_y: 58_f32.to_radians(),
            ..Shot::default()
        }],
        frames_per_second: FRAMES_PER_SECOND,
    }
}

/// A closed hall, lit from above and by a lamp that swings.
fn hall() -> Vec<Object> {
    let floor = Pattern::Checker { colors: [vec3(0.6, 0.58, 0.52), vec3(0.22, 0.2, 0.24)], size: 0.7 };
    let tiles = Finish::Tiles { range: [0.04, 0.4], size: 0.7 };
    let stripes = Pattern::Stripes { colors: [vec3(0.78, 0.74, 0.66), vec3(0.35, 0.5, 0.45)], size: 0.4 };
    let matt = Finish::Even(0.45);
    let side = vec2(6.5, 1.75);
    vec![
        Object::floor(vec3(0.0, 0.0, 1.5), vec2(5.0, 5.0), floor, tiles),
        Object::floor(vec3(0.0, 3.5, 1.5), vec2(5.0, 5.0), plain(0.5, 0.48, 0.45), matt),
        Object::wall(vec3(0.0, 1.75, -3.2), side, 0.0, plain(0.45, 0.2, 0.16), matt),
        Object::wall(vec3(0.0, 1.75, 6.2), side, 180.0, stripes, matt),
        Object::wall(vec3(-4.6, 1.75, 1.5), side, 90.0, plain(0.25, 0.36, 0.52), matt),
        Object::wall(vec3(4.6, 1.75, 1.5), side, -90.0, plain(0.55, 0.5, 0.28), matt),
        Object::floor(vec3(0.0, 3.45, 2.6), vec2(1.5, 1.0), plain(0.8, 0.8, 0.8), matt)
            .turned(Quat::from_rotation_x(std::f32::consts::FRAC_PI_2))
            .glowing(vec3(8.0, 7.6, 7.0)),
        Object::lamp(vec3(-1.4, 2.7, 2.2), 0.16, vec3(60.0, 40.0, 22.0)).moving(Movement {
            sway: vec3(1.1, 0.0, 0.3),
            sway_rate: 0.9,
            ..Movement::default()
        }),
    ]
}

/// A triptych on the wall, a ball, a pillar and a low satin box.
fn mirrors() -> Vec<Object> {
    let silver = plain(0.94, 0.95, 0.94);
    let leaf = |x: f32, degrees: f32, roughness| {
        cuboid(vec3(x, 1.45, -2.7), vec3(1.05, 1.35, 0.05), silver, roughness)
            .turned(Quat::from_rotation_y(degrees.to_radians()))
    };
    vec![
        leaf(-2.2, 18.0, 0.07),
        leaf(0.0, 0.0, 0.0),
        leaf(2.2, -18.0, 0.03),
        sphere(vec3(-1.25, 0.55, -1.2), 0.55, plain(0.92, 0.85, 0.7), 0.0),
        cylinder(vec3(1.45, 0.8, -1.3), 0.38, 0.8, plain(0.9, 0.65, 0.5), 0.02),
        cuboid(vec3(0.3, 0.15, -1.1), vec3(0.45, 0.15, 0.3), plain(0.6, 0.7, 0.8), 0.12),
    ]
}

/// What turns and slides; only the small cube is in front of the camera.
fn movers() -> Vec<Object> {
    let checks = Pattern::Checker { colors: [vec3(0.9, 0.3, 0.08), vec3(0.95, 0.9, 0.7)], size: 0.3 };
    let bands = Pattern::Stripes { colors: [vec3(0.1, 0.5, 0.2), vec3(0.9, 0.85, 0.2)], size: 0.16 };
    let turning = |spin: Vec3| Movement { spin, ..Movement::default() };
    let sliding = |sway: Vec3, sway_rate| Movement { sway, sway_rate, spin: Vec3::Y };
    vec![
        cuboid(vec3(0.4, 1.8, 4.6), vec3(1.5, 0.18, 0.18), checks, 0.3).moving(turning(Vec3::Z * 4.0)),
        cuboid(vec3(-2.3, 1.2, 3.4), Vec3::splat(0.6), Pattern::Mosaic { size: 0.4, seed: 3 }, 0.2)
            .moving(turning(vec3(0.6, 2.5, 0.0))),
        cylinder(vec3(2.2, 0.9, 3.0), 0.3, 0.9, bands, 0.25).moving(sliding(vec3(1.2, 0.0, 0.0), 0.7)),
        sphere(vec3(-0.7, 0.9, 3.2), 0.4, bands, 0.3).moving(sliding(vec3(0.0, 0.5, 0.9), 1.1)),
        cuboid(vec3(0.3, 0.52, -1.1), Vec3::splat(0.16), checks, 0.15).moving(turning(vec3(1.0, 3.0, 0.0))),
    ]
}
