//! Where variables are declared: in the innermost block that mentions them, with their first value if it can be.

use std::collections::HashSet;

use naga::{Expression, Function, Handle, LocalVariable};

use super::outline::{Line, Node, Outline};

struct Mentions<'a> {
    function: &'a Function,
    outline: &'a Outline,
    local: Handle<LocalVariable>,
}

impl Mentions<'_> {
    fn in_expression(&self, handle: Handle<Expression>, top: bool) -> bool {
        if !top && self.outline.named.contains(&handle) {
            return false;
        }
        if !self.outline.short_circuits.contains_key(&handle)
            && !self.outline.aliases.contains_key(&handle)
            && matches!(self.function.expressions[handle], Expression::LocalVariable(local) if local == self.local)
        {
            return true;
        }
        self.outline.operands(self.function, handle).into_iter().any(|operand| self.in_expression(operand, false))
    }

    fn in_lines(&self, lines: &[Line]) -> bool {
        lines.iter().any(|line| self.in_node(&line.node))
    }

    fn in_head(&self, node: &Node) -> bool {
        let any = |handles: &[Handle<Expression>]| handles.iter().any(|&handle| self.in_expression(handle, false));
        match node {
            // The value that it names.
            Node::Let(value) => self.in_expression(*value, true),
            Node::Variable(local, value) => *local == self.local || value.is_some_and(|value| any(&[value])),
            Node::Assign { pointer, value, .. } | Node::Atomic { pointer, value, .. } => any(&[*pointer, *value]),
            Node::ImageStore { image, coordinate, value } => any(&[*image, *coordinate, *value]),
            Node::Call(_, arguments) => any(arguments),
            Node::If { condition, .. } => any(&[*condition]),
            Node::For { first, condition, step, .. } => {
                let part = |line: &Option<Box<Line>>| line.as_ref().is_some_and(|line| self.in_node(&line.node));
                part(first) || part(step) || condition.is_some_and(|condition| any(&[condition]))
            }
            Node::Return(value) => value.is_some_and(|value| any(&[value])),
            Node::Break | Node::Continue | Node::Barrier => false,
        }
    }

    fn in_node(&self, node: &Node) -> bool {
        self.in_head(node)
            || match node {
                Node::If { accept, reject, .. } => self.in_lines(accept) || self.in_lines(reject),
                Node::For { body, .. } => self.in_lines(body),
                _ => false,
            }
    }

    /// Declares the variable in the innermost block. Inside a loop only where its first mention sets it: its initial
    /// value is that of the function's beginning. Returns whether it is declared.
    fn declare(&self, lines: &mut Vec<Line>, in_loop: bool) -> bool {
        let found: Vec<usize> = (0..lines.len()).filter(|&index| self.in_node(&lines[index].node)).collect();
        let Some(&first) = found.first() else { return true };
        if found.len() == 1 && !self.in_head(&lines[first].node) {
            let declared = match &mut lines[first].node {
                Node::If { accept, reject, .. } => match (self.in_lines(accept), self.in_lines(reject)) {
                    (true, false) => self.declare(accept, in_loop),
                    (false, true) => self.declare(reject, in_loop),
                    _ => false,
                },
                Node::For { body, .. } => self.declare(body, true),
                _ => false,
            };
            if declared {
                return true;
            }
        }
        if let Node::Assign { pointer, operator: None, value } = lines[first].node
            && matches!(self.function.expressions[pointer], Expression::LocalVariable(_))
            && !self.in_expression(value, false)
        {
            lines[first].node = Node::Variable(self.local, Some(value));
            return true;
        }
        if in_loop {
            return false;
        }
        lines.insert(first, Line { node: Node::Variable(self.local, None), offset: lines[first].offset });
        true
    }
}

/// Moves a declaration that only the loop after it uses into the loop's head.
fn merge_into_loops(lines: &mut Vec<Line>, function: &Function, outline: &Outline) {
    let mut index = 0;
    while index < lines.len() {
        match &mut lines[index].node {
            Node::If { accept, reject, .. } => {
                merge_into_loops(accept, function, outline);
                merge_into_loops(reject, function, outline);
            }
            Node::For { body, .. } => merge_into_loops(body, function, outline),
            _ => {}
        }
        if index > 0
            && let Node::Variable(local, _) = lines[index - 1].node
            && let Node::For { first: None, step: Some(step), .. } = &lines[index].node
        {
            let mentions = Mentions { function, outline, local };
            if mentions.in_node(&step.node) && !mentions.in_lines(&lines[index + 1..]) {
                let declaration = lines.remove(index - 1);
                index -= 1;
                let Node::For { first, .. } = &mut lines[index].node else { unreachable!("it was a loop just now") };
                *first = Some(Box::new(declaration));
            }
        }
        index += 1;
    }
}

/// Declares all variables that are mentioned.
pub(super) fn declare_variables(body: &mut Vec<Line>, function: &Function, outline: &Outline) {
    let mut seen = HashSet::new();
    for (local, _) in function.local_variables.iter() {
        if seen.insert(local) {
            Mentions { function, outline, local }.declare(body, false);
        }
    }
    merge_into_loops(body, function, outline);
}
