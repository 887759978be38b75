//! Expressions.

use naga::{Expression, Handle, ImageQuery, RelationalFunction, Type, TypeInner, UnaryOperator};

use super::language::{Binds, Operand, Text, call, is_integer, shape};
use super::{Scope, Writer, operators};

type Result<T> = std::result::Result<T, String>;

impl Writer<'_> {
    fn inner<'s>(&'s self, scope: &'s Scope, handle: Handle<Expression>) -> &'s TypeInner {
        scope.info[handle].ty.inner_with(&self.module.types)
    }

    fn operand<'s>(&'s self, scope: &'s Scope, handle: Handle<Expression>) -> Result<Operand<'s>> {
        Ok(Operand { text: self.expression(scope, handle)?, ty: self.inner(scope, handle) })
    }

    /// The text of an expression without what surrounds it.
    pub(super) fn text(&self, scope: &Scope, handle: Handle<Expression>) -> Result<String> {
        Ok(self.expression(scope, handle)?.text)
    }

    /// An expression: its name, if it has one.
    pub(super) fn expression(&self, scope: &Scope, handle: Handle<Expression>) -> Result<Text> {
        match scope.values.get(&handle) {
            Some(name) => Ok(Text::whole(name)),
            None => self.value(scope, handle),
        }
    }

    /// An expression that has no name yet.
    pub(super) fn value(&self, scope: &Scope, handle: Handle<Expression>) -> Result<Text> {
        if let Some(short) = scope.outline.short_circuits.get(&handle) {
            let (left, right) = (self.operand(scope, short.left)?, self.operand(scope, short.right)?);
            return Ok(operators::binary(self.language, short.operator, left, right));
        }
        if let Some(&value) = scope.outline.aliases.get(&handle) {
            return self.expression(scope, value);
        }
        if let Some((function, arguments)) = scope.outline.calls.get(&handle) {
            return self.call(scope, *function, arguments);
        }
        match scope.function.expressions[handle] {
            Expression::FunctionArgument(index) => Ok(Text::whole(&scope.arguments[index as usize])),
            Expression::GlobalVariable(global) => Ok(Text::whole(&self.globals[&global])),
            Expression::LocalVariable(local) => Ok(Text::whole(&scope.locals[&local])),
            Expression::Access { base, index } => {
                let index = self.text(scope, index)?;
                Ok(Text::whole(format!("{}[{index}]", self.place(scope, base)?)))
            }
            Expression::AccessIndex { base, index } => self.member(scope, base, index),
            Expression::Swizzle { size, vector, pattern } => {
                let letters =
                    pattern[..size as usize].iter().map(|component| ['x', 'y', 'z', 'w'][*component as usize]);
                Ok(Text::whole(format!("{}.{}", self.place(scope, vector)?, letters.collect::<String>())))
            }
            Expression::Load { pointer } => {
                let place = self.text(scope, pointer)?;
                let is_atomic = matches!(self.pointee(scope, pointer), Some(TypeInner::Atomic(_)));
                Ok(if is_atomic { self.language.atomic_load(&place) } else { Text::whole(place) })
            }
            Expression::ImageLoad { image, coordinate, array_index: None, sample: None, level: Some(level) } => {
                let coordinate = self.operand(scope, coordinate)?;
                let level = self.text(scope, level)?;
                Ok(self.language.image_load(&self.text(scope, image)?, &coordinate, &level))
            }
            Expression::ImageQuery { image, query } => self.image_query(scope, image, query),
            Expression::ImageSample { .. } => Err("samplers are not exported".to_owned()),
            Expression::Unary { op, expr } => self.unary(scope, op, expr),
            Expression::Binary { op, left, right } => self.binary(scope, op, left, right),
            Expression::Select { condition, accept, reject } => {
                let size = shape(self.inner(scope, condition)).map_or(1, |(_, size)| size);
                let [condition, accept, reject] = [condition, accept, reject].map(|h| self.expression(scope, h));
                let ty = scope.info[handle].ty.inner_with(&self.module.types);
                let ty = if size > 1 { self.inner_name(ty)? } else { String::new() };
                let (text, helper) = self.language.select(condition?, accept?, reject?, size, &ty);
                helper.map(|name| self.helper(name));
                Ok(text)
            }
            Expression::Relational { fun, argument } => {
                let argument = self.text(scope, argument)?;
                match fun {
                    RelationalFunction::All => Ok(call("all", &[&argument])),
                    RelationalFunction::Any => Ok(call("any", &[&argument])),
                    other => Err(format!("{other:?} has no text form")),
                }
            }
            Expression::Math { fun, arg, arg1, arg2, arg3 } => {
                let handles = [Some(arg), arg1, arg2, arg3].into_iter().flatten();
                let operands = handles.map(|handle| self.operand(scope, handle)).collect::<Result<Vec<_>>>()?;
                let written = self.language.math(fun, &operands);
                let of = if operands.iter().any(|operand| is_integer(operand.ty)) { " of integers" } else { "" };
                let (text, helper) = written.ok_or_else(|| format!("the function {fun:?}{of} has no text form"))?;
                helper.map(|name| self.helper(name));
                Ok(text)
            }
            Expression::As { expr, kind, convert } => {
                let value = self.operand(scope, expr)?;
                let ty = self.inner_name(self.inner(scope, handle))?;
                let cast = match convert {
                    Some(_) => Some(self.language.convert(&ty, &value.text)),
                    None => self.language.bitcast(kind, &ty, value.ty, &value.text),
                };
                cast.ok_or_else(|| format!("no bits of {:?} are read as {kind:?}", value.ty))
            }
            Expression::Splat { size, value } => {
                let ty = self.inner_name(self.inner(scope, handle))?;
                Ok(self.language.splat(&ty, size as u8, self.expression(scope, value)?))
            }
            ref other => self.constructed(other, &scope.function.expressions, &|handle| self.expression(scope, handle)),
        }
    }

    /// What constants may be made of too.
    fn constructed(
        &self,
        expression: &Expression,
        arena: &naga::Arena<Expression>,
        text: &dyn Fn(Handle<Expression>) -> Result<Text>,
    ) -> Result<Text> {
        match *expression {
            Expression::Literal(literal) => {
                let text = self.language.literal(literal)?;
                let binds = if text.starts_with('-') { Binds::Unary } else { Binds::Whole };
                Ok(Text { text, binds })
            }
            Expression::Constant(constant) => match self.constants.get(&constant) {
                Some(name) => {
                    self.used_constants.borrow_mut().insert(constant);
                    // What its value is made of is declared before it.
                    self.constant_value(self.module.constants[constant].init)?;
                    Ok(Text::whole(name))
                }
                None => Ok(Text::whole(self.constant_value(self.module.constants[constant].init)?)),
            },
            Expression::ZeroValue(ty) => self.zero(ty),
            Expression::Splat { size, value } => {
                let Expression::Literal(literal) = arena[value] else {
                    return Err("a constant vector is not made of a number".to_owned());
                };
                let ty = self.language.vector(size as u8, literal.scalar())?;
                Ok(self.language.splat(&ty, size as u8, text(value)?))
            }
            Expression::Compose { ty, ref components } => {
                let values = components.iter().map(|&c| Ok(text(c)?.text)).collect::<Result<Vec<_>>>()?;
                if let Some((base, _)) = self.array(ty) {
                    return Ok(Text::whole(self.language.array_value(&self.type_name(base)?, &values)));
                }
                let name = self.type_name(ty)?;
                if let TypeInner::Struct { .. } = self.module.types[ty].inner {
                    self.constructed_types.borrow_mut().insert(ty);
                    return Ok(self.language.construct_struct(&name, &values));
                }
                let values: Vec<_> = values.iter().map(String::as_str).collect();
                Ok(call(&name, &values))
            }
            ref other => Err(format!("the expression {other:?} has no text form")),
        }
    }

    /// The value of a module-scope constant.
    pub(super) fn constant_value(&self, handle: Handle<Expression>) -> Result<String> {
        let arena = &self.module.global_expressions;
        let text = |handle| Ok(Text::whole(self.constant_value(handle)?));
        Ok(self.constructed(&arena[handle], arena, &text)?.text)
    }

    /// The zero of a type.
    pub(super) fn zero(&self, ty: Handle<Type>) -> Result<Text> {
        if let TypeInner::Struct { members, .. } = &self.module.types[ty].inner {
            let values = members.iter().map(|member| Ok(self.zero(member.ty)?.text)).collect::<Result<Vec<_>>>()?;
            let name = self.type_name(ty)?;
            return self
                .language
                .zero(&name, &self.module.types[ty].inner)
                .or_else(|_| Ok(self.language.construct_struct(&name, &values)));
        }
        self.language.zero(&self.type_name(ty)?, &self.module.types[ty].inner)
    }

    /// What a pointer points to.
    fn pointee<'s>(&'s self, scope: &'s Scope, pointer: Handle<Expression>) -> Option<&'s TypeInner> {
        match self.inner(scope, pointer) {
            TypeInner::Pointer { base, .. } => Some(&self.module.types[*base].inner),
            _ => None,
        }
    }

    /// Something that an index or a member can follow.
    fn place(&self, scope: &Scope, base: Handle<Expression>) -> Result<String> {
        Ok(self.expression(scope, base)?.at_least(Binds::Whole))
    }

    fn member(&self, scope: &Scope, base: Handle<Expression>, index: u32) -> Result<Text> {
        let place = self.place(scope, base)?;
        let inner = match self.inner(scope, base) {
            TypeInner::Pointer { base, .. } => &self.module.types[*base].inner,
            other => other,
        };
        Ok(Text::whole(match inner {
            TypeInner::Struct { members, .. } => {
                let name = members.get(index as usize).and_then(|member| member.name.as_deref());
                format!("{place}.{}", self.language.member(name.ok_or("a member has no name")?))
            }
            TypeInner::Vector { .. } | TypeInner::ValuePointer { .. } => {
                format!("{place}.{}", ["x", "y", "z", "w"][index as usize % 4])
            }
            TypeInner::Matrix { .. } if !self.language.has_matrix_columns() => {
                return Err("columns of matrices are not exported".to_owned());
            }
            _ => format!("{place}[{index}]"),
        }))
    }

    fn unary(&self, scope: &Scope, operator: UnaryOperator, value: Handle<Expression>) -> Result<Text> {
        let size = shape(self.inner(scope, value)).map_or(1, |(_, size)| size);
        let value = self.expression(scope, value)?;
        let symbol = match operator {
            UnaryOperator::Negate => "-",
            UnaryOperator::BitwiseNot => "~",
            UnaryOperator::LogicalNot => return Ok(self.language.not(value, size)),
        };
        // Two signs in a row would be another operator.
        let value =
            if value.binds == Binds::Unary { format!("({})", value.text) } else { value.at_least(Binds::Unary) };
        Ok(Text { text: format!("{symbol}{value}"), binds: Binds::Unary })
    }

    fn binary(
        &self,
        scope: &Scope,
        operator: naga::BinaryOperator,
        left: Handle<Expression>,
        right: Handle<Expression>,
    ) -> Result<Text> {
        // `v + vec3(1.0)` is `v + 1.0`.
        let takes_scalars = operators::takes_scalars(self.language, operator);
        let splat = |handle: Handle<Expression>| match scope.function.expressions[handle] {
            Expression::Splat { value, .. } if takes_scalars && !scope.values.contains_key(&handle) => Some(value),
            _ => None,
        };
        let ty = self.inner(scope, left);
        let (left_text, right_text) = match (splat(left), splat(right)) {
            (None, Some(scalar)) => (self.expression(scope, left)?, self.expression(scope, scalar)?),
            (Some(scalar), None) => (self.expression(scope, scalar)?, self.expression(scope, right)?),
            _ => (self.expression(scope, left)?, self.expression(scope, right)?),
        };
        let right_ty = self.inner(scope, right);
        let (left, right) = (Operand { text: left_text, ty }, Operand { text: right_text, ty: right_ty });
        Ok(operators::binary(self.language, operator, left, right))
    }

    fn image_query(&self, scope: &Scope, image: Handle<Expression>, query: ImageQuery) -> Result<Text> {
        let level = match query {
            ImageQuery::Size { level: Some(level) } => Some(self.text(scope, level)?),
            _ => None,
        };
        let written = self.language.image_query(&self.text(scope, image)?, query, level.as_deref());
        let (text, helper) = written.ok_or_else(|| format!("the query {query:?} has no text form"))?;
        helper.map(|name| self.helper(name));
        Ok(text)
    }

    /// A call, with what the function uses of resources where that has to be passed.
    pub(super) fn call(
        &self,
        scope: &Scope,
        function: Handle<naga::Function>,
        arguments: &[Handle<Expression>],
    ) -> Result<Text> {
        let mut values = arguments.iter().map(|&a| self.text(scope, a)).collect::<Result<Vec<_>>>()?;
        if self.language.passes_globals() {
            values.extend(self.effects.of(function).globals.iter().map(|global| self.globals[global].clone()));
        }
        let values: Vec<_> = values.iter().map(String::as_str).collect();
        Ok(call(&self.functions[&function], &values))
    }
}
