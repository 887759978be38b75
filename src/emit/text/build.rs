//! Makes outlines.
//!
//! The IR evaluates every expression at a place of its own. An expression that is used once moves to where it is
//! used, as long as nothing in between writes what it reads; others become named values.

use std::collections::{HashMap, HashSet};

use naga::{
    BinaryOperator, Block, Expression, Function, GlobalVariable, Handle, Literal, LocalVariable, Span, Statement,
    UnaryOperator,
};

use super::effects::Effects;
use super::outline::{Line, Node, Outline, ShortCircuit};
use super::uses::{count_stores, count_uses};

/// Memory that can change while a function runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Place {
    Local(Handle<LocalVariable>),
    Global(Handle<GlobalVariable>),
}

/// An expression that waits for the statement that uses it, and what it reads.
#[derive(Debug)]
struct Pending {
    expression: Handle<Expression>,
    reads: HashSet<Place>,
}

struct Builder<'a> {
    function: &'a Function,
    effects: &'a Effects,
    outline: Outline,
    /// Uses that are still to come.
    uses: HashMap<Handle<Expression>, usize>,
    pending: Vec<Pending>,
    /// Variables that stand for a short circuit.
    conditions: HashMap<Handle<LocalVariable>, ShortCircuit>,
    /// How often nameless variables are set.
    stores: HashMap<Handle<LocalVariable>, usize>,
    /// Variables that are read at all.
    read: HashSet<Place>,
    /// What those stand for that are set once.
    values: HashMap<Handle<LocalVariable>, Handle<Expression>>,
}

/// Brings a function into shape.
///
/// # Errors
///
/// Names what it does not know.
pub(super) fn outline(function: &Function, effects: &Effects) -> Result<Outline, String> {
    let mut uses = HashMap::new();
    count_uses(&function.body, function, effects, &mut uses);
    let mut stores = HashMap::new();
    count_stores(&function.body, function, &mut stores);
    let mut builder = Builder {
        function,
        effects,
        outline: Outline::default(),
        uses,
        pending: Vec::new(),
        conditions: HashMap::new(),
        stores,
        read: HashSet::new(),
        values: HashMap::new(),
    };
    builder.read = builder.places_read();
    let mut body = builder.block(&function.body)?;
    drop_last_return(&mut body);
    let mut outline = builder.outline;
    super::declare::declare_variables(&mut body, function, &outline);
    outline.body = body;
    Ok(outline)
}

/// Leaves out returns at the end of a function.
fn drop_last_return(lines: &mut Vec<Line>) {
    match lines.last_mut().map(|line| &mut line.node) {
        Some(Node::Return(None)) => {
            lines.pop();
        }
        Some(Node::If { accept, reject, .. }) => {
            drop_last_return(accept);
            drop_last_return(reject);
        }
        _ => {}
    }
}

impl Builder<'_> {
    fn expression(&self, handle: Handle<Expression>) -> &Expression {
        &self.function.expressions[handle]
    }

    fn line_of(&self, node: Node, span: Span) -> Line {
        Line { node, offset: span.to_range().map(|range| range.start) }
    }

    /// Whether it is written out wherever it is used, however often.
    fn is_repeatable(&self, handle: Handle<Expression>) -> bool {
        match *self.expression(handle) {
            Expression::Literal(_)
            | Expression::Constant(_)
            | Expression::ZeroValue(_)
            | Expression::FunctionArgument(_)
            | Expression::GlobalVariable(_)
            | Expression::LocalVariable(_) => true,
            _ if self.outline.named.contains(&handle) => true,
            Expression::Access { base, .. } | Expression::AccessIndex { base, .. } => {
                self.is_pointer(base)
                    || self.outline.operands(self.function, handle).iter().all(|&o| self.is_repeatable(o))
            }
            Expression::Swizzle { .. } | Expression::Splat { .. } => {
                self.outline.operands(self.function, handle).iter().all(|&operand| self.is_repeatable(operand))
            }
            _ => false,
        }
    }

    /// Whether it says where something is, and reads nothing.
    fn is_pointer(&self, handle: Handle<Expression>) -> bool {
        match *self.expression(handle) {
            Expression::LocalVariable(_) | Expression::GlobalVariable(_) => true,
            Expression::Access { base, .. } | Expression::AccessIndex { base, .. } => self.is_pointer(base),
            _ => false,
        }
    }

    fn reads(&self, handle: Handle<Expression>) -> HashSet<Place> {
        let mut reads = HashSet::new();
        let mut open = vec![handle];
        while let Some(at) = open.pop() {
            if at != handle && self.outline.named.contains(&at) {
                continue;
            }
            if !self.outline.short_circuits.contains_key(&at) && !self.outline.aliases.contains_key(&at) {
                match *self.expression(at) {
                    Expression::Load { pointer } => reads.extend(self.place(pointer)),
                    Expression::ImageLoad { image, .. } => reads.extend(self.place(image)),
                    _ => {}
                }
            }
            if let Some((function, _)) = self.outline.calls.get(&at) {
                reads.extend(self.effects.of(*function).reads.iter().map(|&global| Place::Global(global)));
            }
            open.extend(self.outline.operands(self.function, at));
        }
        reads
    }

    fn places_read(&self) -> HashSet<Place> {
        let loads = self.function.expressions.iter().filter_map(|(handle, expression)| match *expression {
            Expression::Load { pointer } if self.uses.contains_key(&handle) => self.place(pointer),
            _ => None,
        });
        loads.collect()
    }

    fn place(&self, pointer: Handle<Expression>) -> Option<Place> {
        match *self.expression(pointer) {
            Expression::LocalVariable(local) => Some(Place::Local(local)),
            Expression::GlobalVariable(global) => Some(Place::Global(global)),
            Expression::Access { base, .. } | Expression::AccessIndex { base, .. } => self.place(base),
            _ => None,
        }
    }

    /// Notes that a statement uses an expression.
    fn consume(&mut self, handle: Handle<Expression>) {
        let left = self.uses.entry(handle).or_insert(1);
        *left = left.saturating_sub(1);
        if *left > 0 || self.outline.named.contains(&handle) {
            return;
        }
        self.pending.retain(|pending| pending.expression != handle);
        for operand in self.outline.operands(self.function, handle) {
            self.consume(operand);
        }
    }

    fn name(&mut self, handle: Handle<Expression>, lines: &mut Vec<Line>) {
        self.pending.retain(|pending| pending.expression != handle);
        for operand in self.outline.operands(self.function, handle) {
            self.consume(operand);
        }
        self.outline.named.insert(handle);
        let span = self.function.expressions.get_span(handle);
        lines.push(self.line_of(Node::Let(handle), span));
    }

    /// Names what waits and reads one of `writes`; everything that waits if there are none.
    fn settle(&mut self, writes: Option<&HashSet<Place>>, lines: &mut Vec<Line>) {
        let conflicts = |pending: &Pending| writes.is_none_or(|writes| !writes.is_disjoint(&pending.reads));
        while let Some(found) = self.pending.iter().rposition(conflicts) {
            let expression = self.pending[found].expression;
            self.name(expression, lines);
        }
    }

    /// An expression is evaluated here: names it, or leaves it to the statement that uses it.
    fn evaluate(&mut self, handle: Handle<Expression>, lines: &mut Vec<Line>) {
        if let Expression::Load { pointer } = *self.expression(handle)
            && let Expression::LocalVariable(local) = *self.expression(pointer)
        {
            if let Some(&short) = self.conditions.get(&local) {
                self.outline.short_circuits.insert(handle, short);
            } else if let Some(&value) = self.values.get(&local) {
                self.outline.aliases.insert(handle, value);
            }
        }
        let uses = self.uses.get(&handle).copied().unwrap_or(0);
        let has_name = self.function.named_expressions.contains_key(&handle) && !self.is_pointer(handle);
        if uses == 0 {
            return;
        }
        if has_name || (uses > 1 && !self.is_repeatable(handle)) {
            return self.name(handle, lines);
        }
        let reads = self.reads(handle);
        if !reads.is_empty() && !self.is_pointer(handle) {
            self.pending.push(Pending { expression: handle, reads });
        }
    }

    fn block(&mut self, block: &Block) -> Result<Vec<Line>, String> {
        let mut lines = Vec::new();
        self.statements(block, &mut lines)?;
        Ok(lines)
    }

    fn statements(&mut self, block: &Block, lines: &mut Vec<Line>) -> Result<(), String> {
        for (statement, &span) in block.span_iter() {
            self.statement(statement, span, lines)?;
        }
        Ok(())
    }

    /// A statement with operands that writes some places.
    fn act(
        &mut self,
        node: Node,
        used: &[Handle<Expression>],
        writes: HashSet<Place>,
        span: Span,
        lines: &mut Vec<Line>,
    ) {
        for &expression in used {
            self.consume(expression);
        }
        self.settle(Some(&writes), lines);
        lines.push(self.line_of(node, span));
    }

    fn statement(&mut self, statement: &Statement, span: Span, lines: &mut Vec<Line>) -> Result<(), String> {
        match statement {
            Statement::Emit(range) => range.clone().for_each(|expression| self.evaluate(expression, lines)),
            Statement::Block(inner) => self.statements(inner, lines)?,
            Statement::If { condition, accept, reject } => {
                if !self.short_circuit(*condition, accept, reject)? {
                    self.consume(*condition);
                    self.settle(None, lines);
                    let accept = self.block(accept)?;
                    let reject = self.block(reject)?;
                    lines.push(self.line_of(Node::If { condition: *condition, accept, reject }, span));
                }
            }
            Statement::Loop { body, continuing, break_if: None } => {
                self.settle(None, lines);
                let node = self.repeat(body, continuing)?;
                lines.push(self.line_of(node, span));
            }
            Statement::Break => lines.push(self.line_of(Node::Break, span)),
            Statement::Continue => lines.push(self.line_of(Node::Continue, span)),
            Statement::Return { value } => {
                value.iter().for_each(|&value| self.consume(value));
                self.settle(None, lines);
                lines.push(self.line_of(Node::Return(*value), span));
            }
            Statement::ControlBarrier(_) => {
                self.settle(None, lines);
                lines.push(self.line_of(Node::Barrier, span));
            }
            Statement::Store { pointer, value } => self.store(*pointer, *value, span, lines),
            &Statement::ImageStore { image, coordinate, array_index: None, value } => {
                let writes = self.place(image).into_iter().collect();
                let node = Node::ImageStore { image, coordinate, value };
                self.act(node, &[image, coordinate, value], writes, span, lines);
            }
            &Statement::Atomic { pointer, fun, value, result } => {
                let writes = self.place(pointer).into_iter().collect();
                let result = result.filter(|result| self.uses.contains_key(result));
                let node = Node::Atomic { pointer, fun, value, result };
                self.outline.named.extend(result);
                self.act(node, &[pointer, value], writes, span, lines);
            }
            Statement::Call { function, arguments, result } => {
                self.call(*function, arguments, *result, span, lines);
            }
            other => return Err(format!("the statement {other:?} has no text form")),
        }
        Ok(())
    }

    fn store(&mut self, pointer: Handle<Expression>, value: Handle<Expression>, span: Span, lines: &mut Vec<Line>) {
        if let Expression::LocalVariable(local) = *self.expression(pointer)
            && self.function.local_variables[local].name.is_none()
            && self.stores.get(&local) == Some(&1)
        {
            self.values.insert(local, value);
            return;
        }
        let place = self.place(pointer);
        if matches!(place, Some(Place::Local(_))) && place.is_none_or(|place| !self.read.contains(&place)) {
            // Nobody ever looks.
            return [pointer, value].into_iter().for_each(|expression| self.consume(expression));
        }
        let writes = place.into_iter().collect();
        let mut node = Node::Assign { pointer, operator: None, value };
        // What is changed is read on the left side of the operation, at this very place.
        if let Expression::Binary { op, left, right } = *self.expression(value)
            && is_compound(op)
            && !self.outline.named.contains(&value)
            && matches!(*self.expression(left), Expression::Load { pointer: read } if self.same_pointer(read, pointer))
            && !self.outline.named.contains(&left)
        {
            node = Node::Assign { pointer, operator: Some(op), value: right };
        }
        self.act(node, &[pointer, value], writes, span, lines);
    }

    fn same_pointer(&self, a: Handle<Expression>, b: Handle<Expression>) -> bool {
        let (a_is, b_is) = (self.expression(a), self.expression(b));
        a == b
            || match (a_is, b_is) {
                (Expression::LocalVariable(a), Expression::LocalVariable(b)) => a == b,
                (Expression::GlobalVariable(a), Expression::GlobalVariable(b)) => a == b,
                (&Expression::AccessIndex { base: a, index: i }, &Expression::AccessIndex { base: b, index: j }) => {
                    i == j && self.same_pointer(a, b)
                }
                _ => false,
            }
    }

    fn call(
        &mut self,
        function: Handle<Function>,
        arguments: &[Handle<Expression>],
        result: Option<Handle<Expression>>,
        span: Span,
        lines: &mut Vec<Line>,
    ) {
        let arguments = &self.effects.arguments(function, arguments)[..];
        let effects = self.effects.of(function);
        let writes: HashSet<Place> = effects.writes.iter().map(|&global| Place::Global(global)).collect();
        let Some(result) = result else {
            return self.act(Node::Call(function, arguments.to_vec()), arguments, writes, span, lines);
        };
        self.outline.calls.insert(result, (function, arguments.to_vec()));
        if writes.is_empty() && !effects.waits {
            return self.evaluate(result, lines);
        }
        self.settle(Some(&writes), lines);
        self.name(result, lines);
    }

    /// Turns a branch that only sets a nameless variable into `&&` or `||`.
    fn short_circuit(&mut self, condition: Handle<Expression>, accept: &Block, reject: &Block) -> Result<bool, String> {
        let Some((local, otherwise)) = self.stored_literal(reject) else { return Ok(false) };
        let Some(Statement::Store { pointer, value }) = accept.last() else { return Ok(false) };
        if !matches!(*self.expression(*pointer), Expression::LocalVariable(found) if found == local) {
            return Ok(false);
        }
        let (operator, left) = match (otherwise, self.expression(condition)) {
            (false, _) => (BinaryOperator::LogicalAnd, condition),
            (true, &Expression::Unary { op: UnaryOperator::LogicalNot, expr }) => (BinaryOperator::LogicalOr, expr),
            _ => return Ok(false),
        };
        let mut lines = Vec::new();
        let count = accept.len();
        for (index, (statement, &span)) in accept.span_iter().enumerate() {
            if index + 1 < count {
                self.statement(statement, span, &mut lines)?;
            }
        }
        if !lines.is_empty() {
            return Err("a condition that does more than to read has no text form".to_owned());
        }
        self.pending.retain(|pending| pending.expression != condition || left == condition);
        self.conditions.insert(local, ShortCircuit { operator, left, right: *value });
        Ok(true)
    }

    /// The nameless variable that a block sets to a literal, if it does nothing else.
    fn stored_literal(&self, block: &Block) -> Option<(Handle<LocalVariable>, bool)> {
        let [Statement::Store { pointer, value }] = &block[..] else { return None };
        let Expression::LocalVariable(local) = *self.expression(*pointer) else { return None };
        let Expression::Literal(Literal::Bool(value)) = *self.expression(*value) else { return None };
        self.function.local_variables[local].name.is_none().then_some((local, value))
    }

    /// A loop, with its condition where it begins with `if condition {} else { break; }`.
    fn repeat(&mut self, body: &Block, continuing: &Block) -> Result<Node, String> {
        let mut lines = self.block(body)?;
        let mut condition = None;
        if let Some(Line { node: Node::If { condition: found, accept, reject }, .. }) = lines.first()
            && accept.is_empty()
            && matches!(reject[..], [Line { node: Node::Break, .. }])
        {
            condition = Some(*found);
            lines.remove(0);
        }
        if matches!(lines.last(), Some(Line { node: Node::Continue, .. })) {
            lines.pop();
        }
        let mut step = self.block(continuing)?;
        if step.len() > 1 {
            return Err("a loop with more than one step has no text form".to_owned());
        }
        Ok(Node::For { first: None, condition, step: step.pop().map(Box::new), body: lines })
    }
}

fn is_compound(operator: BinaryOperator) -> bool {
    use BinaryOperator::{
        Add, And, Divide, ExclusiveOr, InclusiveOr, Modulo, Multiply, ShiftLeft, ShiftRight, Subtract,
    };
    matches!(
        operator,
        Add | Subtract | Multiply | Divide | Modulo | And | InclusiveOr | ExclusiveOr | ShiftLeft | ShiftRight
    )
}
