//! Bounding spheres, tested four at a time before the shapes themselves.

use glam::{Vec3, Vec4};

/// Four bounding spheres, one a lane.
pub(super) struct Bounds {
    x: Vec4,
    y: Vec4,
    z: Vec4,
    square_radius: Vec4,
}

impl Bounds {
    /// Packs `(centre, radius)` pairs, in order; lanes that are left over are never met.
    pub(super) fn pack(spheres: &[(Vec3, f32)]) -> Vec<Self> {
        let pack = |four: &[(Vec3, f32)]| {
            let lanes = |part: fn(&(Vec3, f32)) -> f32| {
                Vec4::from_array(std::array::from_fn(|k| four.get(k).map_or(-1.0, part)))
            };
            Self {
                x: lanes(|sphere| sphere.0.x),
                y: lanes(|sphere| sphere.0.y),
                z: lanes(|sphere| sphere.0.z),
                square_radius: lanes(|sphere| sphere.1 * sphere.1 * 1.001),
            }
        };
        spheres.chunks(4).map(pack).collect()
    }

    /// Which spheres a ray of unit direction may meet, one bit a lane.
    pub(super) fn met(&self, origin: Vec3, direction: Vec3) -> u32 {
        let (x, y, z) = (self.x - origin.x, self.y - origin.y, self.z - origin.z);
        let ahead = x * direction.x + y * direction.y + z * direction.z;
        // Distance of the centres from the nearest point of the line.
        let (dx, dy, dz) = (x - ahead * direction.x, y - ahead * direction.y, z - ahead * direction.z);
        let near = (dx * dx + dy * dy + dz * dz).cmple(self.square_radius);
        let inside = (x * x + y * y + z * z).cmple(self.square_radius);
        (near & (ahead.cmpge(Vec4::ZERO) | inside)).bitmask()
    }
}
