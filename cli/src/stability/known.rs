//! What is known not to hold, and why.

/// Cases whose name begins so, the criterion, the presets, and the reason.
const KNOWN: &[(&str, &str, &[&str], &str)] = &[
    ("exposed radiance", "bounded", ALL, SATURATES),
    ("darker by 1e4", "settling", PUBLISHED, FLOOR),
    ("from the largest half float", "settling", PUBLISHED, FLOOR),
    ("noise darker by 1e4", "settling", PUBLISHED, FLOOR),
    ("fireflies at random", "energy", PUBLISHED, DARKENS),
    ("fireflies at random", "energy", FOOTPRINT, LIMITED),
    ("noise of a factor", "energy", PUBLISHED, DARKENS),
];

const ALL: &[&str] = &["default", "fast", "reference"];
const FOOTPRINT: &[&str] = &["default", "fast"];
const PUBLISHED: &[&str] = &["reference"];

const SATURATES: &str =
    "exposed radiance is kept in half floats: above 65504 it is clipped, as documented of `exposure`";
const FLOOR: &str = "the published box that history is clipped to is at least 0.001 of exposed radiance wide: what is \
                     ten times brighter or less stays up to that much too bright until history has faded";
const DARKENS: &str = "the published pipeline darkens: its 8x8 average and prefilter prefer dark pixels";
const LIMITED: &str = "what is cut off from outliers comes back up to `accumulate.excess_limit` times the mean around: \
                       of samples a million times brighter hardly any of it";

/// Why a criterion need not hold of a case with a preset.
pub(super) fn reason(case: &str, criterion: &str, preset: &str) -> Option<&'static str> {
    let is_it = |(start, name, presets, _): &&(&str, &str, &[&str], &str)| {
        case.starts_with(start) && *name == criterion && presets.contains(&preset)
    };
    KNOWN.iter().find(is_it).map(|(.., reason)| *reason)
}

/// Entries that no longer fail, and are to be deleted here.
pub(super) fn repaired(verdicts: &[super::Verdict]) -> Vec<&'static str> {
    let still_fails = |start: &str, criterion: &str, preset: &str| {
        let is_it = |v: &super::Verdict| v.case.starts_with(start) && v.criterion == criterion && v.preset == preset;
        verdicts.iter().any(|v| !v.passed && is_it(v))
    };
    let entries = KNOWN
        .iter()
        .filter(|(start, criterion, presets, _)| presets.iter().any(|preset| !still_fails(start, criterion, preset)));
    entries.map(|(start, ..)| *start).collect()
}
