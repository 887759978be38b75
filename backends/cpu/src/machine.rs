//! Runs compiled kernels, one workgroup at a time, every instruction for all of its invocations.

use std::sync::atomic::{AtomicU32, Ordering};

use crate::LANES;
use crate::check::{Checker, Fault, FaultKind, Use};
use crate::compile::Code;
use crate::eval::{f, with_binary, with_unary};
use crate::op::{Atomic, BuiltIn, Memory, Op, Operand};
use crate::resource::{Buffer, Channel, Texture};

/// One register for a row of invocations.
pub(crate) type Lanes = [u32; LANES];

/// A resource that a binding stands for.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Bound<'a> {
    Buffer(&'a Buffer),
    Texture(&'a Texture),
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
        }
    }

    /// A machine that watches what kernels do.
    pub(crate) fn checked(code: &'a Code, bound: &'a [Bound<'a>], group_count: [u32; 3]) -> Self {
        Self { checker: Some(Checker::default()), ..Self::new(code, bound, group_count) }
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
        run(self);
    }

    /// Calls `check` for every invocation that is active, and notes what it finds.
    fn check(&mut self, mask: Option<u32>, check: impl Fn(&mut Checker, &Self, usize, usize) -> Option<FaultKind>) {
        let Some(mut checker) = self.checker.take() else { return };
        let invocations = self.code.workgroup_size.iter().product::<u32>() as usize;
        for index in 0..invocations {
            let (row, lane) = (index / LANES, index % LANES);
            if self.mask_row(mask, row)[lane] == 0 {
                continue;
            }
            if let Some(kind) = check(&mut checker, self, row, lane) {
                checker.fault(self.current, self.code.spans[self.current], kind, index as u32);
            }
        }
        self.checker = Some(checker);
    }

    #[cold]
    fn check_memory(&mut self, memory: Memory, address: Operand, offset: u32, usage: Use, mask: Option<u32>) {
        self.check(mask, |checker, machine, row, lane| {
            let address = machine.row(address, row)[lane].wrapping_add(offset) as usize;
            match memory {
                Memory::Workgroup => checker.workgroup_use(address, usage, (row * LANES + lane) as u32),
                Memory::Buffer(slot) => {
                    let inside = machine.buffer(slot).is_some_and(|buffer| address < buffer.words.len());
                    let kind =
                        if usage == Use::Read { FaultKind::ReadOutOfBounds } else { FaultKind::WriteOutOfBounds };
                    (!inside).then_some(kind)
                }
            }
        });
    }

    #[cold]
    fn check_texture(&mut self, texture: u32, at: [Operand; 3], mask: Option<u32>, kind: FaultKind) {
        let Some(texture) = self.texture(texture) else { return };
        self.check(mask, |_, machine, row, lane| {
            let [x, y, level] = at.map(|operand| machine.row(operand, row)[lane]);
            let level = texture.levels.get(level as usize);
            level.is_none_or(|level| x >= level.width || y >= level.height).then_some(kind)
        });
    }

    #[cold]
    fn check_barrier(&mut self, mask: Option<u32>) {
        let masks: Vec<Lanes> = (0..self.rows).map(|row| self.mask_row(mask, row)).collect();
        self.check(None, |_, _, row, lane| (masks[row][lane] == 0).then_some(FaultKind::DivergentBarrier));
        if let Some(checker) = &mut self.checker {
            checker.barrier();
        }
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
                            _ => index,
                        };
                    }
                }
            }
            _ => {}
        }
    }

    fn buffer(&self, slot: u32) -> Option<&'a Buffer> {
        match self.bound.get(slot as usize) {
            Some(Bound::Buffer(buffer)) => Some(buffer),
            _ => None,
        }
    }

    fn texture(&self, slot: u32) -> Option<&'a Texture> {
        match self.bound.get(slot as usize) {
            Some(Bound::Texture(texture)) => Some(texture),
            _ => None,
        }
    }

    #[inline(always)]
    fn load(&mut self, to: Operand, memory: Memory, address: Operand, offset: u32) {
        let read = |machine: &Self, address: u32| {
            let address = address.wrapping_add(offset);
            match memory {
                Memory::Workgroup => machine.workgroup.get(address as usize).copied().unwrap_or(0),
                Memory::Buffer(slot) => machine.buffer(slot).map_or(0, |buffer| buffer.get(address)),
            }
        };
        let Operand::Lane(register) = to else {
            let value = read(self, self.scalar(address));
            return self.set_scalar(to, value);
        };
        for row in 0..self.rows {
            let to = self.at(register, row);
            let Operand::Lane(address) = address else {
                self.lanes[to] = [read(self, self.scalar(address)); LANES];
                continue;
            };
            let addresses = self.lanes[self.at(address, row)];
            let mut values = [0; LANES];
            for (value, address) in values.iter_mut().zip(addresses) {
                *value = read(self, address);
            }
            self.lanes[to] = values;
        }
    }

    #[inline(always)]
    fn store(&mut self, memory: Memory, address: Operand, offset: u32, a: Operand, mask: Option<u32>) {
        for row in 0..self.rows {
            let (mask, addresses, values) = (self.mask_row(mask, row), self.row(address, row), self.row(a, row));
            for i in 0..LANES {
                if mask[i] != 0 {
                    let address = addresses[i].wrapping_add(offset);
                    match memory {
                        Memory::Workgroup => {
                            if let Some(word) = self.workgroup.get_mut(address as usize) {
                                *word = values[i];
                            }
                        }
                        Memory::Buffer(slot) => {
                            if let Some(buffer) = self.buffer(slot) {
                                buffer.set(address, values[i]);
                            }
                        }
                    }
                }
            }
        }
    }

    fn atomic_word(op: Atomic, word: &AtomicU32, value: u32) -> u32 {
        let update = |function: &dyn Fn(u32) -> u32| {
            let result = word.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |old| Some(function(old)));
            result.unwrap_or_default()
        };
        match op {
            Atomic::Add => word.fetch_add(value, Ordering::Relaxed),
            Atomic::Subtract => word.fetch_sub(value, Ordering::Relaxed),
            Atomic::And => word.fetch_and(value, Ordering::Relaxed),
            Atomic::Xor => word.fetch_xor(value, Ordering::Relaxed),
            Atomic::Or => word.fetch_or(value, Ordering::Relaxed),
            Atomic::MinU => word.fetch_min(value, Ordering::Relaxed),
            Atomic::MaxU => word.fetch_max(value, Ordering::Relaxed),
            Atomic::MinI => update(&|old| old.cast_signed().min(value.cast_signed()).cast_unsigned()),
            Atomic::MaxI => update(&|old| old.cast_signed().max(value.cast_signed()).cast_unsigned()),
            Atomic::Exchange => word.swap(value, Ordering::Relaxed),
        }
    }

    #[expect(clippy::too_many_arguments, reason = "the fields of one instruction")]
    fn atomic(
        &mut self,
        op: Atomic,
        to: Option<u32>,
        memory: Memory,
        address: Operand,
        offset: u32,
        a: Operand,
        mask: Option<u32>,
    ) {
        for row in 0..self.rows {
            let (mask, addresses, values) = (self.mask_row(mask, row), self.row(address, row), self.row(a, row));
            let mut old = [0; LANES];
            for i in 0..LANES {
                if mask[i] == 0 {
                    continue;
                }
                let address = addresses[i].wrapping_add(offset) as usize;
                match memory {
                    Memory::Workgroup => {
                        if let Some(word) = self.workgroup.get_mut(address) {
                            let cell = AtomicU32::new(*word);
                            old[i] = Self::atomic_word(op, &cell, values[i]);
                            *word = cell.into_inner();
                        }
                    }
                    Memory::Buffer(slot) => {
                        if let Some(word) = self.buffer(slot).and_then(|buffer| buffer.words.get(address)) {
                            old[i] = Self::atomic_word(op, word, values[i]);
                        }
                    }
                }
            }
            if let Some(to) = to {
                let to = self.at(to, row);
                self.lanes[to] = old;
            }
        }
    }

    /// Where each texel begins, in words; `u32::MAX` outside of the texture.
    #[inline(always)]
    fn texel_words(&self, texture: &Texture, x: Operand, y: Operand, level: Operand, row: usize) -> Lanes {
        let words = texture.format().words() as u32;
        let (x, y) = (self.row(x, row), self.row(y, row));
        let mut first = [u32::MAX; LANES];
        if let Operand::Lane(_) = level {
            let level = self.row(level, row);
            for i in 0..LANES {
                let level = texture.levels.get(level[i] as usize);
                if let Some(level) = level.filter(|level| x[i] < level.width && y[i] < level.height) {
                    first[i] = level.first_word + (y[i] * level.width + x[i]) * words;
                }
            }
        } else if let Some(level) = texture.levels.get(self.scalar(level) as usize) {
            for i in 0..LANES {
                let inside = (x[i] < level.width) & (y[i] < level.height);
                let texel = y[i].wrapping_mul(level.width).wrapping_add(x[i]).wrapping_mul(words);
                first[i] = if inside { texel.wrapping_add(level.first_word) } else { u32::MAX };
            }
        }
        first
    }

    #[inline(always)]
    fn texture_load(&mut self, to: [Option<u32>; 4], texture: u32, x: Operand, y: Operand, level: Operand) {
        let Some(texture) = self.texture(texture) else { return };
        let format = texture.format();
        for row in 0..self.rows {
            let first = self.texel_words(texture, x, y, level, row);
            let gather = |offset: u32| {
                let mut values = [0; LANES];
                for (value, first) in values.iter_mut().zip(first) {
                    let word = texture.words.get(first.wrapping_add(offset) as usize);
                    *value = if first == u32::MAX { 0 } else { word.map_or(0, |word| word.load(Ordering::Relaxed)) };
                }
                values
            };
            for (component, to) in to.into_iter().enumerate() {
                let Some(to) = to.map(|register| self.at(register, row)) else { continue };
                self.lanes[to] = if component < format.components() {
                    let (word, shift) = format.position(component);
                    decoded(format.channel(), gather(word as u32), shift, &first)
                } else {
                    [if component == 3 { format.channel().one() } else { 0 }; LANES]
                };
            }
        }
    }

    #[inline(always)]
    fn texture_store(&mut self, texture: u32, x: Operand, y: Operand, texel: [Operand; 4], mask: Option<u32>) {
        let Some(texture) = self.texture(texture) else { return };
        let format = texture.format();
        for row in 0..self.rows {
            let mask = self.mask_row(mask, row);
            let first = self.texel_words(texture, x, y, Operand::Const(0), row);
            let values = texel.map(|operand| self.row(operand, row));
            let mut words = [[0; LANES]; 4];
            for (component, values) in values.iter().enumerate().take(format.components()) {
                let (word, shift) = format.position(component);
                encode(format.channel(), values, shift, &mut words[word]);
            }
            for i in 0..LANES {
                if mask[i] != 0 && first[i] != u32::MAX {
                    for (offset, word) in words[..format.words()].iter().enumerate() {
                        if let Some(cell) = texture.words.get(first[i] as usize + offset) {
                            cell.store(word[i], Ordering::Relaxed);
                        }
                    }
                }
            }
        }
    }

    fn read_indexed(&mut self, to: Operand, base: Operand, stride: u32, count: u32, index: Operand) {
        let clamped = |index: u32| index.min(count - 1) * stride;
        let Operand::Lane(to) = to else {
            if let Operand::Scalar(base) = base {
                let value = self.scalars[(base + clamped(self.scalar(index))) as usize];
                self.set_scalar(to, value);
            }
            return;
        };
        for row in 0..self.rows {
            let to = self.at(to, row);
            match (base, index) {
                (Operand::Lane(base), Operand::Lane(_)) => {
                    let index = self.row(index, row);
                    let mut values = [0; LANES];
                    for i in 0..LANES {
                        values[i] = self.lanes[self.at(base + clamped(index[i]), row)][i];
                    }
                    self.lanes[to] = values;
                }
                (Operand::Lane(base), index) => {
                    self.lanes[to] = self.lanes[self.at(base + clamped(self.scalar(index)), row)];
                }
                (Operand::Scalar(base), index) => {
                    let index = self.row(index, row);
                    self.lanes[to] = index.map(|index| self.scalars[(base + clamped(index)) as usize]);
                }
                (Operand::Const(_), _) => {}
            }
        }
    }

    fn write_indexed(&mut self, op: &Op) {
        let Op::WriteIndexed { base, stride, count, index, a, mask } = *op else { return };
        let clamped = |index: u32| index.min(count - 1) * stride;
        match base {
            Operand::Scalar(base) => {
                let at = base + clamped(self.scalar(index));
                self.scalars[at as usize] = self.scalar(a);
            }
            Operand::Lane(base) => {
                for row in 0..self.rows {
                    let (mask, index, a) = (self.mask_row(mask, row), self.row(index, row), self.row(a, row));
                    for i in 0..LANES {
                        if mask[i] != 0 {
                            let at = self.at(base + clamped(index[i]), row);
                            self.lanes[at][i] = a[i];
                        }
                    }
                }
            }
            Operand::Const(_) => {}
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

/// Components of texels from the words that hold them; 0 where there is no texel.
#[inline(always)]
fn decoded(channel: Channel, words: Lanes, shift: u32, first: &Lanes) -> Lanes {
    macro_rules! each {
        ($channel:expr) => {{
            let mut values = words;
            for i in 0..LANES {
                let value = $channel.decode(words[i] >> shift);
                values[i] = if first[i] == u32::MAX { 0 } else { value };
            }
            values
        }};
    }
    // One loop each, so that each is made of vector instructions.
    match channel {
        Channel::Float32 => each!(Channel::Float32),
        Channel::Float16 => each!(Channel::Float16),
        Channel::Uint(32) => each!(Channel::Uint(32)),
        other => each!(other),
    }
}

/// Adds components to the words of texels.
#[inline(always)]
fn encode(channel: Channel, values: &Lanes, shift: u32, words: &mut Lanes) {
    macro_rules! each {
        ($channel:expr) => {
            for i in 0..LANES {
                words[i] |= $channel.encode(values[i]) << shift;
            }
        };
    }
    match channel {
        Channel::Float16 => each!(Channel::Float16),
        other => each!(other),
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
        match *op {
            Op::Unary { op, to, a } => {
                macro_rules! apply {
                    ($function:expr) => {
                        machine.unary(to, a, $function)
                    };
                }
                with_unary!(op, apply);
            }
            Op::Binary { op, to, a, b } => {
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
            Op::Atomic { op, to, memory, address, offset, a, mask } => {
                if machine.checker.is_some() {
                    let stores = op == Atomic::Exchange && to.is_none();
                    let usage = if stores { Use::AtomicStore } else { Use::Atomic };
                    machine.check_memory(memory, address, offset, usage, mask);
                }
                machine.atomic(op, to, memory, address, offset, a, mask);
            }
            Op::ArrayLength { to, buffer, offset, stride } => {
                let words = machine.buffer(buffer).map_or(0, |buffer| buffer.words.len() as u32);
                machine.set_scalar(to, words.saturating_sub(offset) / stride);
            }
            Op::TextureLoad { to, texture, x, y, level, mask } => {
                if machine.checker.is_some() {
                    machine.check_texture(texture, [x, y, level], mask, FaultKind::ReadOutOfBounds);
                }
                machine.texture_load(to, texture, x, y, level);
            }
            Op::TextureStore { texture, x, y, texel, mask } => {
                if machine.checker.is_some() {
                    let at = [x, y, Operand::Const(0)];
                    machine.check_texture(texture, at, mask, FaultKind::WriteOutOfBounds);
                }
                machine.texture_store(texture, x, y, texel, mask);
            }
            Op::Barrier { mask } => {
                if machine.checker.is_some() {
                    machine.check_barrier(mask);
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
