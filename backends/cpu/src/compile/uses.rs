//! What uses which values of a function.

use std::collections::HashMap;

use naga::{Expression, Function, Handle};

/// The expressions that an expression is made of.
pub(super) fn operands(expression: &Expression, mut visit: impl FnMut(Handle<Expression>)) {
    match expression {
        Expression::Compose { components, .. } => components.iter().copied().for_each(visit),
        Expression::Access { base, index } => [*base, *index].into_iter().for_each(visit),
        Expression::AccessIndex { base, .. } => visit(*base),
        Expression::Splat { value, .. } => visit(*value),
        Expression::Swizzle { vector, .. } => visit(*vector),
        Expression::Load { pointer } => visit(*pointer),
        Expression::ImageLoad { coordinate, level, .. } => {
            visit(*coordinate);
            level.iter().copied().for_each(visit);
        }
        Expression::ImageQuery { query: naga::ImageQuery::Size { level: Some(level) }, .. } => visit(*level),
        Expression::Unary { expr, .. } | Expression::As { expr, .. } => visit(*expr),
        Expression::Binary { left, right, .. } => [*left, *right].into_iter().for_each(visit),
        Expression::Select { condition, accept, reject } => [*condition, *accept, *reject].into_iter().for_each(visit),
        Expression::Relational { argument, .. } => visit(*argument),
        Expression::Math { arg, arg1, arg2, arg3, .. } => {
            [Some(*arg), *arg1, *arg2, *arg3].into_iter().flatten().for_each(visit);
        }
        Expression::ArrayLength(pointer) => visit(*pointer),
        _ => {}
    }
}

fn visit_statements(block: &naga::Block, visit: &mut impl FnMut(&naga::Statement)) {
    for statement in block {
        visit(statement);
        match statement {
            naga::Statement::Block(inner) => visit_statements(inner, visit),
            naga::Statement::If { accept, reject, .. } => {
                visit_statements(accept, visit);
                visit_statements(reject, visit);
            }
            naga::Statement::Loop { body, continuing, .. } => {
                visit_statements(body, visit);
                visit_statements(continuing, visit);
            }
            naga::Statement::Switch { cases, .. } => {
                cases.iter().for_each(|case| visit_statements(&case.body, visit));
            }
            _ => {}
        }
    }
}

/// How often the value of each expression is asked for.
pub(super) fn count_uses(function: &Function) -> Vec<u32> {
    let mut uses = vec![0; function.expressions.len()];
    let mut count = |handle: Handle<Expression>| uses[handle.index()] += 1;
    visit_statements(&function.body, &mut |statement| match statement {
        naga::Statement::Emit(range) => {
            range.clone().for_each(|handle| operands(&function.expressions[handle], &mut count));
        }
        naga::Statement::If { condition, .. } => count(*condition),
        naga::Statement::Switch { selector, .. } => count(*selector),
        naga::Statement::Loop { break_if: Some(condition), .. } => count(*condition),
        naga::Statement::Return { value: Some(value) } => count(*value),
        naga::Statement::Store { pointer, value } => [*pointer, *value].into_iter().for_each(&mut count),
        naga::Statement::ImageStore { coordinate, value, .. } => [*coordinate, *value].into_iter().for_each(&mut count),
        naga::Statement::Atomic { pointer, value, .. } => [*pointer, *value].into_iter().for_each(&mut count),
        naga::Statement::Call { arguments, .. } => arguments.iter().copied().for_each(&mut count),
        _ => {}
    });
    uses
}

/// Which components of each texel are looked at.
pub(super) fn wanted_components(function: &Function) -> HashMap<Handle<Expression>, [bool; 4]> {
    let mut wanted: HashMap<_, [bool; 4]> = HashMap::new();
    let is_load = |handle: &Handle<Expression>| matches!(function.expressions[*handle], Expression::ImageLoad { .. });
    for (_, expression) in function.expressions.iter() {
        match expression {
            Expression::AccessIndex { base, index } if is_load(base) => {
                wanted.entry(*base).or_default()[(*index as usize).min(3)] = true;
            }
            Expression::Swizzle { size, vector, pattern } if is_load(vector) => {
                let components = wanted.entry(*vector).or_default();
                pattern[..*size as usize].iter().for_each(|component| components[*component as usize] = true);
            }
            other => operands(other, |handle| {
                if is_load(&handle) {
                    wanted.insert(handle, [true; 4]);
                }
            }),
        }
    }
    visit_statements(&function.body, &mut |statement| {
        let mut all = |handle: Handle<Expression>| {
            if is_load(&handle) {
                wanted.insert(handle, [true; 4]);
            }
        };
        match statement {
            naga::Statement::Return { value: Some(value) } => all(*value),
            naga::Statement::Store { value, .. }
            | naga::Statement::ImageStore { value, .. }
            | naga::Statement::Atomic { value, .. } => all(*value),
            naga::Statement::Call { arguments, .. } => arguments.iter().copied().for_each(all),
            _ => {}
        }
    });
    wanted
}
