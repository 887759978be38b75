//! Races between workgroups, which nothing orders during a dispatch.

use std::collections::HashMap;

use super::Use;

/// The last two workgroups that used a location in one way, by number plus 1; 0 for none.
#[derive(Debug, Clone, Copy, Default)]
struct Users {
    last: u32,
    before: u32,
}

impl Users {
    fn note(&mut self, group: u32) {
        if self.last != group + 1 {
            (self.last, self.before) = (group + 1, self.last);
        }
    }

    fn other_than(self, group: u32) -> Option<u32> {
        let other = if self.last == group + 1 { self.before } else { self.last };
        other.checked_sub(1)
    }
}

/// How a location was used so far.
#[derive(Debug, Clone, Copy, Default)]
struct Location {
    reads: Users,
    writes: Users,
    atomic_loads: Users,
    atomic_writes: Users,
}

/// Uses of what a dispatch can write.
#[derive(Debug, Default)]
pub(crate) struct Shared {
    /// What stands for the resource of each binding; none if no binding lets the kernel write it.
    resources: Vec<Option<u32>>,
    locations: HashMap<(u32, u32), Location>,
}

impl Shared {
    pub(crate) fn new(resources: Vec<Option<u32>>) -> Self {
        Self { resources, locations: HashMap::new() }
    }

    pub(crate) fn is_written(&self, binding: u32) -> bool {
        self.resources.get(binding as usize).is_some_and(Option::is_some)
    }

    /// Notes a use; another workgroup that must not use the location as well.
    pub(crate) fn note(&mut self, binding: u32, location: u32, usage: Use, group: u32) -> Option<u32> {
        let resource = (*self.resources.get(binding as usize)?)?;
        let Location { reads, writes, atomic_loads, atomic_writes } =
            self.locations.entry((resource, location)).or_default();
        let none = Users::default();
        let conflicts = match usage {
            Use::Read => [*writes, *atomic_writes, none, none],
            Use::Write => [*writes, *reads, *atomic_loads, *atomic_writes],
            Use::AtomicLoad => [*writes, none, none, none],
            Use::Atomic | Use::AtomicStore => [*writes, *reads, none, none],
        };
        let own = match usage {
            Use::Read => reads,
            Use::Write => writes,
            Use::AtomicLoad => atomic_loads,
            Use::Atomic | Use::AtomicStore => atomic_writes,
        };
        own.note(group);
        conflicts.into_iter().find_map(|users| users.other_than(group))
    }
}
