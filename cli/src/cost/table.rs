//! Costs for people to read.

use glam::UVec2;
use limpid::Settings;

use super::{Cost, GENERATIONS, PassCost};
use crate::bench::counts::Counts;

/// Title of a column, and the statistics whose sum it shows, as RADV names them.
const COLUMNS: &[(&str, &[&str])] = &[
    ("VGPRs", &["VGPRs"]),
    ("SGPRs", &["SGPRs"]),
    ("spilled", &["Spilled VGPRs", "Spilled SGPRs"]),
    ("LDS bytes", &["LDS size"]),
    ("instructions", &["Instructions"]),
    ("code bytes", &["Code size"]),
    ("waves", &["Subgroups per SIMD"]),
];

fn is_radv(passes: &[&PassCost]) -> bool {
    passes.iter().all(|pass| pass.get("VGPRs").is_some())
}

/// Titles and how to fill them: the columns above, or everything that another driver gives.
fn columns(passes: &[&PassCost]) -> Vec<(String, Vec<String>)> {
    let owned = |names: &[&str]| names.iter().map(|name| name.to_string()).collect();
    if is_radv(passes) {
        return COLUMNS.iter().map(|(title, names)| (title.to_string(), owned(names))).collect();
    }
    let mut all: Vec<(String, Vec<String>)> = Vec::new();
    for statistic in passes.iter().flat_map(|pass| &pass.statistics) {
        if all.iter().all(|(title, _)| *title != statistic.name) {
            all.push((statistic.name.clone(), vec![statistic.name.clone()]));
        }
    }
    all
}

fn cell(pass: &PassCost, names: &[String]) -> String {
    let values: Vec<f64> = names.iter().filter_map(|name| pass.get(name)).collect();
    if values.is_empty() { "-".to_owned() } else { values.iter().sum::<f64>().to_string() }
}

/// A table with a row for each pass and GPU, the GPUs of a pass together.
pub fn table(costs: &[Cost]) -> String {
    let passes: Vec<&PassCost> = costs.iter().flat_map(|cost| &cost.passes).collect();
    let columns = columns(&passes);
    let mut names: Vec<&str> = Vec::new();
    for pass in &passes {
        if !names.contains(&pass.pass.as_str()) {
            names.push(&pass.pass);
        }
    }
    let titles = ["pass", "GPU", "wave size"].map(str::to_owned).into_iter();
    let mut rows: Vec<Vec<String>> = vec![titles.chain(columns.iter().map(|(title, _)| title.clone())).collect()];
    for name in names {
        for cost in costs {
            for pass in cost.passes.iter().filter(|pass| pass.pass == name) {
                let head = [name.to_owned(), cost.gpu.clone(), pass.subgroup_size.to_string()].into_iter();
                rows.push(head.chain(columns.iter().map(|(_, names)| cell(pass, names))).collect());
            }
        }
    }
    aligned(&rows) + &legend(costs)
}

/// Bandwidths of GPUs that share memory with a CPU, of mid-range and of large ones, in bytes a second.
const BANDWIDTHS: [f64; 3] = [100e9, 300e9, 900e9];

/// What the passes move through memory, and the least time that takes.
///
/// # Errors
///
/// As [`limpid::Plan::new`].
pub fn traffic(settings: &Settings) -> Result<String, limpid::Error> {
    let size = UVec2::new(1920, 1080);
    let counts = Counts::new(settings, size)?;
    let bytes = (counts.bytes_read + counts.bytes_written) * f64::from(size.x) * f64::from(size.y);
    let times = BANDWIDTHS.map(|rate| format!("{:.2} ms at {:.0} GB/s", bytes / rate * 1e3, rate / 1e9));
    Ok(format!(
        "Each pixel reads {:.1} bytes and writes {:.1}: at {}x{} at least {}.\n",
        counts.bytes_read,
        counts.bytes_written,
        size.x,
        size.y,
        times.join(", ")
    ))
}

/// What the names of GPUs stand for.
fn legend(costs: &[Cost]) -> String {
    let known = costs.iter().filter_map(|cost| GENERATIONS.iter().find(|generation| generation.name == cost.gpu));
    known.map(|generation| format!("{}: {}\n", generation.name, generation.description)).collect()
}

/// Words to the left in the first two columns, numbers to the right in the others.
fn aligned(rows: &[Vec<String>]) -> String {
    let width = |column: usize| rows.iter().filter_map(|row| row.get(column)).map(String::len).max().unwrap_or(0);
    let cell = |(column, text): (usize, &String)| {
        let width = width(column);
        if column < 2 { format!("{text:<width$}") } else { format!("{text:>width$}") }
    };
    let line = |row: &Vec<String>| row.iter().enumerate().map(cell).collect::<Vec<_>>().join("  ") + "\n";
    rows.iter().map(line).collect()
}
