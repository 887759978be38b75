//! What invocations of a subgroup do together.

use naga::{CollectiveOperation, Direction, Expression, GatherMode, Handle, Scalar, ScalarKind, SubgroupOperation};

use super::{Compiler, Inlined, Result, unsupported};
use crate::op::{Binary, Fold, Op, Operand, Subgroup};

impl<'a> Compiler<'a> {
    fn subgroup(&mut self, op: Subgroup, a: Operand, index: Operand) -> Operand {
        let to = self.registers.allocate();
        self.emit(Op::Subgroup { op, to, a, index, mask: self.mask });
        Operand::Lane(to)
    }

    pub(super) fn ballot(
        &mut self,
        frame: &mut Inlined<'a>,
        predicate: Option<Handle<Expression>>,
    ) -> Result<Vec<Operand>> {
        let a = predicate.map_or(Ok(Operand::Const(u32::MAX)), |handle| Ok(self.data(frame, handle)?[0]))?;
        let zero = Operand::Const(0);
        // A subgroup has at most 64 invocations.
        let words = [0, 1].map(|word| self.subgroup(Subgroup::Ballot(word), a, zero));
        if let Some(handle) = predicate {
            self.used(frame, handle);
        }
        Ok(vec![words[0], words[1], zero, zero])
    }

    pub(super) fn collective(
        &mut self,
        frame: &mut Inlined<'a>,
        operation: SubgroupOperation,
        collective: CollectiveOperation,
        argument: Handle<Expression>,
    ) -> Result<Vec<Operand>> {
        use SubgroupOperation as S;
        let kind = self.kind(frame, argument)?;
        let one = if kind == ScalarKind::Float { 1f32.to_bits() } else { 1 };
        let (op, identity) = match (operation, kind) {
            (S::All | S::And, _) => (Binary::And, u32::MAX),
            (S::Any | S::Or, _) => (Binary::Or, 0),
            (S::Xor, _) => (Binary::Xor, 0),
            (S::Add, ScalarKind::Float) => (Binary::AddF, 0),
            (S::Add, _) => (Binary::AddI, 0),
            (S::Mul, ScalarKind::Float) => (Binary::MulF, one),
            (S::Mul, _) => (Binary::MulI, one),
            (S::Min, ScalarKind::Float) => (Binary::MinF, f32::INFINITY.to_bits()),
            (S::Min, ScalarKind::Sint) => (Binary::MinI, i32::MAX.cast_unsigned()),
            (S::Min, _) => (Binary::MinU, u32::MAX),
            (S::Max, ScalarKind::Float) => (Binary::MaxF, f32::NEG_INFINITY.to_bits()),
            (S::Max, ScalarKind::Sint) => (Binary::MaxI, i32::MIN.cast_unsigned()),
            (S::Max, _) => (Binary::MaxU, 0),
        };
        let is_half = self.inner(frame, argument).scalar() == Some(Scalar::F16);
        let fold = Fold { op, identity, is_half };
        let op = match collective {
            CollectiveOperation::Reduce => Subgroup::Reduce(fold),
            CollectiveOperation::InclusiveScan => Subgroup::Inclusive(fold),
            CollectiveOperation::ExclusiveScan => Subgroup::Exclusive(fold),
        };
        let values = self.data(frame, argument)?;
        let all = values.into_iter().map(|value| self.subgroup(op, value, Operand::Const(0))).collect();
        self.used(frame, argument);
        Ok(all)
    }

    pub(super) fn gather(
        &mut self,
        frame: &mut Inlined<'a>,
        mode: GatherMode,
        argument: Handle<Expression>,
    ) -> Result<Vec<Operand>> {
        let (op, index) = match mode {
            GatherMode::BroadcastFirst => (Subgroup::BroadcastFirst, None),
            GatherMode::Broadcast(index) | GatherMode::Shuffle(index) => (Subgroup::Shuffle, Some(index)),
            GatherMode::ShuffleDown(index) => (Subgroup::ShuffleDown, Some(index)),
            GatherMode::ShuffleUp(index) => (Subgroup::ShuffleUp, Some(index)),
            GatherMode::ShuffleXor(index) => (Subgroup::ShuffleXor, Some(index)),
            GatherMode::QuadBroadcast(index) => (Subgroup::QuadBroadcast, Some(index)),
            GatherMode::QuadSwap(_) => (Subgroup::ShuffleXor, None),
        };
        let at = match (mode, index) {
            (GatherMode::QuadSwap(Direction::X), _) => Operand::Const(1),
            (GatherMode::QuadSwap(Direction::Y), _) => Operand::Const(2),
            (GatherMode::QuadSwap(Direction::Diagonal), _) => Operand::Const(3),
            (_, Some(index)) => self.data(frame, index)?[0],
            (_, None) => Operand::Const(0),
        };
        if self.inner(frame, argument).scalar().is_none() {
            return unsupported("a value in a subgroup that is no scalar or vector");
        }
        let values = self.data(frame, argument)?;
        let all = values.into_iter().map(|value| self.subgroup(op, value, at)).collect();
        self.used(frame, argument);
        if let Some(index) = index {
            self.used(frame, index);
        }
        Ok(all)
    }
}
