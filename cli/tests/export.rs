//! `limpid export` as its users run it.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

mod tools;

use tools::Folder;

fn limpid(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_limpid")).arg("export").args(arguments).output().unwrap()
}

fn succeeds(arguments: &[&str]) -> Vec<u8> {
    let output = limpid(arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    output.stdout
}

fn fails(arguments: &[&str], code: i32, expected: &[&str]) {
    let output = limpid(arguments);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {errors}");
    for part in expected {
        assert!(errors.contains(part), "{arguments:?}: `{part}` is not in: {errors}");
    }
    assert!(!errors.contains("panicked"), "{errors}");
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

#[test]
fn folders_are_written_compared_and_replaced() {
    let folder = Folder::new("export");
    let (path, other) = (folder.join("out"), folder.join("other"));
    let (out, other) = (text(&path), text(&other));
    succeeds(&["--out", out]);
    succeeds(&["--out", out, "--check"]);
    // The same input gives the same bytes, wherever it is written.
    succeeds(&["--out", other]);
    let files = String::from_utf8(succeeds(&["--list"])).unwrap();
    assert!(files.lines().count() > 30, "{files}");
    for line in files.lines() {
        let (size, file) = line.trim().split_once("  ").unwrap();
        let bytes = fs::read(path.join(file)).unwrap();
        assert_eq!(bytes.len().to_string(), size, "{file}");
        assert_eq!(bytes, fs::read(Path::new(other).join(file)).unwrap(), "{file}");
    }
    fails(&["--out", out], 1, &["exists", "--force", "--check"]);
    let changed = ["--out", out, "--set", "coverage.fallback=input"];
    fails(&[&changed[..], &["--check"]].concat(), 1, &["out of date", "changed: hlsl/fill.hlsl"]);
    fs::remove_file(path.join("limpid.h")).unwrap();
    fails(&["--out", out, "--check"], 1, &["missing: limpid.h"]);
    succeeds(&[&changed[..], &["--force"]].concat());
    succeeds(&[&changed[..], &["--check"]].concat());
    fs::write(path.join("mine.txt"), "").unwrap();
    fails(&["--out", out, "--force"], 1, &["mine.txt", "not of the earlier export"]);
    fails(&["--out", text(&folder.0), "--force"], 1, &["no earlier export", "nothing was replaced"]);
}

#[test]
fn single_shaders_are_printed() {
    let shader = String::from_utf8(succeeds(&["--stdout", "--target", "wgsl", "--pass", "fill"])).unwrap();
    assert!(shader.contains("fn fill(") && shader.contains("settings "), "{shader}");
    let all = String::from_utf8(succeeds(&["--stdout", "--target", "hlsl", "--single-file"])).unwrap();
    assert!(all.contains("#ifdef LIMPID_FILL") && all.contains("void lobe_filter("));
    let schema: serde_json::Value = serde_json::from_slice(&succeeds(&["--schema"])).unwrap();
    assert!(schema["properties"]["passes"].is_object());
    fails(&["--stdout", "--target", "hlsl", "--pass", "nothing"], 1, &["`nothing`", "classify, fill"]);
    fails(&["--stdout", "--pass", "fill"], 1, &["one --target"]);
    fails(&["--stdout", "--target", "hlsl"], 1, &["--pass NAME"]);
    fails(&["--list", "--single-file"], 1, &["spirv has no preprocessor", "expected hlsl"]);
    fails(&["--list", "--target", "cg"], 2, &["cg", "hlsl, spirv"]);
    fails(&[], 2, &["--out"]);
    fails(&["--list", "--kernels", "nowhere"], 1, &["kernel `classify`", "nowhere/classify.wgsl"]);
}

#[test]
fn watching_writes_again_and_survives_mistakes() {
    let folder = Folder::new("watch");
    let (settings, out) = (folder.join("settings.toml"), folder.join("out"));
    fs::write(&settings, "[coverage]\nfallback = 'black'\n").unwrap();
    let kernels = folder.join("kernels");
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("../kernels");
    fs::create_dir_all(kernels.join("shared")).unwrap();
    for part in ["", "shared"] {
        for file in
            fs::read_dir(source.join(part)).unwrap().map(|file| file.unwrap().path()).filter(|path| path.is_file())
        {
            fs::copy(&file, kernels.join(part).join(file.file_name().unwrap())).unwrap();
        }
    }
    let arguments = ["export", "--watch", "--target", "wgsl", "--settings", text(&settings)];
    let arguments = [&arguments[..], &["--kernels", text(&kernels), "--out", text(&out)]].concat();
    let mut child = Command::new(env!("CARGO_BIN_EXE_limpid")).args(arguments).spawn().unwrap();
    let shader = out.join("wgsl/fill.wgsl");
    let wait_for = |wanted: &str| {
        let found = || fs::read_to_string(&shader).is_ok_and(|text| text.contains(wanted));
        let mut tries = 0;
        while !found() {
            tries += 1;
            assert!(tries < 600, "`{wanted}` never came");
            std::thread::sleep(std::time::Duration::from_millis(50));
        }
    };
    wait_for("vec3<f32>(0.0)");
    fs::write(&settings, "[coverage]\nfallback = 'blue'\n").unwrap();
    std::thread::sleep(std::time::Duration::from_millis(700));
    fs::write(&settings, "[coverage]\nfallback = 'input'\n").unwrap();
    wait_for("textureLoad(in_radiance");
    let kernel = kernels.join("shared/tiles.wgsl");
    let edited = fs::read_to_string(&kernel).unwrap().replace("// Position inside an", "// The position inside an");
    fs::write(&kernel, edited).unwrap();
    wait_for("// The position inside an 8x8 tile");
    child.kill().unwrap();
    child.wait().unwrap();
}
