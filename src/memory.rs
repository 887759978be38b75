//! How much memory a plan needs, and which resources can share it.

use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};

use crate::Plan;
use crate::plan::{Grid, Pass};
use crate::resource::{Lifetime, Resource};

/// Memory that limpid allocates, in bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "export", derive(schemars::JsonSchema))]
pub struct Memory {
    /// Kept from frame to frame.
    pub persistent: u64,
    /// Needed only while a frame is denoised; may be shared with other work of the caller.
    pub transient: u64,
}

impl Memory {
    /// Both.
    pub fn total(self) -> u64 {
        self.persistent + self.transient
    }
}

impl Plan {
    /// The passes from the first use of a resource to the last: for what the caller reads to the end of that
    /// stage. `None` for a resource that no pass uses.
    pub fn life(&self, resource: &str) -> Option<RangeInclusive<usize>> {
        let uses = |pass: &Pass| {
            let indirect = matches!(&pass.grid, Grid::Indirect { resource: grid, .. } if grid == resource);
            indirect || pass.bindings.iter().any(|bound| bound.resource == resource)
        };
        let first = self.passes.iter().position(uses)?;
        let mut last = self.passes.iter().rposition(uses)?;
        if self.resource(resource).is_some_and(|resource| resource.exported) {
            let stage = self.passes[last].stage;
            last = self.passes.iter().rposition(|pass| pass.stage == stage)?;
        }
        Some(first..=last)
    }

    /// Resources of limpid by the memory that they can share, as indices into `resources`: each on its own, but
    /// transient ones together where no two are used at the same time. Largest first.
    pub fn memory_slots(&self) -> Vec<Vec<usize>> {
        let bytes = |&index: &usize| self.resources[index].bytes(self.size);
        let mut indices: Vec<_> = (0..self.resources.len()).collect();
        indices.retain(|&index| self.resources[index].lifetime != Lifetime::External);
        indices.sort_by_key(|index| std::cmp::Reverse(bytes(index)));
        let mut slots: Vec<Vec<usize>> = Vec::new();
        for index in indices {
            match slots.iter_mut().find(|slot| slot.iter().all(|&other| self.can_share(index, other))) {
                Some(slot) => slot.push(index),
                None => slots.push(vec![index]),
            }
        }
        slots
    }

    fn can_share(&self, a: usize, b: usize) -> bool {
        let (a, b) = (&self.resources[a], &self.resources[b]);
        let may = |resource: &Resource| resource.lifetime == Lifetime::Transient && !resource.ping_pong;
        match (self.life(&a.name), self.life(&b.name)) {
            (Some(first), Some(second)) if may(a) && may(b) => {
                first.end() < second.start() || second.end() < first.start()
            }
            _ => false,
        }
    }

    /// Memory that limpid allocates when every resource has its own.
    pub fn memory(&self) -> Memory {
        let bytes =
            |lifetime| self.resources.iter().filter(|r| r.lifetime == lifetime).map(|r| r.bytes(self.size)).sum();
        Memory { persistent: bytes(Lifetime::Persistent), transient: bytes(Lifetime::Transient) }
    }

    /// Memory that limpid allocates when resources share it as in [`memory_slots`](Self::memory_slots).
    pub fn shared_memory(&self) -> Memory {
        let bytes = |index: &usize| self.resources[*index].bytes(self.size);
        let slots = self.memory_slots();
        let transient = slots.iter().filter(|slot| self.resources[slot[0]].lifetime == Lifetime::Transient);
        Memory { transient: transient.map(|slot| slot.iter().map(bytes).max().unwrap_or(0)).sum(), ..self.memory() }
    }

    /// Bytes for each pixel when every resource has its own.
    pub fn bytes_per_pixel(&self) -> f64 {
        self.memory().total() as f64 / (f64::from(self.size.x) * f64::from(self.size.y))
    }
}
