//! What of the pipeline a sequence uses, measured on its images the way the kernels look at them.

use std::fmt;

use glam::{UVec2, Vec2};
use limpid::resource::BLOCK_SIZE;
use limpid::{Camera, Settings};
use serde::Serialize;

use super::geometry::{DepthMeaning, view_position};
use super::percent;
use crate::bench::history::History;
use crate::sequence::Frame;

/// Half axes of the filter, in pixels, up to which blocks take no part, and from which on they do all
/// (`kernels/lobe_filter.wgsl`).
const WIDE: [f32; 2] = [1.0, 3.0];
/// Roughness below which nothing is an outlier (`kernels/shared/outliers.wgsl`).
pub(super) const OUTLIER_ROUGHNESS: f32 = 0.015;
/// Roughness up to which light that changes is not looked for (`kernels/accumulate.wgsl`).
pub(super) const LIGHT_ROUGHNESS: f32 = 0.05;
/// Roughness from which on the reflected point's history alone is worth nothing (`kernels/accumulate.wgsl`).
pub(super) const REFLECTION_UP_TO: f32 = 0.6;
/// Roughness from which on blocks are worked on as a whole (`kernels/list_blocks.wgsl`).
pub(super) const WHOLE_ROUGHNESS: f32 = 0.15;
/// Pixels along a side of a cell whose light is compared.
const CELL: u32 = 8;
/// Fewest surfaces of a cell that say anything.
const CELL_SAMPLES: f64 = 16.0;
/// Change of brightness between two frames at rest that is not rounding.
const VISIBLE: f32 = 0.02;
/// Pixels that a surface at rest may seem to move by, through rounding.
const AT_REST: f32 = 0.02;
/// Steps of roughness.
const STEPS: usize = 255;

/// Shares are of surfaces that are denoised and traced unless they say otherwise.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Needs {
    /// Frames that continue the one before.
    pub continued: usize,
    /// Smallest and largest perceptual roughness.
    pub roughness: [f32; 2],
    /// The roughness between surfaces that are traced and rougher ones that never are, where there are such.
    pub traced_up_to: Option<f32>,
    /// Filters whose half axis is above a pixel.
    pub wide: f64,
    /// Filters whose half axis is below 3 pixels.
    pub narrow: f64,
    /// Samples that are cut off as outliers.
    pub outliers: f64,
    /// Whether all frames have the same camera.
    pub camera_rests: bool,
    /// Surfaces with motion vectors that are not next to 0.
    pub moving: f64,
    /// Surfaces that reflect things which move, by `hit_motion`, and are smooth enough to show it.
    pub moving_hits: f64,
    /// Cells of 8x8 pixels, in the frame where it is most, whose light changes at roughness above 0.05.
    pub light_changes: f64,
    /// The same at roughness below `accumulate.clip_roughness`.
    pub reflections_change: f64,
    /// Pixels at rest whose brightness changes from frame to frame; `None` where nothing rests.
    pub noisy: Option<f64>,
    /// Roughness up to which rays at rest hit the same in every frame, as those of perfect mirrors do.
    pub mirrors_up_to: Option<f32>,
}

/// Counts by roughness.
type Histogram = [usize; STEPS + 1];

fn step_of(roughness: f32) -> usize {
    (roughness.clamp(0.0, 1.0) * STEPS as f32) as usize
}

pub(super) struct Gatherer {
    settings: Settings,
    exposure: f32,
    continued: usize,
    camera: Option<Camera>,
    camera_rests: bool,
    surfaces: usize,
    roughness: [f32; 2],
    traced: Histogram,
    untraced: Histogram,
    wide: usize,
    narrow: usize,
    outliers: usize,
    moving: usize,
    moving_hits: usize,
    changes: [f64; 2],
    resting: usize,
    noisy: usize,
    repeats: Histogram,
    differs: Histogram,
}

/// Sums over a cell of how brightness differs from the frame before.
#[derive(Default, Clone, Copy)]
struct Cell {
    count: f64,
    difference: f64,
    square: f64,
    before: f64,
}

impl Cell {
    fn add(&mut self, now: f32, before: f32) {
        let difference = f64::from(now - before);
        self.count += 1.0;
        self.difference += difference;
        self.square += difference * difference;
        self.before += f64::from(before);
    }

    /// Whether it changed by more than its noise and a share of its brightness.
    fn changed(&self) -> bool {
        let (mean, before) = (self.difference / self.count, self.before / self.count);
        let variance = (self.square / self.count - mean * mean).max(0.0) / self.count;
        mean.abs() > 4.0 * variance.sqrt() + 0.15 * before + 0.01
    }
}

impl Gatherer {
    pub(super) fn new(settings: &Settings, exposure: f32) -> Self {
        Self {
            settings: settings.clone(),
            exposure,
            continued: 0,
            camera: None,
            camera_rests: true,
            surfaces: 0,
            roughness: [1.0, 0.0],
            traced: [0; STEPS + 1],
            untraced: [0; STEPS + 1],
            wide: 0,
            narrow: 0,
            outliers: 0,
            moving: 0,
            moving_hits: 0,
            changes: [0.0; 2],
            resting: 0,
            noisy: 0,
            repeats: [0; STEPS + 1],
            differs: [0; STEPS + 1],
        }
    }

    fn luminance(&self, frame: &Frame, i: usize) -> f32 {
        let [r, g, b, _] = frame.radiance[i];
        let l = (0.2126 * r + 0.7152 * g + 0.0722 * b) * self.exposure;
        if l.is_finite() { l.max(0.0) } else { 0.0 }
    }

    fn brightness(&self, frame: &Frame, i: usize) -> f32 {
        let l = self.luminance(frame, i);
        l / (1.0 + l)
    }

    fn is_denoised(&self, frame: &Frame, i: usize) -> bool {
        let (depth, roughness) = (frame.depth[i], frame.roughness[i]);
        depth > 0.0 && depth.is_finite() && roughness <= self.settings.coverage.roughness_threshold
    }

    pub(super) fn add(&mut self, frame: &Frame, previous: Option<&Frame>) {
        let camera = self.camera.get_or_insert(frame.camera);
        self.camera_rests &= *camera == frame.camera;
        let inverse = frame.camera.view_to_clip.inverse();
        for i in (0..frame.pixels()).filter(|&i| self.is_denoised(frame, i)).collect::<Vec<_>>() {
            let step = step_of(frame.roughness[i]);
            let [r, g, b, distance] = frame.radiance[i];
            if distance <= 0.0 && r.max(g).max(b) <= 0.0 {
                self.untraced[step] += 1;
                continue;
            }
            self.traced[step] += 1;
            self.surfaces += 1;
            let [low, high] = self.roughness;
            self.roughness = [low.min(frame.roughness[i]), high.max(frame.roughness[i])];
            let motion = Vec2::from(frame.motion[i]) * frame.size.as_vec2();
            self.moving += usize::from(motion.length() > AT_REST);
            let hit_moves = frame.hit_motion.as_ref().is_some_and(|motion| moves(motion[i]));
            self.moving_hits += usize::from(hit_moves && frame.roughness[i] < REFLECTION_UP_TO);
            let radius = self.filter_radius(frame, &inverse, i);
            self.wide += usize::from(radius[1].is_nan() || radius[1] > WIDE[0]);
            self.narrow += usize::from(radius[0].is_nan() || radius[0] < WIDE[1]);
        }
        self.add_outliers(frame);
        if let Some(history) = History::new(frame, previous) {
            self.continued += 1;
            let previous = previous.expect("there is no history without a frame before");
            self.add_changes(frame, previous, &history);
            if frame.camera == previous.camera {
                self.add_noise(frame, previous);
            }
        }
    }

    /// Least and most half axis of the filter of a pixel, in pixels. They differ where the hit distance is not known.
    fn filter_radius(&self, frame: &Frame, inverse: &glam::Mat4, i: usize) -> [f32; 2] {
        let pixel = UVec2::new(i as u32 % frame.size.x, i as u32 / frame.size.x).as_vec2();
        let position = view_position(&frame.camera, inverse, frame.size, pixel, frame.depth[i], DepthMeaning::Linear);
        let projection = frame.camera.view_to_clip;
        let pixels_per_unit = frame.size.y as f32 * projection.y_axis.y.abs() / 2.0;
        let scale = pixels_per_unit * frame.roughness[i] * frame.roughness[i] * self.settings.footprint.filter_scale;
        let distance = frame.radiance[i][3];
        let is_orthographic = projection.z_axis.w == 0.0;
        match position.filter(|_| distance > 0.0) {
            Some(_) if is_orthographic => [scale * distance; 2],
            Some(position) => [scale * distance / (distance + position.length()); 2],
            None => [0.0, scale],
        }
    }

    /// The sample of each block that is far brighter than all others.
    fn add_outliers(&mut self, frame: &Frame) {
        for y in (0..frame.size.y).step_by(BLOCK_SIZE as usize) {
            for x in (0..frame.size.x).step_by(BLOCK_SIZE as usize) {
                let (mut peak, mut second, mut roughness, mut count) = (0f32, 0f32, 0.0, 0);
                for i in block(frame.size, UVec2::new(x, y), BLOCK_SIZE).filter(|&i| self.is_denoised(frame, i)) {
                    let l = self.luminance(frame, i);
                    count += 1;
                    if l > peak {
                        (second, peak, roughness) = (peak, l, frame.roughness[i]);
                    } else {
                        second = second.max(l);
                    }
                }
                let is_outlier = count > 1 && peak > self.settings.accumulate.outlier_factor * second;
                self.outliers += usize::from(is_outlier && roughness >= OUTLIER_ROUGHNESS);
            }
        }
    }

    /// Where the light differs from that at the same surfaces in the frame before, by cells.
    fn add_changes(&mut self, frame: &Frame, previous: &Frame, history: &History<'_>) {
        let clip_roughness = self.settings.accumulate.clip_roughness;
        let (mut cells, mut changed) = ([0usize; 2], [0usize; 2]);
        for y in (0..frame.size.y).step_by(CELL as usize) {
            for x in (0..frame.size.x).step_by(CELL as usize) {
                let mut both = [Cell::default(); 2];
                for i in block(frame.size, UVec2::new(x, y), CELL).filter(|&i| self.is_denoised(frame, i)) {
                    let Some(place) = history.place(i) else { continue };
                    let nearest = history.taps(place).max_by(|a, b| a.1.total_cmp(&b.1));
                    let Some((j, _)) = nearest.filter(|&(j, _)| self.is_denoised(previous, j)) else { continue };
                    let (now, before) = (self.brightness(frame, i), self.brightness(previous, j));
                    let roughness = frame.roughness[i];
                    if roughness > LIGHT_ROUGHNESS {
                        both[0].add(now, before);
                    }
                    if roughness < clip_roughness {
                        both[1].add(now, before);
                    }
                }
                for (k, cell) in both.iter().enumerate().filter(|(_, cell)| cell.count >= CELL_SAMPLES) {
                    cells[k] += 1;
                    changed[k] += usize::from(cell.changed());
                }
            }
        }
        for k in 0..2 {
            self.changes[k] = self.changes[k].max(share(changed[k], cells[k]));
        }
    }

    /// What differs where nothing moved.
    fn add_noise(&mut self, frame: &Frame, previous: &Frame) {
        for i in 0..frame.pixels() {
            let motion = Vec2::from(frame.motion[i]) * frame.size.as_vec2();
            let is_same = (frame.depth[i] - previous.depth[i]).abs() <= 1e-4 * frame.depth[i];
            let rests = self.is_denoised(frame, i) && motion.length() <= AT_REST && is_same;
            if !rests {
                continue;
            }
            self.resting += 1;
            let change = (self.brightness(frame, i) - self.brightness(previous, i)).abs();
            self.noisy += usize::from(change > VISIBLE);
            let (now, before) = (frame.radiance[i][3], previous.radiance[i][3]);
            let same = (now - before).abs() <= 2e-3 * before.abs();
            let step = step_of(frame.roughness[i]);
            (if same { &mut self.repeats } else { &mut self.differs })[step] += 1;
        }
    }

    pub(super) fn finish(self) -> Needs {
        let of = |count: usize| share(count, self.surfaces);
        let roughest = self.traced.iter().rposition(|&count| count > 0);
        let beyond = |first: usize| self.untraced[first..].iter().position(|&count| count > 0).map(|k| first + k);
        let untraced = roughest.and_then(|roughest| Some((roughest, beyond(roughest + 1)?)));
        let untraced = untraced.filter(|&(_, first)| {
            share(self.untraced[first..].iter().sum(), self.surfaces + self.untraced.iter().sum::<usize>()) > 0.005
        });
        let is_lobe = |k: &usize| share(self.differs[*k], self.differs[*k] + self.repeats[*k]) > 0.01;
        let lobes_from = (0..=STEPS).find(is_lobe).unwrap_or(STEPS + 1);
        let mirrors = self.repeats[..lobes_from].iter().rposition(|&count| count > 0);
        Needs {
            continued: self.continued,
            roughness: self.roughness,
            traced_up_to: untraced.map(|(low, high)| (low + 1 + high) as f32 / (2 * STEPS) as f32),
            wide: of(self.wide),
            narrow: of(self.narrow),
            outliers: of(self.outliers),
            camera_rests: self.camera_rests,
            moving: of(self.moving),
            moving_hits: of(self.moving_hits),
            light_changes: self.changes[0],
            reflections_change: self.changes[1],
            noisy: (self.resting > 0).then(|| share(self.noisy, self.resting)),
            mirrors_up_to: mirrors.map(|k| (k + 1) as f32 / STEPS as f32),
        }
    }
}

/// Whether what was hit has moved; what is no number counts as none.
fn moves(hit_motion: [f32; 3]) -> bool {
    hit_motion.iter().all(|x| x.is_finite()) && hit_motion != [0.0; 3]
}

fn share(count: usize, all: usize) -> f64 {
    count as f64 / all.max(1) as f64
}

/// Indices of the pixels of a block.
fn block(size: UVec2, corner: UVec2, side: u32) -> impl Iterator<Item = usize> {
    let end = (corner + side).min(size);
    (corner.y..end.y).flat_map(move |y| (corner.x..end.x).map(move |x| (y * size.x + x) as usize))
}

impl fmt::Display for Needs {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (wide, narrow, outliers) = (percent(self.wide), percent(self.narrow), percent(self.outliers));
        writeln!(
            f,
            "  filters      {wide} wider than a pixel, {narrow} narrower than 3; {outliers} of samples are outliers"
        )?;
        let (light, reflections) = (percent(self.light_changes), percent(self.reflections_change));
        writeln!(
            f,
            "  changes      light in {light} of cells, reflections in smooth surfaces in {reflections}, at most"
        )?;
        if self.moving_hits > 0.0 {
            writeln!(f, "  hit motion   {} of surfaces reflect things that move", percent(self.moving_hits))?;
        }
        match self.noisy {
            Some(noisy) => {
                writeln!(f, "  noise        {} of pixels at rest change from frame to frame", percent(noisy))
            }
            None => writeln!(f, "  noise        nothing rests, so it is not known"),
        }
    }
}
