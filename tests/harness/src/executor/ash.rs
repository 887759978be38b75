use std::rc::Rc;

use glam::UVec2;
use limpid::{FrameInputs, Settings};
use limpid_ash::ash::vk::Format;
use limpid_ash::offscreen::{Context, ContextOptions, OffscreenError, Session, UploadedImage, UploadedInputs};
use limpid_ash::{Denoiser, Options, SpirvSource, Synchronization};

use super::Executor;
use crate::{Image, Snapshot, TexelFormat};

/// Which device, and how.
#[derive(Clone, Default)]
pub struct AshOptions {
    /// The first device whose name contains this.
    pub device: String,
    /// Whether the validation layer watches.
    pub validation: bool,
    /// Whether barriers are those of Vulkan 1.0 although the device knows better ones.
    pub old_barriers: bool,
    /// Whether resources share memory. Snapshots hold only what the caller reads then.
    pub shared_memory: bool,
    /// What kernels are compiled by in the place of limpid.
    pub spirv: Option<SpirvSource>,
}

/// The ash backend.
pub struct Ash {
    session: Option<Session>,
    options: Options,
    context: Rc<Context>,
}

impl Ash {
    /// Opens a device.
    ///
    /// # Panics
    ///
    /// When there is none.
    pub fn open(options: &AshOptions) -> Self {
        Self::try_open(options).unwrap()
    }

    /// Opens a device, if there is one.
    ///
    /// # Errors
    ///
    /// When there is none, or no validation layer.
    pub fn try_open(options: &AshOptions) -> Result<Self, OffscreenError> {
        let (device, validation) = (options.device.clone(), options.validation);
        let context = Context::open(&ContextOptions { device, validation, ..ContextOptions::default() })?;
        let synchronization = if options.old_barriers { Synchronization::Core1_0 } else { context.synchronization() };
        let denoiser_options = Options {
            readable_intermediates: !options.shared_memory,
            timestamps: options.validation && context.has_timestamps(),
            synchronization,
            spirv: options.spirv.clone(),
            ..Options::default()
        };
        Ok(Self { session: None, options: denoiser_options, context: Rc::new(context) })
    }

    /// What the validation layer said.
    pub fn messages(&self) -> Vec<String> {
        self.context.messages()
    }

    /// The denoiser, once started.
    pub fn denoiser(&self) -> Option<&Denoiser> {
        self.session.as_ref().map(Session::denoiser)
    }

    /// Drops the denoiser and returns the bytes that are still allocated.
    pub fn leaked_bytes(&mut self) -> u64 {
        self.session = None;
        self.context.allocated_bytes()
    }
}

impl Executor for Ash {
    fn backend(&self) -> &'static str {
        "ash"
    }

    fn device(&self) -> &str {
        self.context.name()
    }

    fn start(&mut self, core: limpid::Denoiser) {
        self.session = None;
        self.session = Some(Session::new(&self.context, core, self.options.clone()).unwrap());
    }

    fn resize(&mut self, size: UVec2) {
        self.session.as_mut().unwrap().denoiser_mut().resize(size).unwrap();
    }

    fn set_settings(&mut self, settings: &Settings) {
        self.session.as_mut().unwrap().denoiser_mut().set_settings(settings).unwrap();
    }

    fn frame(&mut self, images: &[Image], frame: &FrameInputs) -> Snapshot {
        let format = |format| match format {
            TexelFormat::Rgba16Float => Format::R16G16B16A16_SFLOAT,
            TexelFormat::Rgba32Float => Format::R32G32B32A32_SFLOAT,
            TexelFormat::R32Float => Format::R32_SFLOAT,
            TexelFormat::Rg32Float => Format::R32G32_SFLOAT,
        };
        let (context, session) = (&self.context, self.session.as_mut().unwrap());
        let upload = |image: &Image| {
            let bytes = bytemuck::cast_slice(&image.words);
            (image.name, UploadedImage::new(context, format(image.format), image.size, bytes).unwrap())
        };
        let uploaded: Vec<_> = images.iter().map(upload).collect();
        let find = |name| &uploaded.iter().find(|(n, _)| *n == name).unwrap().1;
        let inputs = UploadedInputs {
            radiance: find("radiance"),
            normal: find("normal"),
            roughness: find("roughness"),
            depth: find("depth"),
            motion: find("motion"),
            hit_motion: Some(find("hit_motion")),
            environment: Some(find("environment")),
            previous: Some(["prev_normal", "prev_roughness", "prev_depth"].map(find)),
        };
        session.run(&inputs, frame).unwrap();
        let denoiser = session.denoiser();
        let words = |bytes: Vec<u8>| bytemuck::pod_collect_to_vec::<u8, u32>(&bytes);
        Snapshot::take(
            denoiser.plan(),
            frame.size,
            |resource| resource.exported || self.options.readable_intermediates,
            |name, copy| words(context.read_image(&denoiser.intermediate_image(name, copy).unwrap()).unwrap()),
            |name| {
                let (buffer, size) = denoiser.intermediate_buffer(name).unwrap();
                words(context.read_buffer(buffer, size).unwrap())
            },
        )
    }
}
