//! Pointers, loads and stores.

use naga::{AtomicFunction, Expression, Handle, ScalarKind, TypeInner};

use super::{Compiler, Inlined, Place, Result, Root, Value, unsupported};
use crate::layout::{element_count, part, scalar_count};
use crate::op::{Atomic, Binary, Memory, Op, Operand};

impl Place {
    fn is_in_buffer(&self) -> bool {
        matches!(self.root, Root::Memory(Memory::Buffer(_)))
    }
}

impl<'a> Compiler<'a> {
    /// What a pointer points to.
    pub(super) fn place(&mut self, frame: &mut Inlined<'a>, handle: Handle<Expression>) -> Result<Place> {
        if let Some(Value::Place(place)) = &frame.values[handle.index()] {
            return Ok(place.clone());
        }
        match &frame.function.expressions[handle] {
            Expression::GlobalVariable(global) => match self.globals.get(global) {
                Some(Value::Place(place)) => Ok(place.clone()),
                _ => unsupported("a pointer to a texture or sampler"),
            },
            Expression::LocalVariable(local) => {
                let inner = self.module.types[frame.function.local_variables[*local].ty].inner.clone();
                let root = Root::Variable(frame.locals[local]);
                Ok(Place { root, inner, offset: 0, dynamic: Vec::new() })
            }
            Expression::FunctionArgument(index) => match &frame.arguments[*index as usize] {
                Value::Place(place) => Ok(place.clone()),
                _ => unsupported("a value as a pointer"),
            },
            Expression::AccessIndex { base, index } => {
                let place = self.place(frame, *base)?;
                self.part_of(place, *index)
            }
            Expression::Access { base, index } => {
                let mut place = self.place(frame, *base)?;
                let index = self.data(frame, *index)?[0];
                if let Operand::Const(index) = index {
                    let last = element_count(&place.inner).map_or(index, |count| count - 1);
                    return self.part_of(place, index.min(last));
                }
                let Some(second) = part(self.module, &place.inner, 1) else {
                    return unsupported(format!("an index into {:?}", place.inner));
                };
                let stride = if place.is_in_buffer() { second.bytes } else { second.scalars };
                place.dynamic.push((index, stride, element_count(&place.inner)));
                place.inner = second.inner;
                Ok(place)
            }
            other => unsupported(format!("a pointer from {other:?}")),
        }
    }

    fn part_of(&self, mut place: Place, index: u32) -> Result<Place> {
        let Some(part) = part(self.module, &place.inner, index) else {
            return unsupported(format!("a part of {:?}", place.inner));
        };
        place.offset += if place.is_in_buffer() { part.bytes } else { part.scalars };
        place.inner = part.inner;
        Ok(place)
    }

    /// The dynamic part of an address, in units of so many bytes or scalars.
    fn address(&mut self, place: &Place, unit: u32) -> Operand {
        let mut address = Operand::Const(0);
        for &(index, stride, _) in &place.dynamic {
            let scaled = self.binary(Binary::MulI, index, Operand::Const(stride / unit));
            let sum = self.binary(Binary::AddI, address, scaled);
            self.release(&[address, scaled]);
            address = sum;
        }
        address
    }

    /// Where each scalar of a place in memory is: memory, dynamic and fixed part of the address. The dynamic parts
    /// are to be released: those of words and of half words.
    fn addresses(&mut self, place: &Place, memory: Memory) -> (Vec<(Memory, Operand, u32)>, [Operand; 2]) {
        let Memory::Buffer(buffer) = memory else {
            let address = self.address(place, 1);
            let count = scalar_count(self.module, &place.inner).unwrap_or(0);
            let all = (0..count).map(|scalar| (memory, address, place.offset + scalar)).collect();
            return (all, [address, Operand::Const(0)]);
        };
        let mut slots = Vec::new();
        crate::layout::slots(self.module, &place.inner, place.offset, &mut slots);
        let of = |compiler: &mut Self, half: bool| match slots.iter().any(|slot| slot.is_half == half) {
            true => compiler.address(place, if half { 2 } else { 4 }),
            false => Operand::Const(0),
        };
        let [words, halves] = [false, true].map(|half| of(self, half));
        let all = slots.iter().map(|slot| match slot.is_half {
            true => (Memory::Halves(buffer), halves, slot.offset / 2),
            false => (memory, words, slot.offset / 4),
        });
        (all.collect(), [words, halves])
    }

    /// Index into the registers of a variable, distance between elements, and number of elements. The index has a
    /// reference of its own.
    fn variable_index(&mut self, place: &Place, variable: usize) -> (Operand, u32, u32) {
        if let [(index, stride, Some(count))] = place.dynamic[..] {
            self.retain(&[index]);
            return (index, stride, count);
        }
        let mut sum = Operand::Const(0);
        for &(index, stride, count) in &place.dynamic {
            let last = Operand::Const(count.map_or(u32::MAX, |count| count - 1));
            let clamped = self.binary(Binary::MinU, index, last);
            let scaled = self.fold(Binary::MulI, clamped, Operand::Const(stride));
            sum = self.fold(Binary::AddI, sum, scaled);
        }
        (sum, 1, self.variables[variable].count - place.offset)
    }

    pub(super) fn load(&mut self, place: &Place) -> Result<Vec<Operand>> {
        self.count(&place.inner)?;
        match place.root {
            Root::Memory(memory) => {
                let (addresses, parts) = self.addresses(place, memory);
                // Only constant buffers hold the same for all: others change while the kernel runs.
                let uniform = self.is_constant(memory);
                let load = |compiler: &mut Self, (memory, address, offset): (Memory, Operand, u32)| {
                    if let TypeInner::Atomic(_) = place.inner {
                        let to = compiler.registers.allocate();
                        let zero = Operand::Const(0);
                        compiler.atomic_op(Atomic::Load, Some(to), (memory, address, offset), zero, None);
                        return Operand::Lane(to);
                    }
                    let to = match uniform {
                        true => compiler.result(&[address]),
                        false => Operand::Lane(compiler.registers.allocate()),
                    };
                    compiler.emit(Op::Load { to, memory, address, offset, mask: compiler.mask });
                    to
                };
                let values = addresses.into_iter().map(|address| load(self, address)).collect();
                self.release(&parts);
                Ok(values)
            }
            Root::Variable(variable) => {
                let count = self.count(&place.inner)?;
                let (index, stride, elements) = self.variable_index(place, variable);
                let read = |compiler: &mut Self, scalar| {
                    let base = compiler.variable_operand(variable, place.offset + scalar);
                    let to = compiler.result(&[base, index]);
                    compiler.emit(Op::ReadIndexed { to, base, stride, count: elements, index });
                    to
                };
                let values = (0..count).map(|scalar| read(self, scalar)).collect();
                self.release(&[index]);
                Ok(values)
            }
        }
    }

    fn is_constant(&self, memory: Memory) -> bool {
        match memory {
            Memory::Buffer(slot) | Memory::Halves(slot) => {
                self.bindings[slot as usize].kind == super::SlotKind::Buffer { writable: false }
            }
            Memory::Workgroup => false,
        }
    }

    pub(super) fn store(&mut self, place: &Place, operands: &[Operand]) -> Result<()> {
        match place.root {
            Root::Memory(memory) => {
                let (addresses, parts) = self.addresses(place, memory);
                for ((memory, address, offset), &a) in addresses.into_iter().zip(operands) {
                    if let TypeInner::Atomic(_) = place.inner {
                        self.atomic_op(Atomic::Store, None, (memory, address, offset), a, None);
                    } else {
                        self.emit(Op::Store { memory, address, offset, a, mask: self.mask });
                    }
                }
                self.release(&parts);
            }
            Root::Variable(variable) if place.dynamic.is_empty() => {
                for (scalar, &operand) in operands.iter().enumerate() {
                    self.assign(variable, place.offset + scalar as u32, operand);
                }
            }
            Root::Variable(variable) => {
                let (index, stride, count) = self.variable_index(place, variable);
                let lanes = |operand: &Operand| matches!(operand, Operand::Lane(_));
                let declared = &self.variables[variable];
                let must_vary = self.depth > declared.depth || operands.iter().any(lanes) || lanes(&index);
                if must_vary && !declared.varying {
                    self.mark_varying(variable);
                    self.release(&[index]);
                    return Ok(());
                }
                let mask = if self.variables[variable].varying { self.mask } else { None };
                for (scalar, &a) in operands.iter().enumerate() {
                    let base = self.variable_operand(variable, place.offset + scalar as u32);
                    self.emit(Op::WriteIndexed { base, stride, count, index, a, mask });
                }
                self.release(&[index]);
            }
        }
        Ok(())
    }

    /// The value before, if it is wanted, and for a conditional exchange whether it happened.
    pub(super) fn atomic(
        &mut self,
        frame: &mut Inlined<'a>,
        pointer: Handle<Expression>,
        function: AtomicFunction,
        value: Handle<Expression>,
        wanted: bool,
    ) -> Result<Vec<Operand>> {
        let place = self.place(frame, pointer)?;
        let Root::Memory(memory) = place.root else { return unsupported("an atomic variable of a function") };
        let signed = matches!(place.inner, TypeInner::Atomic(scalar) if scalar.kind == ScalarKind::Sint);
        let op = match function {
            AtomicFunction::Add => Atomic::Add,
            AtomicFunction::Subtract => Atomic::Subtract,
            AtomicFunction::And => Atomic::And,
            AtomicFunction::ExclusiveOr => Atomic::Xor,
            AtomicFunction::InclusiveOr => Atomic::Or,
            AtomicFunction::Min => {
                if signed {
                    Atomic::MinI
                } else {
                    Atomic::MinU
                }
            }
            AtomicFunction::Max => {
                if signed {
                    Atomic::MaxI
                } else {
                    Atomic::MaxU
                }
            }
            AtomicFunction::Exchange { .. } => Atomic::Exchange,
        };
        let a = self.data(frame, value)?[0];
        let condition = if let AtomicFunction::Exchange { compare } = function { compare } else { None };
        let compare = condition.map(|handle| self.data(frame, handle)).transpose()?.map(|operands| operands[0]);
        let (addresses, parts) = self.addresses(&place, memory);
        let to = wanted.then(|| self.registers.allocate());
        for address in addresses {
            self.atomic_op(op, to, address, a, compare);
        }
        self.release(&parts);
        let mut results: Vec<_> = to.into_iter().map(Operand::Lane).collect();
        if let (Some(compare), Some(&old)) = (compare, results.first()) {
            results.push(self.binary(Binary::EqI, old, compare));
        }
        self.used(frame, value);
        if let Some(handle) = condition {
            self.used(frame, handle);
        }
        Ok(results)
    }

    fn atomic_op(
        &mut self,
        op: Atomic,
        to: Option<u32>,
        (memory, address, offset): (Memory, Operand, u32),
        a: Operand,
        compare: Option<Operand>,
    ) {
        self.emit(Op::Atomic { op, to, memory, address, offset, a, compare, mask: self.mask });
    }

    pub(super) fn array_length(
        &mut self,
        frame: &mut Inlined<'a>,
        pointer: Handle<Expression>,
    ) -> Result<Vec<Operand>> {
        let place = self.place(frame, pointer)?;
        match (&place.root, &place.inner) {
            (Root::Memory(Memory::Buffer(buffer)), TypeInner::Array { stride, .. }) => {
                let to = self.scalar();
                self.emit(Op::ArrayLength { to, buffer: *buffer, offset: place.offset, stride: *stride });
                Ok(vec![to])
            }
            _ => unsupported("arrayLength of what is no buffer"),
        }
    }
}
