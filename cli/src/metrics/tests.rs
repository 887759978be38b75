//! Expected numbers were computed once on the images of [`reference`] and [`denoised`], built by
//! the same formulas in numpy: the metrics by the `eval.py` the evaluation sequences come with (the two it lacks,
//! `psnr_linear` and `relmse_tone_mapped`, by their definitions in double precision), FLIP by the
//! `flip_evaluator` package it uses (67 pixels per degree).

use glam::{Mat4, UVec2, Vec2};
use limpid::Camera;
use proptest::prelude::*;

use super::*;
use crate::sequence::Frame;

const SIZE: UVec2 = UVec2::new(40, 28);

fn image(value: impl Fn(u32, u32, u32) -> f32) -> Vec<[f32; 3]> {
    let pixels = (0..SIZE.y).flat_map(|y| (0..SIZE.x).map(move |x| (x, y)));
    pixels.map(|(x, y)| [0, 1, 2].map(|c| value(x, y, c))).collect()
}

/// Noise, 0 to 6.75.
fn noise(seed: u32) -> Vec<[f32; 3]> {
    image(|x, y, c| {
        let n = (x * 73 + y * 151 + c * 37 + x * y * 11 + seed * 29) % 97;
        (n * n * n) as f32 / 131_072.0
    })
}

/// Coloured blocks on a gradient.
fn reference(t: u32) -> Vec<[f32; 3]> {
    image(|x, y, c| (((x / 8 * 5 + y / 7 * 3 + c * 2) % 7 + 1) * (x + t + 4)) as f32 / 32.0)
}

fn denoised(t: u32) -> Vec<[f32; 3]> {
    let (reference, noise) = (reference(t), noise(t));
    let mix = |(r, n): (&[f32; 3], &[f32; 3])| [0, 1, 2].map(|c| 0.5 * r[c] + 0.25 * n[c]);
    let mut mixed: Vec<[f32; 3]> = reference.iter().zip(&noise).map(mix).collect();
    if t == 1 {
        let width = SIZE.x as usize;
        mixed[3 * width + 5][0] = f32::NAN;
        mixed[4 * width + 6][1] = f32::INFINITY;
        mixed[5 * width + 7][2] = f32::NEG_INFINITY;
        mixed[6 * width + 8][0] = -2.0;
    }
    mixed
}

fn frame(t: u32) -> Frame {
    let surface = image(|x, y, _| ((x + y * 3 + t) % 11).min(1) as f32);
    let pixels = surface.len();
    Frame {
        number: t,
        size: SIZE,
        reset: t == 0 || t == 3,
        seconds: 1.0 / 60.0,
        camera: Camera { world_to_view: Mat4::IDENTITY, view_to_clip: Mat4::IDENTITY, jitter: Vec2::ZERO },
        radiance: vec![[0.0; 4]; pixels],
        normal: vec![[0.0; 3]; pixels],
        roughness: vec![0.5; pixels],
        depth: surface.iter().map(|z| z[0]).collect(),
        motion: vec![[0.0; 2]; pixels],
        hit_motion: None,
        reference: Some(reference(t)),
    }
}

fn assert_close(found: f64, expected: f64, what: &str) {
    assert!((found - expected).abs() <= 1e-5 * expected.abs(), "{what}: {found}, expected {expected}");
}

#[test]
fn scores_equal_those_of_eval_py() {
    #[rustfmt::skip]
    let expected = [
        [18.2419052, -1.53679467, 0.426026288, 0.102037393, 0.279748201, 0.645740963, -0.0707297842],
        [18.3122201, -58.973499, 1298072.0, 0.0804323773, 0.278183371, 7.64920021, -0.0741242197],
        [18.4611803, -2.0842196, 0.301662543, 0.0693857251, 0.275390446, 0.632877033, -0.0780998766],
        [18.4815906, -2.40779074, 0.296165983, 0.0659865418, 0.269432127, 0.628104998, -0.0801467501],
    ];
    let flicker = [None, Some(0.0999357386), Some(0.0977791816), None];
    let mut scorer = Scorer::new(0.75);
    for t in 0..4 {
        let score = scorer.score(&denoised(t), &frame(t));
        let m = score.metrics;
        let [psnr, psnr_linear, relmse, relmse_tm, flip, energy, bias] = expected[t as usize];
        assert_close(m.psnr, psnr, "psnr");
        assert_close(m.psnr_linear, psnr_linear, "psnr_linear");
        assert_close(m.relmse, relmse, "relmse");
        assert_close(m.relmse_tone_mapped, relmse_tm, "relmse_tone_mapped");
        assert_close(m.flip, flip, "flip");
        assert_close(m.energy, energy, "energy");
        assert_close(m.bias, bias, "bias");
        assert_eq!(m.flicker.is_some(), flicker[t as usize].is_some());
        assert_close(m.flicker.unwrap_or(0.0), flicker[t as usize].unwrap_or(0.0), "flicker");
        assert_eq!(m.non_finite, if t == 1 { 3 } else { 0 });
    }
}

#[test]
fn flip_equals_the_flip_evaluator_package() {
    let encoded = |image: Vec<[f32; 3]>| -> Vec<[f32; 3]> {
        image.iter().map(|rgb| rgb.map(|x| (x / 8.0).clamp(0.0, 1.0))).collect()
    };
    let map = flip(&encoded(reference(0)), &encoded(noise(0)), SIZE);
    let mean = map.iter().map(|&e| f64::from(e)).sum::<f64>() / map.len() as f64;
    assert_close(mean, 0.6933648, "mean");
    let at = |x: usize, y: usize| f64::from(map[y * SIZE.x as usize + x]);
    assert_close(at(0, 0), 0.789538383, "top left");
    assert_close(at(39, 0), 0.96892178, "top right");
    assert_close(at(20, 14), 0.439586163, "middle");
    assert_close(at(7, 27), 0.518569291, "bottom");
}

#[test]
fn summaries_follow_resets_and_skip_empty_frames() {
    let mut scorer = Scorer::new(1.0);
    let mut scores: Vec<FrameScore> = (0..3).map(|t| scorer.score(&denoised(t), &frame(t))).collect();
    assert_eq!(late(&scores), None);
    let first = scores[0].clone();
    let mut sky = frame(4);
    sky.depth.fill(0.0);
    let sky = scorer.score(&denoised(1), &sky);
    assert_eq!((sky.surface_pixels, sky.metrics.flicker), (0, None));
    assert!(sky.metrics.psnr.is_nan());
    scores.extend([sky, first.clone()]);
    scores[4].reset = false;
    assert_eq!(late(&scores).unwrap(), first.metrics);

    let mean = mean(&scores);
    assert_close(mean.bias, scores.iter().map(|s| s.metrics.bias).filter(|b| !b.is_nan()).sum::<f64>() / 4.0, "bias");
    assert_eq!(mean.non_finite, 6);
    let table = table("title", &scores);
    assert_eq!(table.lines().count(), 9);
    assert!(table.lines().last().unwrap().starts_with("  late "));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn equal_images_have_no_error(exposure in 0.01_f32..100.0, seed in 0_u32..1000) {
        let mut frame = frame(0);
        frame.reference = Some(noise(seed));
        let mut scorer = Scorer::new(exposure);
        let _ = scorer.score(&noise(seed), &frame);
        frame.reset = false;
        let m = scorer.score(&noise(seed), &frame).metrics;
        prop_assert_eq!((m.psnr, m.psnr_linear, m.relmse, m.relmse_tone_mapped), (120.0, 120.0, 0.0, 0.0));
        prop_assert_eq!((m.flip, m.energy, m.bias, m.flicker), (0.0, 1.0, 0.0, Some(0.0)));
    }

    #[test]
    fn flip_stays_in_range_at_any_size(
        width in 1_u32..30,
        height in 1_u32..30,
        values in prop::collection::vec(0.0_f32..=1.0, 6 * 29 * 29),
    ) {
        let n = (width * height) as usize;
        let image = |from: usize| -> Vec<[f32; 3]> {
            values[from..].chunks_exact(3).take(n).map(|v| [v[0], v[1], v[2]]).collect()
        };
        let map = flip(&image(0), &image(3 * n), UVec2::new(width, height));
        prop_assert_eq!(map.len(), n);
        prop_assert!(map.iter().all(|e| (0.0..=1.0).contains(e)));
    }
}
