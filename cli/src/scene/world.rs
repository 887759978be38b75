//! A scene at one moment: posed objects that rays can meet.

use super::Scene;
use super::bounds::Bounds;
use super::light::{Light, LightSample};
use super::lobe::MIRROR_ROUGHNESS;
use super::object::{Object, Pose};
use super::shape::Shape;
use glam::{Mat3, Vec2, Vec3};

/// A scene with every object where it is at one frame.
pub(super) struct World<'a> {
    /// The scene.
    pub(super) scene: &'a Scene,
    /// Pose of each object.
    pub(super) poses: Vec<Pose>,
    /// Everything that can be sampled as a light.
    pub(super) lights: Vec<Light>,
    bounds: Vec<Bounds>,
    bodies: Vec<Body>,
}

/// What the intersection loop needs of an object.
struct Body {
    shape: Shape,
    centre: Vec3,
    to_local: Mat3,
}

impl Body {
    /// Where a ray first meets the body.
    fn cross(&self, origin: Vec3, direction: Vec3) -> Option<f32> {
        let local = self.to_local * (origin - self.centre);
        self.shape.intersect(local, self.to_local * direction)
    }
}

/// Where a ray meets a surface.
pub(super) struct Hit {
    /// Which object.
    pub(super) object: usize,
    /// Along the ray, world units.
    pub(super) distance: f32,
    /// World space.
    pub(super) point: Vec3,
    /// Unit, world space, against the ray.
    pub(super) normal: Vec3,
    /// The point in the object's local space.
    pub(super) local: Vec3,
}

impl<'a> World<'a> {
    pub(super) fn new(scene: &'a Scene, frame: u32) -> Self {
        let time = scene.time(frame);
        let poses: Vec<_> = scene.objects.iter().map(|o| o.pose(time)).collect();
        let body = |(object, pose): (&Object, &Pose)| Body {
            shape: object.shape,
            centre: pose.position,
            to_local: Mat3::from_quat(pose.rotation).transpose(),
        };
        let sphere = |(object, pose): (&Object, &Pose)| (pose.position, object.shape.bound());
        let spheres: Vec<_> = scene.objects.iter().zip(&poses).map(sphere).collect();
        Self {
            scene,
            bounds: Bounds::pack(&spheres),
            bodies: scene.objects.iter().zip(&poses).map(body).collect(),
            lights: Light::gather(scene, &poses, time),
            poses,
        }
    }

    /// The nearest surface along a ray of unit direction.
    pub(super) fn hit(&self, origin: Vec3, direction: Vec3) -> Option<Hit> {
        let mut nearest = (f32::INFINITY, usize::MAX);
        self.any_candidate(origin, direction, |index, body| {
            if let Some(t) = body.cross(origin, direction).filter(|&t| t < nearest.0) {
                nearest = (t, index);
            }
            false
        });
        let (distance, object) = nearest;
        let body = self.bodies.get(object)?;
        let point = origin + direction * distance;
        let local = body.to_local * (point - body.centre);
        let outward = body.to_local.transpose() * body.shape.normal(local);
        Some(Hit {
            object,
            distance,
            point,
            normal: if outward.dot(direction) > 0.0 { -outward } else { outward },
            local,
        })
    }

    /// Whether anything lies within `distance` along a ray of unit direction.
    pub(super) fn occluded(&self, origin: Vec3, direction: Vec3, distance: f32) -> bool {
        self.any_candidate(origin, direction, |_, body| body.cross(origin, direction).is_some_and(|t| t < distance))
    }

    /// Whether `test` holds for any body whose bounding sphere a ray meets.
    fn any_candidate(&self, origin: Vec3, direction: Vec3, mut test: impl FnMut(usize, &Body) -> bool) -> bool {
        self.bounds.iter().enumerate().any(|(pack, bounds)| {
            let mut met = bounds.met(origin, direction);
            while met != 0 {
                let index = 4 * pack + met.trailing_zeros() as usize;
                if test(index, &self.bodies[index]) {
                    return true;
                }
                met &= met - 1;
            }
            false
        })
    }

    /// Diffuse reflectance, or mirror tint, at a hit.
    pub(super) fn albedo(&self, hit: &Hit) -> Vec3 {
        self.scene.objects[hit.object].material.albedo.at(hit.local)
    }

    /// Perceptual roughness at a hit.
    pub(super) fn roughness(&self, hit: &Hit) -> f32 {
        self.scene.objects[hit.object].material.finish.at(hit.local)
    }

    /// Whether reflections carry on at a hit.
    pub(super) fn is_mirror(&self, hit: &Hit) -> bool {
        self.roughness(hit) < MIRROR_ROUGHNESS
    }

    /// The light a ray sees: that of the object hit, or the sun where nothing is.
    pub(super) fn lamp_along(&self, direction: Vec3, hit: Option<&Hit>) -> Option<usize> {
        let object = hit.map(|hit| hit.object);
        self.lights.iter().position(|light| light.object == object && light.shines_against(direction))
    }

    /// Picks a light in proportion to `importance`, by index, and draws a direction towards it.
    /// The sample carries the probability of both.
    pub(super) fn sample_light(
        &self,
        point: Vec3,
        importance: impl Fn(usize) -> f32,
        random: Vec2,
    ) -> Option<(&Light, LightSample)> {
        let total: f32 = (0..self.lights.len()).map(&importance).sum();
        let (mut left, mut choice) = (random.x * total, None);
        for (index, light) in self.lights.iter().enumerate() {
            let share = importance(index);
            if share > 0.0 {
                // What is left of the random number within the share is as good as new.
                let rest = (left / share).min(1.0 - f32::EPSILON);
                choice = Some((light, share / total, random.with_x(rest)));
                if left < share {
                    break;
                }
                left -= share;
            }
        }
        let (light, probability, random) = choice?;
        let mut sample = light.sample(point, random)?;
        sample.density *= probability;
        Some((light, sample))
    }
}
