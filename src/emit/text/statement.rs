//! Statements and functions.

use std::collections::{BTreeSet, HashMap};

use naga::{Expression, Function, Handle, TypeInner};

use super::outline::{Line, Node, Outline};
use super::{Scope, Writer, build, operators};

type Result<T> = std::result::Result<T, String>;

const INDENT: &str = "    ";

impl<'a> Writer<'a> {
    /// A function with the comment above it.
    pub(super) fn function(&mut self, handle: Handle<Function>, function: &'a Function) -> Result<String> {
        let name = self.functions[&handle].clone();
        let outline = build::outline(function, &self.effects)?;
        let mut scope = self.scope(function, &self.kernel.info[handle], outline);
        self.names.enter();
        let mut arguments = Vec::new();
        let used = self.effects.of(handle).used_arguments.clone();
        for (argument, is_used) in function.arguments.iter().zip(used) {
            if !is_used {
                scope.arguments.push(String::new());
                continue;
            }
            let name = self.names.declare(argument.name.as_deref().unwrap_or("value"));
            arguments.push((self.type_name(argument.ty)?, name.clone()));
            scope.arguments.push(name);
        }
        if self.language.passes_globals() {
            for &global in &self.effects.of(handle).globals.clone() {
                arguments.push((self.global_argument(global)?, String::new()));
            }
        }
        let result = function.result.as_ref().map(|result| self.type_name(result.ty)).transpose()?;
        let line = self.source.declaration(&format!("fn {}", function.name.as_deref().unwrap_or_default()));
        let mut text = self.comment(line, "") + &self.language.function(result.as_deref(), &name, &arguments);
        scope.commented.extend(line);
        let body = std::mem::take(&mut scope.outline.body);
        text += &self.lines(&mut scope, &body, 1)?;
        self.names.leave();
        Ok(text + "}\n")
    }

    pub(super) fn entry_point(&mut self) -> Result<String> {
        let entry = self.module.entry_points.first().ok_or("there is no entry point")?;
        let function = &entry.function;
        let outline = build::outline(function, &self.effects)?;
        let mut scope = self.scope(function, self.kernel.info.get_entry_point(0), outline);
        self.names.enter();
        let mut arguments = Vec::new();
        for argument in &function.arguments {
            let Some(naga::Binding::BuiltIn(built_in)) = argument.binding else {
                return Err("an input of the entry point is no built-in".to_owned());
            };
            let written = self.language.built_in(built_in);
            let written = written.ok_or_else(|| format!("the input {built_in:?} has no text form"))?;
            if self.language.built_ins_are_global() {
                scope.arguments.push(written.to_owned());
                continue;
            }
            let name = self.names.declare(argument.name.as_deref().unwrap_or("value"));
            arguments.push((self.type_name(argument.ty)?, format!("{name}{written}")));
            scope.arguments.push(name);
        }
        let mut memory = String::new();
        if self.language.passes_globals() {
            for (handle, variable) in self.module.global_variables.iter() {
                if variable.space == naga::AddressSpace::WorkGroup {
                    let line = self.source.declaration(&format!("var<workgroup> {}", self.globals[&handle]));
                    memory += &self.comment(line, INDENT);
                    memory += &format!("{INDENT}{}\n", self.workgroup_declaration(handle, variable)?);
                } else {
                    arguments.push((String::new(), self.entry_argument(handle)?));
                }
            }
        }
        let line = self.source.declaration(&format!("fn {}", self.kernel.file));
        scope.commented.extend(line);
        let mut text = self.language.entry_point(self.kernel, &arguments) + &memory;
        let body = std::mem::take(&mut scope.outline.body);
        text += &self.lines(&mut scope, &body, 1)?;
        self.names.leave();
        Ok(text + "}\n")
    }

    fn scope(&self, function: &'a Function, info: &'a naga::valid::FunctionInfo, outline: Outline) -> Scope<'a> {
        Scope {
            function,
            info,
            outline,
            arguments: Vec::new(),
            locals: HashMap::new(),
            values: HashMap::new(),
            commented: BTreeSet::new(),
        }
    }

    /// A resource or workgroup variable as the parameter of a function, with its name.
    fn global_argument(&self, handle: Handle<naga::GlobalVariable>) -> Result<String> {
        let variable = &self.module.global_variables[handle];
        let (element, count) = self.array(variable.ty).unwrap_or((variable.ty, None));
        let is_atomic = matches!(self.module.types[element].inner, TypeInner::Atomic(_));
        let name = &self.globals[&handle];
        if variable.space == naga::AddressSpace::WorkGroup {
            let ty = if is_atomic { "atomic_uint".to_owned() } else { self.type_name(element)? };
            return Ok(match count {
                Some(count) => format!("threadgroup {ty} (&{name})[{count}]"),
                None => format!("threadgroup {ty} &{name}"),
            });
        }
        self.entry_declaration(handle)
    }

    /// A resource as a parameter of the entry point, with its slot.
    fn entry_argument(&self, handle: Handle<naga::GlobalVariable>) -> Result<String> {
        let variable = &self.module.global_variables[handle];
        let at = variable.binding.as_ref().ok_or("a resource has no binding")?;
        let binding = self.kernel.bindings.iter().find(|b| (b.group, b.binding) == (at.group, at.binding));
        let binding = binding.ok_or("a resource was not reflected")?;
        Ok(format!("{} [[{}]]", self.entry_declaration(handle)?, self.language.slot(self.kernel, binding)))
    }

    fn entry_declaration(&self, handle: Handle<naga::GlobalVariable>) -> Result<String> {
        let variable = &self.module.global_variables[handle];
        let at = variable.binding.as_ref().ok_or("a resource has no binding")?;
        let binding = self.kernel.bindings.iter().find(|b| (b.group, b.binding) == (at.group, at.binding));
        let binding = binding.ok_or("a resource was not reflected")?;
        let ty = self.array(variable.ty).map_or(variable.ty, |(base, _)| base);
        let is_atomic = matches!(self.module.types[ty].inner, TypeInner::Atomic(_));
        let element = match self.module.types[ty].inner {
            TypeInner::Image { .. } => String::new(),
            _ if is_atomic => "atomic_uint".to_owned(),
            _ => self.type_name(ty)?,
        };
        Ok(self.language.resource(self.kernel, binding, &self.globals[&handle], &element))
    }

    /// Comment and blank line above a node, once for each line of the source.
    fn lead(&self, scope: &mut Scope, line: &Line, is_first: bool, indent: &str) -> String {
        let Some(at) = line.offset.map(|offset| self.source.line_at(offset)) else { return String::new() };
        if !scope.commented.insert(at) {
            return String::new();
        }
        let blank = if !is_first && self.source.has_blank_above(at) { "\n" } else { "" };
        format!("{blank}{}", self.comment(Some(at), indent))
    }

    fn lines(&mut self, scope: &mut Scope, lines: &[Line], depth: usize) -> Result<String> {
        let indent = INDENT.repeat(depth);
        let mut text = String::new();
        for (index, line) in lines.iter().enumerate() {
            text += &self.lead(scope, line, index == 0, &indent);
            text += &self.node(scope, line, depth)?;
        }
        Ok(text)
    }

    fn nested(&mut self, scope: &mut Scope, lines: &[Line], depth: usize) -> Result<String> {
        self.names.enter();
        let text = self.lines(scope, lines, depth + 1);
        self.names.leave();
        text
    }

    fn node(&mut self, scope: &mut Scope, line: &Line, depth: usize) -> Result<String> {
        let indent = INDENT.repeat(depth);
        match &line.node {
            Node::If { condition, accept, reject } => {
                Ok(format!("{indent}{}", self.branch(scope, *condition, accept, reject, depth)?))
            }
            Node::For { first, condition, step, body } => {
                self.names.enter();
                let levels = usize::from(self.language.loop_variables_leak());
                let first = first.as_ref().map(|line| self.simple(scope, &line.node, levels)).transpose()?;
                let condition = condition.map(|condition| self.text(scope, condition)).transpose()?;
                let step = step.as_ref().map(|line| self.simple(scope, &line.node, 0)).transpose()?;
                let clean =
                    |text: Option<String>| text.map(|text| text.trim_end_matches(';').to_owned()).unwrap_or_default();
                let (first, step) = (clean(first), clean(step));
                let condition = condition.unwrap_or_else(|| "true".to_owned());
                let head = if first.is_empty() && step.is_empty() {
                    format!("while {} {{", self.language.condition(&condition))
                } else {
                    self.language.for_head(&first, &condition, &step)
                };
                let body = self.nested(scope, body, depth)?;
                self.names.leave();
                Ok(format!("{indent}{head}\n{body}{indent}}}\n"))
            }
            simple => {
                let text = self.simple(scope, simple, 0)?;
                Ok(text.lines().map(|line| format!("{indent}{line}\n")).collect())
            }
        }
    }

    /// An `if` without indentation in front of it.
    fn branch(
        &mut self,
        scope: &mut Scope,
        condition: Handle<Expression>,
        accept: &[Line],
        reject: &[Line],
        depth: usize,
    ) -> Result<String> {
        let indent = INDENT.repeat(depth);
        let condition = self.expression(scope, condition)?;
        let (condition, accept, reject) = if accept.is_empty() {
            (self.language.not(condition, 1), reject, accept)
        } else {
            (condition, accept, reject)
        };
        let mut text = format!("if {} {{\n", self.language.condition(&condition.text));
        text += &self.nested(scope, accept, depth)?;
        text += &format!("{indent}}}");
        if let [Line { node: Node::If { condition, accept, reject }, .. }] = reject {
            return Ok(text + " else " + &self.branch(scope, *condition, accept, reject, depth)?);
        }
        if !reject.is_empty() {
            text += &format!(" else {{\n{}{indent}}}", self.nested(scope, reject, depth)?);
        }
        Ok(text + "\n")
    }

    /// A name for a value that the sources do not name.
    fn wanted_name(&self, scope: &Scope, handle: Handle<Expression>) -> String {
        if let Some(name) = scope.function.named_expressions.get(&handle) {
            return name.clone();
        }
        match scope.function.expressions[handle] {
            Expression::AtomicResult { .. } => "previous".to_owned(),
            Expression::Load { pointer } | Expression::ImageLoad { image: pointer, .. } => {
                let text = self.text(scope, pointer).unwrap_or_default();
                let last = text.split(['.', '[']).next().unwrap_or("value").trim_start_matches("in_");
                format!("{last}_value")
            }
            _ => "value".to_owned(),
        }
    }

    /// A statement in one line. Variables are declared in the scope so many levels further out.
    fn simple(&mut self, scope: &mut Scope, node: &Node, levels: usize) -> Result<String> {
        Ok(match *node {
            Node::Let(value) => {
                let text = self.value(scope, value)?.text;
                let ty = self.inner_type(scope, value)?;
                let name = self.names.declare(&self.wanted_name(scope, value));
                scope.values.insert(value, name.clone());
                self.language.named_value(&ty, &name, &text)
            }
            Node::Variable(local, value) => {
                let variable = &scope.function.local_variables[local];
                if let Some((base, count)) = self.array(variable.ty) {
                    let count = count.filter(|_| value.is_none() && variable.init.is_none());
                    let count = count.ok_or("variables that are arrays have no initial value in text")?;
                    let name = self.names.declare(variable.name.as_deref().unwrap_or("value"));
                    scope.locals.insert(local, name.clone());
                    return Ok(self.language.array_variable(&self.type_name(base)?, &name, count));
                }
                let text = match value.or(variable.init) {
                    Some(value) => self.text(scope, value)?,
                    None => self.zero(variable.ty)?.text,
                };
                let name = self.names.declare_outside(variable.name.as_deref().unwrap_or("value"), levels);
                scope.locals.insert(local, name.clone());
                self.language.variable(&self.type_name(variable.ty)?, &name, &text)
            }
            Node::Assign { pointer, operator, value } => self.assign(scope, pointer, operator, value)?,
            Node::ImageStore { image, coordinate, value } => self.image_store(scope, image, coordinate, value)?,
            Node::Atomic { pointer, fun, value, result } => {
                let place = self.text(scope, pointer)?;
                let value = self.text(scope, value)?;
                let named = match result {
                    Some(result) => {
                        let name = self.names.declare(&self.wanted_name(scope, result));
                        scope.values.insert(result, name.clone());
                        Some((self.inner_type(scope, result)?, name))
                    }
                    None => None,
                };
                let named = named.as_ref().map(|(ty, name)| (ty.as_str(), name.as_str()));
                let text = self.language.atomic(fun, &place, &value, named);
                text.ok_or_else(|| format!("the atomic function {fun:?} has no text form"))?
            }
            Node::Call(function, ref arguments) => self.call(scope, function, arguments)?.text + ";",
            Node::Break => "break;".to_owned(),
            Node::Continue => "continue;".to_owned(),
            Node::Return(None) => "return;".to_owned(),
            Node::Return(Some(value)) => format!("return {};", self.text(scope, value)?),
            Node::Barrier => self.language.barrier().to_owned(),
            Node::If { .. } | Node::For { .. } => return Err("a loop's head holds a block".to_owned()),
        })
    }

    fn inner_type(&self, scope: &Scope, handle: Handle<Expression>) -> Result<String> {
        match &scope.info[handle].ty {
            naga::proc::TypeResolution::Handle(ty) => self.type_name(*ty),
            naga::proc::TypeResolution::Value(inner) => self.inner_name(inner),
        }
    }

    fn assign(
        &mut self,
        scope: &Scope,
        pointer: Handle<Expression>,
        operator: Option<naga::BinaryOperator>,
        value: Handle<Expression>,
    ) -> Result<String> {
        let place = self.text(scope, pointer)?;
        let pointee = scope.info[pointer].ty.inner_with(&self.module.types);
        let is_atomic = matches!(pointee, TypeInner::Pointer { base, .. }
            if matches!(self.module.types[*base].inner, TypeInner::Atomic(_)));
        let is_one =
            |value: &Expression| matches!(value, Expression::Literal(naga::Literal::U32(1) | naga::Literal::I32(1)));
        Ok(match operator {
            Some(naga::BinaryOperator::Add) if is_one(&scope.function.expressions[value]) => format!("{place}++;"),
            Some(operator) => {
                let scalar = match scope.function.expressions[value] {
                    Expression::Splat { value, .. } if operators::takes_scalars(self.language, operator) => value,
                    _ => value,
                };
                format!("{place} {}= {};", operators::symbol(operator), self.text(scope, scalar)?)
            }
            None if is_atomic => self.language.atomic_store(&place, &self.text(scope, value)?),
            None => format!("{place} = {};", self.text(scope, value)?),
        })
    }

    fn image_store(
        &mut self,
        scope: &Scope,
        image: Handle<Expression>,
        coordinate: Handle<Expression>,
        value: Handle<Expression>,
    ) -> Result<String> {
        let ty = scope.info[coordinate].ty.inner_with(&self.module.types);
        let coordinate = super::language::Operand { text: self.expression(scope, coordinate)?, ty };
        let name = self.text(scope, image)?;
        let components = self.components(scope, image);
        let text = if self.language.stores_full_values() || components == 4 {
            self.text(scope, value)?
        } else {
            self.first_components(scope, value, components)?
        };
        Ok(self.language.image_store(&name, &coordinate, &text))
    }

    /// Components of a storage texture's format.
    fn components(&self, scope: &Scope, image: Handle<Expression>) -> u8 {
        match scope.info[image].ty.inner_with(&self.module.types) {
            TypeInner::Image { class: naga::ImageClass::Storage { format, .. }, .. } => match format {
                naga::StorageFormat::R32Uint => 1,
                naga::StorageFormat::Rg32Uint => 2,
                _ => 4,
            },
            _ => 4,
        }
    }

    /// The first one or two components of a vector of four.
    fn first_components(&self, scope: &Scope, value: Handle<Expression>, count: u8) -> Result<String> {
        if let Expression::Compose { components, .. } = &scope.function.expressions[value]
            && let Some(&first) = components.first()
            // What is left is as long as what is cut off.
            && components.len() == 5 - usize::from(count)
            && !scope.values.contains_key(&value)
        {
            return self.text(scope, first);
        }
        let swizzle = if count == 1 { "x" } else { "xy" };
        Ok(format!("{}.{swizzle}", self.expression(scope, value)?.at_least(super::language::Binds::Whole)))
    }
}
