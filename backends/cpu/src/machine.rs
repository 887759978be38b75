//! Runs compiled kernels, one workgroup at a time, every instruction for all of its invocations.

mod memory;
mod probe;
mod sample;
mod subgroup;
mod texture;
mod watch;

use crate::LANES;
use crate::check::{Checker, Fault, Shared, Use};
use crate::compile::Code;
use crate::eval::{f, with_binary, with_unary};
use crate::inexact::Inexact;
use crate::op::{Atomic, BuiltIn, Op, Operand};
use crate::probe::Probe;
use crate::resource::{Buffer, Texture};
use crate::sampler::Sampler;

/// One register for a row of invocations.
pub(crate) type Lanes = [u32; LANES];

/// A resource that a binding stands for.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Bound<'a> {
    Buffer(&'a Buffer),
    Texture(&'a Texture),
    Sampler(Sampler),
}

pub(crate) struct Machine<'a> {
    code: &'a Code,
    bound: &'a [Bound<'a>],
    /// Rows of invocations in a workgroup; register `r` of row `row` is at `r * rows + row`.
    rows: usize,
    lanes: Vec<Lanes>,
    scalars: Vec<u32>,
    workgroup: Vec<u32>,
    group: [u32; 3],
    group_count: [u32; 3],
    /// Instruction that is running.
    current: usize,
    checker: Option<Checker>,
    probing: Option<Box<probe::Probing>>,
}

/// For each binding the first one with the same resource, if the kernel can write that.
fn written_resources(code: &Code, bound: &[Bound<'_>]) -> Vec<Option<u32>> {
    let same = |a: &Bound<'_>, b: &Bound<'_>| match (a, b) {
        (Bound::Buffer(a), Bound::Buffer(b)) => std::ptr::eq(*a, *b),
        (Bound::Texture(a), Bound::Texture(b)) => std::ptr::eq(*a, *b),
        _ => false,
    };
    let resource = |one: &Bound<'_>| {
        let mut bindings = bound.iter().zip(&code.bindings);
        let is_written = bindings.any(|(other, slot)| same(one, other) && slot.kind.is_writable());
        let first = bound.iter().position(|other| same(one, other));
        first.filter(|_| is_written).map(|first| first as u32)
    };
    bound.iter().map(resource).collect()
}

impl<'a> Machine<'a> {
    pub(crate) fn new(code: &'a Code, bound: &'a [Bound<'a>], group_count: [u32; 3]) -> Self {
        let invocations: u32 = code.workgroup_size.iter().product();
        let rows = (invocations as usize).div_ceil(LANES);
        Self {
            code,
            bound,
            rows,
            lanes: vec![[0; LANES]; code.lane_registers as usize * rows],
            scalars: vec![0; code.scalar_registers as usize],
            workgroup: vec![0; code.workgroup_words as usize],
            group: [0; 3],
            group_count,
            current: 0,
            checker: None,
            probing: None,
        }
    }

    /// A machine that watches what kernels do.
    pub(crate) fn checked(code: &'a Code, bound: &'a [Bound<'a>], group_count: [u32; 3]) -> Self {
        let checker = Checker::new(group_count, Shared::new(written_resources(code, bound)));
        Self { checker: Some(checker), ..Self::new(code, bound, group_count) }
    }

    /// A machine that watches what happens to numbers.
    pub(crate) fn probed(code: &'a Code, bound: &'a [Bound<'a>], group_count: [u32; 3]) -> Self {
        let machine = Self::new(code, bound, group_count);
        let probing = probe::Probing::new(machine.lanes.len(), machine.scalars.len());
        Self { probing: Some(Box::new(probing)), ..machine }
    }

    pub(crate) fn into_probe(self) -> Probe {
        self.probing.map(|probing| probing.recorder.into_probe()).unwrap_or_default()
    }

    pub(crate) fn into_faults(self) -> Vec<Fault> {
        self.checker.map(Checker::into_faults).unwrap_or_default()
    }

    pub(crate) fn run(&mut self, group: [u32; 3]) {
        self.group = group;
        self.workgroup.fill(0);
        if let Some(checker) = &mut self.checker {
            checker.begin(group, self.workgroup.len());
        }
        if let Some(probing) = &mut self.probing {
            probing.recorder.workgroup = group;
        }
        run(self);
    }

    #[inline(always)]
    fn at(&self, register: u32, row: usize) -> usize {
        register as usize * self.rows + row
    }

    /// The value of an operand that is no lane register.
    #[inline(always)]
    fn scalar(&self, operand: Operand) -> u32 {
        match operand {
            Operand::Const(bits) => bits,
            Operand::Scalar(register) => self.scalars[register as usize],
            Operand::Lane(register) => self.lanes[self.at(register, 0)][0],
        }
    }

    /// A copy of the lanes of an operand.
    #[inline(always)]
    fn row(&self, operand: Operand, row: usize) -> Lanes {
        match operand {
            Operand::Lane(register) => self.lanes[self.at(register, row)],
            other => [self.scalar(other); LANES],
        }
    }

    #[inline(always)]
    fn mask_row(&self, mask: Option<u32>, row: usize) -> Lanes {
        mask.map_or([u32::MAX; LANES], |register| self.lanes[self.at(register, row)])
    }

    #[inline(always)]
    fn set_scalar(&mut self, to: Operand, value: u32) {
        if let Operand::Scalar(register) = to {
            self.scalars[register as usize] = value;
        }
    }

    #[inline(always)]
    fn unary(&mut self, to: Operand, a: Operand, function: impl Fn(u32) -> u32) {
        let Operand::Lane(to) = to else {
            let value = function(self.scalar(a));
            return self.set_scalar(to, value);
        };
        for row in 0..self.rows {
            let to = self.at(to, row);
            match a {
                Operand::Lane(a) => {
                    let a = self.at(a, row);
                    match self.lanes.get_disjoint_mut([to, a]) {
                        Ok([to, a]) => to.iter_mut().zip(a.iter()).for_each(|(to, a)| *to = function(*a)),
                        Err(_) => self.lanes[to].iter_mut().for_each(|to| *to = function(*to)),
                    }
                }
                other => self.lanes[to] = [function(self.scalar(other)); LANES],
            }
        }
    }

    #[inline(always)]
    fn binary(&mut self, to: Operand, a: Operand, b: Operand, function: impl Fn(u32, u32) -> u32) {
        let Operand::Lane(to) = to else {
            let value = function(self.scalar(a), self.scalar(b));
            return self.set_scalar(to, value);
        };
        for row in 0..self.rows {
            let to = self.at(to, row);
            match (a, b) {
                (Operand::Lane(a), Operand::Lane(b)) => {
                    let (a, b) = (self.at(a, row), self.at(b, row));
                    if let Ok([to, a, b]) = self.lanes.get_disjoint_mut([to, a, b]) {
                        for i in 0..LANES {
                            to[i] = function(a[i], b[i]);
                        }
                    } else {
                        let (a, b) = (self.lanes[a], self.lanes[b]);
                        let to = &mut self.lanes[to];
                        for i in 0..LANES {
                            to[i] = function(a[i], b[i]);
                        }
                    }
                }
                (Operand::Lane(a), b) => {
                    let (a, b) = (self.at(a, row), self.scalar(b));
                    match self.lanes.get_disjoint_mut([to, a]) {
                        Ok([to, a]) => to.iter_mut().zip(a.iter()).for_each(|(to, a)| *to = function(*a, b)),
                        Err(_) => self.lanes[to].iter_mut().for_each(|to| *to = function(*to, b)),
                    }
                }
                (a, Operand::Lane(b)) => {
                    let (a, b) = (self.scalar(a), self.at(b, row));
                    match self.lanes.get_disjoint_mut([to, b]) {
                        Ok([to, b]) => to.iter_mut().zip(b.iter()).for_each(|(to, b)| *to = function(a, *b)),
                        Err(_) => self.lanes[to].iter_mut().for_each(|to| *to = function(a, *to)),
                    }
                }
                (a, b) => self.lanes[to] = [function(self.scalar(a), self.scalar(b)); LANES],
            }
        }
    }

    #[inline(always)]
    fn select(&mut self, to: Operand, condition: Operand, a: Operand, b: Operand) {
        let Operand::Lane(to) = to else {
            let value = if self.scalar(condition) != 0 { self.scalar(a) } else { self.scalar(b) };
            return self.set_scalar(to, value);
        };
        for row in 0..self.rows {
            let (condition, a, b) = (self.row(condition, row), self.row(a, row), self.row(b, row));
            let to = self.at(to, row);
            let to = &mut self.lanes[to];
            for i in 0..LANES {
                to[i] = (condition[i] & a[i]) | (!condition[i] & b[i]);
            }
        }
    }

    #[inline(always)]
    fn assign(&mut self, to: Operand, a: Operand, mask: Option<u32>) {
        let (Operand::Lane(register), Some(_)) = (to, mask) else { return self.unary(to, a, |a| a) };
        for row in 0..self.rows {
            let (mask, a) = (self.mask_row(mask, row), self.row(a, row));
            let to = self.at(register, row);
            let to = &mut self.lanes[to];
            for i in 0..LANES {
                to[i] = (mask[i] & a[i]) | (!mask[i] & to[i]);
            }
        }
    }

    fn builtin(&mut self, to: Operand, value: BuiltIn) {
        let size = self.code.workgroup_size;
        let local = |index: u32| [index % size[0], index / size[0] % size[1], index / (size[0] * size[1])];
        match (to, value) {
            (to, BuiltIn::WorkgroupId(axis)) => self.set_scalar(to, self.group[axis as usize]),
            (to, BuiltIn::WorkgroupCount(axis)) => self.set_scalar(to, self.group_count[axis as usize]),
            (to, BuiltIn::SubgroupSize) => self.set_scalar(to, self.code.subgroup_size),
            (to, BuiltIn::SubgroupCount) => {
                let invocations: u32 = size.iter().product();
                self.set_scalar(to, invocations.div_ceil(self.code.subgroup_size));
            }
            (Operand::Lane(register), value) => {
                for row in 0..self.rows {
                    let to = self.at(register, row);
                    for i in 0..LANES {
                        let index = (row * LANES + i) as u32;
                        self.lanes[to][i] = match value {
                            BuiltIn::LocalId(axis) => local(index)[axis as usize],
                            BuiltIn::GlobalId(axis) => {
                                let axis = axis as usize;
                                self.group[axis].wrapping_mul(size[axis]).wrapping_add(local(index)[axis])
                            }
                            BuiltIn::SubgroupId => index / self.code.subgroup_size,
                            BuiltIn::SubgroupLane => index % self.code.subgroup_size,
                            _ => index,
                        };
                    }
                }
            }
            _ => {}
        }
    }

    fn table(&mut self, to: Operand, table: u32, stride: u32, offset: u32, index: Operand) {
        let table = &self.code.tables[table as usize];
        let look_up = |index: u32| {
            let last = (table.len() as u32 / stride).saturating_sub(1);
            table[(index.min(last) * stride + offset) as usize]
        };
        self.unary(to, index, look_up);
    }

    #[inline(always)]
    fn any(&self, mask: u32) -> bool {
        (0..self.rows).any(|row| self.lanes[self.at(mask, row)].iter().fold(0, |any, lane| any | lane) != 0)
    }
}

/// The loop over instructions, compiled for what the processor offers.
#[multiversion::multiversion(targets("x86_64+avx2+f16c", "aarch64+neon"))]
fn run<'a>(machine: &mut Machine<'a>) {
    let code = machine.code;
    let mut counter = 0;
    while let Some(op) = code.ops.get(counter) {
        machine.current = counter;
        counter += 1;
        if machine.probing.is_some() {
            machine.probe(op);
        }
        match *op {
            Op::Unary { op, to, a } => {
                macro_rules! apply {
                    ($function:expr) => {
                        machine.unary(to, a, $function)
                    };
                }
                with_unary!(op, apply);
                if let Some(inexact) = code.inexact {
                    machine.unary(to, to, |bits| inexact.unary(op, bits));
                }
            }
            Op::Binary { op, to, a, b } => {
                if let Some(inexact) = code.inexact.filter(|_| Inexact::concerns(op)) {
                    machine.binary(to, a, b, |a, b| inexact.binary(op, a, b));
                    continue;
                }
                macro_rules! apply {
                    ($function:expr) => {
                        machine.binary(to, a, b, $function)
                    };
                }
                with_binary!(op, apply);
            }
            Op::Select { to, condition, a, b } => machine.select(to, condition, a, b),
            Op::Fma { to, a, b, c } => {
                for row in 0..machine.rows {
                    let (a, b, c) = (machine.row(a, row), machine.row(b, row), machine.row(c, row));
                    let mut value = [0; LANES];
                    for i in 0..LANES {
                        value[i] = f(a[i]).mul_add(f(b[i]), f(c[i])).to_bits();
                    }
                    match to {
                        Operand::Lane(register) => {
                            let to = machine.at(register, row);
                            machine.lanes[to] = value;
                        }
                        other => machine.set_scalar(other, value[0]),
                    }
                }
            }
            Op::Assign { to, a, mask } => machine.assign(to, a, mask),
            Op::BuiltIn { to, value } => machine.builtin(to, value),
            Op::ReadIndexed { to, base, stride, count, index } => machine.read_indexed(to, base, stride, count, index),
            Op::WriteIndexed { .. } => machine.write_indexed(op),
            Op::Table { to, table, stride, offset, index } => machine.table(to, table, stride, offset, index),
            Op::Load { to, memory, address, offset, mask } => {
                if machine.checker.is_some() {
                    machine.check_memory(memory, address, offset, Use::Read, mask);
                }
                machine.load(to, memory, address, offset);
            }
            Op::Store { memory, address, offset, a, mask } => {
                if machine.checker.is_some() {
                    machine.check_memory(memory, address, offset, Use::Write, mask);
                }
                machine.store(memory, address, offset, a, mask);
            }
            Op::Atomic { op: kind, memory, address, offset, mask, .. } => {
                if machine.checker.is_some() {
                    let usage = match kind {
                        Atomic::Load => Use::AtomicLoad,
                        Atomic::Store => Use::AtomicStore,
                        _ => Use::Atomic,
                    };
                    machine.check_memory(memory, address, offset, usage, mask);
                }
                machine.atomic(op);
            }
            Op::ArrayLength { to, buffer, offset, stride } => {
                let bytes = machine.buffer(buffer).map_or(0, |buffer| 4 * buffer.words.len() as u64);
                machine.set_scalar(to, (bytes.saturating_sub(offset.into()) / u64::from(stride)) as u32);
            }
            Op::TextureLoad { to, texture, x, y, level, mask } => {
                if machine.checker.is_some() {
                    machine.check_texture(texture, [x, y, level], Use::Read, mask);
                }
                machine.texture_load(to, texture, x, y, level);
            }
            Op::TextureSample(ref sample) => machine.sample(sample),
            Op::TextureStore { texture, x, y, texel, mask } => {
                if machine.checker.is_some() {
                    let at = [x, y, Operand::Const(0)];
                    machine.check_texture(texture, at, Use::Write, mask);
                }
                machine.texture_store(texture, x, y, texel, mask);
            }
            Op::Subgroup { .. } => machine.subgroup(op),
            Op::Barrier { mask, orders_workgroup } => {
                if machine.checker.is_some() {
                    machine.check_barrier(mask, orders_workgroup);
                }
            }
            Op::TextureSize { to, texture, level } => {
                let levels = machine.texture(texture).map_or(&[][..], |texture| &texture.levels);
                let size = |axis: usize| {
                    move |level: u32| levels.get(level as usize).map_or(0, |level| [level.width, level.height][axis])
                };
                machine.unary(to[0], level, size(0));
                machine.unary(to[1], level, size(1));
            }
            Op::TextureLevels { to, texture } => {
                let count = machine.texture(texture).map_or(0, |texture| texture.levels.len() as u32);
                machine.set_scalar(to, count);
            }
            Op::Jump { to } => counter = to,
            Op::JumpIfFalse { condition, to } => {
                if machine.scalar(condition) == 0 {
                    counter = to;
                }
            }
            Op::JumpIfNone { mask, to } => {
                if !machine.any(mask) {
                    counter = to;
                }
            }
            Op::JumpIfAny { mask, to } => {
                if machine.any(mask) {
                    counter = to;
                }
            }
        }
    }
}
