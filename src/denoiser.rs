//! The scheduler: keeps what one frame leaves to the next, and says what each frame dispatches.

use std::sync::Arc;

use glam::UVec2;

use crate::frame::{self, FrameConstants, FrameInputs, Previous};
use crate::kernel::Kernel;
use crate::plan::{Grid, Plan};
use crate::settings::Settings;
use crate::variants::Variants;
use crate::{Error, passes};

/// What a backend has to know to run one frame of a [`Plan`].
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct FrameSchedule {
    /// 0 or 1: which copy of each pair is this frame's, see [`Copy::index`](crate::resource::Copy::index).
    pub phase: usize,
    /// Content of the constant buffer.
    pub constants: FrameConstants,
}

impl FrameSchedule {
    /// Workgroups of a pass, unless they come from a buffer.
    pub fn workgroups(&self, grid: &Grid) -> Option<[u32; 3]> {
        match grid {
            Grid::One => Some([1, 1, 1]),
            Grid::Squares { side } => {
                let [width, height] = self.constants.size.map(|pixels| pixels.div_ceil(*side));
                Some([width, height, 1])
            }
            Grid::Indirect { .. } => None,
        }
    }
}

/// What new settings change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Change {
    /// Constants. Pipelines, resources and history stay.
    Constants,
    /// Kernels too. What is bound to them, resources and history stay.
    Kernels,
    /// All: resources have to be made anew, and history is lost.
    Plan,
}

/// Whether last frame's G-buffer would say otherwise than it did then what was denoised.
fn reads_otherwise(settings: &Settings, last: &Settings) -> bool {
    settings.coverage.roughness_threshold != last.coverage.roughness_threshold
        || settings.features.constant_roughness != last.features.constant_roughness
        || settings.conventions != last.conventions
}

/// Decides passes, resources and constants. Backends own one and carry out what it says.
#[derive(Debug, Clone)]
pub struct Denoiser {
    settings: Settings,
    plan: Plan,
    kernels: Vec<Arc<Kernel>>,
    variants: Variants,
    frame_index: u32,
    previous: Option<Previous>,
    started: Option<FrameSchedule>,
}

impl Denoiser {
    /// A denoiser for images of up to `size` pixels.
    ///
    /// # Errors
    ///
    /// As [`Plan::new`].
    pub fn new(settings: &Settings, size: UVec2) -> Result<Self, Error> {
        let mut variants = Variants::default();
        let (plan, kernels) = Plan::from_variants(settings, size, &mut variants)?;
        let settings = settings.clone();
        Ok(Self { settings, plan, kernels, variants, frame_index: 0, previous: None, started: None })
    }

    /// A denoiser that runs a plan other than the settings' own: for tests of backends, which have to carry out
    /// any plan. `kernels` are those of its passes, in order.
    pub fn with_plan(settings: &Settings, plan: Plan, kernels: Vec<Kernel>) -> Self {
        let (settings, kernels) = (settings.clone(), kernels.into_iter().map(Arc::new).collect());
        Self { settings, plan, kernels, variants: Variants::default(), frame_index: 0, previous: None, started: None }
    }

    /// What is allocated and dispatched.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// The kernel of each pass of the plan, in order.
    pub fn kernels(&self) -> &[Arc<Kernel>] {
        &self.kernels
    }

    /// The settings in force.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Changes settings. What was made for settings that were in force or [prepared](Self::prepare) before is used
    /// again. Where the caller supplies last frame's G-buffer, a change of what it says is denoised loses history too.
    ///
    /// # Errors
    ///
    /// As [`Plan::new`]; nothing changes then.
    pub fn set_settings(&mut self, settings: &Settings) -> Result<Change, Error> {
        let (plan, kernels) = Plan::from_variants(settings, self.plan.size, &mut self.variants)?;
        // The length of stored history is counted in steps that depend on its limit.
        let counts_alike = settings.reproject.max_history == self.settings.reproject.max_history;
        let change = match plan == self.plan {
            true if counts_alike => Change::Constants,
            false if counts_alike && plan.is_like(&self.plan) => Change::Kernels,
            _ => Change::Plan,
        };
        let rereads = !settings.features.gbuffer_copy && reads_otherwise(settings, &self.settings);
        self.settings = settings.clone();
        if change != Change::Constants {
            (self.plan, self.kernels) = (plan, kernels);
        }
        if change == Change::Plan {
            self.forget();
        }
        if rereads {
            self.previous = None;
        }
        Ok(change)
    }

    /// Makes the kernels of settings that may be set later, and returns them with their plan, for backends to make
    /// pipelines of.
    ///
    /// # Errors
    ///
    /// As [`Plan::new`].
    pub fn prepare(&mut self, settings: &Settings) -> Result<(Plan, Vec<Arc<Kernel>>), Error> {
        Plan::from_variants(settings, self.plan.size, &mut self.variants)
    }

    /// All kernels that are kept, at most [`MAX_VARIANTS`](crate::variants::MAX_VARIANTS) and those in force. A kernel
    /// of the same pass with the same override constants is the same one as long as it is kept.
    pub fn variants(&self) -> impl Iterator<Item = &Arc<Kernel>> + Clone {
        self.variants.kernels().chain(&self.kernels)
    }

    /// Changes the largest image size. Pipelines stay; resources have to be allocated anew, and history is
    /// lost.
    ///
    /// # Errors
    ///
    /// [`Error::Size`]; nothing changes then.
    pub fn resize(&mut self, size: UVec2) -> Result<(), Error> {
        frame::check_allocation(size)?;
        self.plan.size = size;
        self.forget();
        Ok(())
    }

    /// Size of the frame that `inputs` finds history of; zero where there is none. What the caller supplies of last
    /// frame has to be as large; see [`input_size`](crate::resource::input_size).
    pub fn prev_size(&self, inputs: &FrameInputs) -> UVec2 {
        self.last_finished().filter(|_| !inputs.reset).map_or(UVec2::ZERO, |previous| previous.size)
    }

    fn last_finished(&self) -> Option<Previous> {
        if self.started.is_some() { None } else { self.previous }
    }

    fn forget(&mut self) {
        (self.previous, self.started) = (None, None);
    }

    /// Goes on to the next frame, for the passes of [`Stage::Classify`](crate::plan::Stage::Classify). Those of
    /// [`Stage::Denoise`](crate::plan::Stage::Denoise) follow with [`started_frame`](Self::started_frame) and
    /// [`finish_frame`](Self::finish_frame). A frame that was started and never finished left no history.
    ///
    /// # Errors
    ///
    /// [`Error::Size`], [`Error::Camera`] or [`Error::FrameInput`]; the denoiser is as before then.
    pub fn next_frame(&mut self, inputs: &FrameInputs) -> Result<FrameSchedule, Error> {
        let constants = frame::constants(&self.settings, inputs, self.plan.size, self.last_finished())?;
        let phase = (self.frame_index % 2) as usize;
        self.frame_index = self.frame_index.wrapping_add(1);
        self.previous = Some(Previous { camera: inputs.camera, size: inputs.size });
        let schedule = FrameSchedule { phase, constants };
        self.started = Some(schedule.clone());
        Ok(schedule)
    }

    /// The frame that was started and not finished yet.
    ///
    /// # Errors
    ///
    /// [`Error::Order`] if there is none.
    pub fn started_frame(&self) -> Result<&FrameSchedule, Error> {
        self.started.as_ref().ok_or(Error::Order)
    }

    /// Ends the frame: all its passes were recorded or run, and the next frame finds their results.
    pub fn finish_frame(&mut self) {
        self.started = None;
    }

    /// Which copy of each pair is that of the frame started last: 0 or 1.
    pub fn phase(&self) -> usize {
        (self.frame_index.wrapping_add(1) % 2) as usize
    }

    /// Where in the buffer `args` the grid of the ray list is, in bytes: workgroups of 64 rays in x, y and z,
    /// then the number of rays. `None` without a ray list.
    pub fn ray_args_offset(&self) -> Option<u64> {
        self.plan.resource("rays").map(|_| passes::RAY_ARGS * passes::ARGS_STRIDE)
    }
}
