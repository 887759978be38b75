//! An export is enough: a C program that shares no code with limpid (`tests/c/denoise`) reads an export folder, runs it
//! on Vulkan, and gets the bits that the ash backend gets on the same device.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use glam::UVec2;
use limpid::settings::{Fallback, RayList, RaysPerQuad};
use limpid::{Preset, Settings};
use limpid_cli::scene;
use limpid_harness::executor::{Ash, AshOptions};
use limpid_harness::{Case, Executor, TexelFormat};
use serde_json::{Value, json};

mod frames;
mod tools;

use tools::Folder;

const SIZE: UVec2 = UVec2::new(100, 60);

/// How a test runs: settings, options of `limpid export`, and frames.
struct Run {
    name: &'static str,
    options: &'static [&'static str],
    case: Case,
}

fn case(settings: &Settings, scene: &str, sizes: &[UVec2]) -> Case {
    let scene = scene::by_name(scene).unwrap();
    let frames = sizes.iter().zip(0..).map(|(&size, number)| scene.render(number, size, 0));
    frames::case(settings, frames)
}

fn runs() -> Vec<Run> {
    let default = case(&Settings::default(), "gallery", &[SIZE; 5]);

    // Everything that can be elsewhere is elsewhere, frames are smaller at times, and the camera jitters and cuts.
    let mut settings = Preset::Reference.settings();
    settings.coverage.fallback = Fallback::Environment;
    settings.coverage.ray_list = Some(RayList::default());
    if let Some(list) = &mut settings.coverage.ray_list {
        (list.rays_per_quad, list.variance_threshold) = (RaysPerQuad::One, Some(0.1));
    }
    settings.conventions.motion_includes_jitter = true;
    let smaller = UVec2::new(77, 41);
    let mut moved = case(&settings, "dolly", &[SIZE, SIZE, smaller, smaller, SIZE]);
    for (number, step) in moved.steps.iter_mut().enumerate() {
        step.frame.camera.jitter = glam::Vec2::new(0.25, -0.125) * number as f32;
        step.frame.exposure = 0.5 + number as f32;
    }
    moved.steps[3].frame.reset = true;

    let mut few = Settings::default();
    (few.features.spatial_filter, few.features.light_change) = (false, false);
    few.features.constant_roughness = Some(0.25);
    (few.features.gbuffer_copy, few.features.packed_guide) = (false, false);
    let few = case(&few, "mirrors", &[SIZE; 3]);
    vec![
        Run { name: "default", options: &[], case: default },
        Run {
            name: "moved",
            options: &["--spirv-set", "1", "--spirv-binding-base", "5", "--spirv-version", "1.0"],
            case: moved,
        },
        Run { name: "few", options: &[], case: few },
    ]
}

/// Writes an export of the case's settings, with the command that its users run.
fn export(run: &Run, folder: &Path) {
    let (settings, out) = (folder.join("settings.json"), folder.join("export"));
    fs::write(&settings, serde_json::to_vec(&run.case.settings).unwrap()).unwrap();
    let paths = ["--settings", settings.to_str().unwrap(), "--out", out.to_str().unwrap()];
    let arguments = [&["export", "--target", "spirv"], &paths[..], run.options].concat();
    tools::run(env!("CARGO_BIN_EXE_limpid"), &arguments);
}

fn format(format: TexelFormat) -> (&'static str, u32) {
    match format {
        TexelFormat::Rgba16Float => ("VK_FORMAT_R16G16B16A16_SFLOAT", 8),
        TexelFormat::Rgba32Float => ("VK_FORMAT_R32G32B32A32_SFLOAT", 16),
        TexelFormat::R32Float => ("VK_FORMAT_R32_SFLOAT", 4),
        TexelFormat::Rg32Float => ("VK_FORMAT_R32G32_SFLOAT", 8),
    }
}

/// Writes cameras and images of a case.
fn write_sequence(case: &Case, folder: &Path) {
    fs::create_dir(folder).unwrap();
    let mut frames = Vec::new();
    for (number, step) in case.steps.iter().enumerate() {
        for image in case.images(number) {
            let path = folder.join(format!("{number}.{}.raw", image.name));
            fs::write(path, bytemuck::cast_slice::<u32, u8>(&image.words)).unwrap();
        }
        let (frame, camera) = (&step.frame, &step.frame.camera);
        frames.push(json!({
            "width": frame.size.x,
            "height": frame.size.y,
            "world_to_view": camera.world_to_view.to_cols_array(),
            "view_to_clip": camera.view_to_clip.to_cols_array(),
            "jitter": camera.jitter.to_array(),
            "exposure": frame.exposure,
            "frame_seconds": frame.frame_seconds,
            "reset": frame.reset,
        }));
    }
    let inputs: Vec<Value> = case
        .images(0)
        .iter()
        .map(|image| {
            let (format, texel_bytes) = format(image.format);
            json!({
                "name": image.name,
                "format": format,
                "texel_bytes": texel_bytes,
                "width": image.size.x,
                "height": image.size.y,
            })
        })
        .collect();
    let sequence = json!({ "width": case.size.x, "height": case.size.y, "inputs": inputs, "frames": frames });
    fs::write(folder.join("sequence.json"), serde_json::to_vec_pretty(&sequence).unwrap()).unwrap();
}

/// Compiles the program with the header of an export.
fn compile(folder: &Path) -> PathBuf {
    let sources = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/c/denoise");
    let files = fs::read_dir(&sources).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<_> = files.filter(|path| path.extension().is_some_and(|ending| ending == "c")).collect();
    files.sort();
    let program = folder.join("denoise");
    let strict = ["-std=c11", "-O1", "-Wall", "-Wextra", "-Wpedantic", "-Wshadow", "-Wconversion", "-Werror"];
    let mut command = Command::new("cc");
    command.args(strict).arg("-I").arg(folder.join("export")).args(files).arg("-o").arg(&program);
    let output = command.args(["-lvulkan", "-lm"]).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    program
}

/// Runs the program under the validation layer, if it is installed, and returns the frames that it wrote.
fn denoise(program: &Path, folder: &Path, device: &str, frames: usize) -> Vec<Vec<u32>> {
    let out = folder.join("out");
    fs::create_dir(&out).unwrap();
    let mut command = Command::new(program);
    command.arg(folder.join("export")).arg(folder.join("sequence")).arg(&out).arg(device);
    let watched = AshOptions { device: device.to_owned(), validation: true, ..AshOptions::default() };
    if Ash::try_open(&watched).is_ok() {
        command
            .env("VK_INSTANCE_LAYERS", "VK_LAYER_KHRONOS_validation")
            .env("VK_LAYER_ENABLES", "VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT");
    } else {
        limpid_harness::skip("no validation layer to watch the C program");
    }
    let output = command.output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && said.is_empty(), "{said}");
    let read = |number| bytemuck::pod_collect_to_vec(&fs::read(out.join(format!("{number}.raw"))).unwrap());
    (0..frames).map(read).collect()
}

fn has_vulkan_headers() -> bool {
    let folder = Folder::new("vulkan-header");
    let source = folder.join("probe.c");
    fs::write(&source, "#include <vulkan/vulkan.h>\nint main(void) { return vkCreateInstance == 0; }\n").unwrap();
    let mut command = Command::new("cc");
    let found = command.arg(&source).arg("-lvulkan").arg("-o").arg(folder.join("probe")).output().unwrap();
    if !found.status.success() {
        tools::skip("the C compiler finds no vulkan/vulkan.h or no libvulkan (Debian: apt-get install libvulkan-dev)");
    }
    found.status.success()
}

#[test]
fn a_c_program_with_an_export_gets_the_pixels_of_the_ash_backend() {
    if !tools::has("cc") || !has_vulkan_headers() {
        return;
    }
    let mut ash = match Ash::try_open(&AshOptions::default()) {
        Ok(ash) => ash,
        Err(error) => return limpid_harness::skip(&error.to_string()),
    };
    for run in runs() {
        let folder = Folder::new(&format!("outsider-{}", run.name));
        export(&run, &folder.0);
        write_sequence(&run.case, &folder.join("sequence"));
        let program = compile(&folder.0);
        let found = denoise(&program, &folder.0, ash.device(), run.case.steps.len());
        let expected = run.case.run(&mut ash);
        for (number, (expected, found)) in expected.iter().zip(&found).enumerate() {
            let output = &expected.0["output"];
            assert!(output.iter().any(|&word| word != 0));
            assert_eq!(output.len(), found.len());
            let differing = output.iter().zip(found).filter(|(a, b)| a != b).count();
            assert_eq!(differing, 0, "{}, frame {number}: {differing} of {} words", run.name, output.len());
        }
    }
}
