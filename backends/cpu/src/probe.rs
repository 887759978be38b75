//! The numerical probe: what happens to numbers inside of a kernel, by place in its source.
//!
//! Beside every 32-bit float that is computed, the probe computes the same in 64 bits ("exact"), and follows the
//! decisions of the 32-bit run. Values that come from memory, from integers or from a variable with a dynamic index
//! begin anew as what they are, and so does what `floor` and the like decide.

use std::collections::BTreeMap;

use crate::op::{Binary, Unary};

/// What happened to a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum EventKind {
    /// NaN came of operands that are none.
    Nan,
    /// Infinity came of finite operands: an overflow, or a division by 0.
    Infinite,
    /// A result too small to have all its digits came of operands that have theirs. Some devices make it 0.
    Denormal,
    /// A sum or difference lost ten bits or more: what was left of large operands is mostly their rounding.
    Cancellation,
}

/// Something that happened at one place of the source.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Event {
    /// What.
    pub kind: EventKind,
    /// Where in the source that the module was parsed from, in bytes; none if the module does not know.
    pub offset: Option<usize>,
    /// How often.
    pub count: u64,
    /// Workgroup of the first time.
    pub workgroup: [u32; 3],
    /// Index in its workgroup of the invocation of the first time.
    pub invocation: u32,
    /// Operands of the first time.
    pub operands: Vec<f32>,
    /// Result of the first time.
    pub value: f32,
}

/// Rounding error of what a place of the source writes or packs.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct OutputError {
    /// Where it is written, in bytes of the source.
    pub offset: Option<usize>,
    /// Values written.
    pub count: u64,
    /// Largest error relative to the exact value, taken as at least the smallest normal half float.
    pub relative: f64,
    /// The value with that error.
    pub value: f32,
    /// What it would be without rounding.
    pub exact: f64,
    /// Where most of that error arose, in bytes of the source.
    pub origin: Option<usize>,
}

/// What the probe saw of a kernel.
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub struct Probe {
    /// Events in the order of the code.
    pub events: Vec<Event>,
    /// Outputs in the order of the code.
    pub outputs: Vec<OutputError>,
    /// Float operations that were watched.
    pub operations: u64,
}

/// The smallest normal half float: errors of what is smaller count relative to this.
const SMALLEST: f64 = 6.103_515_625e-5;

/// A register's value and what it would be without rounding. The default is that of a register that holds 0, and
/// is not valid for others: then the value begins anew.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Shadow {
    pub(crate) bits: u32,
    pub(crate) exact: f64,
    /// Instruction that most of the error comes from, plus 1; 0 for a value that was not computed.
    origin: u32,
}

impl Shadow {
    /// A value that begins anew.
    pub(crate) fn anew(bits: u32) -> Self {
        Self { bits, exact: f64::from(f32::from_bits(bits)), origin: 0 }
    }

    fn value(self) -> f32 {
        f32::from_bits(self.bits)
    }

    fn relative_error(self, least: f64) -> f64 {
        let error = (f64::from(self.value()) - self.exact).abs() / self.exact.abs().max(least);
        if error.is_finite() { error } else { 0.0 }
    }

    pub(crate) fn is_computed(self) -> bool {
        self.origin != 0
    }
}

/// The exact result of an operation on floats that gives a float. `None` for all others.
pub(crate) fn exact_unary(op: Unary, a: Shadow) -> Option<f64> {
    let x = a.exact;
    Some(match op {
        Unary::NegF => -x,
        Unary::AbsF => x.abs(),
        Unary::Sqrt => x.sqrt(),
        Unary::InverseSqrt => 1.0 / x.sqrt(),
        Unary::Exp => x.exp(),
        Unary::Exp2 => x.exp2(),
        Unary::Log => x.ln(),
        Unary::Log2 => x.log2(),
        Unary::Sin => x.sin(),
        Unary::Cos => x.cos(),
        Unary::Tan => x.tan(),
        Unary::Asin => x.asin(),
        Unary::Acos => x.acos(),
        Unary::Atan => x.atan(),
        Unary::SaturateF => x.clamp(0.0, 1.0),
        Unary::Fract => x - f64::from(a.value()).floor(),
        _ => return None,
    })
}

/// The same for two operands.
pub(crate) fn exact_binary(op: Binary, a: Shadow, b: Shadow) -> Option<f64> {
    let (x, y) = (a.exact, b.exact);
    Some(match op {
        Binary::AddF => x + y,
        Binary::SubF => x - y,
        Binary::MulF => x * y,
        Binary::DivF => x / y,
        Binary::MinF => x.min(y),
        Binary::MaxF => x.max(y),
        Binary::Pow => x.powf(y),
        Binary::Atan2 => x.atan2(y),
        _ => return None,
    })
}

/// Whether an operation rounds a float for keeps: what is packed is an output.
pub(crate) fn packs(op: Unary) -> bool {
    matches!(op, Unary::ToHalf | Unary::ToSnorm16 | Unary::ToUnorm16 | Unary::ToSnorm8 | Unary::ToUnorm8)
}

fn event_of(result: Shadow, operands: &[Shadow], is_sum: bool) -> Option<EventKind> {
    let value = result.value();
    let all = |test: fn(f32) -> bool| operands.iter().all(|operand| test(operand.value()));
    let largest = operands.iter().map(|operand| operand.value().abs()).fold(0.0, f32::max);
    if value.is_nan() {
        return all(|x| !x.is_nan()).then_some(EventKind::Nan);
    }
    if value.is_infinite() {
        return all(f32::is_finite).then_some(EventKind::Infinite);
    }
    if value.is_subnormal() {
        return all(|x| !x.is_subnormal()).then_some(EventKind::Denormal);
    }
    let is_cancelled = is_sum && value.abs() < largest / 1024.0 && result.relative_error(SMALLEST) > 1.0 / 1024.0;
    is_cancelled.then_some(EventKind::Cancellation)
}

/// What a machine gathers while it runs.
#[derive(Debug, Default)]
pub(crate) struct Recorder {
    events: BTreeMap<(usize, EventKind), Event>,
    outputs: BTreeMap<usize, OutputError>,
    operations: u64,
    pub(crate) workgroup: [u32; 3],
}

/// Where in the code a value is computed, and by which invocation.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Moment {
    pub(crate) instruction: usize,
    pub(crate) invocation: usize,
    /// Whether the invocation takes part, rather than only its lane.
    pub(crate) is_active: bool,
}

impl Recorder {
    /// Notes a float operation and gives its shadow.
    pub(crate) fn note(
        &mut self,
        at: Moment,
        span: impl Fn(usize) -> Option<usize>,
        (bits, exact): (u32, f64),
        operands: &[Shadow],
        is_sum: bool,
    ) -> Shadow {
        let mut result = Shadow { bits, exact, origin: at.instruction as u32 + 1 };
        let error = |shadow: &Shadow| shadow.relative_error(1e-30);
        let worst = operands.iter().max_by(|a, b| error(a).total_cmp(&error(b)));
        let is_inherited = |worst: &&Shadow| error(&result) <= 4.0 * error(worst) + f64::from(f32::EPSILON);
        if let Some(worst) = worst.filter(|worst| worst.is_computed()).filter(is_inherited) {
            result.origin = worst.origin;
        }
        if at.is_active {
            self.operations += 1;
            if let Some(kind) = event_of(result, operands, is_sum) {
                let event = self.events.entry((at.instruction, kind)).or_insert_with(|| Event {
                    kind,
                    offset: span(at.instruction),
                    count: 0,
                    workgroup: self.workgroup,
                    invocation: at.invocation as u32,
                    operands: operands.iter().map(|operand| operand.value()).collect(),
                    value: result.value(),
                });
                event.count += 1;
            }
        }
        result
    }

    /// Notes a value that leaves the kernel's registers.
    pub(crate) fn output(&mut self, at: Moment, span: impl Fn(usize) -> Option<usize>, shadow: Shadow) {
        if !at.is_active || !shadow.is_computed() {
            return;
        }
        let relative = shadow.relative_error(SMALLEST);
        let output = self.outputs.entry(at.instruction).or_insert_with(|| OutputError {
            offset: span(at.instruction),
            count: 0,
            relative: -1.0,
            value: 0.0,
            exact: 0.0,
            origin: None,
        });
        output.count += 1;
        if relative > output.relative {
            (output.relative, output.value, output.exact) = (relative, shadow.value(), shadow.exact);
            output.origin = span(shadow.origin as usize - 1);
        }
    }

    pub(crate) fn into_probe(self) -> Probe {
        let Self { events, outputs, operations, .. } = self;
        Probe { events: events.into_values().collect(), outputs: outputs.into_values().collect(), operations }
    }
}

impl Probe {
    /// Adds what another run of the same kernel saw.
    pub(crate) fn merge(&mut self, other: Self) {
        self.operations += other.operations;
        for event in other.events {
            match self.events.iter_mut().find(|own| (own.offset, own.kind) == (event.offset, event.kind)) {
                Some(own) => own.count += event.count,
                None => self.events.push(event),
            }
        }
        for output in other.outputs {
            match self.outputs.iter_mut().find(|own| own.offset == output.offset) {
                Some(own) => {
                    let count = own.count + output.count;
                    if output.relative > own.relative {
                        *own = output;
                    }
                    own.count = count;
                }
                None => self.outputs.push(output),
            }
        }
    }
}
