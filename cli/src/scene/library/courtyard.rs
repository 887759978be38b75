//! A courtyard after rain.

use super::*;

/// Open sky and a small sun over puddles and a colonnade.
pub(super) fn scene() -> Scene {
    let mut objects = vec![ground()];
    objects.extend(walls());
    objects.extend(colonnade());
    objects.extend(things());
    Scene {
        name: "courtyard",
        description: "Colonnade and coloured things under a sky with a small sun; puddles of \
                      roughness 0.03 in stone of 0.5; the camera orbits fast.",
        objects,
        sky: Sky {
            zenith: vec3(0.1, 0.2, 0.5),
            horizon: vec3(0.95, 0.72, 0.5),
            ground: vec3(0.3, 0.28, 0.25),
            sun: Some(Sun {
                direction: vec3(0.3, 0.33, -0.9).normalize(),
                radius: 1.5_f32.to_radians(),
                radiance: vec3(1500.0, 1150.0, 700.0),
            }),
        },
        ambient: vec3(0.6, 0.58, 0.6),
        shots: vec![Shot {
            eye: vec3(-1.6, 1.8, 6.8),
            target: vec3(0.0, 1.1, 0.0),
            turn: 75_f32.to_radians(),
            fov_y: 50_f32.to_radians(),
            ..Shot::default()
        }],
        frames_per_second: FRAMES_PER_SECOND,
    }
}

/// Wet flagstones.
fn ground() -> Object {
    let stone = Pattern::Checker { colors: [vec3(0.42, 0.38, 0.33), vec3(0.33, 0.31, 0.29)], size: 1.2 };
    let puddles = Finish::Patches { range: [0.03, 0.5], size: 2.2 };
    Object::floor(Vec3::ZERO, vec2(11.0, 11.0), stone, puddles)
}

/// Low walls all around.
fn walls() -> impl Iterator<Item = Object> {
    let plaster = Pattern::Stripes { colors: [vec3(0.62, 0.3, 0.18), vec3(0.75, 0.62, 0.45)], size: 0.8 };
    [(0.0, -11.0, 0.0), (11.0, 0.0, -90.0), (0.0, 11.0, 180.0), (-11.0, 0.0, 90.0)].into_iter().map(
        move |(x, z, degrees)| {
            let middle = vec3(x, 1.1, z);
            Object::wall(middle, vec2(11.0, 1.1), degrees, plaster, Finish::Even(0.4))
        },
    )
}

/// Columns with bases and capitals on a square, and the beams they carry.
fn colonnade() -> Vec<Object> {
    let marble = Pattern::Clouds { colors: [vec3(0.85, 0.8, 0.72), vec3(0.6, 0.55, 0.5)], size: 0.5 };
    let mut objects = Vec::new();
    for (x, z) in [(-4.5, -4.0), (-1.5, -4.0), (1.5, -4.0), (4.5, -4.0), (-4.5, -0.5), (4.5, -0.5)] {
        let place = |y| vec3(x, y, z);
        objects.push(cylinder(place(1.5), 0.28, 1.3, marble, 0.3));
        objects.push(cuboid(place(0.1), vec3(0.42, 0.1, 0.42), marble, 0.4));
        objects.push(cuboid(place(2.9), vec3(0.42, 0.1, 0.42), marble, 0.4));
    }
    let beam = |x, z, half| cuboid(vec3(x, 3.25, z), half, marble, 0.35);
    objects.push(beam(0.0, -4.0, vec3(5.0, 0.25, 0.38)));
    objects.push(beam(-4.5, -1.87, vec3(0.38, 0.25, 1.75)));
    objects.push(beam(4.5, -1.87, vec3(0.38, 0.25, 1.75)));
    objects
}

/// Things to be mirrored in the puddles.
fn things() -> Vec<Object> {
    let checks = Pattern::Checker { colors: [vec3(0.8, 0.25, 0.12), vec3(0.9, 0.85, 0.75)], size: 0.3 };
    let mosaic = Pattern::Mosaic { size: 0.25, seed: 4 };
    vec![
        sphere(vec3(0.2, 0.8, -0.6), 0.8, plain(0.95, 0.95, 0.95), 0.0),
        sphere(vec3(2.1, 0.5, 1.1), 0.5, plain(0.9, 0.62, 0.2), 0.15),
        cuboid(vec3(-1.9, 0.6, 0.6), Vec3::splat(0.6), checks, 0.1)
            .moving(Movement { spin: Vec3::Y * 1.2, ..Movement::default() }),
        cuboid(vec3(2.3, 0.9, -1.9), vec3(0.45, 0.9, 0.45), mosaic, 0.2).turned(Quat::from_rotation_y(0.5)),
        cylinder(vec3(-2.4, 0.7, -2.0), 0.4, 0.7, plain(0.12, 0.3, 0.7), 0.12),
        sphere(vec3(0.4, 0.3, 2.2), 0.3, plain(0.75, 0.12, 0.3), 0.05).moving(Movement {
            sway: vec3(0.8, 0.0, 0.0),
            sway_rate: 0.6,
            ..Movement::default()
        }),
    ]
}
