//! Arithmetic and mathematical functions, made of the machine's operations.

use naga::{BinaryOperator, Expression, Handle, MathFunction, ScalarKind, TypeInner};

use super::{Compiler, Inlined, Result, unsupported};
use crate::op::{Binary, Op, Operand, Unary};

fn float(value: f32) -> Operand {
    Operand::Const(value.to_bits())
}

fn binary_op(op: BinaryOperator, kind: ScalarKind) -> Option<(Binary, bool)> {
    use BinaryOperator as B;
    use ScalarKind::{Bool, Float, Sint, Uint};
    // With the operands swapped where true.
    Some(match (op, kind) {
        (B::Add, Float) => (Binary::AddF, false),
        (B::Add, Sint | Uint) => (Binary::AddI, false),
        (B::Subtract, Float) => (Binary::SubF, false),
        (B::Subtract, Sint | Uint) => (Binary::SubI, false),
        (B::Multiply, Float) => (Binary::MulF, false),
        (B::Multiply, Sint | Uint) => (Binary::MulI, false),
        (B::Divide, Float) => (Binary::DivF, false),
        (B::Divide, Sint) => (Binary::DivI, false),
        (B::Divide, Uint) => (Binary::DivU, false),
        (B::Modulo, Float) => (Binary::RemF, false),
        (B::Modulo, Sint) => (Binary::RemI, false),
        (B::Modulo, Uint) => (Binary::RemU, false),
        (B::Equal, Float) => (Binary::EqF, false),
        (B::Equal, Sint | Uint | Bool) => (Binary::EqI, false),
        (B::NotEqual, Float) => (Binary::NeF, false),
        (B::NotEqual, Sint | Uint | Bool) => (Binary::NeI, false),
        (B::Less, Float) => (Binary::LtF, false),
        (B::Less, Sint) => (Binary::LtI, false),
        (B::Less, Uint) => (Binary::LtU, false),
        (B::LessEqual, Float) => (Binary::LeF, false),
        (B::LessEqual, Sint) => (Binary::LeI, false),
        (B::LessEqual, Uint) => (Binary::LeU, false),
        (B::Greater, Float) => (Binary::LtF, true),
        (B::Greater, Sint) => (Binary::LtI, true),
        (B::Greater, Uint) => (Binary::LtU, true),
        (B::GreaterEqual, Float) => (Binary::LeF, true),
        (B::GreaterEqual, Sint) => (Binary::LeI, true),
        (B::GreaterEqual, Uint) => (Binary::LeU, true),
        (B::And | B::LogicalAnd, _) => (Binary::And, false),
        (B::ExclusiveOr, _) => (Binary::Xor, false),
        (B::InclusiveOr | B::LogicalOr, _) => (Binary::Or, false),
        (B::ShiftLeft, _) => (Binary::ShiftLeft, false),
        (B::ShiftRight, Sint) => (Binary::ShiftRightI, false),
        (B::ShiftRight, Uint) => (Binary::ShiftRightU, false),
        _ => return None,
    })
}

impl<'a> Compiler<'a> {
    pub(super) fn binary_expression(
        &mut self,
        frame: &mut Inlined<'a>,
        op: BinaryOperator,
        left: Handle<Expression>,
        right: Handle<Expression>,
    ) -> Result<Vec<Operand>> {
        let (left_type, right_type) = (self.inner(frame, left), self.inner(frame, right));
        let kind = self.kind(frame, left)?;
        let a = self.data(frame, left)?;
        let b = self.data(frame, right)?;
        if let BinaryOperator::Multiply = op {
            match (&left_type, &right_type) {
                (TypeInner::Matrix { columns, rows, .. }, TypeInner::Vector { .. }) => {
                    return Ok(self.matrix_times_vector(&a, &b, *columns as usize, *rows as usize));
                }
                (TypeInner::Vector { .. }, TypeInner::Matrix { rows, .. }) => {
                    return Ok(b.chunks_exact(*rows as usize).map(|column| self.dot(&a, column)).collect());
                }
                (TypeInner::Matrix { columns, rows, .. }, TypeInner::Matrix { .. }) => {
                    let columns = *columns as usize;
                    let product = |column: &[Operand]| self.matrix_times_vector(&a, column, columns, *rows as usize);
                    return Ok(b.chunks_exact(columns).flat_map(product).collect());
                }
                _ => {}
            }
        }
        let Some((op, swapped)) = binary_op(op, kind) else {
            return unsupported(format!("{op:?} of {kind:?}"));
        };
        let count = a.len().max(b.len());
        let at = |values: &[Operand], i: usize| values[i.min(values.len() - 1)];
        Ok((0..count)
            .map(|i| {
                let (a, b) = (at(&a, i), at(&b, i));
                if swapped { self.binary(op, b, a) } else { self.binary(op, a, b) }
            })
            .collect())
    }

    fn matrix_times_vector(&mut self, m: &[Operand], v: &[Operand], columns: usize, rows: usize) -> Vec<Operand> {
        let row = |row: usize| (0..columns).map(|column| m[column * rows + row]).collect::<Vec<_>>();
        (0..rows).map(|index| self.dot(&row(index), v)).collect()
    }

    /// In order, each product rounded.
    fn dot(&mut self, a: &[Operand], b: &[Operand]) -> Operand {
        self.dot_of(a, b, Binary::MulF, Binary::AddF)
    }

    pub(super) fn dot_of(&mut self, a: &[Operand], b: &[Operand], multiply: Binary, add: Binary) -> Operand {
        let mut sum = self.binary(multiply, a[0], b[0]);
        for (&a, &b) in a.iter().zip(b).skip(1) {
            let product = self.binary(multiply, a, b);
            sum = self.fold(add, sum, product);
        }
        sum
    }

    /// By expansion along the first row.
    fn determinant(&mut self, columns: &[Vec<Operand>]) -> Operand {
        if let [column] = columns {
            self.retain(&[column[0]]);
            return column[0];
        }
        let mut sum: Option<Operand> = None;
        for (index, column) in columns.iter().enumerate() {
            let others = columns.iter().enumerate().filter(|(other, _)| *other != index);
            let minor: Vec<_> = others.map(|(_, other)| other[1..].to_vec()).collect();
            let factor = self.determinant(&minor);
            let term = self.binary(Binary::MulF, column[0], factor);
            self.release(&[factor]);
            sum = Some(match sum {
                None => term,
                Some(sum) => self.fold(if index % 2 == 0 { Binary::AddF } else { Binary::SubF }, sum, term),
            });
        }
        sum.unwrap_or(float(0.0))
    }

    fn length(&mut self, v: &[Operand]) -> Operand {
        if let [scalar] = v {
            return self.unary(Unary::AbsF, *scalar);
        }
        let squared = self.dot(v, v);
        let length = self.unary(Unary::Sqrt, squared);
        self.release(&[squared]);
        length
    }

    pub(super) fn each(&mut self, op: Unary, values: &[Operand]) -> Result<Vec<Operand>> {
        Ok(values.iter().map(|&value| self.unary(op, value)).collect())
    }

    pub(super) fn each_pair(&mut self, op: Binary, a: &[Operand], b: &[Operand]) -> Result<Vec<Operand>> {
        let at = |i: usize| b[i.min(b.len() - 1)];
        Ok(a.iter().enumerate().map(|(i, &a)| self.binary(op, a, at(i))).collect())
    }

    /// `a * b + c`, each step rounded.
    fn multiply_add(&mut self, a: Operand, b: Operand, c: Operand) -> Operand {
        let product = self.binary(Binary::MulF, a, b);
        let sum = self.binary(Binary::AddF, product, c);
        self.release(&[product]);
        sum
    }

    fn scaled(&mut self, values: &[Operand], factor: Operand) -> Vec<Operand> {
        values.iter().map(|&value| self.binary(Binary::MulF, value, factor)).collect()
    }

    pub(super) fn math(
        &mut self,
        function: MathFunction,
        kind: ScalarKind,
        inner: &TypeInner,
        arguments: &[Vec<Operand>],
    ) -> Result<Vec<Operand>> {
        use MathFunction as M;
        let is_float = kind == ScalarKind::Float;
        let signed = kind == ScalarKind::Sint;
        let a = &arguments[0];
        let argument = |i: usize| arguments.get(i).map_or(&[][..], Vec::as_slice);
        let (b, c) = (argument(1), argument(2));
        let (min, max) = match kind {
            ScalarKind::Float => (Binary::MinF, Binary::MaxF),
            ScalarKind::Sint => (Binary::MinI, Binary::MaxI),
            _ => (Binary::MinU, Binary::MaxU),
        };
        let op = match function {
            M::Abs if is_float => Some(Unary::AbsF),
            M::Abs if signed => Some(Unary::AbsI),
            M::Abs => Some(Unary::Copy),
            M::Sign if is_float => Some(Unary::SignF),
            M::Sign => Some(Unary::SignI),
            M::Saturate => Some(Unary::SaturateF),
            M::Cos => Some(Unary::Cos),
            M::Cosh => Some(Unary::Cosh),
            M::Sin => Some(Unary::Sin),
            M::Sinh => Some(Unary::Sinh),
            M::Tan => Some(Unary::Tan),
            M::Tanh => Some(Unary::Tanh),
            M::Acos => Some(Unary::Acos),
            M::Asin => Some(Unary::Asin),
            M::Atan => Some(Unary::Atan),
            M::Asinh => Some(Unary::Asinh),
            M::Acosh => Some(Unary::Acosh),
            M::Atanh => Some(Unary::Atanh),
            M::Ceil => Some(Unary::Ceil),
            M::Floor => Some(Unary::Floor),
            M::Round => Some(Unary::Round),
            M::Fract => Some(Unary::Fract),
            M::Trunc => Some(Unary::Trunc),
            M::Exp => Some(Unary::Exp),
            M::Exp2 => Some(Unary::Exp2),
            M::Log => Some(Unary::Log),
            M::Log2 => Some(Unary::Log2),
            M::Sqrt => Some(Unary::Sqrt),
            M::InverseSqrt => Some(Unary::InverseSqrt),
            M::QuantizeToF16 => Some(Unary::QuantizeToF16),
            M::CountTrailingZeros => Some(Unary::CountTrailingZeros),
            M::CountLeadingZeros => Some(Unary::CountLeadingZeros),
            M::CountOneBits => Some(Unary::CountOneBits),
            M::ReverseBits => Some(Unary::ReverseBits),
            M::FirstTrailingBit => Some(Unary::FirstTrailingBit),
            M::FirstLeadingBit if signed => Some(Unary::FirstLeadingBitI),
            M::FirstLeadingBit => Some(Unary::FirstLeadingBitU),
            _ => None,
        };
        if let Some(op) = op {
            return self.each(op, a);
        }
        match function {
            M::Min => self.each_pair(min, a, b),
            M::Max => self.each_pair(max, a, b),
            M::Clamp => {
                let raised = self.each_pair(max, a, b)?;
                let clamped = self.each_pair(min, &raised, c);
                self.release(&raised);
                clamped
            }
            M::Atan2 => self.each_pair(Binary::Atan2, a, b),
            M::Pow => self.each_pair(Binary::Pow, a, b),
            // step(edge, x)
            M::Step => self.each_pair(Binary::Step, a, b),
            M::Ldexp => self.each_pair(Binary::Ldexp, a, b),
            M::Radians => Ok(self.scaled(a, float(0.017_453_292))),
            M::Degrees => Ok(self.scaled(a, float(57.295_78))),
            M::Dot if is_float => Ok(vec![self.dot(a, b)]),
            M::Dot => Ok(vec![self.dot_of(a, b, Binary::MulI, Binary::AddI)]),
            M::Length => Ok(vec![self.length(a)]),
            M::Distance => {
                let difference = self.each_pair(Binary::SubF, a, b)?;
                let length = self.length(&difference);
                self.release(&difference);
                Ok(vec![length])
            }
            M::Normalize => {
                let squared = self.dot(a, a);
                let inverse = self.unary(Unary::InverseSqrt, squared);
                let all = self.scaled(a, inverse);
                self.release(&[squared, inverse]);
                Ok(all)
            }
            M::Cross => Ok((0..3)
                .map(|i| {
                    let (j, k) = ((i + 1) % 3, (i + 2) % 3);
                    let first = self.binary(Binary::MulF, a[j], b[k]);
                    let second = self.binary(Binary::MulF, a[k], b[j]);
                    self.fold(Binary::SubF, first, second)
                })
                .collect()),
            M::Reflect => {
                // e - 2 dot(n, e) n
                let cosine = self.dot(b, a);
                let twice = self.fold(Binary::MulF, float(2.0), cosine);
                let along = self.scaled(b, twice);
                let reflected = self.each_pair(Binary::SubF, a, &along);
                self.release(&along);
                self.release(&[twice]);
                reflected
            }
            M::Refract => {
                // k = 1 - eta^2 (1 - cosine^2); eta e - (eta cosine + sqrt(k)) n, or 0 where k < 0
                let eta = c[0];
                let cosine = self.dot(b, a);
                let negated = self.unary(Unary::NegF, cosine);
                let sine = self.multiply_add(negated, cosine, float(1.0));
                let squared = self.binary(Binary::MulF, eta, eta);
                let reduced = self.fold(Binary::MulF, squared, sine);
                let k = self.binary(Binary::SubF, float(1.0), reduced);
                let root = self.unary(Unary::Sqrt, k);
                let along = self.multiply_add(eta, cosine, root);
                let total = self.binary(Binary::LtF, k, float(0.0));
                let bend = |compiler: &mut Self, (&e, &n): (&Operand, &Operand)| {
                    let scaled = compiler.binary(Binary::MulF, eta, e);
                    let pushed = compiler.binary(Binary::MulF, along, n);
                    let bent = compiler.fold(Binary::SubF, scaled, pushed);
                    let refracted = compiler.select(total, float(0.0), bent);
                    compiler.release(&[bent]);
                    refracted
                };
                let all = a.iter().zip(b).map(|pair| bend(self, pair)).collect();
                self.release(&[cosine, negated, reduced, k, root, along, total]);
                Ok(all)
            }
            M::Determinant => {
                let TypeInner::Matrix { rows, .. } = inner else { return unsupported("determinant of no matrix") };
                let columns: Vec<Vec<Operand>> = a.chunks_exact(*rows as usize).map(<[_]>::to_vec).collect();
                Ok(vec![self.determinant(&columns)])
            }
            M::FaceForward => {
                // dot(incident, reference) < 0 ? n : -n
                let cosine = self.dot(b, c);
                let faces = self.fold(Binary::LtF, cosine, float(0.0));
                let flipped = self.each(Unary::NegF, a)?;
                let chosen = a.iter().zip(&flipped).map(|(&n, &m)| self.select(faces, n, m)).collect();
                self.release(&flipped);
                self.release(&[faces]);
                Ok(chosen)
            }
            M::Fma => Ok((0..a.len())
                .map(|i| {
                    let to = self.result(&[a[i], b[i], c[i]]);
                    self.emit(Op::Fma { to, a: a[i], b: b[i], c: c[i] });
                    to
                })
                .collect()),
            M::Mix => {
                // a (1 - t) + b t
                let weights: Vec<_> = c.iter().map(|&t| self.binary(Binary::SubF, float(1.0), t)).collect();
                let from = self.each_pair(Binary::MulF, a, &weights)?;
                let to = self.each_pair(Binary::MulF, b, c)?;
                let mixed = self.each_pair(Binary::AddF, &from, &to);
                [weights, from, to].iter().for_each(|values| self.release(values));
                mixed
            }
            M::SmoothStep => {
                // t t (3 - 2 t), t = saturate((x - low) / (high - low))
                let smooth = |compiler: &mut Self, i: usize| {
                    let range = compiler.binary(Binary::SubF, b[i], a[i]);
                    let above = compiler.binary(Binary::SubF, c[i], a[i]);
                    let ratio = compiler.fold(Binary::DivF, above, range);
                    let t = compiler.unary(Unary::SaturateF, ratio);
                    let slope = compiler.multiply_add(float(-2.0), t, float(3.0));
                    let squared = compiler.binary(Binary::MulF, t, t);
                    compiler.release(&[ratio, t]);
                    compiler.fold(Binary::MulF, squared, slope)
                };
                Ok((0..a.len()).map(|i| smooth(self, i)).collect())
            }
            M::Transpose => {
                let TypeInner::Matrix { rows, .. } = inner else { return unsupported("transpose of no matrix") };
                let rows = *rows as usize;
                let all: Vec<_> = (0..rows).flat_map(|row| a.iter().copied().skip(row).step_by(rows)).collect();
                self.retain(&all);
                Ok(all)
            }
            M::Pack2x16float => self.pack16(Unary::ToHalf, a),
            M::Pack2x16snorm => self.pack16(Unary::ToSnorm16, a),
            M::Pack2x16unorm => self.pack16(Unary::ToUnorm16, a),
            M::Pack4x8snorm => self.pack8(Unary::ToSnorm8, a),
            M::Pack4x8unorm => self.pack8(Unary::ToUnorm8, a),
            M::Unpack2x16float => {
                Ok(vec![self.unary(Unary::HalfToFloat, a[0]), self.unary(Unary::HighHalfToFloat, a[0])])
            }
            M::Unpack2x16snorm => Ok(vec![self.unary(Unary::LowSnorm16, a[0]), self.unary(Unary::HighSnorm16, a[0])]),
            M::Unpack2x16unorm => Ok(vec![self.unary(Unary::LowUnorm16, a[0]), self.unary(Unary::HighUnorm16, a[0])]),
            M::Unpack4x8unorm => Ok((0..4).map(|i| self.unary(Unary::Unorm8(i), a[0])).collect()),
            M::Unpack4x8snorm => Ok((0..4).map(|i| self.unary(Unary::Snorm8(i), a[0])).collect()),
            M::Unpack4xI8 => Ok((0..4).map(|i| self.unary(Unary::Int8(i), a[0])).collect()),
            M::Unpack4xU8 => Ok((0..4).map(|i| self.unary(Unary::Uint8(i), a[0])).collect()),
            M::Modf => {
                let wholes = self.each(Unary::Trunc, a)?;
                let mut parts = self.each_pair(Binary::SubF, a, &wholes)?;
                parts.extend(wholes);
                Ok(parts)
            }
            M::Frexp => {
                let mut parts = self.each(Unary::FrexpFraction, a)?;
                parts.extend(self.each(Unary::FrexpExponent, a)?);
                Ok(parts)
            }
            M::ExtractBits => {
                let field = self.bit_field(b[0], c[0]);
                let right = if signed { Binary::ShiftRightI } else { Binary::ShiftRightU };
                let all = a.iter().map(|&value| self.extract_bits(value, &field, right)).collect();
                self.release(&field);
                Ok(all)
            }
            M::InsertBits => {
                let field = self.bit_field(c[0], arguments[3][0]);
                let all = a.iter().zip(b).map(|(&value, &new)| self.insert_bits(value, new, &field)).collect();
                self.release(&field);
                Ok(all)
            }
            M::Dot4I8Packed => Ok(vec![self.dot_packed(Unary::Int8, a[0], b[0])]),
            M::Dot4U8Packed => Ok(vec![self.dot_packed(Unary::Uint8, a[0], b[0])]),
            M::Pack4xI8 | M::Pack4xU8 => self.pack_bytes(a),
            M::Pack4xI8Clamp => self.pack_clamped(a, Binary::MaxI, Binary::MinI, (-128i32).cast_unsigned(), 127),
            M::Pack4xU8Clamp => self.pack_clamped(a, Binary::MaxU, Binary::MinU, 0, 255),
            other => unsupported(format!("the function {other:?}")),
        }
    }
}
