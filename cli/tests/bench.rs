//! `limpid bench` as its users and CI run it.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use limpid_cli::bench::{Report, Run};

fn limpid(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_limpid")).args(arguments).output().unwrap()
}

fn errors(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// A folder of its own for a test.
fn folder(name: &str) -> PathBuf {
    let path = std::env::temp_dir().join(format!("limpid-bench-{name}-{}", std::process::id()));
    let _ = fs::remove_dir_all(&path);
    path
}

/// Errors and counts at a small size, which are the same in every run on the CPU.
fn bench(out: &Path, more: &[&str]) -> Output {
    let out = out.to_str().unwrap();
    let base = ["bench", "--backend", "cpu", "--size", "64x36", "--frames", "6", "--samples", "8", "--repetitions"];
    limpid(&[&base, &["0", "--out", out][..], more].concat())
}

fn succeeds(output: &Output) {
    assert!(output.status.success(), "{}", errors(output));
}

fn report(folder: &Path) -> Report {
    serde_json::from_str(&fs::read_to_string(folder.join("bench.json")).unwrap()).unwrap()
}

/// Fails when an error or a count is worse than the approved one. `BENCH=accept` approves what is there now.
#[test]
fn errors_and_counts_are_no_worse_than_approved() {
    let approved = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/approved/bench.json");
    let out = folder("gate");
    succeeds(&bench(&out, &["--scene", "gallery", "--scene", "dolly", "--scene", "events", "--no-ablations"]));
    let now = out.join("bench.json");
    if std::env::var_os("BENCH").is_some_and(|value| value == "accept") {
        fs::copy(&now, &approved).unwrap();
    }
    let compared = limpid(&["bench", "--compare", approved.to_str().unwrap(), now.to_str().unwrap()]);
    assert!(compared.status.success(), "{}{}", String::from_utf8_lossy(&compared.stdout), errors(&compared));
    fs::remove_dir_all(out).unwrap();
}

#[test]
fn what_was_interrupted_goes_on() {
    let (whole, parts) = (folder("whole"), folder("parts"));
    let scenes =
        ["--scene", "still", "--scene", "mirrors", "--no-ablations", "--set", "footprint.filter_scale=0.2,0.9"];
    succeeds(&bench(&whole, &scenes));
    succeeds(&bench(&parts, &["--scene", "still", "--no-ablations"]));
    let again = bench(&parts, &scenes);
    assert!(!again.status.success() && errors(&again).contains("--resume"), "{}", errors(&again));
    succeeds(&bench(&parts, &[&scenes[..], &["--resume"]].concat()));
    let (mut whole_report, mut parts_report) = (report(&whole), report(&parts));
    let order =
        |report: &mut Report| report.runs.sort_by(|a, b| (&a.sequence, &a.variant).cmp(&(&b.sequence, &b.variant)));
    order(&mut whole_report);
    order(&mut parts_report);
    // Two sequences; noisy, accumulation, three presets and two values.
    assert_eq!(whole_report.runs.len(), 14);
    assert_eq!(whole_report, parts_report);
    for file in
        ["report.html", "bench.csv", "measured.md", "figures/convergence-still.svg", "pictures/mirrors--default.png"]
    {
        assert!(parts.join(file).is_file(), "{file}");
    }
    // A worse setting is noticed, and time never is.
    let mut worse = whole_report.clone();
    for run in worse.runs.iter_mut().filter(|run| run.variant == "default") {
        run.frames = whole_report.run(&run.sequence, "noisy").unwrap().frames.clone();
        run.mean = whole_report.run(&run.sequence, "noisy").unwrap().mean.clone();
    }
    let worse_path = parts.join("worse.json");
    fs::write(&worse_path, serde_json::to_string(&worse).unwrap()).unwrap();
    let compared =
        limpid(&["bench", "--compare", whole.join("bench.json").to_str().unwrap(), worse_path.to_str().unwrap()]);
    assert_eq!(compared.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&compared.stdout).contains("default on still"), "{compared:?}");
    fs::remove_dir_all(whole).unwrap();
    fs::remove_dir_all(parts).unwrap();
}

/// Where Python has the package, the network beats its input and both have times; elsewhere the rest is measured.
#[test]
fn a_yardstick_is_measured_or_skipped_aloud() {
    let out = folder("yardstick");
    let yardstick = ["--scene", "still", "--no-ablations", "--yardstick", "oidn"];
    let timed = ["--repetitions", "1", "--scaling-seconds", "0", "--out", out.to_str().unwrap()];
    let small = ["bench", "--backend", "cpu", "--size", "64x36", "--frames", "4", "--samples", "8"];
    let output = limpid(&[&small[..], &yardstick, &timed].concat());
    succeeds(&output);
    let report = report(&out);
    assert!(report.run("still", "default").is_some());
    match report.run("still", "oidn") {
        Some(run) => {
            let psnr = |run: &Run| run.mean.get("psnr").unwrap();
            assert!(psnr(run) > psnr(report.run("still", "noisy").unwrap()) + 2.0);
            assert!(run.times.as_ref().is_some_and(|times| times.cpu.median > 0.0));
            assert_eq!(report.ratio_to_yardstick("oidn"), Some([1.0; 2]));
        }
        None => {
            assert!(errors(&output).contains("SKIPPED: yardstick oidn"), "{}", errors(&output));
            eprintln!("SKIPPED: the yardstick is not installed");
        }
    }
    fs::remove_dir_all(&out).unwrap();
    // Without Python at all.
    let mut command = Command::new(env!("CARGO_BIN_EXE_limpid"));
    let output = command.args(small).args(yardstick).args(timed).env("PATH", "").output().unwrap();
    succeeds(&output);
    assert!(errors(&output).contains("SKIPPED: yardstick oidn"), "{}", errors(&output));
    fs::remove_dir_all(out).unwrap();
}

#[test]
fn mistakes_are_named() {
    let out = folder("mistakes");
    for (arguments, expected) in [
        (&["--scene", "nowhere"][..], "no scene `nowhere`"),
        (&["--scene", "still", "--set", "resolve.stability=0.5,7"], "`resolve.stability` is 7"),
        (&["--scene", "still", "--preset", "best"], "no preset `best`"),
        (&["--scene", "still", "--scene", "still", "--no-ablations"], "two sequences are called `still`"),
        (&["--compare", "a.json", "b.json"], "cannot read a.json"),
    ] {
        let output = bench(&out, arguments);
        assert!(!output.status.success() && errors(&output).contains(expected), "{}", errors(&output));
    }
    let _ = fs::remove_dir_all(out);
}
