//! What is refused, by name, and that nothing leaks when it is.

use std::rc::Rc;

use ash::vk;
use glam::{Mat4, UVec2, Vec2, camera::rh};
use limpid::settings::Fallback;
use limpid::{Camera, FrameInputs, Settings};
use limpid_ash::memory::{MemoryBlock, MemoryError, MemoryRequest, MemorySource};
use limpid_ash::offscreen::{Context, ContextOptions, OffscreenError, Session, UploadedImage, UploadedInputs};
use limpid_ash::{Denoiser, Error, Gpu, Input, Inputs, Options, PrevGbuffer};

const SIZE: UVec2 = UVec2::new(24, 16);

fn open() -> Option<Rc<Context>> {
    match Context::open(&ContextOptions { validation: true, ..ContextOptions::default() }) {
        Ok(context) => Some(Rc::new(context)),
        Err(error) => {
            use std::io::Write;
            assert!(std::env::var_os("LIMPID_REQUIRE_DEVICE").is_none(), "{error}");
            // Past the harness, which keeps to itself what a passing test prints.
            let _ = writeln!(std::io::stderr(), "SKIPPED: {error}");
            None
        }
    }
}

fn frame(size: UVec2) -> FrameInputs {
    let view_to_clip = rh::proj::directx::perspective(1.0, 1.0, 0.1, 100.0);
    FrameInputs::new(Camera { world_to_view: Mat4::IDENTITY, view_to_clip, jitter: Vec2::ZERO }, size)
}

/// Memory that gives out after so many blocks.
struct Scarce {
    source: Box<dyn MemorySource>,
    left: usize,
}

// SAFETY: hands on what another source does.
unsafe impl MemorySource for Scarce {
    fn allocate(&mut self, request: &MemoryRequest<'_>) -> Result<MemoryBlock, MemoryError> {
        self.left = self.left.checked_sub(1).ok_or("there is none left")?;
        self.source.allocate(request)
    }

    fn free(&mut self, block: MemoryBlock) {
        self.source.free(block);
    }
}

#[test]
fn whatever_allocation_fails_nothing_leaks() {
    let Some(context) = open() else { return };
    let mut blocks = 0;
    loop {
        let memory = Box::new(Scarce { source: context.memory(), left: blocks });
        // SAFETY: the context's handles belong together and outlive the denoiser.
        let made = unsafe { Denoiser::new(context.gpu(), memory, &Settings::default(), SIZE, Options::default()) };
        match made {
            Ok(denoiser) => {
                assert!(context.allocated_bytes() > 0);
                drop(denoiser);
                break;
            }
            Err(error) => {
                assert!(matches!(error, Error::OutOfMemory { .. }), "{error}");
                assert!(error.to_string().contains("limpid.") && error.to_string().contains("none left"), "{error}");
            }
        }
        assert_eq!(context.allocated_bytes(), 0);
        blocks += 1;
    }
    // Pairs of history and light, two of blocks, guide, last frame's guide, samples, idle frames, tiles, counters, args,
    // the same three for blocks, constants.
    assert_eq!(blocks, 17);
    assert_eq!(context.allocated_bytes(), 0);
    assert_eq!(context.messages(), Vec::<String>::new());
}

#[test]
fn devices_that_do_not_fit_are_refused() {
    let Some(context) = open() else { return };
    let make = |gpu: Gpu<'_>, size| {
        // SAFETY: as above; the family is only looked up.
        unsafe { Denoiser::new(gpu, context.memory(), &Settings::default(), size, Options::default()) }.err().unwrap()
    };
    let error = make(Gpu { queue_family: 99, ..context.gpu() }, SIZE);
    assert!(error.to_string().contains("queue family 99"), "{error}");
    let error = make(context.gpu(), UVec2::new(16384, 16385));
    assert!(matches!(error, Error::Limpid(limpid::Error::Size { .. })), "{error}");
    assert_eq!(context.allocated_bytes(), 0);
}

#[test]
fn inputs_that_do_not_fit_are_refused_and_nothing_is_recorded() {
    let Some(context) = open() else { return };
    let image = |format, bytes: usize| {
        UploadedImage::new(&context, format, SIZE, &vec![0; bytes * SIZE.element_product() as usize]).unwrap()
    };
    let wide = image(vk::Format::R32G32B32A32_SFLOAT, 16);
    let single = image(vk::Format::R32_SFLOAT, 4);
    let good = Inputs {
        radiance: wide.input(),
        normal: wide.input(),
        roughness: single.input(),
        depth: single.input(),
        motion: wide.input(),
        hit_motion: None,
        environment: None,
        previous: None,
    };
    let mut settings = Settings::default();
    // SAFETY: as above.
    let new = |settings: &Settings| unsafe {
        Denoiser::new(context.gpu(), context.memory(), settings, SIZE, Options::default()).unwrap()
    };
    let record = |denoiser: &mut Denoiser, inputs: &Inputs, frame: &FrameInputs| {
        // SAFETY: `run` records, submits and waits; what does not fit is refused before it is used.
        context.run(|commands| Ok(unsafe { denoiser.record(commands, inputs, frame) }?))
    };
    let mut denoiser = new(&settings);
    let mut refused = |inputs: &Inputs, size: UVec2, parts: &[&str]| {
        let error = record(&mut denoiser, inputs, &frame(size)).unwrap_err().to_string();
        assert!(parts.iter().all(|part| error.contains(part)), "{error}");
    };
    let small = Input { size: UVec2::new(24, 15), ..good.depth };
    refused(&Inputs { depth: small, ..good }, SIZE, &["`depth`", "[24, 15]", "[24, 16]"]);
    let attachment = Input { layout: vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL, ..good.motion };
    refused(&Inputs { motion: attachment, ..good }, SIZE, &["`motion`", "COLOR_ATTACHMENT_OPTIMAL"]);
    let nothing = Input { view: vk::ImageView::null(), ..good.radiance };
    refused(&Inputs { radiance: nothing, ..good }, SIZE, &["`radiance`", "missing"]);
    refused(&good, UVec2::new(25, 16), &["`radiance`", "[25, 16]"]);
    // After all that the denoiser works.
    record(&mut denoiser, &good, &frame(SIZE)).unwrap();

    settings.features.gbuffer_copy = false;
    let mut denoiser = new(&settings);
    let error = record(&mut denoiser, &good, &frame(SIZE)).unwrap_err().to_string();
    assert!(error.contains("`previous.normal`") && error.contains("missing"), "{error}");
    let previous = PrevGbuffer { normal: wide.input(), roughness: single.input(), depth: small };
    let supplied = Inputs { previous: Some(previous), ..good };
    // There is no last frame yet.
    record(&mut denoiser, &supplied, &frame(SIZE)).unwrap();
    let error = record(&mut denoiser, &supplied, &frame(SIZE)).unwrap_err().to_string();
    assert!(["`previous.depth`", "[24, 15]", "[24, 16]"].iter().all(|part| error.contains(part)), "{error}");
    settings.features.gbuffer_copy = true;

    settings.features.hit_motion = true;
    let error = record(&mut new(&settings), &good, &frame(SIZE)).unwrap_err();
    assert!(matches!(error, OffscreenError::Denoiser(Error::InputMissing { input: "hit_motion" })), "{error}");
    let good = Inputs { hit_motion: Some(wide.input()), ..good };
    settings.coverage.fallback = Fallback::Environment;
    let error = record(&mut new(&settings), &good, &frame(SIZE)).unwrap_err();
    assert!(matches!(error, OffscreenError::Denoiser(Error::InputMissing { input: "environment" })), "{error}");
    let error = context
        // SAFETY: refused before anything is recorded.
        .run(|commands| Ok(unsafe { new(&Settings::default()).record_denoise(commands, &good) }?))
        .unwrap_err();
    assert!(matches!(error, OffscreenError::Denoiser(Error::Limpid(limpid::Error::Order))), "{error}");
    assert_eq!(context.messages(), Vec::<String>::new());
}

#[test]
fn several_denoisers_live_on_one_device() {
    let Some(context) = open() else { return };
    let core = || limpid::Denoiser::new(&Settings::default(), SIZE).unwrap();
    let mut sessions: Vec<_> = (0..3).map(|_| Session::new(&context, core(), Options::default()).unwrap()).collect();
    let texels = vec![0.5f32; 4 * SIZE.element_product() as usize];
    let image =
        UploadedImage::new(&context, vk::Format::R32G32B32A32_SFLOAT, SIZE, bytemuck::cast_slice(&texels)).unwrap();
    let inputs = UploadedInputs {
        radiance: &image,
        normal: &image,
        roughness: &image,
        depth: &image,
        motion: &image,
        hit_motion: None,
        environment: None,
        previous: None,
    };
    for _ in 0..2 {
        for session in &mut sessions {
            session.run(&inputs, &frame(SIZE)).unwrap();
        }
    }
    let outputs: Vec<_> =
        sessions.iter().map(|session| context.read_image(&session.denoiser().output()).unwrap()).collect();
    assert!(outputs.iter().all(|output| output == &outputs[0]));
    drop((sessions, image));
    assert_eq!(context.allocated_bytes(), 0);
    assert_eq!(context.messages(), Vec::<String>::new());
}
