//! The plan: every resource and pass of a denoiser as plain data, for backends to carry out.

use std::fmt;
use std::sync::Arc;

use glam::UVec2;
use serde::{Deserialize, Serialize};

use crate::Error;
use crate::frame::check_allocation;
use crate::kernel::{self, Kernel, Overrides, Sources};
use crate::passes::{
    ARGS_STRIDE, BLOCKS, EXPORTED, GBUFFER_OVERRIDES, GridTemplate, NEXT_BLOCKS, OTHER_BLOCKS, OUTPUT_VARIABLE,
    PassTemplate, SHARED_BINDINGS, all_resources, has_whole_blocks, override_value, resource_of, templates,
};
use crate::resource::Copy::{self, Previous};
use crate::resource::{Access, Kind, Lifetime, Resource, TILE_SIZE};
use crate::settings::Settings;
use crate::variants::Variants;

/// When in the frame a pass runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "export", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Stage {
    /// Before the renderer traces its rays.
    Classify,
    /// After.
    Denoise,
}

/// How many workgroups a pass has.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Grid {
    /// One.
    One,
    /// One for each square of the frame's size.
    Squares {
        /// Pixels of its side.
        side: u32,
    },
    /// Three `u32` in a buffer, written on the GPU.
    Indirect {
        /// Name of the buffer.
        resource: String,
        /// Where in it, in bytes.
        offset: u64,
    },
}

/// A resource bound to a variable of a kernel.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Bound {
    /// Name of the variable.
    pub variable: String,
    /// Bind group: 0 for what the caller supplies, 1 for what limpid owns.
    pub group: u32,
    /// Number in the group.
    pub binding: u32,
    /// Name of the resource.
    pub resource: String,
    /// Which copy of it.
    pub copy: Copy,
    /// How the kernel uses it.
    pub access: Access,
}

/// One dispatch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Pass {
    /// Name, unique in the plan; also that of the entry point.
    pub name: String,
    /// Name of the kernel's file, `kernels/KERNEL.wgsl`. A plan can use one more than once.
    pub kernel: String,
    /// When it runs.
    pub stage: Stage,
    /// Values of the kernel's override constants; others keep their defaults.
    pub overrides: Overrides,
    /// Workgroups.
    pub grid: Grid,
    /// Resources, by group and number.
    pub bindings: Vec<Bound>,
}

/// Every resource and pass of a denoiser, in the order of execution.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// Largest image, in pixels.
    pub size: UVec2,
    /// What must be allocated or supplied.
    pub resources: Vec<Resource>,
    /// Dispatches in order.
    pub passes: Vec<Pass>,
}

/// Name of the texture that holds the debug view.
pub const DEBUG_VIEW: &str = crate::passes::DEBUG_VIEW;

/// Passes that read a resource and write it take turns with two of them.
#[derive(Default)]
struct Turns {
    /// Whether `other_blocks` was written last.
    other: bool,
}

impl Turns {
    fn take(&mut self, bindings: &mut [Bound]) {
        let last = self.other;
        // A pass that writes both clears them.
        if bindings.iter().any(|bound| bound.resource == OTHER_BLOCKS) {
            return;
        }
        for bound in bindings {
            let is_ahead = bound.resource == NEXT_BLOCKS;
            if !is_ahead && bound.resource != BLOCKS {
                continue;
            }
            let writes = bound.access.writes();
            bound.resource = if writes == last { BLOCKS } else { OTHER_BLOCKS }.to_owned();
            self.other ^= writes && !is_ahead;
        }
    }
}

fn plan_pass<K: AsRef<Kernel>>(
    template: &PassTemplate,
    settings: &Settings,
    sources: &Sources,
    make: &mut impl FnMut(&PassTemplate, &Overrides) -> Result<K, Error>,
) -> Result<(Pass, K), Error> {
    let linked = kernel::link(template.kernel, sources)?;
    let shared = GBUFFER_OVERRIDES.iter().filter(|name| linked.text.contains(&format!("override {name}:")));
    let names = template.overrides.iter().chain(shared);
    let overrides: Overrides = names.map(|&name| (name.to_owned(), override_value(settings, name))).collect();
    let made = make(template, &overrides)?;
    let kernel = made.as_ref();
    let mut bindings = Vec::new();
    for binding in &kernel.bindings {
        let (resource, copy) = template
            .bindings
            .iter()
            .chain(SHARED_BINDINGS)
            .find(|(variable, ..)| *variable == binding.name)
            .map(|&(_, resource, copy)| resource_of(settings.pipeline, resource, copy))
            .ok_or_else(|| Error::Kernel {
                kernel: template.kernel,
                stage: "plan",
                report: format!("no resource is known for `{}`", binding.name),
            })?;
        bindings.push(Bound {
            variable: binding.name.clone(),
            group: binding.group,
            binding: binding.binding,
            resource: resource.to_owned(),
            copy,
            access: binding.kind.access(),
        });
    }
    let list = |resource: &str, index| Grid::Indirect { resource: resource.to_owned(), offset: index * ARGS_STRIDE };
    let grid = match template.grid {
        GridTemplate::One => Grid::One,
        GridTemplate::Tiles(tiles) => Grid::Squares { side: tiles * TILE_SIZE },
        GridTemplate::List(index) => list("args", index),
        GridTemplate::Blocks(index) => list("block_args", index),
        GridTemplate::Quads if has_whole_blocks(settings) => list("block_args", 0),
        GridTemplate::Quads => list("args", 4),
        GridTemplate::OtherBlocks if has_whole_blocks(settings) => list("block_args", 3),
        GridTemplate::OtherBlocks => list("args", 3),
    };
    let (name, kernel_name) = (template.name.to_owned(), template.kernel.to_owned());
    let pass = Pass { name, kernel: kernel_name, stage: template.stage, overrides, grid, bindings };
    Ok((pass, made))
}

impl Plan {
    /// The plan for `settings`, for images of up to `size` pixels, and the kernel of each pass.
    ///
    /// Resources that no kernel uses after specialisation are not part of it.
    ///
    /// # Errors
    ///
    /// [`Error::Setting`] and [`Error::Size`]; [`Error::Kernel`] would be a defect of limpid.
    pub fn new(settings: &Settings, size: UVec2) -> Result<(Self, Vec<Kernel>), Error> {
        Self::from_sources(settings, size, &Sources::BuiltIn)
    }

    /// The same with kernels from other sources.
    ///
    /// # Errors
    ///
    /// As [`Plan::new`]; [`Error::Kernel`] with file and line for mistakes in the sources.
    pub fn from_sources(settings: &Settings, size: UVec2, sources: &Sources) -> Result<(Self, Vec<Kernel>), Error> {
        Self::with_kernels(settings, size, sources, |template, overrides| {
            Ok(Kernel::from_sources(template.kernel, overrides, sources)?.renamed(template.name))
        })
    }

    /// The same with the built-in kernels, those taken from `variants` that it has.
    pub(crate) fn from_variants(
        settings: &Settings,
        size: UVec2,
        variants: &mut Variants,
    ) -> Result<(Self, Vec<Arc<Kernel>>), Error> {
        Self::with_kernels(settings, size, &Sources::BuiltIn, |template, overrides| {
            variants.kernel(template.name, template.kernel, overrides)
        })
    }

    fn with_kernels<K: AsRef<Kernel>>(
        settings: &Settings,
        size: UVec2,
        sources: &Sources,
        mut make: impl FnMut(&PassTemplate, &Overrides) -> Result<K, Error>,
    ) -> Result<(Self, Vec<K>), Error> {
        settings.validate()?;
        check_allocation(size)?;
        let mut passes = Vec::new();
        let mut kernels = Vec::new();
        let mut turns = Turns::default();
        for template in templates(settings.pipeline).into_iter().filter(|template| (template.is_needed)(settings)) {
            let (mut pass, kernel) = plan_pass(template, settings, sources, &mut make)?;
            turns.take(&mut pass.bindings);
            passes.push(pass);
            kernels.push(kernel);
        }
        let is_used = |name: &str| {
            passes.iter().any(|pass| {
                let indirect = matches!(&pass.grid, Grid::Indirect { resource, .. } if resource == name);
                indirect || pass.bindings.iter().any(|bound| bound.resource == name)
            })
        };
        let resources = all_resources().into_iter().filter(|resource| is_used(&resource.name)).collect();
        let mut plan = Self { size, resources, passes };
        plan.settle_lives();
        Ok((plan, kernels))
    }

    /// Keeps no pair of which nobody uses last frame's copy, and notes what the caller reads.
    fn settle_lives(&mut self) {
        let output = self.output().map(|(resource, _)| resource.to_owned());
        let bindings = self.passes.iter().flat_map(|pass| &pass.bindings);
        for resource in &mut self.resources {
            if resource.ping_pong && !bindings.clone().any(|b| b.resource == resource.name && b.copy == Previous) {
                (resource.ping_pong, resource.lifetime) = (false, Lifetime::Transient);
            }
            resource.exported = EXPORTED.contains(&resource.name.as_str()) || Some(&resource.name) == output.as_ref();
        }
    }

    /// Whether the plans differ in values of override constants at most: resources and bindings are the same.
    pub fn is_like(&self, other: &Self) -> bool {
        let is_like = |a: &Pass, b: &Pass| Pass { overrides: b.overrides.clone(), ..a.clone() } == *b;
        self.size == other.size
            && self.resources == other.resources
            && self.passes.len() == other.passes.len()
            && self.passes.iter().zip(&other.passes).all(|(a, b)| is_like(a, b))
    }

    /// The denoised image when a frame has run: resource and copy. `None` for a plan without one.
    pub fn output(&self) -> Option<(&str, Copy)> {
        let mut bindings = self.passes.iter().flat_map(|pass| &pass.bindings);
        let bound = bindings.find(|bound| bound.variable == OUTPUT_VARIABLE)?;
        Some((&bound.resource, bound.copy))
    }

    /// The resource of that name.
    pub fn resource(&self, name: &str) -> Option<&Resource> {
        self.resources.iter().find(|resource| resource.name == name)
    }

    /// Names of the images that the caller has to supply.
    pub fn inputs(&self) -> impl Iterator<Item = &str> {
        self.resources.iter().filter(|resource| resource.kind == Kind::Input).map(|resource| resource.name.as_str())
    }
}

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}x{}, {:.2} bytes per pixel", self.size.x, self.size.y, self.bytes_per_pixel())?;
        for resource in &self.resources {
            let kind = match resource.kind {
                Kind::Constants => "constants".to_owned(),
                Kind::Input => "input".to_owned(),
                Kind::Texture { format, extent } => format!("{format:?} {extent:?}"),
                Kind::Buffer { stride, count, .. } => format!("{} x {stride} bytes", count.of(self.size)),
            };
            let pair = if resource.ping_pong { " pair" } else { "" };
            writeln!(f, "  {:<15}{:?} {kind}{pair}", resource.name, resource.lifetime)?;
        }
        for pass in &self.passes {
            let grid = match &pass.grid {
                Grid::One => "one workgroup".to_owned(),
                Grid::Squares { side } => format!("a workgroup per {side}x{side} pixels"),
                Grid::Indirect { resource, offset } => format!("indirect from {resource} + {offset}"),
            };
            writeln!(f, "{} ({:?}), {grid}", pass.name, pass.stage)?;
            for bound in &pass.bindings {
                let arrow = match bound.access {
                    Access::Read => "<-",
                    Access::Write => "->",
                    Access::ReadWrite => "<>",
                };
                let copy = if bound.copy == Previous { ", last frame's" } else { "" };
                writeln!(
                    f,
                    "  {}.{} {:<16}{arrow} {}{copy}",
                    bound.group, bound.binding, bound.variable, bound.resource
                )?;
            }
        }
        Ok(())
    }
}
