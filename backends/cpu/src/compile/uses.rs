//! What uses which values of a function.

use std::collections::HashMap;

use naga::{AtomicFunction, Block, Expression, Function, GatherMode, Handle, SampleLevel, Statement};

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
        Expression::ImageSample { coordinate, offset, level, depth_ref, .. } => {
            [Some(*coordinate), *offset, *depth_ref].into_iter().flatten().for_each(&mut visit);
            match level {
                SampleLevel::Exact(level) => visit(*level),
                SampleLevel::Gradient { x, y } => [*x, *y].into_iter().for_each(visit),
                SampleLevel::Auto | SampleLevel::Zero | SampleLevel::Bias(_) => {}
            }
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

fn visit_statements(block: &Block, visit: &mut impl FnMut(&Statement)) {
    for statement in block {
        visit(statement);
        match statement {
            Statement::Block(inner) => visit_statements(inner, visit),
            Statement::If { accept, reject, .. } => {
                visit_statements(accept, visit);
                visit_statements(reject, visit);
            }
            Statement::Loop { body, continuing, .. } => {
                visit_statements(body, visit);
                visit_statements(continuing, visit);
            }
            Statement::Switch { cases, .. } => {
                cases.iter().for_each(|case| visit_statements(&case.body, visit));
            }
            _ => {}
        }
    }
}

/// The expressions that a statement itself looks at.
fn statement_operands(function: &Function, statement: &Statement, mut visit: impl FnMut(Handle<Expression>)) {
    match statement {
        Statement::Emit(range) => {
            range.clone().for_each(|handle| operands(&function.expressions[handle], &mut visit));
        }
        Statement::If { condition, .. } => visit(*condition),
        Statement::Switch { selector, .. } => visit(*selector),
        Statement::Loop { break_if: Some(condition), .. } => visit(*condition),
        Statement::Return { value: Some(value) } => visit(*value),
        Statement::Store { pointer, value } => [*pointer, *value].into_iter().for_each(visit),
        Statement::ImageStore { coordinate, value, .. } => [*coordinate, *value].into_iter().for_each(visit),
        Statement::Atomic { pointer, value, fun, .. } => {
            [*pointer, *value].into_iter().for_each(&mut visit);
            if let AtomicFunction::Exchange { compare: Some(compare) } = fun {
                visit(*compare);
            }
        }
        Statement::SubgroupBallot { predicate, .. } => predicate.iter().copied().for_each(visit),
        Statement::SubgroupCollectiveOperation { argument, .. } => visit(*argument),
        Statement::SubgroupGather { mode, argument, .. } => {
            visit(*argument);
            match mode {
                GatherMode::BroadcastFirst | GatherMode::QuadSwap(_) => {}
                GatherMode::Broadcast(index)
                | GatherMode::Shuffle(index)
                | GatherMode::ShuffleDown(index)
                | GatherMode::ShuffleUp(index)
                | GatherMode::ShuffleXor(index)
                | GatherMode::QuadBroadcast(index) => visit(*index),
            }
        }
        Statement::Call { arguments, .. } => arguments.iter().copied().for_each(visit),
        _ => {}
    }
}

/// How often the value of each expression is asked for.
pub(super) fn count_uses(function: &Function) -> Vec<u32> {
    let mut uses = vec![0; function.expressions.len()];
    visit_statements(&function.body, &mut |statement| {
        statement_operands(function, statement, |handle| uses[handle.index()] += 1);
    });
    uses
}

/// Which components of each texel are looked at.
pub(super) fn wanted_components(function: &Function) -> HashMap<Handle<Expression>, [bool; 4]> {
    let mut wanted: HashMap<_, [bool; 4]> = HashMap::new();
    let is_load = |handle: &Handle<Expression>| {
        matches!(function.expressions[*handle], Expression::ImageLoad { .. } | Expression::ImageSample { .. })
    };
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
        if !matches!(statement, Statement::Emit(_)) {
            statement_operands(function, statement, |handle| {
                if is_load(&handle) {
                    wanted.insert(handle, [true; 4]);
                }
            });
        }
    });
    wanted
}
