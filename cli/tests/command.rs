//! The `limpid` command as its users run it.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use limpid_cli::sequence::{ChannelNames, Sequence, read_rgb};

/// A folder of its own for a test, removed at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("limpid-{name}-{}", std::process::id()));
        fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn join(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn limpid(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_limpid")).args(arguments).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Runs a command that must succeed; what it printed.
fn succeeds(arguments: &[&str]) -> String {
    let output = limpid(arguments);
    assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
    text(&output.stdout)
}

/// Runs a command that must fail with an exit code and a message that contains all of `expected`.
fn fails(arguments: &[&str], code: i32, expected: &[&str]) {
    let output = limpid(arguments);
    let errors = text(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {errors}");
    for part in expected {
        assert!(errors.contains(part), "{arguments:?}: `{part}` is not in: {errors}");
    }
    assert!(!errors.contains("panicked"), "{errors}");
}

fn path(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// A tiny demo in `out`.
fn demo<'a>(out: &'a str, more: &[&'a str]) -> serde_json::Value {
    let base = ["demo", "--size", "64x36", "--frames", "4", "--samples", "16", "--json", "--out", out];
    serde_json::from_str(&succeeds(&[&base, more].concat())).unwrap()
}

#[test]
fn usage_is_explained_and_mistakes_have_code_two() {
    let help = limpid(&["--help"]);
    assert!(help.status.success());
    let plan_help = text(&limpid(&["plan", "--help"]).stdout);
    assert!(plan_help.contains("default, fast, reference"), "{plan_help}");
    for command in ["demo", "denoise", "analyze", "bench", "export", "stability", "plan"] {
        assert!(text(&help.stdout).contains(command));
        assert!(limpid(&[command, "--help"]).status.success());
    }
    fails(&["denoise"], 2, &["--out", "SEQUENCE"]);
    fails(&["demo", "--size", "0x3"], 2, &["0x3"]);
    fails(&["demo", "--size", "big"], 2, &["WIDTHxHEIGHT", "320x180"]);
    fails(&["demo", "--scene", "nowhere"], 1, &["nowhere", "gallery"]);
    fails(&["plan", "--set", "resolve.stability=7"], 1, &["resolve.stability", "7", "0.0 to 1.0"]);
    fails(&["plan", "--settings", "no-such-file.toml"], 1, &["no-such-file.toml"]);
}

#[test]
fn plans_are_printed() {
    let plan = succeeds(&["plan", "--preset", "reference", "--size", "640x360"]);
    assert!(plan.contains("reproject") && plan.contains("7 dispatches"), "{plan}");
    let plan = succeeds(&["plan", "--size", "640x360"]);
    assert!(plan.contains("block_spread_accumulated") && plan.contains("15 dispatches"), "{plan}");
    let fewer = succeeds(&["plan", "--features", "-spatial_filter,constant_roughness=0.3"]);
    assert!(!fewer.contains("_accumulated") && !fewer.contains("roughness "), "{fewer}");
    let json = succeeds(&["plan", "--json", "--set", "coverage.fallback=environment"]);
    let plan: limpid::Plan = serde_json::from_str(&json).unwrap();
    assert!(plan.inputs().any(|input| input == "environment"));
}

#[test]
fn the_demo_denoises_and_replaces_nothing_unasked() {
    let folder = Folder::new("demo");
    let out = folder.join("out");
    let report = demo(path(&out), &[]);
    assert_eq!(report["frames"], 4);
    // A fifth of the noisy input's squared error, which its fireflies dominate, after four frames.
    let relmse = |which: &str| report[which]["mean"]["relmse"].as_f64().unwrap();
    assert!(relmse("denoised") < 0.2 * relmse("noisy"), "{report}");
    assert_eq!(report["denoised"]["mean"]["non_finite"], 0);
    for file in ["animation.png", "comparison.png", "strip.png", "noisy/camera.json", "denoised/frame_0003.exr"] {
        assert!(out.join(file).is_file(), "{file}");
    }
    let before = fs::read(out.join("comparison.png")).unwrap();
    fails(&["demo", "--size", "64x36", "--frames", "4", "--out", path(&out)], 1, &["exists", "--force"]);
    assert_eq!(fs::read(out.join("comparison.png")).unwrap(), before);
    // The same again gives the same.
    demo(path(&out), &["--force"]);
    assert_eq!(fs::read(out.join("comparison.png")).unwrap(), before);

    // What it wrote can be denoised from disk, with the same result up to the half floats of the file.
    let again = folder.join("again");
    succeeds(&["denoise", path(&out.join("noisy")), "--out", path(&again), "--png"]);
    for number in 0..4 {
        let name = format!("frame_{number:04}.exr");
        let (_, a) = read_rgb(&out.join("denoised").join(&name)).unwrap();
        let (_, b) = read_rgb(&again.join(&name)).unwrap();
        let error: f32 = a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| (a - b).abs() / (1.0 + a)).sum();
        assert!(error / (3.0 * a.len() as f32) < 1e-3, "{name}: mean error {error}");
        assert!(again.join(&name).with_extension("png").is_file());
    }
}

#[test]
fn backends_can_be_chosen() {
    let folder = Folder::new("backends");
    let relmse = |backend: &str| {
        let report = demo(path(&folder.join(backend)), &["--backend", backend]);
        report["denoised"]["mean"]["relmse"].as_f64().unwrap()
    };
    // Whatever automatic choice finds, it gives what the CPU gives.
    let (cpu, auto) = (relmse("cpu"), relmse("auto"));
    assert!((cpu / auto - 1.0).abs() < 1e-3, "{cpu} on the CPU, {auto} by automatic choice");
    if limpid_ash::offscreen::device_names().is_empty() {
        limpid_harness::skip("no Vulkan device for --backend ash");
    } else {
        let ash = relmse("ash");
        assert!((cpu / ash - 1.0).abs() < 1e-3, "{cpu} on the CPU, {ash} through ash");
    }
    fails(&["demo", "--backend", "abacus"], 2, &["abacus", "auto, wgpu, ash, cpu"]);
}

#[test]
fn debug_views_come_with_a_legend_and_change_nothing() {
    let folder = Folder::new("views");
    let (plain, out) = (folder.join("plain"), folder.join("out"));
    demo(path(&plain), &[]);
    demo(path(&out), &["--debug-view", "motion-error"]);
    // Noisy, denoised, reference and the view, and the legend below.
    let size = |folder: &Path| image::open(folder.join("comparison.png")).unwrap().into_rgb8().dimensions();
    assert_eq!(size(&plain), (3 * 64 + 2 * 4, 36));
    assert!(size(&out).0 >= 4 * 64 + 3 * 4 && size(&out).1 > 36 + 20);
    for number in 0..4 {
        let name = format!("denoised/frame_{number:04}.exr");
        assert_eq!(fs::read(plain.join(&name)).unwrap(), fs::read(out.join(&name)).unwrap());
    }
    for backend in ["cpu", "auto", "ash"] {
        if backend == "ash" && limpid_ash::offscreen::device_names().is_empty() {
            limpid_harness::skip("no Vulkan device for --backend ash");
            continue;
        }
        let shown = folder.join(backend);
        let noisy = out.join("noisy");
        let view = ["--debug-view", "history-length", "--backend", backend];
        succeeds(&[&["denoise", path(&noisy), "--out", path(&shown)], &view[..]].concat());
        let begins_anew = |number: u32| {
            let picture = image::open(shown.join(format!("frame_{number:04}.png"))).unwrap().into_rgb8();
            let view = image::imageops::crop_imm(&picture, 3 * (64 + 4), 0, 64, 36).to_image();
            let is_red = |pixel: &&image::Rgb<u8>| pixel.0[0] > 200 && pixel.0[1] < 60 && pixel.0[2] < 60;
            view.pixels().filter(is_red).count()
        };
        // All that is no sky in the first frame, hardly anything in the last.
        assert!(begins_anew(0) > 1000 && begins_anew(3) < 300, "{backend}: {} {}", begins_anew(0), begins_anew(3));
    }
    fails(&["demo", "--debug-view", "nothing"], 2, &["nothing", "history-length", "candidate"]);
    let without_motion = ["--features=-surface_motion", "--debug-view", "motion-error"];
    fails(&[&["demo", "--out", path(&folder.join("no"))], &without_motion[..]].concat(), 1, &["surface_motion"]);
}

#[test]
fn hit_motion_is_used_where_there_is_some_and_asked_for_where_there_is_none() {
    let folder = Folder::new("hit-motion");
    let score = |scene: &str, options: &[&str]| {
        let out = folder.join(&format!("{scene}{}", options.len()));
        demo(path(&out), &[&["--scene", scene, "--backend", "cpu"], options].concat())["denoised"]["mean"]["psnr"]
            .clone()
    };
    let on = "--features=hit_motion";
    assert!(score("carousel", &[on]).as_f64() > score("carousel", &[]).as_f64());
    assert_eq!(score("still", &[on]), score("still", &[]));

    let sequence = Sequence::open(&folder.join("carousel0/noisy"), &ChannelNames::default()).unwrap();
    let frame = limpid_cli::sequence::Frame { hit_motion: None, ..sequence.load(1).unwrap() };
    let (without, out) = (folder.join("without"), folder.join("out"));
    limpid_cli::sequence::write_sequence(&without, "without", 1.0, [frame]).unwrap();
    for backend in ["cpu", "auto"] {
        let arguments = ["denoise", path(&without), "--out", path(&out), on, "--backend", backend];
        fails(&arguments, 1, &["frame_0001.exr", "hit_motion.X", "--channel"]);
    }
    let renamed = ["--channel", "hit_motion=normal"];
    succeeds(&[&["denoise", path(&without), "--out", path(&out), on], &renamed[..]].concat());
}

#[test]
fn normals_are_asked_for_unless_they_are_derived() {
    let folder = Folder::new("normals");
    let (demonstration, without) = (folder.join("demo"), folder.join("without"));
    demo(path(&demonstration), &["--backend", "cpu"]);
    let sequence = Sequence::open(&demonstration.join("noisy"), &ChannelNames::default()).unwrap();
    let frame = sequence.load(1).unwrap();
    let frame = limpid_cli::sequence::Frame { normal: vec![[0.0; 3]; frame.pixels()], ..frame };
    limpid_cli::sequence::write_sequence(&without, "without", 1.0, [frame]).unwrap();
    for backend in ["cpu", "auto"] {
        let out = folder.join(backend);
        let arguments = ["denoise", path(&without), "--out", path(&out), "--backend", backend];
        fails(&arguments, 1, &["frame_0001.exr", "normal.X", "--channel", "--features=-normal_input"]);
        succeeds(&[&arguments[..], &["--features=-normal_input"]].concat());
    }
}

#[test]
fn fewer_rays_cost_error() {
    let folder = Folder::new("rays");
    let mut psnr = Vec::new();
    for (rays, per_pixel) in [("1", 0.25..0.4), ("2", 0.5..0.6), ("4", 0.99..1.01)] {
        let report = demo(path(&folder.join(rays)), &["--rays-per-quad", rays]);
        let traced = report["rays_per_pixel"].as_f64().unwrap();
        assert!(per_pixel.contains(&traced), "{rays} rays per quad: {traced} per pixel");
        psnr.push(report["denoised"]["mean"]["psnr"].as_f64().unwrap());
    }
    assert!(psnr[0] < psnr[1] && psnr[1] < psnr[2], "{psnr:?}");
    // Listing every ray is the same as tracing all.
    let all = demo(path(&folder.join("all")), &[]);
    assert_eq!(all["denoised"]["mean"]["psnr"].as_f64().unwrap(), psnr[2]);
    // Extra rays where the image varies.
    let extra = demo(path(&folder.join("extra")), &["--rays-per-quad", "1", "--extra-rays-above", "0.005"]);
    assert!(extra["rays_per_pixel"].as_f64().unwrap() > 0.3, "{extra}");
}

#[test]
fn bad_sequences_are_refused_and_finished_frames_stay() {
    let folder = Folder::new("bad");
    let demo_out = folder.join("demo");
    demo(path(&demo_out), &[]);
    let noisy = demo_out.join("noisy");
    let sequence = path(&noisy);
    let out = folder.join("out");
    let denoise = |more: &[&str], expected: &[&str]| {
        fails(&[&["denoise", sequence, "--out", path(&out)], more].concat(), 1, expected);
    };
    fails(&["denoise", "no-such-folder", "--out", path(&out)], 1, &["no-such-folder"]);
    fails(&["denoise", sequence, "--out", sequence, "--force"], 1, &["folder of the sequence itself"]);
    denoise(&["--channel", "depth=Depth.Z"], &["Depth.Z", "frame_0000.exr", "reflection.R"]);
    denoise(&["--channel", "deep=Z"], &["deep"]);

    // A file that breaks off: what came before it is written and whole.
    let third = noisy.join("frame_0002.exr");
    let whole = fs::read(&third).unwrap();
    fs::write(&third, &whole[..whole.len() / 2]).unwrap();
    denoise(&[], &["frame_0002.exr"]);
    assert_eq!(read_rgb(&out.join("frame_0001.exr")).unwrap().0, glam::UVec2::new(64, 36));
    assert!(!out.join("frame_0002.exr").exists());
    denoise(&[], &["frame_0000.exr exists", "--force"]);
    fs::write(&third, &whole).unwrap();

    let camera = noisy.join("camera.json");
    let good = fs::read_to_string(&camera).unwrap();
    let mut json: serde_json::Value = serde_json::from_str(&good).unwrap();
    json["frames"][1]["proj"][0] = serde_json::json!([0, 0, 0, 0]);
    fs::write(&camera, json.to_string()).unwrap();
    denoise(&["--force"], &["camera.json", "proj"]);
    fs::write(&camera, &good).unwrap();
    assert_eq!(Sequence::open(&noisy, &ChannelNames::default()).unwrap().len(), 4);
    succeeds(&["denoise", sequence, "--out", path(&out), "--force"]);
}

#[test]
fn data_that_means_something_else_is_recognised() {
    let folder = Folder::new("analyze");
    let out = folder.join("dolly");
    let size = ["--scene", "dolly", "--size", "128x72", "--frames", "4", "--samples", "0"];
    succeeds(&[&["demo", "--out", path(&out)], &size[..]].concat());
    let noisy = out.join("noisy");
    let right = succeeds(&["analyze", path(&noisy), "--json"]);
    let right: serde_json::Value = serde_json::from_str(&right).unwrap();
    assert!(!right["settings"].as_str().unwrap().contains("conventions"), "{right}");
    // With the wrong sign in the settings the right one is advised.
    let wrong = ["analyze", path(&noisy), "--set", "conventions.motion_scale=[-1.0, -1.0]"];
    fails(&wrong, 1, &["does not mean what limpid takes it for"]);
    let text = text(&limpid(&wrong).stdout);
    assert!(text.contains("they point the other way") && text.contains("[1, 1]"), "{text}");
    fails(&["analyze", path(&folder.join("nowhere"))], 1, &["camera.json"]);
}

/// What analyze writes, every command reads, and it costs less.
#[test]
fn recommended_settings_are_a_file_for_other_commands() {
    let folder = Folder::new("recommended");
    let demo_out = folder.join("still");
    let scene = ["demo", "--scene", "still", "--size", "64x36", "--frames", "6", "--samples", "16"];
    succeeds(&[&scene[..], &["--out", path(&demo_out)]].concat());
    let (noisy, file) = (demo_out.join("noisy"), folder.join("smallest.toml"));
    let base = ["analyze", path(&noisy), "--write-settings", path(&file)];
    let searched = ["--search", "--repetitions", "1", "--backend", "cpu", "--json"];
    let json = succeeds(&[&base[..], &searched].concat());
    let analysis: serde_json::Value = serde_json::from_str(&json).unwrap();
    let differences = analysis["verification"]["recommended"]["differences"].as_array().unwrap();
    assert!(differences.len() == 4 && differences.iter().all(|d| d["beyond_bound"] == false), "{json}");
    assert!(analysis["verification"]["recommended"]["cpu_ratio"].as_f64().is_some_and(|ratio| ratio > 0.0), "{json}");
    let cost = |at: usize, what: &str| analysis["predicted"][at][what].as_f64().unwrap();
    for what in ["bytes", "bindings", "instructions"] {
        assert!(cost(1, what) < cost(0, what), "{what}: {json}");
    }
    let plan = succeeds(&["plan", "--json", "--settings", path(&file)]);
    let plan: limpid::Plan = serde_json::from_str(&plan).unwrap();
    assert_eq!(plan.passes.len() as f64, cost(1, "passes"));
    succeeds(&["denoise", path(&noisy), "--out", path(&folder.join("out")), "--settings", path(&file)]);
    let out = folder.join("shaders");
    succeeds(&["export", "--target", "wgsl", "--out", path(&out), "--settings", path(&file)]);
    fails(&base, 1, &["smallest.toml exists", "--force"]);
}

#[test]
fn stability_is_judged_case_by_case() {
    let folder = Folder::new("stability");
    let table = folder.join("table.md");
    let one = ["stability", "--backend", "cpu", "--case", "NaN at one pixel", "--json", "--table", path(&table)];
    let json = succeeds(&one);
    assert!(fs::read_to_string(&table).unwrap().contains("| all | 2 | 24 | 24 |  |"));
    let report: serde_json::Value = serde_json::from_str(&json).unwrap();
    let verdicts = report["verdicts"].as_array().unwrap();
    // Two cases with three presets: finite, bounded, footprint and lifetime.
    assert_eq!(verdicts.len(), 24);
    assert!(verdicts.iter().all(|verdict| verdict["passed"] == true), "{json}");
    let json = succeeds(&["stability", "--probe", "--case", "infinity at one pixel, soon", "--json"]);
    let probe: serde_json::Value = serde_json::from_str(&json).unwrap();
    // Each kernel with its operations, and outputs that are right but for rounding.
    let worst = probe["lobe_filter"]["outputs"][0]["relative"].as_f64().unwrap();
    assert!(worst > 0.0 && worst < 1e-2, "{json}");
    assert!(probe["accumulate"]["operations"].as_u64().unwrap() > 100_000);
    fails(&["stability", "--case", "no such case"], 1, &["no such case"]);
    fails(&["stability", "--long", "3"], 2, &["160 to 1000000"]);
}
