//! A studio of mirrors.

use super::*;

/// Flat and curved mirrors with coloured things moving in front of them.
pub(super) fn scene() -> Scene {
    let mut objects = studio();
    objects.extend(mirrors());
    objects.extend(movers());
    Scene {
        name: "mirrors",
        description: "Flat and curved mirrors of roughness 0 and 0.05 with coloured things \
                      moving in front of them; slow camera.",
        objects,
        sky: Sky {
            zenith: vec3(0.75, 0.8, 0.9),
            horizon: vec3(0.35, 0.4, 0.5),
            ground: vec3(0.15, 0.14, 0.14),
            sun: None,
        },
        ambient: vec3(0.65, 0.65, 0.7),
        shots: vec![Shot {
            eye: vec3(0.9, 1.5, 4.8),
            target: vec3(0.0, 1.0, -0.8),
            turn: -9_f32.to_radians(),
            ..Shot::default()
        }],
        frames_per_second: FRAMES_PER_SECOND,
    }
}

/// The floor, a striped wall behind the camera for the mirrors to show, and lamps.
fn studio() -> Vec<Object> {
    let floor = Pattern::Checker { colors: [vec3(0.7, 0.66, 0.6), vec3(0.16, 0.2, 0.26)], size: 0.8 };
    let stripes = Pattern::Stripes { colors: [vec3(0.85, 0.45, 0.15), vec3(0.9, 0.85, 0.75)], size: 0.7 };
    let lacquer = Finish::Patches { range: [0.06, 0.3], size: 1.5 };
    vec![
        Object::floor(Vec3::ZERO, vec2(14.0, 14.0), floor, lacquer),
        Object::wall(vec3(0.0, 1.75, 9.0), vec2(9.0, 1.75), 180.0, stripes, Finish::Even(0.4)),
        Object::lamp(vec3(-2.6, 3.4, 2.2), 0.25, vec3(60.0, 52.0, 42.0)),
        Object::lamp(vec3(3.0, 3.0, 1.0), 0.18, vec3(40.0, 52.0, 75.0)),
        Object::lamp(vec3(0.2, 2.6, -1.6), 0.1, vec3(85.0, 60.0, 40.0)),
    ]
}

/// The mirrors.
fn mirrors() -> Vec<Object> {
    let silver = plain(0.94, 0.95, 0.94);
    let copper = plain(0.92, 0.62, 0.48);
    let mirror = |x, z, half, degrees: f32, roughness| {
        cuboid(vec3(x, 1.45, z), half, silver, roughness).turned(Quat::from_rotation_y(degrees.to_radians()))
    };
    vec![
        mirror(-1.3, -3.0, vec3(1.2, 1.3, 0.06), 12.0, 0.0),
        mirror(1.5, -3.0, vec3(1.2, 1.3, 0.06), -12.0, 0.05),
        mirror(-3.6, -0.8, vec3(1.2, 1.3, 0.06), 62.0, 0.05),
        mirror(3.8, -0.8, vec3(1.2, 1.3, 0.06), -62.0, 0.0),
        sphere(vec3(-0.9, 0.7, -0.7), 0.7, silver, 0.0),
        sphere(vec3(1.9, 0.45, 0.4), 0.45, copper, 0.05),
        cylinder(vec3(0.75, 0.75, -1.4), 0.35, 0.75, copper, 0.0),
    ]
}

/// What moves: a turning box, a hopping ball, a sliding pillar.
fn movers() -> Vec<Object> {
    let checks = Pattern::Checker { colors: [vec3(0.85, 0.15, 0.12), vec3(0.9, 0.8, 0.6)], size: 0.2 };
    let mosaic = Pattern::Mosaic { size: 0.2, seed: 11 };
    vec![
        cuboid(vec3(0.5, 0.4, 0.8), Vec3::splat(0.3), checks, 0.2).moving(Movement {
            spin: vec3(0.0, 2.2, 0.0),
            sway: vec3(0.5, 0.0, 0.0),
            sway_rate: 0.5,
        }),
        sphere(vec3(-2.0, 0.6, 0.7), 0.35, plain(0.12, 0.55, 0.25), 0.25).moving(Movement {
            sway: vec3(0.0, 0.25, 0.3),
            sway_rate: 0.8,
            ..Movement::default()
        }),
        cylinder(vec3(-0.2, 0.6, -2.0), 0.18, 0.6, mosaic, 0.15).moving(Movement {
            spin: Vec3::Y * 3.0,
            sway: vec3(-0.9, 0.0, 0.0),
            sway_rate: 0.4,
        }),
    ]
}
