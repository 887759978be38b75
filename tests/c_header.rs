//! `limpid.h` compiles as C11 and C++17 without a warning, and fills the constants as the crate does.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use glam::{EulerRot, Mat4, Quat, UVec2, Vec2, Vec3, camera::lh, camera::rh};
use limpid::export::{Options, bundle};
use limpid::settings::{DepthEncoding, NdcY};
use limpid::{Camera, Denoiser, FrameConstants, FrameInputs, Settings};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;

const SIZE: UVec2 = UVec2::new(4000, 3000);

/// A compiler and how it is told to be strict, if it is installed.
fn compilers() -> Vec<(&'static str, &'static [&'static str])> {
    let all: [(&str, &[&str]); 2] = [("cc", &["-std=c11", "-x", "c"]), ("c++", &["-std=c++17", "-x", "c++"])];
    let is_there = |(compiler, _): &(&'static str, _)| {
        let found = Command::new(compiler).arg("--version").output().is_ok();
        assert!(found || std::env::var_os("LIMPID_REQUIRE_TOOLS").is_none(), "{compiler} is not installed");
        if !found {
            let _ = writeln!(std::io::stderr(), "SKIPPED: {compiler} is not installed");
        }
        found
    };
    all.into_iter().filter(is_there).collect()
}

fn compile(folder: &Path, compiler: &str, arguments: &[&str]) -> PathBuf {
    let program = folder.join(format!("constants-{compiler}"));
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/c/constants.c");
    let warnings = ["-Wall", "-Wextra", "-Wpedantic", "-Wshadow", "-Wconversion", "-Werror", "-O1", "-I"];
    let mut command = Command::new(compiler);
    command.args(arguments).args(warnings).arg(folder).arg(source).arg("-o").arg(&program).arg("-lm");
    let output = command.output().unwrap();
    assert!(output.status.success(), "{compiler}: {}", String::from_utf8_lossy(&output.stderr));
    program
}

/// A frame and the one before it.
#[derive(Debug, Clone)]
struct Case {
    inputs: FrameInputs,
    previous: Option<(Camera, UVec2)>,
}

fn any_camera(projection: Mat4) -> impl Strategy<Value = Camera> {
    let angles = prop::array::uniform3(-3.1f32..3.1);
    let position = prop::array::uniform3(-5000.0f32..5000.0);
    let jitter = prop::array::uniform2(-0.5f32..0.5);
    (angles, position, jitter).prop_map(move |(angles, position, jitter)| {
        let rotation = Quat::from_euler(EulerRot::XYZ, angles[0], angles[1], angles[2]);
        let world_to_view = Mat4::from_rotation_translation(rotation, Vec3::from(position));
        Camera { world_to_view, view_to_clip: projection, jitter: Vec2::from(jitter) }
    })
}

fn any_case(projection: Mat4) -> impl Strategy<Value = Case> {
    let size = || (1u32..=SIZE.x, 1u32..=SIZE.y).prop_map(|(x, y)| UVec2::new(x, y));
    let previous = prop::option::of((any_camera(projection), size()));
    (any_camera(projection), size(), 0.001f32..1000.0, 0.001f32..0.2, any::<bool>(), previous).prop_map(
        |(camera, size, exposure, seconds, reset, previous)| {
            let mut inputs = FrameInputs::new(camera, size);
            (inputs.exposure, inputs.frame_seconds, inputs.reset) = (exposure, seconds, reset);
            Case { inputs, previous }
        },
    )
}

fn push_camera(words: &mut Vec<u32>, camera: &Camera) {
    let floats = camera.world_to_view.to_cols_array().into_iter().chain(camera.view_to_clip.to_cols_array());
    words.extend(floats.chain(camera.jitter.to_array()).map(f32::to_bits));
}

fn record(case: &Case) -> Vec<u32> {
    let mut words = Vec::new();
    push_camera(&mut words, &case.inputs.camera);
    words.extend(case.inputs.size.to_array());
    words.extend([case.inputs.exposure, case.inputs.frame_seconds].map(f32::to_bits));
    words.push(u32::from(case.inputs.reset));
    let (camera, size) = case.previous.unwrap_or((case.inputs.camera, UVec2::ONE));
    push_camera(&mut words, &camera);
    words.extend(size.to_array());
    words.push(u32::from(case.previous.is_some()));
    words
}

fn from_c(program: &Path, cases: &[Case]) -> Vec<FrameConstants> {
    let mut child = Command::new(program).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    let words: Vec<u32> = cases.iter().flat_map(record).collect();
    let mut stdin = child.stdin.take().unwrap();
    let writer = std::thread::spawn(move || stdin.write_all(bytemuck::cast_slice(&words)).unwrap());
    let output = child.wait_with_output().unwrap();
    writer.join().unwrap();
    assert!(output.status.success());
    output.stdout.chunks_exact(size_of::<FrameConstants>()).map(bytemuck::pod_read_unaligned).collect()
}

fn from_rust(denoiser: &Denoiser, case: &Case) -> FrameConstants {
    let mut denoiser = denoiser.clone();
    if let Some((camera, size)) = case.previous {
        denoiser.next_frame(&FrameInputs::new(camera, size)).unwrap();
        denoiser.finish_frame();
    }
    denoiser.next_frame(&case.inputs).unwrap().constants
}

/// How far two constants may be apart: some units in the last place of the largest of their field.
fn assert_close(rust: &FrameConstants, c: &FrameConstants, what: &str) {
    let (rust, c): (&[u32], &[u32]) =
        (bytemuck::cast_slice(bytemuck::bytes_of(rust)), bytemuck::cast_slice(bytemuck::bytes_of(c)));
    for &(name, offset, size) in FrameConstants::FIELDS {
        let range = offset / 4..(offset + size) / 4;
        if ["size", "prev_size"].contains(&name) {
            assert_eq!(rust[range.clone()], c[range], "{what}: {name}");
            continue;
        }
        let floats = |words: &[u32]| words.iter().map(|&word| f32::from_bits(word)).collect::<Vec<_>>();
        let (expected, found) = (floats(&rust[range.clone()]), floats(&c[range]));
        let scale = expected.iter().fold(0.0f32, |scale, value| scale.max(value.abs()));
        for (a, b) in expected.iter().zip(&found) {
            assert!(a == b || (a - b).abs() <= 2e-6 * scale, "{what}: {name}: {expected:?} in Rust, {found:?} in C");
        }
    }
}

#[test]
fn c_and_rust_fill_the_same_constants() {
    let compilers = compilers();
    let folder = std::env::temp_dir().join(format!("limpid-c-header-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let mut flipped = rh::proj::directx::perspective(1.0, 1.6, 0.1, 500.0);
    flipped.y_axis.y *= -1.0;
    flipped.z_axis.x = 0.3;
    let projections = [
        (rh::proj::directx::perspective(1.0, 1.6, 0.1, 500.0), DepthEncoding::Device, NdcY::Up),
        (lh::proj::directx::perspective_infinite_reverse(1.0, 1.6, 0.1), DepthEncoding::ReversedDevice, NdcY::Up),
        (flipped, DepthEncoding::Linear, NdcY::Down),
        (rh::proj::directx::orthographic(-8.0, 9.0, -5.0, 5.0, 500.0, 0.1), DepthEncoding::ReversedDevice, NdcY::Up),
    ];
    let mut runner = TestRunner::deterministic();
    for (number, (projection, depth, ndc_y)) in projections.into_iter().enumerate() {
        let mut settings = Settings::default();
        (settings.conventions.depth, settings.conventions.ndc_y) = (depth, ndc_y);
        settings.conventions.motion_includes_jitter = number % 2 == 0;
        settings.conventions.motion_scale = Vec2::new(0.5, -0.5);
        settings.coverage.environment_from_world = glam::Mat3::from_rotation_y(0.7);
        settings.reproject.max_history = 21.0;
        settings.resolve.stability = 0.3;
        settings.footprint.filter_scale = 0.7;
        settings.features.constant_roughness = (number == 1).then_some(0.3);
        let files = bundle(&settings, &Options { targets: Vec::new(), ..Options::default() }).unwrap();
        let header = files.iter().find(|file| file.path == "limpid.h").unwrap();
        std::fs::write(folder.join("limpid.h"), &header.bytes).unwrap();
        let denoiser = Denoiser::new(&settings, SIZE).unwrap();
        let cases: Vec<_> = (0..200).map(|_| any_case(projection).new_tree(&mut runner).unwrap().current()).collect();
        for (compiler, arguments) in &compilers {
            let program = compile(&folder, compiler, arguments);
            let constants = from_c(&program, &cases);
            assert_eq!(constants.len(), cases.len());
            for (case, c) in cases.iter().zip(&constants) {
                assert_close(&from_rust(&denoiser, case), c, &format!("{compiler}, projection {number}, {case:?}"));
            }
        }
    }
    let _ = std::fs::remove_dir_all(&folder);
}
