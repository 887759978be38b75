//! A report as a picture: how near every verdict came to its limit.

use std::fmt::Write;

use super::report::{Report, Verdict};

const WIDTH: f64 = 860.0;
/// Where the dots are, from left to right.
const PLOT: [f64; 2] = [300.0, 830.0];
const TOP: f64 = 64.0;
const ROW: f64 = 30.0;
/// Powers of ten of what was measured over what is allowed; what lies beyond is drawn at the border.
const DECADES: [i32; 2] = [-4, 2];

/// Colours and names of what can come of a verdict.
const OUTCOMES: [(&str, &str); 3] = [("#0072b2", "holds"), ("#e69f00", "known not to hold"), ("#b00020", "fails")];

fn outcome(verdict: &Verdict) -> usize {
    match (verdict.passed, verdict.known) {
        (true, _) => 0,
        (false, Some(_)) => 1,
        (false, None) => 2,
    }
}

fn place(ratio: f64) -> f64 {
    let [low, high] = DECADES.map(f64::from);
    let decade = ratio.max(1e-30).log10().clamp(low, high);
    PLOT[0] + (PLOT[1] - PLOT[0]) * (decade - low) / (high - low)
}

/// A row for each group of cases and in it a dot for each verdict that has a limit to come near to.
pub fn svg(report: &Report) -> String {
    let mut groups: Vec<&str> = report.verdicts.iter().map(|verdict| verdict.group).collect();
    groups.dedup();
    let bottom = TOP + ROW * groups.len() as f64;
    let height = bottom + 44.0;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" width=\"{WIDTH}\" \
         height=\"{height}\" font-family=\"sans-serif\" font-size=\"12\">\n\
         <rect width=\"{WIDTH}\" height=\"{height}\" fill=\"#ffffff\"/>\n\
         <text x=\"16\" y=\"22\" font-size=\"14\" font-weight=\"bold\">Measured over allowed, every verdict</text>\n"
    );
    for (index, (colour, name)) in OUTCOMES.iter().enumerate() {
        let x = PLOT[0] + 150.0 * index as f64;
        let _ = writeln!(
            svg,
            "<circle cx=\"{x}\" cy=\"44\" r=\"5\" fill=\"{colour}\"/><text x=\"{}\" y=\"48\">{name}</text>",
            x + 10.0
        );
    }
    for decade in DECADES[0]..=DECADES[1] {
        let (x, colour) = (place(10f64.powi(decade)), if decade == 0 { "#111111" } else { "#dddddd" });
        let _ = writeln!(
            svg,
            "<path d=\"M{x:.1} {TOP}V{bottom}\" stroke=\"{colour}\"/>\
             <text x=\"{x:.1}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
            bottom + 18.0,
            10f64.powi(decade)
        );
    }
    for (row, group) in groups.iter().enumerate() {
        draw_row(&mut svg, report, group, TOP + ROW * (row as f64 + 0.5));
    }
    svg + "</svg>\n"
}

fn draw_row(svg: &mut String, report: &Report, group: &str, middle: f64) {
    let verdicts: Vec<&Verdict> = report.verdicts.iter().filter(|verdict| verdict.group == group).collect();
    let passed = verdicts.iter().filter(|verdict| verdict.passed).count();
    let _ = writeln!(
        svg,
        "<text x=\"16\" y=\"{0:.1}\">{group}</text>\
         <text x=\"{1}\" y=\"{0:.1}\" text-anchor=\"end\">{passed} of {2}</text>",
        middle + 4.0,
        PLOT[0] - 20.0,
        verdicts.len()
    );
    // Failures are drawn last, above what they would hide under.
    let mut graded: Vec<(usize, &&Verdict)> = verdicts.iter().map(|verdict| (outcome(verdict), verdict)).collect();
    graded.retain(|(outcome, verdict)| *outcome > 0 || verdict.limit > 0.0);
    graded.sort_by_key(|(outcome, _)| *outcome);
    for (index, (outcome, verdict)) in graded.into_iter().enumerate() {
        let ratio = verdict.measured.map_or(f64::INFINITY, |measured| measured / verdict.limit.max(1e-30));
        // Multiples of the golden ratio keep dots apart.
        let lane = (index as f64 * 0.618_033_988_749_895).fract() - 0.5;
        let _ = writeln!(
            svg,
            "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"2.2\" fill=\"{}\" fill-opacity=\"0.6\"/>",
            place(ratio),
            middle + lane * 0.7 * ROW,
            OUTCOMES[outcome].0
        );
    }
}
