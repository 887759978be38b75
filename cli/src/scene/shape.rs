//! Analytic shapes in their own local space, centred on the origin.

use glam::{Vec2, Vec3};

/// A solid or a rectangle around the local origin. Lengths are world units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// A ball.
    Sphere {
        /// Radius, `> 0.0`.
        radius: f32,
    },
    /// A box.
    Cuboid {
        /// Half the edge lengths, `> 0.0`.
        half: Vec3,
    },
    /// A closed cylinder around local Y.
    Cylinder {
        /// Radius, `> 0.0`.
        radius: f32,
        /// Half the height, `> 0.0`.
        half_height: f32,
    },
    /// A cylinder around local Y with a hemisphere at either end.
    Capsule {
        /// Radius, `> 0.0`.
        radius: f32,
        /// Half the height of the straight part, `> 0.0`.
        half_height: f32,
    },
    /// A rectangle in the local XY plane; its front faces +Z, both sides are solid.
    Panel {
        /// Half the edge lengths, `> 0.0`.
        half: Vec2,
    },
}

impl Shape {
    /// Radius of the ball around the origin that holds the shape.
    pub(super) fn bound(&self) -> f32 {
        match *self {
            Self::Sphere { radius } => radius,
            Self::Cuboid { half } => half.length(),
            Self::Cylinder { radius, half_height } => radius.hypot(half_height),
            Self::Capsule { radius, half_height } => radius + half_height,
            Self::Panel { half } => half.length(),
        }
    }

    /// Distance along the ray to the nearest crossing in front of the origin.
    pub(super) fn intersect(&self, origin: Vec3, direction: Vec3) -> Option<f32> {
        match *self {
            Self::Sphere { radius } => first(ball(origin, direction, radius)?),
            Self::Cuboid { half } => {
                let inverse = direction.recip();
                let (centre, reach) = (-origin * inverse, half * inverse.abs());
                let enter = (centre - reach).max_element();
                let leave = (centre + reach).min_element();
                (enter <= leave).then(|| first([enter, leave]))?
            }
            Self::Cylinder { radius, half_height } => {
                let [side_in, side_out] = tube(origin, direction, radius)?;
                let slab = half_height / direction.y.abs();
                let middle = -origin.y / direction.y;
                let enter = side_in.max(middle - slab);
                let leave = side_out.min(middle + slab);
                (enter <= leave).then(|| first([enter, leave]))?
            }
            Self::Capsule { radius, half_height } => {
                let straight = |t: &f32| (origin.y + t * direction.y).abs() <= half_height;
                let side = tube(origin, direction, radius).into_iter().flatten();
                let side = side.filter(straight);
                let caps = [-half_height, half_height].into_iter().flat_map(|y| {
                    ball(origin - Vec3::Y * y, direction, radius)
                        .into_iter()
                        .flatten()
                        .filter(move |t| (origin.y + t * direction.y) * y.signum() >= half_height)
                });
                side.chain(caps).filter(|&t| t > 0.0).reduce(f32::min)
            }
            Self::Panel { half } => {
                let t = -origin.z / direction.z;
                let point = (origin + direction * t).truncate().abs();
                (t > 0.0 && point.cmple(half).all()).then_some(t)
            }
        }
    }

    /// Outward unit normal at a point of the surface; a panel's is +Z.
    pub(super) fn normal(&self, point: Vec3) -> Vec3 {
        match *self {
            Self::Sphere { .. } => point.normalize_or(Vec3::Y),
            Self::Cuboid { half } => {
                let place = point / half;
                let depth = place.abs();
                if depth.x >= depth.y.max(depth.z) {
                    Vec3::X * place.x.signum()
                } else if depth.y >= depth.z {
                    Vec3::Y * place.y.signum()
                } else {
                    Vec3::Z * place.z.signum()
                }
            }
            Self::Cylinder { radius, half_height } => {
                let side = Vec3::new(point.x, 0.0, point.z);
                if half_height - point.y.abs() < radius - side.length() {
                    Vec3::Y * point.y.signum()
                } else {
                    side.normalize_or(Vec3::Y)
                }
            }
            Self::Capsule { half_height, .. } => {
                let spine = Vec3::Y * point.y.clamp(-half_height, half_height);
                (point - spine).normalize_or(Vec3::Y)
            }
            Self::Panel { .. } => Vec3::Z,
        }
    }
}

/// The nearer crossing that lies ahead.
fn first([enter, leave]: [f32; 2]) -> Option<f32> {
    [enter, leave].into_iter().find(|&t| t > 0.0)
}

/// Both crossings of a ray (unit direction) with a sphere, in order. The discriminant is taken
/// from the closest approach, which keeps its digits far away (Haines et al. 2019, "Precision
/// Improvements for Ray/Sphere Intersection").
fn ball(origin: Vec3, direction: Vec3, radius: f32) -> Option<[f32; 2]> {
    let middle = -origin.dot(direction);
    let nearest = origin + direction * middle;
    let square = radius * radius - nearest.length_squared();
    (square >= 0.0).then(|| [middle - square.sqrt(), middle + square.sqrt()])
}

/// Both crossings with an endless cylinder around Y, in order; of a ray along the axis, the
/// whole line or nothing.
fn tube(origin: Vec3, direction: Vec3, radius: f32) -> Option<[f32; 2]> {
    let (o, d) = (Vec2::new(origin.x, origin.z), Vec2::new(direction.x, direction.z));
    let speed = d.length_squared();
    if speed < 1e-12 {
        return (o.length_squared() <= radius * radius).then_some([f32::NEG_INFINITY, f32::INFINITY]);
    }
    let middle = -o.dot(d) / speed;
    let square = (radius * radius - (o + d * middle).length_squared()) / speed;
    (square >= 0.0).then(|| [middle - square.sqrt(), middle + square.sqrt()])
}
