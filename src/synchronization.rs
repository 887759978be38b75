//! What has to wait for what, derived from how the passes of a plan use their resources.

use serde::{Deserialize, Serialize};

use crate::Plan;
use crate::plan::{Grid, Pass};
use crate::resource::{Access, Copy, Lifetime, Resource};

/// How a resource is used at some point of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "export", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Usage {
    /// By a kernel.
    Kernel(Access),
    /// As the grid of a dispatch.
    Indirect,
}

impl Usage {
    fn writes(self) -> bool {
        matches!(self, Self::Kernel(access) if access.writes())
    }
}

/// A use of a resource that must see, or must not disturb, an earlier one.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Dependency {
    /// Name of the resource.
    pub resource: String,
    /// Which copy, named as in the frame of the later use.
    pub copy: Copy,
    /// Index of the pass of the earlier use.
    pub pass: usize,
    /// How many frames ago that pass ran: 0 for the same frame, at most 2.
    pub frames_ago: usize,
    /// The earlier use.
    pub before: Usage,
    /// The later use.
    pub after: Usage,
}

/// A set of ways in which passes use memory: one side of a [`Barrier`].
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "export", derive(schemars::JsonSchema))]
pub struct Scope {
    /// Kernels that read.
    pub kernel_reads: bool,
    /// Kernels that write.
    pub kernel_writes: bool,
    /// Grids read from a buffer.
    pub indirect: bool,
}

impl Scope {
    fn add(&mut self, usage: Usage) {
        match usage {
            Usage::Kernel(access) => {
                self.kernel_reads |= access != Access::Write;
                self.kernel_writes |= access.writes();
            }
            Usage::Indirect => self.indirect = true,
        }
    }

    /// Whether it includes a use.
    pub fn contains(self, usage: Usage) -> bool {
        let mut with = self;
        with.add(usage);
        with == self
    }
}

/// A barrier on all memory: what was recorded before it and is in scope `before` comes first.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "export", derive(schemars::JsonSchema))]
pub struct Barrier {
    /// What has to be finished, its writes visible.
    pub before: Scope,
    /// What waits.
    pub after: Scope,
}

/// A use with its place in a run of several frames.
#[derive(Debug, Clone, Copy)]
struct Use {
    position: usize,
    usage: Usage,
}

/// How a resource was used since, and including, its last write.
#[derive(Debug, Clone, Default)]
struct Uses {
    write: Option<Use>,
    reads: Vec<Use>,
}

impl Uses {
    /// Notes a use and returns the earlier ones that it has to wait for.
    fn then(&mut self, after: Use) -> Vec<Use> {
        if after.usage.writes() {
            let reads = std::mem::take(&mut self.reads);
            let write = self.write.replace(after);
            // Reads waited for the write before them.
            return if reads.is_empty() { write.into_iter().collect() } else { reads };
        }
        let repeated = self.reads.iter_mut().find(|read| read.usage == after.usage);
        if let Some(read) = repeated {
            *read = after;
            return Vec::new();
        }
        self.reads.push(after);
        self.write.into_iter().collect()
    }
}

/// Frames after which dependencies repeat: in the first two there is less to wait for.
const FRAMES: usize = 3;

/// The latest place with a barrier between the earlier use and the later one, which is by `pass`.
fn place_of(dependency: &Dependency, pass: usize, barriers: &[Option<Barrier>]) -> Option<usize> {
    let count = barriers.len();
    // Seen from a frame so late that no place is negative.
    let after = FRAMES * count + pass;
    let before = (FRAMES - dependency.frames_ago) * count + dependency.pass;
    (before + 1..=after).rev().map(|place| place % count).find(|&place| barriers[place].is_some())
}

impl Plan {
    /// What each pass has to wait for, in a frame that follows others.
    ///
    /// Uses that only read do not wait for each other, whatever a backend has to do about image layouts. A
    /// read that follows another of the same kind waits through that one.
    pub fn dependencies(&self) -> Vec<Vec<Dependency>> {
        let run = self.run_dependencies();
        run[(FRAMES - 1) * self.passes.len()..].to_vec()
    }

    /// The barrier before each pass that needs one, so few that none can be left out: passes overlap where they
    /// can. In a frame that follows others; a first frame needs no more. Between the uses of the caller and
    /// those of limpid it is the caller who synchronises, or the backend.
    pub fn barriers(&self) -> Vec<Option<Barrier>> {
        let count = self.passes.len();
        let dependencies = self.dependencies();
        let all = || dependencies.iter().enumerate().flat_map(|(pass, of_pass)| of_pass.iter().map(move |d| (pass, d)));
        let mut barriers = vec![None; count];
        for (pass, dependency) in all() {
            if place_of(dependency, pass, &barriers).is_none() {
                barriers[pass] = Some(Barrier::default());
            }
        }
        for place in 0..count {
            let barrier = barriers[place].take();
            if !all().all(|(pass, dependency)| place_of(dependency, pass, &barriers).is_some()) {
                barriers[place] = barrier;
            }
        }
        for (pass, dependency) in all() {
            let place = place_of(dependency, pass, &barriers);
            if let Some(barrier) = place.and_then(|place| barriers[place].as_mut()) {
                barrier.before.add(dependency.before);
                barrier.after.add(dependency.after);
            }
        }
        barriers
    }

    /// Dependencies of each pass of several frames in a row.
    fn run_dependencies(&self) -> Vec<Vec<Dependency>> {
        // Resources that share memory wait for each other as if they were one.
        let mut slots = vec![0; self.resources.len()];
        for (slot, indices) in self.memory_slots().into_iter().enumerate() {
            indices.into_iter().for_each(|index| slots[index] = slot);
        }
        let mut uses = vec![<[Uses; 2]>::default(); self.resources.len()];
        let frames =
            (0..FRAMES).flat_map(|frame| self.passes.iter().enumerate().map(move |(i, pass)| (frame, i, pass)));
        frames
            .map(|(frame, index, pass)| {
                let position = frame * self.passes.len() + index;
                self.pass_uses(pass)
                    .flat_map(|(at, copy, usage)| {
                        let memory = &mut uses[slots[at]][copy.index(self.resources[at].ping_pong, frame % 2)];
                        // Within a pass there is nothing to wait for.
                        let before = memory.then(Use { position, usage }).into_iter().filter(|b| b.position < position);
                        before.map(|before| self.dependency(at, copy, before, frame, usage)).collect::<Vec<_>>()
                    })
                    .collect()
            })
            .collect()
    }

    /// Index of resource, copy and usage of everything of limpid that a pass uses.
    fn pass_uses(&self, pass: &Pass) -> impl Iterator<Item = (usize, Copy, Usage)> {
        let bound = pass.bindings.iter().map(|b| (b.resource.as_str(), b.copy, Usage::Kernel(b.access)));
        let indirect = match &pass.grid {
            Grid::Indirect { resource, .. } => Some((resource.as_str(), Copy::Current, Usage::Indirect)),
            Grid::One | Grid::Squares { .. } => None,
        };
        bound.chain(indirect).filter_map(|(name, copy, usage)| {
            let is_own = |resource: &Resource| resource.name == name && resource.lifetime != Lifetime::External;
            Some((self.resources.iter().position(is_own)?, copy, usage))
        })
    }

    fn dependency(&self, resource: usize, copy: Copy, before: Use, frame: usize, after: Usage) -> Dependency {
        let count = self.passes.len();
        Dependency {
            resource: self.resources[resource].name.clone(),
            copy,
            pass: before.position % count,
            frames_ago: frame - before.position / count,
            before: before.usage,
            after,
        }
    }
}
