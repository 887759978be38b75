//! The scheduler: keeps what one frame leaves to the next, and says what each frame dispatches.

use glam::UVec2;

use crate::frame::{self, FrameConstants, FrameInputs, Previous};
use crate::kernel::Kernel;
use crate::plan::{Grid, Plan};
use crate::settings::Settings;
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

/// Decides passes, resources and constants. Backends own one and carry out what it says.
#[derive(Debug, Clone)]
pub struct Denoiser {
    settings: Settings,
    plan: Plan,
    kernels: Vec<Kernel>,
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
        let (plan, kernels) = Plan::new(settings, size)?;
        Ok(Self::with_plan(settings, plan, kernels))
    }

    /// A denoiser that runs a plan other than the settings' own: for tests of backends, which have to carry out
    /// any plan. `kernels` are those of its passes, in order.
    pub fn with_plan(settings: &Settings, plan: Plan, kernels: Vec<Kernel>) -> Self {
        Self { settings: settings.clone(), plan, kernels, frame_index: 0, previous: None, started: None }
    }

    /// What is allocated and dispatched.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// The kernel of each pass of the plan, in order.
    pub fn kernels(&self) -> &[Kernel] {
        &self.kernels
    }

    /// The settings in force.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Changes settings. Returns whether the plan changed, so that the backend has to make its pipelines and
    /// resources anew; history is lost then. Otherwise only constants changed, and history is kept.
    ///
    /// # Errors
    ///
    /// As [`Plan::new`]; nothing changes then.
    pub fn set_settings(&mut self, settings: &Settings) -> Result<bool, Error> {
        let (plan, kernels) = Plan::new(settings, self.plan.size)?;
        // The length of stored history is counted in steps that depend on its limit.
        let rebuilt = plan != self.plan || settings.reproject.max_history != self.settings.reproject.max_history;
        self.settings = settings.clone();
        if rebuilt {
            (self.plan, self.kernels) = (plan, kernels);
            self.forget();
        }
        Ok(rebuilt)
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
        let previous = if self.started.is_some() { None } else { self.previous };
        let constants = frame::constants(&self.settings, inputs, self.plan.size, previous)?;
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
