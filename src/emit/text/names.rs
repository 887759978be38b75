//! Names: as in the sources, with an underscore where a language reserves them and a number where they are taken.

use std::collections::HashSet;

/// Names that are visible at some place of a program.
#[derive(Debug)]
pub(super) struct Names {
    reserved: HashSet<&'static str>,
    scopes: Vec<HashSet<String>>,
}

impl Names {
    pub(super) fn new(reserved: impl IntoIterator<Item = &'static str>) -> Self {
        Self { reserved: reserved.into_iter().collect(), scopes: vec![HashSet::new()] }
    }

    pub(super) fn enter(&mut self) {
        self.scopes.push(HashSet::new());
    }

    pub(super) fn leave(&mut self) {
        self.scopes.pop();
    }

    /// A free name like `wanted`, taken from now on to the end of the innermost scope.
    pub(super) fn declare(&mut self, wanted: &str) -> String {
        self.declare_outside(wanted, 0)
    }

    /// The same, to the end of the scope so many levels further out.
    pub(super) fn declare_outside(&mut self, wanted: &str, levels: usize) -> String {
        let base = if self.reserved.contains(wanted) { format!("{wanted}_") } else { wanted.to_owned() };
        let is_free = |name: &String| self.scopes.iter().all(|scope| !scope.contains(name));
        let numbered = (2..).map(|number| format!("{}_{number}", base.trim_end_matches('_')));
        let name = std::iter::once(base.clone()).chain(numbered).find(is_free).unwrap_or(base);
        let scope = self.scopes.len().saturating_sub(1 + levels);
        self.scopes[scope].insert(name.clone());
        name
    }
}
