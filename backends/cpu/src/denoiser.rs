use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use glam::UVec2;
use limpid::kernel::Kernel;
use limpid::plan::{Bound, DEBUG_VIEW, Grid, Pass, Stage};
use limpid::resource::{Copy, Format, Kind, Lifetime, input_size};
use limpid::variants::Made;
use limpid::{Change, FrameConstants, FrameInputs, FrameSchedule, Plan, Settings};

use crate::{Binding, Buffer, CompileError, Error, Executor, Fault, Probe, TexelFormat, Texture};

/// Last frame's G-buffer, encoded as this frame's and as large as that frame was. In the first frame, after a camera cut
/// and after a resize it may be anything of any size.
#[derive(Debug, Clone, Copy)]
pub struct PrevGbuffer<'a> {
    /// World-space normal.
    pub normal: &'a Texture,
    /// Roughness, in the channel that the settings name.
    pub roughness: &'a Texture,
    /// Depth.
    pub depth: &'a Texture,
}

/// The caller's images of one frame, of any format. Encodings are set in
/// [`Settings::conventions`](limpid::settings::Conventions).
///
/// What the settings leave out, such as `normal` without the feature `normal_input`, is not looked at: anything will do there.
#[derive(Debug, Clone, Copy)]
pub struct Inputs<'a> {
    /// `rgb`: noisy radiance, `a`: hit distance.
    pub radiance: &'a Texture,
    /// World-space normal.
    pub normal: &'a Texture,
    /// Roughness, in the channel that the settings name.
    pub roughness: &'a Texture,
    /// Depth.
    pub depth: &'a Texture,
    /// Motion vectors in the first two channels.
    pub motion: &'a Texture,
    /// World-space motion of what was hit, in `rgb`. Only for the feature `hit_motion`.
    pub hit_motion: Option<&'a Texture>,
    /// Equirectangular radiance with its mip chain. Only for `Fallback::Environment`.
    pub environment: Option<&'a Texture>,
    /// Last frame's G-buffer. Only without the feature `gbuffer_copy`.
    pub previous: Option<PrevGbuffer<'a>>,
}

impl<'a> Inputs<'a> {
    fn get(&self, name: &str) -> Option<&'a Texture> {
        match name {
            "radiance" => Some(self.radiance),
            "normal" => Some(self.normal),
            "roughness" => Some(self.roughness),
            "depth" => Some(self.depth),
            "motion" => Some(self.motion),
            "hit_motion" => self.hit_motion,
            "environment" => self.environment,
            "prev_normal" => self.previous.map(|previous| previous.normal),
            "prev_roughness" => self.previous.map(|previous| previous.roughness),
            "prev_depth" => self.previous.map(|previous| previous.depth),
            _ => None,
        }
    }

    fn check<'n>(&self, names: impl Iterator<Item = &'n str>, size: UVec2, prev_size: UVec2) -> Result<(), Error> {
        for name in names {
            let missing = || Error::InputMissing { input: name.to_owned() };
            let actual = UVec2::from_array(self.get(name).ok_or_else(missing)?.size());
            let expected = input_size(name, size, prev_size);
            if actual.cmplt(expected).any() {
                return Err(Error::InputSize { input: name.to_owned(), actual, expected });
            }
        }
        Ok(())
    }
}

/// A resource of the plan, one entry for each copy.
enum Allocation {
    Textures(Vec<Texture>),
    Buffer(Buffer),
}

/// A denoiser on the CPU.
pub struct Denoiser {
    core: limpid::Denoiser,
    executors: Vec<Arc<Executor>>,
    /// The compiled form of all kernels that the core keeps.
    made: Made<Arc<Executor>>,
    allocations: HashMap<String, Allocation>,
    constants: Buffer,
    /// Faults by kernel, when kernels are watched.
    faults: Option<Vec<(&'static str, Fault)>>,
    /// What the probe saw, by kernel, when it is in use.
    probes: Option<BTreeMap<&'static str, Probe>>,
}

fn texel_format(format: Format) -> TexelFormat {
    match format {
        Format::Rgba16Float => TexelFormat::Rgba16Float,
        Format::Rgba32Uint => TexelFormat::Rgba32Uint,
        Format::Rg32Uint => TexelFormat::Rg32Uint,
        Format::R32Uint => TexelFormat::R32Uint,
    }
}

fn allocate(plan: &Plan) -> HashMap<String, Allocation> {
    let allocate = |kind, ping_pong| match kind {
        Kind::Texture { format, extent } => {
            let size = extent.of(plan.size);
            let texture = || Texture::new(texel_format(format), size.x, size.y);
            Some(Allocation::Textures((0..=usize::from(ping_pong)).map(|_| texture()).collect()))
        }
        Kind::Buffer { stride, count, .. } => {
            Some(Allocation::Buffer(Buffer::zeroed((stride / 4 * count.of(plan.size)) as usize)))
        }
        Kind::Constants | Kind::Input => None,
    };
    let named = plan.resources.iter().map(|r| (r.name.clone(), allocate(r.kind, r.ping_pong)));
    named.filter_map(|(name, allocation)| Some((name, allocation?))).collect()
}

fn find_texture<'a>(
    plan: &Plan,
    allocations: &'a HashMap<String, Allocation>,
    name: &str,
    copy: Copy,
    phase: usize,
) -> Option<&'a Texture> {
    match allocations.get(name)? {
        Allocation::Textures(textures) => textures.get(copy.index(plan.resource(name)?.ping_pong, phase)),
        Allocation::Buffer(_) => None,
    }
}

fn compile(kernel: &Kernel) -> Result<Executor, Error> {
    Executor::new(&kernel.module, &kernel.info, kernel.name).map_err(|source| {
        let offset = if let CompileError::Unsupported { offset, .. } = source { offset } else { None };
        let place = offset.and_then(|offset| kernel.linked.place(offset));
        let place = place.unwrap_or_else(|| format!("kernels/{}.wgsl", kernel.file));
        Error::Compile { kernel: kernel.name, place, source }
    })
}

/// The compiled form of kernels: those of `made`, and new ones that are kept there.
fn executors(kernels: &[Arc<Kernel>], made: &mut Made<Arc<Executor>>) -> Result<Vec<Arc<Executor>>, Error> {
    kernels.iter().map(|kernel| made.get_or_make(kernel, |_| true, |kernel| compile(kernel).map(Arc::new))).collect()
}

impl Denoiser {
    /// Compiles kernels and allocates memory for images of up to `size` pixels.
    ///
    /// # Errors
    ///
    /// [`Error::Limpid`] for settings or size; [`Error::Compile`] would be a defect of limpid.
    pub fn new(settings: &Settings, size: UVec2) -> Result<Self, Error> {
        Self::with_core(limpid::Denoiser::new(settings, size)?)
    }

    /// Carries out a plan that is ready.
    ///
    /// # Errors
    ///
    /// [`Error::Compile`].
    pub fn with_core(core: limpid::Denoiser) -> Result<Self, Error> {
        Self::with_executors(core, Made::default())
    }

    fn with_executors(core: limpid::Denoiser, mut made: Made<Arc<Executor>>) -> Result<Self, Error> {
        let executors = executors(core.kernels(), &mut made)?;
        let allocations = allocate(core.plan());
        let constants = Buffer::zeroed(size_of::<FrameConstants>() / 4);
        Ok(Self { core, executors, made, allocations, constants, faults: None, probes: None })
    }

    /// What is allocated and dispatched.
    pub fn plan(&self) -> &Plan {
        self.core.plan()
    }

    /// Allocates for another largest size. Compiled kernels stay, history is lost.
    ///
    /// # Errors
    ///
    /// [`Error::Limpid`]; nothing changes then.
    pub fn resize(&mut self, size: UVec2) -> Result<(), Error> {
        self.core.resize(size)?;
        self.allocations = allocate(self.core.plan());
        Ok(())
    }

    /// Changes settings. Takes effect with the next frame. Kernels that were compiled before are used again. Numbers,
    /// and features that change no binding, such as `near_taps`, keep history; others make all memory anew.
    ///
    /// # Errors
    ///
    /// As [`Denoiser::new`]; nothing changes then.
    pub fn set_settings(&mut self, settings: &Settings) -> Result<(), Error> {
        let mut core = self.core.clone();
        match core.set_settings(settings)? {
            Change::Constants => self.core = core,
            Change::Kernels => {
                self.executors = executors(core.kernels(), &mut self.made)?;
                self.core = core;
            }
            Change::Plan => {
                let new = Self::with_executors(core, self.made.clone())?;
                let (faults, probes) = (self.faults.take(), self.probes.take());
                *self = Self { faults, probes, ..new };
            }
        }
        self.made.keep(self.core.variants());
        Ok(())
    }

    /// Compiles kernels for settings that may be set later.
    ///
    /// # Errors
    ///
    /// As [`Denoiser::new`].
    pub fn prepare(&mut self, settings: &Settings) -> Result<(), Error> {
        let (_, kernels) = self.core.prepare(settings)?;
        executors(&kernels, &mut self.made)?;
        self.made.keep(self.core.variants());
        Ok(())
    }

    /// Denoises a frame.
    ///
    /// # Errors
    ///
    /// [`Error::Limpid`] for `frame`, or one of the `Input` errors. Nothing has happened then.
    pub fn denoise(&mut self, inputs: &Inputs<'_>, frame: &FrameInputs) -> Result<(), Error> {
        self.run_classify(inputs, frame)?;
        self.run_denoise(inputs)
    }

    /// Runs what comes before ray tracing: afterwards the [`ray_list`](Self::ray_list) can be traced. Looks at
    /// normal, roughness and depth only.
    ///
    /// # Errors
    ///
    /// As [`denoise`](Self::denoise).
    pub fn run_classify(&mut self, inputs: &Inputs<'_>, frame: &FrameInputs) -> Result<(), Error> {
        inputs.check(self.core.plan().inputs(), frame.size, self.core.prev_size(frame))?;
        let schedule = self.core.next_frame(frame)?;
        self.constants.write(bytemuck::cast_slice(&[schedule.constants]).iter().copied());
        self.run_stage(Stage::Classify, inputs, &schedule)
    }

    /// Runs what comes after ray tracing, with the inputs of [`run_classify`](Self::run_classify).
    ///
    /// # Errors
    ///
    /// [`limpid::Error::Order`], or one of the `Input` errors.
    pub fn run_denoise(&mut self, inputs: &Inputs<'_>) -> Result<(), Error> {
        let schedule = self.core.started_frame()?.clone();
        let [size, prev_size] = [schedule.constants.size, schedule.constants.prev_size].map(UVec2::from_array);
        inputs.check(self.core.plan().inputs(), size, prev_size)?;
        self.run_stage(Stage::Denoise, inputs, &schedule)?;
        self.core.finish_frame();
        Ok(())
    }

    fn run_stage(&mut self, stage: Stage, inputs: &Inputs<'_>, schedule: &FrameSchedule) -> Result<(), Error> {
        let passes = self.core.plan().passes.iter().zip(&self.executors).zip(self.core.kernels());
        let mut found = Vec::new();
        let mut probed = Vec::new();
        for ((pass, executor), kernel) in passes.filter(|((pass, _), _)| pass.stage == stage) {
            let bindings: Vec<_> =
                pass.bindings.iter().filter_map(|bound| self.binding(bound, inputs, schedule.phase)).collect();
            let groups = self.workgroups(pass, schedule);
            if self.faults.is_some() {
                found.extend(
                    executor.dispatch_checked(groups, &bindings)?.into_iter().map(|fault| (kernel.name, fault)),
                );
            } else if self.probes.is_some() {
                probed.push((kernel.name, executor.dispatch_probed(groups, &bindings)?));
            } else {
                executor.dispatch(groups, &bindings)?;
            }
        }
        if let Some(probes) = &mut self.probes {
            probed.into_iter().for_each(|(kernel, probe)| probes.entry(kernel).or_default().merge(probe));
        }
        if let Some(faults) = &mut self.faults {
            faults.extend(found);
        }
        Ok(())
    }

    /// Makes functions as inexact as Vulkan lets devices be; see [`Executor::with_inexact_functions`]. Lasts until a
    /// change of settings that changes kernels.
    pub fn make_inexact(&mut self, seed: u32) {
        for executor in &mut self.executors {
            *executor = Arc::new(Executor::clone(executor).with_inexact_functions(seed));
        }
    }

    /// From now on runs kernels one workgroup after another and watches them; see
    /// [`Executor::dispatch_checked`].
    pub fn watch(&mut self) {
        self.faults = Some(Vec::new());
    }

    /// What kernels did that they must not, since [`watch`](Self::watch): kernel, place in its source as
    /// `file:line`, and fault.
    pub fn faults(&self) -> impl Iterator<Item = (&'static str, String, &Fault)> {
        self.faults.iter().flatten().map(|(name, fault)| (*name, self.place(name, fault.offset), fault))
    }

    /// From now on runs kernels one workgroup after another and watches what happens to numbers; see
    /// [`Executor::dispatch_probed`].
    pub fn probe(&mut self) {
        self.probes = Some(BTreeMap::new());
    }

    /// What the probe saw of each kernel since [`probe`](Self::probe). [`place`](Self::place) tells lines.
    pub fn probes(&self) -> impl Iterator<Item = (&'static str, &Probe)> {
        self.probes.iter().flatten().map(|(kernel, probe)| (*kernel, probe))
    }

    /// Place in a kernel's source as `file:line`; empty where it is not known.
    pub fn place(&self, kernel: &str, offset: Option<usize>) -> String {
        let kernel = self.core.kernels().iter().find(|other| other.name == kernel);
        kernel.zip(offset).and_then(|(kernel, offset)| kernel.linked.place(offset)).unwrap_or_default()
    }

    fn workgroups(&self, pass: &Pass, schedule: &FrameSchedule) -> [u32; 3] {
        match (schedule.workgroups(&pass.grid), &pass.grid) {
            (Some(groups), _) => groups,
            (None, Grid::Indirect { resource, offset }) => {
                let word = |i: u64| match self.allocations.get(resource) {
                    Some(Allocation::Buffer(buffer)) => buffer.get((offset / 4 + i) as u32),
                    _ => 0,
                };
                [word(0), word(1), word(2)]
            }
            (None, _) => [0; 3],
        }
    }

    fn binding<'a>(&'a self, bound: &Bound, inputs: &Inputs<'a>, phase: usize) -> Option<Binding<'a>> {
        let Bound { group, binding, resource, copy, .. } = bound;
        if resource == "frame" {
            return Some(Binding::buffer(*group, *binding, &self.constants));
        }
        if let Some(Allocation::Buffer(buffer)) = self.allocations.get(resource) {
            return Some(Binding::buffer(*group, *binding, buffer));
        }
        let texture = inputs.get(resource).or_else(|| self.intermediate_texture_in(resource, *copy, phase))?;
        Some(Binding::texture(*group, *binding, texture))
    }

    fn intermediate_texture_in(&self, name: &str, copy: Copy, phase: usize) -> Option<&Texture> {
        find_texture(self.core.plan(), &self.allocations, name, copy, phase)
    }

    /// Fills everything that lives within a frame with a word, as other work would that shares its memory: what comes
    /// out must be the same.
    pub fn overwrite_transient(&mut self, word: u32) {
        let transient = self.core.plan().resources.iter().filter(|resource| resource.lifetime == Lifetime::Transient);
        for resource in transient {
            match self.allocations.get_mut(&resource.name) {
                Some(Allocation::Textures(textures)) => {
                    textures.iter_mut().for_each(|texture| texture.write(std::iter::repeat(word)));
                }
                Some(Allocation::Buffer(buffer)) => buffer.write(std::iter::repeat(word)),
                None => {}
            }
        }
    }

    /// The denoised image of the last frame: `rgb` radiance, `a` variance. It can be another texture from frame to frame.
    pub fn output(&self) -> &Texture {
        let output = self.core.plan().output();
        output.and_then(|(name, copy)| self.intermediate_texture(name, copy)).expect("every plan has an output")
    }

    /// The debug view of the last frame: linear colours, 0 to 1, as [`limpid::DebugView::legend`] explains them. `None`
    /// unless the settings ask for one.
    pub fn debug_view(&self) -> Option<&Texture> {
        self.intermediate_texture(DEBUG_VIEW, Copy::Current)
    }

    /// A texture of the plan as it is after the last frame.
    pub fn intermediate_texture(&self, resource: &str, copy: Copy) -> Option<&Texture> {
        self.intermediate_texture_in(resource, copy, self.core.phase())
    }

    /// A buffer of the plan as it is after the last frame.
    pub fn intermediate_buffer(&self, resource: &str) -> Option<&Buffer> {
        match self.allocations.get(resource)? {
            Allocation::Buffer(buffer) => Some(buffer),
            Allocation::Textures(_) => None,
        }
    }

    /// The rays to trace, after [`run_classify`](Self::run_classify), as `kernels/classify.wgsl` packs them.
    /// `None` unless the settings ask for a list.
    pub fn ray_list(&self) -> Option<Vec<u32>> {
        let count_word = self.core.ray_args_offset()? / 4 + 3;
        let count = self.intermediate_buffer("args")?.get(count_word as u32);
        let mut rays = self.intermediate_buffer("rays")?.read();
        rays.truncate(count as usize);
        Some(rays)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_supported_is_named_with_kernel_file_and_line() {
        let core = limpid::Denoiser::new(&Settings::default(), UVec2::new(64, 64)).unwrap();
        for kernel in core.kernels() {
            assert!(compile(kernel).is_ok());
            // Texture after texture becomes one of three dimensions.
            for (handle, variable) in kernel.module.global_variables.iter() {
                let naga::TypeInner::Image { class, arrayed, .. } = kernel.module.types[variable.ty].inner else {
                    continue;
                };
                let mut changed = Kernel::clone(kernel);
                let inner = naga::TypeInner::Image { dim: naga::ImageDimension::D3, class, arrayed };
                let ty = changed.module.types.insert(naga::Type { name: None, inner }, naga::Span::UNDEFINED);
                changed.module.global_variables[handle].ty = ty;
                let name = variable.name.as_deref().unwrap();
                let error = compile(&changed).err().unwrap();
                let Error::Compile { kernel: named, place, .. } = &error else { panic!("{error}") };
                assert_eq!(*named, kernel.name);
                let (file, line) = place.split_once(':').unwrap();
                let text = std::fs::read_to_string(format!("../../{file}")).unwrap();
                let line = text.lines().nth(line.parse::<usize>().unwrap() - 1).unwrap();
                assert!(line.contains("var") && line.contains(name), "{place}: {line}, expected {name}");
                assert!(error.to_string().contains(&format!("{}`, {place}: ", kernel.name)), "{error}");
                assert!(error.to_string().contains(&format!("`{name}`")), "{error}");
            }
        }
    }
}
