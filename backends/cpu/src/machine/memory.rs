//! Loads, stores and atomic operations on buffers and workgroup memory, and variables with an index.

use std::sync::atomic::{AtomicU32, Ordering};

use super::{Bound, Machine};
use crate::LANES;
use crate::eval::unary;
use crate::op::{Atomic, Memory, Op, Operand, Unary};
use crate::resource::Buffer;

impl<'a> Machine<'a> {
    pub(super) fn buffer(&self, slot: u32) -> Option<&'a Buffer> {
        match self.bound.get(slot as usize) {
            Some(Bound::Buffer(buffer)) => Some(buffer),
            _ => None,
        }
    }

    #[inline(always)]
    pub(super) fn load(&mut self, to: Operand, memory: Memory, address: Operand, offset: u32) {
        let read = |machine: &Self, address: u32| {
            let address = address.wrapping_add(offset);
            match memory {
                Memory::Workgroup => machine.workgroup.get(address as usize).copied().unwrap_or(0),
                Memory::Buffer(slot) => machine.buffer(slot).map_or(0, |buffer| buffer.get(address)),
                Memory::Halves(slot) => {
                    let half = machine.buffer(slot).map_or(0, |buffer| buffer.get_half(address));
                    unary(Unary::HalfToFloat, half)
                }
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
    pub(super) fn store(&mut self, memory: Memory, address: Operand, offset: u32, a: Operand, mask: Option<u32>) {
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
                        Memory::Halves(slot) => {
                            if let Some(buffer) = self.buffer(slot) {
                                buffer.set_half(address, unary(Unary::ToHalf, values[i]));
                            }
                        }
                    }
                }
            }
        }
    }

    /// Changes a word; the value before.
    fn atomic_word(op: Atomic, word: &AtomicU32, value: u32, compare: Option<u32>) -> u32 {
        let update = |function: &dyn Fn(u32) -> u32| {
            let result = word.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |old| Some(function(old)));
            result.unwrap_or_default()
        };
        match op {
            Atomic::Load => word.load(Ordering::Relaxed),
            Atomic::Store => {
                word.store(value, Ordering::Relaxed);
                0
            }
            Atomic::Add => word.fetch_add(value, Ordering::Relaxed),
            Atomic::Subtract => word.fetch_sub(value, Ordering::Relaxed),
            Atomic::And => word.fetch_and(value, Ordering::Relaxed),
            Atomic::Xor => word.fetch_xor(value, Ordering::Relaxed),
            Atomic::Or => word.fetch_or(value, Ordering::Relaxed),
            Atomic::MinU => word.fetch_min(value, Ordering::Relaxed),
            Atomic::MaxU => word.fetch_max(value, Ordering::Relaxed),
            Atomic::MinI => update(&|old| old.cast_signed().min(value.cast_signed()).cast_unsigned()),
            Atomic::MaxI => update(&|old| old.cast_signed().max(value.cast_signed()).cast_unsigned()),
            Atomic::Exchange => match compare {
                None => word.swap(value, Ordering::Relaxed),
                Some(compare) => word
                    .compare_exchange(compare, value, Ordering::Relaxed, Ordering::Relaxed)
                    .unwrap_or_else(|other| other),
            },
        }
    }

    pub(super) fn atomic(&mut self, operation: &Op) {
        let Op::Atomic { op, to, memory, address, offset, a, compare, mask } = *operation else { return };
        for row in 0..self.rows {
            let (mask, addresses, values) = (self.mask_row(mask, row), self.row(address, row), self.row(a, row));
            let compare = compare.map(|compare| self.row(compare, row));
            let mut old = [0; LANES];
            for i in 0..LANES {
                let compare = compare.map(|compare| compare[i]);
                if mask[i] == 0 {
                    continue;
                }
                let address = addresses[i].wrapping_add(offset) as usize;
                match memory {
                    Memory::Workgroup => {
                        if let Some(word) = self.workgroup.get_mut(address) {
                            let cell = AtomicU32::new(*word);
                            old[i] = Self::atomic_word(op, &cell, values[i], compare);
                            *word = cell.into_inner();
                        }
                    }
                    Memory::Buffer(slot) | Memory::Halves(slot) => {
                        if let Some(word) = self.buffer(slot).and_then(|buffer| buffer.words.get(address)) {
                            old[i] = Self::atomic_word(op, word, values[i], compare);
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

    pub(super) fn read_indexed(&mut self, to: Operand, base: Operand, stride: u32, count: u32, index: Operand) {
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

    pub(super) fn write_indexed(&mut self, op: &Op) {
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
}
