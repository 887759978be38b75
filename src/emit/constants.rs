//! Constants that are loaded once, for drivers that load each anew for every lane, wherever it is used.

use naga::{AddressSpace, Arena, Block, Expression, Function, GlobalVariable, Handle, Module, Range, Span, Statement};

use crate::kernel::Kernel;

impl Kernel {
    /// The kernel for drivers that take SPIR-V: its entry point begins with a copy of the constant buffer into a private
    /// variable, which everything reads.
    ///
    /// From the buffer Mesa's lavapipe loads a scalar eight times, once a lane, wherever it is used inside of branches and
    /// loops: 6 % of all instructions of the preset `fast`. RADV makes the same of both, or up to 3 % less of the copy.
    pub fn module_for_spirv(&self) -> Module {
        let mut module = self.module.clone();
        let buffers = module.global_variables.iter().filter(|(_, variable)| variable.space == AddressSpace::Uniform);
        let buffers: Vec<_> = buffers.map(|(handle, variable)| (handle, variable.clone())).collect();
        for (buffer, variable) in buffers {
            let copy = GlobalVariable {
                name: variable.name.map(|name| format!("{name}_copy")),
                space: AddressSpace::Private,
                binding: None,
                ..variable
            };
            let copy = module.global_variables.append(copy, Span::UNDEFINED);
            module.functions.iter_mut().for_each(|(_, function)| redirect(&mut function.expressions, buffer, copy));
            for entry_point in &mut module.entry_points {
                redirect(&mut entry_point.function.expressions, buffer, copy);
                copy_first(&mut entry_point.function, buffer, copy);
            }
        }
        module
    }
}

fn redirect(expressions: &mut Arena<Expression>, from: Handle<GlobalVariable>, to: Handle<GlobalVariable>) {
    for (_, expression) in expressions.iter_mut() {
        if let Expression::GlobalVariable(variable) = expression
            && *variable == from
        {
            *variable = to;
        }
    }
}

fn copy_first(function: &mut Function, from: Handle<GlobalVariable>, to: Handle<GlobalVariable>) {
    let mut append = |expression| function.expressions.append(expression, Span::UNDEFINED);
    let pointer = append(Expression::GlobalVariable(to));
    let buffer = append(Expression::GlobalVariable(from));
    let value = append(Expression::Load { pointer: buffer });
    let body = std::mem::take(&mut function.body);
    function.body = Block::from_vec(vec![
        Statement::Emit(Range::new_from_bounds(value, value)),
        Statement::Store { pointer, value },
    ]);
    function.body.extend_block(body);
}
