//! What functions read and write.

use std::collections::{BTreeSet, HashMap};

use naga::{Block, Expression, Function, GlobalVariable, Handle, Module, Statement};

use super::uses::count_uses;

/// What a function does beyond computing its result, the functions it calls included.
#[derive(Debug, Clone, Default)]
pub(super) struct Effect {
    pub(super) reads: BTreeSet<Handle<GlobalVariable>>,
    pub(super) writes: BTreeSet<Handle<GlobalVariable>>,
    /// All that it mentions.
    pub(super) globals: BTreeSet<Handle<GlobalVariable>>,
    /// Whether it has a barrier.
    pub(super) waits: bool,
    /// Which arguments matter.
    pub(super) used_arguments: Vec<bool>,
}

/// The effects of all functions of a module.
#[derive(Debug)]
pub(super) struct Effects(HashMap<Handle<Function>, Effect>);

impl Effects {
    pub(super) fn new(module: &Module) -> Self {
        let mut effects = Self(HashMap::new());
        // Functions stand before those that call them.
        for (handle, function) in module.functions.iter() {
            let mut effect = effects.find(function);
            let mut uses = HashMap::new();
            count_uses(&function.body, function, &effects, &mut uses);
            effect.used_arguments = vec![false; function.arguments.len()];
            for (expression, count) in uses {
                if let Expression::FunctionArgument(index) = function.expressions[expression] {
                    effect.used_arguments[index as usize] |= count > 0;
                }
            }
            effects.0.insert(handle, effect);
        }
        effects
    }

    pub(super) fn of(&self, function: Handle<Function>) -> &Effect {
        &self.0[&function]
    }

    /// The arguments of a call that matter.
    pub(super) fn arguments(
        &self,
        function: Handle<Function>,
        arguments: &[Handle<Expression>],
    ) -> Vec<Handle<Expression>> {
        let used = arguments.iter().zip(&self.of(function).used_arguments);
        used.filter(|(_, used)| **used).map(|(argument, _)| *argument).collect()
    }

    /// The effect of a function whose callees are known.
    pub(super) fn find(&self, function: &Function) -> Effect {
        let mut effect = Effect::default();
        for (_, expression) in function.expressions.iter() {
            match *expression {
                Expression::GlobalVariable(global) => {
                    effect.globals.insert(global);
                }
                Expression::Load { pointer } => effect.reads.extend(global_of(function, pointer)),
                Expression::ImageLoad { image, .. } => effect.reads.extend(global_of(function, image)),
                _ => {}
            }
        }
        self.visit(&function.body, function, &mut effect);
        effect
    }

    fn visit(&self, block: &Block, function: &Function, effect: &mut Effect) {
        for statement in block.iter() {
            match statement {
                Statement::Store { pointer: to, .. }
                | Statement::Atomic { pointer: to, .. }
                | Statement::ImageStore { image: to, .. } => effect.writes.extend(global_of(function, *to)),
                Statement::ControlBarrier(_) | Statement::MemoryBarrier(_) => effect.waits = true,
                Statement::Call { function: callee, .. } => {
                    let called = &self.0[callee];
                    effect.reads.extend(&called.reads);
                    effect.writes.extend(&called.writes);
                    effect.globals.extend(&called.globals);
                    effect.waits |= called.waits;
                }
                Statement::Block(inner) => self.visit(inner, function, effect),
                Statement::If { accept, reject, .. } => {
                    self.visit(accept, function, effect);
                    self.visit(reject, function, effect);
                }
                Statement::Loop { body, continuing, .. } => {
                    self.visit(body, function, effect);
                    self.visit(continuing, function, effect);
                }
                _ => {}
            }
        }
    }
}

fn global_of(function: &Function, pointer: Handle<Expression>) -> Option<Handle<GlobalVariable>> {
    match function.expressions[pointer] {
        Expression::GlobalVariable(global) => Some(global),
        Expression::Access { base, .. } | Expression::AccessIndex { base, .. } => global_of(function, base),
        _ => None,
    }
}
