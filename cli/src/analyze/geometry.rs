//! Whether depth and normals mean what limpid takes them for: normals have to be those of the surface that the depth
//! describes.

use std::fmt;

use glam::{Mat3, Mat4, UVec2, Vec2, Vec3, Vec4};
use limpid::Camera;
use serde::Serialize;

use super::percent;
use crate::sequence::Frame;

/// What a depth could mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum DepthMeaning {
    /// Distance along the view axis: what limpid expects of sequences.
    Linear,
    /// Distance along the ray through the pixel.
    RayDistance,
    /// Depth buffer as the projection matrix makes it.
    Device,
    /// One minus that.
    ReversedDevice,
}

/// What a normal could mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum NormalMeaning {
    /// World space, away from the surface: what limpid expects.
    World,
    /// View space.
    View,
    /// World space, `n * 0.5 + 0.5`.
    WorldUnsigned,
    /// View space, `n * 0.5 + 0.5`.
    ViewUnsigned,
    /// World space, into the surface.
    Inward,
}

/// A pair of meanings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Meaning {
    /// Of depth.
    pub depth: DepthMeaning,
    /// Of normals.
    pub normal: NormalMeaning,
}

/// Expected by limpid.
pub(super) const EXPECTED: Meaning = Meaning { depth: DepthMeaning::Linear, normal: NormalMeaning::World };

const DEPTHS: [DepthMeaning; 4] =
    [DepthMeaning::Linear, DepthMeaning::RayDistance, DepthMeaning::Device, DepthMeaning::ReversedDevice];
const NORMALS: [NormalMeaning; 5] = [
    NormalMeaning::World,
    NormalMeaning::View,
    NormalMeaning::WorldUnsigned,
    NormalMeaning::ViewUnsigned,
    NormalMeaning::Inward,
];

/// How well depth and normals fit each other.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Geometry {
    /// Pixels that were compared.
    pub samples: usize,
    /// Share of them whose normal is that of the surface, taken as limpid takes it.
    pub agreement: f64,
    /// The meaning that fits best.
    pub best: Meaning,
    /// Its share.
    pub best_agreement: f64,
    /// Whether clip space looks as if it had `y` down.
    pub y_down: bool,
}

/// Cosine from which two normals agree: bumps and curved surfaces are allowed for.
const AGREEING: f32 = 0.9;
/// Pixels between samples.
const STRIDE: usize = 3;

#[derive(Default)]
pub(super) struct Gatherer {
    samples: usize,
    agreeing: [[usize; NORMALS.len()]; DEPTHS.len()],
    /// With `y` of clip space the other way.
    agreeing_y_down: usize,
}

/// Position in view space of a pixel with a depth, `None` if there is none.
pub(super) fn view_position(
    camera: &Camera,
    inverse_projection: &Mat4,
    size: UVec2,
    pixel: Vec2,
    depth: f32,
    meaning: DepthMeaning,
) -> Option<Vec3> {
    let uv = (pixel + 0.5 + camera.jitter) / size.as_vec2();
    let ndc = Vec2::new(uv.x * 2.0 - 1.0, 1.0 - uv.y * 2.0);
    let unproject = |z: f32| {
        let position = *inverse_projection * ndc.extend(z).extend(1.0);
        Some(position.truncate() / position.w).filter(|position| position.is_finite())
    };
    match meaning {
        DepthMeaning::Device => unproject(depth),
        DepthMeaning::ReversedDevice => unproject(1.0 - depth),
        DepthMeaning::Linear => unproject(0.5).map(|p| p / p.z.abs() * depth),
        DepthMeaning::RayDistance => unproject(0.5).map(|p| p.normalize() * depth),
    }
}

/// Turns `y` of clip space around.
const FLIPPED: Mat4 = Mat4::from_cols(Vec4::X, Vec4::NEG_Y, Vec4::Z, Vec4::W);

/// Normal in view space, towards the camera, of the surface through a pixel's place and those right of and below it.
/// `None` across an edge, where there is no surface.
fn surface_normal([center, right, below]: [Vec3; 3]) -> Option<Vec3> {
    let is_edge = |other: Vec3| (other.length() / center.length() - 1.0).abs() > 0.05;
    if is_edge(right) || is_edge(below) {
        return None;
    }
    let normal = (right - center).cross(below - center).normalize_or_zero();
    Some(if normal.dot(center) > 0.0 { -normal } else { normal })
}

impl Gatherer {
    pub(super) fn add(&mut self, frame: &Frame) {
        let size = frame.size;
        let inverse_projection = frame.camera.view_to_clip.inverse();
        let view_to_world = Mat3::from_mat4(frame.camera.world_to_view).transpose();
        let rows = (1..size.y.saturating_sub(1)).step_by(STRIDE);
        for pixel in rows.flat_map(|y| (1..size.x.saturating_sub(1)).step_by(STRIDE).map(move |x| UVec2::new(x, y))) {
            let at = |dx: u32, dy: u32| ((pixel.y + dy) * size.x + pixel.x + dx) as usize;
            let depths = [at(0, 0), at(1, 0), at(0, 1)].map(|i| frame.depth[i]);
            let stored = Vec3::from(frame.normal[at(0, 0)]);
            if depths.iter().any(|depth| !(depth.is_finite() && *depth > 0.0)) || !stored.is_finite() {
                continue;
            }
            self.samples += 1;
            let candidates = candidates(stored, view_to_world);
            let surface = |meaning, inverse_projection: &Mat4| {
                let position = |dx: f32, dy: f32, depth| {
                    let pixel = pixel.as_vec2() + Vec2::new(dx, dy);
                    view_position(&frame.camera, inverse_projection, size, pixel, depth, meaning)
                };
                surface_normal([
                    position(0.0, 0.0, depths[0])?,
                    position(1.0, 0.0, depths[1])?,
                    position(0.0, 1.0, depths[2])?,
                ])
            };
            let agrees = |candidate: Vec3, normal: Vec3| candidate.dot(view_to_world * normal) > AGREEING;
            for (d, meaning) in DEPTHS.into_iter().enumerate() {
                let Some(normal) = surface(meaning, &inverse_projection) else { continue };
                for (n, candidate) in candidates.iter().enumerate() {
                    self.agreeing[d][n] += usize::from(agrees(*candidate, normal));
                }
            }
            let y_down = surface(DepthMeaning::Linear, &(inverse_projection * FLIPPED));
            self.agreeing_y_down += usize::from(y_down.is_some_and(|normal| agrees(candidates[0], normal)));
        }
    }

    pub(super) fn finish(self) -> Geometry {
        // Of all samples, so that a meaning does not win by making an edge of everything.
        let agreement = |d: usize, n: usize| self.agreeing[d][n] as f64 / self.samples.max(1) as f64;
        let (mut best, mut best_agreement) = (EXPECTED, agreement(0, 0));
        for (d, depth) in DEPTHS.into_iter().enumerate() {
            for (n, normal) in NORMALS.into_iter().enumerate() {
                // Others have to be clearly better.
                if agreement(d, n) > best_agreement + 0.02 {
                    (best, best_agreement) = (Meaning { depth, normal }, agreement(d, n));
                }
            }
        }
        let y_down_agreement = self.agreeing_y_down as f64 / self.samples.max(1) as f64;
        let y_down = y_down_agreement > best_agreement + 0.05;
        if y_down {
            (best, best_agreement) = (EXPECTED, y_down_agreement);
        }
        Geometry { samples: self.samples, agreement: agreement(0, 0), best, best_agreement, y_down }
    }
}

/// World-space unit normals that a stored one could mean, in the order of `NORMALS`.
fn candidates(stored: Vec3, view_to_world: Mat3) -> [Vec3; NORMALS.len()] {
    let unit = stored.normalize_or_zero();
    let from_unsigned = (stored * 2.0 - 1.0).normalize_or_zero();
    [unit, view_to_world * unit, from_unsigned, view_to_world * from_unsigned, -unit]
}

impl fmt::Display for Geometry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "  normals      {} are those of the surface that the depth describes", percent(self.agreement))
    }
}
