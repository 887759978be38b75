//! Frames of sequences as cases of the harness.

#![allow(dead_code, reason = "every test uses its part")]

use limpid::settings::DepthEncoding;
use limpid::{FrameInputs, Settings};
use limpid_cli::sequence::Frame;
use limpid_harness::{Case, Change, Images, Pixel, Snapshot, Step};

fn step(frame: &Frame) -> Step {
    let pixel = |i: usize| Pixel {
        radiance: frame.radiance[i],
        normal: frame.normal[i],
        roughness: frame.roughness[i],
        depth: frame.depth[i],
        motion: frame.motion[i],
        hit_motion: frame.hit_motion.as_ref().map_or([0.0; 3], |motion| motion[i]),
    };
    let mut inputs = FrameInputs::new(frame.camera, frame.size);
    inputs.reset = frame.reset;
    inputs.frame_seconds = frame.seconds;
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

/// Compares what two runs of a case left in memory: every word is the same.
pub(crate) fn assert_same(name: &str, expected: &[Snapshot], found: &[Snapshot]) {
    for (number, (expected, found)) in expected.iter().zip(found).enumerate() {
        assert!(expected.0["output"].iter().any(|&word| word != 0), "{name}, frame {number}: nothing but zeros");
        for (resource, words) in &expected.0 {
            let differing = words.iter().zip(&found.0[resource]).filter(|(a, b)| a != b).count();
            let count = words.len();
            assert!(differing == 0, "{name}, frame {number}: {differing} of {count} words of {resource}");
        }
    }
}
