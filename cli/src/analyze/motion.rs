//! Whether motion vectors and cameras mean what limpid takes them for: they have to lead to the same surface in the frame
//! before.

use std::fmt;

use glam::{DVec3, Mat4, UVec2, Vec2, Vec3};
use limpid::Camera;
use serde::Serialize;

use super::geometry::{DepthMeaning, view_position};
use super::percent;
use crate::sequence::Frame;

/// What the view matrices of `camera.json` could mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum CameraMeaning {
    /// World to view space: what limpid expects.
    AsExpected,
    /// View to world space.
    ViewInverted,
}

const CAMERAS: [CameraMeaning; 2] = [CameraMeaning::AsExpected, CameraMeaning::ViewInverted];

/// How motion vectors and cameras lead to the frame before.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Motion {
    /// Surfaces that were looked up in the frame before.
    pub samples: usize,
    /// Those that move by more than half a pixel.
    pub moving: f64,
    /// Mean mismatch of surfaces where the motion vectors lead, 0 to 1.
    pub mismatch: f64,
    /// The same of those that move.
    pub moving_mismatch: f64,
    /// The factor on motion vectors that fits best, over the one in the settings.
    pub best_factor: Vec2,
    /// The mismatch, with it, of those that move.
    pub best_mismatch: f64,
    /// Median distance between where motion vectors lead and where the cameras say, in pixels, for moving cameras.
    pub camera_residual: Option<f64>,
    /// What the matrices mean if that fits better.
    pub camera: CameraMeaning,
    /// Whether any camera differs from the one before, cuts aside.
    pub camera_moves: bool,
    /// Surfaces that move by more than a pixel beyond what the camera does.
    pub object_motion: f64,
    /// Whether cameras are jittered.
    pub has_jitter: bool,
    /// Whether motion vectors contain the difference of the jitter.
    pub includes_jitter: bool,
    /// Frames that begin anew, marked as reset, but for the first.
    pub cuts: Vec<u32>,
    /// Frames that continue nothing and are not marked as reset.
    pub unmarked_cuts: Vec<u32>,
    /// Frames that are marked as reset and continue the one before.
    pub needless_resets: Vec<u32>,
}

/// Factors that turn other conventions into limpid's.
fn factors(size: UVec2) -> Vec<Vec2> {
    let magnitudes = [Vec2::ONE, Vec2::splat(0.5), Vec2::splat(2.0), 1.0 / size.as_vec2()];
    let signs = [Vec2::ONE, Vec2::NEG_ONE, Vec2::new(1.0, -1.0), Vec2::new(-1.0, 1.0)];
    magnitudes.into_iter().flat_map(|magnitude| signs.map(|sign| magnitude * sign)).collect()
}

/// Surfaces that are looked at in each frame, about.
const SAMPLES: u32 = 6000;

#[derive(Default)]
struct Sums {
    mismatch: f64,
    count: usize,
}

impl Sums {
    fn add(&mut self, mismatch: f64) {
        self.mismatch += mismatch;
        self.count += 1;
    }

    fn mean(&self) -> f64 {
        self.mismatch / self.count.max(1) as f64
    }
}

/// Surfaces of a frame whose motion tells one convention from another.
pub(super) struct Gatherer {
    factors: Vec<Vec2>,
    samples: usize,
    moving: usize,
    /// Of all surfaces, for each factor, and of those that move: what rests fits whatever the factor.
    sums: [Vec<Sums>; 2],
    camera_residuals: [Vec<f32>; CAMERAS.len()],
    jittered_residuals: Vec<f32>,
    has_jitter: bool,
    camera_moves: bool,
    object_motion: usize,
    cuts: Vec<u32>,
    unmarked_cuts: Vec<u32>,
    needless_resets: Vec<u32>,
}

/// A surface and where it may be found in the frame before.
struct Sample {
    pixel: UVec2,
    uv: Vec2,
    motion: Vec2,
}

fn samples(frame: &Frame) -> Vec<Sample> {
    let stride = ((frame.size.element_product() / SAMPLES) as f32).sqrt().max(1.0) as u32;
    let mut samples = Vec::new();
    for y in (stride / 2..frame.size.y).step_by(stride as usize) {
        for x in (stride / 2..frame.size.x).step_by(stride as usize) {
            let i = (y * frame.size.x + x) as usize;
            let motion = Vec2::from(frame.motion[i]);
            if frame.depth[i].is_finite() && frame.depth[i] > 0.0 && motion.is_finite() {
                let pixel = UVec2::new(x, y);
                samples.push(Sample { pixel, uv: (pixel.as_vec2() + 0.5) / frame.size.as_vec2(), motion });
            }
        }
    }
    samples
}

/// World-space position of the surface of a pixel.
fn world_position(frame: &Frame, inverse_projection: &Mat4, pixel: UVec2) -> Option<DVec3> {
    let i = (pixel.y * frame.size.x + pixel.x) as usize;
    let meaning = DepthMeaning::Linear;
    let depth = frame.depth[i];
    let view = view_position(&frame.camera, inverse_projection, frame.size, pixel.as_vec2(), depth, meaning)?;
    Some(frame.camera.world_to_view.as_dmat4().inverse().transform_point3(view.as_dvec3()))
}

/// 0 where the surface that `previous` shows at `uv` could be the one at `pixel`, towards 1 as it cannot.
fn mismatch(previous: &Frame, frame: &Frame, inverse_projections: [&Mat4; 2], pixel: UVec2, uv: Vec2) -> f64 {
    let place = (uv * previous.size.as_vec2()).floor();
    if !(place.cmpge(Vec2::ZERO).all() && place.cmplt(previous.size.as_vec2()).all()) {
        return 1.0;
    }
    let place = place.as_uvec2();
    let (i, j) = ((pixel.y * frame.size.x + pixel.x) as usize, (place.y * previous.size.x + place.x) as usize);
    if !(previous.depth[j].is_finite() && previous.depth[j] > 0.0) {
        return 1.0;
    }
    let normals = [frame.normal[i], previous.normal[j]].map(|normal| Vec3::from(normal).normalize_or_zero());
    // Those that are not there say nothing.
    let cosine = if normals.contains(&Vec3::ZERO) { 1.0 } else { normals[0].dot(normals[1]) };
    let roughness = (frame.roughness[i] - previous.roughness[j]).abs();
    let here = world_position(frame, inverse_projections[0], pixel);
    let there = world_position(previous, inverse_projections[1], place);
    let distance = here.zip(there).map_or(1.0, |(a, b)| a.distance(b) / f64::from(frame.depth[i]));
    let parts = f64::from((1.0 - cosine) * 5.0) + f64::from(roughness * 10.0) + distance * 10.0;
    if parts.is_finite() { parts.min(1.0) } else { 1.0 }
}

/// Where in `previous` a camera puts a place in the world, in uv.
fn project(camera: &Camera, meaning: CameraMeaning, place: DVec3) -> Option<Vec2> {
    let mut world_to_view = camera.world_to_view.as_dmat4();
    if meaning == CameraMeaning::ViewInverted {
        world_to_view = world_to_view.inverse();
    }
    let clip = camera.view_to_clip.as_dmat4() * world_to_view * place.extend(1.0);
    let uv = glam::DVec2::new(0.5 + 0.5 * clip.x / clip.w, 0.5 - 0.5 * clip.y / clip.w);
    (clip.w > 0.0 && uv.is_finite()).then(|| uv.as_vec2())
}

/// The place in the world that a pixel shows, if the matrices mean that.
fn place_of(frame: &Frame, meaning: CameraMeaning, pixel: UVec2) -> Option<DVec3> {
    let i = (pixel.y * frame.size.x + pixel.x) as usize;
    let inverse = frame.camera.view_to_clip.inverse();
    let (depth, pixel) = (frame.depth[i], pixel.as_vec2());
    let view = view_position(&frame.camera, &inverse, frame.size, pixel, depth, DepthMeaning::Linear)?;
    let view_to_world = match meaning {
        CameraMeaning::ViewInverted => frame.camera.world_to_view.as_dmat4(),
        CameraMeaning::AsExpected => frame.camera.world_to_view.as_dmat4().inverse(),
    };
    Some(view_to_world.transform_point3(view.as_dvec3()))
}

impl Gatherer {
    pub(super) fn new(size: UVec2) -> Self {
        let factors = factors(size);
        Self {
            sums: [(); 2].map(|()| factors.iter().map(|_| Sums::default()).collect()),
            factors,
            samples: 0,
            moving: 0,
            camera_residuals: Default::default(),
            jittered_residuals: Vec::new(),
            has_jitter: false,
            camera_moves: false,
            object_motion: 0,
            cuts: Vec::new(),
            unmarked_cuts: Vec::new(),
            needless_resets: Vec::new(),
        }
    }

    pub(super) fn add(&mut self, previous: &Frame, frame: &Frame) {
        let samples = samples(frame);
        let inverse_projections = [frame.camera.view_to_clip.inverse(), previous.camera.view_to_clip.inverse()];
        let [now, before] = &inverse_projections;
        let jitter = (frame.camera.jitter - previous.camera.jitter) / frame.size.as_vec2();
        self.has_jitter |= frame.camera.jitter != Vec2::ZERO;
        let look_up = |sample: &Sample, factor: Vec2| {
            mismatch(previous, frame, [now, before], sample.pixel, sample.uv - sample.motion * factor)
        };
        let mismatches: Vec<Vec<f64>> =
            self.factors.iter().map(|&factor| samples.iter().map(|sample| look_up(sample, factor)).collect()).collect();
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
        let best = mismatches.iter().map(|values| mean(values)).fold(f64::INFINITY, f64::min);
        if frame.reset {
            self.cuts.push(frame.number);
        }
        // Whatever the convention, nothing fits.
        let is_cut = samples.len() > 50 && best > 0.75;
        match (is_cut, frame.reset) {
            (true, false) => self.unmarked_cuts.push(frame.number),
            (false, true) if samples.len() > 50 && best < 0.2 => self.needless_resets.push(frame.number),
            _ => {}
        }
        if is_cut || frame.reset {
            return;
        }
        self.samples += samples.len();
        let moves = |sample: &Sample| (sample.motion * frame.size.as_vec2()).length() > 0.5;
        let [all, moving] = &mut self.sums;
        for ((all, moving), values) in all.iter_mut().zip(moving).zip(&mismatches) {
            for (sample, value) in samples.iter().zip(values) {
                all.add(*value);
                if moves(sample) {
                    moving.add(*value);
                }
            }
        }
        self.camera_moves |= frame.camera.world_to_view != previous.camera.world_to_view;
        for sample in &samples {
            self.moving += usize::from(moves(sample));
            self.add_residuals(previous, frame, sample, jitter);
        }
    }

    /// How far apart motion vectors and cameras are.
    fn add_residuals(&mut self, previous: &Frame, frame: &Frame, sample: &Sample, jitter: Vec2) {
        let size = frame.size.as_vec2();
        for (index, meaning) in CAMERAS.into_iter().enumerate() {
            let place = place_of(frame, meaning, sample.pixel);
            let Some(uv) = place.and_then(|place| project(&previous.camera, meaning, place)) else { continue };
            // Cameras are not jittered, samples are.
            let unjittered = sample.uv + frame.camera.jitter / size;
            let predicted = unjittered - uv;
            let residual = ((predicted - sample.motion) * size).length();
            self.camera_residuals[index].push(residual);
            if index == 0 {
                self.object_motion += usize::from(residual > 1.0);
                self.jittered_residuals.push(((predicted - jitter - sample.motion) * size).length());
            }
        }
    }

    pub(super) fn finish(mut self) -> Motion {
        let [all, moving] = &self.sums;
        let least =
            |sums: &[Sums]| (0..sums.len()).min_by(|&a, &b| sums[a].mean().total_cmp(&sums[b].mean())).unwrap_or(0);
        // Others have to be clearly better; where little moves, by far, since things that move lie elsewhere anyway.
        let (best_of_all, best_of_moving) = (least(all), least(moving));
        let mismatch = all[0].mean();
        let best = if all[best_of_all].mean() < 0.8 * mismatch - 0.005 {
            best_of_all
        } else if moving[0].count > 50
            && moving[0].mean() > 0.5
            && moving[best_of_moving].mean() < 0.5 * moving[0].mean()
        {
            best_of_moving
        } else {
            0
        };
        let [moving_mismatch, best_mismatch] = [0, best].map(|index| moving[index].mean());
        let median = |values: &mut Vec<f32>| {
            values.sort_by(f32::total_cmp);
            values.get(values.len() / 2).map(|&value| f64::from(value))
        };
        let residuals = self.camera_residuals.each_mut().map(median);
        let jittered = median(&mut self.jittered_residuals);
        let expected = residuals[0];
        let better = |i: usize| residuals[i].zip(expected).is_some_and(|(a, b)| b > 0.5 && a < 0.3 * b);
        let camera = (1..CAMERAS.len()).find(|&i| better(i)).map_or(CameraMeaning::AsExpected, |i| CAMERAS[i]);
        let share = |count: usize| count as f64 / self.samples.max(1) as f64;
        let fits = expected.is_some_and(|residual| residual < 0.5);
        Motion {
            samples: self.samples,
            moving: share(self.moving),
            mismatch,
            moving_mismatch,
            best_factor: self.factors[best],
            best_mismatch,
            camera_residual: expected.filter(|_| self.camera_moves),
            camera,
            object_motion: if fits { share(self.object_motion) } else { 0.0 },
            has_jitter: self.has_jitter,
            includes_jitter: self.has_jitter
                && expected.zip(jittered).is_some_and(|(plain, jittered)| jittered < 0.5 * plain),
            camera_moves: self.camera_moves,
            cuts: self.cuts,
            unmarked_cuts: self.unmarked_cuts,
            needless_resets: self.needless_resets,
        }
    }
}

impl fmt::Display for Motion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.samples == 0 {
            return writeln!(f, "  motion       no frame continues another");
        }
        let (moving, objects) = (percent(self.moving), percent(self.object_motion));
        writeln!(f, "  motion       {moving} of surfaces move, {objects} not just with the camera")?;
        let camera = if self.camera_moves { "moves" } else { "rests" };
        let jitter = if self.has_jitter { "with jitter" } else { "without jitter" };
        let cuts: Vec<_> = self.cuts.iter().map(u32::to_string).collect();
        let cuts = if cuts.is_empty() { "no cuts".to_owned() } else { format!("cuts at {}", cuts.join(", ")) };
        writeln!(f, "  camera       {camera}, {jitter}, {cuts}")?;
        writeln!(f, "  history      {} of surfaces are found where motion vectors lead", percent(1.0 - self.mismatch))?;
        if let Some(residual) = self.camera_residual {
            writeln!(f, "               {residual:.2} pixels from the motion vectors, at the median")?;
        }
        Ok(())
    }
}
