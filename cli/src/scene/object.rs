//! Objects: a shape with a material on a rigid path through time.

use super::shape::Shape;
use super::texture::{Finish, Pattern};
use glam::{Quat, Vec2, Vec3};
use std::f32::consts::{FRAC_PI_2, TAU};

/// What an object's surface is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Diffuse reflectance; of a mirror, its tint. Counts only in reflections, since the signal
    /// leaves out the material of the surface the camera sees.
    pub albedo: Pattern,
    /// Perceptual roughness. Counts where the camera sees the surface; in reflections a surface
    /// is diffuse, or a mirror if the roughness is below 0.01.
    pub finish: Finish,
    /// Emitted radiance, linear RGB; zero for all but lamps. Panels emit from their front.
    pub emission: Vec3,
}

/// Rigid motion about the resting pose.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Movement {
    /// Rotation axis in world space times radians per second, about the object's centre.
    pub spin: Vec3,
    /// Largest excursion of a sinusoidal swing, world units.
    pub sway: Vec3,
    /// Swings per second.
    pub sway_rate: f32,
}

/// Where an object is at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Local origin in world space.
    pub position: Vec3,
    /// Local to world rotation, unit.
    pub rotation: Quat,
}

impl Pose {
    /// World position of a local point.
    pub(super) fn to_world(self, local: Vec3) -> Vec3 {
        self.position + self.rotation * local
    }
}

/// One thing in a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Object {
    /// Its form in local space. Lamps are spheres or panels.
    pub shape: Shape,
    /// Its surface.
    pub material: Material,
    /// Where it rests at time zero.
    pub rest: Pose,
    /// How it moves from there.
    pub movement: Movement,
    /// Begin and end of a time in which it emits nothing, seconds; by default there is none.
    pub dark: [f32; 2],
}

impl Object {
    /// Where the object is, `time` in seconds.
    pub fn pose(&self, time: f32) -> Pose {
        let Movement { spin, sway, sway_rate } = self.movement;
        Pose {
            position: self.rest.position + sway * (TAU * sway_rate * time).sin(),
            rotation: (Quat::from_scaled_axis(spin * time) * self.rest.rotation).normalize(),
        }
    }

    /// Emitted radiance, `time` in seconds.
    pub fn emission(&self, time: f32) -> Vec3 {
        let [begin, end] = self.dark;
        if (begin..end).contains(&time) { Vec3::ZERO } else { self.material.emission }
    }

    /// A resting object; the scenes build theirs from here.
    pub(super) fn new(shape: Shape, position: Vec3, albedo: Pattern, finish: Finish) -> Self {
        Self {
            shape,
            material: Material { albedo, finish, emission: Vec3::ZERO },
            rest: Pose { position, rotation: Quat::IDENTITY },
            movement: Movement::default(),
            dark: [0.0; 2],
        }
    }

    /// A spherical lamp of one emitted radiance.
    pub(super) fn lamp(position: Vec3, radius: f32, emission: Vec3) -> Self {
        Self::new(Shape::Sphere { radius }, position, Pattern::Solid(Vec3::splat(0.8)), Finish::Even(0.3))
            .glowing(emission)
    }

    /// A horizontal rectangle facing up; `half` is along world X and Z.
    pub(super) fn floor(position: Vec3, half: Vec2, albedo: Pattern, finish: Finish) -> Self {
        Self::new(Shape::Panel { half }, position, albedo, finish).turned(Quat::from_rotation_x(-FRAC_PI_2))
    }

    /// An upright rectangle that faces `degrees` about +Y from world +Z.
    pub(super) fn wall(position: Vec3, half: Vec2, degrees: f32, albedo: Pattern, finish: Finish) -> Self {
        Self::new(Shape::Panel { half }, position, albedo, finish).turned(Quat::from_rotation_y(degrees.to_radians()))
    }

    /// Rests at this rotation instead.
    pub(super) fn turned(mut self, rotation: Quat) -> Self {
        self.rest.rotation = rotation;
        self
    }

    /// Moves like this.
    pub(super) fn moving(mut self, movement: Movement) -> Self {
        self.movement = movement;
        self
    }

    /// Emits this radiance.
    pub(super) fn glowing(mut self, emission: Vec3) -> Self {
        self.material.emission = emission;
        self
    }

    /// Emits nothing from the first to the second time, seconds.
    pub(super) fn dark_within(mut self, seconds: [f32; 2]) -> Self {
        self.dark = seconds;
        self
    }
}
