//! `limpid.h`: the constant buffer, the plan as tables, and the constants of a frame, for C11 and C++17.

use glam::{Mat4, UVec2, Vec2, camera::rh};

use super::describe::is_unsigned;
use super::{Export, formats};
use crate::frame::{self, FrameConstants};
use crate::plan::{Grid, Stage};
use crate::resource::{Access, BLOCK_SIZE, Copy, Count, Extent, Kind, Lifetime, TILE_SIZE};
use crate::settings::{DepthEncoding, NdcY};
use crate::{Camera, Error, FrameInputs};

/// Constants that are made of settings and more.
const DERIVED: [&str; 4] =
    ["accumulate_max_history", "accumulate_mirror_history", "light_change_rate", "history_length_steps"];

/// The fields of the constant buffer that settings go to unchanged.
fn setting_fields() -> impl Iterator<Item = &'static (&'static str, usize, usize)> {
    let from = FrameConstants::FIELDS.iter().skip_while(|(name, ..)| *name != "roughness_threshold");
    from.filter(|(name, ..)| !DERIVED.contains(name))
}

/// A float as C writes it.
fn float(value: f32) -> String {
    format!("{value:?}f")
}

fn floats(values: &[f32]) -> String {
    values.iter().map(|&value| float(value)).collect::<Vec<_>>().join(", ")
}

fn c_field(name: &str, size: usize) -> String {
    let ty = if is_unsigned(name) { "uint32_t" } else { "float" };
    match size / 4 {
        1 => format!("    {ty} {name};\n"),
        count => format!("    {ty} {name}[{count}];\n"),
    }
}

fn upper(name: &str) -> String {
    name.to_uppercase()
}

impl Export<'_> {
    /// The header.
    pub(super) fn c_header(&self) -> Result<String, Error> {
        let guard = "LIMPID_H";
        let mut text = format!(
            "/*\n * limpid {} for C11 and C++17: constant buffer, plan, and the constants of a frame. Settings {}.\n *\n\
             \x20* Conventions: uv has its origin at the top left, y down. Matrices are for column vectors. See INTEGRATION.md.\n *\n\
             \x20* SPDX-License-Identifier: MIT OR Apache-2.0\n */\n#ifndef {guard}\n#define {guard}\n\n\
             #include <float.h>\n#include <math.h>\n#include <stddef.h>\n#include <stdint.h>\n#include <string.h>\n\n\
             #ifdef __cplusplus\n#define LIMPID_STATIC_ASSERT static_assert\n#else\n\
             #define LIMPID_STATIC_ASSERT _Static_assert\n#endif\n\n#define LIMPID_TILE_SIZE {TILE_SIZE}u\n\
             #define LIMPID_BLOCK_SIZE {BLOCK_SIZE}u\n\
             #define LIMPID_VERSION \"{0}\"\n#define LIMPID_SETTINGS_HASH \"{}\"\n\n",
            env!("CARGO_PKG_VERSION"),
            self.settings_hash,
            self.settings_hash,
        );
        text += &self.frame_struct();
        text += &self.settings_struct()?;
        text += include_str!("constants.h");
        text += &self.tables();
        text += &format!("\n#endif /* {guard} */\n");
        Ok(text)
    }

    fn frame_struct(&self) -> String {
        let mut text =
            "/* The constant buffer. Matrices are column by column. */\ntypedef struct LimpidFrame {\n".to_owned();
        text.extend(FrameConstants::FIELDS.iter().map(|&(name, _, size)| c_field(name, size)));
        text += "} LimpidFrame;\n\n";
        text += &format!("LIMPID_STATIC_ASSERT(sizeof(LimpidFrame) == {}, \"layout\");\n", size_of::<FrameConstants>());
        for (name, offset, _) in FrameConstants::FIELDS {
            text += &format!("LIMPID_STATIC_ASSERT(offsetof(LimpidFrame, {name}) == {offset}, \"layout\");\n");
        }
        text + "\n"
    }

    /// The constants of a frame with these settings and some camera.
    fn some_constants(&self) -> Result<FrameConstants, Error> {
        let size = UVec2::new(16, 16);
        let view_to_clip = rh::proj::directx::perspective(1.0, 1.0, 0.1, 10.0);
        let camera = Camera { world_to_view: Mat4::IDENTITY, view_to_clip, jitter: Vec2::ZERO };
        frame::constants(self.settings, &FrameInputs::new(camera, size), size, None)
    }

    /// Settings that constants are made of together with something else.
    fn source_settings(&self) -> impl Iterator<Item = (&'static str, f32)> {
        let (reproject, accumulate) = (&self.settings.reproject, &self.settings.accumulate);
        [
            ("neighborhood_falloff", reproject.neighborhood_falloff),
            ("max_history_seconds", accumulate.max_history_seconds),
            ("mirror_history_seconds", accumulate.mirror_history_seconds),
            ("light_change_seconds", accumulate.light_change_seconds),
        ]
        .into_iter()
    }

    fn settings_struct(&self) -> Result<String, Error> {
        let constants = self.some_constants()?;
        let bytes = bytemuck::bytes_of(&constants);
        let mut text = "/* How `depth` is encoded. */\nenum {\n    LIMPID_DEPTH_DEVICE = 0, /* 0 near, 1 far */\n    \
            LIMPID_DEPTH_REVERSED_DEVICE = 1, /* 1 near, 0 far */\n    LIMPID_DEPTH_LINEAR = 2 /* along the view axis */\n};\n\n\
            /* Direction of y in clip space. */\nenum { LIMPID_NDC_Y_UP = 0, LIMPID_NDC_Y_DOWN = 1 };\n\n\
            /* Settings that may change every frame: meanings and ranges are in the documentation of limpid::Settings. */\n\
            typedef struct LimpidSettings {\n    int depth; /* LIMPID_DEPTH_ */\n    int ndc_y; /* LIMPID_NDC_Y_ */\n    \
            int motion_includes_jitter;\n    float sky_distance;\n    float motion_scale[2];\n    \
            float environment_from_world[9]; /* column by column */\n"
            .to_owned();
        text.extend(self.source_settings().map(|(name, _)| c_field(name, size_of::<f32>())));
        text.extend(setting_fields().map(|&(name, _, size)| c_field(name, size)));
        text += "} LimpidSettings;\n\n/* The settings that were exported. */\n\
                 static inline LimpidSettings limpid_settings(void) {\n    LimpidSettings settings;\n";
        let conventions = &self.settings.conventions;
        let depth = match conventions.depth {
            DepthEncoding::Device => "DEVICE",
            DepthEncoding::ReversedDevice => "REVERSED_DEVICE",
            DepthEncoding::Linear => "LINEAR",
        };
        let ndc_y = if conventions.ndc_y == NdcY::Up { "UP" } else { "DOWN" };
        text += &format!("    settings.depth = LIMPID_DEPTH_{depth};\n    settings.ndc_y = LIMPID_NDC_Y_{ndc_y};\n");
        text += &format!("    settings.motion_includes_jitter = {};\n", u8::from(conventions.motion_includes_jitter));
        text += &format!("    settings.sky_distance = {};\n", float(conventions.sky_distance));
        for (i, scale) in conventions.motion_scale.to_array().into_iter().enumerate() {
            text += &format!("    settings.motion_scale[{i}] = {};\n", float(scale));
        }
        let environment = self.settings.coverage.environment_from_world.to_cols_array();
        text += &format!("    const float environment[9] = {{{}}};\n", floats(&environment));
        text += "    memcpy(settings.environment_from_world, environment, sizeof environment);\n";
        text.extend(self.source_settings().map(|(name, value)| format!("    settings.{name} = {};\n", float(value))));
        for &(name, offset, size) in setting_fields() {
            let value: f32 = bytemuck::pod_read_unaligned(&bytes[offset..offset + size]);
            text += &format!("    settings.{name} = {};\n", float(value));
        }
        text += "    return settings;\n}\n\n\
                 static inline void limpid_copy_settings(const LimpidSettings *settings, LimpidFrame *frame) {\n";
        text.extend(setting_fields().map(|(name, ..)| format!("    frame->{name} = settings->{name};\n")));
        Ok(text + "}\n\n")
    }

    fn tables(&self) -> String {
        let names: Vec<_> =
            self.plan.resources.iter().map(|r| format!("    LIMPID_RESOURCE_{},\n", upper(&r.name))).collect();
        let passes: Vec<_> =
            self.plan.passes.iter().map(|p| format!("    LIMPID_PASS_{},\n", upper(&p.name))).collect();
        format!(
            "\n/* ---- The plan {} */\n\nenum {{\n{}    LIMPID_RESOURCE_COUNT\n}};\n\nenum {{\n{}    LIMPID_PASS_COUNT\n}};\n\n{}{}{}{}",
            "-".repeat(98),
            names.concat(),
            passes.concat(),
            self.output_macros(),
            include_str!("tables.h"),
            self.resource_table(),
            self.pass_table(),
        )
    }

    fn output_macros(&self) -> String {
        let output = self.output_entry();
        format!(
            "/* The denoised image, and whether it is the previous copy: in frame n then copy 1 - n % 2. */\n\
             #define LIMPID_OUTPUT LIMPID_RESOURCE_{}\n#define LIMPID_OUTPUT_IS_PREVIOUS {}\n\n",
            upper(&output.resource),
            u8::from(output.copy == Copy::Previous)
        )
    }

    fn resource_table(&self) -> String {
        let rows = self.plan.resources.iter().map(|resource| {
            let (kind, extent, dxgi, bytes, count) = match resource.kind {
                Kind::Constants => ("CONSTANTS", Extent::Full, "", 0, 0),
                Kind::Input => ("INPUT", Extent::Full, "", 0, 0),
                Kind::Texture { format, extent } => ("TEXTURE", extent, formats::names(format).webgpu, format.bytes(), 0),
                Kind::Buffer { stride, count: Count::Per(extent), .. } => ("BUFFER", extent, "", stride, 0),
                Kind::Buffer { stride, count: Count::Fixed(count), .. } => ("BUFFER", Extent::Full, "", stride, count),
            };
            let lifetime = match resource.lifetime {
                Lifetime::External => "EXTERNAL",
                Lifetime::Persistent => "PERSISTENT",
                Lifetime::Transient => "TRANSIENT",
            };
            let extent = match extent {
                Extent::Full => "FULL",
                Extent::Block => "BLOCK",
                Extent::Tile => "TILE",
            };
            format!(
                "    {{\"{}\", LIMPID_{kind}, LIMPID_{lifetime}, LIMPID_EXTENT_{extent}, {}, \"{dxgi}\", {bytes}, {count}}},\n",
                resource.name,
                1 + u32::from(resource.ping_pong),
            )
        });
        format!(
            "/* Indexed by LIMPID_RESOURCE_. */\nstatic const LimpidResource limpid_resources[LIMPID_RESOURCE_COUNT] = {{\n{}}};\n\n",
            rows.collect::<String>()
        )
    }

    fn pass_table(&self) -> String {
        let barriers = self.plan.barriers();
        let mut text = String::new();
        let mut rows = String::new();
        for (pass, barrier) in self.plan.passes.iter().zip(barriers) {
            let bindings: String = pass
                .bindings
                .iter()
                .map(|bound| {
                    let access = match bound.access {
                        Access::Read => "READ",
                        Access::Write => "WRITE",
                        Access::ReadWrite => "READ_WRITE",
                    };
                    format!(
                        "    {{\"{}\", LIMPID_RESOURCE_{}, {}, LIMPID_{access}, {}, {}}},\n",
                        bound.variable,
                        upper(&bound.resource),
                        u8::from(bound.copy == Copy::Previous),
                        bound.group,
                        bound.binding
                    )
                })
                .collect();
            let table = format!("limpid_{}_bindings", pass.name);
            text += &format!("static const LimpidBinding {table}[{}] = {{\n{bindings}}};\n\n", pass.bindings.len());
            let (grid, side, resource, offset) = match &pass.grid {
                Grid::One => ("ONE", 0, "-1".to_owned(), 0),
                Grid::Squares { side } => ("SQUARES", *side, "-1".to_owned(), 0),
                Grid::Indirect { resource, offset } => {
                    ("INDIRECT", 0, format!("LIMPID_RESOURCE_{}", upper(resource)), *offset)
                }
            };
            let stage = if pass.stage == Stage::Classify { "CLASSIFY" } else { "DENOISE" };
            rows += &format!(
                "    {{\"{}\", LIMPID_STAGE_{stage}, LIMPID_GRID_{grid}, {side}, {resource}, {offset}, {}, {table}, {}}},\n",
                pass.name,
                u8::from(barrier.is_some()),
                pass.bindings.len(),
            );
        }
        text + &format!(
            "/* Indexed by LIMPID_PASS_, in the order of execution. */\nstatic const LimpidPass limpid_passes[LIMPID_PASS_COUNT] = {{\n{rows}}};\n"
        )
    }
}
