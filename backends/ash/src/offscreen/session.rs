use std::rc::Rc;

use limpid::FrameInputs;

use super::context::{Context, OffscreenError};
use super::image::UploadedImage;
use crate::{Denoiser, Inputs, Options, PrevGbuffer};

/// The images of a frame.
#[derive(Clone, Copy)]
pub struct UploadedInputs<'a> {
    /// `rgb`: noisy radiance, `a`: hit distance.
    pub radiance: &'a UploadedImage,
    /// World-space normal.
    pub normal: &'a UploadedImage,
    /// Roughness, in the channel that the settings name.
    pub roughness: &'a UploadedImage,
    /// Depth.
    pub depth: &'a UploadedImage,
    /// Motion vectors in `rg`.
    pub motion: &'a UploadedImage,
    /// World-space motion of what was hit, in `rgb`. Only for the feature `hit_motion`.
    pub hit_motion: Option<&'a UploadedImage>,
    /// Equirectangular radiance. Only for `Fallback::Environment`.
    pub environment: Option<&'a UploadedImage>,
    /// Last frame's normal, roughness and depth. Only without the feature `gbuffer_copy`.
    pub previous: Option<[&'a UploadedImage; 3]>,
}

impl UploadedInputs<'_> {
    fn inputs(&self) -> Inputs {
        Inputs {
            radiance: self.radiance.input(),
            normal: self.normal.input(),
            roughness: self.roughness.input(),
            depth: self.depth.input(),
            motion: self.motion.input(),
            hit_motion: self.hit_motion.map(UploadedImage::input),
            environment: self.environment.map(UploadedImage::input),
            previous: self.previous.map(|images| {
                let [normal, roughness, depth] = images.map(UploadedImage::input);
                PrevGbuffer { normal, roughness, depth }
            }),
        }
    }
}

/// A denoiser on a device of its own, which runs every frame at once and waits for it.
pub struct Session {
    /// Before the context, because it is dropped before it.
    denoiser: Denoiser,
    context: Rc<Context>,
}

impl Session {
    /// A denoiser that carries out a plan. The context says how barriers are recorded and what debuggers see,
    /// unless `options` do.
    ///
    /// # Errors
    ///
    /// [`OffscreenError::Denoiser`].
    pub fn new(context: &Rc<Context>, core: limpid::Denoiser, options: Options) -> Result<Self, OffscreenError> {
        let options = Options {
            frames_in_flight: 1,
            debug_utils: options.debug_utils.clone().or_else(|| context.debug_utils()),
            ..options
        };
        // SAFETY: the context's handles belong together and outlive the denoiser; it enabled what it offers.
        let denoiser = unsafe { Denoiser::with_core(context.gpu(), context.memory(), core, options) }?;
        Ok(Self { denoiser, context: Rc::clone(context) })
    }

    /// The denoiser, to see what it left.
    pub fn denoiser(&self) -> &Denoiser {
        &self.denoiser
    }

    /// The denoiser, to change settings or size.
    pub fn denoiser_mut(&mut self) -> &mut Denoiser {
        &mut self.denoiser
    }

    /// Denoises a frame.
    ///
    /// # Errors
    ///
    /// [`OffscreenError`].
    pub fn run(&mut self, inputs: &UploadedInputs<'_>, frame: &FrameInputs) -> Result<(), OffscreenError> {
        let denoiser = &mut self.denoiser;
        // SAFETY: `Context::run` records, submits and waits; uploaded images are readable and of this device.
        self.context.run(|commands| Ok(unsafe { denoiser.record(commands, &inputs.inputs(), frame) }?))
    }

    /// Runs what comes before ray tracing.
    ///
    /// # Errors
    ///
    /// [`OffscreenError`].
    pub fn run_classify(&mut self, inputs: &UploadedInputs<'_>, frame: &FrameInputs) -> Result<(), OffscreenError> {
        let denoiser = &mut self.denoiser;
        // SAFETY: as in `run`.
        self.context.run(|commands| Ok(unsafe { denoiser.record_classify(commands, &inputs.inputs(), frame) }?))
    }

    /// Runs what comes after ray tracing.
    ///
    /// # Errors
    ///
    /// [`OffscreenError`].
    pub fn run_denoise(&mut self, inputs: &UploadedInputs<'_>) -> Result<(), OffscreenError> {
        let denoiser = &mut self.denoiser;
        // SAFETY: as in `run`.
        self.context.run(|commands| Ok(unsafe { denoiser.record_denoise(commands, &inputs.inputs()) }?))
    }
}
