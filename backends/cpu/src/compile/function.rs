//! Entry points and functions, which are inlined.

use std::collections::HashMap;

use naga::valid::FunctionInfo;
use naga::{Block, Expression, Function, Handle, Statement, TypeInner};

use super::{Compiler, Inlined, Result, Value, unsupported};
use crate::op::{Binary, BuiltIn, Op, Operand, Unary};

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
            // One value, or a struct of them.
            let bindings = match (&argument.binding, &self.module.types[argument.ty].inner) {
                (None, TypeInner::Struct { members, .. }) => members.iter().map(|member| &member.binding).collect(),
                (binding, _) => vec![binding],
            };
            let mut operands = Vec::new();
            for binding in bindings {
                let Some(naga::Binding::BuiltIn(builtin)) = binding else {
                    return unsupported("entry point arguments that are no built-in values");
                };
                operands.extend(self.argument(*builtin)?);
            }
            arguments.push(Value::Data(operands));
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
            naga::BuiltIn::SubgroupSize => vec![self.builtin(BuiltIn::SubgroupSize)],
            naga::BuiltIn::NumSubgroups => vec![self.builtin(BuiltIn::SubgroupCount)],
            naga::BuiltIn::SubgroupId => vec![self.builtin(BuiltIn::SubgroupId)],
            naga::BuiltIn::SubgroupInvocationId => vec![self.builtin(BuiltIn::SubgroupLane)],
            other => return unsupported(format!("built-in value {other:?}")),
        })
    }

    fn builtin(&mut self, value: BuiltIn) -> Operand {
        let to = match value {
            BuiltIn::WorkgroupId(_) | BuiltIn::WorkgroupCount(_) | BuiltIn::SubgroupSize | BuiltIn::SubgroupCount => {
                self.scalar()
            }
            _ => Operand::Lane(self.registers.allocate()),
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
            remaining_uses: super::uses::count_uses(function),
            defined_in_loop: vec![0; function.expressions.len()],
            wanted_components: super::uses::wanted_components(function),
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
            self.span = function.local_variables.get_span(handle);
            let count = self.count(&self.module.types[local.ty].inner.clone())?;
            frame.locals.insert(handle, self.declare(count));
        }
        // Variables without an initial value are zero, also when the function is called again.
        for (handle, local) in function.local_variables.iter() {
            self.span = function.local_variables.get_span(handle);
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

    pub(super) fn return_statement(
        &mut self,
        frame: &mut Inlined<'a>,
        value: Option<Handle<Expression>>,
    ) -> Result<()> {
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
}
