//! The demo's scenes as small approved pictures. `GOLDEN=accept cargo test -p limpid-cli --test golden` approves what
//! is there now; look at it first.

use std::path::Path;

use glam::UVec2;
use limpid::Settings;
use limpid_cli::backend::{self, Choice};
use limpid_cli::{picture, scene};

const SIZE: UVec2 = UVec2::new(96, 54);
const FRAMES: u32 = 4;

/// Noisy over denoised, after some frames.
fn picture_of(name: &str) -> image::RgbImage {
    let mut backend = backend::open(Choice::Cpu, &Settings::default(), SIZE).unwrap();
    let scene = scene::by_name(name).unwrap();
    let mut last = None;
    for number in 0..FRAMES {
        let frame = scene.render(number, SIZE, 0);
        let denoised = backend.denoise(&frame, 1.0, None).unwrap();
        last = Some((frame, denoised));
    }
    let (frame, denoised) = last.unwrap();
    let noisy: Vec<_> = frame.radiance.iter().map(|&[r, g, b, _]| [r, g, b]).collect();
    let pictures = [noisy, denoised.radiance].map(|image| picture::tone_map(&image, SIZE, 1.0));
    picture::side_by_side(&pictures)
}

#[test]
fn scenes_look_as_approved() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden");
    for name in scene::NAMES {
        let actual = picture_of(name);
        let path = folder.join(format!("{name}.png"));
        if std::env::var_os("GOLDEN").is_some_and(|value| value == "accept") {
            picture::write_png(&path, &actual).unwrap();
            continue;
        }
        let approved = image::open(&path).unwrap().to_rgb8();
        assert_eq!(actual.dimensions(), approved.dimensions());
        let differences = actual.as_raw().iter().zip(approved.as_raw()).map(|(a, b)| f64::from(a.abs_diff(*b)));
        let mean = differences.sum::<f64>() / actual.as_raw().len() as f64;
        // Mathematical functions differ between platforms and drivers in their last bits, which flips single
        // rays and decisions; a change that anyone would see is an order of magnitude above.
        if mean > 0.5 {
            let shown = std::env::temp_dir().join(format!("limpid-golden-{name}.png"));
            picture::write_png(&shown, &actual).unwrap();
            panic!("{name}: mean difference {mean:.3} of 255; see {}", shown.display());
        }
    }
}
