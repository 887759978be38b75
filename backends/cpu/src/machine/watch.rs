//! What checked execution looks at.

use super::{Lanes, Machine};
use crate::LANES;
use crate::check::{Checker, FaultKind, Use};
use crate::op::{Memory, Operand};

impl Machine<'_> {
    /// Calls `check` for every invocation that is active, and notes what it finds.
    pub(super) fn check(
        &mut self,
        mask: Option<u32>,
        check: impl Fn(&mut Checker, &Self, usize, usize) -> Option<FaultKind>,
    ) {
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
    pub(super) fn check_memory(
        &mut self,
        memory: Memory,
        address: Operand,
        offset: u32,
        usage: Use,
        mask: Option<u32>,
    ) {
        self.check(mask, |checker, machine, row, lane| {
            let address = machine.row(address, row)[lane].wrapping_add(offset) as usize;
            match memory {
                Memory::Workgroup => checker.workgroup_use(address, usage, (row * LANES + lane) as u32),
                Memory::Buffer(slot) | Memory::Halves(slot) => {
                    let address = if let Memory::Halves(_) = memory { address / 2 } else { address };
                    let inside = machine.buffer(slot).is_some_and(|buffer| address < buffer.words.len());
                    let kind =
                        if usage == Use::Read { FaultKind::ReadOutOfBounds } else { FaultKind::WriteOutOfBounds };
                    (!inside).then_some(kind)
                }
            }
        });
    }

    #[cold]
    pub(super) fn check_texture(&mut self, texture: u32, at: [Operand; 3], mask: Option<u32>, kind: FaultKind) {
        let Some(texture) = self.texture(texture) else { return };
        self.check(mask, |_, machine, row, lane| {
            let [x, y, level] = at.map(|operand| machine.row(operand, row)[lane]);
            let level = texture.levels.get(level as usize);
            level.is_none_or(|level| x >= level.width || y >= level.height).then_some(kind)
        });
    }

    #[cold]
    pub(super) fn check_barrier(&mut self, mask: Option<u32>, orders_workgroup: bool) {
        let masks: Vec<Lanes> = (0..self.rows).map(|row| self.mask_row(mask, row)).collect();
        self.check(None, |_, _, row, lane| (masks[row][lane] == 0).then_some(FaultKind::DivergentBarrier));
        if let (Some(checker), true) = (&mut self.checker, orders_workgroup) {
            checker.barrier();
        }
    }
}
