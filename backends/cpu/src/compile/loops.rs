//! Loops and switches.

use naga::{Block, Expression, Handle, SwitchValue};

use super::{Compiler, Inlined, LoopContext, Result, unsupported};
use crate::op::{Binary, Op, Operand, Unary};

impl<'a> Compiler<'a> {
    /// Opens a loop or switch; its body runs under a mask of its own if invocations leave it at different times.
    pub(super) fn enter(&mut self, is_switch: bool) -> Option<u32> {
        let flow = self.next_flow;
        self.next_flow += 1;
        let divergent = self.facts.divergent_flows.contains(&flow);
        let outer = self.mask;
        let (mut break_mask, mut continue_mask) = (0, 0);
        if divergent {
            self.mask = Some(self.copy_mask(outer));
            self.depth += 1;
            let zero = |compiler: &mut Self| {
                let register = compiler.registers.allocate();
                compiler.emit(Op::Unary { op: Unary::Copy, to: Operand::Lane(register), a: Operand::Const(0) });
                register
            };
            break_mask = zero(self);
            continue_mask = if is_switch { 0 } else { zero(self) };
        }
        self.loops.push(LoopContext {
            flow,
            divergent,
            entry_depth: self.depth,
            is_switch,
            break_mask,
            continue_mask,
            break_jumps: Vec::new(),
            continue_jumps: Vec::new(),
        });
        outer
    }

    /// Closes what `enter` opened: who left by `break` goes on.
    pub(super) fn exit(&mut self, outer: Option<u32>) {
        let Some(context) = self.loops.pop() else { return };
        let end = self.ops.len();
        for jump in &context.break_jumps {
            self.patch(*jump, end);
        }
        if context.divergent {
            if context.is_switch {
                // Who came to the end of a case goes on as well.
                let left = Operand::Lane(context.break_mask);
                let a = self.mask.map_or(Operand::Const(0), Operand::Lane);
                self.emit(Op::Binary { op: Binary::Or, to: left, a, b: left });
            }
            if let Some(register) = outer {
                let (to, a) = (Operand::Lane(register), Operand::Lane(context.break_mask));
                self.emit(Op::Unary { op: Unary::Copy, to, a });
            }
            self.release_mask(outer);
            self.registers.release(context.break_mask);
            if !context.is_switch {
                self.registers.release(context.continue_mask);
            }
            self.mask = outer;
            self.depth -= 1;
        }
    }

    pub(super) fn loop_statement(
        &mut self,
        frame: &mut Inlined<'a>,
        body: &'a Block,
        continuing: &'a Block,
        break_if: Option<Handle<Expression>>,
    ) -> Result<()> {
        let outer = self.enter(false);
        self.loop_depth += 1;
        let start = self.ops.len();
        self.block(frame, body)?;
        let (divergent, continue_mask) = {
            let context = &self.loops[self.loops.len() - 1];
            (context.divergent, Operand::Lane(context.continue_mask))
        };
        let next = self.ops.len();
        let last = self.loops.len() - 1;
        for jump in std::mem::take(&mut self.loops[last].continue_jumps) {
            self.patch(jump, next);
        }
        if let (true, Some(mask)) = (divergent, self.mask) {
            let mask = Operand::Lane(mask);
            self.emit(Op::Binary { op: Binary::Or, to: mask, a: mask, b: continue_mask });
            self.emit(Op::Unary { op: Unary::Copy, to: continue_mask, a: Operand::Const(0) });
        }
        // The condition at the end sees what the continuing block computed.
        let mut defined = Vec::new();
        for (statement, span) in continuing.span_iter() {
            self.span = *span;
            self.statement(frame, statement, &mut defined)?;
        }
        if let Some(condition) = break_if {
            let operand = self.data(frame, condition)?[0];
            self.break_if(operand);
            self.used(frame, condition);
        }
        for handle in defined {
            self.forget(frame, handle);
        }
        // Also a loop that all leave together ends when all have returned from inside it.
        match self.mask {
            Some(mask) => self.emit(Op::JumpIfAny { mask, to: start }),
            None => self.emit(Op::Jump { to: start }),
        }
        self.loop_depth -= 1;
        self.exit(outer);
        Ok(())
    }

    /// Leaves the innermost loop where a condition holds.
    pub(super) fn break_if(&mut self, condition: Operand) {
        let last = self.loops.len() - 1;
        let (flow, divergent, break_mask) =
            (self.loops[last].flow, self.loops[last].divergent, Operand::Lane(self.loops[last].break_mask));
        match (condition, divergent, self.mask) {
            (_, true, Some(mask)) => {
                let mask = Operand::Lane(mask);
                let leaving = Operand::Lane(self.registers.allocate());
                self.emit(Op::Binary { op: Binary::And, to: leaving, a: mask, b: condition });
                self.emit(Op::Binary { op: Binary::Or, to: break_mask, a: break_mask, b: leaving });
                self.emit(Op::Binary { op: Binary::AndNot, to: mask, a: mask, b: leaving });
                self.release(&[leaving]);
            }
            (Operand::Lane(_), ..) => {
                self.facts.divergent_flows.insert(flow);
            }
            _ => {
                let stay = self.jump(Op::JumpIfFalse { condition, to: 0 });
                let leave = self.jump(Op::Jump { to: 0 });
                self.loops[last].break_jumps.push(leave);
                let end = self.ops.len();
                self.patch(stay, end);
            }
        }
    }

    pub(super) fn leave_loop(&mut self, frame: &Inlined<'a>, is_break: bool) -> Result<()> {
        let Some(index) = self.loops.iter().rposition(|context| is_break || !context.is_switch) else {
            return unsupported("`break` or `continue` outside of a loop");
        };
        // Leaving an inner switch by `continue` needs its mask too.
        let crossed_divergent = self.loops[index..].iter().any(|context| context.divergent);
        let context = &self.loops[index];
        if context.divergent {
            let to = Operand::Lane(if is_break { context.break_mask } else { context.continue_mask });
            let a = self.mask.map_or(Operand::Const(u32::MAX), Operand::Lane);
            self.emit(Op::Binary { op: Binary::Or, to, a: to, b: a });
            self.clear_mask();
        } else if self.depth > context.entry_depth || crossed_divergent || frame.entry_depth > self.depth {
            self.facts.divergent_flows.insert(context.flow);
        } else {
            let jump = self.jump(Op::Jump { to: 0 });
            let context = &mut self.loops[index];
            if is_break { context.break_jumps.push(jump) } else { context.continue_jumps.push(jump) }
        }
        Ok(())
    }

    pub(super) fn clear_mask(&mut self) {
        if let Some(mask) = self.mask {
            self.emit(Op::Unary { op: Unary::Copy, to: Operand::Lane(mask), a: Operand::Const(0) });
        }
    }

    /// A chain of comparisons; values that share a body are gathered first.
    pub(super) fn switch(
        &mut self,
        frame: &mut Inlined<'a>,
        selector: Handle<Expression>,
        cases: &'a [naga::SwitchCase],
    ) -> Result<()> {
        let selected = self.data(frame, selector)?[0];
        let outer = self.enter(true);
        let mut matches_any: Option<Operand> = None;
        let mut pending: Option<Operand> = None;
        let mut ordered: Vec<(Option<Operand>, &'a Block)> = Vec::new();
        let mut is_default = false;
        for case in cases {
            let value = match case.value {
                SwitchValue::I32(value) => Some(value.cast_unsigned()),
                SwitchValue::U32(value) => Some(value),
                SwitchValue::Default => None,
            };
            match value {
                Some(value) => {
                    let equal = self.binary(Binary::EqI, selected, Operand::Const(value));
                    let any = matches_any.map_or(equal, |any| self.binary(Binary::Or, any, equal));
                    matches_any = Some(any);
                    pending = Some(pending.map_or(equal, |pending| self.binary(Binary::Or, pending, equal)));
                }
                None => is_default = true,
            }
            if case.fall_through {
                if !case.body.is_empty() {
                    return unsupported("a case of a switch that falls through into another body");
                }
                continue;
            }
            ordered.push((if is_default { None } else { pending }, &case.body));
            (pending, is_default) = (None, false);
        }
        // The default case takes whoever no other value took; which values share its body does not matter then.
        for (index, (condition, body)) in ordered.iter().enumerate() {
            let condition = match condition {
                Some(condition) => *condition,
                None => {
                    let others = ordered.iter().enumerate().filter(|(other, _)| *other != index);
                    let mut taken = Operand::Const(0);
                    for other in others.filter_map(|(_, (condition, _))| *condition) {
                        taken = self.binary(Binary::Or, taken, other);
                    }
                    self.unary(Unary::Not, taken)
                }
            };
            self.switch_case(frame, condition, body)?;
        }
        self.used(frame, selector);
        self.exit(outer);
        Ok(())
    }

    pub(super) fn switch_case(&mut self, frame: &mut Inlined<'a>, condition: Operand, body: &'a Block) -> Result<()> {
        let Operand::Lane(register) = condition else {
            let skip = self.jump(Op::JumpIfFalse { condition, to: 0 });
            self.block(frame, body)?;
            let end = self.ops.len();
            self.patch(skip, end);
            return Ok(());
        };
        let outer = self.mask;
        let mask = self.registers.allocate();
        let all = outer.map_or(Operand::Const(u32::MAX), Operand::Lane);
        self.emit(Op::Binary { op: Binary::And, to: Operand::Lane(mask), a: all, b: Operand::Lane(register) });
        // Invocations that leave inside the case must not come back after it.
        let entered = self.copy_mask(Some(mask));
        self.mask = Some(mask);
        self.depth += 1;
        let skip = self.jump(Op::JumpIfNone { mask, to: 0 });
        self.block(frame, body)?;
        let end = self.ops.len();
        self.patch(skip, end);
        if let Some(outer) = outer.map(Operand::Lane) {
            let [mask, entered] = [mask, entered].map(Operand::Lane);
            self.emit(Op::Binary { op: Binary::AndNot, to: outer, a: outer, b: entered });
            self.emit(Op::Binary { op: Binary::Or, to: outer, a: outer, b: mask });
        }
        self.registers.release(mask);
        self.registers.release(entered);
        self.mask = outer;
        self.depth -= 1;
        Ok(())
    }
}
