//! Lights a surface point can sample: spheres, panels and the sun.

use super::Scene;
use super::lobe::frame_around;
use super::object::Pose;
use super::shape::Shape;
use glam::{Vec2, Vec3};
use std::f32::consts::{PI, TAU};

/// Something that shines, in world space.
pub(super) struct Light {
    form: Form,
    /// Emitted radiance.
    pub(super) radiance: Vec3,
    /// The object that carries it; `None` for the sun.
    pub(super) object: Option<usize>,
}

enum Form {
    Ball { centre: Vec3, radius: f32 },
    Panel { pose: Pose, half: Vec2 },
    Sun { direction: Vec3, radius: f32 },
}

/// A direction towards a light.
pub(super) struct LightSample {
    /// Unit vector.
    pub(super) direction: Vec3,
    /// How far away the light is.
    pub(super) distance: f32,
    /// Probability per solid angle.
    pub(super) density: f32,
}

impl Light {
    /// All lights of a scene that shine at `time`, in seconds, with its objects at `poses`.
    pub(super) fn gather(scene: &Scene, poses: &[Pose], time: f32) -> Vec<Self> {
        let lamps = scene.objects.iter().zip(poses).enumerate();
        let lamps = lamps.filter_map(|(index, (object, &pose))| {
            let form = match object.shape {
                Shape::Sphere { radius } => Form::Ball { centre: pose.position, radius },
                Shape::Panel { half } => Form::Panel { pose, half },
                _ => return None,
            };
            let radiance = object.emission(time);
            (radiance != Vec3::ZERO).then_some(Self { form, radiance, object: Some(index) })
        });
        let sun = scene.sky.sun.map(|sun| Self {
            form: Form::Sun { direction: sun.direction, radius: sun.radius },
            radiance: sun.radiance,
            object: None,
        });
        lamps.chain(sun).collect()
    }

    /// About how much it lights a diffuse surface if nothing is in between: radiance times solid
    /// angle times cosine. Zero only where no part of it can.
    pub(super) fn importance(&self, point: Vec3, normal: Vec3) -> f32 {
        let (solid_angle, cosine) = match &self.form {
            Form::Ball { centre, radius } => {
                let way = centre - point;
                let distance = way.length();
                let solid_angle = PI * (radius / distance).powi(2);
                (solid_angle, (normal.dot(way) + radius) / distance)
            }
            Form::Panel { pose, half } => {
                let way = pose.position - point;
                let distance = way.length();
                let facing = -way.dot(pose.rotation * Vec3::Z).min(0.0);
                let solid_angle = 4.0 * half.x * half.y * facing / distance.powi(3);
                (solid_angle, (normal.dot(way) + half.length()) / distance)
            }
            Form::Sun { direction, radius } => (PI * radius * radius, normal.dot(*direction) + radius),
        };
        self.radiance.element_sum() * solid_angle * cosine.clamp(0.0, 1.0)
    }

    /// Unit direction to its centre.
    pub(super) fn centre(&self, point: Vec3) -> Vec3 {
        match &self.form {
            Form::Ball { centre, .. } => (centre - point).normalize_or(Vec3::Y),
            Form::Panel { pose, .. } => (pose.position - point).normalize_or(Vec3::Y),
            Form::Sun { direction, .. } => *direction,
        }
    }

    /// Draws a direction towards the light: uniform over the cone of a sphere or the sun, over
    /// the area of a panel.
    pub(super) fn sample(&self, point: Vec3, random: Vec2) -> Option<LightSample> {
        match &self.form {
            Form::Ball { centre, radius } => {
                let way = centre - point;
                let square = way.length_squared();
                let (cone, axis) = (Cone::of_ball(*radius, square)?, way / square.sqrt());
                let direction = cone.sample(axis, random);
                let middle = direction.dot(way);
                let reach = radius * radius - (square - middle * middle);
                Some(LightSample { direction, distance: middle - reach.max(0.0).sqrt(), density: cone.density() })
            }
            Form::Panel { pose, half } => {
                let local = (random * 2.0 - 1.0) * half;
                let way = pose.to_world(local.extend(0.0)) - point;
                let distance = way.length();
                let direction = way / distance;
                let facing = -direction.dot(pose.rotation * Vec3::Z);
                (facing > 1e-6).then(|| LightSample {
                    direction,
                    distance,
                    density: distance * distance / (facing * 4.0 * half.x * half.y),
                })
            }
            Form::Sun { direction, radius } => {
                let cone = Cone::of_angle(*radius);
                Some(LightSample {
                    direction: cone.sample(*direction, random),
                    distance: f32::INFINITY,
                    density: cone.density(),
                })
            }
        }
    }

    /// Probability of [`Light::sample`] per solid angle about a direction known to reach the
    /// light after `distance`.
    pub(super) fn density(&self, point: Vec3, direction: Vec3, distance: f32) -> f32 {
        match &self.form {
            Form::Ball { centre, radius } => {
                Cone::of_ball(*radius, centre.distance_squared(point)).map_or(0.0, |c| c.density())
            }
            Form::Panel { pose, half } => {
                let facing = -direction.dot(pose.rotation * Vec3::Z);
                distance * distance / (facing.max(1e-6) * 4.0 * half.x * half.y)
            }
            Form::Sun { radius, .. } => Cone::of_angle(*radius).density(),
        }
    }

    /// Whether a ray that leaves the scene, or hits the carrying object, along `direction` meets
    /// the shining side.
    pub(super) fn shines_against(&self, direction: Vec3) -> bool {
        match &self.form {
            Form::Ball { .. } => true,
            Form::Panel { pose, .. } => direction.dot(pose.rotation * Vec3::Z) < 0.0,
            Form::Sun { direction: to_sun, radius } => {
                direction.dot(*to_sun) > 0.0 && direction.cross(*to_sun).length() < radius.sin()
            }
        }
    }
}

/// Directions within an angle of an axis, by `1 - cos` of that angle, which keeps its digits
/// where the cosine has none left.
struct Cone(f32);

impl Cone {
    fn of_angle(angle: f32) -> Self {
        Self(2.0 * (0.5 * angle).sin().powi(2))
    }

    /// The cone a sphere fills; `None` from inside.
    fn of_ball(radius: f32, square_distance: f32) -> Option<Self> {
        let sine_squared = radius * radius / square_distance;
        (sine_squared < 1.0).then(|| Self(sine_squared / (1.0 + (1.0 - sine_squared).sqrt())))
    }

    fn sample(&self, axis: Vec3, random: Vec2) -> Vec3 {
        let below_one = random.x * self.0;
        let sine = (below_one * (2.0 - below_one)).max(0.0).sqrt();
        let angle = TAU * random.y;
        let local = Vec3::new(sine * angle.cos(), sine * angle.sin(), 1.0 - below_one);
        (frame_around(axis) * local).normalize()
    }

    fn density(&self) -> f32 {
        1.0 / (TAU * self.0)
    }
}
