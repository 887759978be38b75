//! Kernels in other languages, whatever the settings.

use glam::UVec2;
use limpid::emit::{Checks, GlslDialect, GlslOptions, HlslOptions, MslOptions, ShaderModel, SpirvOptions, WgslOptions};
use limpid::kernel::Kernel;
use limpid::{Error, Plan, Preset, Settings};
use proptest::prelude::*;

mod any_settings;
use any_settings::any_settings;

/// Names that naga or a generator would have left behind, and words that stand for something unfinished.
const SCAFFOLDING: &[&str] =
    &["naga", "_e1", "loop_init", "nagaSamplerHeap", "type_1", "local_1", "ret_Construct", "fake"];

fn check_text(kernel: &Kernel, text: &str) {
    for word in SCAFFOLDING {
        let found = text.lines().find(|line| !line.trim_start().starts_with("//") && line.contains(word));
        assert!(found.is_none(), "{}: `{word}` in {found:?}", kernel.name);
    }
    for line in text.lines().filter(|line| !line.starts_with('#')) {
        assert!(line.len() <= 125 && line.trim_end() == line, "{}: {line}", kernel.name);
    }
    for binding in &kernel.bindings {
        assert!(text.contains(&binding.name), "{}: {}", kernel.name, binding.name);
    }
}

/// WGSL that was written, read again.
fn parsed(text: &str) -> naga::Module {
    let module = naga::front::wgsl::parse_str(text).unwrap_or_else(|e| panic!("{}\n{text}", e.emit_to_string(text)));
    let capabilities = naga::valid::Capabilities::default() | naga::valid::Capabilities::SHADER_FLOAT16_IN_FLOAT32;
    let mut validator = naga::valid::Validator::new(naga::valid::ValidationFlags::all(), capabilities);
    validator.validate(&module).unwrap_or_else(|e| panic!("{}\n{text}", e.emit_to_string(text)));
    module
}

type Write = fn(&Kernel) -> Result<String, Error>;

const WRITERS: &[Write] = &[
    |kernel| kernel.hlsl(&HlslOptions::default()),
    |kernel| {
        kernel.hlsl(&HlslOptions { shader_model: ShaderModel::V6_2Half, vk_binding: true, ..HlslOptions::default() })
    },
    |kernel| kernel.msl(&MslOptions::default()),
    |kernel| kernel.glsl(&GlslOptions::default()),
    |kernel| kernel.glsl(&GlslOptions { dialect: GlslDialect::Vulkan, ..GlslOptions::default() }),
    |kernel| kernel.wgsl(&WgslOptions::default()),
];

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn every_kernel_has_a_text_in_every_language(settings in any_settings()) {
        let (_, kernels) = Plan::new(&settings, UVec2::new(64, 64)).unwrap();
        for kernel in &kernels {
            for write in WRITERS {
                let text = write(kernel).unwrap();
                check_text(kernel, &text);
                prop_assert_eq!(&text, &write(kernel).unwrap(), "the same again");
            }
            for checks in [Checks::Unchecked, Checks::Robust] {
                kernel.spirv(&SpirvOptions { checks, ..SpirvOptions::default() }).unwrap();
            }
            let module = parsed(&kernel.wgsl(&WgslOptions { first_group: 2, first_binding: 3 }).unwrap());
            let mut bindings: Vec<_> = module.global_variables.iter().filter_map(|(_, v)| v.binding).collect();
            bindings.sort_by_key(|at| (at.group, at.binding));
            let expected: Vec<_> = kernel
                .bindings
                .iter()
                .map(|b| naga::ResourceBinding { group: b.group + 2, binding: b.binding + 3 })
                .collect();
            prop_assert_eq!(bindings, expected);
            prop_assert_eq!(module.entry_points[0].workgroup_size, kernel.workgroup_size);
        }
    }
}

#[test]
fn spirv_reads_the_constant_buffer_once() {
    let (_, kernels) = Plan::new(&Settings::default(), UVec2::new(64, 64)).unwrap();
    for kernel in &kernels {
        let module = kernel.module_for_spirv();
        let buffers = |module: &naga::Module| -> Vec<_> {
            let globals = module.global_variables.iter();
            globals.filter(|(_, v)| v.space == naga::AddressSpace::Uniform).map(|(handle, _)| handle).collect()
        };
        assert_eq!(buffers(&module), buffers(&kernel.module), "{}", kernel.name);
        let functions = module.functions.iter().map(|(_, function)| function);
        let functions = functions.chain(module.entry_points.iter().map(|entry_point| &entry_point.function));
        let expressions = functions.flat_map(|function| function.expressions.iter());
        let uses = expressions.filter(
            |(_, e)| matches!(e, naga::Expression::GlobalVariable(handle) if buffers(&module).contains(handle)),
        );
        assert_eq!(uses.count(), buffers(&module).len(), "{}", kernel.name);
    }
    assert!(kernels.iter().any(|kernel| kernel.bindings.iter().any(|binding| binding.name == "frame")));
}

#[test]
fn comments_and_names_are_those_of_the_sources() {
    let (_, kernels) = Plan::new(&Preset::Reference.settings(), UVec2::new(64, 64)).unwrap();
    let prefilter = kernels.iter().find(|kernel| kernel.name == "prefilter").unwrap();
    let text = prefilter.hlsl(&HlslOptions::default()).unwrap();
    for part in [
        "// Prefilter: one sparse edge-stopping blur",
        "// Halton points in bases 2 and 3 over 7x7 pixels, centre left out, as published.\nstatic const int2 TAPS[15]",
        "// Bit test: compilers fold `x == x` to true.\nbool is_finite(float x) {",
        "    // The pixel's own tile has an average and a weight of at least a quarter.\n    return",
        "    for (uint entry = lane; entry < WINDOW_COUNT; entry += 64u) {",
        "Texture2D<uint4> in_guide : register(t12, space1);",
        "SPDX-License-Identifier",
    ] {
        assert!(text.contains(part), "`{part}` is not in\n{text}");
    }
}

#[test]
fn registers_can_be_moved() {
    let mut settings = Settings::default();
    settings.coverage.fallback = limpid::settings::Fallback::Input;
    let (_, kernels) = Plan::new(&settings, UVec2::new(64, 64)).unwrap();
    let fill = kernels.iter().find(|kernel| kernel.name == "fill").unwrap();
    let hlsl = HlslOptions { first_space: 7, first_register: 10, vk_binding: true, ..HlslOptions::default() };
    let text = fill.hlsl(&hlsl).unwrap();
    assert!(text.contains("[[vk::binding(10, 7)]] ConstantBuffer<Frame> frame : register(b10, space7);"), "{text}");
    let written = "[[vk::image_format(\"rgba16f\")]] RWTexture2D<float4> out_output : register(u13, space8);";
    assert!(text.contains(written), "{text}");
    assert!(hlsl.root_signature_of(fill).contains("CBV(b10, space = 7)"));
    let glsl = GlslOptions { dialect: GlslDialect::Vulkan, first_set: 2, first_binding: 4 };
    assert!(fill.glsl(&glsl).unwrap().contains("layout(set = 3, binding = 7, rgba16f) uniform writeonly image2D"));
    let text = fill.msl(&MslOptions { first_buffer: 5, first_texture: 6 }).unwrap();
    assert!(
        text.contains("constant Frame &frame [[buffer(5)]]") && text.contains("in_radiance [[texture(6)]]"),
        "{text}"
    );
    // SPIR-V: instruction 71 decorates, 33 with a binding, 34 with a set.
    let words = fill.spirv(&SpirvOptions { first_set: 2, first_binding: 4, ..SpirvOptions::default() }).unwrap();
    let mut rest = &words[5..];
    let mut lowest = [u32::MAX; 2];
    while let [head, ..] = *rest {
        let (instruction, tail) = rest.split_at((head >> 16) as usize);
        if head & 0xffff == 71 && (33..=34).contains(&instruction[2]) {
            let at = &mut lowest[instruction[2] as usize - 33];
            *at = (*at).min(instruction[3]);
        }
        rest = tail;
    }
    assert_eq!(lowest, [4, 2]);
}

/// The number that a resource is bound to does not change when settings leave others out.
#[test]
fn numbers_do_not_depend_on_settings() {
    let numbers = |settings: &Settings| {
        let (_, kernels) = Plan::new(settings, UVec2::new(64, 64)).unwrap();
        let of = |kernel: &Kernel| {
            let name = kernel.name;
            let of = |b: &limpid::kernel::Binding| {
                let key = (name, b.name.clone());
                (key, (MslOptions::default().slot_of(kernel, b), GlslOptions::default().slot_of(kernel, b)))
            };
            kernel.bindings.iter().map(of).collect::<Vec<_>>()
        };
        kernels.iter().flat_map(of).collect::<std::collections::HashMap<_, _>>()
    };
    let few = numbers(&Settings::default());
    let mut settings = Settings::default();
    settings.coverage.fallback = limpid::settings::Fallback::Environment;
    settings.coverage.ray_list = Some(limpid::settings::RayList::default());
    let many = numbers(&settings);
    assert!(many.len() > few.len());
    let shared: Vec<_> = few.iter().filter(|(key, _)| many.contains_key(key)).collect();
    assert!(shared.len() > 30);
    for (key, slot) in shared {
        assert_eq!(many[key], *slot, "{key:?}");
    }
}
