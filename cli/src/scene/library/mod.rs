//! The built-in scenes, one file each.

mod carousel;
mod courtyard;
mod dolly;
mod gallery;
mod mirrors;
mod quay;
mod railings;
mod sparks;
mod still;
mod switch;

use super::object::Object;
use super::shape::Shape;
use super::texture::{Finish, Pattern};
use super::{FRAMES_PER_SECOND, Movement, Scene, Shot, Sky, Sun};
use glam::{Quat, Vec2, Vec3, vec2, vec3};

/// Names of all scenes, the default first.
pub const NAMES: [&str; 10] =
    ["gallery", "courtyard", "mirrors", "dolly", "still", "railings", "carousel", "sparks", "quay", "switch"];

/// All scenes, in the order of [`NAMES`].
pub fn all() -> Vec<Scene> {
    vec![
        gallery::scene(),
        courtyard::scene(),
        mirrors::scene(),
        dolly::scene(),
        still::scene(),
        railings::scene(),
        carousel::scene(),
        sparks::scene(),
        quay::scene(),
        switch::scene(),
    ]
}

/// The scene of a name, see [`NAMES`], or `None` if there is none. `NAME@RATE` is the scene at
/// `RATE` frames per second, 1 to 1000: `dolly@24` makes longer steps.
pub fn by_name(name: &str) -> Option<Scene> {
    let (name, rate) = match name.split_once('@') {
        Some((name, rate)) => (name, rate.parse().ok().filter(|rate| (1.0..=1000.0).contains(rate))?),
        None => (name, FRAMES_PER_SECOND),
    };
    all().into_iter().find(|scene| scene.name == name).map(|scene| scene.at_rate(rate))
}

/// One colour all over.
fn plain(red: f32, green: f32, blue: f32) -> Pattern {
    Pattern::Solid(vec3(red, green, blue))
}

/// A ball.
fn sphere(position: Vec3, radius: f32, albedo: Pattern, roughness: f32) -> Object {
    Object::new(Shape::Sphere { radius }, position, albedo, Finish::Even(roughness))
}

/// A box.
fn cuboid(position: Vec3, half: Vec3, albedo: Pattern, roughness: f32) -> Object {
    Object::new(Shape::Cuboid { half }, position, albedo, Finish::Even(roughness))
}

/// An upright cylinder.
fn cylinder(position: Vec3, radius: f32, half_height: f32, albedo: Pattern, roughness: f32) -> Object {
    let shape = Shape::Cylinder { radius, half_height };
    Object::new(shape, position, albedo, Finish::Even(roughness))
}

/// The sky of a closed room, which no ray reaches.
const NO_SKY: Sky = Sky { zenith: Vec3::ZERO, horizon: Vec3::ZERO, ground: Vec3::ZERO, sun: None };
