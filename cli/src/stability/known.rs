//! What is known not to hold, and why.

/// Cases whose name begins so, the criterion, and the reason.
const KNOWN: &[(&str, &str, &str)] = &[
    ("exposed radiance", "bounded", SATURATES),
    ("darker by 1e4", "settling", FLOOR),
    ("from the largest half float", "settling", FLOOR),
    ("noise darker by 1e4", "settling", FLOOR),
    ("fireflies at random", "energy", DARKENS),
    ("noise of a factor", "energy", DARKENS),
];

const SATURATES: &str =
    "exposed radiance is kept in half floats: above 65504 it is clipped, as documented of `exposure`";
const FLOOR: &str = "the published box that history is clipped to is at least 0.001 of exposed radiance wide: what is \
                     ten times brighter or less stays up to that much too bright until history has faded";
const DARKENS: &str = "the published pipeline darkens: its 8x8 average and prefilter prefer dark pixels";

/// Why a criterion need not hold of a case.
pub(super) fn reason(case: &str, criterion: &str) -> Option<&'static str> {
    let entry = KNOWN.iter().find(|(start, name, _)| case.starts_with(start) && *name == criterion);
    entry.map(|(_, _, reason)| *reason)
}

/// Entries that no longer fail, and are to be deleted here.
pub(super) fn repaired(verdicts: &[super::Verdict]) -> Vec<&'static str> {
    let still_fails = |(start, criterion, _): &&(&str, &str, &str)| {
        verdicts.iter().any(|v| !v.passed && v.case.starts_with(start) && v.criterion == *criterion)
    };
    KNOWN.iter().filter(|entry| !still_fails(entry)).map(|(start, ..)| *start).collect()
}
