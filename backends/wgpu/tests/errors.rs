//! What cannot be used is refused with a typed error that says what was found and what was expected, and does
//! no harm.

mod support;

use glam::{Mat4, UVec2};
use limpid::settings::{Channel, Fallback, NormalEncoding, RayList};
use limpid::{FrameInputs, Settings};
use limpid_wgpu::{Denoiser, Error, Inputs, Options, PrevGbuffer};
use support::{Gpu, Images, Run, Scene, linear_settings, still_frame};
use wgpu::TextureFormat::{self, R32Float, Rg16Float, Rg32Float, Rgba8Uint, Rgba16Float, Rgba32Float, Rgba32Sint};
use wgpu::{TextureDescriptor, TextureUsages, TextureViewDescriptor};

const SIZE: UVec2 = UVec2::new(40, 24);

/// A texture that nothing was written to.
fn view(
    gpu: &Gpu,
    size: UVec2,
    format: TextureFormat,
    change: impl FnOnce(&mut TextureDescriptor<'_>),
) -> wgpu::TextureView {
    let texture = gpu.texture(size, format, TextureUsages::TEXTURE_BINDING, change);
    texture.create_view(&TextureViewDescriptor::default())
}

fn variant(error: &Error) -> &'static str {
    match error {
        Error::Limpid(_) => "Limpid",
        Error::InputMissing { .. } => "InputMissing",
        Error::InputSize { .. } => "InputSize",
        Error::InputFormat { .. } => "InputFormat",
        Error::InputShape { .. } => "InputShape",
        Error::InputUsage { .. } => "InputUsage",
        Error::Feature { .. } => "Feature",
        Error::Limit { .. } => "Limit",
        _ => "unknown",
    }
}

fn assert_says(error: &Error, expected_variant: &str, parts: &[&str]) {
    let message = error.to_string();
    assert_eq!(variant(error), expected_variant, "{message}");
    for part in parts {
        assert!(message.contains(part), "`{message}` does not say `{part}`");
    }
}

/// Encodes bad images between good frames: they must be refused, and leave no trace.
fn refuse(gpu: &Gpu, run: &mut Run<'_>, bad: &Inputs<'_>, frame: &FrameInputs) -> Error {
    let good = Scene::noisy_wall(SIZE, 1).upload(gpu);
    let mut reset = still_frame(SIZE);
    reset.reset = true;
    run.images(&good, &reset);
    let mut encoder = gpu.encoder();
    let error = run.denoiser.encode(&gpu.queue, &mut encoder, bad, frame).unwrap_err();
    gpu.queue.submit([encoder.finish()]);
    let after = run.images(&good, &still_frame(SIZE));
    assert!(after.length.iter().all(|length| *length == 2.0), "history was lost after: {error}");
    error
}

#[test]
fn unusable_inputs_are_refused_by_name() {
    let Some(gpu) = Gpu::open() else { return };
    let mut run = Run::new(&gpu, &linear_settings(), SIZE);
    let good = Scene::noisy_wall(SIZE, 0).upload(&gpu);
    let frame = still_frame(SIZE);
    let mut check = |images: Images, variant: &str, parts: &[&str]| {
        assert_says(&refuse(&gpu, &mut run, &images.inputs(), &frame), variant, parts);
    };

    let small = view(&gpu, UVec2::new(39, 24), Rgba16Float, |_| ());
    let parts = ["`radiance`", "[39, 24]", "at least [40, 24]"];
    check(Images { radiance: small, ..good.clone() }, "InputSize", &parts);
    let low = view(&gpu, UVec2::new(100, 23), R32Float, |_| ());
    check(Images { depth: low, ..good.clone() }, "InputSize", &["`depth`", "[100, 23]", "at least [40, 24]"]);

    let integer = view(&gpu, SIZE, Rgba8Uint, |_| ());
    let parts = ["`normal`", "Rgba8Uint", "float texels", "3 channels"];
    check(Images { normal: integer, ..good.clone() }, "InputFormat", &parts);
    let signed = view(&gpu, SIZE, Rgba32Sint, |_| ());
    check(Images { motion: signed, ..good.clone() }, "InputFormat", &["`motion`", "Rgba32Sint", "2 channels"]);
    let no_hit_distance = view(&gpu, SIZE, Rg32Float, |_| ());
    let parts = ["`radiance`", "Rg32Float", "4 channels"];
    check(Images { radiance: no_hit_distance, ..good.clone() }, "InputFormat", &parts);
    let one_channel = view(&gpu, SIZE, R32Float, |_| ());
    check(Images { motion: one_channel, ..good.clone() }, "InputFormat", &["`motion`", "R32Float", "2 channels"]);
    let two_channels = view(&gpu, SIZE, Rg16Float, |_| ());
    check(Images { normal: two_channels, ..good.clone() }, "InputFormat", &["`normal`", "Rg16Float", "3 channels"]);
    let stencil = view(&gpu, SIZE, TextureFormat::Stencil8, |_| ());
    check(Images { depth: stencil, ..good.clone() }, "InputFormat", &["`depth`", "Stencil8", "float texels"]);

    let attachment = gpu.texture(SIZE, Rgba32Float, TextureUsages::RENDER_ATTACHMENT, |_| ());
    let attachment = attachment.create_view(&TextureViewDescriptor::default());
    let parts = ["`roughness`", "RENDER_ATTACHMENT", "expected TEXTURE_BINDING"];
    check(Images { roughness: attachment, ..good.clone() }, "InputUsage", &parts);

    let multisampled = view(&gpu, SIZE, Rgba16Float, |descriptor| {
        descriptor.sample_count = 4;
        descriptor.usage |= TextureUsages::RENDER_ATTACHMENT;
    });
    let parts = ["`radiance`", "4 samples", "one sample"];
    check(Images { radiance: multisampled, ..good.clone() }, "InputShape", &parts);
    let volume = view(&gpu, SIZE, Rgba16Float, |descriptor| descriptor.dimension = wgpu::TextureDimension::D3);
    check(Images { radiance: volume, ..good.clone() }, "InputShape", &["`radiance`", "D3", "two-dimensional"]);
}

#[test]
fn what_an_input_must_have_depends_on_the_settings() {
    let Some(gpu) = Gpu::open() else { return };
    let mut settings = linear_settings();
    settings.features.hit_motion = true;
    settings.coverage.fallback = Fallback::Environment;
    settings.conventions.normal = NormalEncoding::Octahedral;
    settings.conventions.roughness_channel = Channel::Green;
    let mut denoiser = Denoiser::new(&gpu.device, &settings, SIZE, Options::default()).unwrap();
    let good = Scene::noisy_wall(SIZE, 0).upload(&gpu);
    let mut encode =
        |images: &Images| denoiser.encode(&gpu.queue, &mut gpu.encoder(), &images.inputs(), &still_frame(SIZE));
    assert_says(&encode(&good).unwrap_err(), "InputMissing", &["`hit_motion`", "settings"]);
    let flat = Images { hit_motion: Some(view(&gpu, SIZE, Rg16Float, |_| ())), ..good.clone() };
    assert_says(&encode(&flat).unwrap_err(), "InputFormat", &["`hit_motion`", "Rg16Float", "3 channels"]);
    let small = Images { hit_motion: Some(view(&gpu, SIZE - 1, Rgba16Float, |_| ())), ..good.clone() };
    assert_says(&encode(&small).unwrap_err(), "InputSize", &["`hit_motion`", "[39, 23]", "[40, 24]"]);
    let good = Images { hit_motion: Some(view(&gpu, SIZE, Rgba16Float, |_| ())), ..good };
    assert_says(&encode(&good).unwrap_err(), "InputMissing", &["`environment`", "settings"]);
    let texel = UVec2::ONE;
    let environment = Some(view(&gpu, texel, Rg16Float, |_| ()));
    let thin = Images { environment, ..good.clone() };
    assert_says(&encode(&thin).unwrap_err(), "InputFormat", &["`environment`", "Rg16Float", "3 channels"]);
    let environment = Some(view(&gpu, texel, Rgba16Float, |_| ()));
    let enough = Images { environment, normal: view(&gpu, SIZE, Rg16Float, |_| ()), ..good };
    let red = Images { roughness: view(&gpu, SIZE, R32Float, |_| ()), ..enough.clone() };
    assert_says(&encode(&red).unwrap_err(), "InputFormat", &["`roughness`", "R32Float", "2 channels"]);
    encode(&enough).unwrap();
}

#[test]
fn last_frames_gbuffer_is_as_large_as_that_frame() {
    let Some(gpu) = Gpu::open() else { return };
    let mut settings = linear_settings();
    (settings.features.gbuffer_copy, settings.features.packed_guide) = (false, false);
    let mut denoiser = Denoiser::new(&gpu.device, &settings, SIZE, Options::default()).unwrap();
    let images = Scene::noisy_wall(SIZE, 0).upload(&gpu);
    let smaller = SIZE - UVec2::X;
    let mut encode = |previous, size| {
        let inputs = Inputs { previous, ..images.inputs() };
        denoiser.encode(&gpu.queue, &mut gpu.encoder(), &inputs, &still_frame(size))
    };
    assert_says(&encode(None, smaller).unwrap_err(), "InputMissing", &["`previous.normal`", "settings"]);
    let single = view(&gpu, UVec2::ONE, Rgba32Float, |_| ());
    let all = |view| PrevGbuffer { normal: view, roughness: view, depth: view };
    // There is none yet.
    encode(Some(all(&single)), smaller).unwrap();
    let enough = view(&gpu, smaller, Rgba32Float, |_| ());
    let parts = ["`previous.depth`", "[1, 1]", &format!("[{}, {}]", smaller.x, smaller.y)];
    let thin = PrevGbuffer { depth: &single, ..all(&enough) };
    assert_says(&encode(Some(thin), SIZE).unwrap_err(), "InputSize", &parts);
    encode(Some(all(&enough)), SIZE).unwrap();
    let red = view(&gpu, SIZE, R32Float, |_| ());
    let thin = PrevGbuffer { normal: &red, ..all(&images.normal) };
    let parts = ["`previous.normal`", "R32Float", "3 channels"];
    assert_says(&encode(Some(thin), SIZE).unwrap_err(), "InputFormat", &parts);
}

#[test]
fn unusable_frames_are_refused_by_name() {
    let Some(gpu) = Gpu::open() else { return };
    let mut run = Run::new(&gpu, &linear_settings(), SIZE);
    let good = Scene::noisy_wall(SIZE, 0).upload(&gpu);
    let changed = |change: fn(&mut FrameInputs)| {
        let mut frame = still_frame(SIZE);
        change(&mut frame);
        frame
    };
    let too_large = changed(|frame| frame.size = UVec2::new(40, 25));
    // The images are large enough for it.
    let large = Scene::noisy_wall(UVec2::new(64, 64), 0).upload(&gpu);
    let error = refuse(&gpu, &mut run, &large.inputs(), &too_large);
    assert_says(&error, "Limpid", &["`size`", "[40, 25]", "[40, 24]"]);
    let nothing = changed(|frame| frame.size = UVec2::ZERO);
    assert_says(&refuse(&gpu, &mut run, &good.inputs(), &nothing), "Limpid", &["`size`", "[0, 0]"]);
    let dark = changed(|frame| frame.exposure = -1.0);
    assert_says(&refuse(&gpu, &mut run, &good.inputs(), &dark), "Limpid", &["`exposure`", "-1", "above 0"]);
    let flat = changed(|frame| frame.camera.world_to_view = Mat4::ZERO);
    assert_says(&refuse(&gpu, &mut run, &good.inputs(), &flat), "Limpid", &["`world_to_view`"]);
}

#[test]
fn stages_out_of_order_are_refused() {
    let Some(gpu) = Gpu::open() else { return };
    let mut run = Run::new(&gpu, &linear_settings(), SIZE);
    let images = Scene::noisy_wall(SIZE, 0).upload(&gpu);
    let mut encoder = gpu.encoder();
    for _ in 0..2 {
        let error = run.denoiser.encode_denoise(&mut encoder, &images.inputs()).unwrap_err();
        assert_says(&error, "Limpid", &["denoise stage", "no frame was classified"]);
        // A whole frame is no classify stage that is waiting.
        run.denoiser.encode(&gpu.queue, &mut encoder, &images.inputs(), &still_frame(SIZE)).unwrap();
    }
    gpu.queue.submit([encoder.finish()]);
    assert!(run.images(&images, &still_frame(SIZE)).length.iter().all(|length| *length == 3.0));
}

#[test]
fn what_the_device_cannot_do_is_refused_before_anything_is_made() {
    let Some(gpu) = Gpu::open() else { return };
    let refused = |settings: &Settings, size: UVec2, options: Options| {
        let Err(error) = Denoiser::new(&gpu.device, settings, size, options) else {
            panic!("{size} with {options:?} was accepted")
        };
        error
    };
    let mut settings = linear_settings();
    let timed = Options { timestamps: true, ..Default::default() };
    let error = refused(&settings, SIZE, timed);
    assert_says(&error, "Feature", &["`timestamps`", "TIMESTAMP_QUERY"]);

    let error = refused(&settings, UVec2::new(8193, 8), Options::default());
    assert_says(&error, "Limit", &["`guide`", "8193 pixels", "`max_texture_dimension_2d` is 8192"]);
    let error = refused(&settings, UVec2::new(20_000, 8), Options::default());
    assert_says(&error, "Limpid", &["size", "20000", "16384"]);
    let error = refused(&settings, UVec2::new(0, 8), Options::default());
    assert_says(&error, "Limpid", &["size", "[0, 8]"]);
    // A word a pixel: 256 MiB, where WebGPU promises half of that.
    settings.coverage.ray_list = Some(RayList::default());
    let error = refused(&settings, UVec2::splat(8192), Options::default());
    let parts = ["`rays`", "268435456 bytes", "`max_storage_buffer_binding_size` is 134217728"];
    assert_says(&error, "Limit", &parts);

    let mut run = Run::new(&gpu, &linear_settings(), SIZE);
    run.still(&Scene::noisy_wall(SIZE, 0));
    assert_says(&run.denoiser.resize(UVec2::new(9000, 9)).unwrap_err(), "Limit", &["9000 pixels"]);
    assert!(run.still(&Scene::noisy_wall(SIZE, 1)).length.iter().all(|length| *length == 2.0));
}
