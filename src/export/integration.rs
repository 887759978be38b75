//! INTEGRATION.md: how to put an export to work, from the same data as the manifest.

use std::fmt::Write;

use super::manifest::{BindingEntry, GridEntry, Manifest, OutputEntry, PassEntry, ResourceEntry, ResourceKind};
use super::{Export, MANIFEST, Target};
use crate::plan::{DEBUG_VIEW, Stage};
use crate::resource::{Copy, Lifetime};
use crate::settings::{DepthEncoding, NormalEncoding, RoughnessEncoding};
use crate::synchronization::{Barrier, Scope};
use crate::{DebugView, Key};

/// What is said of a language's API.
struct Words {
    api: &'static str,
    /// Making a pipeline of a pass.
    pipeline: &'static str,
    /// Binding its resources.
    bind: &'static str,
    /// Separating passes.
    barrier: &'static str,
    /// Clearing in the first frame.
    clear: &'static str,
    /// Dispatching from a buffer.
    indirect: &'static str,
}

fn words(target: Target) -> Words {
    match target {
        Target::Hlsl => Words {
            api: "Direct3D 12",
            pipeline: "Compile each file with `dxc -T cs_6_0 -E <pass>` (the profile is in the manifest's options; `-enable-16bit-types` for 6.2; FXC takes 5.1). The macro `<PASS>_ROOT_SIGNATURE` in the file is its root signature: a constant buffer view at the root and one table, in the order that the macro lists; export with `--hlsl-root-signature` to have it on the entry point.",
            bind: "Fill the descriptor table in the order of the root signature. Two tables a pass, one for even and one for odd frames, serve all frames.",
            barrier: "A barrier is `D3D12_RESOURCE_BARRIER_TYPE_UAV` without a resource where both sides write or read through `u` registers, and a transition to the states in the tables below where a resource changes between `t` and `u`. With enhanced barriers: one global barrier, compute to compute, and to indirect arguments where it says so.",
            clear: "`ClearUnorderedAccessViewUint` with zeros",
            indirect: "`ExecuteIndirect` with a signature of one `D3D12_INDIRECT_ARGUMENT_TYPE_DISPATCH`",
        },
        Target::Spirv => Words {
            api: "Vulkan",
            pipeline: "Make a compute pipeline of each module; its entry point is the pass's name. Set 0 holds the constants and your images, set 1 what limpid owns. Vulkan 1.0 will do, with the device feature `shaderStorageImageExtendedFormats` for `rg32ui`.",
            bind: "Two sets of group 1 a pass, one for even and one for odd frames, serve all frames.",
            barrier: "A barrier is one `vkCmdPipelineBarrier` with a `VkMemoryBarrier`, compute stage to compute stage, and to `VK_PIPELINE_STAGE_DRAW_INDIRECT_BIT` with `VK_ACCESS_INDIRECT_COMMAND_READ_BIT` where it says so. Keep limpid's images in `VK_IMAGE_LAYOUT_GENERAL`: no layout transitions are needed then.",
            clear: "`vkCmdClearColorImage` and `vkCmdFillBuffer` with zeros",
            indirect: "`vkCmdDispatchIndirect`",
        },
        Target::Msl => Words {
            api: "Metal",
            pipeline: "Compile the files into one library (`xcrun metal`), turn fast math off if you compare with other platforms, and make a compute pipeline of each function.",
            bind: "Bind buffers and textures at the indices below.",
            barrier: "With tracked resources Metal inserts barriers by itself inside a serial encoder; for a concurrent encoder or untracked heaps a barrier is `memoryBarrierWithScope:` for buffers and textures.",
            clear: "a blit encoder's `fillBuffer`, and zeros written to textures,",
            indirect: "`dispatchThreadgroupsWithIndirectBuffer:indirectBufferOffset:threadsPerThreadgroup:`",
        },
        Target::Glsl => Words {
            api: "OpenGL 4.5 or Vulkan",
            pipeline: "Compile each file as a compute shader; its entry point is `main`. Export with `--glsl-dialect vulkan` for sets and bindings.",
            bind: "Texture units, image units, uniform buffers and storage buffers are numbered apart. In OpenGL set textures to `GL_NEAREST`: texels are fetched, never filtered.",
            barrier: "A barrier is `glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT | GL_SHADER_IMAGE_ACCESS_BARRIER_BIT)`, with `GL_COMMAND_BARRIER_BIT` where it says grids.",
            clear: "`glClearTexImage` and `glClearNamedBufferData` without data",
            indirect: "`glDispatchComputeIndirect`",
        },
        Target::Wgsl => Words {
            api: "WebGPU",
            pipeline: "Make a compute pipeline of each module; its entry point is the pass's name. Default limits suffice. Layouts have to be explicit: float textures are `unfilterable-float`.",
            bind: "Two bind groups a pass, one for even and one for odd frames, serve all frames.",
            barrier: "WebGPU synchronises by itself; the barriers below are for information.",
            clear: "nothing: WebGPU clears by itself",
            indirect: "`dispatchWorkgroupsIndirect`",
        },
    }
}

impl Export<'_> {
    /// The page for one language.
    pub(super) fn integration(&self, target: Target) -> String {
        let manifest = self.manifest(&[]);
        let words = words(target);
        let mut page = format!(
            "# limpid {} in {}\n\nSettings {}. Everything on this page is also in `{MANIFEST}`, for programs; the constants are in `limpid.h`.\n\n",
            manifest.limpid_version, words.api, manifest.settings_hash
        );
        page += &self.steps(&manifest, &words);
        page += &resource_table(&manifest, target);
        page += &self.debug_view_legend();
        page += "## Passes\n\n";
        let _ = write!(page, "{} {}\n\n", words.bind, words.barrier);
        manifest.passes.iter().for_each(|pass| page += &pass_section(pass, target, &words));
        page += include_str!("conventions.md");
        page += &self.chosen_conventions();
        page + "\n" + include_str!("checklist.md")
    }

    fn steps(&self, manifest: &Manifest, words: &Words) -> String {
        let inputs: Vec<_> = self.plan.inputs().map(|name| format!("`{name}`")).collect();
        let stage = |stage| {
            manifest.passes.iter().filter(move |pass| pass.stage == stage).map(|pass| format!("`{}`", pass.name))
        };
        let list = |names: &mut dyn Iterator<Item = String>| names.collect::<Vec<_>>().join(", ");
        let rays = match self.plan.resource("rays") {
            Some(_) => {
                "Trace the rays of `rays`, 64 a workgroup, from the grid at byte 32 of `args`; the fourth word there is their number. An entry holds x in bits 0 to 13 and y in bits 14 to 27. Write the result to that pixel of `radiance` and, where bit 28, 29 or 30 is set, to the pixel beside it (x ^ 1), above or below it (y ^ 1) or across (both)."
            }
            None => "Trace a ray for every pixel that reflects into `radiance`.",
        };
        let previous = if self.settings.features.gbuffer_copy {
            ""
        } else {
            " Those that begin with `prev_` are last frame's, encoded as this frame's; in the first frame and where `reset` is set they may hold anything. Set `reset` too in the frame after a change of `depth`, `sky_distance`, `roughness_threshold` or `constant_roughness`."
        };
        format!(
            "## Steps\n\n1. {}\n2. Allocate the resources below; those with two copies twice. Before the first frame, and after a resize, set \
             what is persistent to zero: {}.\n3. Every frame, fill a constant buffer of {} bytes with `limpid_fill_constants` of `limpid.h`, from this frame's camera and the camera and size of the frame that was denoised last. Count \
             frames: in frame `n` the current copy of a pair is `n % 2`, the previous one the other.\n4. Dispatch {}.\n5. {rays} \
             Your images: {}.{previous}\n6. Dispatch {}. The result is in {}: leave it as it is.\n\n",
            words.pipeline,
            words.clear,
            manifest.constants.size,
            list(&mut stage(Stage::Classify)),
            inputs.join(", "),
            list(&mut stage(Stage::Denoise)),
            output_text(manifest),
        )
    }

    fn debug_view_legend(&self) -> String {
        let Some(legend) = self.settings.features.debug_view.map(DebugView::legend) else { return String::new() };
        let mut section = format!(
            "## Debug view\n\nThe texture `{DEBUG_VIEW}` shows in linear colours: {}. Read it between the denoise passes of this frame and the next.\n\n\
             | red, green, blue | |\n|---|---|\n",
            legend.title
        );
        for Key { color: [r, g, b], label } in legend.ramp.iter().chain(legend.keys) {
            let _ = writeln!(section, "| {r}, {g}, {b} | {label} |");
        }
        if !legend.ramp.is_empty() {
            let _ = writeln!(section, "\nThe first {} are mixed for what lies between.", legend.ramp.len());
        }
        section + "\n"
    }

    fn chosen_conventions(&self) -> String {
        let conventions = &self.settings.conventions;
        let depth = match conventions.depth {
            DepthEncoding::Device => "device depth, 0 near, 1 far; 1 is sky",
            DepthEncoding::ReversedDevice => "device depth, 1 near, 0 far; 0 is sky",
            DepthEncoding::Linear => "linear distance along the view axis; 0 is sky",
        };
        let normal = match conventions.normal {
            NormalEncoding::Signed => "world space, `xyz` in -1..1",
            NormalEncoding::Unsigned => "world space, `xyz * 2 - 1`",
            NormalEncoding::Octahedral => "world space, octahedral in -1..1",
            NormalEncoding::OctahedralUnsigned => "world space, octahedral in 0..1",
        };
        let roughness = match conventions.roughness {
            RoughnessEncoding::Perceptual => "perceptual",
            RoughnessEncoding::Alpha => "GGX alpha",
        };
        format!(
            "| depth | {depth} |\n| normal | {normal} |\n| roughness | {roughness}, channel {:?} |\n| clip space | `y` {:?} |\n",
            conventions.roughness_channel, conventions.ndc_y
        )
    }
}

fn output_text(manifest: &Manifest) -> String {
    let OutputEntry { resource, copy } = &manifest.output;
    match copy {
        Copy::Current => format!("`{resource}`, which is also next frame's history"),
        Copy::Previous => {
            format!(
                "the previous copy of `{resource}`, so in another texture every frame; the current copy is next frame's history"
            )
        }
    }
}

fn format_name(resource: &ResourceEntry, target: Target) -> String {
    let name = resource.format.as_ref().map(|format| match target {
        Target::Hlsl => format.dxgi,
        Target::Spirv => format.vulkan,
        Target::Msl => format.metal,
        Target::Glsl => format.gl,
        Target::Wgsl => format.webgpu,
    });
    match (name, resource.kind, resource.stride) {
        (Some(name), ..) => format!("`{name}`"),
        (None, ResourceKind::Constants, _) => "constant buffer".to_owned(),
        (None, ResourceKind::Input, _) => "texture, any float format".to_owned(),
        (None, _, stride) => format!("buffer, stride {}", stride.unwrap_or(0)),
    }
}

fn resource_table(manifest: &Manifest, target: Target) -> String {
    let mut table = "## Resources\n\n`width` and `height` are those of the largest image; division rounds down.\n\n\
        | resource | format | size | lifetime | copies | use |\n|---|---|---|---|---|---|\n"
        .to_owned();
    for resource in &manifest.resources {
        let size = match (resource.width, resource.height, &resource.bytes) {
            (Some(x), Some(y), _) => format!("`{x}` x `{y}`"),
            (_, _, Some(bytes)) => format!("`{bytes}` bytes"),
            _ => String::new(),
        };
        let lifetime = match resource.lifetime {
            Lifetime::External => "yours",
            Lifetime::Persistent => "kept, zero at first",
            Lifetime::Transient => "within a frame",
        };
        let uses = [(resource.is_read, "read"), (resource.is_written, "written"), (resource.is_indirect, "grids")];
        let uses: Vec<_> = uses.iter().filter(|(used, _)| *used).map(|(_, name)| *name).collect();
        let _ = writeln!(
            table,
            "| `{}` | {} | {size} | {lifetime} | {} | {} |",
            resource.name,
            format_name(resource, target),
            resource.copies,
            uses.join(", ")
        );
    }
    let memory = &manifest.memory;
    let _ = write!(
        table,
        "\n{:.1} bytes a pixel at 1920x1080. What lives within a frame may share its memory with other work.\n\n",
        memory.bytes_per_pixel
    );
    table
}

fn scope_text(scope: Scope) -> String {
    let parts =
        [(scope.kernel_writes, "shader writes"), (scope.kernel_reads, "shader reads"), (scope.indirect, "grids")];
    parts.iter().filter(|(used, _)| *used).map(|(_, name)| *name).collect::<Vec<_>>().join(" and ")
}

fn barrier_text(barrier: Option<Barrier>) -> String {
    match barrier {
        Some(barrier) => {
            format!("Before it a barrier: {} before, {} after.", scope_text(barrier.before), scope_text(barrier.after))
        }
        None => "No barrier before it.".to_owned(),
    }
}

fn slot(binding: &BindingEntry, target: Target) -> (String, String) {
    let missing = || (String::new(), String::new());
    match target {
        Target::Hlsl => binding.hlsl.as_ref().map_or_else(missing, |at| {
            (format!("`{}{}`, `space{}`", at.class, at.register, at.space), format!("{}, `{}`", at.view, at.state))
        }),
        Target::Spirv => binding
            .spirv
            .as_ref()
            .map_or_else(missing, |at| (format!("set {}, binding {}", at.set, at.binding), format!("`{}`", at.r#type))),
        Target::Msl => binding
            .msl
            .as_ref()
            .map_or_else(missing, |at| (format!("`{}({})`", at.table, at.index), format!("`{}`", at.usage))),
        Target::Glsl => binding.glsl.as_ref().map_or_else(missing, |at| {
            let set = at.set.map(|set| format!("set {set}, ")).unwrap_or_default();
            (format!("{set}binding {}", at.binding), at.unit.to_owned())
        }),
        Target::Wgsl => binding.wgsl.as_ref().map_or_else(missing, |at| {
            (format!("group {}, binding {}", at.group, at.binding), format!("`{}`", at.layout))
        }),
    }
}

fn pass_section(pass: &PassEntry, target: Target, words: &Words) -> String {
    let grid = match &pass.grid {
        GridEntry::Direct { x, y, .. } if x == "1" && y == "1" => "One workgroup.".to_owned(),
        GridEntry::Direct { x, y, z } => {
            format!("`{x}` x `{y}` x `{z}` workgroups, of the frame's own width and height.")
        }
        GridEntry::Indirect { resource, offset } => {
            format!("Workgroups from `{resource}` at byte {offset}: {}.", words.indirect)
        }
    };
    let file = pass.shaders.get(&target).map(|shader| shader.file.clone()).unwrap_or_default();
    let mut section = format!(
        "### {}\n\n`{file}`. {grid} {}\n\n| variable | slot | as | resource |\n|---|---|---|---|\n",
        pass.name,
        barrier_text(pass.barrier)
    );
    for binding in &pass.bindings {
        let (slot, usage) = slot(binding, target);
        let copy = if binding.copy == Copy::Previous { ", previous copy" } else { "" };
        let _ = writeln!(section, "| `{}` | {slot} | {usage} | `{}`{copy} |", binding.variable, binding.resource);
    }
    section + "\n"
}
