//! The comment at the top of a file.

use std::collections::BTreeMap;

use super::Writer;

/// What a heading says that the kernel does not know.
#[derive(Debug, Clone, Default)]
pub(crate) struct Note {
    /// Hash of the settings.
    pub(crate) settings: Option<String>,
    /// What is bound to each variable.
    pub(crate) resources: BTreeMap<String, String>,
}

impl Writer<'_> {
    /// What the kernel says of itself, where its resources are bound, and what made the file.
    pub(super) fn heading(&self, note: &Note) -> String {
        let mut lines: Vec<_> = self.kernel.header().map(str::to_owned).collect();
        lines.push(String::new());
        let [x, y, z] = self.kernel.workgroup_size;
        lines.push(format!(
            "Entry point {}, {x} x {y} x {z} invocations a workgroup.",
            self.language.entry_name(self.kernel)
        ));
        lines.push(String::new());
        let rows: Vec<_> = self
            .kernel
            .bindings
            .iter()
            .map(|binding| {
                let resource = note.resources.get(&binding.name).map_or("", String::as_str);
                [self.language.slot(self.kernel, binding), binding.name.clone(), resource.to_owned()]
            })
            .collect();
        let width = |column: usize| rows.iter().map(|row| row[column].len()).max().unwrap_or(0);
        let (slots, names) = (width(0), width(1));
        for [slot, name, resource] in &rows {
            lines.push(format!("{slot:slots$}  {name:names$}  {resource}"));
        }
        lines.push(String::new());
        let version = env!("CARGO_PKG_VERSION");
        let settings = note.settings.as_ref().map(|hash| format!(", settings {hash}")).unwrap_or_default();
        lines.push(format!("Written by limpid {version} from kernels/{}.wgsl{settings}.", self.kernel.file));
        lines.push("SPDX-License-Identifier: MIT OR Apache-2.0".to_owned());
        lines.iter().map(|line| format!("// {line}").trim_end().to_owned() + "\n").collect()
    }
}
