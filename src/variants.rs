//! Kernels that were made for settings, and what backends made of them, kept for when those settings come back.

use std::sync::Arc;

use crate::Error;
use crate::kernel::{Kernel, Overrides, Sources};

/// Most kernels that a denoiser keeps: those of more than three quite different settings.
pub const MAX_VARIANTS: usize = 64;

/// Kernels by pass and overrides, those used last at the end.
#[derive(Debug, Clone, Default)]
pub(crate) struct Variants(Vec<Variant>);

#[derive(Debug, Clone)]
struct Variant {
    pass: &'static str,
    overrides: Overrides,
    kernel: Arc<Kernel>,
}

impl Variants {
    /// The kernel of a pass, made unless it is known.
    pub(crate) fn kernel(
        &mut self,
        pass: &'static str,
        file: &'static str,
        overrides: &Overrides,
    ) -> Result<Arc<Kernel>, Error> {
        let known = self.0.iter().position(|known| known.pass == pass && known.overrides == *overrides);
        let variant = match known {
            Some(index) => self.0.remove(index),
            None => {
                let kernel = Kernel::from_sources(file, overrides, &Sources::BuiltIn)?.renamed(pass);
                Variant { pass, overrides: overrides.clone(), kernel: Arc::new(kernel) }
            }
        };
        let kernel = Arc::clone(&variant.kernel);
        self.0.push(variant);
        if self.0.len() > MAX_VARIANTS {
            self.0.remove(0);
        }
        Ok(kernel)
    }

    pub(crate) fn kernels(&self) -> impl Iterator<Item = &Arc<Kernel>> + Clone {
        self.0.iter().map(|variant| &variant.kernel)
    }
}

/// What a backend made of kernels, such as pipelines.
#[derive(Debug, Clone)]
pub struct Made<T>(Vec<(Arc<Kernel>, T)>);

impl<T> Default for Made<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<T> Made<T> {
    /// What was made of a kernel, if it is still `usable`; else it is made now, and kept.
    ///
    /// # Errors
    ///
    /// Those of `make`; what was kept before stays.
    pub fn get_or_make<E>(
        &mut self,
        kernel: &Arc<Kernel>,
        usable: impl FnOnce(&T) -> bool,
        make: impl FnOnce(&Kernel) -> Result<T, E>,
    ) -> Result<T, E>
    where
        T: Clone,
    {
        let known = self.0.iter().find(|(known, _)| Arc::ptr_eq(known, kernel)).map(|(_, made)| made);
        if let Some(made) = known.filter(|made| usable(made)) {
            return Ok(made.clone());
        }
        let made = make(kernel)?;
        self.0.retain(|(known, _)| !Arc::ptr_eq(known, kernel));
        self.0.push((Arc::clone(kernel), made.clone()));
        Ok(made)
    }

    /// Drops what was made of kernels that are not among `kernels`.
    pub fn keep<'a>(&mut self, kernels: impl Iterator<Item = &'a Arc<Kernel>> + Clone) {
        self.0.retain(|(known, _)| kernels.clone().any(|kernel| Arc::ptr_eq(known, kernel)));
    }

    /// How many are kept.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether none is kept.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}
