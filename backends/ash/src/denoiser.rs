use std::sync::Arc;

use ash::vk;
use glam::UVec2;
use limpid::kernel::Binding;
use limpid::plan::{DEBUG_VIEW, Grid, Stage};
use limpid::resource::Copy;
use limpid::variants::Made;
use limpid::{Change, FrameConstants, FrameInputs, FrameSchedule, Plan, Settings};

use crate::barrier::{Batch, Side};
use crate::descriptors::{InputSets, OwnSets};
use crate::gpu::{Gpu, Shared};
use crate::inputs::Inputs;
use crate::memory::MemorySource;
use crate::pipelines::{Pipeline, Pipelines, stage_index};
use crate::resources::{Buffer, Resources};
use crate::timing::{PassTime, Timing};
use crate::{Error, Options};

/// The image of a resource of limpid, in the layout `GENERAL` between frames as well as within.
#[derive(Debug, Clone, Copy)]
pub struct OwnImage {
    /// The image.
    pub image: vk::Image,
    /// A view of all of it.
    pub view: vk::ImageView,
    /// Its format.
    pub format: vk::Format,
    /// Its size in texels.
    pub size: UVec2,
}

/// The ray list that the classify stage leaves for the renderer.
#[derive(Debug, Clone, Copy)]
pub struct RayList {
    /// One `u32` for each ray: `x` in bits 0 to 13, `y` in bits 14 to 27; bit 28, 29 and 30 ask to copy the
    /// result to the other pixel in the row, in the column and on the diagonal of the 2x2 quad.
    pub rays: vk::Buffer,
    /// Size of `rays` in bytes.
    pub rays_size: u64,
    /// Buffer with the grid for `vkCmdDispatchIndirect` (64 rays a workgroup, 4096 workgroups a row) and, after
    /// those three `u32`, the number of rays.
    pub args: vk::Buffer,
    /// Where in `args`, in bytes.
    pub args_offset: u64,
}

/// What was recorded for a frame, in numbers.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Recorded {
    /// Calls of `vkCmdDispatch` and `vkCmdDispatchIndirect`.
    pub dispatches: usize,
    /// Calls of `vkCmdPipelineBarrier` or its successor.
    pub barriers: usize,
    /// Descriptors written by `vkUpdateDescriptorSets`.
    pub descriptor_writes: usize,
}

/// Everything that depends on the size.
struct Sized {
    resources: Resources,
    own_sets: OwnSets,
}

/// A denoiser on a Vulkan device. See the [crate](crate) for what it asks of its caller.
///
/// # Dropping
///
/// A denoiser destroys what it made: pipelines, descriptor sets, images, buffers, queries; then it frees their
/// memory through its [`MemorySource`], which it drops last. Before that, the device must have finished every frame,
/// and device and instance must still exist.
pub struct Denoiser {
    gpu: Arc<Shared>,
    options: Options,
    core: limpid::Denoiser,
    barriers: Vec<Option<limpid::synchronization::Barrier>>,
    pipelines: Pipelines,
    /// Pipelines of all kernels that the core keeps.
    made: Made<Arc<Pipeline>>,
    sized: Sized,
    constants: Buffer,
    constants_stride: u64,
    input_sets: InputSets,
    timing: Option<Timing>,
    /// Frames started so far.
    frames: u64,
    needs_clear: bool,
    recorded: Recorded,
    /// What may still be in use, and the number of frames after which it is not.
    retired: Vec<(u64, Retired)>,
}

/// Kept only to be dropped later.
enum Retired {
    Sized(#[expect(dead_code, reason = "dropped in time")] Box<Sized>),
    Pipelines(#[expect(dead_code, reason = "dropped in time")] Vec<Arc<Pipeline>>),
    Denoiser(#[expect(dead_code, reason = "dropped in time")] Box<Denoiser>),
}

fn new_sized(gpu: &Arc<Shared>, plan: &Plan, pipelines: &Pipelines, options: &Options) -> Result<Sized, Error> {
    let resources = Resources::new(gpu, plan, options)?;
    let own_sets = OwnSets::new(gpu, plan, pipelines, &resources)?;
    Ok(Sized { resources, own_sets })
}

impl Denoiser {
    /// Creates pipelines and memory for images of up to `size` pixels.
    ///
    /// # Safety
    ///
    /// The handles of `gpu` and `options` belong together and stay valid until the denoiser is dropped. The
    /// extensions and features that `options` names are enabled, and `shaderStorageImageExtendedFormats`. What
    /// [`Options::spirv`] makes is valid and binds what it is said to.
    ///
    /// # Errors
    ///
    /// [`Error::Limpid`] for settings or size, [`Error::Unsupported`], [`Error::Limit`], [`Error::OutOfMemory`],
    /// [`Error::DeviceLost`], [`Error::Vulkan`]. What was made before the error is destroyed.
    pub unsafe fn new(
        gpu: Gpu<'_>,
        memory: Box<dyn MemorySource>,
        settings: &Settings,
        size: UVec2,
        options: Options,
    ) -> Result<Self, Error> {
        // SAFETY: the caller's promise.
        unsafe { Self::with_core(gpu, memory, limpid::Denoiser::new(settings, size)?, options) }
    }

    /// Carries out a plan that is ready.
    ///
    /// # Safety
    ///
    /// As [`new`](Self::new).
    ///
    /// # Errors
    ///
    /// As [`new`](Self::new).
    pub unsafe fn with_core(
        gpu: Gpu<'_>,
        memory: Box<dyn MemorySource>,
        core: limpid::Denoiser,
        options: Options,
    ) -> Result<Self, Error> {
        let synchronization = options.synchronization.clone();
        let shared = Shared::new(gpu, memory, synchronization, options.debug_utils.clone())?;
        Self::on(Arc::new(shared), core, options, Made::default())
    }

    fn on(
        gpu: Arc<Shared>,
        core: limpid::Denoiser,
        options: Options,
        mut made: Made<Arc<Pipeline>>,
    ) -> Result<Self, Error> {
        let frames_in_flight = options.frames_in_flight.max(1);
        let pipelines = Pipelines::new(&gpu, core.plan(), core.kernels(), &options, &mut made)?;
        let sized = new_sized(&gpu, core.plan(), &pipelines, &options)?;
        let alignment = gpu.limits.min_uniform_buffer_offset_alignment.max(1);
        let constants_stride = (size_of::<FrameConstants>() as u64).next_multiple_of(alignment);
        let size = constants_stride * frames_in_flight as u64;
        let constants = Buffer::for_upload(&gpu, "limpid.frame", size, vk::BufferUsageFlags::UNIFORM_BUFFER)?;
        let input_sets = InputSets::new(&gpu, &pipelines, &constants, constants_stride, frames_in_flight)?;
        let passes = core.plan().passes.len();
        let timing = options.timestamps.then(|| Timing::new(&gpu, passes, frames_in_flight)).transpose()?;
        Ok(Self {
            barriers: core.plan().barriers(),
            gpu,
            options,
            core,
            pipelines,
            made,
            sized,
            constants,
            constants_stride,
            input_sets,
            timing,
            frames: 0,
            needs_clear: true,
            recorded: Recorded::default(),
            retired: Vec::new(),
        })
    }

    fn frames_in_flight(&self) -> u64 {
        self.options.frames_in_flight.max(1) as u64
    }

    fn slot(&self) -> usize {
        (self.frames % self.frames_in_flight()) as usize
    }

    /// Allocates for another largest size. Pipelines stay, history is lost. What was allocated before is kept
    /// until so many more frames were recorded as can be in flight.
    ///
    /// # Errors
    ///
    /// As [`new`](Self::new); nothing changes then.
    pub fn resize(&mut self, size: UVec2) -> Result<(), Error> {
        let mut core = self.core.clone();
        core.resize(size)?;
        let sized = new_sized(&self.gpu, core.plan(), &self.pipelines, &self.options)?;
        let old = std::mem::replace(&mut self.sized, sized);
        self.retired.push((self.frames + self.frames_in_flight(), Retired::Sized(Box::new(old))));
        self.core = core;
        self.needs_clear = true;
        Ok(())
    }

    /// Changes settings. Takes effect with the next frame. Pipelines that were made before are used again:
    /// [`prepare`](Self::prepare) makes them ahead. Numbers, and features that change no binding, such as
    /// `near_taps`, keep history; others make resources anew and lose it. What was there before is kept as in
    /// [`resize`](Self::resize).
    ///
    /// # Errors
    ///
    /// As [`new`](Self::new); nothing changes then.
    pub fn set_settings(&mut self, settings: &Settings) -> Result<(), Error> {
        let mut core = self.core.clone();
        match core.set_settings(settings)? {
            Change::Constants => self.core = core,
            Change::Kernels => {
                let new = Pipelines::new(&self.gpu, core.plan(), core.kernels(), &self.options, &mut self.made)?;
                // Sets of inputs are written with the layouts they were allocated with, which are like the new ones.
                let old = std::mem::replace(&mut self.pipelines.passes, new.passes);
                self.retired.push((self.frames + self.frames_in_flight(), Retired::Pipelines(old)));
                self.core = core;
            }
            Change::Plan => {
                let new = Self::on(Arc::clone(&self.gpu), core, self.options.clone(), self.made.clone())?;
                let mut old = std::mem::replace(self, new);
                self.retired = std::mem::take(&mut old.retired);
                // From here on frames are counted from 0 again.
                self.retired.iter_mut().for_each(|(until, _)| *until = until.saturating_sub(old.frames));
                self.retired.push((self.frames_in_flight(), Retired::Denoiser(Box::new(old))));
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
    /// As [`new`](Self::new).
    pub fn prepare(&mut self, settings: &Settings) -> Result<(), Error> {
        let (plan, kernels) = self.core.prepare(settings)?;
        Pipelines::new(&self.gpu, &plan, &kernels, &self.options, &mut self.made)?;
        self.made.keep(self.core.variants());
        Ok(())
    }

    /// How many pipelines are kept.
    pub fn pipelines(&self) -> usize {
        self.made.len()
    }

    /// Records a whole frame.
    ///
    /// # Safety
    ///
    /// - `commands` is being recorded, outside of a render pass, for a queue of the family given to
    ///   [`new`](Self::new), and is submitted once. Frames are executed in the order of their recording.
    /// - The device has finished the frame that was recorded [`Options::frames_in_flight`] frames ago.
    /// - Views and layouts of `inputs` are what they are said to be when `commands` is executed; what wrote the
    ///   images was made visible to `COMPUTE_SHADER`, `SHADER_READ`. They live until the device has finished.
    ///
    /// # Errors
    ///
    /// [`Error::Limpid`] for `frame`, or one of the `Input` errors. Nothing was recorded then.
    pub unsafe fn record(
        &mut self,
        commands: vk::CommandBuffer,
        inputs: &Inputs,
        frame: &FrameInputs,
    ) -> Result<(), Error> {
        // SAFETY: the caller's promise.
        unsafe {
            self.record_classify(commands, inputs, frame)?;
            self.record_denoise(commands, inputs)
        }
    }

    /// Records what comes before ray tracing: afterwards the [`ray_list`](Self::ray_list) can be traced. Reads
    /// normal, roughness and depth only.
    ///
    /// # Safety
    ///
    /// As [`record`](Self::record). The denoise stage may be recorded into another command buffer that is
    /// executed later.
    ///
    /// # Errors
    ///
    /// As [`record`](Self::record).
    pub unsafe fn record_classify(
        &mut self,
        commands: vk::CommandBuffer,
        inputs: &Inputs,
        frame: &FrameInputs,
    ) -> Result<(), Error> {
        inputs.check(self.core.plan().inputs(), frame.size, self.core.prev_size(frame))?;
        let schedule = self.core.next_frame(frame)?;
        self.frames += 1;
        self.retired.retain(|(until, _)| *until > self.frames);
        self.recorded = Recorded::default();
        // SAFETY: the device has finished the frame that used this part of the buffer and these queries.
        unsafe {
            let offset = self.slot() as u64 * self.constants_stride;
            self.constants.write(offset, bytemuck::bytes_of(&schedule.constants));
            if let Some(timing) = &self.timing {
                timing.reset(commands, self.slot());
            }
            if self.needs_clear {
                self.sized.resources.clear(&self.gpu, commands);
            }
            self.record_stage(Stage::Classify, commands, inputs, &schedule);
        }
        self.needs_clear = false;
        Ok(())
    }

    /// Records what comes after ray tracing.
    ///
    /// # Safety
    ///
    /// As [`record`](Self::record), with the same frame as in [`record_classify`](Self::record_classify).
    ///
    /// # Errors
    ///
    /// [`limpid::Error::Order`], or one of the `Input` errors. Nothing was recorded then.
    pub unsafe fn record_denoise(&mut self, commands: vk::CommandBuffer, inputs: &Inputs) -> Result<(), Error> {
        let schedule = self.core.started_frame()?.clone();
        let [size, prev_size] = [schedule.constants.size, schedule.constants.prev_size].map(UVec2::from_array);
        inputs.check(self.core.plan().inputs(), size, prev_size)?;
        // SAFETY: the caller's promise.
        unsafe { self.record_stage(Stage::Denoise, commands, inputs, &schedule) };
        self.core.finish_frame();
        Ok(())
    }

    /// # Safety
    ///
    /// As [`record`](Self::record).
    unsafe fn record_stage(
        &mut self,
        stage: Stage,
        commands: vk::CommandBuffer,
        inputs: &Inputs,
        schedule: &FrameSchedule,
    ) {
        let set = self.write_inputs(stage, inputs);
        let plan = self.core.plan();
        let passes = plan.passes.iter().enumerate().filter(|(_, pass)| pass.stage == stage);
        let mut is_first = true;
        let (gpu, mut recorded) = (&*self.gpu, self.recorded);
        gpu.labelled(commands, &format!("limpid {stage:?}"), || {
            for (index, pass) in passes {
                let batch = self.batch_before(index, stage == Stage::Classify && is_first);
                is_first = false;
                recorded.barriers += usize::from(batch.is_some());
                recorded.dispatches += 1;
                let groups = schedule.workgroups(&pass.grid);
                gpu.labelled(commands, &self.pipelines.passes[index].label, || {
                    // SAFETY: the caller's promise.
                    unsafe {
                        if let Some(batch) = batch {
                            batch.record(gpu, commands);
                        }
                        self.record_pass(index, commands, set, schedule.phase, groups, &pass.grid);
                    }
                });
            }
            if let Some(batch) = self.batch_after(stage) {
                recorded.barriers += 1;
                // SAFETY: the caller's promise.
                unsafe { batch.record(gpu, commands) };
            }
        });
        self.recorded = recorded;
    }

    /// Writes the descriptors of the caller's images.
    fn write_inputs(&mut self, stage: Stage, inputs: &Inputs) -> vk::DescriptorSet {
        let (slot, stage) = (self.slot(), stage_index(stage));
        let passes = &self.core.plan().passes;
        let resource_of = |binding: &Binding| {
            let bound = passes.iter().flat_map(|pass| &pass.bindings);
            let found = bound.clone().find(|bound| bound.group == 0 && bound.binding == binding.binding);
            found.map(|bound| bound.resource.clone())
        };
        let layout = &self.pipelines.inputs[stage];
        let written = self.input_sets.update(&self.gpu, slot, stage, layout, resource_of, inputs);
        self.recorded.descriptor_writes += written;
        self.input_sets.get(slot, stage)
    }

    /// What a pass has to wait for.
    fn batch_before(&self, pass: usize, is_first_of_frame: bool) -> Option<Batch> {
        let mut batch = Batch::default();
        if let Some(barrier) = self.barriers[pass] {
            batch.add_planned(barrier);
        }
        if is_first_of_frame {
            // The caller reads last frame's output and ray list.
            let mut before = Side::readers(self.options.reader_stages);
            if self.needs_clear {
                before = before.and(Side::TRANSFER);
            }
            batch.add(before, Side::KERNEL);
        }
        for image in self.sized.resources.first_used_by(pass) {
            batch.add(Side::KERNEL, Side::KERNEL);
            batch.discard(image);
        }
        (!batch.is_empty()).then_some(batch)
    }

    /// What the caller's readers have to wait for.
    fn batch_after(&self, stage: Stage) -> Option<Batch> {
        let has_results = stage == Stage::Denoise || self.core.ray_args_offset().is_some();
        has_results.then(|| {
            let mut batch = Batch::default();
            batch.add(Side::KERNEL, Side::readers(self.options.reader_stages));
            batch
        })
    }

    /// # Safety
    ///
    /// As [`record`](Self::record).
    unsafe fn record_pass(
        &self,
        index: usize,
        commands: vk::CommandBuffer,
        inputs: vk::DescriptorSet,
        phase: usize,
        groups: Option<[u32; 3]>,
        grid: &Grid,
    ) {
        let (device, pipeline, slot) = (&self.gpu.device, &self.pipelines.passes[index], self.slot());
        let sets = [inputs, self.sized.own_sets.get(index, phase)];
        let point = vk::PipelineBindPoint::COMPUTE;
        // SAFETY: the caller's promise; pipelines, sets and buffers are alive and fit each other.
        unsafe {
            if let Some(timing) = &self.timing {
                timing.write(commands, slot, index, false);
            }
            device.cmd_bind_pipeline(commands, point, pipeline.pipeline);
            device.cmd_bind_descriptor_sets(commands, point, pipeline.layout, 0, &sets, &[]);
            match (groups, grid) {
                (Some([x, y, z]), _) => device.cmd_dispatch(commands, x, y, z),
                (None, Grid::Indirect { resource, offset }) => {
                    if let Some(buffer) = self.sized.resources.buffer(self.core.plan(), resource) {
                        device.cmd_dispatch_indirect(commands, buffer.buffer, *offset);
                    }
                }
                (None, _) => {}
            }
            if let Some(timing) = &self.timing {
                timing.write(commands, slot, index, true);
            }
        }
    }

    /// The denoised image, `R16G16B16A16_SFLOAT` in the layout `GENERAL`: `rgb` radiance, `a` variance. After the
    /// recorded frame it is visible to [`Options::reader_stages`]; the next frame's commands wait for those stages
    /// before they overwrite it. Do not write it. It can be another image from frame to frame, one of two: ask for it
    /// after each.
    pub fn output(&self) -> OwnImage {
        let output = self.core.plan().output();
        output.and_then(|(name, copy)| self.intermediate_image(name, copy)).expect("every plan has an output")
    }

    /// The debug view, `R16G16B16A16_SFLOAT` in the layout `GENERAL`: linear colours, 0 to 1, as
    /// [`limpid::DebugView::legend`] explains them. Visible to [`Options::reader_stages`] from the end of the recorded
    /// frame until the next frame's commands, which wait for those stages. `None` unless the settings ask for one.
    pub fn debug_view(&self) -> Option<OwnImage> {
        self.intermediate_image(DEBUG_VIEW, Copy::Current)
    }

    /// The rays to trace, after [`record_classify`](Self::record_classify), visible to [`Options::reader_stages`].
    /// `None` unless the settings ask for a list.
    pub fn ray_list(&self) -> Option<RayList> {
        let (plan, resources) = (self.core.plan(), &self.sized.resources);
        let args_offset = self.core.ray_args_offset()?;
        let (rays, args) = (resources.buffer(plan, "rays")?, resources.buffer(plan, "args")?);
        Some(RayList { rays: rays.buffer, rays_size: rays.size, args: args.buffer, args_offset })
    }

    /// An image of the plan as it is after the frame recorded last; see [`Options::readable_intermediates`].
    pub fn intermediate_image(&self, resource: &str, copy: Copy) -> Option<OwnImage> {
        let plan = self.core.plan();
        let image = self.sized.resources.image(plan, resource, copy, self.core.phase())?;
        let limpid::resource::Kind::Texture { format, extent } = plan.resource(resource)?.kind else { return None };
        let format = crate::resources::image_format(format);
        Some(OwnImage { image: image.image, view: image.view, format, size: extent.of(plan.size) })
    }

    /// A buffer of the plan and its size in bytes; see [`Options::readable_intermediates`].
    pub fn intermediate_buffer(&self, resource: &str) -> Option<(vk::Buffer, u64)> {
        let buffer = self.sized.resources.buffer(self.core.plan(), resource)?;
        Some((buffer.buffer, buffer.size))
    }

    /// The time of each pass of the frame recorded last, once the device has finished it: `None` before, and
    /// without [`Options::timestamps`].
    ///
    /// # Errors
    ///
    /// [`Error::DeviceLost`] and others of Vulkan.
    pub fn read_times(&self) -> Result<Option<Vec<PassTime>>, Error> {
        let Some(timing) = self.timing.as_ref().filter(|_| self.frames > 0) else { return Ok(None) };
        timing.read(self.slot(), self.core.plan().passes.iter().map(|pass| pass.name.as_str()))
    }

    /// What was recorded for the last frame.
    pub fn recorded(&self) -> Recorded {
        self.recorded
    }

    /// Bytes of device memory that images and buffers take, without what was retired.
    pub fn allocated_bytes(&self) -> u64 {
        self.sized.resources.bytes()
    }

    /// What is allocated and dispatched.
    pub fn plan(&self) -> &Plan {
        self.core.plan()
    }
}
