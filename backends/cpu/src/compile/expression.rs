//! Expressions: values as registers, one a scalar.

use naga::{Expression, Handle, RelationalFunction, ScalarKind, TypeInner, UnaryOperator};

use super::uses::operands;
use super::{Compiler, Inlined, Result, Root, Value, unsupported};
use crate::layout::{element_count, is_supported, part, scalar_count};
use crate::op::{Binary, Op, Operand, Unary};

impl<'a> Compiler<'a> {
    pub(super) fn inner(&self, frame: &Inlined<'a>, handle: Handle<Expression>) -> TypeInner {
        frame.info[handle].ty.inner_with(&self.module.types).clone()
    }

    /// Kind of scalar that a value is made of.
    pub(super) fn kind(&self, frame: &Inlined<'a>, handle: Handle<Expression>) -> Result<ScalarKind> {
        match self.inner(frame, handle).scalar() {
            Some(scalar) if is_supported(scalar) => Ok(scalar.kind),
            Some(scalar) => unsupported(super::number_name(scalar)),
            None => unsupported("arithmetic on what is no number"),
        }
    }

    pub(super) fn define(&mut self, frame: &mut Inlined<'a>, handle: Handle<Expression>, value: Value) {
        frame.defined_in_loop[handle.index()] = self.loop_depth;
        frame.values[handle.index()] = Some(value);
    }

    pub(super) fn drop_value(&mut self, value: Value) {
        if let Value::Data(operands) = value {
            self.release(&operands);
        }
    }

    /// Gives up the value of an expression.
    pub(super) fn forget(&mut self, frame: &mut Inlined<'a>, handle: Handle<Expression>) {
        if let Some(value) = frame.values[handle.index()].take() {
            self.drop_value(value);
        }
    }

    /// Notes that a value was used; after its last use its registers are free. Not inside a loop that it was
    /// not made in, which may come round again.
    pub(super) fn used(&mut self, frame: &mut Inlined<'a>, handle: Handle<Expression>) {
        let remaining = &mut frame.remaining_uses[handle.index()];
        *remaining = remaining.saturating_sub(1);
        let is_data = matches!(frame.values[handle.index()], Some(Value::Data(_)));
        if *remaining == 0 && is_data && frame.defined_in_loop[handle.index()] == self.loop_depth {
            self.forget(frame, handle);
        }
    }

    /// The registers of a value. They stay the expression's.
    pub(super) fn data(&mut self, frame: &mut Inlined<'a>, handle: Handle<Expression>) -> Result<Vec<Operand>> {
        if let Some(Value::Data(operands)) = &frame.values[handle.index()] {
            return Ok(operands.clone());
        }
        let constants = |bits: Vec<u32>| bits.into_iter().map(Operand::Const).collect();
        match &frame.function.expressions[handle] {
            Expression::Literal(literal) => Ok(vec![Operand::Const(super::globals::literal_bits(*literal)?)]),
            Expression::Constant(constant) => self.constant(self.module.constants[*constant].init).map(constants),
            Expression::ZeroValue(ty) => {
                let count = self.count(&self.module.types[*ty].inner.clone())?;
                Ok(vec![Operand::Const(0); count as usize])
            }
            Expression::FunctionArgument(index) => match &frame.arguments[*index as usize] {
                Value::Data(operands) => Ok(operands.clone()),
                _ => unsupported("a pointer or texture as a value"),
            },
            // Not part of any range: made of constants.
            Expression::Compose { components, .. } => {
                let mut all = Vec::new();
                for &component in components {
                    all.extend(self.data(frame, component)?);
                }
                Ok(all)
            }
            Expression::Splat { size, value } => {
                let value = self.data(frame, *value)?;
                Ok(vec![value[0]; *size as usize])
            }
            other => unsupported(format!("the value of {other:?}")),
        }
    }

    /// What a function call passes on: registers with a reference of their own, or a place.
    pub(super) fn argument_value(&mut self, frame: &mut Inlined<'a>, handle: Handle<Expression>) -> Result<Value> {
        match self.inner(frame, handle) {
            TypeInner::Pointer { .. } | TypeInner::ValuePointer { .. } => Ok(Value::Place(self.place(frame, handle)?)),
            TypeInner::Image { .. } | TypeInner::Sampler { .. } => Ok(Value::Resource(self.resource(frame, handle)?)),
            _ => {
                let operands = self.data(frame, handle)?;
                self.retain(&operands);
                Ok(Value::Data(operands))
            }
        }
    }

    pub(super) fn emit_expression(
        &mut self,
        frame: &mut Inlined<'a>,
        handle: Handle<Expression>,
        range: &naga::Range<Expression>,
    ) -> Result<()> {
        let expression = &frame.function.expressions[handle];
        self.span = frame.function.expressions.get_span(handle);
        let is_pointer =
            matches!(self.inner(frame, handle), TypeInner::Pointer { .. } | TypeInner::ValuePointer { .. });
        if is_pointer {
            // The registers of dynamic indices live until the end of the block.
            let place = self.place(frame, handle)?;
            self.define(frame, handle, Value::Place(place));
            return Ok(());
        }
        let operands_of = self.evaluate(frame, handle, expression, range)?;
        self.define(frame, handle, Value::Data(operands_of));
        let mut uses = Vec::new();
        operands(expression, |operand| uses.push(operand));
        for operand in uses {
            self.used(frame, operand);
        }
        Ok(())
    }

    /// New references to the registers of a value.
    fn evaluate(
        &mut self,
        frame: &mut Inlined<'a>,
        handle: Handle<Expression>,
        expression: &Expression,
        range: &naga::Range<Expression>,
    ) -> Result<Vec<Operand>> {
        match expression {
            Expression::Compose { components, .. } => {
                let mut all = Vec::new();
                for &component in components {
                    all.extend(self.data(frame, component)?);
                }
                self.retain(&all);
                Ok(all)
            }
            Expression::Splat { size, value } => {
                let value = self.data(frame, *value)?[0];
                let all = vec![value; *size as usize];
                self.retain(&all);
                Ok(all)
            }
            Expression::Swizzle { size, vector, pattern } => {
                let vector = self.data(frame, *vector)?;
                let all: Vec<_> =
                    pattern[..*size as usize].iter().map(|component| vector[*component as usize]).collect();
                self.retain(&all);
                Ok(all)
            }
            Expression::AccessIndex { base, index } => {
                let inner = self.inner(frame, *base);
                let values = self.data(frame, *base)?;
                let Some(part) = part(self.module, &inner, *index) else {
                    return unsupported(format!("a part of {inner:?}"));
                };
                let count = self.count(&part.inner)?;
                let all = values[part.scalars as usize..(part.scalars + count) as usize].to_vec();
                self.retain(&all);
                Ok(all)
            }
            Expression::Access { base, index } => self.access(frame, *base, *index),
            Expression::Load { pointer } => {
                let place = self.place(frame, *pointer)?;
                if let (Root::Variable(index), true) = (&place.root, place.dynamic.is_empty()) {
                    let count = self.count(&place.inner)?;
                    let all: Vec<_> =
                        (0..count).map(|scalar| self.variable_operand(*index, place.offset + scalar)).collect();
                    // What is stored later must not be seen: share registers only with what is computed before
                    // the next statement.
                    if self.used_only_in(frame, handle, range) {
                        self.retain(&all);
                        return Ok(all);
                    }
                    return Ok(all.into_iter().map(|operand| self.unary(Unary::Copy, operand)).collect());
                }
                self.load(&place)
            }
            Expression::ImageLoad { .. } => self.image_load(frame, handle),
            Expression::ImageSample { .. } => self.image_sample(frame, handle),
            Expression::ImageQuery { image, query } => self.image_query(frame, *image, *query),
            Expression::Unary { op, expr } => {
                let kind = self.kind(frame, *expr)?;
                let op = match (op, kind) {
                    (UnaryOperator::Negate, ScalarKind::Float) => Unary::NegF,
                    (UnaryOperator::Negate, _) => Unary::NegI,
                    (UnaryOperator::LogicalNot | UnaryOperator::BitwiseNot, _) => Unary::Not,
                };
                let values = self.data(frame, *expr)?;
                Ok(values.into_iter().map(|value| self.unary(op, value)).collect())
            }
            Expression::Binary { op, left, right } => {
                let values = self.binary_expression(frame, *op, *left, *right)?;
                Ok(self.rounded(frame, handle, values))
            }
            Expression::Select { condition, accept, reject } => {
                let condition = self.data(frame, *condition)?;
                let accept = self.data(frame, *accept)?;
                let reject = self.data(frame, *reject)?;
                let chosen = accept.into_iter().zip(reject).enumerate();
                Ok(chosen.map(|(i, (a, b))| self.select(condition[i.min(condition.len() - 1)], a, b)).collect())
            }
            Expression::Relational { fun, argument } => {
                let values = self.data(frame, *argument)?;
                match fun {
                    RelationalFunction::All => Ok(vec![self.reduce(Binary::And, &values)]),
                    RelationalFunction::Any => Ok(vec![self.reduce(Binary::Or, &values)]),
                    RelationalFunction::IsNan => Ok(values.into_iter().map(|v| self.unary(Unary::IsNan, v)).collect()),
                    RelationalFunction::IsInf => Ok(values.into_iter().map(|v| self.unary(Unary::IsInf, v)).collect()),
                }
            }
            Expression::Math { fun, arg, arg1, arg2, arg3 } => {
                let kind = self.kind(frame, *arg)?;
                let inner = self.inner(frame, *arg);
                let mut arguments = Vec::new();
                for handle in [Some(*arg), *arg1, *arg2, *arg3].into_iter().flatten() {
                    arguments.push(self.data(frame, handle)?);
                }
                let values = self.math(*fun, kind, &inner, &arguments)?;
                Ok(self.rounded(frame, handle, values))
            }
            Expression::As { expr, kind, convert } => {
                let values = self.data(frame, *expr)?;
                let from = self.kind(frame, *expr)?;
                self.kind(frame, handle)?;
                let op = match (from, kind, convert) {
                    (_, _, None) => Unary::Copy,
                    (ScalarKind::Sint, ScalarKind::Float, _) => Unary::IntToFloat,
                    (ScalarKind::Uint, ScalarKind::Float, _) => Unary::UintToFloat,
                    (ScalarKind::Float, ScalarKind::Sint, _) => Unary::FloatToInt,
                    (ScalarKind::Float, ScalarKind::Uint, _) => Unary::FloatToUint,
                    (ScalarKind::Bool, ScalarKind::Float, _) => Unary::BoolToFloat,
                    (ScalarKind::Bool, ScalarKind::Sint | ScalarKind::Uint, _) => Unary::BoolToInt,
                    (ScalarKind::Float, ScalarKind::Bool, _) => Unary::FloatToBool,
                    (ScalarKind::Sint | ScalarKind::Uint, ScalarKind::Bool, _) => Unary::IntToBool,
                    _ => Unary::Copy,
                };
                if op == Unary::Copy {
                    self.retain(&values);
                    return Ok(self.rounded(frame, handle, values));
                }
                let values = values.into_iter().map(|value| self.unary(op, value)).collect();
                Ok(self.rounded(frame, handle, values))
            }
            Expression::ArrayLength(pointer) => self.array_length(frame, *pointer),
            other => unsupported(format!("expression {other:?}")),
        }
    }

    /// What arithmetic in single precision gave, rounded if it is to be half floats. Takes over the references.
    fn rounded(&mut self, frame: &Inlined<'a>, handle: Handle<Expression>, values: Vec<Operand>) -> Vec<Operand> {
        if self.inner(frame, handle).scalar() != Some(naga::Scalar::F16) {
            return values;
        }
        let round = |value| {
            let rounded = self.unary(Unary::QuantizeToF16, value);
            self.release(&[value]);
            rounded
        };
        values.into_iter().map(round).collect()
    }

    pub(super) fn reduce(&mut self, op: Binary, values: &[Operand]) -> Operand {
        let mut result = values[0];
        self.retain(&[result]);
        for &value in &values[1..] {
            let next = self.binary(op, result, value);
            self.release(&[result]);
            result = next;
        }
        result
    }

    /// Whether all uses of a value are in the range of expressions that it is part of.
    fn used_only_in(&self, frame: &Inlined<'a>, handle: Handle<Expression>, range: &naga::Range<Expression>) -> bool {
        let mut uses = 0;
        for other in range.clone() {
            operands(&frame.function.expressions[other], |operand| uses += u32::from(operand == handle));
        }
        // What only passes registers on is no use that ends here.
        let passed_on = range.clone().any(|other| {
            let expression = &frame.function.expressions[other];
            let passes = matches!(
                expression,
                // A pointer keeps its index.
                Expression::Access { .. }
                    | Expression::Compose { .. }
                    | Expression::Splat { .. }
                    | Expression::Swizzle { .. }
                    | Expression::AccessIndex { .. }
                    | Expression::As { .. }
                    | Expression::Select { .. }
                    | Expression::Relational { .. }
                    | Expression::Math { .. }
            );
            let mut found = false;
            operands(expression, |operand| found |= operand == handle);
            passes && found
        });
        uses == frame.remaining_uses[handle.index()] && !passed_on
    }

    /// An element of a value by an index that is only known when running.
    fn access(
        &mut self,
        frame: &mut Inlined<'a>,
        base: Handle<Expression>,
        index: Handle<Expression>,
    ) -> Result<Vec<Operand>> {
        let inner = self.inner(frame, base);
        let values = self.data(frame, base)?;
        let index = self.data(frame, index)?[0];
        let (Some(elements), Some(element)) = (element_count(&inner), part(self.module, &inner, 0)) else {
            return unsupported(format!("an index into {inner:?}"));
        };
        let stride = scalar_count(self.module, &element.inner).unwrap_or(1);
        if let Operand::Const(index) = index {
            let first = (index.min(elements - 1) * stride) as usize;
            let all = values[first..first + stride as usize].to_vec();
            self.retain(&all);
            return Ok(all);
        }
        let constants: Option<Vec<u32>> =
            values.iter().map(|value| if let Operand::Const(bits) = value { Some(*bits) } else { None }).collect();
        if let Some(constants) = constants {
            let known = self.tables.iter().position(|table| *table == constants);
            let table = known.unwrap_or_else(|| {
                self.tables.push(constants);
                self.tables.len() - 1
            }) as u32;
            return Ok((0..stride)
                .map(|offset| {
                    let to = self.result(&[index]);
                    self.emit(Op::Table { to, table, stride, offset, index });
                    to
                })
                .collect());
        }
        // Side by side, to be indexed.
        let varying = values.iter().any(|value| matches!(value, Operand::Lane(_)));
        let count = values.len() as u32;
        let first = if varying {
            self.registers.allocate_block(count)
        } else {
            self.scalars += count;
            self.scalars - count
        };
        let register = |i: u32| if varying { Operand::Lane(first + i) } else { Operand::Scalar(first + i) };
        for (i, &a) in values.iter().enumerate() {
            self.emit(Op::Unary { op: Unary::Copy, to: register(i as u32), a });
        }
        let mut elements_read = Vec::new();
        for offset in 0..stride {
            let base = register(offset);
            let to = self.result(&[base, index]);
            self.emit(Op::ReadIndexed { to, base, stride, count: elements, index });
            elements_read.push(to);
        }
        for i in 0..count {
            self.release(&[register(i)]);
        }
        Ok(elements_read)
    }
}
