//! Whether depth and normals mean what limpid takes them for: normals have to be those of the surface that the depth
//! describes.

use std::fmt;

use glam::{Mat3, Mat4, UVec2, Vec2, Vec3};
use limpid::Camera;
use serde::Serialize;

use super::conform::FLIPPED;
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

/// Whose view matrices those of `camera.json` are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum MatrixTiming {
    /// Of their own frame.
    Own,
    /// Of the frame before.
    FrameBefore,
    /// Of the frame after.
    FrameAfter,
}

/// Median distances between stored unit normals and those of the surface that the depth describes; about radians.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Apart {
    /// As limpid takes both.
    pub own: f64,
    /// With the normals taken for view-space ones.
    pub view: f64,
    /// Of surfaces that the camera turns against: with their own view matrix, that of the frame before, and that of the
    /// frame after.
    pub turned: Option<[f64; 3]>,
}

/// Whether a distance is clearly below another. Below a tenth of a degree it is that of rounding.
fn is_clearly_below(distance: f64, other: f64) -> bool {
    other > 2e-3 && distance < 0.4 * other
}

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
    /// Whose view matrices turn normals of the depth into those that are stored.
    pub matrices: MatrixTiming,
    /// Median distance between stored normals and those of the depth.
    pub apart: Apart,
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
    /// Stored normal in world space and that of the depth in view space, of the last frame, with its matrix.
    last: Option<(Mat3, Vec<[Vec3; 2]>)>,
    /// Distances between stored normals and those of the depth: own, view; own, before and after of what turned.
    distances: [Vec<f32>; 5],
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

/// The same as of neighbours on both sides, which is right of curved surfaces too. Not for pixels at the border.
fn smooth_normal(frame: &Frame, inverse_projection: &Mat4, pixel: UVec2) -> Option<Vec3> {
    let position = |dx: i32, dy: i32| {
        let at = pixel.as_ivec2() + glam::IVec2::new(dx, dy);
        let depth = frame.depth[(at.y * frame.size.x as i32 + at.x) as usize];
        let meaning = DepthMeaning::Linear;
        let place = view_position(&frame.camera, inverse_projection, frame.size, at.as_vec2(), depth, meaning);
        place.filter(|_| depth > 0.0)
    };
    let center = position(0, 0)?;
    let [left, right, above, below] = [position(-1, 0)?, position(1, 0)?, position(0, -1)?, position(0, 1)?];
    let is_edge = |other: Vec3| (other.length() / center.length() - 1.0).abs() > 0.05;
    if [left, right, above, below].into_iter().any(is_edge) {
        return None;
    }
    let normal = (right - left).cross(below - above).normalize_or_zero();
    Some(if normal.dot(center) > 0.0 { -normal } else { normal })
}

impl Gatherer {
    pub(super) fn add(&mut self, frame: &Frame) {
        let size = frame.size;
        let inverse_projection = frame.camera.view_to_clip.inverse();
        let view_to_world = Mat3::from_mat4(frame.camera.world_to_view).transpose();
        let mut pairs = Vec::new();
        let rows = (1..size.y.saturating_sub(1)).step_by(STRIDE);
        for pixel in rows.flat_map(|y| (1..size.x.saturating_sub(1)).step_by(STRIDE).map(move |x| UVec2::new(x, y))) {
            let at = |dx: u32, dy: u32| ((pixel.y + dy) * size.x + pixel.x + dx) as usize;
            let depths = [at(0, 0), at(1, 0), at(0, 1)].map(|i| frame.depth[i]);
            let stored = Vec3::from(frame.normal[at(0, 0)]);
            if depths.iter().any(|depth| !(depth.is_finite() && *depth > 0.0))
                || !stored.is_finite()
                || stored == Vec3::ZERO
            {
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
            pairs.extend(smooth_normal(frame, &inverse_projection, pixel).map(|normal| [candidates[0], normal]));
            let y_down = surface(DepthMeaning::Linear, &(inverse_projection * FLIPPED));
            self.agreeing_y_down += usize::from(y_down.is_some_and(|normal| agrees(candidates[0], normal)));
        }
        self.add_distances(frame.reset, view_to_world, pairs);
    }

    /// `pairs` are normals as stored and those of the depth in view space. With matrices that come a frame late, this
    /// frame's are those of the images before, and the other way round.
    fn add_distances(&mut self, reset: bool, matrix: Mat3, pairs: Vec<[Vec3; 2]>) {
        let distances = |matrix: Mat3, pairs: &[[Vec3; 2]]| -> Vec<f32> {
            pairs.iter().map(|[stored, surface]| stored.distance(matrix * *surface)).collect()
        };
        self.distances[0].extend(distances(matrix, &pairs));
        self.distances[1].extend(distances(Mat3::IDENTITY, &pairs));
        if let Some((last_matrix, last)) = self.last.take().filter(|_| !reset) {
            // The ground says nothing of a camera that turns about what is upright.
            let turned = |pairs: &[[Vec3; 2]]| -> Vec<[Vec3; 2]> {
                let turns = |[_, n]: &&[Vec3; 2]| (matrix * *n).distance(last_matrix * *n) > 2e-3;
                pairs.iter().filter(turns).copied().collect()
            };
            let (now, last) = (turned(&pairs), turned(&last));
            self.distances[2].extend(distances(matrix, &now));
            self.distances[3].extend(distances(matrix, &last));
            self.distances[4].extend(distances(last_matrix, &now));
        }
        self.last = Some((matrix, pairs));
    }

    fn apart(&mut self) -> Apart {
        let enough = self.distances[2..].iter().all(|values| values.len() > 50);
        let median = |values: &mut Vec<f32>| {
            values.sort_by(f32::total_cmp);
            values.get(values.len() / 2).map_or(0.0, |&value| f64::from(value))
        };
        let [own, view, turned @ ..] = self.distances.each_mut().map(median);
        Apart { own, view, turned: enough.then_some(turned) }
    }

    pub(super) fn finish(mut self) -> Geometry {
        let apart = self.apart();
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
        // A camera that looks nearly along an axis turns normals by too little for shares to tell.
        if best == EXPECTED && !y_down && is_clearly_below(apart.view, apart.own) {
            (best, best_agreement) = (Meaning { normal: NormalMeaning::View, ..EXPECTED }, agreement(0, 1));
        }
        let [own, before, after] = apart.turned.filter(|_| best == EXPECTED && !y_down).unwrap_or_default();
        let matrices = match (is_clearly_below(before, own), is_clearly_below(after, own)) {
            (true, _) if before <= after => MatrixTiming::FrameBefore,
            (_, true) => MatrixTiming::FrameAfter,
            (true, _) => MatrixTiming::FrameBefore,
            _ => MatrixTiming::Own,
        };
        Geometry { samples: self.samples, agreement: agreement(0, 0), best, best_agreement, y_down, matrices, apart }
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
