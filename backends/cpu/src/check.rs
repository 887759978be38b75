//! Checked execution: what a kernel must not do and no driver tells.

mod shared;

use std::collections::BTreeMap;

pub(crate) use shared::Shared;

/// What went wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum FaultKind {
    /// Workgroup memory was read that no invocation of the workgroup has written.
    UninitializedRead,
    /// A buffer, texture or workgroup variable was read outside of its bounds.
    ReadOutOfBounds,
    /// The same, written.
    WriteOutOfBounds,
    /// Two invocations used a word of workgroup memory without a barrier between, and one of them wrote it.
    Race,
    /// Two workgroups of a dispatch used a word of a buffer or a texel, and one of them wrote it, not both
    /// atomically.
    RaceBetweenWorkgroups,
    /// A barrier that not all invocations of the workgroup reached.
    DivergentBarrier,
}

impl std::fmt::Display for FaultKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::UninitializedRead => "reads workgroup memory that was not written",
            Self::ReadOutOfBounds => "reads out of bounds",
            Self::WriteOutOfBounds => "writes out of bounds",
            Self::Race => "uses workgroup memory that another invocation uses without a barrier between",
            Self::RaceBetweenWorkgroups => "uses memory that another workgroup uses",
            Self::DivergentBarrier => "a barrier that not all invocations reach",
        })
    }
}

/// Something that a kernel must not do, at one place of its source.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Fault {
    /// What went wrong.
    pub kind: FaultKind,
    /// Where in the source that the module was parsed from, in bytes; none if the module does not know.
    pub offset: Option<usize>,
    /// Workgroup of the first time.
    pub workgroup: [u32; 3],
    /// The other workgroup of a race between two.
    pub other_workgroup: Option<[u32; 3]>,
    /// Index in its workgroup of the invocation of the first time.
    pub invocation: u32,
    /// How often.
    pub count: u64,
}

/// How a word of workgroup memory was used since it was last behind a barrier.
#[derive(Debug, Clone, Copy, Default)]
struct Word {
    written: bool,
    /// Barriers before the last write and read, plus 1; 0 for never.
    write_epoch: u32,
    read_epoch: u32,
    writer: u32,
    reader: u32,
    /// More than one invocation has read it in that epoch.
    many_readers: bool,
    atomic: bool,
}

/// How memory is used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Use {
    Read,
    Write,
    Atomic,
    AtomicLoad,
    AtomicStore,
}

impl Use {
    pub(crate) fn out_of_bounds(self) -> FaultKind {
        match self {
            Self::Read | Self::AtomicLoad => FaultKind::ReadOutOfBounds,
            _ => FaultKind::WriteOutOfBounds,
        }
    }

    fn is_atomic(self) -> bool {
        matches!(self, Self::Atomic | Self::AtomicLoad | Self::AtomicStore)
    }
}

/// Watches one machine.
#[derive(Debug, Default)]
pub(crate) struct Checker {
    words: Vec<Word>,
    epoch: u32,
    workgroup: [u32; 3],
    group_count: [u32; 3],
    shared: Shared,
    faults: BTreeMap<(usize, FaultKind), Fault>,
}

/// What is wrong, and which other workgroup is part of it.
pub(crate) struct Found {
    kind: FaultKind,
    other_workgroup: Option<[u32; 3]>,
}

impl From<FaultKind> for Found {
    fn from(kind: FaultKind) -> Self {
        Self { kind, other_workgroup: None }
    }
}

impl Checker {
    pub(crate) fn new(group_count: [u32; 3], shared: Shared) -> Self {
        Self { group_count, shared, ..Self::default() }
    }

    /// Whether uses of a binding's resource are to be noted.
    pub(crate) fn is_written(&self, binding: u32) -> bool {
        self.shared.is_written(binding)
    }

    /// What using a location of a bound resource violates.
    pub(crate) fn shared_use(&mut self, binding: u32, location: u32, usage: Use) -> Option<Found> {
        let [width, height, _] = self.group_count;
        let [x, y, z] = self.workgroup;
        let other = self.shared.note(binding, location, usage, x + width * (y + height * z))?;
        let other_workgroup = Some([other % width, other / width % height, other / (width * height)]);
        Some(Found { kind: FaultKind::RaceBetweenWorkgroups, other_workgroup })
    }

    pub(crate) fn begin(&mut self, workgroup: [u32; 3], words: usize) {
        self.workgroup = workgroup;
        self.words.clear();
        self.words.resize(words, Word::default());
        self.epoch = 1;
    }

    pub(crate) fn barrier(&mut self) {
        self.epoch += 1;
    }

    /// Notes a fault of instruction `op`.
    pub(crate) fn fault(&mut self, op: usize, span: naga::Span, found: Found, invocation: u32) {
        let Found { kind, other_workgroup } = found;
        let fault = self.faults.entry((op, kind)).or_insert(Fault {
            kind,
            offset: span.to_range().map(|range| range.start),
            workgroup: self.workgroup,
            other_workgroup,
            invocation,
            count: 0,
        });
        fault.count += 1;
    }

    /// What using a word of workgroup memory violates.
    pub(crate) fn workgroup_use(&mut self, address: usize, usage: Use, invocation: u32) -> Option<FaultKind> {
        let epoch = self.epoch;
        let Some(word) = self.words.get_mut(address) else {
            return Some(usage.out_of_bounds());
        };
        let both_atomic = usage.is_atomic() && word.atomic;
        let written_by_other = word.write_epoch == epoch && word.writer != invocation && !both_atomic;
        let read_by_other =
            word.read_epoch == epoch && (word.many_readers || word.reader != invocation) && usage != Use::Read;
        let uninitialized = usage != Use::Write && usage != Use::AtomicStore && !word.written;
        if usage == Use::Read {
            word.many_readers = word.read_epoch == epoch && (word.many_readers || word.reader != invocation);
            (word.read_epoch, word.reader) = (epoch, invocation);
        } else {
            word.written |= usage != Use::AtomicLoad;
            (word.write_epoch, word.writer, word.atomic) = (epoch, invocation, usage.is_atomic());
        }
        match (uninitialized, written_by_other || read_by_other) {
            (true, _) => Some(FaultKind::UninitializedRead),
            (_, true) => Some(FaultKind::Race),
            _ => None,
        }
    }

    pub(crate) fn into_faults(self) -> Vec<Fault> {
        self.faults.into_values().collect()
    }
}
