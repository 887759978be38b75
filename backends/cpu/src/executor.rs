use naga::valid::ModuleInfo;
use rayon::prelude::*;

use crate::compile::{BindingSlot, Code, SlotKind, compile};
use crate::inexact::Inexact;
use crate::machine::{Bound, Machine};
use crate::{Buffer, CompileError, DispatchError, Fault, Probe, Sampler, Texture};

/// A resource for a binding of a kernel.
#[derive(Debug, Clone, Copy)]
pub struct Binding<'a> {
    group: u32,
    binding: u32,
    bound: Bound<'a>,
}

impl<'a> Binding<'a> {
    /// Binds a buffer.
    pub fn buffer(group: u32, binding: u32, buffer: &'a Buffer) -> Self {
        Self { group, binding, bound: Bound::Buffer(buffer) }
    }

    /// Binds a texture.
    pub fn texture(group: u32, binding: u32, texture: &'a Texture) -> Self {
        Self { group, binding, bound: Bound::Texture(texture) }
    }

    /// Binds a sampler.
    pub fn sampler(group: u32, binding: u32, sampler: Sampler) -> Self {
        Self { group, binding, bound: Bound::Sampler(sampler) }
    }
}

/// A compiled compute kernel.
#[derive(Debug, Clone)]
pub struct Executor {
    code: Code,
}

impl Executor {
    /// Compiles an entry point of a validated module without overrides.
    ///
    /// # Errors
    ///
    /// [`CompileError`] for what the executor does not know; nothing is left to fail while running.
    pub fn new(module: &naga::Module, info: &ModuleInfo, entry_point: &str) -> Result<Self, CompileError> {
        Ok(Self { code: compile(module, info, entry_point)? })
    }

    /// The same with subgroups of `size` invocations rather than [`SUBGROUP_SIZE`](crate::SUBGROUP_SIZE).
    /// Invocations of a workgroup are in subgroups by their local index. What a subgroup operation reads from an
    /// invocation that does not exist or does not take part is 0; sums and products go through invocations in order.
    ///
    /// # Errors
    ///
    /// [`CompileError::SubgroupSize`] for a size other than 4, 8, 16, 32 and 64.
    pub fn with_subgroup_size(mut self, size: u32) -> Result<Self, CompileError> {
        if ![4, 8, 16, 32, 64].contains(&size) {
            return Err(CompileError::SubgroupSize { size });
        }
        self.code.subgroup_size = size;
        Ok(self)
    }

    /// The same with functions that are as inexact as Vulkan lets devices be: divisions, roots, exponentials,
    /// logarithms, powers and trigonometric functions get errors within the bounds of the specification, which
    /// depend on `seed` and on their result. Shows what hangs on last digits, and so what devices may disagree on.
    pub fn with_inexact_functions(mut self, seed: u32) -> Self {
        self.code.inexact = Some(Inexact { seed });
        self
    }

    /// Number of instructions.
    pub fn instruction_count(&self) -> usize {
        self.code.ops.len()
    }

    fn bind<'a>(&self, slot: &BindingSlot, bindings: &[Binding<'a>]) -> Result<Bound<'a>, DispatchError> {
        let BindingSlot { name, group, binding, kind } = slot;
        let given = bindings.iter().find(|given| given.group == *group && given.binding == *binding);
        let fail = |expected| DispatchError::Binding { name: name.clone(), group: *group, binding: *binding, expected };
        match (given.map(|given| given.bound), kind) {
            (Some(bound @ Bound::Buffer(_)), SlotKind::Buffer { .. }) => Ok(bound),
            (Some(bound @ Bound::Texture(_)), SlotKind::Texture { .. }) => Ok(bound),
            (Some(bound @ Bound::Sampler(sampler)), SlotKind::Sampler { comparison })
                if sampler.compare.is_some() == *comparison =>
            {
                Ok(bound)
            }
            (_, SlotKind::Sampler { comparison: true }) => Err(fail("a sampler that compares")),
            (_, SlotKind::Sampler { comparison: false }) => Err(fail("a sampler that does not compare")),
            (_, SlotKind::Buffer { .. }) => Err(fail("a buffer")),
            (_, SlotKind::Texture { .. }) => Err(fail("a texture")),
        }
    }

    /// Runs `groups` workgroups.
    ///
    /// # Errors
    ///
    /// [`DispatchError`] for a binding that is missing or of another kind.
    pub fn dispatch(&self, groups: [u32; 3], bindings: &[Binding<'_>]) -> Result<(), DispatchError> {
        let bound = self.bind_all(bindings)?;
        (0..count(groups)).into_par_iter().with_min_len(8).for_each_init(
            || Machine::new(&self.code, &bound, groups),
            |machine, index| machine.run(position(groups, index)),
        );
        Ok(())
    }

    /// Runs `groups` workgroups one after another and watches what they do: uninitialised or racy use of
    /// workgroup memory, races between workgroups, accesses out of bounds, barriers that not all reach. Results are
    /// those of [`dispatch`](Self::dispatch). Races for buffers inside a workgroup are not seen.
    ///
    /// # Errors
    ///
    /// As [`dispatch`](Self::dispatch).
    pub fn dispatch_checked(&self, groups: [u32; 3], bindings: &[Binding<'_>]) -> Result<Vec<Fault>, DispatchError> {
        let bound = self.bind_all(bindings)?;
        let mut machine = Machine::checked(&self.code, &bound, groups);
        (0..count(groups)).for_each(|index| machine.run(position(groups, index)));
        Ok(machine.into_faults())
    }

    /// Runs `groups` workgroups one after another and watches what happens to numbers: where NaN, infinity,
    /// denormal numbers and cancellation arise, and how far outputs are from what 64 bits would give. Results are
    /// those of [`dispatch`](Self::dispatch).
    ///
    /// # Errors
    ///
    /// As [`dispatch`](Self::dispatch).
    pub fn dispatch_probed(&self, groups: [u32; 3], bindings: &[Binding<'_>]) -> Result<Probe, DispatchError> {
        let bound = self.bind_all(bindings)?;
        let mut machine = Machine::probed(&self.code, &bound, groups);
        (0..count(groups)).for_each(|index| machine.run(position(groups, index)));
        Ok(machine.into_probe())
    }

    fn bind_all<'a>(&self, bindings: &[Binding<'a>]) -> Result<Vec<Bound<'a>>, DispatchError> {
        self.code.bindings.iter().map(|slot| self.bind(slot, bindings)).collect()
    }
}

fn count(groups: [u32; 3]) -> usize {
    groups.iter().map(|&count| count as usize).product()
}

/// Position of a workgroup by its number, `x` fastest.
fn position(groups: [u32; 3], index: usize) -> [u32; 3] {
    let [width, height, _] = groups.map(|count| count as usize);
    [index % width, index / width % height, index / (width * height)].map(|i| i as u32)
}
