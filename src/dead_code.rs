//! Removes what nothing uses from a specialised kernel: naga keeps every value that has a name and every call, and with
//! them code and bindings of features that are off.

use std::collections::{HashMap, HashSet};

use naga::{
    Block, Expression, Function, Handle, ImageQuery, LocalVariable, Module, SampleLevel, Statement, Type, TypeInner,
    UniqueArena,
};

/// What callers have to know of a function.
struct Callee {
    /// Whether it does nothing but compute a result.
    is_pure: bool,
    /// The type of each argument that does not matter.
    unused: Vec<Option<Handle<Type>>>,
}

type Callees = HashMap<Handle<Function>, Callee>;

/// What a function uses of itself.
#[derive(Default)]
struct Used {
    expressions: HashSet<Handle<Expression>>,
    /// Those that are read.
    variables: HashSet<Handle<LocalVariable>>,
}

/// Removes calls that do nothing but compute a result that is not used, what is stored in variables that are not read,
/// branches that are empty then, arguments that do not matter, and names of values that are not used, which would keep
/// them alive. Functions with statements or expressions that are not known here stay as they are.
pub(crate) fn remove(module: &mut Module) {
    let mut callees = Callees::new();
    let handles: Vec<_> = module.functions.iter().map(|(handle, _)| handle).collect();
    // Functions stand before those that call them.
    for handle in handles {
        let function = module.functions.get_mut(handle);
        simplify(function, &callees);
        let is_pure = is_pure(&function.body, function, &callees);
        let unused = unused_arguments(function, &callees, &module.types);
        callees.insert(handle, Callee { is_pure, unused });
    }
    module.entry_points.iter_mut().for_each(|entry_point| simplify(&mut entry_point.function, &callees));
}

fn simplify(function: &mut Function, callees: &Callees) {
    while let Some(used) = find_used(function, callees) {
        function.named_expressions.retain(|expression, _| used.expressions.contains(expression));
        let body = std::mem::take(&mut function.body);
        let mut sweep = Sweep { function, used: &used, callees, has_removed: false };
        let body = sweep.without_unused(body);
        let has_removed = sweep.has_removed;
        function.body = body;
        if !has_removed {
            return;
        }
    }
}

/// Types of arguments that do not matter and that have a zero to stand in for them.
fn unused_arguments(function: &Function, callees: &Callees, types: &UniqueArena<Type>) -> Vec<Option<Handle<Type>>> {
    let mut unused: Vec<_> = function.arguments.iter().map(|argument| Some(argument.ty)).collect();
    let Some(used) = find_used(function, callees) else { return vec![None; unused.len()] };
    for expression in used.expressions {
        if let Expression::FunctionArgument(index) = function.expressions[expression] {
            unused[index as usize] = None;
        }
    }
    let has_zero = |ty: &Handle<Type>| {
        matches!(types[*ty].inner, TypeInner::Scalar(_) | TypeInner::Vector { .. } | TypeInner::Struct { .. })
    };
    unused.into_iter().map(|ty| ty.filter(has_zero)).collect()
}

/// Whether a function only computes its result. Variables of its own are no one else's business.
fn is_pure(block: &Block, function: &Function, callees: &Callees) -> bool {
    let inside = |block| is_pure(block, function, callees);
    block.iter().all(|statement| match statement {
        Statement::Emit(_) | Statement::Break | Statement::Continue | Statement::Return { .. } => true,
        Statement::Store { pointer, .. } => is_local(*pointer, function),
        Statement::Call { function: callee, .. } => callees[callee].is_pure,
        Statement::Block(inner) => inside(inner),
        Statement::If { accept, reject, .. } => inside(accept) && inside(reject),
        Statement::Loop { body, continuing, .. } => inside(body) && inside(continuing),
        Statement::Switch { cases, .. } => cases.iter().all(|case| inside(&case.body)),
        _ => false,
    })
}

fn is_local(pointer: Handle<Expression>, function: &Function) -> bool {
    local_of(pointer, function).is_some()
}

/// The variable of the function that a pointer points into.
fn local_of(pointer: Handle<Expression>, function: &Function) -> Option<Handle<LocalVariable>> {
    match function.expressions[pointer] {
        Expression::LocalVariable(local) => Some(local),
        Expression::Access { base, .. } | Expression::AccessIndex { base, .. } => local_of(base, function),
        _ => None,
    }
}

/// Goes through the statements of a function.
struct Sweep<'a> {
    function: &'a mut Function,
    used: &'a Used,
    callees: &'a Callees,
    has_removed: bool,
}

impl Sweep<'_> {
    fn is_unused(&self, statement: &Statement) -> bool {
        match statement {
            Statement::Call { function, result, .. } => {
                let is_used = result.is_some_and(|result| self.used.expressions.contains(&result));
                self.callees[function].is_pure && !is_used
            }
            Statement::Store { pointer, .. } => {
                local_of(*pointer, self.function).is_some_and(|local| !self.used.variables.contains(&local))
            }
            // Values that are computed and not used are no reason for a branch.
            Statement::If { accept, reject, .. } => !(acts(accept) || acts(reject)),
            _ => false,
        }
    }

    /// Arguments of a call, with a zero for each that does not matter.
    fn arguments(&mut self, callee: Handle<Function>, arguments: Vec<Handle<Expression>>) -> Vec<Handle<Expression>> {
        let expressions = &mut self.function.expressions;
        let unused = arguments.into_iter().zip(&self.callees[&callee].unused);
        unused
            .map(|(argument, unused)| match *unused {
                Some(ty) if !matches!(expressions[argument], Expression::ZeroValue(_)) => {
                    let span = expressions.get_span(argument);
                    expressions.append(Expression::ZeroValue(ty), span)
                }
                _ => argument,
            })
            .collect()
    }

    fn without_unused(&mut self, block: Block) -> Block {
        let mut kept = Block::new();
        for (statement, span) in block.span_into_iter() {
            let statement = match statement {
                Statement::Block(inner) => Statement::Block(self.without_unused(inner)),
                Statement::If { condition, accept, reject } => {
                    let (accept, reject) = (self.without_unused(accept), self.without_unused(reject));
                    Statement::If { condition, accept, reject }
                }
                Statement::Loop { body, continuing, break_if } => {
                    let (body, continuing) = (self.without_unused(body), self.without_unused(continuing));
                    Statement::Loop { body, continuing, break_if }
                }
                Statement::Switch { selector, cases } => {
                    let mut swept = |case: naga::SwitchCase| {
                        let body = self.without_unused(case.body);
                        naga::SwitchCase { body, ..case }
                    };
                    Statement::Switch { selector, cases: cases.into_iter().map(&mut swept).collect() }
                }
                Statement::Call { function, arguments, result } => {
                    Statement::Call { function, arguments: self.arguments(function, arguments), result }
                }
                other => other,
            };
            if self.is_unused(&statement) {
                self.has_removed = true;
            } else {
                kept.push(statement, span);
            }
        }
        kept
    }
}

/// Whether a block does anything but compute values.
fn acts(block: &Block) -> bool {
    block.iter().any(|statement| match statement {
        Statement::Emit(_) => false,
        Statement::Block(inner) => acts(inner),
        _ => true,
    })
}

/// What statements use: some only if their result is used in turn.
#[derive(Default)]
struct Roots {
    /// Arguments of calls by their result.
    arguments: HashMap<Handle<Expression>, Vec<Handle<Expression>>>,
    /// Pointers and values of what is stored, by variable.
    stored: HashMap<Handle<LocalVariable>, Vec<Handle<Expression>>>,
    needed: Vec<Handle<Expression>>,
}

/// What statements use, directly or not; `None` if something is not known.
fn find_used(function: &Function, callees: &Callees) -> Option<Used> {
    let mut roots = Roots::default();
    find_roots(&function.body, function, callees, &mut roots)?;
    let mut used = Used::default();
    let mut open = roots.needed;
    while let Some(handle) = open.pop() {
        if !used.expressions.insert(handle) {
            continue;
        }
        let expression = &function.expressions[handle];
        open.extend(known_operands(expression)?);
        open.extend(roots.arguments.get(&handle).into_iter().flatten());
        if let Expression::LocalVariable(local) = expression {
            used.variables.insert(*local);
            open.extend(roots.stored.get(local).into_iter().flatten());
        }
    }
    Some(used)
}

fn find_roots(block: &Block, function: &Function, callees: &Callees, roots: &mut Roots) -> Option<()> {
    for statement in block.iter() {
        match statement {
            Statement::Emit(_)
            | Statement::Break
            | Statement::Continue
            | Statement::ControlBarrier(_)
            | Statement::MemoryBarrier(_) => {}
            Statement::Call { function: callee, arguments, result } => {
                let callee = &callees[callee];
                let unused = arguments.iter().zip(&callee.unused);
                let matter = unused.filter(|(_, unused)| unused.is_none()).map(|(argument, _)| *argument);
                match result {
                    Some(result) if callee.is_pure => drop(roots.arguments.insert(*result, matter.collect())),
                    _ => roots.needed.extend(matter),
                }
            }
            Statement::Return { value } => roots.needed.extend(value),
            Statement::Store { pointer, value } => match local_of(*pointer, function) {
                Some(local) => roots.stored.entry(local).or_default().extend([pointer, value]),
                None => roots.needed.extend([pointer, value]),
            },
            Statement::ImageStore { image, coordinate, array_index: None, value } => {
                roots.needed.extend([image, coordinate, value]);
            }
            Statement::Atomic { pointer, value, fun, .. } => {
                roots.needed.extend([pointer, value]);
                if let naga::AtomicFunction::Exchange { compare } = fun {
                    roots.needed.extend(compare);
                }
            }
            Statement::Block(inner) => find_roots(inner, function, callees, roots)?,
            Statement::If { condition, accept, reject } => {
                roots.needed.push(*condition);
                find_roots(accept, function, callees, roots)?;
                find_roots(reject, function, callees, roots)?;
            }
            Statement::Loop { body, continuing, break_if } => {
                roots.needed.extend(break_if);
                find_roots(body, function, callees, roots)?;
                find_roots(continuing, function, callees, roots)?;
            }
            Statement::Switch { selector, cases } => {
                roots.needed.push(*selector);
                for case in cases {
                    find_roots(&case.body, function, callees, roots)?;
                }
            }
            _ => return None,
        }
    }
    Some(())
}

/// The expressions that an expression is made of, if it is one that kernels can have so far.
fn known_operands(expression: &Expression) -> Option<Vec<Handle<Expression>>> {
    match expression {
        Expression::Literal(_)
        | Expression::Constant(_)
        | Expression::ZeroValue(_)
        | Expression::FunctionArgument(_)
        | Expression::GlobalVariable(_)
        | Expression::LocalVariable(_)
        | Expression::CallResult(_)
        | Expression::AtomicResult { .. } => Some(Vec::new()),
        Expression::ImageSample { .. }
        | Expression::ImageLoad { array_index: Some(_), .. }
        | Expression::ImageLoad { sample: Some(_), .. } => None,
        other => Some(operands(other)).filter(|operands| !operands.is_empty()),
    }
}

/// The expressions that an expression is made of.
pub(crate) fn operands(expression: &Expression) -> Vec<Handle<Expression>> {
    match expression {
        Expression::Compose { components, .. } => components.clone(),
        &Expression::Access { base, index } => vec![base, index],
        &Expression::AccessIndex { base, .. } => vec![base],
        &Expression::Splat { value, .. } => vec![value],
        &Expression::Swizzle { vector, .. } => vec![vector],
        &Expression::Load { pointer } => vec![pointer],
        &Expression::ImageLoad { image, coordinate, level, .. } => {
            [Some(image), Some(coordinate), level].into_iter().flatten().collect()
        }
        &Expression::ImageSample { image, sampler, coordinate, level, .. } => {
            let level = if let SampleLevel::Exact(level) = level { Some(level) } else { None };
            [Some(image), Some(sampler), Some(coordinate), level].into_iter().flatten().collect()
        }
        &Expression::ImageQuery { image, query: ImageQuery::Size { level } } => {
            [Some(image), level].into_iter().flatten().collect()
        }
        &Expression::ImageQuery { image, .. } => vec![image],
        &Expression::Unary { expr, .. } | &Expression::As { expr, .. } => vec![expr],
        &Expression::Binary { left, right, .. } => vec![left, right],
        &Expression::Select { condition, accept, reject } => vec![condition, accept, reject],
        &Expression::Relational { argument, .. } => vec![argument],
        &Expression::Math { arg, arg1, arg2, arg3, .. } => {
            [Some(arg), arg1, arg2, arg3].into_iter().flatten().collect()
        }
        &Expression::ArrayLength(array) => vec![array],
        _ => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use crate::kernel::Kernel;

    #[test]
    fn what_a_feature_leaves_behind_is_gone() {
        let text = "
            @group(0) @binding(0) var in_a: texture_2d<f32>;
            @group(0) @binding(1) var in_b: texture_2d<f32>;
            @group(1) @binding(0) var<storage, read_write> out_sum: array<f32>;
            const IS_ON = false;
            fn sum(a: vec4<f32>, b: vec4<f32>) -> f32 {
                if (IS_ON) { return a.x + b.x; }
                return a.x;
            }
            fn twice(x: f32) -> f32 {
                var y = x;
                y += x;
                return y;
            }
            fn add(x: f32) -> f32 {
                out_sum[1] += x;
                return x;
            }
            @compute @workgroup_size(1) fn main_test() {
                let a = textureLoad(in_a, vec2<u32>(0u), 0);
                let b = textureLoad(in_b, vec2<u32>(0u), 0);
                let c = twice(b.y);
                var d = 0.0;
                if (c > 0.0 && b.z > 0.0) { d = b.w; }
                let e = add(a.y);
                out_sum[0] = sum(a, b);
            }";
        let kernel = Kernel::from_text("main_test", text).unwrap();
        let bindings: Vec<_> = kernel.bindings.iter().map(|binding| binding.name.as_str()).collect();
        assert_eq!(bindings, ["in_a", "out_sum"]);
        let functions: Vec<_> = kernel.module.functions.iter().filter_map(|(_, f)| f.name.as_deref()).collect();
        assert_eq!(functions, ["sum", "add"]);
        let names: Vec<_> = kernel.module.entry_points[0].function.named_expressions.values().collect();
        assert_eq!(names, ["a"]);
    }
}
