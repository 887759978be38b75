//! All backends leave the same in memory, over the built-in scenes and, where `LIMPID_PEER_DATA` names a folder with
//! them, over the public sequences.

use std::collections::BTreeMap;
use std::path::Path;

use glam::UVec2;
use limpid::{Preset, Settings};
use limpid_cli::scene;
use limpid_cli::sequence::{ChannelNames, Sequence};
use limpid_harness::{Case, Executor, Table, executors};

mod frames;

use frames::case;

/// One of each pipeline, and near taps alone, of which pixels side by side take different numbers.
fn variants() -> [(&'static str, Settings); 3] {
    let mut narrow = Preset::Fast.settings();
    narrow.features.wide_filter = false;
    [
        ("default", Settings::default()),
        ("fast without wide filter", narrow),
        ("reference", Preset::Reference.settings()),
    ]
}

fn is_first_on_device(all: &[Box<dyn Executor>], index: usize) -> bool {
    all[..index].iter().all(|other| other.device() != all[index].device())
}

/// Runs cases on every executor: the same bits on the same device, and close otherwise.
fn check(cases: &[(String, Case)]) {
    let mut all = executors();
    let mut tables = BTreeMap::<(usize, usize), Table>::new();
    for (name, case) in cases {
        let runs: Vec<_> = all.iter_mut().map(|executor| case.run(executor.as_mut())).collect();
        for i in 0..runs.len() {
            for j in 0..i {
                if all[i].device() == all[j].device() {
                    assert!(runs[i] == runs[j], "{name}: {} and {} differ", all[i].name(), all[j].name());
                    continue;
                }
                // Other backends on the same device add nothing.
                if !(is_first_on_device(&all, i) && is_first_on_device(&all, j)) {
                    continue;
                }
                let table = tables.entry((i, j)).or_default();
                runs[i].iter().zip(&runs[j]).for_each(|(a, b)| table.add(a, b));
            }
        }
    }
    for ((i, j), table) in &tables {
        println!("{} and {}\n{table}", all[*i].name(), all[*j].name());
        for (name, agreement) in &table.0 {
            // The last digits of functions differ between devices (tests/precision.rs), which becomes a step of a
            // half float now and then and, rarely, another decision at a threshold.
            assert!(agreement.differing() < 0.01, "{name}");
            assert!((agreement.far as f64) < 0.0015 * agreement.values as f64, "{name}");
        }
    }
}

#[test]
fn the_built_in_scenes_are_the_same_everywhere() {
    let size = UVec2::new(120, 68);
    for (variant, settings) in variants() {
        let cases: Vec<_> = ["gallery", "courtyard", "mirrors", "dolly"]
            .map(|name| {
                let scene = scene::by_name(name).unwrap();
                let frames = (0..6).map(|number| scene.render(number, size, 0));
                (format!("{name}, {variant}"), case(&settings, frames))
            })
            .into();
        check(&cases);
    }
}

#[test]
fn the_public_sequences_are_the_same_everywhere() {
    let Some(data) = std::env::var_os("LIMPID_PEER_DATA") else {
        use std::io::Write;
        // Past the harness, which keeps to itself what a passing test prints.
        let _ = writeln!(std::io::stderr(), "SKIPPED: LIMPID_PEER_DATA names no folder with the public sequences");
        return;
    };
    for (variant, settings) in variants() {
        let cases: Vec<_> = ["glossy-room", "orbit"]
            .map(|name| {
                let folder = Path::new(&data).join("public").join(name);
                let sequence = Sequence::open(&folder, &ChannelNames::default()).unwrap();
                let frames = (0..sequence.len().min(6)).map(|index| sequence.load(index).unwrap());
                (format!("{name}, {variant}"), case(&settings, frames))
            })
            .into();
        check(&cases);
    }
}
