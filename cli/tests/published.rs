//! The Reference preset against frames that AMD's own shaders made of the same sequences.
//!
//! The data is not part of the repository: `LIMPID_PEER_DATA` names a folder with `public/SEQUENCE` and
//! `peer/SEQUENCE`. Without it the test says that it is skipped.

use std::io::Write;
use std::path::Path;

use limpid::Preset;
use limpid_cli::backend::{self, Choice};
use limpid_cli::sequence::{ChannelNames, Frame, Sequence, read_rgb};

/// PSNR in decibels of two images after `x / (1 + x)`, surfaces only.
fn tone_mapped_psnr(a: &[[f32; 3]], b: &[[f32; 3]], depth: &[f32]) -> f64 {
    let tone_map = |x: f32| f64::from(x.max(0.0)) / (1.0 + f64::from(x.max(0.0)));
    let surfaces = a.iter().zip(b).zip(depth).filter(|(_, depth)| **depth > 0.0);
    let errors: Vec<f64> =
        surfaces.flat_map(|((a, b), _)| (0..3).map(move |i| (tone_map(a[i]) - tone_map(b[i])).powi(2))).collect();
    -10.0 * (errors.iter().sum::<f64>() / errors.len() as f64).max(1e-12).log10()
}

/// Gives limpid what the original's defects make of the input: GGX alpha in 8 bits, and a sky that counts as
/// a black surface at the far plane.
fn with_published_defects(mut frame: Frame, far: f32) -> Frame {
    for roughness in &mut frame.roughness {
        *roughness = ((*roughness * *roughness * 255.0).round() / 255.0).sqrt();
    }
    for pixel in 0..frame.depth.len() {
        if frame.depth[pixel] == 0.0 {
            frame.depth[pixel] = far;
            frame.normal[pixel] = [0.0, 1.0, 0.0];
        }
    }
    frame
}

fn mean_agreement(data: &Path, name: &str, defects: bool) -> f64 {
    let sequence = Sequence::open(&data.join("public").join(name), &ChannelNames::default()).unwrap();
    let mut settings = Preset::Reference.settings();
    settings.coverage.roughness_threshold = 1.0;
    let mut backend = backend::open(Choice::Auto, &settings, sequence.size()).unwrap();
    let mut sum = 0.0;
    for index in 0..sequence.len() {
        let frame = sequence.load(index).unwrap();
        let depth = frame.depth.clone();
        let frame = if defects { with_published_defects(frame, 1000.0) } else { frame };
        let denoised = backend.denoise(&frame, 1.0, None).unwrap();
        let file = sequence.path(index).unwrap();
        let (_, peer) = read_rgb(&data.join("peer").join(name).join(file.file_name().unwrap())).unwrap();
        sum += tone_mapped_psnr(&denoised.radiance, &peer, &depth);
    }
    sum / sequence.len() as f64
}

#[test]
fn reference_agrees_with_the_published_shaders() {
    let Some(data) = std::env::var_os("LIMPID_PEER_DATA") else {
        // Past the harness, which keeps to itself what a passing test prints.
        let _ = writeln!(
            std::io::stderr(),
            "SKIPPED: LIMPID_PEER_DATA names no folder with frames of the published shaders"
        );
        return;
    };
    for (name, at_least, with_defects) in [("glossy-room", 50.0, 50.0), ("orbit", 35.0, 40.0)] {
        for (defects, bound) in [(false, at_least), (true, with_defects)] {
            let agreement = mean_agreement(Path::new(&data), name, defects);
            println!("{name}: {agreement:.2} dB, defects emulated: {defects}");
            assert!(agreement >= bound, "{name}: {agreement} dB, expected {bound}");
        }
    }
}
