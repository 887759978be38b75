//! Statements: control flow by jumps where it is uniform, by masks where it is not.

use std::collections::HashMap;

use naga::valid::FunctionInfo;
use naga::{Block, Expression, Function, Handle, Statement, SwitchValue};

use super::{Compiler, Inlined, LoopContext, Result, Value, unsupported};
use crate::op::{Binary, BuiltIn, Op, Operand, Unary};

/// Whether control can leave a block other than at its end.
fn escapes(block: &Block, in_loop: bool) -> bool {
    block.iter().any(|statement| match statement {
        Statement::Return { .. } => true,
        Statement::Break | Statement::Continue => !in_loop,
        Statement::Block(inner) => escapes(inner, in_loop),
        Statement::If { accept, reject, .. } => escapes(accept, in_loop) || escapes(reject, in_loop),
        Statement::Loop { body, continuing, .. } => escapes(body, true) || escapes(continuing, true),
        Statement::Switch { cases, .. } => cases.iter().any(|case| escapes(&case.body, in_loop)),
        _ => false,
    })
}

/// Number of `return` statements.
fn count_returns(block: &Block) -> usize {
    let count = |statement: &Statement| match statement {
        Statement::Return { .. } => 1,
        Statement::Block(inner) => count_returns(inner),
        Statement::If { accept, reject, .. } => count_returns(accept) + count_returns(reject),
        Statement::Loop { body, continuing, .. } => count_returns(body) + count_returns(continuing),
        Statement::Switch { cases, .. } => cases.iter().map(|case| count_returns(&case.body)).sum(),
        _ => 0,
    };
    block.iter().map(count).sum()
}

impl<'a> Compiler<'a> {
    pub(super) fn entry_point(&mut self, entry: &'a naga::EntryPoint, info: &'a FunctionInfo) -> Result<()> {
        let invocations: u32 = entry.workgroup_size.iter().product();
        if !invocations.is_multiple_of(crate::LANES as u32) {
            // The last invocations of the last row of lanes do not exist.
            let index = self.builtin(BuiltIn::LocalIndex);
            self.mask = match self.fold(Binary::LtU, index, Operand::Const(invocations)) {
                Operand::Lane(register) => Some(register),
                _ => None,
            };
        }
        let mut arguments = Vec::new();
        for argument in &entry.function.arguments {
            let Some(naga::Binding::BuiltIn(builtin)) = &argument.binding else {
                return unsupported("entry point arguments that are no built-in values");
            };
            arguments.push(Value::Data(self.argument(*builtin)?));
        }
        self.inline(&entry.function, info, arguments)?;
        Ok(())
    }

    fn argument(&mut self, builtin: naga::BuiltIn) -> Result<Vec<Operand>> {
        let mut vector = |of: fn(u8) -> BuiltIn| (0..3).map(|axis| self.builtin(of(axis))).collect();
        Ok(match builtin {
            naga::BuiltIn::LocalInvocationId => vector(BuiltIn::LocalId),
            naga::BuiltIn::GlobalInvocationId => vector(BuiltIn::GlobalId),
            naga::BuiltIn::WorkGroupId => vector(BuiltIn::WorkgroupId),
            naga::BuiltIn::NumWorkGroups => vector(BuiltIn::WorkgroupCount),
            naga::BuiltIn::LocalInvocationIndex => vec![self.builtin(BuiltIn::LocalIndex)],
            other => return unsupported(format!("built-in value {other:?}")),
        })
    }

    fn builtin(&mut self, value: BuiltIn) -> Operand {
        let to = match value {
            BuiltIn::WorkgroupId(_) | BuiltIn::WorkgroupCount(_) => self.scalar(),
            BuiltIn::LocalId(_) | BuiltIn::GlobalId(_) | BuiltIn::LocalIndex => {
                Operand::Lane(self.registers.allocate())
            }
        };
        self.emit(Op::BuiltIn { to, value });
        to
    }

    /// The code of a function, with its arguments in place; its result.
    pub(super) fn inline(
        &mut self,
        function: &'a Function,
        info: &'a FunctionInfo,
        arguments: Vec<Value>,
    ) -> Result<Option<Vec<Operand>>> {
        let flow = self.next_flow;
        self.next_flow += 1;
        let divergent = self.facts.divergent_flows.contains(&flow);
        let single_return =
            count_returns(&function.body) == 1 && matches!(function.body.last(), Some(Statement::Return { .. }));
        let mut frame = Inlined {
            function,
            info,
            arguments,
            values: vec![None; function.expressions.len()],
            remaining_uses: super::expression::count_uses(function),
            defined_in_loop: vec![0; function.expressions.len()],
            wanted_components: super::expression::wanted_components(function),
            locals: HashMap::new(),
            flow,
            divergent,
            entry_depth: 0,
            result: None,
            direct_result: None,
            single_return,
            end_jumps: Vec::new(),
        };
        let entry_mask = self.mask;
        if divergent {
            self.mask = Some(self.copy_mask(entry_mask));
            self.depth += 1;
        }
        frame.entry_depth = self.depth;
        if let (Some(result), false) = (&function.result, single_return) {
            let count = self.count(&self.module.types[result.ty].inner.clone())?;
            frame.result = Some(self.declare(count));
        }
        let outer_loops = std::mem::take(&mut self.loops);
        for (handle, local) in function.local_variables.iter() {
            let count = self.count(&self.module.types[local.ty].inner.clone())?;
            frame.locals.insert(handle, self.declare(count));
        }
        // Variables without an initial value are zero, also when the function is called again.
        for (handle, local) in function.local_variables.iter() {
            let index = frame.locals[&handle];
            let operands = match local.init {
                Some(init) => self.data(&mut frame, init)?,
                None => vec![Operand::Const(0); self.variables[index].count as usize],
            };
            self.initialize(index, &operands);
        }
        self.block(&mut frame, &function.body)?;
        let end = self.ops.len();
        for jump in std::mem::take(&mut frame.end_jumps) {
            self.patch(jump, end);
        }
        self.loops = outer_loops;
        if divergent {
            self.release_mask(entry_mask);
            self.mask = entry_mask;
            self.depth -= 1;
        }
        let result = match (frame.direct_result.take(), frame.result) {
            (Some(operands), _) => Some(operands),
            (None, Some(index)) => {
                let count = self.variables[index].count;
                let operands: Vec<_> = (0..count).map(|scalar| self.variable_operand(index, scalar)).collect();
                Some(operands.into_iter().map(|operand| self.unary(Unary::Copy, operand)).collect())
            }
            (None, None) => None,
        };
        let locals: Vec<usize> = frame.locals.values().copied().chain(frame.result).collect();
        for index in locals {
            for scalar in 0..self.variables[index].count {
                let operand = self.variable_operand(index, scalar);
                self.release(&[operand]);
            }
        }
        for argument in std::mem::take(&mut frame.arguments) {
            self.drop_value(argument);
        }
        Ok(result)
    }

    /// A register of its own with the invocations of a mask.
    fn copy_mask(&mut self, mask: Option<u32>) -> u32 {
        let register = self.registers.allocate();
        let a = mask.map_or(Operand::Const(u32::MAX), Operand::Lane);
        self.emit(Op::Unary { op: Unary::Copy, to: Operand::Lane(register), a });
        register
    }

    /// Gives up the current mask unless it is `kept`.
    fn release_mask(&mut self, kept: Option<u32>) {
        if let Some(register) = self.mask.filter(|_| self.mask != kept) {
            self.registers.release(register);
        }
    }

    fn jump(&mut self, op: Op) -> usize {
        self.emit(op);
        self.ops.len() - 1
    }

    fn patch(&mut self, jump: usize, target: usize) {
        match &mut self.ops[jump] {
            Op::Jump { to } | Op::JumpIfFalse { to, .. } | Op::JumpIfNone { to, .. } | Op::JumpIfAny { to, .. } => {
                *to = target;
            }
            _ => {}
        }
    }

    pub(super) fn block(&mut self, frame: &mut Inlined<'a>, block: &'a Block) -> Result<()> {
        let mut defined = Vec::new();
        let mut leaves = Vec::new();
        for (statement, span) in block.span_iter() {
            self.span = *span;
            self.statement(frame, statement, &mut defined)?;
            // Once every invocation has left, the rest of the block has nothing to do.
            let may_leave = match statement {
                Statement::If { accept, reject, .. } => escapes(accept, false) || escapes(reject, false),
                Statement::Loop { body, .. } => escapes(body, true),
                _ => false,
            };
            if let (true, Some(mask)) = (may_leave && self.depth > 0, self.mask) {
                leaves.push(self.jump(Op::JumpIfNone { mask, to: 0 }));
            }
        }
        let end = self.ops.len();
        for jump in leaves {
            self.patch(jump, end);
        }
        for handle in defined {
            self.forget(frame, handle);
        }
        Ok(())
    }

    fn statement(
        &mut self,
        frame: &mut Inlined<'a>,
        statement: &'a Statement,
        defined: &mut Vec<Handle<Expression>>,
    ) -> Result<()> {
        match statement {
            Statement::Emit(range) => {
                for handle in range.clone() {
                    self.emit_expression(frame, handle, range)?;
                    defined.push(handle);
                }
                Ok(())
            }
            Statement::Block(inner) => self.block(frame, inner),
            Statement::If { condition, accept, reject } => self.if_statement(frame, *condition, accept, reject),
            Statement::Switch { selector, cases } => self.switch(frame, *selector, cases),
            Statement::Loop { body, continuing, break_if } => self.loop_statement(frame, body, continuing, *break_if),
            Statement::Break => self.leave_loop(frame, true),
            Statement::Continue => self.leave_loop(frame, false),
            Statement::Return { value } => self.return_statement(frame, *value),
            Statement::ControlBarrier(_) => {
                self.emit(Op::Barrier { mask: self.mask });
                Ok(())
            }
            Statement::MemoryBarrier(_) => Ok(()),
            Statement::Store { pointer, value } => {
                let place = self.place(frame, *pointer)?;
                let operands = self.data(frame, *value)?;
                self.store(&place, &operands)?;
                self.used(frame, *value);
                Ok(())
            }
            Statement::ImageStore { image, coordinate, array_index: None, value } => {
                let texture = self.texture(frame, *image)?;
                let at = self.data(frame, *coordinate)?;
                let texel = self.data(frame, *value)?;
                let component = |i: usize| texel.get(i).copied().unwrap_or(Operand::Const(0));
                let y = at.get(1).copied().unwrap_or(Operand::Const(0));
                let texel = [0, 1, 2, 3].map(component);
                self.emit(Op::TextureStore { texture, x: at[0], y, texel, mask: self.mask });
                self.used(frame, *coordinate);
                self.used(frame, *value);
                Ok(())
            }
            Statement::Atomic { pointer, fun, value, result } => {
                let operand = self.atomic(frame, *pointer, *fun, *value, result.is_some())?;
                if let (Some(handle), Some(operand)) = (result, operand) {
                    self.define(frame, *handle, Value::Data(vec![operand]));
                    defined.push(*handle);
                }
                Ok(())
            }
            Statement::WorkGroupUniformLoad { pointer, result } => {
                let place = self.place(frame, *pointer)?;
                let operands = self.load(&place)?;
                self.define(frame, *result, Value::Data(operands));
                defined.push(*result);
                Ok(())
            }
            Statement::Call { function, arguments, result } => {
                let mut values = Vec::new();
                for argument in arguments {
                    values.push(self.argument_value(frame, *argument)?);
                }
                let returned = self.inline(&self.module.functions[*function], &self.info[*function], values)?;
                for argument in arguments {
                    self.used(frame, *argument);
                }
                match (result, returned) {
                    (Some(handle), Some(operands)) => {
                        self.define(frame, *handle, Value::Data(operands));
                        defined.push(*handle);
                    }
                    (_, operands) => self.release(&operands.unwrap_or_default()),
                }
                Ok(())
            }
            other => unsupported(format!("statement {other:?}")),
        }
    }

    fn if_statement(
        &mut self,
        frame: &mut Inlined<'a>,
        condition: Handle<Expression>,
        accept: &'a Block,
        reject: &'a Block,
    ) -> Result<()> {
        let operand = self.data(frame, condition)?[0];
        let Operand::Lane(condition_register) = operand else {
            let skip = self.jump(Op::JumpIfFalse { condition: operand, to: 0 });
            self.used(frame, condition);
            self.block(frame, accept)?;
            if reject.is_empty() {
                let end = self.ops.len();
                self.patch(skip, end);
            } else {
                let done = self.jump(Op::Jump { to: 0 });
                let otherwise = self.ops.len();
                self.patch(skip, otherwise);
                self.block(frame, reject)?;
                let end = self.ops.len();
                self.patch(done, end);
            }
            return Ok(());
        };
        let outer = self.mask;
        let merges = escapes(accept, false) || escapes(reject, false);
        self.depth += 1;
        let all = outer.map_or(Operand::Const(u32::MAX), Operand::Lane);
        let mut masks = Vec::new();
        // Both masks before either side runs: it may change what the condition was read from.
        for (op, wanted) in [(Binary::And, true), (Binary::AndNot, merges || !reject.is_empty())] {
            if wanted {
                let register = self.registers.allocate();
                let (to, b) = (Operand::Lane(register), Operand::Lane(condition_register));
                self.emit(Op::Binary { op, to, a: all, b });
                masks.push(register);
            }
        }
        self.used(frame, condition);
        for (&mask, block) in masks.iter().zip([accept, reject]) {
            self.mask = Some(mask);
            if !block.is_empty() {
                let skip = self.jump(Op::JumpIfNone { mask, to: 0 });
                self.block(frame, block)?;
                let end = self.ops.len();
                self.patch(skip, end);
            }
        }
        if let (true, Some(register)) = (merges, outer) {
            let [a, b] = [0, 1].map(|i| Operand::Lane(masks[i]));
            self.emit(Op::Binary { op: Binary::Or, to: Operand::Lane(register), a, b });
        }
        for mask in masks {
            self.registers.release(mask);
        }
        self.mask = outer;
        self.depth -= 1;
        Ok(())
    }

    /// Opens a loop or switch; its body runs under a mask of its own if invocations leave it at different times.
    fn enter(&mut self, is_switch: bool) -> Option<u32> {
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
    fn exit(&mut self, outer: Option<u32>) {
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

    fn loop_statement(
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
        for statement in continuing {
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
    fn break_if(&mut self, condition: Operand) {
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

    fn leave_loop(&mut self, frame: &Inlined<'a>, is_break: bool) -> Result<()> {
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

    fn clear_mask(&mut self) {
        if let Some(mask) = self.mask {
            self.emit(Op::Unary { op: Unary::Copy, to: Operand::Lane(mask), a: Operand::Const(0) });
        }
    }

    fn return_statement(&mut self, frame: &mut Inlined<'a>, value: Option<Handle<Expression>>) -> Result<()> {
        if let Some(handle) = value {
            let operands = self.data(frame, handle)?;
            match frame.result {
                None => {
                    self.retain(&operands);
                    frame.direct_result = Some(operands);
                }
                Some(result) => {
                    for (scalar, operand) in operands.into_iter().enumerate() {
                        self.assign(result, scalar as u32, operand);
                    }
                }
            }
            self.used(frame, handle);
        }
        if frame.single_return {
            return Ok(());
        }
        if frame.divergent {
            self.clear_mask();
        } else if self.depth > frame.entry_depth {
            self.facts.divergent_flows.insert(frame.flow);
        } else {
            let jump = self.jump(Op::Jump { to: 0 });
            frame.end_jumps.push(jump);
        }
        Ok(())
    }

    /// A chain of comparisons; values that share a body are gathered first.
    fn switch(
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

    fn switch_case(&mut self, frame: &mut Inlined<'a>, condition: Operand, body: &'a Block) -> Result<()> {
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
