use glam::UVec2;
use limpid::plan::{Bound, DEBUG_VIEW, Grid, Stage};
use limpid::resource::Copy;
use limpid::variants::Made;
use limpid::{Change, FrameConstants, FrameInputs, FrameSchedule, Plan, Settings};

use crate::pipelines::{Pipeline, pipelines};
use crate::textures::Allocations;
use crate::timing::{PassTime, Timing};
use crate::{Error, Inputs};

/// Frames that may be recorded before the first of them is submitted.
pub const FRAMES_BEFORE_SUBMIT: u64 = 8;

/// Bind groups kept for each pass: enough for callers whose G-buffer alternates between a few sets of textures.
const CACHED_INPUT_SETS: usize = 8;

/// What a denoiser is made with, beside its settings.
#[derive(Debug, Clone, Copy, Default)]
pub struct Options {
    /// Measures each pass; see [`Denoiser::read_times`]. Needs `wgpu::Features::TIMESTAMP_QUERY`.
    pub timestamps: bool,
    /// Lets intermediate textures and buffers be copied from, to inspect them.
    pub readable_intermediates: bool,
}

/// The ray list that the classify stage leaves for the renderer.
#[derive(Debug, Clone, Copy)]
pub struct RayList<'a> {
    /// One `u32` for each ray: `x` in bits 0 to 13, `y` in bits 14 to 27; bit 28, 29 and 30 ask to copy the
    /// result to the other pixel in the row, in the column and on the diagonal of the 2x2 quad.
    pub rays: &'a wgpu::Buffer,
    /// Buffer with the grid for `dispatch_workgroups_indirect` (64 rays a workgroup, 4096 workgroups a row)
    /// and, after those three `u32`, the number of rays.
    pub args: &'a wgpu::Buffer,
    /// Where in `args`, in bytes.
    pub args_offset: u64,
}

/// Bind groups of group 0 of one pass, by the caller's views.
#[derive(Default)]
struct InputGroups(Vec<(Vec<wgpu::TextureView>, wgpu::BindGroup)>);

/// A denoiser on a device.
///
/// Several can live on one device. Frames of one denoiser have to be submitted in the order in which they
/// were recorded; up to [`FRAMES_BEFORE_SUBMIT`] may be recorded before a submission.
pub struct Denoiser {
    device: wgpu::Device,
    options: Options,
    core: limpid::Denoiser,
    pipelines: Vec<Pipeline>,
    /// Pipelines of all kernels that the core keeps.
    made: Made<Pipeline>,
    allocations: Allocations,
    constants: wgpu::Buffer,
    constants_stride: u64,
    constants_slot: u64,
    /// Group 1 of each pass, for both phases.
    own_groups: Vec<[Option<wgpu::BindGroup>; 2]>,
    /// Group 0 of each pass.
    input_groups: Vec<InputGroups>,
    timing: Option<Timing>,
}

fn own_groups(
    device: &wgpu::Device,
    plan: &Plan,
    pipelines: &[Pipeline],
    allocations: &Allocations,
) -> Vec<[Option<wgpu::BindGroup>; 2]> {
    let group = |bindings: &[Bound], pipeline: &Pipeline, phase| {
        let layout = pipeline.groups[1].as_ref()?;
        let entries: Vec<_> = bindings
            .iter()
            .filter(|bound| bound.group == 1)
            .filter_map(|bound| {
                let resource = allocations.binding(plan, &bound.resource, bound.copy, phase)?;
                Some(wgpu::BindGroupEntry { binding: bound.binding, resource })
            })
            .collect();
        let label = Some(pipeline.label.as_str());
        Some(device.create_bind_group(&wgpu::BindGroupDescriptor { label, layout, entries: &entries }))
    };
    let passes = plan.passes.iter().zip(pipelines);
    passes.map(|(pass, pipeline)| [0, 1].map(|phase| group(&pass.bindings, pipeline, phase))).collect()
}

impl InputGroups {
    /// The bind group for the views that a pass reads, made anew when they were not used before.
    fn get(
        &mut self,
        device: &wgpu::Device,
        pipeline: &Pipeline,
        bindings: &[Bound],
        inputs: &Inputs<'_>,
        constants: &wgpu::Buffer,
    ) -> Option<&wgpu::BindGroup> {
        let layout = pipeline.groups[0].as_ref()?;
        let views = || bindings.iter().filter(|b| b.group == 0).filter_map(|b| inputs.view(&b.resource));
        if let Some(known) = self.0.iter().position(|(known, _)| known.iter().eq(views())) {
            return Some(&self.0[known].1);
        }
        let entries: Vec<_> = bindings
            .iter()
            .filter(|bound| bound.group == 0)
            .map(|bound| {
                let resource = match inputs.view(&bound.resource) {
                    Some(view) => wgpu::BindingResource::TextureView(view),
                    None => wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                        buffer: constants,
                        offset: 0,
                        size: wgpu::BufferSize::new(size_of::<FrameConstants>() as u64),
                    }),
                };
                wgpu::BindGroupEntry { binding: bound.binding, resource }
            })
            .collect();
        let label = Some(pipeline.label.as_str());
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor { label, layout, entries: &entries });
        if self.0.len() == CACHED_INPUT_SETS {
            self.0.remove(0);
        }
        self.0.push((views().cloned().collect(), group));
        self.0.last().map(|(_, group)| group)
    }
}

impl Denoiser {
    /// Creates pipelines and memory for images of up to `size` pixels.
    ///
    /// # Errors
    ///
    /// [`Error::Limpid`] for settings or size, [`Error::Feature`], [`Error::Limit`].
    pub fn new(device: &wgpu::Device, settings: &Settings, size: UVec2, options: Options) -> Result<Self, Error> {
        Self::with_core(device, limpid::Denoiser::new(settings, size)?, options)
    }

    /// Carries out a plan that is ready.
    ///
    /// # Errors
    ///
    /// [`Error::Feature`], [`Error::Limit`].
    pub fn with_core(device: &wgpu::Device, core: limpid::Denoiser, options: Options) -> Result<Self, Error> {
        Self::with_pipelines(device, core, Made::default(), options)
    }

    fn with_pipelines(
        device: &wgpu::Device,
        core: limpid::Denoiser,
        mut made: Made<Pipeline>,
        options: Options,
    ) -> Result<Self, Error> {
        if options.timestamps && !device.features().contains(wgpu::Features::TIMESTAMP_QUERY) {
            return Err(Error::Feature { option: "timestamps", feature: wgpu::Features::TIMESTAMP_QUERY });
        }
        let allocations = Allocations::new(device, core.plan(), options.readable_intermediates)?;
        let pipelines = pipelines(device, core.kernels(), &mut made);
        let own_groups = own_groups(device, core.plan(), &pipelines, &allocations);
        let alignment = u64::from(device.limits().min_uniform_buffer_offset_alignment);
        let constants_stride = (size_of::<FrameConstants>() as u64).next_multiple_of(alignment);
        let constants = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("limpid.frame"),
            size: constants_stride * FRAMES_BEFORE_SUBMIT,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        Ok(Self {
            device: device.clone(),
            options,
            input_groups: pipelines.iter().map(|_| InputGroups::default()).collect(),
            core,
            pipelines,
            made,
            allocations,
            constants,
            constants_stride,
            constants_slot: 0,
            own_groups,
            timing: None,
        })
    }

    /// Allocates for another largest size. Pipelines stay, history is lost.
    ///
    /// # Errors
    ///
    /// [`Error::Limpid`] or [`Error::Limit`]; nothing changes then.
    pub fn resize(&mut self, size: UVec2) -> Result<(), Error> {
        let mut core = self.core.clone();
        core.resize(size)?;
        self.allocations = Allocations::new(&self.device, core.plan(), self.options.readable_intermediates)?;
        self.own_groups = own_groups(&self.device, core.plan(), &self.pipelines, &self.allocations);
        self.core = core;
        Ok(())
    }

    /// Changes settings. Takes effect with the next frame. Pipelines that were made before are used again:
    /// [`prepare`](Self::prepare) makes them ahead. Numbers, and features that change no binding, such as
    /// `near_taps`, keep history; others make resources anew and lose it.
    ///
    /// # Errors
    ///
    /// As [`Denoiser::new`]; nothing changes then.
    pub fn set_settings(&mut self, settings: &Settings) -> Result<(), Error> {
        let mut core = self.core.clone();
        match core.set_settings(settings)? {
            Change::Constants => self.core = core,
            Change::Kernels => {
                self.pipelines = pipelines(&self.device, core.kernels(), &mut self.made);
                self.core = core;
            }
            Change::Plan => {
                *self = Self::with_pipelines(&self.device, core, self.made.clone(), self.options)?;
            }
        }
        self.made.keep(self.core.variants());
        Ok(())
    }

    /// Makes pipelines for settings that may be set later, so that no frame has to wait for a compiler then. The
    /// pipelines that were used last are kept: those of at most [`MAX_VARIANTS`](limpid::variants::MAX_VARIANTS)
    /// kernels and those in use.
    ///
    /// # Errors
    ///
    /// As [`Denoiser::new`].
    pub fn prepare(&mut self, settings: &Settings) -> Result<(), Error> {
        let (_, kernels) = self.core.prepare(settings)?;
        pipelines(&self.device, &kernels, &mut self.made);
        self.made.keep(self.core.variants());
        Ok(())
    }

    /// How many pipelines are kept.
    pub fn pipelines(&self) -> usize {
        self.made.len()
    }

    /// Records a whole frame.
    ///
    /// # Errors
    ///
    /// [`Error::Limpid`] for `frame`, or one of the `Input` errors. Nothing was recorded then.
    pub fn encode(
        &mut self,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        inputs: &Inputs<'_>,
        frame: &FrameInputs,
    ) -> Result<(), Error> {
        self.encode_classify(queue, encoder, inputs, frame)?;
        self.encode_denoise(encoder, inputs)
    }

    /// Records what comes before ray tracing: afterwards the [`ray_list`](Self::ray_list) can be traced. Reads
    /// normal, roughness and depth only.
    ///
    /// # Errors
    ///
    /// As [`encode`](Self::encode).
    pub fn encode_classify(
        &mut self,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        inputs: &Inputs<'_>,
        frame: &FrameInputs,
    ) -> Result<(), Error> {
        let prev_size = self.core.prev_size(frame);
        inputs.check(self.core.plan().inputs(), self.core.settings(), frame.size, prev_size)?;
        let schedule = self.core.next_frame(frame)?;
        if self.options.timestamps && self.timing.is_none() {
            let passes = self.core.plan().passes.iter().map(|pass| pass.name.clone()).collect();
            self.timing = Some(Timing::new(&self.device, queue, passes));
        }
        self.constants_slot = (self.constants_slot + 1) % FRAMES_BEFORE_SUBMIT;
        let offset = self.constants_slot * self.constants_stride;
        queue.write_buffer(&self.constants, offset, bytemuck::bytes_of(&schedule.constants));
        self.encode_stage(Stage::Classify, encoder, inputs, &schedule);
        Ok(())
    }

    /// Records what comes after ray tracing, with the same inputs as [`encode_classify`](Self::encode_classify).
    ///
    /// # Errors
    ///
    /// [`limpid::Error::Order`], or one of the `Input` errors. Nothing was recorded then.
    pub fn encode_denoise(&mut self, encoder: &mut wgpu::CommandEncoder, inputs: &Inputs<'_>) -> Result<(), Error> {
        let schedule = self.core.started_frame()?.clone();
        let [size, prev_size] = [schedule.constants.size, schedule.constants.prev_size].map(UVec2::from_array);
        inputs.check(self.core.plan().inputs(), self.core.settings(), size, prev_size)?;
        self.encode_stage(Stage::Denoise, encoder, inputs, &schedule);
        if let Some(timing) = &mut self.timing {
            timing.resolve(encoder);
        }
        self.core.finish_frame();
        Ok(())
    }

    fn encode_stage(
        &mut self,
        stage: Stage,
        encoder: &mut wgpu::CommandEncoder,
        inputs: &Inputs<'_>,
        schedule: &FrameSchedule,
    ) {
        let plan = self.core.plan();
        let constants_offset = (self.constants_slot * self.constants_stride) as u32;
        for (index, pass) in plan.passes.iter().enumerate().filter(|(_, pass)| pass.stage == stage) {
            let pipeline = &self.pipelines[index];
            let input_group =
                self.input_groups[index].get(&self.device, pipeline, &pass.bindings, inputs, &self.constants);
            let mut compute = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: Some(&pipeline.label),
                timestamp_writes: self.timing.as_ref().map(|timing| timing.writes(index)),
            });
            compute.set_pipeline(&pipeline.pipeline);
            if let Some(group) = input_group {
                compute.set_bind_group(0, group, &[constants_offset]);
            }
            if let Some(group) = &self.own_groups[index][schedule.phase] {
                compute.set_bind_group(1, group, &[]);
            }
            match (schedule.workgroups(&pass.grid), &pass.grid) {
                (Some([x, y, z]), _) => compute.dispatch_workgroups(x, y, z),
                (None, Grid::Indirect { resource, offset }) => {
                    if let Some(buffer) = self.allocations.buffer(plan, resource) {
                        compute.dispatch_workgroups_indirect(buffer, *offset);
                    }
                }
                (None, _) => {}
            }
        }
    }

    /// The denoised image of the frame recorded last, `Rgba16Float`: `rgb` radiance, `a` variance. Read it
    /// before the next frame's denoise stage runs, and do not write it. It can be another texture from frame to frame,
    /// one of two: ask for it after each.
    pub fn output(&self) -> &wgpu::TextureView {
        let (_, view) = self.output_pair();
        view
    }

    /// The texture of [`output`](Self::output), to copy from.
    pub fn output_texture(&self) -> &wgpu::Texture {
        let (texture, _) = self.output_pair();
        texture
    }

    fn output_pair(&self) -> &(wgpu::Texture, wgpu::TextureView) {
        let plan = self.core.plan();
        let output =
            plan.output().and_then(|(name, copy)| self.allocations.texture(plan, name, copy, self.core.phase()));
        output.expect("every plan has an output")
    }

    /// The debug view of the frame recorded last, `Rgba16Float`: linear colours, 0 to 1, as
    /// [`limpid::DebugView::legend`] explains them. Read it before the next frame's denoise stage runs. `None` unless
    /// the settings ask for one.
    pub fn debug_view(&self) -> Option<&wgpu::TextureView> {
        self.debug_view_pair().map(|(_, view)| view)
    }

    /// The texture of [`debug_view`](Self::debug_view), to copy from.
    pub fn debug_view_texture(&self) -> Option<&wgpu::Texture> {
        self.debug_view_pair().map(|(texture, _)| texture)
    }

    fn debug_view_pair(&self) -> Option<&(wgpu::Texture, wgpu::TextureView)> {
        self.allocations.texture(self.core.plan(), DEBUG_VIEW, Copy::Current, self.core.phase())
    }

    /// The rays to trace, after [`encode_classify`](Self::encode_classify). `None` unless the settings ask for
    /// a list.
    pub fn ray_list(&self) -> Option<RayList<'_>> {
        let plan = self.core.plan();
        let args_offset = self.core.ray_args_offset()?;
        let rays = self.allocations.buffer(plan, "rays")?;
        Some(RayList { rays, args: self.allocations.buffer(plan, "args")?, args_offset })
    }

    /// A texture of the plan as it is after the frame recorded last; see [`Options::readable_intermediates`].
    pub fn intermediate_texture(&self, resource: &str, copy: Copy) -> Option<&wgpu::Texture> {
        self.allocations.texture(self.core.plan(), resource, copy, self.core.phase()).map(|(texture, _)| texture)
    }

    /// A buffer of the plan; see [`Options::readable_intermediates`].
    pub fn intermediate_buffer(&self, resource: &str) -> Option<&wgpu::Buffer> {
        self.allocations.buffer(self.core.plan(), resource)
    }

    /// Calls back with the time of each pass of the frame recorded last, once the device has been polled. To be
    /// called after that frame was submitted and before the next is recorded. Does nothing without
    /// [`Options::timestamps`].
    pub fn read_times(&self, callback: impl FnOnce(Vec<PassTime>) + Send + 'static) {
        if let Some(timing) = &self.timing {
            timing.read(callback);
        }
    }

    /// What is allocated and dispatched.
    pub fn plan(&self) -> &Plan {
        self.core.plan()
    }
}
