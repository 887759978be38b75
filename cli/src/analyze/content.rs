//! What the images hold: shares, ranges, and values that mean nothing.

use std::fmt;

use limpid::resource::TILE_SIZE;
use serde::Serialize;

use super::percent;
use crate::sequence::Frame;

/// Perceptual roughness up to which the published pipeline denoises: GGX alpha 0.2.
pub(super) const PUBLISHED_THRESHOLD: f32 = 0.447_213_6;
/// Perceptual roughness up to which a surface counts as a mirror.
const MIRROR: f32 = 0.01;
/// Hit distance from which a ray counts as having left the scene.
const MISS: f32 = 5000.0;

/// Shares are of all pixels unless they say otherwise.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Content {
    /// Frames.
    pub frames: usize,
    /// Pixels without a surface.
    pub sky: f64,
    /// Surfaces up to roughness 0.01.
    pub mirrors: f64,
    /// Surfaces rougher than what the published pipeline denoises.
    pub rough: f64,
    /// 8x8 tiles without a surface up to the published threshold.
    pub tiles_above_published_threshold: f64,
    /// 8x8 tiles without a surface.
    pub empty_tiles: f64,
    /// Surfaces by perceptual roughness, in tenths; shares of surfaces.
    pub roughness: [f64; 10],
    /// Whether all surfaces have the same roughness.
    pub roughness_is_constant: bool,
    /// Values of all images that are NaN or infinite.
    pub not_finite: usize,
    /// Surfaces with negative radiance.
    pub negative_radiance: f64,
    /// Surfaces whose roughness is not within 0 and 1.
    pub roughness_out_of_range: f64,
    /// Surfaces whose normal is longer or shorter than 1 by more than 5 %.
    pub normals_not_unit: f64,
    /// Surfaces with a normal of length 0.
    pub normals_zero: f64,
    /// Surfaces with a hit distance of 0 or less.
    pub hit_distance_missing: f64,
    /// Quartile, median and largest hit distance of rays that hit something.
    pub hit_distance: [f32; 3],
    /// Surfaces whose ray left the scene.
    pub misses: f64,
    /// Mean of the radiance's brightest channel, surfaces only.
    pub mean_radiance: f64,
    /// Largest.
    pub largest_radiance: f32,
    /// Surfaces brighter than 50 times the mean.
    pub fireflies: f64,
    /// Smallest, median and largest linear depth of surfaces.
    pub depth: [f32; 3],
}

#[derive(Default)]
pub(super) struct Gatherer {
    frames: usize,
    pixels: usize,
    tiles: usize,
    surfaces: usize,
    counts: Counts,
    radiance_sum: f64,
    radiance: Vec<f32>,
    depths: Vec<f32>,
    hit_distances: Vec<f32>,
    roughness_range: Option<(f32, f32)>,
    largest_radiance: f32,
}

#[derive(Default)]
struct Counts {
    mirrors: usize,
    rough: usize,
    roughness: [usize; 10],
    rough_tiles: usize,
    empty_tiles: usize,
    not_finite: usize,
    negative_radiance: usize,
    roughness_out_of_range: usize,
    normals_not_unit: usize,
    normals_zero: usize,
    hit_distance_missing: usize,
    misses: usize,
}

impl Gatherer {
    pub(super) fn add(&mut self, frame: &Frame) {
        self.frames += 1;
        self.pixels += frame.pixels();
        let w = frame.warnings();
        self.counts.not_finite += w.radiance + w.hit_distance + w.normal + w.roughness + w.depth + w.motion;
        for i in (0..frame.pixels()).filter(|&i| frame.depth[i] > 0.0) {
            self.add_surface(frame, i);
        }
        self.add_tiles(frame);
    }

    fn add_surface(&mut self, frame: &Frame, i: usize) {
        let counts = &mut self.counts;
        self.surfaces += 1;
        let roughness = frame.roughness[i];
        counts.mirrors += usize::from(roughness <= MIRROR);
        counts.rough += usize::from(roughness > PUBLISHED_THRESHOLD);
        counts.roughness[((roughness.clamp(0.0, 1.0) * 10.0) as usize).min(9)] += 1;
        counts.roughness_out_of_range += usize::from(!(0.0..=1.0).contains(&roughness));
        let (low, high) = self.roughness_range.unwrap_or((roughness, roughness));
        self.roughness_range = Some((low.min(roughness), high.max(roughness)));
        let length = glam::Vec3::from(frame.normal[i]).length();
        counts.normals_zero += usize::from(length < 1e-6);
        counts.normals_not_unit += usize::from(length >= 1e-6 && (length - 1.0).abs() > 0.05);
        let [r, g, b, hit_distance] = frame.radiance[i];
        counts.negative_radiance += usize::from(r.min(g).min(b) < 0.0);
        counts.hit_distance_missing += usize::from(hit_distance <= 0.0);
        counts.misses += usize::from(hit_distance >= MISS);
        let brightest = r.max(g).max(b);
        if brightest.is_finite() {
            self.radiance_sum += f64::from(brightest);
            self.largest_radiance = self.largest_radiance.max(brightest);
            // Every seventh is enough for shares.
            if i.is_multiple_of(7) {
                self.radiance.push(brightest);
                self.depths.push(frame.depth[i]);
                self.hit_distances.extend((0.0 < hit_distance && hit_distance < MISS).then_some(hit_distance));
            }
        }
    }

    fn add_tiles(&mut self, frame: &Frame) {
        let tiles = frame.size.map(|side| side.div_ceil(TILE_SIZE));
        for tile in (0..tiles.x * tiles.y).map(|t| glam::UVec2::new(t % tiles.x, t / tiles.x) * TILE_SIZE) {
            let end = (tile + TILE_SIZE).min(frame.size);
            let mut smoothest = None::<f32>;
            for i in (tile.y..end.y).flat_map(|y| (tile.x..end.x).map(move |x| (y * frame.size.x + x) as usize)) {
                if frame.depth[i] > 0.0 {
                    smoothest = Some(smoothest.map_or(frame.roughness[i], |r| r.min(frame.roughness[i])));
                }
            }
            self.tiles += 1;
            self.counts.empty_tiles += usize::from(smoothest.is_none());
            self.counts.rough_tiles += usize::from(smoothest.is_none_or(|roughness| roughness > PUBLISHED_THRESHOLD));
        }
    }

    pub(super) fn finish(mut self) -> Content {
        let of = |count: usize, all: usize| count as f64 / all.max(1) as f64;
        let (surfaces, counts) = (self.surfaces, &self.counts);
        self.depths.retain(|depth| depth.is_finite());
        let depth = quantiles(&mut self.depths, [0.0, 0.5, 1.0]);
        let hit_distance = quantiles(&mut self.hit_distances, [0.25, 0.5, 1.0]);
        let mean_radiance = self.radiance_sum / surfaces.max(1) as f64;
        let is_firefly = |value: &&f32| f64::from(**value) > 50.0 * mean_radiance;
        Content {
            frames: self.frames,
            sky: of(self.pixels - surfaces, self.pixels),
            mirrors: of(counts.mirrors, self.pixels),
            rough: of(counts.rough, self.pixels),
            tiles_above_published_threshold: of(counts.rough_tiles, self.tiles),
            empty_tiles: of(counts.empty_tiles, self.tiles),
            roughness: counts.roughness.map(|count| of(count, surfaces)),
            roughness_is_constant: self.roughness_range.is_some_and(|(low, high)| high - low < 1e-4),
            not_finite: counts.not_finite,
            negative_radiance: of(counts.negative_radiance, surfaces),
            roughness_out_of_range: of(counts.roughness_out_of_range, surfaces),
            normals_not_unit: of(counts.normals_not_unit, surfaces),
            normals_zero: of(counts.normals_zero, surfaces),
            hit_distance_missing: of(counts.hit_distance_missing, surfaces),
            misses: of(counts.misses, surfaces),
            mean_radiance,
            largest_radiance: self.largest_radiance,
            fireflies: of(self.radiance.iter().filter(is_firefly).count(), self.radiance.len()),
            depth,
            hit_distance,
        }
    }
}

/// Values below which given shares lie; 0 where there are none.
fn quantiles<const N: usize>(values: &mut [f32], shares: [f64; N]) -> [f32; N] {
    values.sort_by(f32::total_cmp);
    let last = values.len().saturating_sub(1) as f64;
    shares.map(|share| values.get((share * last) as usize).copied().unwrap_or(0.0))
}

impl fmt::Display for Content {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (sky, mirrors, rough) = (percent(self.sky), percent(self.mirrors), percent(self.rough));
        writeln!(f, "  pixels       {sky} sky, {mirrors} mirrors, {rough} rougher than {PUBLISHED_THRESHOLD:.3}")?;
        writeln!(
            f,
            "  8x8 tiles    {} without a surface, {} without one up to roughness {PUBLISHED_THRESHOLD:.3}",
            percent(self.empty_tiles),
            percent(self.tiles_above_published_threshold)
        )?;
        let bars: Vec<_> = self.roughness.iter().map(|share| format!("{:.0}", share * 100.0)).collect();
        writeln!(f, "  roughness    {} % of surfaces in tenths from 0 to 1", bars.join(" "))?;
        let [near, median, far] = self.depth;
        writeln!(f, "  depth        {near:.3} to {far:.3}, median {median:.3}")?;
        writeln!(
            f,
            "  radiance     mean {:.3}, largest {:.1}, {} fireflies",
            self.mean_radiance,
            self.largest_radiance,
            percent(self.fireflies)
        )?;
        let (missing, misses) = (percent(self.hit_distance_missing), percent(self.misses));
        let [_, half, most] = self.hit_distance;
        writeln!(
            f,
            "  hit distance median {half:.3}, up to {most:.3}; {missing} have none, {misses} of rays leave the scene"
        )
    }
}
