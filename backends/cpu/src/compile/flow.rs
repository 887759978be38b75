//! Statements: control flow by jumps where it is uniform, by masks where it is not.

use naga::{Barrier, Block, Expression, Handle, Statement};

use super::{Compiler, Inlined, Result, Value, unsupported};
use crate::op::{Binary, Op, Operand, Unary};

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

impl<'a> Compiler<'a> {
    /// A register of its own with the invocations of a mask.
    pub(super) fn copy_mask(&mut self, mask: Option<u32>) -> u32 {
        let register = self.registers.allocate();
        let a = mask.map_or(Operand::Const(u32::MAX), Operand::Lane);
        self.emit(Op::Unary { op: Unary::Copy, to: Operand::Lane(register), a });
        register
    }

    /// Gives up the current mask unless it is `kept`.
    pub(super) fn release_mask(&mut self, kept: Option<u32>) {
        if let Some(register) = self.mask.filter(|_| self.mask != kept) {
            self.registers.release(register);
        }
    }

    pub(super) fn jump(&mut self, op: Op) -> usize {
        self.emit(op);
        self.ops.len() - 1
    }

    pub(super) fn patch(&mut self, jump: usize, target: usize) {
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

    pub(super) fn statement(
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
            // Orders no memory that others share.
            Statement::ControlBarrier(Barrier::SUB_GROUP) => Ok(()),
            Statement::ControlBarrier(barrier) => {
                self.barrier(barrier.contains(Barrier::WORK_GROUP));
                Ok(())
            }
            Statement::SubgroupBallot { result, predicate } => {
                let operands = self.ballot(frame, *predicate)?;
                self.define(frame, *result, Value::Data(operands));
                defined.push(*result);
                Ok(())
            }
            Statement::SubgroupCollectiveOperation { op, collective_op, argument, result } => {
                let operands = self.collective(frame, *op, *collective_op, *argument)?;
                self.define(frame, *result, Value::Data(operands));
                defined.push(*result);
                Ok(())
            }
            Statement::SubgroupGather { mode, argument, result } => {
                let operands = self.gather(frame, *mode, *argument)?;
                self.define(frame, *result, Value::Data(operands));
                defined.push(*result);
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
                let texture = self.resource(frame, *image)?;
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
                let operands = self.atomic(frame, *pointer, *fun, *value, result.is_some())?;
                if let Some(handle) = result {
                    self.define(frame, *handle, Value::Data(operands));
                    defined.push(*handle);
                }
                Ok(())
            }
            Statement::WorkGroupUniformLoad { pointer, result } => {
                let place = self.place(frame, *pointer)?;
                self.barrier(true);
                let operands = self.load(&place)?;
                self.barrier(true);
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

    fn barrier(&mut self, orders_workgroup: bool) {
        self.emit(Op::Barrier { mask: self.mask, orders_workgroup });
    }

    pub(super) fn if_statement(
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
}
