//! A function of naga's IR in the shape in which people write it: nested expressions, `for` loops, `&&`, variables
//! declared where they are first used. [`build`](super::build) makes it.

use std::collections::{HashMap, HashSet};

use naga::{BinaryOperator, Expression, Function, Handle, LocalVariable};

use crate::dead_code::operands;

/// A statement as it is printed.
#[derive(Debug, Clone)]
pub(super) enum Node {
    /// Names a value.
    Let(Handle<Expression>),
    /// Declares a variable; without a value it gets its initial one.
    Variable(Handle<LocalVariable>, Option<Handle<Expression>>),
    /// `pointer = value`, or `pointer operator= value`.
    Assign {
        pointer: Handle<Expression>,
        operator: Option<BinaryOperator>,
        value: Handle<Expression>,
    },
    ImageStore {
        image: Handle<Expression>,
        coordinate: Handle<Expression>,
        value: Handle<Expression>,
    },
    Atomic {
        pointer: Handle<Expression>,
        fun: naga::AtomicFunction,
        value: Handle<Expression>,
        result: Option<Handle<Expression>>,
    },
    Call(Handle<Function>, Vec<Handle<Expression>>),
    If {
        condition: Handle<Expression>,
        accept: Vec<Line>,
        reject: Vec<Line>,
    },
    /// `for (first; condition; step)`, each of which may be missing.
    For {
        first: Option<Box<Line>>,
        condition: Option<Handle<Expression>>,
        step: Option<Box<Line>>,
        body: Vec<Line>,
    },
    Break,
    Continue,
    Return(Option<Handle<Expression>>),
    Barrier,
}

/// A node and the place in the source that it comes from.
#[derive(Debug, Clone)]
pub(super) struct Line {
    pub(super) node: Node,
    pub(super) offset: Option<usize>,
}

/// `left && right` or `left || right`, which the IR spells as a branch.
#[derive(Debug, Clone, Copy)]
pub(super) struct ShortCircuit {
    pub(super) operator: BinaryOperator,
    pub(super) left: Handle<Expression>,
    pub(super) right: Handle<Expression>,
}

/// A function and what it is called with.
type Call = (Handle<Function>, Vec<Handle<Expression>>);

/// A function ready to be printed.
#[derive(Debug, Default)]
pub(super) struct Outline {
    pub(super) body: Vec<Line>,
    /// What call results stand for.
    pub(super) calls: HashMap<Handle<Expression>, Call>,
    pub(super) short_circuits: HashMap<Handle<Expression>, ShortCircuit>,
    /// Loads of nameless variables that are set once, and what to.
    pub(super) aliases: HashMap<Handle<Expression>, Handle<Expression>>,
    /// Whose value has a name.
    pub(super) named: HashSet<Handle<Expression>>,
}

impl Outline {
    /// What an expression is made of.
    pub(super) fn operands(&self, function: &Function, expression: Handle<Expression>) -> Vec<Handle<Expression>> {
        if let Some((_, arguments)) = self.calls.get(&expression) {
            return arguments.clone();
        }
        if let Some(short) = self.short_circuits.get(&expression) {
            return vec![short.left, short.right];
        }
        if let Some(&value) = self.aliases.get(&expression) {
            return vec![value];
        }
        operands(&function.expressions[expression])
    }
}
