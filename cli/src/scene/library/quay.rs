//! A wet quay at night.

use super::*;

/// Lamps up to 70 m away over wet ground that is seen at grazing angles: long streaks.
pub(super) fn scene() -> Scene {
    let mut objects = ground();
    objects.extend(street_lamps());
    objects.extend(houses());
    objects.extend(near());
    Scene {
        name: "quay",
        description: "Wet ground of roughness 0.06 to 0.3 seen from knee height, with lamps 8 to \
                      70 m away whose reflections are long streaks; slow sideways camera.",
        objects,
        sky: Sky {
            zenith: vec3(0.01, 0.015, 0.04),
            horizon: vec3(0.06, 0.06, 0.1),
            ground: vec3(0.01, 0.01, 0.01),
            sun: None,
        },
        ambient: vec3(0.1, 0.1, 0.12),
        shots: vec![Shot {
            eye: vec3(0.0, 0.8, 6.0),
            target: vec3(0.0, -0.1, -4.0),
            travel: vec3(1.2, 0.0, -1.0),
            fov_y: 40_f32.to_radians(),
            ..Shot::default()
        }],
        frames_per_second: FRAMES_PER_SECOND,
    }
}

/// Asphalt with water on it.
fn ground() -> Vec<Object> {
    let asphalt = Pattern::Clouds { colors: [vec3(0.12, 0.12, 0.13), vec3(0.3, 0.29, 0.28)], size: 2.0 };
    let wet = Finish::Patches { range: [0.06, 0.3], size: 2.2 };
    vec![Object::floor(Vec3::ZERO, vec2(90.0, 90.0), asphalt, wet)]
}

/// Two rows of lamps into the distance; the farther the brighter, so that all of them count.
fn street_lamps() -> impl Iterator<Item = Object> {
    let colors = [vec3(1.0, 0.66, 0.3), vec3(0.85, 0.9, 1.0), vec3(1.0, 0.55, 0.2), vec3(0.4, 1.0, 0.55)];
    [(-3.2, -4.0), (3.8, -9.0), (-4.6, -18.0), (5.6, -26.0), (-7.0, -38.0), (2.4, -48.0), (-2.0, -62.0)]
        .into_iter()
        .enumerate()
        .flat_map(move |(k, (x, z))| {
            let height = 2.6 + 0.03 * -z;
            [
                cylinder(vec3(x, 0.5 * height, z), 0.05, 0.5 * height, plain(0.4, 0.4, 0.42), 0.3),
                Object::lamp(vec3(x, height, z), 0.18 - 0.001 * z, colors[k % 4] * (55.0 - 1.5 * z)),
            ]
        })
}

/// A row of houses with lit windows at the far end.
fn houses() -> Vec<Object> {
    let mut objects = Vec::new();
    for k in 0..5 {
        let (x, height) = (-28.0 + 13.0 * k as f32, 5.0 + 2.0 * (k * 2 % 5) as f32);
        let brick = Pattern::Checker { colors: [vec3(0.4, 0.22, 0.18), vec3(0.3, 0.26, 0.24)], size: 1.5 };
        objects.push(cuboid(vec3(x, height, -75.0), vec3(5.5, height, 3.0), brick, 0.5));
        let window = Object::wall(vec3(x, 3.5, -71.9), vec2(3.0, 1.0), 0.0, plain(0.5, 0.5, 0.5), Finish::Even(0.3));
        objects.push(window.glowing([vec3(6.0, 4.2, 2.0), vec3(2.0, 3.0, 5.0)][k % 2]));
    }
    objects
}

/// Crates, a mirror bollard, and a cart with a red light that drives by.
fn near() -> Vec<Object> {
    let crate_paint = Pattern::Checker { colors: [vec3(0.6, 0.35, 0.1), vec3(0.7, 0.65, 0.55)], size: 0.3 };
    let drive = Movement { sway: vec3(2.5, 0.0, 0.0), sway_rate: 0.35, ..Movement::default() };
    vec![
        cuboid(vec3(-1.7, 0.4, -1.2), Vec3::splat(0.4), crate_paint, 0.25).turned(Quat::from_rotation_y(0.5)),
        cylinder(vec3(1.5, 0.4, 0.6), 0.18, 0.4, plain(0.9, 0.88, 0.85), 0.05),
        cuboid(vec3(-0.5, 0.5, -7.0), vec3(0.9, 0.35, 0.5), plain(0.2, 0.35, 0.5), 0.15).moving(drive),
        Object::lamp(vec3(-1.45, 0.55, -6.6), 0.07, vec3(120.0, 14.0, 6.0)).moving(drive),
    ]
}
