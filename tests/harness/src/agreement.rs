use std::collections::BTreeMap;
use std::fmt;

use crate::Snapshot;

/// How far the values of a resource are apart.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Agreement {
    /// Values compared: half floats; whole words of guides, buffers and what is not a half float.
    pub values: usize,
    /// Values that are the same.
    pub identical: usize,
    /// Sum of differences, in steps of a half float.
    pub steps: f64,
    /// Largest difference in steps; 1 for words that differ.
    pub largest: u32,
    /// Values that differ by more than two steps.
    pub far: usize,
}

impl Agreement {
    fn add(&mut self, steps: u32) {
        self.values += 1;
        self.identical += usize::from(steps == 0);
        self.steps += f64::from(steps);
        self.largest = self.largest.max(steps);
        self.far += usize::from(steps > 2);
    }

    /// Share of values that differ.
    pub fn differing(&self) -> f64 {
        (self.values - self.identical) as f64 / self.values.max(1) as f64
    }

    /// Mean difference in steps.
    pub fn mean(&self) -> f64 {
        self.steps / self.values.max(1) as f64
    }
}

/// Half floats as integers in their order.
fn ordered(bits: u32) -> i32 {
    let magnitude = (bits & 0x7fff) as i32;
    if bits & 0x8000 == 0 { magnitude } else { -magnitude }
}

/// Steps from one half float to another.
pub fn half_steps(a: u32, b: u32) -> u32 {
    ordered(a & 0xffff).abs_diff(ordered(b & 0xffff))
}

/// Whether a pixel is denoised: the guide's depth is negative where it is left out. Without a guide, whether its tile is
/// listed: what is left out in those has no history.
fn is_denoised(snapshot: &Snapshot, pixel: usize) -> bool {
    match snapshot.0.get("guide") {
        Some(guide) => f32::from_bits(guide[2 * pixel]) > 0.0,
        None => snapshot.0["listed"][pixel] != 0,
    }
}

/// Where a pipeline keeps what it accumulated: radiance in three half floats, in the upper half of the second word
/// history length and other numbers.
struct Accumulated {
    resource: &'static str,
    /// Bits of each of those numbers, the length first.
    bits: &'static [u32],
    /// The bits from the upper half of the word.
    decode: fn(u32) -> u32,
}

/// Normal half floats counted from the smallest, the positive ones first.
fn half_code(bits: u32) -> u32 {
    let magnitude = (bits & 0x7fff).saturating_sub(0x400);
    if bits & 0x8000 == 0 { magnitude } else { magnitude + 0x7800 }
}

impl Accumulated {
    const ALL: &[Self] = &[
        // Length and variance.
        Self { resource: "signal", bits: &[8, 8], decode: |half| half },
        // Length, hit share and noise.
        Self { resource: "history", bits: &[5, 7, 4], decode: half_code },
    ];

    /// That of the pipeline which left a snapshot.
    fn of(snapshot: &Snapshot) -> &'static Self {
        let found = Self::ALL.iter().find(|accumulated| snapshot.0.contains_key(accumulated.resource));
        found.expect("every pipeline accumulates")
    }

    fn fields(&self, word: u32) -> impl Iterator<Item = u32> {
        let mut rest = (self.decode)(word >> 16);
        self.bits.iter().map(move |bits| {
            let field = rest & ((1 << bits) - 1);
            rest >>= bits;
            field
        })
    }
}

/// Agreement by resource.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Table(pub BTreeMap<String, Agreement>);

impl Table {
    /// Compares what two executors left after the same frame.
    ///
    /// # Panics
    ///
    /// When they have different resources.
    pub fn add(&mut self, a: &Snapshot, b: &Snapshot) {
        assert!(a.0.keys().eq(b.0.keys()));
        for (name, words) in &a.0 {
            let others = &b.0[name];
            assert_eq!(words.len(), others.len(), "{name}");
            let accumulated = Accumulated::ALL.iter().find(|accumulated| accumulated.resource == name);
            let is_halves = accumulated.is_some()
                || matches!(name.as_str(), "previous signal" | "average" | "output" | "debug_view");
            for (index, (&word, &other)) in words.iter().zip(others).enumerate() {
                // Where nothing is denoised it holds what was there before.
                if accumulated.is_some() && !(is_denoised(a, index / 2) && is_denoised(b, index / 2)) {
                    continue;
                }
                let (a, b) = (word, other);
                let agreement = self.0.entry(name.clone()).or_default();
                if !is_halves {
                    agreement.add(u32::from(a != b));
                    continue;
                }
                agreement.add(half_steps(a, b));
                match accumulated.filter(|_| index % 2 == 1) {
                    Some(accumulated) => {
                        let state = self.0.entry(format!("{name} state")).or_default();
                        for (a, b) in accumulated.fields(a).zip(accumulated.fields(b)) {
                            state.add(a.abs_diff(b));
                        }
                    }
                    None => agreement.add(half_steps(a >> 16, b >> 16)),
                }
            }
        }
    }

    /// Pixels of an image, listed or not.
    pub fn pixels(snapshot: &Snapshot) -> usize {
        snapshot.0[Accumulated::of(snapshot).resource].len() / 2
    }

    /// Pixels whose history differs by more than two steps of a half float, or in length: where
    /// two executors decided differently about what last frame shows there.
    pub fn decisions(a: &Snapshot, b: &Snapshot) -> Vec<usize> {
        let accumulated = Accumulated::of(a);
        let length = |word: u32| accumulated.fields(word).next().unwrap_or(0);
        let differs = |(a, b): (&[u32], &[u32])| {
            let radiance = [(a[0], b[0]), (a[0] >> 16, b[0] >> 16), (a[1], b[1])];
            radiance.iter().any(|&(a, b)| half_steps(a, b) > 2) || length(a[1]).abs_diff(length(b[1])) > 1
        };
        let name = accumulated.resource;
        let pairs = a.0[name].chunks_exact(2).zip(b.0[name].chunks_exact(2));
        let decided = pairs.enumerate().filter(|&(_, pair)| differs(pair)).map(|(index, _)| index);
        decided.filter(|&pixel| is_denoised(a, pixel) && is_denoised(b, pixel)).collect()
    }

    /// Adds another table.
    pub fn merge(&mut self, other: &Self) {
        for (name, agreement) in &other.0 {
            let into = self.0.entry(name.clone()).or_default();
            into.values += agreement.values;
            into.identical += agreement.identical;
            into.steps += agreement.steps;
            into.largest = into.largest.max(agreement.largest);
            into.far += agreement.far;
        }
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{:<18}{:>11}{:>11}{:>10}{:>9}{:>11}",
            "resource", "values", "identical", "mean", "largest", "above 2"
        )?;
        for (name, a) in &self.0 {
            let share = |count: usize| 100.0 * count as f64 / a.values.max(1) as f64;
            let (identical, far) = (share(a.identical), share(a.far));
            let (values, mean, largest) = (a.values, a.mean(), a.largest);
            writeln!(f, "{name:<18}{values:>11}{identical:>10.4}%{mean:>10.5}{largest:>9}{far:>10.5}%")?;
        }
        Ok(())
    }
}
