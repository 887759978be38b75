//! Which lane registers are in use. Values share registers, so they are counted.

#[derive(Debug, Default)]
pub(crate) struct Registers {
    references: Vec<u32>,
    free: Vec<u32>,
}

impl Registers {
    /// A register with one reference.
    pub(crate) fn allocate(&mut self) -> u32 {
        if let Some(register) = self.free.pop() {
            self.references[register as usize] = 1;
            return register;
        }
        self.references.push(1);
        self.references.len() as u32 - 1
    }

    /// Consecutive registers with one reference each; the first one.
    pub(crate) fn allocate_block(&mut self, count: u32) -> u32 {
        if count == 1 {
            return self.allocate();
        }
        let first = self.references.len() as u32;
        self.references.extend(std::iter::repeat_n(1, count as usize));
        first
    }

    pub(crate) fn retain(&mut self, register: u32) {
        self.references[register as usize] += 1;
    }

    pub(crate) fn release(&mut self, register: u32) {
        let references = &mut self.references[register as usize];
        *references -= 1;
        if *references == 0 {
            self.free.push(register);
        }
    }

    /// Registers that were ever in use.
    pub(crate) fn count(&self) -> u32 {
        self.references.len() as u32
    }
}
