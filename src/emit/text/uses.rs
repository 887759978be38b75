//! How often expressions are used and variables set.

use std::collections::HashMap;

use naga::{Block, Expression, Function, Handle, LocalVariable, Statement};

use super::effects::Effects;
use crate::dead_code::operands;

/// How often each variable is set as a whole.
pub(super) fn count_stores(block: &Block, function: &Function, stores: &mut HashMap<Handle<LocalVariable>, usize>) {
    for statement in block.iter() {
        match statement {
            Statement::Store { pointer, .. } => {
                if let Expression::LocalVariable(local) = function.expressions[*pointer] {
                    *stores.entry(local).or_default() += 1;
                }
            }
            Statement::Block(inner) => count_stores(inner, function, stores),
            Statement::If { accept, reject, .. } => {
                count_stores(accept, function, stores);
                count_stores(reject, function, stores);
            }
            Statement::Loop { body, continuing, .. } => {
                count_stores(body, function, stores);
                count_stores(continuing, function, stores);
            }
            _ => {}
        }
    }
}

/// How often each expression is used.
pub(super) fn count_uses(
    block: &Block,
    function: &Function,
    effects: &Effects,
    uses: &mut HashMap<Handle<Expression>, usize>,
) {
    for statement in block.iter() {
        let used = match statement {
            Statement::Emit(range) => {
                range.clone().flat_map(|expression| operands(&function.expressions[expression])).collect()
            }
            Statement::Block(inner) => {
                count_uses(inner, function, effects, uses);
                Vec::new()
            }
            Statement::If { condition, accept, reject } => {
                count_uses(accept, function, effects, uses);
                count_uses(reject, function, effects, uses);
                vec![*condition]
            }
            Statement::Loop { body, continuing, break_if } => {
                count_uses(body, function, effects, uses);
                count_uses(continuing, function, effects, uses);
                break_if.iter().copied().collect()
            }
            Statement::Return { value } => value.iter().copied().collect(),
            Statement::Store { pointer, value } | Statement::Atomic { pointer, value, .. } => vec![*pointer, *value],
            Statement::ImageStore { image, coordinate, value, .. } => vec![*image, *coordinate, *value],
            Statement::Call { function, arguments, .. } => effects.arguments(*function, arguments),
            _ => Vec::new(),
        };
        for expression in used {
            *uses.entry(expression).or_default() += 1;
        }
    }
}
