//! What checked execution looks at.

use super::{Lanes, Machine};
use crate::LANES;
use crate::check::{Checker, FaultKind, Found, Use};
use crate::op::{Memory, Operand};

impl Machine<'_> {
    /// Calls `check` for every invocation that is active, and notes what it finds.
    pub(super) fn check(
        &mut self,
        mask: Option<u32>,
        check: impl Fn(&mut Checker, &Self, usize, usize) -> Option<Found>,
    ) {
        let Some(mut checker) = self.checker.take() else { return };
        let invocations = self.code.workgroup_size.iter().product::<u32>() as usize;
        for index in 0..invocations {
            let (row, lane) = (index / LANES, index % LANES);
            if self.mask_row(mask, row)[lane] == 0 {
                continue;
            }
            if let Some(found) = check(&mut checker, self, row, lane) {
                checker.fault(self.current, self.code.spans[self.current], found, index as u32);
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
            let (binding, word) = match memory {
                Memory::Workgroup => {
                    let kind = checker.workgroup_use(address, usage, (row * LANES + lane) as u32);
                    return kind.map(Found::from);
                }
                Memory::Buffer(binding) => (binding, address),
                Memory::Halves(binding) => (binding, address / 2),
            };
            if machine.buffer(binding).is_none_or(|buffer| word >= buffer.words.len()) {
                return Some(usage.out_of_bounds().into());
            }
            let location = if let Memory::Halves(_) = memory { address } else { 2 * address };
            checker.shared_use(binding, location as u32, usage)
        });
    }

    #[cold]
    pub(super) fn check_texture(&mut self, binding: u32, at: [Operand; 3], usage: Use, mask: Option<u32>) {
        let Some(texture) = self.texture(binding) else { return };
        self.check(mask, |checker, machine, row, lane| {
            let [x, y, level] = at.map(|operand| machine.row(operand, row)[lane]);
            let level = texture.levels.get(level as usize);
            match level.filter(|level| x < level.width && y < level.height) {
                Some(level) => checker.shared_use(binding, texture.first_word(level, x, y), usage),
                None => Some(usage.out_of_bounds().into()),
            }
        });
    }

    /// For texels that a sampler read.
    #[cold]
    pub(super) fn check_reads(&mut self, binding: u32, texels: &[u32], invocation: usize) {
        let Some(checker) = &mut self.checker else { return };
        for &texel in texels {
            if let Some(found) = checker.shared_use(binding, texel, Use::Read) {
                checker.fault(self.current, self.code.spans[self.current], found, invocation as u32);
            }
        }
    }

    #[cold]
    pub(super) fn check_barrier(&mut self, mask: Option<u32>, orders_workgroup: bool) {
        let masks: Vec<Lanes> = (0..self.rows).map(|row| self.mask_row(mask, row)).collect();
        self.check(None, |_, _, row, lane| (masks[row][lane] == 0).then_some(FaultKind::DivergentBarrier.into()));
        if let (Some(checker), true) = (&mut self.checker, orders_workgroup) {
            checker.barrier();
        }
    }
}
