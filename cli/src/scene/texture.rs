//! Procedural textures: colour and roughness as functions of a point in local space.

use super::sampler::{hash, unit_float};
use glam::{IVec3, Vec3};

/// Diffuse reflectance of a surface (or the tint of a mirror), linear RGB in `0.0..1.0`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pattern {
    /// One colour.
    Solid(Vec3),
    /// Two colours in alternating cubes.
    Checker {
        /// The two colours.
        colors: [Vec3; 2],
        /// Edge of a cube, world units.
        size: f32,
    },
    /// Two colours in alternating layers along local Y.
    Stripes {
        /// The two colours.
        colors: [Vec3; 2],
        /// Thickness of a layer, world units.
        size: f32,
    },
    /// Cubes of random bright colours.
    Mosaic {
        /// Edge of a cube, world units.
        size: f32,
        /// Chooses the colours.
        seed: u32,
    },
    /// Soft noise between two colours.
    Clouds {
        /// The two colours.
        colors: [Vec3; 2],
        /// Size of the largest spots, world units.
        size: f32,
    },
}

impl Pattern {
    /// The colour at a local point.
    pub(super) fn at(&self, point: Vec3) -> Vec3 {
        match *self {
            Self::Solid(color) => color,
            Self::Checker { colors, size } => {
                let cell = cell(point, size);
                colors[((cell.x + cell.y + cell.z) & 1) as usize]
            }
            Self::Stripes { colors, size } => colors[(cell(point, size).y & 1) as usize],
            Self::Mosaic { size, seed } => {
                let hue = std::f32::consts::TAU * cell_value(cell(point, size), seed);
                let wave = Vec3::new(hue, hue - 2.1, hue + 2.1).map(f32::cos);
                wave * 0.38 + 0.45
            }
            Self::Clouds { colors, size } => colors[0].lerp(colors[1], noise(point / size, 1)),
        }
    }
}

/// Perceptual roughness of a surface, `0.0..=1.0`; GGX alpha is its square. Below 0.01 the
/// surface is a perfect mirror.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Finish {
    /// The same everywhere.
    Even(f32),
    /// Cubes of random roughness.
    Tiles {
        /// Lowest and highest roughness.
        range: [f32; 2],
        /// Edge of a cube, world units.
        size: f32,
    },
    /// Patches with soft edges, such as puddles.
    Patches {
        /// Roughness inside and outside the patches.
        range: [f32; 2],
        /// Size of a patch, world units.
        size: f32,
    },
}

impl Finish {
    /// The roughness at a local point.
    pub(super) fn at(&self, point: Vec3) -> f32 {
        match *self {
            Self::Even(roughness) => roughness,
            Self::Tiles { range, size } => {
                let step = (cell_value(cell(point, size), 7) * 5.0).floor() / 4.0;
                range[0] + (range[1] - range[0]) * step
            }
            Self::Patches { range, size } => {
                let edge = ((noise(point / size, 3) - 0.42) / 0.16).clamp(0.0, 1.0);
                range[0] + (range[1] - range[0]) * smooth(edge)
            }
        }
    }
}

/// The lattice cell of a point. Cells are centred on the origin, so that a flat surface through
/// it, or one a whole number of cells away, does not lie on a border.
fn cell(point: Vec3, size: f32) -> IVec3 {
    (point / size + 0.5).floor().as_ivec3()
}

/// A random number in `0.0..1.0` for a lattice cell.
fn cell_value(cell: IVec3, seed: u32) -> f32 {
    let cell = cell.as_uvec3();
    unit_float(hash([cell.x, cell.y, cell.z, seed]))
}

/// Two octaves of value noise, `0.0..1.0`.
fn noise(point: Vec3, seed: u32) -> f32 {
    0.7 * value_noise(point, seed) + 0.3 * value_noise(point * 2.7, seed + 1)
}

/// Random values on the integer lattice, smoothly interpolated.
fn value_noise(point: Vec3, seed: u32) -> f32 {
    let base = point.floor();
    let part = (point - base).map(smooth);
    let corner = |x, y, z| cell_value(base.as_ivec3() + IVec3::new(x, y, z), seed);
    let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
    let edge = |y, z| mix(corner(0, y, z), corner(1, y, z), part.x);
    let face = |z| mix(edge(0, z), edge(1, z), part.y);
    mix(face(0), face(1), part.z)
}

/// Hermite step from 0 to 1 over `0.0..=1.0`.
fn smooth(x: f32) -> f32 {
    x * x * (3.0 - 2.0 * x)
}
