//! The report as one HTML file that loads nothing.

use std::fmt::Write;

use super::error::{METRICS, REGIONS, Values};
use super::figures;
use super::plot::{escape, short};
use super::record::{Report, VariantInfo};
use super::table::{events, recovery_of};
use super::variant::Group;

const STYLE: &str = "
body { font: 15px/1.5 sans-serif; max-width: 1360px; margin: 2em auto; padding: 0 1em; color: #111; background: #fff }
table { border-collapse: collapse; margin: 1em 0; font-size: 13px }
th, td { padding: 3px 9px; border-bottom: 1px solid #ddd; text-align: right; white-space: nowrap }
th { cursor: pointer; border-bottom: 2px solid #444; position: sticky; top: 0; background: #fff }
th:first-child, td:first-child { text-align: left }
tr:hover td { background: #f1f6fb }
.better { color: #006b3c } .worse { color: #b00020 }
.figures { display: flex; flex-wrap: wrap; gap: 14px } .figures svg { border: 1px solid #ddd; max-width: 100% }
.pictures { display: flex; flex-wrap: wrap; gap: 10px } figure { margin: 0 } figcaption { font-size: 13px }
img { image-rendering: pixelated; max-width: 100%; min-width: 320px }
.scroll { overflow-x: auto } p.note { color: #444; max-width: 60em }
";

/// Sorts a table by the column that was clicked, numbers as numbers.
const SCRIPT: &str = "
document.querySelectorAll('th').forEach(th => th.addEventListener('click', () => {
  const body = th.closest('table').tBodies[0], at = th.cellIndex, down = th.dataset.down = th.dataset.down ? '' : '1';
  const value = row => { const t = row.cells[at].dataset.value || row.cells[at].textContent; const n = parseFloat(t);
    return isNaN(n) ? t : n; };
  [...body.rows].sort((a, b) => { const x = value(a), y = value(b);
    return (x < y ? -1 : x > y ? 1 : 0) * (down ? 1 : -1); }).forEach(row => body.append(row));
}));
";

/// Bytes as base64 (RFC 4648).
fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let byte = |index: usize| u32::from(chunk.get(index).copied().unwrap_or(0));
        let word = byte(0) << 16 | byte(1) << 8 | byte(2);
        for digit in 0..4 {
            let is_there = digit <= chunk.len();
            text.push(if is_there { char::from(DIGITS[(word >> (18 - 6 * digit)) as usize & 63]) } else { '=' });
        }
    }
    text
}

/// A table: header cells with hints, rows of cells that are HTML.
fn table(header: &[(String, String)], rows: &[Vec<String>]) -> String {
    let mut html = "<div class=scroll><table><thead><tr>".to_owned();
    for (name, hint) in header {
        let _ = write!(html, "<th title=\"{}\">{}</th>", escape(hint), escape(name));
    }
    html += "</tr></thead><tbody>\n";
    for row in rows {
        html += "<tr>";
        row.iter().for_each(|cell| html = format!("{html}<td>{cell}</td>"));
        html += "</tr>\n";
    }
    html + "</tbody></table></div>\n"
}

fn plain(names: &[&str]) -> Vec<(String, String)> {
    names.iter().map(|name| ((*name).to_owned(), String::new())).collect()
}

fn metric_header() -> impl Iterator<Item = (String, String)> {
    METRICS.iter().map(|metric| (metric.name.to_owned(), metric.meaning.to_owned()))
}

fn number(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.4}"))
}

fn metric_cells(values: &Values) -> impl Iterator<Item = String> {
    METRICS.iter().map(|metric| number(values.get(metric.name)))
}

fn overview(report: &Report) -> String {
    let mut header = plain(&["variant", "time", "processor time"]);
    header[1].1 = "relative to Reference in the same run, geometric mean over sequences".to_owned();
    header[2].1 = "of all processors together, relative to Reference".to_owned();
    let yardstick = report.variants.iter().find(|info| info.variant.group == Group::Yardstick);
    for what in ["time", "processor time"] {
        header.extend(
            yardstick.map(|info| (format!("{what} / {}", info.variant.name), "by way of Reference".to_owned())),
        );
    }
    header.extend(metric_header());
    let rows: Vec<_> = report
        .variants
        .iter()
        .map(|info| {
            let variant = &info.variant;
            let name = format!("<span title=\"{}\">{}</span>", escape(&variant.note), escape(&variant.name));
            let ratios = [report.overall_ratio(&variant.name), report.overall_cpu_ratio(&variant.name)];
            let mut row = vec![name, number(ratios[0]), number(ratios[1])];
            if yardstick.is_some() {
                let ratios = report.ratio_to_yardstick(&variant.name);
                row.extend([0, 1].map(|index| number(ratios.map(|ratios| ratios[index]))));
            }
            row.extend(metric_cells(&report.overall(&variant.name)));
            row
        })
        .collect();
    table(&header, &rows)
}

/// `without - with`, red where it is a loss to be without.
fn difference(pair: Option<(f64, f64)>, is_loss: impl Fn(f64, f64) -> bool) -> String {
    let Some((without, with)) = pair else { return "-".to_owned() };
    let class = match (without - with).abs() < 5e-5 {
        true => "",
        false if is_loss(without, with) => "worse",
        false => "better",
    };
    format!("<span class=\"{class}\">{:+.4}</span>", without - with)
}

/// Costs that the table of ablations shows, of [`Counts::named`](super::counts::Counts::named).
const ABLATION_COUNTS: [&str; 5] =
    ["dispatches", "bytes read", "bytes written", "bytes allocated", "SPIR-V instructions"];

/// What each feature costs and buys: without the feature minus the default preset.
fn ablations(report: &Report) -> String {
    let info_of = |group: Group| report.variants.iter().filter(move |info| info.variant.group == group);
    let Some(base) = info_of(Group::Preset).find(|info| info.variant.name == "default") else { return String::new() };
    let base_values = report.overall(&base.variant.name);
    let count = |info: &VariantInfo, name: &str| {
        let named = info.counts.as_ref()?.named();
        named.into_iter().find(|(other, _)| other == name).map(|(_, value)| value)
    };
    let mut header = plain(&["without", "what", "time", "processor time"]);
    header.extend(ABLATION_COUNTS.map(|name| (name.to_owned(), "when every pixel is denoised".to_owned())));
    header.extend(metric_header());
    let more = |without: f64, with: f64| without > with;
    let row = |info: &VariantInfo| {
        let (name, with) = (info.variant.name.as_str(), base.variant.name.as_str());
        let ratios = [
            report.overall_ratio(name).zip(report.overall_ratio(with)),
            report.overall_cpu_ratio(name).zip(report.overall_cpu_ratio(with)),
        ];
        let mut row = vec![escape(name), escape(&info.variant.note)];
        row.extend(ratios.map(|pair| difference(pair, more)));
        row.extend(ABLATION_COUNTS.map(|name| difference(count(info, name).zip(count(base, name)), more)));
        let values = report.overall(name);
        row.extend(METRICS.iter().map(|metric| {
            let pair = values.get(metric.name).zip(base_values.get(metric.name));
            difference(pair, |without, with| metric.badness(without) > metric.badness(with))
        }));
        row
    };
    let rows: Vec<_> = info_of(Group::Ablation).map(row).collect();
    if rows.is_empty() {
        return String::new();
    }
    format!(
        "<h2>What each feature costs and buys</h2><p class=note>The default preset with one feature left out, minus the \
         default preset: red is what is lost without it, green what is gained. Bytes are a pixel.</p>{}",
        table(&header, &rows)
    )
}

fn details(report: &Report) -> String {
    let mut header = plain(&[
        "sequence",
        "variant",
        "ms",
        "quarter below",
        "quarter above",
        "processor ms",
        "ratio",
        "processor ratio",
    ]);
    header.extend(metric_header());
    let rows: Vec<_> = report
        .runs
        .iter()
        .map(|run| {
            let mut row = vec![escape(&run.sequence), escape(&run.variant)];
            let times = run.times.as_ref();
            let values = times.map(|t| [t.frame.median, t.frame.low, t.frame.high, t.cpu.median, t.ratio, t.cpu_ratio]);
            (0..6).for_each(|index| row.push(number(values.map(|values| values[index]))));
            row.extend(metric_cells(&run.mean));
            row
        })
        .collect();
    table(&header, &rows)
}

fn passes(report: &Report) -> String {
    let timed = report.runs.iter().filter_map(|run| Some((run, run.times.as_ref()?)));
    let rows: Vec<_> = timed
        .flat_map(|(run, times)| {
            times
                .passes
                .iter()
                .map(|(pass, ms)| vec![escape(&run.sequence), escape(&run.variant), escape(pass), format!("{ms:.4}")])
        })
        .collect();
    if rows.is_empty() {
        return "<p class=note>The device has no clock for single passes.</p>".to_owned();
    }
    table(&plain(&["sequence", "variant", "pass", "ms, median"]), &rows)
}

fn counts(report: &Report) -> String {
    let with = || report.variants.iter().filter_map(|info| Some((&info.variant.name, info.counts.as_ref()?.named())));
    let Some((_, first)) = with().next() else { return String::new() };
    let mut header = plain(&["variant"]);
    header.extend(first.iter().map(|(name, _)| (name.clone(), String::new())));
    let rows: Vec<_> = with()
        .map(|(variant, counts)| {
            let cells = first
                .iter()
                .map(|(name, _)| number(counts.iter().find(|(other, _)| other == name).map(|(_, value)| *value)));
            std::iter::once(escape(variant)).chain(cells).collect()
        })
        .collect();
    table(&header, &rows)
}

/// Statistics of a GPU's compiler that are shown, and what they are called here.
const COMPILED: &[(&str, &str)] =
    &[("VGPRs", "VGPRs"), ("Instructions", "instructions"), ("Subgroups per SIMD", "waves")];

fn compiled(report: &Report) -> String {
    let with = || report.variants.iter().filter_map(|info| Some((&info.variant.name, info.compiled.as_ref()?)));
    let Some(gpu) = with().next().map(|(_, cost)| cost.gpu.clone()) else { return String::new() };
    let mut passes: Vec<&str> = Vec::new();
    for pass in with().flat_map(|(_, cost)| &cost.passes) {
        if !passes.contains(&pass.pass.as_str()) {
            passes.push(&pass.pass);
        }
    }
    let columns = || passes.iter().flat_map(|pass| COMPILED.iter().map(move |(name, title)| (*pass, *name, *title)));
    let mut header = plain(&["variant"]);
    header.extend(columns().map(|(pass, _, title)| (format!("{pass} {title}"), String::new())));
    let rows: Vec<_> = with()
        .map(|(variant, cost)| {
            let cell = |(pass, name, _): (&str, &str, &str)| {
                let value = cost.passes.iter().find(|other| other.pass == pass).and_then(|pass| pass.get(name));
                value.map_or_else(|| "-".to_owned(), |value| value.to_string())
            };
            std::iter::once(escape(variant)).chain(columns().map(cell)).collect()
        })
        .collect();
    format!(
        "<h2>Compiled for {}</h2><p class=note>By Mesa's driver RADV, without that GPU: limpid cost.</p>{}",
        escape(&gpu),
        table(&header, &rows)
    )
}

fn recovery(report: &Report) -> String {
    let rows: Vec<_> = events(report)
        .flat_map(|(sequence, what, first, end)| {
            report.variants.iter().filter_map(move |info| {
                let run = report.run(sequence, &info.variant.name)?;
                let (frames, settled) = recovery_of(run, first, end)?;
                Some(vec![escape(what), escape(&info.variant.name), frames.to_string(), format!("{settled:.4}")])
            })
        })
        .collect();
    if rows.is_empty() {
        return String::new();
    }
    format!(
        "<h2>Recovery</h2><p class=note>Frames until the error is no more than 10 % above what it settles at before the \
         next event (mean of the last quarter). Few frames are good only where the settled error is low.</p>{}",
        table(&plain(&["event", "variant", "frames", "settled rms"]), &rows)
    )
}

/// Errors by kind of pixel, of all but ablations.
fn regions(report: &Report) -> String {
    let shown = || report.variants.iter().map(|info| &info.variant).filter(|v| v.group != Group::Ablation);
    let meaning = |name: &str| METRICS.iter().find(|metric| metric.name == name).map_or("", |metric| metric.meaning);
    let mut header = plain(&["sequence", "variant"]);
    header.extend(REGIONS.map(|name| (name.to_owned(), meaning(name).to_owned())));
    let rows: Vec<_> = report
        .sequences
        .iter()
        .flat_map(|sequence| shown().filter_map(|variant| report.run(&sequence.name, &variant.name)))
        .map(|run| {
            let names = [escape(&run.sequence), escape(&run.variant)];
            names.into_iter().chain(REGIONS.map(|name| number(run.mean.get(name)))).collect()
        })
        .collect();
    format!(
        "<h2>Error by kind of pixel</h2><p class=note>Root mean squared error where the surface was just uncovered, on \
         mirrors, on rough surfaces, and beside fireflies of the input. A dash where a sequence has no such pixels; their \
         shares are in the table of sequences below.</p>{}",
        table(&header, &rows)
    )
}

fn sequences(report: &Report) -> String {
    let mut header = plain(&["sequence", "size", "frames", "PSNR of the converged image"]);
    header.extend(REGIONS.map(|name| (format!("{name} %"), "share of pixels".to_owned())));
    let rows: Vec<_> = report
        .sequences
        .iter()
        .map(|s| {
            let size = format!("{}x{}", s.size.x, s.size.y);
            let mut row = vec![escape(&s.name), size, s.frames.to_string(), number(s.limit)];
            row.extend(REGIONS.map(|name| s.shares.get(name).map_or_else(String::new, |share| short(share * 100.0))));
            row
        })
        .collect();
    table(&header, &rows)
}

/// The whole page. `pictures` are captions and PNG files.
pub fn page(report: &Report, pictures: &[(String, Vec<u8>)]) -> String {
    let mut html = format!(
        "<!doctype html>\n<html lang=en><meta charset=utf-8><title>limpid bench</title><style>{STYLE}</style>\n\
         <h1>limpid bench</h1><p class=note>limpid {} on {}. {} frames a scene, {} rays a pixel in references, each \
         frame timed {} times. Errors are of radiance after x / (1 + x); hover over a heading for its definition, \
         click to sort. Times are of this machine; ratios are to the Reference preset, frame by frame in turn.</p>\n",
        escape(&report.limpid),
        escape(&report.device),
        report.config.frames,
        report.config.samples,
        report.config.repetitions
    );
    let all = figures(report);
    let show = |prefix: &str| {
        let shown = all.iter().filter(|(name, _)| name.starts_with(prefix)).map(|(_, svg)| svg.as_str());
        format!("<div class=figures>{}</div>\n", shown.collect::<String>())
    };
    html = html + "<h2>Error against run time</h2>" + &show("pareto");
    html += "<p class=note>Means over all sequences but `events`, which is for recovery. `reference` is the preset, not the \
             converged image.</p>";
    html = html + &overview(report);
    html = html + &regions(report) + &ablations(report);
    html = html + "<h2>Convergence</h2>" + &show("convergence") + &recovery(report) + &show("recovery");
    html = html + "<h2>Scaling</h2>" + &show("scaling");
    html += "<h2>Costs that are the same everywhere</h2><p class=note>Of a frame in which every pixel is denoised. \
             Bytes are a pixel; each resource counts once a pass, taps around a pixel come from caches.</p>";
    html = html + &counts(report) + &compiled(report);
    html = html + "<h2>Passes</h2>" + &passes(report);
    html += "<h2>Last frames</h2><div class=pictures>";
    for (caption, png) in pictures {
        let _ = writeln!(
            html,
            "<figure><img alt=\"{0}\" src=\"data:image/png;base64,{1}\"><figcaption>{0}</figcaption></figure>",
            escape(caption),
            base64(png)
        );
    }
    html = html + "</div>\n<h2>Sequences</h2>" + &sequences(report) + "<h2>All numbers</h2>" + &details(report);
    html + "<script>" + SCRIPT + "</script></html>\n"
}

#[cfg(test)]
mod tests {
    use super::base64;

    #[test]
    fn base64_is_that_of_the_rfc() {
        let of = |text: &str| base64(text.as_bytes());
        assert_eq!([of(""), of("f"), of("fo"), of("foo"), of("foob")], ["", "Zg==", "Zm8=", "Zm9v", "Zm9vYg=="]);
    }
}
