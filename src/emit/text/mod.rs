//! Kernels as text that people read: nested expressions, loops, comments and names as in the sources.
//!
//! [`build`] brings a function into shape, [`Writer`] prints it; what differs between languages is in
//! [`Language`].

mod build;
mod declare;
mod effects;
mod expression;
mod glsl;
mod heading;
mod hlsl;
mod language;
mod msl;
mod names;
mod operators;
mod outline;
mod source;
mod statement;
#[cfg(test)]
mod tests;
mod uses;
mod wgsl;
mod words;
mod wrap;

use std::cell::RefCell;
use std::collections::{BTreeSet, HashMap};

use naga::{AddressSpace, Function, GlobalVariable, Handle, Module, Type, TypeInner};

use effects::Effects;
pub use glsl::{GlslDialect, GlslOptions};
pub(crate) use heading::Note;
pub use hlsl::{HlslOptions, ShaderModel};
use language::Language;
pub use msl::MslOptions;
use names::Names;
use outline::Outline;
use source::Source;
pub use wgsl::WgslOptions;

use crate::Error;
use crate::kernel::Kernel;

/// Prints one kernel in one language.
struct Writer<'a> {
    kernel: &'a Kernel,
    module: &'a Module,
    language: &'a dyn Language,
    source: Source<'a>,
    effects: Effects,
    names: Names,
    types: HashMap<Handle<Type>, String>,
    constants: HashMap<Handle<naga::Constant>, String>,
    globals: HashMap<Handle<GlobalVariable>, String>,
    functions: HashMap<Handle<Function>, String>,
    /// Functions that the text needs and the kernel does not have.
    helpers: RefCell<BTreeSet<&'static str>>,
    used_constants: RefCell<BTreeSet<Handle<naga::Constant>>>,
    used_types: RefCell<BTreeSet<Handle<Type>>>,
    constructed_types: RefCell<BTreeSet<Handle<Type>>>,
}

/// A function while it is printed.
struct Scope<'a> {
    function: &'a Function,
    info: &'a naga::valid::FunctionInfo,
    outline: Outline,
    arguments: Vec<String>,
    locals: HashMap<Handle<naga::LocalVariable>, String>,
    values: HashMap<Handle<naga::Expression>, String>,
    /// Lines of the source whose comment was printed.
    commented: BTreeSet<usize>,
}

/// Writes a kernel, or says what of it the language cannot express.
fn write(kernel: &Kernel, language: &dyn Language, note: &Note) -> Result<String, Error> {
    let fail = |report| Error::Kernel { kernel: kernel.name, stage: language.stage(), report };
    Writer::new(kernel, language).program(note).map_err(fail)
}

impl<'a> Writer<'a> {
    fn new(kernel: &'a Kernel, language: &'a dyn Language) -> Self {
        let module = &kernel.module;
        let mut names = Names::new(language.reserved().iter().flat_map(|list| list.iter().copied()));
        let mut declare = |name: &Option<String>| name.as_deref().map(|name| names.declare(name));
        let types = module.types.iter().filter_map(|(h, ty)| Some((h, declare(&ty.name)?))).collect();
        let constants = module.constants.iter().filter_map(|(h, c)| Some((h, declare(&c.name)?))).collect();
        let globals = module.global_variables.iter().filter_map(|(h, g)| Some((h, declare(&g.name)?))).collect();
        let functions = module.functions.iter().filter_map(|(h, f)| Some((h, declare(&f.name)?))).collect();
        names.declare(kernel.name);
        Self {
            kernel,
            module,
            language,
            source: Source::new(&kernel.linked),
            effects: Effects::new(module),
            names,
            types,
            constants,
            globals,
            functions,
            helpers: RefCell::default(),
            used_constants: RefCell::default(),
            used_types: RefCell::default(),
            constructed_types: RefCell::default(),
        }
    }

    /// The whole file. Functions are printed first: they tell which constants and structs are needed.
    fn program(mut self, note: &Note) -> Result<String, String> {
        let mut functions = Vec::new();
        for (handle, function) in self.module.functions.iter() {
            functions.push(self.function(handle, function)?);
        }
        functions.push(self.entry_point()?);
        let constants = self.constants()?;
        let resources = self.resources()?;
        let structs = self.structs()?;
        let mut sections = vec![self.heading(note), self.language.prologue(self.kernel)];
        sections.extend(structs);
        sections.push(constants);
        sections.push(resources);
        sections.extend(self.helpers.borrow().iter().map(|name| self.language.helper(name).to_owned()));
        sections.extend(functions);
        let sections: Vec<_> = sections.iter().map(|section| section.trim_end()).filter(|s| !s.is_empty()).collect();
        Ok(wrap::wrap(&(sections.join("\n\n") + "\n")))
    }

    fn helper(&self, name: &'static str) -> &'static str {
        self.helpers.borrow_mut().insert(name);
        name
    }

    /// Name of a type, or an error for one that has none (arrays).
    fn type_name(&self, ty: Handle<Type>) -> Result<String, String> {
        if let TypeInner::Struct { .. } = self.module.types[ty].inner {
            self.used_types.borrow_mut().insert(ty);
            return self.types.get(&ty).cloned().ok_or_else(|| "a struct has no name".to_owned());
        }
        self.inner_name(&self.module.types[ty].inner)
    }

    fn inner_name(&self, inner: &TypeInner) -> Result<String, String> {
        match *inner {
            TypeInner::Scalar(scalar) | TypeInner::Atomic(scalar) => Ok(self.language.scalar(scalar)?.to_owned()),
            TypeInner::Vector { size, scalar } => self.language.vector(size as u8, scalar),
            TypeInner::Matrix { columns, rows, scalar } if scalar == naga::Scalar::F32 => {
                Ok(self.language.matrix(columns as u8, rows as u8))
            }
            ref other => Err(format!("the type {other:?} has no text form")),
        }
    }

    /// Element type and length of an array, `None` for one of unknown length.
    fn array(&self, ty: Handle<Type>) -> Option<(Handle<Type>, Option<u32>)> {
        match self.module.types[ty].inner {
            TypeInner::Array { base, size: naga::ArraySize::Constant(count), .. } => Some((base, Some(count.get()))),
            TypeInner::Array { base, .. } => Some((base, None)),
            _ => None,
        }
    }

    fn comment(&self, line: Option<usize>, indent: &str) -> String {
        let comment = line.map(|line| self.source.comment_above(line)).unwrap_or_default();
        comment.iter().map(|text| format!("{indent}// {text}").trim_end().to_owned() + "\n").collect()
    }

    fn structs(&self) -> Result<Vec<String>, String> {
        let mut needed: BTreeSet<Handle<Type>> = self.used_types.borrow().clone();
        for (_, variable) in self.module.global_variables.iter() {
            if matches!(self.module.types[variable.ty].inner, TypeInner::Struct { .. }) {
                needed.insert(variable.ty);
            }
        }
        // Members may be structs too; those stand before.
        let mut open: Vec<_> = needed.iter().copied().collect();
        while let Some(ty) = open.pop() {
            if let TypeInner::Struct { members, .. } = &self.module.types[ty].inner {
                let inner = members.iter().map(|member| member.ty);
                open.extend(inner.filter(|&ty| {
                    matches!(self.module.types[ty].inner, TypeInner::Struct { .. }) && needed.insert(ty)
                }));
            }
        }
        needed.into_iter().map(|ty| self.structure(ty)).collect()
    }

    fn structure(&self, ty: Handle<Type>) -> Result<String, String> {
        let TypeInner::Struct { members, .. } = &self.module.types[ty].inner else { return Ok(String::new()) };
        let name = self.type_name(ty)?;
        let declared =
            self.source.declaration(&format!("struct {}", self.module.types[ty].name.as_deref().unwrap_or("")));
        let mut text = self.comment(declared, "") + &format!("struct {name} {{\n");
        let mut fields = Vec::new();
        for (index, member) in members.iter().enumerate() {
            let wanted = member.name.as_deref().unwrap_or_default();
            let line = declared.and_then(|declared| self.source.member(declared, wanted));
            if index > 0 && line.is_some_and(|line| self.source.has_blank_above(line)) {
                text.push('\n');
            }
            let ty = self.type_name(member.ty)?;
            let name = self.language.member(wanted);
            text += &self.comment(line, "    ");
            text += &format!("    {}\n", self.language.field(&ty, &name));
            fields.push((ty, name));
        }
        text += self.language.struct_end();
        if self.constructed_types.borrow().contains(&ty) {
            text += &self.language.constructor(&name, &fields);
        }
        Ok(text)
    }

    fn constants(&self) -> Result<String, String> {
        // The value of one may name another.
        let mut texts = Vec::new();
        for (handle, constant) in self.module.constants.iter() {
            let is_used = self.used_constants.borrow().contains(&handle);
            let Some(name) = self.constants.get(&handle).filter(|_| is_used) else { continue };
            let value = self.constant_value(constant.init)?;
            let (element, count) = self.array(constant.ty).map_or((constant.ty, None), |(base, count)| (base, count));
            let source_name = constant.name.as_deref().unwrap_or_default();
            let line = ["const ", "override "]
                .iter()
                .find_map(|kind| self.source.declaration(&format!("{kind}{source_name}")));
            let element = self.type_name(element)?;
            texts.push(self.comment(line, "") + &self.language.constant(&element, count, name, &value));
        }
        Ok(texts.concat())
    }

    fn resources(&self) -> Result<String, String> {
        let mut bound: Vec<_> = self.module.global_variables.iter().filter(|(_, v)| v.binding.is_some()).collect();
        bound.sort_by_key(|(_, variable)| variable.binding.as_ref().map(|at| (at.group, at.binding)));
        let mut text = String::new();
        // Where they are arguments, the entry point lists them.
        bound.retain(|_| !self.language.passes_globals());
        for (handle, variable) in bound {
            let at = variable.binding.as_ref().ok_or("a resource has no binding")?;
            let binding = self.kernel.bindings.iter().find(|b| (b.group, b.binding) == (at.group, at.binding));
            let binding = binding.ok_or("a resource was not reflected")?;
            let ty = self.array(variable.ty).map_or(variable.ty, |(base, _)| base);
            let element = match self.module.types[ty].inner {
                TypeInner::Image { .. } => String::new(),
                _ => self.type_name(ty)?,
            };
            text += &self.language.resource(self.kernel, binding, &self.globals[&handle], &element);
        }
        text += "\n";
        for (handle, variable) in self.module.global_variables.iter() {
            match variable.space {
                AddressSpace::WorkGroup => text += &self.workgroup_variable(handle, variable)?,
                AddressSpace::Handle | AddressSpace::Uniform | AddressSpace::Storage { .. } => {}
                other => return Err(format!("variables of the address space {other:?} have no text form")),
            }
        }
        Ok(text)
    }

    fn workgroup_variable(&self, handle: Handle<GlobalVariable>, variable: &GlobalVariable) -> Result<String, String> {
        if self.language.passes_globals() {
            return Ok(String::new());
        }
        let source_name = variable.name.as_deref().unwrap_or_default();
        let line = self.source.declaration(&format!("var<workgroup> {source_name}"));
        Ok(self.comment(line, "") + &self.workgroup_declaration(handle, variable)? + "\n")
    }

    /// Declaration of workgroup memory, without its comment.
    fn workgroup_declaration(
        &self,
        handle: Handle<GlobalVariable>,
        variable: &GlobalVariable,
    ) -> Result<String, String> {
        let (element, count) = self.array(variable.ty).unwrap_or((variable.ty, None));
        let is_atomic = matches!(self.module.types[element].inner, TypeInner::Atomic(_));
        Ok(self.language.workgroup(&self.type_name(element)?, is_atomic, count, &self.globals[&handle]))
    }
}
