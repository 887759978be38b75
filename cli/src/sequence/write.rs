//! Writing single images and whole sequences.

use std::borrow::Borrow;
use std::fs;
use std::io;
use std::path::Path;

use exr::compression::Compression;
use exr::image::write::WritableImage;
use exr::image::{AnyChannel, AnyChannels, Blocks, Encoding, FlatSamples, Image, Layer};
use exr::math::Vec2;
use exr::meta::attribute::LineOrder;
use glam::UVec2;
use half::f16;
use serde::Serialize;

use super::{Frame, Metadata, SequenceError, write_atomically};

/// Writes linear radiance as channels `R`, `G`, `B`: half floats, ZIP-compressed scan lines, with
/// the header attributes `metadata`. The file appears whole or not at all.
///
/// Finite values beyond the range of half floats become the largest half float.
pub fn write_exr(path: &Path, size: UVec2, rgb: &[[f32; 3]], metadata: &Metadata) -> Result<(), SequenceError> {
    check_pixels(path, "rgb", rgb.len(), size)?;
    let channels = vec![half("R", rgb, 0), half("G", rgb, 1), half("B", rgb, 2)];
    write_channels(path, size, channels, metadata)
}

/// Writes a sequence that [`Sequence::open`](super::Sequence::open) reads: a file
/// `frame_NNNN.exr` per frame with the default channel names and a `camera.json`, in the folder
/// `dir`, which is created if need be.
///
/// Depth and motion are written as floats, all else as half floats; finite values beyond their
/// range become the largest half float. `exposure` is the factor to view the sequence with.
pub fn write_sequence<F: Borrow<Frame>>(
    dir: &Path,
    name: &str,
    exposure: f32,
    frames: impl IntoIterator<Item = F>,
) -> Result<(), SequenceError> {
    fs::create_dir_all(dir).map_err(|reason| SequenceError::write(dir, reason))?;
    let camera_path = dir.join("camera.json");
    let mut entries = Vec::new();
    let mut size = None;
    for frame in frames {
        let frame = frame.borrow();
        let file = format!("frame_{:04}.exr", frame.number);
        let path = dir.join(&file);
        let expected = *size.get_or_insert(frame.size);
        if frame.size != expected {
            let found = frame.size;
            return Err(SequenceError::Size { path, expected, found });
        }
        write_frame(&path, frame)?;
        entries.push(FrameJson::new(frame, file));
    }
    let Some(size) = size else {
        return Err(SequenceError::NoFrames { path: dir.to_owned() });
    };
    let cameras =
        CameraJson { sequence: name, width: size.x, height: size.y, exposure, convention: CONVENTION, frames: entries };
    write_atomically(&camera_path, |file| Ok(serde_json::to_writer_pretty(file, &cameras)?))
        .map_err(|reason| SequenceError::write(&camera_path, reason))
}

const CONVENTION: &str = "Matrices are row-major nested lists, applied to column vectors: \
    clip = proj * view * [world,1]. View space looks down -Z, +Y up; clip depth 0..1, NDC +Y up. \
    Z channel = -view_z, 0 = sky. motion = uv_current - uv_previous, uv origin top-left. \
    hit_motion = world position of what was hit, current - previous. \
    jitter: pixels. reset: history is invalid at this frame.";

#[derive(Serialize)]
struct CameraJson<'a> {
    sequence: &'a str,
    width: u32,
    height: u32,
    exposure: f32,
    convention: &'a str,
    frames: Vec<FrameJson>,
}

#[derive(Serialize)]
struct FrameJson {
    frame: u32,
    file: String,
    reset: bool,
    seconds: f32,
    jitter: [f32; 2],
    view: [[f32; 4]; 4],
    proj: [[f32; 4]; 4],
}

impl FrameJson {
    fn new(frame: &Frame, file: String) -> Self {
        Self {
            frame: frame.number,
            file,
            reset: frame.reset,
            seconds: frame.seconds,
            jitter: frame.camera.jitter.to_array(),
            view: frame.camera.world_to_view.transpose().to_cols_array_2d(),
            proj: frame.camera.view_to_clip.transpose().to_cols_array_2d(),
        }
    }
}

fn write_frame(path: &Path, frame: &Frame) -> Result<(), SequenceError> {
    let size = frame.size;
    check_pixels(path, "radiance", frame.radiance.len(), size)?;
    check_pixels(path, "normal", frame.normal.len(), size)?;
    check_pixels(path, "roughness", frame.roughness.len(), size)?;
    check_pixels(path, "depth", frame.depth.len(), size)?;
    check_pixels(path, "motion", frame.motion.len(), size)?;
    let roughness: Vec<[f32; 1]> = frame.roughness.iter().map(|&x| [x]).collect();
    let motion = |i: usize| FlatSamples::F32(frame.motion.iter().map(|m| m[i]).collect());
    let mut channels = vec![
        half("reflection.R", &frame.radiance, 0),
        half("reflection.G", &frame.radiance, 1),
        half("reflection.B", &frame.radiance, 2),
        half("reflection.A", &frame.radiance, 3),
        half("normal.X", &frame.normal, 0),
        half("normal.Y", &frame.normal, 1),
        half("normal.Z", &frame.normal, 2),
        half("roughness", &roughness, 0),
        AnyChannel::new("Z", FlatSamples::F32(frame.depth.clone())),
        AnyChannel::new("motion.X", motion(0)),
        AnyChannel::new("motion.Y", motion(1)),
    ];
    if let Some(hit_motion) = &frame.hit_motion {
        check_pixels(path, "hit_motion", hit_motion.len(), size)?;
        channels.push(half("hit_motion.X", hit_motion, 0));
        channels.push(half("hit_motion.Y", hit_motion, 1));
        channels.push(half("hit_motion.Z", hit_motion, 2));
    }
    if let Some(reference) = &frame.reference {
        check_pixels(path, "reference", reference.len(), size)?;
        channels.push(half("reference.R", reference, 0));
        channels.push(half("reference.G", reference, 1));
        channels.push(half("reference.B", reference, 2));
    }
    write_channels(path, size, channels, &Metadata::new(size))
}

fn check_pixels(path: &Path, image: &'static str, found: usize, size: UVec2) -> Result<(), SequenceError> {
    let expected = size.x as usize * size.y as usize;
    let path = path.to_owned();
    match found == expected {
        true => Ok(()),
        false => Err(SequenceError::Pixels { path, image, expected, found }),
    }
}

/// Component `i` of an image as a half-float channel.
fn half<const N: usize>(name: &'static str, image: &[[f32; N]], i: usize) -> AnyChannel<FlatSamples> {
    let largest = f16::MAX.to_f32();
    let to_half = |x: f32| match x.is_finite() {
        true => f16::from_f32(x.clamp(-largest, largest)),
        false => f16::from_f32(x),
    };
    AnyChannel::new(name, FlatSamples::F16(image.iter().map(|pixel| to_half(pixel[i])).collect()))
}

fn write_channels(
    path: &Path,
    size: UVec2,
    channels: Vec<AnyChannel<FlatSamples>>,
    metadata: &Metadata,
) -> Result<(), SequenceError> {
    let size = Vec2(size.x as usize, size.y as usize);
    let encoding =
        Encoding { compression: Compression::ZIP16, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    let (image_attributes, layer_attributes) = metadata.for_image(size);
    let channels = AnyChannels::sort(channels.into());
    let layer = Layer::new(size, layer_attributes, encoding, channels);
    let image = Image::new(image_attributes, layer);
    write_atomically(path, |file| image.write().to_buffered(file).map_err(io::Error::other))
        .map_err(|reason| SequenceError::write(path, reason))
}
