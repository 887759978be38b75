//! Scores of a sequence: averages and a plain-text table.

use std::fmt::Write;

use super::{FrameScore, Metrics};

/// Frames that count as late are at least this many after a reset.
const LATE: u32 = 4;

/// The mean over frames of each metric (of flicker over the frames that have one) and the total
/// of non-finite values. Frames that are all sky are left out; without any frame every mean is NaN.
pub fn mean(scores: &[FrameScore]) -> Metrics {
    mean_of(scores.iter().collect())
}

/// The mean over the frames at least four after a reset, where a temporal filter has settled.
/// `None` if there is no such frame.
pub fn late(scores: &[FrameScore]) -> Option<Metrics> {
    let mut age = 0;
    let late: Vec<&FrameScore> = scores
        .iter()
        .filter(|score| {
            age = if score.reset { 0 } else { age + 1 };
            age >= LATE
        })
        .collect();
    (!late.is_empty()).then(|| mean_of(late))
}

fn mean_of(scores: Vec<&FrameScore>) -> Metrics {
    let compared = scores.iter().filter(|s| s.surface_pixels > 0);
    let metrics: Vec<&Metrics> = compared.map(|s| &s.metrics).collect();
    let mean = |f: fn(&Metrics) -> f64| average(metrics.iter().map(|m| f(m))).unwrap_or(f64::NAN);
    Metrics {
        psnr: mean(|m| m.psnr),
        psnr_linear: mean(|m| m.psnr_linear),
        relmse: mean(|m| m.relmse),
        relmse_tone_mapped: mean(|m| m.relmse_tone_mapped),
        flip: mean(|m| m.flip),
        energy: mean(|m| m.energy),
        bias: mean(|m| m.bias),
        flicker: average(metrics.iter().filter_map(|m| m.flicker)),
        non_finite: scores.iter().map(|s| s.metrics.non_finite).sum(),
    }
}

fn average(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0usize), |(sum, count), x| (sum + x, count + 1));
    (count > 0).then(|| sum / count as f64)
}

/// The scores of each frame (`R` marks resets), their mean and, where there is one, the mean of
/// the late frames, as text under `title`.
pub fn table(title: &str, scores: &[FrameScore]) -> String {
    let mut text = format!("{title}\n  frame ");
    for name in ["psnr", "psnr_lin", "relmse", "relmse_tm", "flip", "energy", "bias", "flicker", "nonfinite"] {
        let _ = write!(text, " {name:>10}");
    }
    text.push('\n');
    for score in scores {
        let reset = if score.reset { 'R' } else { ' ' };
        line(&mut text, &format!("{:4}{reset}", score.frame), &score.metrics, "");
    }
    line(&mut text, "mean", &mean(scores), "");
    if let Some(late) = late(scores) {
        line(&mut text, "late", &late, "   (frames at least 4 after a reset)");
    }
    text
}

fn line(text: &mut String, head: &str, m: &Metrics, note: &str) {
    let _ = write!(text, "  {head:<6}");
    for value in [m.psnr, m.psnr_linear, m.relmse, m.relmse_tone_mapped, m.flip, m.energy, m.bias] {
        let _ = write!(text, " {value:10.4}");
    }
    let flicker = m.flicker.map_or("-".to_owned(), |x| format!("{x:.4}"));
    let _ = writeln!(text, " {flicker:>10} {:>10}{note}", m.non_finite);
}
