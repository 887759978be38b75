//! Denoisers that are changed, that share a device, and frames that are recorded ahead.

mod support;

use std::sync::mpsc;

use glam::UVec2;
use limpid::settings::Fallback;
use limpid::variants::MAX_VARIANTS;
use limpid_wgpu::{Denoiser, FRAMES_BEFORE_SUBMIT, Options, PassTime};
use support::{Denoised, Gpu, Images, Run, Scene, linear_settings, published_settings, still_frame};

const SIZE: UVec2 = UVec2::new(52, 36);

fn scene(index: u32) -> Scene {
    Scene::noisy_wall(SIZE, index)
}

/// What a denoiser of its own makes of consecutive scenes.
fn separately(gpu: &Gpu, size: UVec2, seeds: impl Iterator<Item = u32>) -> Vec<Denoised> {
    let mut run = Run::new(gpu, &linear_settings(), size);
    seeds.map(|seed| run.still(&Scene::noisy_wall(size, seed))).collect()
}

#[test]
fn numbers_take_effect_at_once_and_keep_history() {
    let Some(gpu) = Gpu::open() else { return };
    let mut settings = linear_settings();
    // Which blocks are worked on as a whole depends on the filter's scale.
    settings.features.whole_blocks = false;
    let mut run = Run::new(&gpu, &settings, SIZE);
    let mut unchanged = Run::new(&gpu, &settings, SIZE);
    for index in 0..3 {
        assert!(run.still(&scene(index)) == unchanged.still(&scene(index)));
    }
    settings.footprint.filter_scale = 0.1;
    settings.coverage.roughness_threshold = 0.9;
    run.denoiser.set_settings(&settings).unwrap();
    let (changed, unchanged) = (run.still(&scene(3)), unchanged.still(&scene(3)));
    assert!(changed.length == unchanged.length && changed.length.iter().all(|length| *length == 4.0));
    assert!(changed.found == unchanged.found && changed.output != unchanged.output);

    settings.footprint.filter_scale = 20.0;
    let refused = run.denoiser.set_settings(&settings).unwrap_err();
    assert!(refused.to_string().contains("`footprint.filter_scale` is 20"), "{refused}");
    assert!(run.still(&scene(4)).length.iter().all(|length| *length == 5.0));
}

#[test]
fn features_that_change_no_binding_keep_history() {
    let Some(gpu) = Gpu::open() else { return };
    let mut fewer = linear_settings();
    fewer.features.near_taps = 3;
    let mut run = Run::new(&gpu, &linear_settings(), SIZE);
    let mut unchanged = Run::new(&gpu, &linear_settings(), SIZE);
    for (index, settings) in [&fewer, &linear_settings(), &fewer, &linear_settings()].into_iter().enumerate() {
        run.denoiser.set_settings(settings).unwrap();
        // Smooth enough for near taps to count.
        let mut scene = scene(index as u32);
        scene.pixels.iter_mut().for_each(|pixel| pixel.roughness = 0.2);
        let (changed, unchanged) = (run.still(&scene), unchanged.still(&scene));
        assert!(changed.length == unchanged.length);
        assert_eq!(changed.output == unchanged.output, index % 2 == 1, "frame {index}");
    }
}

#[test]
fn pipelines_are_made_once_and_not_kept_without_end() {
    let Some(gpu) = Gpu::open() else { return };
    let mut denoiser = Denoiser::new(&gpu.device, &linear_settings(), SIZE, Options::default()).unwrap();
    let passes = denoiser.plan().passes.len();
    assert_eq!(denoiser.pipelines(), passes);
    let mut narrow = linear_settings();
    narrow.features.wide_filter = false;
    denoiser.prepare(&narrow).unwrap();
    // All others but the two that leave whole blocks to other passes, and the one that finds them, have the same kernels.
    assert_eq!(denoiser.pipelines(), passes + 3);
    denoiser.prepare(&published_settings()).unwrap();
    let prepared = denoiser.pipelines();
    for settings in [narrow, published_settings(), linear_settings()] {
        denoiser.set_settings(&settings).unwrap();
        assert_eq!(denoiser.pipelines(), prepared);
    }
    for near_taps in 0..=64 {
        let mut settings = linear_settings();
        settings.features.near_taps = near_taps;
        denoiser.set_settings(&settings).unwrap();
    }
    assert!(denoiser.pipelines() <= MAX_VARIANTS, "{}", denoiser.pipelines());
}

#[test]
fn what_changes_the_plan_starts_anew() {
    let Some(gpu) = Gpu::open() else { return };
    let mut run = Run::new(&gpu, &linear_settings(), SIZE);
    let mut black = linear_settings();
    black.coverage.fallback = Fallback::Black;
    // The default again in the end: what follows is compared with a denoiser that never was anything else.
    for (start, settings) in [(0, black), (5, published_settings()), (10, linear_settings())] {
        run.still(&scene(start));
        run.still(&scene(start + 1));
        run.denoiser.set_settings(&settings).unwrap();
    }
    for (index, expected) in separately(&gpu, SIZE, 20..23).iter().enumerate() {
        assert!(run.still(&scene(20 + index as u32)) == *expected, "frame {index}");
    }
}

#[test]
fn a_resized_denoiser_is_like_a_fresh_one() {
    let Some(gpu) = Gpu::open() else { return };
    let mut run = Run::new(&gpu, &linear_settings(), SIZE);
    // An odd number of frames in between, so that the pairs of textures have changed roles.
    for size in [UVec2::new(90, 70), UVec2::new(17, 9), SIZE, SIZE] {
        run.denoiser.resize(size).unwrap();
        assert_eq!(run.denoiser.plan().size, size);
        for (index, expected) in separately(&gpu, size, 0..3).iter().enumerate() {
            assert!(run.still(&Scene::noisy_wall(size, index as u32)) == *expected, "{size}, frame {index}");
        }
    }
    assert!(run.denoiser.resize(UVec2::new(0, 5)).is_err());
    assert!(run.still(&scene(3)).length.iter().all(|length| *length == 4.0), "a refused resize changes nothing");
}

#[test]
fn two_denoisers_on_a_device_do_not_disturb_each_other() {
    let Some(gpu) = Gpu::open() else { return };
    let mut runs = [0, 1].map(|_| Run::new(&gpu, &linear_settings(), SIZE));
    let expected = [separately(&gpu, SIZE, 0..4), separately(&gpu, SIZE, 100..104)];
    for index in 0..4 {
        // Classify and denoise stages of both alternate, in one encoder.
        let images = [index, 100 + index].map(|seed| scene(seed).upload(&gpu));
        let mut encoder = gpu.encoder();
        for (run, images) in runs.iter_mut().zip(&images) {
            run.denoiser.encode_classify(&gpu.queue, &mut encoder, &images.inputs(), &still_frame(SIZE)).unwrap();
        }
        for (run, images) in runs.iter_mut().zip(&images) {
            run.denoiser.encode_denoise(&mut encoder, &images.inputs()).unwrap();
        }
        let copies = runs.each_ref().map(|run| run.copy_out(&mut encoder, SIZE));
        gpu.queue.submit([encoder.finish()]);
        for ((run, copies), expected) in runs.iter().zip(&copies).zip(&expected) {
            assert!(run.read(copies) == expected[index as usize], "frame {index}");
        }
    }
}

#[test]
fn frames_may_be_recorded_ahead_of_submission() {
    let Some(gpu) = Gpu::open() else { return };
    let mut run = Run::new(&gpu, &linear_settings(), SIZE);
    // Twice as many as may be waiting, in two submissions, each of two command buffers. Exposure changes with
    // every frame, so that mixed up constants would show.
    let frames = 2 * FRAMES_BEFORE_SUBMIT as u32;
    let images: Vec<Images> = (0..frames).map(|index| scene(index).upload(&gpu)).collect();
    let frame = |index: u32| {
        let mut frame = still_frame(SIZE);
        frame.exposure = 1.0 + index as f32;
        frame
    };
    let mut copies = Vec::new();
    for batch in 0..2 {
        let mut command_buffers = Vec::new();
        for half in 0..2 {
            let mut encoder = gpu.encoder();
            for index in (0..frames).filter(|index| index * 4 / frames == 2 * batch + half) {
                let inputs = images[index as usize].inputs();
                run.denoiser.encode(&gpu.queue, &mut encoder, &inputs, &frame(index)).unwrap();
                copies.push(run.copy_out(&mut encoder, SIZE));
            }
            command_buffers.push(encoder.finish());
        }
        gpu.queue.submit(command_buffers);
    }
    let mut one_by_one = Run::new(&gpu, &linear_settings(), SIZE);
    for (index, copies) in (0..frames).zip(&copies) {
        let expected = one_by_one.images(&images[index as usize], &frame(index));
        assert!(run.read(copies) == expected, "frame {index}");
    }
}

#[test]
fn a_frame_that_was_classified_only_leaves_no_history() {
    let Some(gpu) = Gpu::open() else { return };
    let mut run = Run::new(&gpu, &linear_settings(), SIZE);
    run.still(&scene(0));
    let mut encoder = gpu.encoder();
    let images = scene(1).upload(&gpu);
    run.denoiser.encode_classify(&gpu.queue, &mut encoder, &images.inputs(), &still_frame(SIZE)).unwrap();
    gpu.queue.submit([encoder.finish()]);
    for (index, expected) in separately(&gpu, SIZE, 2..4).iter().enumerate() {
        assert!(run.still(&scene(2 + index as u32)) == *expected, "frame {index}");
    }
}

/// Times of the frame recorded last, which was submitted.
fn times(gpu: &Gpu, denoiser: &Denoiser) -> Option<Vec<PassTime>> {
    let (sender, receiver) = mpsc::channel();
    denoiser.read_times(move |times| sender.send(times).unwrap());
    gpu.wait();
    receiver.try_recv().ok()
}

#[test]
fn each_pass_is_timed_in_order() {
    let Some(gpu) = Gpu::open_with(wgpu::Features::TIMESTAMP_QUERY) else { return };
    let options = Options { timestamps: true, ..Default::default() };
    let mut timed = Denoiser::new(&gpu.device, &linear_settings(), SIZE, options).unwrap();
    let mut untimed = Denoiser::new(&gpu.device, &linear_settings(), SIZE, Options::default()).unwrap();
    assert_eq!(times(&gpu, &timed), None, "before the first frame");
    for index in 0..6 {
        let mut encoder = gpu.encoder();
        let images = scene(index).upload(&gpu);
        for denoiser in [&mut timed, &mut untimed] {
            denoiser.encode(&gpu.queue, &mut encoder, &images.inputs(), &still_frame(SIZE)).unwrap();
        }
        gpu.queue.submit([encoder.finish()]);
        assert_eq!(times(&gpu, &untimed), None);
        // Frames whose times nobody reads do no harm.
        if index == 1 || index == 2 {
            continue;
        }
        let times = times(&gpu, &timed).unwrap();
        let timed_passes: Vec<&str> = times.iter().map(|time| time.pass.as_str()).collect();
        let passes: Vec<&str> = timed.plan().passes.iter().map(|pass| pass.name.as_str()).collect();
        assert_eq!(timed_passes, passes, "frame {index}");
        assert!(times.iter().any(|time| !time.duration.is_zero()), "frame {index}");
    }
}
