//! Frames of sequences as cases of the harness.

use limpid::settings::DepthEncoding;
use limpid::{FrameInputs, Settings};
use limpid_cli::sequence::Frame;
use limpid_harness::{Case, Change, Images, Pixel, Step};

fn step(frame: &Frame) -> Step {
    let pixel = |i: usize| Pixel {
        radiance: frame.radiance[i],
        normal: frame.normal[i],
        roughness: frame.roughness[i],
        depth: frame.depth[i],
        motion: frame.motion[i],
    };
    let mut inputs = FrameInputs::new(frame.camera, frame.size);
    inputs.reset = frame.reset;
    let images = Images { size: frame.size, pixels: (0..frame.pixels()).map(pixel).collect() };
    Step { change: Change::None, frame: inputs, images }
}

/// A case of frames, with settings that fit how they hold depth.
pub(crate) fn case(settings: &Settings, frames: impl Iterator<Item = Frame>) -> Case {
    let steps: Vec<_> = frames.map(|frame| step(&frame)).collect();
    let mut settings = settings.clone();
    settings.conventions.depth = DepthEncoding::Linear;
    Case { settings, size: steps[0].images.size, steps }
}
