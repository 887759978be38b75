//! The plots of a report.

use super::plot::{Axis, Plot, Series, Style};
use super::record::{Report, SequenceInfo};
use super::table::events;
use super::variant::{ACCUMULATION, Group, NOISY};

fn group_name(group: Group) -> &'static str {
    match group {
        Group::Baseline => "baselines",
        Group::Yardstick => "not limpid",
        Group::Preset => "presets",
        Group::Chosen => "chosen settings",
        Group::Ablation => "default without one feature",
    }
}

/// Error against time: of one sequence, or over all.
fn pareto(report: &Report, sequence: Option<&SequenceInfo>) -> Plot {
    let psnr = |variant: &str| match sequence {
        Some(sequence) => report.run(&sequence.name, variant).and_then(|run| run.mean.get("psnr")),
        None => report.overall(variant).get("psnr"),
    };
    let time = |variant: &str| match sequence {
        Some(sequence) => report.run(&sequence.name, variant)?.times.as_ref().map(|times| times.ratio),
        None => report.overall_ratio(variant),
    };
    let groups = [Group::Preset, Group::Chosen, Group::Ablation, Group::Yardstick];
    let series = groups.into_iter().filter_map(|group| {
        let of_group = report.variants.iter().map(|info| &info.variant).filter(|variant| variant.group == group);
        let points: Vec<_> = of_group.filter_map(|v| Some((time(&v.name)?, psnr(&v.name)?, v.name.clone()))).collect();
        let name = group_name(group).to_owned();
        (!points.is_empty()).then_some(Series { name, style: Style::Points, points })
    });
    let baselines = [NOISY, ACCUMULATION].into_iter().filter_map(|name| Some((name.to_owned(), psnr(name)?)));
    let limit =
        sequence.and_then(|sequence| sequence.limit).map(|limit| ("noise of the converged image".to_owned(), limit));
    let of = sequence.map_or("all sequences", |sequence| sequence.name.as_str());
    Plot {
        title: format!("Error against run time, {of}"),
        x: Axis::linear("run time, multiple of the Reference preset's"),
        y: Axis::linear("PSNR in dB, higher is better"),
        series: series.collect(),
        levels: baselines.chain(limit).collect(),
        marks: Vec::new(),
    }
}

/// A line for each variant that is no ablation, of a metric over the frames of a sequence.
fn over_frames(report: &Report, sequence: &SequenceInfo, metric: &str) -> Vec<Series> {
    let shown = report.variants.iter().map(|info| &info.variant).filter(|variant| variant.group != Group::Ablation);
    let line = |name: &str| {
        let run = report.run(&sequence.name, name)?;
        let points = run.frames.iter().enumerate();
        let points: Vec<_> = points
            .filter_map(|(index, v)| Some((index as f64, v.get(metric)?, format!("{name}, frame {index}"))))
            .collect();
        Some(Series { name: name.to_owned(), style: Style::Line, points })
    };
    shown.filter_map(|variant| line(&variant.name)).collect()
}

fn convergence(report: &Report, sequence: &SequenceInfo) -> Plot {
    Plot {
        title: format!("Convergence, {}", sequence.name),
        x: Axis::linear("frame"),
        y: Axis::linear("PSNR in dB, higher is better"),
        series: over_frames(report, sequence, "psnr"),
        levels: Vec::new(),
        marks: Vec::new(),
    }
}

fn recovery(report: &Report, sequence: &SequenceInfo) -> Plot {
    let marks = events(report).filter(|(name, ..)| *name == sequence.name);
    Plot {
        title: format!("Recovery, {}", sequence.name),
        x: Axis::linear("frame"),
        y: Axis::logarithmic("rms error, lower is better"),
        series: over_frames(report, sequence, "rms"),
        levels: Vec::new(),
        marks: marks.map(|(_, what, frame, _)| (what.to_owned(), frame as f64)).collect(),
    }
}

/// Time a pixel by size, or time of a frame by share of tiles.
fn scaling(report: &Report, by_share: bool) -> Plot {
    let all = report.scaling.iter().map(|point| point.variant.as_str());
    let mut names: Vec<&str> = all.collect();
    names.dedup();
    // Shares are at one size, where there also is a point with all tiles.
    let share_size = report.scaling.iter().find(|point| point.share < 1.0).map(|point| point.size);
    let series = names.into_iter().map(|name| {
        let own = report.scaling.iter().filter(|point| point.variant == name);
        let mut points: Vec<_> = if by_share {
            let own = own.filter(|point| Some(point.size) == share_size);
            own.map(|p| (p.share * 100.0, p.time.median, format!("{name} at {:.0} %", p.share * 100.0))).collect()
        } else {
            let own = own.filter(|point| point.share == 1.0);
            own.map(|p| {
                let pixels = f64::from(p.size.x) * f64::from(p.size.y);
                (pixels / 1e6, p.time.median * 1e6 / pixels, format!("{name} at {}x{}", p.size.x, p.size.y))
            })
            .collect()
        };
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        Series { name: name.to_owned(), style: Style::Line, points }
    });
    let size = share_size.map_or_else(String::new, |size| format!(", {}x{}", size.x, size.y));
    Plot {
        title: if by_share {
            format!("Run time by tiles that need denoising{size}")
        } else {
            "Run time by size".into()
        },
        x: if by_share { Axis::linear("tiles that need denoising, %") } else { Axis::logarithmic("megapixels") },
        y: Axis::from_zero(if by_share { "ms a frame" } else { "ns a pixel" }),
        series: series.collect(),
        levels: Vec::new(),
        marks: Vec::new(),
    }
}

/// File name and SVG of every figure that has data.
pub fn figures(report: &Report) -> Vec<(String, String)> {
    let mut plots = vec![("pareto".to_owned(), pareto(report, None))];
    let sequences = || report.sequences.iter().filter(|sequence| sequence.events.is_empty());
    plots.extend(sequences().map(|s| (format!("pareto-{}", s.name), pareto(report, Some(s)))));
    plots.extend(sequences().map(|s| (format!("convergence-{}", s.name), convergence(report, s))));
    let eventful = report.sequences.iter().filter(|sequence| !sequence.events.is_empty());
    plots.extend(eventful.map(|s| (format!("recovery-{}", s.name), recovery(report, s))));
    plots.push(("scaling-size".to_owned(), scaling(report, false)));
    plots.push(("scaling-tiles".to_owned(), scaling(report, true)));
    let drawn = plots.into_iter().map(|(name, plot)| (name, plot.svg()));
    drawn.filter(|(_, svg)| !svg.is_empty()).collect()
}
