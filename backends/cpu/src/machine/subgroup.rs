//! Operations of subgroups: neighbouring lanes of a row.

use super::{Lanes, Machine};
use crate::LANES;
use crate::eval;
use crate::op::{Fold, Op, Subgroup, Unary};

impl Fold {
    fn apply(self, a: u32, b: u32) -> u32 {
        let result = eval::binary(self.op, a, b);
        if self.is_half { eval::unary(Unary::QuantizeToF16, result) } else { result }
    }
}

/// Values and active invocations of one subgroup.
struct Group<'a> {
    values: &'a [u32],
    active: &'a [u32],
}

impl Group<'_> {
    /// The value of an invocation; 0 of one that takes no part.
    fn value(&self, lane: u32) -> u32 {
        let lane = lane as usize;
        if self.active.get(lane).is_some_and(|active| *active != 0) { self.values[lane] } else { 0 }
    }

    /// Results for all lanes. `fold` in the order of lanes.
    fn scan(&self, fold: Fold, to: &mut [u32], inclusive: bool) -> u32 {
        let mut total = None;
        for lane in (0..self.values.len()).filter(|&lane| self.active[lane] != 0) {
            let before = total;
            let value = self.values[lane];
            total = Some(before.map_or(value, |total| fold.apply(total, value)));
            to[lane] = if inclusive { total } else { before }.unwrap_or(fold.identity);
        }
        total.unwrap_or(fold.identity)
    }

    fn run(&self, op: Subgroup, index: &[u32], to: &mut [u32]) {
        let from = |source: &dyn Fn(u32, u32) -> u32, to: &mut [u32]| {
            for (lane, to) in (0..).zip(to) {
                *to = self.value(source(lane, index[lane as usize]));
            }
        };
        match op {
            Subgroup::Ballot(word) => {
                let lanes = 32 * u32::from(word)..32 * u32::from(word) + 32;
                let bits = lanes.map(|lane| u32::from(self.value(lane) != 0) << (lane % 32));
                to.fill(bits.fold(0, |all, bit| all | bit));
            }
            Subgroup::Reduce(fold) => {
                let total = self.scan(fold, to, true);
                to.fill(total);
            }
            Subgroup::Inclusive(fold) => {
                self.scan(fold, to, true);
            }
            Subgroup::Exclusive(fold) => {
                self.scan(fold, to, false);
            }
            Subgroup::BroadcastFirst => {
                let first = self.active.iter().position(|active| *active != 0).unwrap_or(0);
                to.fill(self.value(first as u32));
            }
            Subgroup::Shuffle => from(&|_, index| index, to),
            Subgroup::ShuffleXor => from(&|lane, index| lane ^ index, to),
            Subgroup::ShuffleUp => from(&|lane, index| lane.wrapping_sub(index), to),
            Subgroup::ShuffleDown => from(&|lane, index| lane.saturating_add(index), to),
            Subgroup::QuadBroadcast => from(&|lane, index| lane / 4 * 4 + index % 4, to),
        }
    }
}

impl Machine<'_> {
    pub(super) fn subgroup(&mut self, operation: &Op) {
        let Op::Subgroup { op, to, a, index, mask } = *operation else { return };
        let size = self.code.subgroup_size as usize;
        for row in 0..self.rows {
            let (values, active, index) = (self.row(a, row), self.mask_row(mask, row), self.row(index, row));
            let mut results: Lanes = [0; LANES];
            for start in (0..LANES).step_by(size) {
                let lanes = start..start + size;
                let group = Group { values: &values[lanes.clone()], active: &active[lanes.clone()] };
                group.run(op, &index[lanes.clone()], &mut results[lanes]);
            }
            let to = self.at(to, row);
            self.lanes[to] = results;
        }
    }
}
