//! Exported shaders through compilers that share nothing with naga, and what those report against the manifest.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;

use limpid::emit::{Checks, GlslDialect, ShaderModel, SpirvVersion};
use limpid::export::{File, MANIFEST, Options, Target, bundle};
use limpid::settings::{Fallback, NormalEncoding, RayList, RaysPerQuad};
use limpid::{Preset, Settings};
use proptest::prelude::*;
use serde_json::Value;

#[path = "../../tests/any_settings/mod.rs"]
mod any_settings;
mod tools;

use any_settings::any_settings;
use tools::Folder;

/// Settings that keep little and settings that keep all.
fn settings() -> Vec<Settings> {
    let mut all = Settings::default();
    all.coverage.fallback = Fallback::Environment;
    all.conventions.normal = NormalEncoding::OctahedralUnsigned;
    let mut list = RayList::default();
    (list.rays_per_quad, list.variance_threshold) = (RaysPerQuad::One, Some(0.1));
    all.coverage.ray_list = Some(list);
    // Samples are used or not, and so are blocks of what was accumulated.
    let mut few = Preset::Fast.settings();
    few.coverage.fallback = Fallback::Black;
    (few.features.outlier_spread, few.features.wide_filter) = (false, false);
    vec![Settings::default(), Preset::Reference.settings(), all, few]
}

struct Exported {
    manifest: Value,
    files: Vec<File>,
}

impl Exported {
    fn new(settings: &Settings, options: &Options) -> Self {
        let files = bundle(settings, options).unwrap();
        let manifest = files.iter().find(|file| file.path == MANIFEST).unwrap();
        Self { manifest: serde_json::from_slice(&manifest.bytes).unwrap(), files }
    }

    fn passes(&self) -> &[Value] {
        self.manifest["passes"].as_array().unwrap()
    }

    /// Content and entry point of a pass in a language.
    fn shader<'a>(&'a self, pass: &'a Value, target: Target) -> (&'a [u8], &'a str) {
        let shader = &pass["shaders"][target.name()];
        let file = self.files.iter().find(|file| file.path == shader["file"].as_str().unwrap()).unwrap();
        (&file.bytes, shader["entry_point"].as_str().unwrap())
    }
}

fn only(target: Target) -> Options {
    Options { targets: vec![target], ..Options::default() }
}

/// `name: (class or set, number...)` of all bindings of a pass, as the manifest says.
fn bindings(pass: &Value, describe: impl Fn(&Value) -> String) -> BTreeSet<String> {
    let bindings = pass["bindings"].as_array().unwrap().iter();
    bindings.map(|binding| format!("{} {}", binding["variable"].as_str().unwrap(), describe(binding))).collect()
}

#[test]
fn spirv_is_valid_in_every_environment_and_binds_what_the_manifest_says() {
    if !tools::has("spirv-val") || !tools::has("spirv-dis") {
        return;
    }
    let folder = Folder::new("spirv");
    let environments = [
        (SpirvVersion::V1_0, "vulkan1.0"),
        (SpirvVersion::V1_0, "vulkan1.2"),
        (SpirvVersion::V1_1, "vulkan1.1"),
        (SpirvVersion::V1_2, "vulkan1.1"),
        (SpirvVersion::V1_3, "vulkan1.1"),
        (SpirvVersion::V1_3, "vulkan1.3"),
    ];
    for settings in settings() {
        for (number, (version, environment)) in environments.into_iter().enumerate() {
            let mut options = only(Target::Spirv);
            options.spirv.version = version;
            options.spirv.debug_names = true;
            options.spirv.checks = if number % 2 == 0 { Checks::Unchecked } else { Checks::Robust };
            (options.spirv.first_set, options.spirv.first_binding) = (number as u32, 10 * number as u32);
            let exported = Exported::new(&settings, &options);
            for pass in exported.passes() {
                let path = folder.join("pass.spv");
                fs::write(&path, exported.shader(pass, Target::Spirv).0).unwrap();
                let path = path.to_str().unwrap();
                tools::run("spirv-val", &["--target-env", environment, path]);
                let text = tools::run("spirv-dis", &[path]);
                // All that INTEGRATION.md tells to enable.
                let capabilities: BTreeSet<_> =
                    text.lines().filter_map(|line| line.trim().strip_prefix("OpCapability ")).collect();
                let known = ["Shader", "ImageQuery", "StorageImageExtendedFormats"];
                assert!(capabilities.iter().all(|capability| known.contains(capability)), "{capabilities:?}");
                let decoration = |kind: &str| -> BTreeMap<String, String> {
                    let lines = text.lines().filter_map(|line| {
                        let mut words = line.split_whitespace();
                        let is = words.next() == Some("OpDecorate");
                        let id = words.next()?;
                        (is && words.next() == Some(kind)).then(|| (id.to_owned(), words.next().unwrap().to_owned()))
                    });
                    lines.collect()
                };
                let (sets, numbers) = (decoration("DescriptorSet"), decoration("Binding"));
                let found: BTreeSet<_> =
                    sets.iter().map(|(id, set)| format!("{} {set} {}", &id[1..], numbers[id])).collect();
                let expected = bindings(pass, |b| format!("{} {}", b["spirv"]["set"], b["spirv"]["binding"]));
                assert_eq!(found, expected, "{}", pass["name"]);
            }
        }
    }
}

/// Compiles all passes of an export as GLSL.
fn compile_glsl(folder: &Folder, exported: &Exported, dialect: GlslDialect) {
    for pass in exported.passes() {
        let path = folder.join("pass.comp");
        let text = String::from_utf8(exported.shader(pass, Target::Glsl).0.to_vec()).unwrap();
        let define = pass["shaders"]["glsl"]["define"].as_str().map(|name| format!("#define {name}\n"));
        let version = "#version 450\n";
        fs::write(&path, text.replace(version, &format!("{version}{}", define.unwrap_or_default()))).unwrap();
        let object = folder.join("pass.spv");
        let vulkan = ["-V", "-o", object.to_str().unwrap()];
        let api: &[&str] = if dialect == GlslDialect::Vulkan { &vulkan } else { &[] };
        let messages = tools::run("glslangValidator", &[api, &[path.to_str().unwrap()]].concat());
        assert!(!messages.to_lowercase().contains("warn"), "{messages}");
    }
}

#[test]
fn glsl_compiles_for_opengl_and_vulkan() {
    if !tools::has("glslangValidator") {
        return;
    }
    let folder = Folder::new("glsl");
    for settings in settings() {
        for (dialect, single_file) in
            [(GlslDialect::OpenGl, false), (GlslDialect::Vulkan, false), (GlslDialect::OpenGl, true)]
        {
            let mut options = only(Target::Glsl);
            options.single_file = single_file;
            options.glsl.dialect = dialect;
            (options.glsl.first_set, options.glsl.first_binding) = (1, 2);
            compile_glsl(&folder, &Exported::new(&settings, &options), dialect);
        }
    }
}

/// Rows of a table of DXC's disassembly, as `name class+number space`.
fn dxil_bindings(text: &str) -> BTreeSet<String> {
    let table = text.split("; Resource Bindings:").nth(1).unwrap().split("\n;\n").nth(1).unwrap();
    let rows = table.lines().filter_map(|line| {
        let words: Vec<_> = line.trim_start_matches(';').split_whitespace().collect();
        let slot = words.iter().rev().nth(1)?;
        if words[0].starts_with('-') || words[0] == "Name" {
            return None;
        }
        let (register, space) = slot.split_once(",space").unwrap_or((slot, "0"));
        Some(format!("{} {} {space}", words[0], register.replace("cb", "b")))
    });
    rows.collect()
}

/// Offsets of the constant buffer's fields in DXC's disassembly.
fn dxil_offsets(text: &str) -> BTreeMap<String, u64> {
    let lines = text.lines().filter(|line| line.contains("; Offset:") && !line.contains("Size:"));
    let field = |line: &str| {
        let (declaration, offset) = line.split_once("; Offset:")?;
        let name = declaration.trim().trim_end_matches(';').rsplit(' ').next()?.to_owned();
        Some((name, offset.trim().parse().ok()?))
    };
    lines.filter_map(|line| field(line.trim_start_matches(';'))).collect()
}

// The library takes no profile below 6.0: the text for 5.1 is compiled as 6.0, in the older language too.
const HLSL_MODES: &[(ShaderModel, &[&str])] = &[
    (ShaderModel::V5_1, &["-T", "cs_6_0", "-HV", "2016"]),
    (ShaderModel::V6_0, &["-T", "cs_6_0"]),
    (ShaderModel::V6_0, &["-T", "cs_6_0", "-HV", "2021"]),
    (ShaderModel::V6_2Half, &["-T", "cs_6_2", "-enable-16bit-types"]),
    (ShaderModel::V6_0, &["-T", "cs_6_0", "-spirv"]),
];

/// Options for a mode of DXC.
fn hlsl_options(model: ShaderModel, arguments: &[&str]) -> Options {
    let is_spirv = arguments.contains(&"-spirv");
    let mut options = only(Target::Hlsl);
    options.hlsl.shader_model = model;
    (options.hlsl.root_signature, options.hlsl.vk_binding) = (!is_spirv, is_spirv);
    options
}

/// Compiles a pass of an export as HLSL.
fn compile_hlsl(compiler: &limpid_dxc::Compiler, exported: &Exported, pass: &Value, arguments: &[&str]) -> Vec<u8> {
    let (text, entry_point) = exported.shader(pass, Target::Hlsl);
    let mut arguments = [arguments, &["-E", entry_point, "-WX"][..]].concat();
    if let Some(define) = pass["shaders"]["hlsl"]["define"].as_str() {
        arguments.extend(["-D", define]);
    }
    tools::compile_hlsl(compiler, std::str::from_utf8(text).unwrap(), &arguments)
}

#[test]
fn hlsl_compiles_to_dxil_and_binds_what_the_manifest_says() {
    let Some(compiler) = tools::dxc() else { return };
    for settings in settings() {
        for (number, (model, arguments)) in HLSL_MODES.iter().enumerate() {
            let mut options = hlsl_options(*model, arguments);
            (options.hlsl.first_space, options.hlsl.first_register) = (number as u32, number as u32);
            options.single_file = number == 2;
            let exported = Exported::new(&settings, &options);
            for pass in exported.passes() {
                let object = compile_hlsl(&compiler, &exported, pass, arguments);
                if arguments.contains(&"-spirv") {
                    continue;
                }
                let text = compiler.disassemble(&object).unwrap();
                let expected = bindings(pass, |binding| {
                    let at = &binding["hlsl"];
                    format!("{}{} {}", at["class"].as_str().unwrap(), at["register"], at["space"])
                });
                assert_eq!(dxil_bindings(&text), expected, "{}", pass["name"]);
                let offsets = dxil_offsets(&text);
                for field in exported.manifest["constants"]["fields"].as_array().unwrap() {
                    let name = field["name"].as_str().unwrap();
                    if let Some(offset) = offsets.get(name) {
                        assert_eq!(Some(*offset), field["offset"].as_u64(), "{name}");
                    }
                }
                let has_constants = pass["bindings"].as_array().unwrap().iter().any(|b| b["resource"] == "frame");
                assert_eq!(offsets.contains_key("clip_extent_floor"), has_constants, "{}", pass["name"]);
            }
            let header = exported.files.iter().find(|file| file.path == "hlsl/limpid.hlsli").unwrap();
            let body = "ConstantBuffer<LimpidFrame> frame : register(b0); RWBuffer<float> o : register(u0);\n\
                        [numthreads(1, 1, 1)] void use() { o[0] = frame.exposure; }";
            let text = format!("{}{body}", std::str::from_utf8(&header.bytes).unwrap());
            tools::compile_hlsl(&compiler, &text, &["-T", "cs_6_0", "-E", "use", "-WX"]);
        }
    }
}

/// glslang reads HLSL too, in the manner of shader model 5.
#[test]
fn hlsl_compiles_with_glslang() {
    if !tools::has("glslangValidator") {
        return;
    }
    let folder = Folder::new("hlsl");
    for settings in settings() {
        let mut options = only(Target::Hlsl);
        options.hlsl.shader_model = ShaderModel::V5_1;
        options.hlsl.vk_binding = true;
        let exported = Exported::new(&settings, &options);
        for pass in exported.passes() {
            let (path, object) = (folder.join("pass.hlsl"), folder.join("pass.spv"));
            let (text, entry_point) = exported.shader(pass, Target::Hlsl);
            fs::write(&path, text).unwrap();
            let (path, object) = (path.to_str().unwrap(), object.to_str().unwrap());
            tools::run("glslangValidator", &["-D", "-V", "-S", "comp", "-e", entry_point, "-o", object, path]);
        }
    }
}

/// Chrome's compiler, from the npm package `webgpu` in the folder that `LIMPID_TINT` names.
#[test]
fn wgsl_compiles_with_tint() {
    let Some(modules) = std::env::var_os("LIMPID_TINT") else {
        use std::io::Write;
        // Not required where tools are: it takes longer to fetch than to run.
        let _ = writeln!(std::io::stderr(), "SKIPPED: LIMPID_TINT does not name a folder with the npm package webgpu");
        return;
    };
    let folder = Folder::new("wgsl");
    let mut files = Vec::new();
    for (number, settings) in settings().iter().enumerate() {
        let exported = Exported::new(settings, &only(Target::Wgsl));
        for pass in exported.passes() {
            let path = folder.join(&format!("{number}-{}.wgsl", pass["name"].as_str().unwrap()));
            fs::write(&path, exported.shader(pass, Target::Wgsl).0).unwrap();
            files.push(path.to_str().unwrap().to_owned());
        }
    }
    let script = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/tools/tint.mjs");
    let modules = modules.to_str().unwrap();
    let arguments: Vec<_> =
        [script.to_str().unwrap(), modules].into_iter().chain(files.iter().map(String::as_str)).collect();
    let messages = tools::run("node", &arguments);
    assert!(messages.contains(&format!("{} files without a remark", files.len())), "{messages}");
}

/// Checks names and types of all passes of an export as MSL. There is no compiler for Metal on Linux; a C++ compiler with a
/// small stand-in for Metal's library leaves address spaces, attributes and limits to `.github/workflows/metal.yml`.
fn check_msl(folder: &Folder, exported: &Exported) {
    let library = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/tools");
    for pass in exported.passes() {
        let path = folder.join("pass.cpp");
        fs::write(&path, exported.shader(pass, Target::Msl).0).unwrap();
        let warnings =
            ["-Wall", "-Wextra", "-Wshadow", "-Werror", "-Wno-unknown-attributes", "-Wno-ignored-attributes"];
        let mode = ["-std=c++17", "-fsyntax-only", "-fdeclspec", "-x", "c++", "-I", library.to_str().unwrap()];
        tools::run("clang++-14", &[&mode[..], &warnings, &[path.to_str().unwrap()]].concat());
        let text = fs::read_to_string(&path).unwrap();
        for binding in pass["bindings"].as_array().unwrap() {
            let at = &binding["msl"];
            let (variable, table) = (binding["variable"].as_str().unwrap(), at["table"].as_str().unwrap());
            let argument = format!("{variable} [[{table}({})]]", at["index"]);
            assert!(text.contains(&argument), "{}: {argument}", pass["name"]);
        }
    }
}

#[test]
fn msl_has_the_right_types() {
    if !tools::has("clang++-14") {
        return;
    }
    let folder = Folder::new("msl");
    for settings in settings() {
        check_msl(&folder, &Exported::new(&settings, &only(Target::Msl)));
    }
}

/// The same settings in every run, unless `PROPTEST_CASES` asks for so many new ones.
#[test]
fn random_settings_compile_with_every_compiler() {
    let (dxc, has_glslang, has_clang) = (tools::dxc(), tools::has("glslangValidator"), tools::has("clang++-14"));
    let folder = Folder::new("random");
    let dialect = prop_oneof![Just(GlslDialect::OpenGl), Just(GlslDialect::Vulkan)];
    let (mut runner, _) = limpid_harness::runner(file!(), 4);
    let cases = (any_settings(), dialect, 0..HLSL_MODES.len());
    let compile = |(settings, dialect, mode): (Settings, GlslDialect, usize)| {
        let (model, arguments) = HLSL_MODES[mode];
        let mut options = hlsl_options(model, arguments);
        options.targets = vec![Target::Hlsl, Target::Glsl, Target::Msl];
        options.glsl.dialect = dialect;
        let exported = Exported::new(&settings, &options);
        for (compiler, pass) in dxc.iter().flat_map(|dxc| exported.passes().iter().map(move |pass| (dxc, pass))) {
            compile_hlsl(compiler, &exported, pass, arguments);
        }
        if has_glslang {
            compile_glsl(&folder, &exported, dialect);
        }
        if has_clang {
            check_msl(&folder, &exported);
        }
        Ok(())
    };
    runner.run(&cases, compile).unwrap();
}
