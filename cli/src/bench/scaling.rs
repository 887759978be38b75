//! Run time over image size and over the share of tiles that need denoising.

use std::time::{Duration, Instant};

use anyhow::Result;
use glam::UVec2;
use limpid::Plan;
use limpid::resource::{Extent, TILE_SIZE};

use super::record::{ScalingPoint, Spread};
use super::variant::Variant;
use crate::backend::{self, Choice};
use crate::sequence::Frame;

/// Sizes from small to 8K.
pub const SIZES: [UVec2; 9] = [
    UVec2::new(320, 180),
    UVec2::new(640, 360),
    UVec2::new(960, 540),
    UVec2::new(1280, 720),
    UVec2::new(1920, 1080),
    UVec2::new(2560, 1440),
    UVec2::new(3840, 2160),
    UVec2::new(5120, 2880),
    UVec2::new(7680, 4320),
];

/// Shares of tiles.
const SHARES: [f64; 7] = [0.0, 0.05, 0.1, 0.25, 0.5, 0.75, 1.0];

/// Frames timed at each point, after as many to warm up as it takes until tiles that are left out hold what they keep.
const TIMED: usize = 9;
const WARM_UP: usize = 4;

/// Bytes a pixel that two frames and their copies on the device take; 175 were measured at 8K on a software driver.
const FRAME_BYTES: f64 = 200.0;

/// Memory that can be had, in bytes, where the system tells.
fn available_memory() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    Some(line.trim().trim_end_matches("kB").trim().parse::<f64>().ok()? * 1024.0)
}

fn enlarged<T: Copy>(image: &[T], from: UVec2, to: UVec2) -> Vec<T> {
    let source = |p: UVec2| {
        let at = p * from / to;
        image[(at.y * from.x + at.x) as usize]
    };
    (0..to.y).flat_map(|y| (0..to.x).map(move |x| UVec2::new(x, y))).map(source).collect()
}

/// The frame at another size, each pixel several times. No reference.
fn resized(frame: &Frame, size: UVec2) -> Frame {
    Frame {
        size,
        radiance: enlarged(&frame.radiance, frame.size, size),
        normal: enlarged(&frame.normal, frame.size, size),
        roughness: enlarged(&frame.roughness, frame.size, size),
        depth: enlarged(&frame.depth, frame.size, size),
        motion: enlarged(&frame.motion, frame.size, size),
        hit_motion: frame.hit_motion.as_ref().map(|image| enlarged(image, frame.size, size)),
        reference: None,
        ..*frame
    }
}

/// The frame with sky in all but a share of the tiles. Where there was sky, a surface far away takes its place.
fn with_share(frame: &Frame, share: f64) -> Frame {
    let mut frame = frame.clone();
    let tiles = Extent::Tile.of(frame.size);
    for index in 0..frame.pixels() {
        let pixel = UVec2::new(index as u32 % frame.size.x, index as u32 / frame.size.x) / TILE_SIZE;
        // Multiples of the golden ratio are spread evenly.
        let order = f64::from(pixel.y * tiles.x + pixel.x) * 0.618_033_988_749_895;
        if order.fract() >= share {
            frame.depth[index] = 0.0;
        } else if frame.depth[index] == 0.0 {
            (frame.depth[index], frame.normal[index]) = (100.0, [0.0, 1.0, 0.0]);
        }
    }
    frame
}

fn time_of(choice: Choice, variant: &Variant, frames: &[Frame], share: f64) -> Result<Option<ScalingPoint>> {
    let Some(settings) = &variant.settings else { return Ok(None) };
    let size = frames[0].size;
    let mut backend = backend::open(choice, settings, size)?;
    let mut times = Vec::new();
    for round in 0..WARM_UP + TIMED {
        let denoised = backend.denoise(&frames[round % frames.len()], 1.0, None)?;
        if round >= WARM_UP {
            times.push(denoised.time.as_secs_f64() * 1e3);
        }
    }
    let point = |time| ScalingPoint { variant: variant.name.clone(), size, share, time };
    Ok(Spread::of(times).map(point))
}

/// Which image sizes to time.
#[derive(Clone, Copy, Debug)]
pub enum Sizes<'s> {
    /// Those of [`SIZES`], from the smallest, for which memory and this time are enough.
    Within(Duration),
    /// These, made smaller where memory forbids them.
    Exactly(&'s [UVec2]),
}

/// The largest size of the same shape that so many pixels are enough for.
fn shrunk(size: UVec2, pixels: f64) -> UVec2 {
    let factor = (pixels / pixels_of(size)).sqrt().min(1.0);
    (size.as_dvec2() * factor).as_uvec2().max(UVec2::ONE)
}

fn pixels_of(size: UVec2) -> f64 {
    f64::from(size.x) * f64::from(size.y)
}

/// Times `variant` at the wanted sizes and, unless they are exact, over the share of tiles that need denoising, on two
/// frames that follow each other. `stop` is asked before each point. What is left out is said on standard error.
///
/// # Errors
///
/// When a backend fails at a size that it accepted.
pub fn scaling(
    choice: Choice,
    variant: &Variant,
    frames: &[Frame],
    sizes: Sizes<'_>,
    stop: &dyn Fn() -> bool,
) -> Result<Vec<ScalingPoint>> {
    let Some(settings) = &variant.settings else { return Ok(Vec::new()) };
    // They follow each other over and over: a sequence that begins once, not each time.
    let base: Vec<Frame> = frames.iter().map(|frame| Frame { reset: false, ..with_share(frame, 1.0) }).collect();
    let per_pixel = Plan::new(settings, SIZES[0])?.0.bytes_per_pixel() + FRAME_BYTES;
    let fitting = || available_memory().map_or(f64::INFINITY, |available| 0.8 * available / per_pixel);
    let point = |size: UVec2| {
        let enlarged: Vec<Frame> = base.iter().map(|frame| resized(frame, size)).collect();
        time_of(choice, variant, &enlarged, 1.0)
    };
    let budget = match sizes {
        Sizes::Within(budget) => budget,
        Sizes::Exactly(sizes) => {
            let mut points = Vec::new();
            for wanted in sizes.iter().take_while(|_| !stop()) {
                let size = shrunk(*wanted, fitting());
                if size != *wanted {
                    eprintln!("scaling: {wanted} made {size}: not enough memory");
                }
                points.extend(point(size)?);
            }
            return Ok(points);
        }
    };
    let mut points = growing(budget, &fitting, &point, stop);
    // At a size where overheads no longer matter and every machine still is quick.
    let base: Vec<Frame> = base.iter().map(|frame| resized(frame, SIZES[1])).collect();
    for share in SHARES.into_iter().filter(|share| *share < 1.0) {
        if stop() {
            break;
        }
        let frames: Vec<Frame> = base.iter().map(|frame| with_share(frame, share)).collect();
        points.extend(time_of(choice, variant, &frames, share)?);
    }
    Ok(points)
}

/// Points at growing sizes, until memory (`fitting` pixels) or the budget would not be enough or the device refuses.
fn growing(
    budget: Duration,
    fitting: &dyn Fn() -> f64,
    point: &dyn Fn(UVec2) -> Result<Option<ScalingPoint>>,
    stop: &dyn Fn() -> bool,
) -> Vec<ScalingPoint> {
    let start = Instant::now();
    let mut points = Vec::new();
    let mut last: Option<(f64, Duration)> = None;
    for size in SIZES {
        let pixels = pixels_of(size);
        let skip = |reason: &str| eprintln!("scaling: {}x{} and above left out: {reason}", size.x, size.y);
        if pixels > fitting() {
            skip("not enough memory");
            break;
        }
        let expected = last.map_or(Duration::ZERO, |(before, took)| took.mul_f64(pixels / before));
        if start.elapsed() + expected > budget {
            skip("it would take longer than --scaling-seconds allows");
            break;
        }
        if stop() {
            break;
        }
        let begun = Instant::now();
        match point(size) {
            Ok(point) => points.extend(point),
            Err(error) => {
                skip(&format!("{error:#}"));
                break;
            }
        }
        last = Some((pixels, begun.elapsed()));
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_fit_becomes_the_largest_of_its_shape() {
        let wanted = UVec2::new(7680, 4320);
        assert_eq!(shrunk(wanted, f64::INFINITY), wanted);
        assert_eq!(shrunk(wanted, pixels_of(wanted) / 4.0), UVec2::new(3840, 2160));
        assert!(pixels_of(shrunk(wanted, 1e6)) <= 1e6);
        assert_eq!(shrunk(wanted, 0.0), UVec2::ONE);
    }
}
