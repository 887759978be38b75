//! Bit fields and packed numbers.

use super::{Compiler, Result};
use crate::op::{Binary, Operand, Unary};

impl Compiler<'_> {
    /// Offset and count of a bit field that does not leave the word, and bits above it.
    pub(super) fn bit_field(&mut self, offset: Operand, count: Operand) -> [Operand; 3] {
        let offset = self.binary(Binary::MinU, offset, Operand::Const(32));
        let room = self.binary(Binary::SubI, Operand::Const(32), offset);
        let count = self.binary(Binary::MinU, count, room);
        let above = self.binary(Binary::SubI, room, count);
        self.release(&[room]);
        [offset, count, above]
    }

    /// `value` where the field has bits, else 0.
    pub(super) fn unless_empty(&mut self, value: Operand, count: Operand) -> Operand {
        let empty = self.binary(Binary::EqI, count, Operand::Const(0));
        let result = self.select(empty, Operand::Const(0), value);
        self.release(&[empty, value]);
        result
    }

    pub(super) fn extract_bits(&mut self, value: Operand, &[_, count, above]: &[Operand; 3], right: Binary) -> Operand {
        let top = self.binary(Binary::ShiftLeft, value, above);
        let below = self.binary(Binary::SubI, Operand::Const(32), count);
        let field = self.fold(right, top, below);
        self.unless_empty(field, count)
    }

    pub(super) fn insert_bits(&mut self, value: Operand, new: Operand, &[offset, count, _]: &[Operand; 3]) -> Operand {
        let unused = self.binary(Binary::SubI, Operand::Const(32), count);
        let ones = self.fold(Binary::ShiftRightU, Operand::Const(u32::MAX), unused);
        let placed = self.binary(Binary::ShiftLeft, ones, offset);
        self.release(&[ones]);
        let mask = self.unless_empty(placed, count);
        let kept = self.binary(Binary::AndNot, value, mask);
        let moved = self.binary(Binary::ShiftLeft, new, offset);
        let inserted = self.fold(Binary::And, moved, mask);
        self.fold(Binary::Or, kept, inserted)
    }

    pub(super) fn dot_packed(&mut self, byte: fn(u8) -> Unary, a: Operand, b: Operand) -> Operand {
        let bytes = |compiler: &mut Self, word| (0..4).map(|i| compiler.unary(byte(i), word)).collect::<Vec<_>>();
        let (a, b) = (bytes(self, a), bytes(self, b));
        let sum = self.dot_of(&a, &b, Binary::MulI, Binary::AddI);
        self.release(&a);
        self.release(&b);
        sum
    }

    pub(super) fn pack_bytes(&mut self, a: &[Operand]) -> Result<Vec<Operand>> {
        let lowest = self.each_pair(Binary::And, a, &[Operand::Const(0xff)])?;
        let mut word = lowest[0];
        for (i, &byte) in lowest.iter().enumerate().skip(1) {
            let shifted = self.fold(Binary::ShiftLeft, byte, Operand::Const(8 * i as u32));
            word = self.fold(Binary::Or, word, shifted);
        }
        Ok(vec![word])
    }

    pub(super) fn pack_clamped(
        &mut self,
        a: &[Operand],
        max: Binary,
        min: Binary,
        low: u32,
        high: u32,
    ) -> Result<Vec<Operand>> {
        let raised = self.each_pair(max, a, &[Operand::Const(low)])?;
        let clamped = self.each_pair(min, &raised, &[Operand::Const(high)])?;
        self.release(&raised);
        let packed = self.pack_bytes(&clamped);
        self.release(&clamped);
        packed
    }

    pub(super) fn pack16(&mut self, op: Unary, a: &[Operand]) -> Result<Vec<Operand>> {
        let (low, high) = (self.unary(op, a[0]), self.unary(op, a[1]));
        Ok(vec![self.fold(Binary::Pack16, low, high)])
    }

    pub(super) fn pack8(&mut self, op: Unary, a: &[Operand]) -> Result<Vec<Operand>> {
        let bytes = self.each(op, a)?;
        let packed = self.pack_bytes(&bytes);
        self.release(&bytes);
        packed
    }
}
