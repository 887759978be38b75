//! Verdicts as data and as a table.

use std::collections::BTreeMap;
use std::fmt;

use serde::Serialize;

/// The value that came nearest to breaking a criterion, or farthest beyond it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Worst {
    /// Frame.
    pub frame: usize,
    /// Pixel, from the top left.
    pub pixel: [u32; 2],
    /// Output: radiance and variance. As text, since JSON knows neither NaN nor infinity.
    pub value: String,
    /// What was expected, as text.
    pub expected: String,
}

/// What came of a criterion.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Verdict {
    /// What is extreme about the case.
    pub group: &'static str,
    /// Case.
    pub case: String,
    /// Preset.
    pub preset: &'static str,
    /// Backend.
    pub backend: &'static str,
    /// Criterion.
    pub criterion: &'static str,
    /// What was measured; at most `limit` where it holds. `None` when that is not a finite number.
    pub measured: Option<f64>,
    /// The most that is allowed.
    pub limit: f64,
    /// Whether it holds.
    pub passed: bool,
    /// Why it is known not to hold.
    pub known: Option<&'static str>,
    /// Where it holds worst.
    pub worst: Option<Worst>,
}

impl Verdict {
    /// Measured over allowed, to find the worst of several.
    fn strain(&self) -> f64 {
        let Some(measured) = self.measured else { return f64::INFINITY };
        if self.passed { measured / self.limit.max(1e-30) } else { 1e30 + measured }
    }
}

/// All verdicts of a run.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Report {
    /// In the order of cases.
    pub verdicts: Vec<Verdict>,
}

impl Report {
    /// Criteria that do not hold although nothing says they need not.
    pub fn failures(&self) -> impl Iterator<Item = &Verdict> {
        self.verdicts.iter().filter(|verdict| !verdict.passed && verdict.known.is_none())
    }

    /// Cases that are listed as known failures and no longer fail. Only of a report on all cases.
    pub fn repaired(&self) -> Vec<&'static str> {
        super::known::repaired(&self.verdicts)
    }

    /// A row for each group in Markdown, as docs/stability.md has it.
    pub fn markdown(&self) -> String {
        let mut text = "| group | cases | verdicts | passed | known failures |\n|---|---|---|---|---|\n".to_owned();
        let cases = self.cases();
        let mut groups: Vec<&str> = cases.iter().map(|(group, _)| *group).collect();
        groups.dedup();
        let row = |name: &str, cases: usize, verdicts: &[&Verdict]| {
            let passed = verdicts.iter().filter(|verdict| verdict.passed).count();
            let known = verdicts.iter().filter(|verdict| !verdict.passed && verdict.known.is_some()).count();
            let known = if known > 0 { known.to_string() } else { String::new() };
            format!("| {name} | {cases} | {} | {passed} | {known} |\n", verdicts.len())
        };
        for group in groups {
            let of_group: Vec<&Verdict> = self.verdicts.iter().filter(|verdict| verdict.group == group).collect();
            text += &row(group, cases.iter().filter(|(other, _)| *other == group).count(), &of_group);
        }
        text + &row("all", cases.len(), &self.verdicts.iter().collect::<Vec<_>>())
    }

    /// Names of cases in order.
    fn cases(&self) -> Vec<(&str, &str)> {
        let mut cases: Vec<(&str, &str)> = Vec::new();
        for verdict in &self.verdicts {
            let case = (verdict.group, verdict.case.as_str());
            if !cases.contains(&case) {
                cases.push(case);
            }
        }
        cases
    }
}

fn number(value: Option<f64>) -> String {
    match value {
        None => "not finite".to_owned(),
        Some(value) if value == 0.0 || (1e-3..1e5).contains(&value.abs()) => {
            format!("{value:.4}").trim_end_matches('0').trim_end_matches('.').to_owned()
        }
        Some(value) => format!("{value:.2e}"),
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut last_group = "";
        for (group, case) in self.cases() {
            if group != last_group {
                writeln!(f, "\n{group}")?;
                last_group = group;
            }
            let of_case: Vec<&Verdict> = self.verdicts.iter().filter(|v| v.case == case && v.group == group).collect();
            let passed = of_case.iter().filter(|verdict| verdict.passed).count();
            let word = match of_case.iter().filter(|v| !v.passed).all(|v| v.known.is_some()) {
                true if passed == of_case.len() => "passed",
                true => "known ",
                false => "FAILED",
            };
            // Of what only two answers exist there is no worst, unless it fails.
            let graded = of_case.iter().filter(|v| !v.passed || !matches!(v.criterion, "finite" | "refused"));
            let worst = graded.max_by(|a, b| a.strain().total_cmp(&b.strain()));
            write!(f, "  {word} {passed:>3}/{:<3} {case:<60}", of_case.len())?;
            if let Some(worst) = worst {
                write!(f, " {} {} of {}", worst.criterion, number(worst.measured), number(Some(worst.limit)))?;
                if let Some(at) = &worst.worst {
                    let [x, y] = at.pixel;
                    write!(f, " at ({x}, {y}) of frame {}: {}, expected {}", at.frame, at.value, at.expected)?;
                }
                if !worst.passed {
                    write!(f, " [{} on {}]", worst.preset, worst.backend)?;
                }
            }
            writeln!(f)?;
        }
        let mut reasons: BTreeMap<&str, usize> = BTreeMap::new();
        for reason in self.verdicts.iter().filter(|verdict| !verdict.passed).filter_map(|verdict| verdict.known) {
            *reasons.entry(reason).or_default() += 1;
        }
        writeln!(f)?;
        for (reason, count) in &reasons {
            writeln!(f, "known, {count} verdicts: {reason}")?;
        }
        let known: usize = reasons.values().sum();
        let passed = self.verdicts.iter().filter(|verdict| verdict.passed).count();
        let failed = self.failures().count();
        let cases = self.cases().len();
        writeln!(f, "{cases} cases, {} verdicts: {passed} passed, {failed} failed, {known} known", self.verdicts.len())
    }
}
