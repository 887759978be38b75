//! Kernels: WGSL sources, linked, specialised and reflected. No graphics API is involved.

use std::borrow::Cow;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::PathBuf;

use naga::back::pipeline_constants::process_overrides;
use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use naga::{AddressSpace, Expression, Handle, ImageClass, Literal, Statement, StorageAccess, TypeInner};

use crate::resource::{Access, Format};
use crate::{Error, dead_code};

/// File name below `kernels/` without its ending, and text.
macro_rules! sources {
    ($($path:literal),* $(,)?) => {
        &[$(($path, include_str!(concat!("../kernels/", $path, ".wgsl")))),*]
    };
}

const SOURCES: &[(&str, &str)] = sources![
    "classify",
    "list_tiles",
    "indirect_args",
    "fill",
    "reproject",
    "prefilter",
    "resolve_temporal",
    "block_average",
    "block_average_accumulated",
    "block_statistics",
    "block_spread",
    "list_blocks",
    "block_args",
    "accumulate",
    "accumulate_blocks",
    "lobe_filter",
    "lobe_filter_blocks",
    "debug_view",
    "debug_view_published",
    "shared/average",
    "shared/blocks",
    "shared/color",
    "shared/debug_view",
    "shared/fallback",
    "shared/footprint",
    "shared/frame",
    "shared/gbuffer",
    "shared/history",
    "shared/light",
    "shared/listed",
    "shared/neighborhood",
    "shared/outliers",
    "shared/packing",
    "shared/radiance",
    "shared/tiles",
    "shared/whole_blocks",
];

/// Values of a kernel's `override` constants.
pub type Overrides = BTreeMap<String, f64>;

/// Where the texts of kernels come from.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Sources {
    /// Those that this crate was built with.
    #[default]
    BuiltIn,
    /// Files in a folder laid out as `kernels/`, for those who edit them.
    Folder(PathBuf),
}

impl Sources {
    fn read(&self, path: &str) -> Result<Cow<'static, str>, String> {
        match self {
            Self::BuiltIn => {
                let found = SOURCES.iter().find(|(name, _)| *name == path);
                found.map(|(_, text)| Cow::Borrowed(*text)).ok_or_else(|| format!("there is no kernels/{path}.wgsl"))
            }
            Self::Folder(folder) => {
                let file = folder.join(format!("{path}.wgsl"));
                let text = std::fs::read_to_string(&file);
                text.map(Cow::Owned).map_err(|error| format!("cannot read {}: {error}", file.display()))
            }
        }
    }
}

/// Names of all kernels.
pub fn names() -> impl Iterator<Item = &'static str> {
    SOURCES.iter().map(|(path, _)| *path).filter(|path| !path.contains('/'))
}

/// A kernel with the files it imports spliced in, each once.
#[derive(Debug, Clone, PartialEq)]
pub struct Linked {
    /// WGSL.
    pub text: String,
    /// File and line number that each line of `text` comes from.
    pub origins: Vec<(String, u32)>,
}

impl Linked {
    /// File and line of a byte of `text`, as `kernels/name.wgsl:12`.
    pub fn place(&self, offset: usize) -> Option<String> {
        let line = self.text.get(..offset)?.matches('\n').count();
        self.origins.get(line).map(|(file, line)| format!("{file}:{line}"))
    }

    /// Replaces line numbers of a report on the linked text by those of the files.
    fn locate(&self, message: &str, line: Option<u32>) -> String {
        match line.and_then(|line| self.origins.get(line as usize - 1)) {
            Some((file, line)) => format!("{file}:{line}: {message}"),
            None => message.to_owned(),
        }
    }
}

fn splice(path: &str, sources: &Sources, linked: &mut Linked, seen: &mut HashSet<String>) -> Result<(), String> {
    if !seen.insert(path.to_owned()) {
        return Ok(());
    }
    let text = sources.read(path)?;
    for (index, line) in text.lines().enumerate() {
        if let Some(import) = line.strip_prefix("import package::") {
            splice(&import.trim_end_matches(';').replace("::", "/"), sources, linked, seen)?;
            continue;
        }
        // Headers are documentation comments of the file, which WGSL has no notion of.
        linked.text.push_str(&if line.starts_with("//!") { line.replacen("//!", "//", 1) } else { line.to_owned() });
        linked.text.push('\n');
        linked.origins.push((format!("kernels/{path}.wgsl"), index as u32 + 1));
    }
    Ok(())
}

/// The WGSL of a kernel with its imports in place.
///
/// # Errors
///
/// [`Error::Kernel`] for a name that does not exist or an import that leads nowhere.
pub fn link(kernel: &'static str, sources: &Sources) -> Result<Linked, Error> {
    let mut linked = Linked { text: String::new(), origins: Vec::new() };
    splice(kernel, sources, &mut linked, &mut HashSet::new()).map_err(|report| Error::Kernel {
        kernel,
        stage: "link",
        report,
    })?;
    Ok(linked)
}

/// How a kernel uses one of its resources.
#[derive(Debug, Clone, PartialEq)]
pub struct Binding {
    /// Name of the variable.
    pub name: String,
    /// Bind group: 0 for what the caller supplies, 1 for what limpid owns.
    pub group: u32,
    /// Number in the group.
    pub binding: u32,
    /// What kind of resource it is.
    pub kind: BindingKind,
}

/// Kind of resource that a kernel expects.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BindingKind {
    /// Constant buffer.
    Uniform,
    /// Texture read by texel: float (never filtered).
    TextureFloat,
    /// Texture read by texel: unsigned integer.
    TextureUint,
    /// Texture written by texel.
    StorageTexture(Format),
    /// Storage buffer.
    StorageBuffer(Access),
}

impl BindingKind {
    /// How the kernel accesses it.
    pub fn access(self) -> Access {
        match self {
            Self::Uniform | Self::TextureFloat | Self::TextureUint => Access::Read,
            Self::StorageTexture(_) => Access::Write,
            Self::StorageBuffer(access) => access,
        }
    }
}

/// A kernel made for one set of overrides: constants are folded, and what they switch off is gone from code
/// and bindings.
#[derive(Debug, Clone)]
pub struct Kernel {
    /// Name of the entry point; in a plan, that of the pass.
    pub name: &'static str,
    /// Name of its file, without the ending.
    pub file: &'static str,
    /// The program.
    pub module: naga::Module,
    /// What validation found out about `module`.
    pub info: ModuleInfo,
    /// Its resources, by group and number.
    pub bindings: Vec<Binding>,
    /// The resources that its source declares, whether specialising kept them or not.
    pub all_bindings: Vec<Binding>,
    /// Invocations per workgroup.
    pub workgroup_size: [u32; 3],
    /// The source that the spans in `module` are about.
    pub linked: Linked,
}

pub(crate) fn validator() -> Validator {
    // pack2x16float is part of WebGPU, but not of naga's default.
    let capabilities = Capabilities::default() | Capabilities::SHADER_FLOAT16_IN_FLOAT32;
    Validator::new(ValidationFlags::all(), capabilities)
}

impl Kernel {
    /// Links, parses, specialises, validates and reflects a kernel. Overrides that are not given keep their
    /// defaults.
    ///
    /// # Errors
    ///
    /// [`Error::Kernel`] with file and line where they are known.
    pub fn new(name: &'static str, overrides: &Overrides) -> Result<Self, Error> {
        Self::from_sources(name, overrides, &Sources::BuiltIn)
    }

    /// The same from other sources.
    ///
    /// # Errors
    ///
    /// [`Error::Kernel`] with file and line where they are known.
    pub fn from_sources(name: &'static str, overrides: &Overrides, sources: &Sources) -> Result<Self, Error> {
        Self::from_linked(name, &link(name, sources)?, overrides)
    }

    /// What the kernel says of itself at the top of its file, without comment signs.
    pub(crate) fn header(&self) -> impl Iterator<Item = &str> {
        let lines = self.linked.text.lines().map_while(|line| line.strip_prefix("//"));
        lines.map(|line| line.strip_prefix(' ').unwrap_or(line))
    }

    /// A kernel of a test, from one text.
    #[cfg(test)]
    pub(crate) fn from_text(name: &'static str, text: &str) -> Result<Self, Error> {
        let origins = (1..=text.lines().count()).map(|line| ("test.wgsl".to_owned(), line as u32)).collect();
        Self::from_linked(name, &Linked { text: text.to_owned(), origins }, &Overrides::new())
    }

    fn from_linked(name: &'static str, linked: &Linked, overrides: &Overrides) -> Result<Self, Error> {
        let fail = |stage, report| Error::Kernel { kernel: name, stage, report };
        let line_of = |location: Option<naga::SourceLocation>| location.map(|at| at.line_number);
        let parsed = naga::front::wgsl::parse_str(&linked.text)
            .map_err(|e| fail("parse", linked.locate(e.message(), line_of(e.location(&linked.text)))))?;
        let checked = validator().validate(&parsed).map_err(|e| {
            let cause = format!("{:#}", DisplayChain(e.as_inner()));
            fail("validate", linked.locate(&cause, line_of(e.location(&linked.text))))
        })?;
        let constants: HashMap<String, f64> = overrides.iter().map(|(k, v)| (k.clone(), *v)).collect();
        let entry_point = Some((naga::ShaderStage::Compute, name));
        let (module, _) = process_overrides(&parsed, &checked, entry_point, &constants.into_iter().collect())
            .map_err(|e| fail("specialise", e.to_string()))?;
        let mut module = module.into_owned();
        remove_dead_branches(&mut module);
        dead_code::remove(&mut module);
        naga::compact::compact(&mut module, naga::compact::KeepUnused::No);
        let info = validator()
            .validate(&module)
            .map_err(|e| fail("validate after specialising", DisplayChain(e.as_inner()).to_string()))?;
        let bindings = reflect(&module).map_err(|report| fail("reflect", report))?;
        let all_bindings = reflect(&parsed).map_err(|report| fail("reflect", report))?;
        let entry_point =
            module.entry_points.first().ok_or_else(|| fail("reflect", format!("there is no entry point `{name}`")))?;
        let workgroup_size = entry_point.workgroup_size;
        let (file, linked) = (name, linked.clone());
        Ok(Self { name, file, module, info, bindings, all_bindings, workgroup_size, linked })
    }

    /// The kernel with another name of its entry point.
    pub(crate) fn renamed(mut self, name: &'static str) -> Self {
        self.name = name;
        self.module.entry_points.iter_mut().for_each(|entry_point| name.clone_into(&mut entry_point.name));
        self
    }
}

impl AsRef<Self> for Kernel {
    fn as_ref(&self) -> &Self {
        self
    }
}

/// An error and its causes in one line.
struct DisplayChain<'a>(&'a dyn std::error::Error);

impl std::fmt::Display for DisplayChain<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", self.0)?;
        let mut cause = self.0.source();
        while let Some(error) = cause {
            write!(f, ": {error}")?;
            cause = error.source();
        }
        Ok(())
    }
}

/// Puts the taken side of every `if` on a constant in its place. naga keeps both, and with the dead one every
/// resource that it mentions.
fn remove_dead_branches(module: &mut naga::Module) {
    let flags = constant_flags(module);
    let functions = module.functions.iter_mut().map(|(_, function)| function);
    let entry_points = module.entry_points.iter_mut().map(|entry_point| &mut entry_point.function);
    for function in functions.chain(entry_points) {
        let body = std::mem::take(&mut function.body);
        function.body = live_block(body, &Known { expressions: &function.expressions, flags: &flags });
        // A name keeps its expression alive: only those that are still evaluated may.
        let mut evaluated = HashSet::new();
        collect_evaluated(&function.body, &mut evaluated);
        function.named_expressions.retain(|expression, _| evaluated.contains(expression));
    }
}

/// Module-scope constants, overrides that were given a value among them, that are true or false.
fn constant_flags(module: &naga::Module) -> HashMap<Handle<naga::Constant>, bool> {
    let flag = |constant: &naga::Constant| match module.global_expressions[constant.init] {
        Expression::Literal(Literal::Bool(value)) => Some(value),
        _ => None,
    };
    module.constants.iter().filter_map(|(handle, constant)| Some((handle, flag(constant)?))).collect()
}

/// Expressions of a function and the constants that they may name.
struct Known<'a> {
    expressions: &'a naga::Arena<Expression>,
    flags: &'a HashMap<Handle<naga::Constant>, bool>,
}

impl Known<'_> {
    fn condition(&self, condition: Handle<Expression>) -> Option<bool> {
        match self.expressions[condition] {
            Expression::Literal(Literal::Bool(value)) => Some(value),
            Expression::Constant(constant) => self.flags.get(&constant).copied(),
            _ => None,
        }
    }
}

fn live_block(block: naga::Block, known: &Known) -> naga::Block {
    let mut live = naga::Block::new();
    for (statement, span) in block.span_into_iter() {
        match statement {
            Statement::If { condition, accept, reject } => match known.condition(condition) {
                Some(taken) => live.extend_block(live_block(if taken { accept } else { reject }, known)),
                None => {
                    let accept = live_block(accept, known);
                    let reject = live_block(reject, known);
                    live.push(Statement::If { condition, accept, reject }, span);
                }
            },
            Statement::Block(inner) => live.push(Statement::Block(live_block(inner, known)), span),
            Statement::Loop { body, continuing, break_if } => {
                let body = live_block(body, known);
                let continuing = live_block(continuing, known);
                live.push(Statement::Loop { body, continuing, break_if }, span);
            }
            Statement::Switch { selector, cases } => {
                let cases = cases
                    .into_iter()
                    .map(|case| naga::SwitchCase { body: live_block(case.body, known), ..case })
                    .collect();
                live.push(Statement::Switch { selector, cases }, span);
            }
            other => live.push(other, span),
        }
        // What follows a jump is never reached, and naga rejects it.
        let jumps = matches!(
            live.last(),
            Some(Statement::Return { .. } | Statement::Break | Statement::Continue | Statement::Kill)
        );
        if jumps {
            break;
        }
    }
    live
}

fn collect_evaluated(block: &naga::Block, evaluated: &mut HashSet<Handle<Expression>>) {
    for statement in block.iter() {
        match statement {
            Statement::Emit(range) => evaluated.extend(range.clone()),
            Statement::Call { result: Some(result), .. } | Statement::Atomic { result: Some(result), .. } => {
                evaluated.insert(*result);
            }
            Statement::Block(inner) => collect_evaluated(inner, evaluated),
            Statement::If { accept, reject, .. } => {
                collect_evaluated(accept, evaluated);
                collect_evaluated(reject, evaluated);
            }
            Statement::Loop { body, continuing, .. } => {
                collect_evaluated(body, evaluated);
                collect_evaluated(continuing, evaluated);
            }
            Statement::Switch { cases, .. } => {
                cases.iter().for_each(|case| collect_evaluated(&case.body, evaluated));
            }
            _ => {}
        }
    }
}

fn storage_access(access: StorageAccess) -> Access {
    match (access.contains(StorageAccess::LOAD), access.contains(StorageAccess::STORE)) {
        (_, false) => Access::Read,
        (false, true) => Access::Write,
        (true, true) => Access::ReadWrite,
    }
}

fn binding_kind(module: &naga::Module, variable: &naga::GlobalVariable) -> Option<BindingKind> {
    match (variable.space, &module.types[variable.ty].inner) {
        (AddressSpace::Uniform, _) => Some(BindingKind::Uniform),
        (AddressSpace::Storage { access }, _) => Some(BindingKind::StorageBuffer(storage_access(access))),
        (AddressSpace::Handle, TypeInner::Image { class, .. }) => match *class {
            ImageClass::Sampled { kind: naga::ScalarKind::Float, multi: false } => Some(BindingKind::TextureFloat),
            ImageClass::Sampled { kind: naga::ScalarKind::Uint, multi: false } => Some(BindingKind::TextureUint),
            ImageClass::Storage { format, access: StorageAccess::STORE } => {
                Format::from_naga(format).map(BindingKind::StorageTexture)
            }
            _ => None,
        },
        _ => None,
    }
}

fn reflect(module: &naga::Module) -> Result<Vec<Binding>, String> {
    let mut bindings = Vec::new();
    for (_, variable) in module.global_variables.iter() {
        let Some(at) = &variable.binding else { continue };
        let name = variable.name.clone().unwrap_or_default();
        let kind = binding_kind(module, variable)
            .ok_or_else(|| format!("`{name}` is a kind of resource that limpid's backends do not bind"))?;
        bindings.push(Binding { name, group: at.group, binding: at.binding, kind });
    }
    bindings.sort_by_key(|binding| (binding.group, binding.binding));
    Ok(bindings)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lined(text: &str) -> Linked {
        let origins = (1..=text.lines().count()).map(|line| ("test.wgsl".to_owned(), line as u32)).collect();
        Linked { text: text.to_owned(), origins }
    }

    const SWITCHED: &str = "
        override KEEP: bool = false;
        @group(1) @binding(0) var in_maybe: texture_2d<f32>;
        @group(1) @binding(1) var out_color: texture_storage_2d<rgba16float, write>;
        fn maybe(p: vec2<u32>) -> vec4<f32> {
            if !KEEP { return vec4<f32>(1.0); }
            let texel = textureLoad(in_maybe, p, 0);
            return texel;
        }
        @compute @workgroup_size(8, 8)
        fn switched(@builtin(global_invocation_id) id: vec3<u32>) {
            textureStore(out_color, id.xy, maybe(id.xy));
        }";

    fn binding_names(keep: f64) -> Vec<String> {
        let overrides = Overrides::from([("KEEP".to_owned(), keep)]);
        let kernel = Kernel::from_linked("switched", &lined(SWITCHED), &overrides).unwrap();
        kernel.bindings.into_iter().map(|binding| binding.name).collect()
    }

    #[test]
    fn what_an_override_switches_off_loses_its_binding() {
        assert_eq!(binding_names(1.0), ["in_maybe", "out_color"]);
        assert_eq!(binding_names(0.0), ["out_color"]);
    }

    #[test]
    fn errors_name_file_and_line() {
        let broken = lined("@compute @workgroup_size(1)\nfn broken() {\n  let x = nowhere;\n}\n");
        let report = Kernel::from_linked("broken", &broken, &Overrides::new()).unwrap_err().to_string();
        assert!(report.contains("test.wgsl:3:"), "{report}");
        let unknown = Overrides::from([("NO_SUCH".to_owned(), 1.0)]);
        assert!(Kernel::new("prefilter", &unknown).is_err());
    }

    #[test]
    fn every_kernel_is_valid_and_named_after_its_file() {
        for name in names() {
            let kernel = Kernel::new(name, &Overrides::new()).unwrap_or_else(|e| panic!("{e}"));
            assert_eq!(kernel.module.entry_points[0].name, name);
        }
    }

    #[test]
    fn kernels_stay_within_webgpu_core() {
        for name in names() {
            let kernel = Kernel::new(name, &Overrides::new()).unwrap_or_else(|e| panic!("{e}"));
            let count = |wanted: fn(&BindingKind) -> bool| kernel.bindings.iter().filter(|b| wanted(&b.kind)).count();
            assert!(count(|kind| matches!(kind, BindingKind::StorageTexture(_))) <= 4, "{name}");
            assert!(count(|kind| matches!(kind, BindingKind::StorageBuffer(_))) <= 8, "{name}");
            let invocations: u32 = kernel.workgroup_size.iter().product();
            assert!(invocations <= 256, "{name}");
        }
    }
}
