//! What programs compute, one invocation at a time.

use super::{Condition, Expr, Floats, Function, Op, Program, Stmt, Type};

/// The result of a program: three values of each type.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Out {
    pub(crate) f: [f32; 3],
    pub(crate) i: [i32; 3],
    pub(crate) u: [u32; 3],
}

enum Flow {
    Next,
    Break,
    Continue,
    Return,
}

struct State<'a> {
    program: &'a Program,
    invocation: u32,
    argument: u32,
    variables: Out,
    list: [u32; 4],
    counters: Vec<u32>,
}

pub(crate) fn interpret(program: &Program, invocation: u32, argument: u32) -> Out {
    run(program, &program.test, invocation, argument, 3)
}

fn run(program: &Program, body: &[Stmt], i: u32, u: u32, second: i32) -> Out {
    let variables = Out {
        f: [1.0, (i % 16) as f32, (u % 16) as f32],
        i: [i.cast_signed().wrapping_sub(20), second, u.cast_signed()],
        u: [i, u, 9],
    };
    let list = [1, i, u, 7];
    let mut state = State { program, invocation: i, argument: u, variables, list, counters: Vec::new() };
    state.block(body);
    state.variables.u[0] ^= state.list[0] ^ state.list[3];
    state.variables
}

/// A float as bits, or the bits of an integer.
fn f(bits: u32) -> f32 {
    f32::from_bits(bits)
}

impl State<'_> {
    fn block(&mut self, block: &[Stmt]) -> Flow {
        for statement in block {
            match self.statement(statement) {
                Flow::Next => {}
                leave => return leave,
            }
        }
        Flow::Next
    }

    fn set(&mut self, ty: Type, index: usize, bits: u32) {
        match ty {
            Type::F if self.program.floats == Floats::Exact => self.variables.f[index] = f(bits).clamp(-64.0, 64.0),
            Type::F => self.variables.f[index] = f(bits),
            Type::I => self.variables.i[index] = bits.cast_signed(),
            Type::U => self.variables.u[index] = bits,
        }
    }

    fn statement(&mut self, statement: &Stmt) -> Flow {
        match statement {
            Stmt::Assign(ty, index, value) => {
                let value = self.expr(value);
                self.set(*ty, *index, value);
            }
            Stmt::SetElement(index, value) => {
                let (index, value) = (self.expr(index) % 4, self.expr(value));
                self.list[index as usize] = value;
            }
            Stmt::Through(index, variable, set, value) => {
                let index = (self.expr(index) % 4) as usize;
                self.variables.u[*variable] = self.expr(set);
                self.list[index] = self.expr(value).wrapping_add(self.list[index]);
            }
            Stmt::If(condition, accept, reject) => {
                return if self.condition(condition) { self.block(accept) } else { self.block(reject) };
            }
            Stmt::For(rounds, body) => {
                self.counters.push(0);
                loop {
                    // The counter of this loop is in no expression of its own header.
                    let round = self.counters[self.counters.len() - 1];
                    if round >= self.expr(rounds) % 6 {
                        break;
                    }
                    match self.block(body) {
                        Flow::Break => break,
                        Flow::Return => return Flow::Return,
                        Flow::Next | Flow::Continue => {}
                    }
                    *self.counters.last_mut().unwrap() += 1;
                }
                self.counters.pop();
            }
            Stmt::Loop(body, continuing, condition) => {
                self.counters.push(0);
                loop {
                    match self.block(body) {
                        Flow::Break => break,
                        Flow::Return => return Flow::Return,
                        Flow::Next | Flow::Continue => {}
                    }
                    self.block(continuing);
                    *self.counters.last_mut().unwrap() += 1;
                    if self.counters[self.counters.len() - 1] > 5 || self.condition(condition) {
                        break;
                    }
                }
                self.counters.pop();
            }
            Stmt::Repeat(body, condition) => {
                self.counters.push(0);
                loop {
                    let counter = self.counters.len() - 1;
                    self.counters[counter] += 1;
                    if self.counters[counter] < 6 {
                        match self.block(body) {
                            Flow::Break => break,
                            Flow::Return => return Flow::Return,
                            Flow::Continue => continue,
                            Flow::Next => {}
                        }
                    }
                    if self.counters[counter] >= 6 || self.condition(condition) {
                        break;
                    }
                }
                self.counters.pop();
            }
            Stmt::Switch(selector, cases, default, _) => {
                let selected = self.expr(selector) % 6;
                let case = cases.iter().find(|(values, _)| values.contains(&selected));
                return match self.block(case.map_or(default, |(_, body)| body)) {
                    Flow::Break => Flow::Next,
                    other => other,
                };
            }
            Stmt::Break => return Flow::Break,
            Stmt::Continue => return Flow::Continue,
            Stmt::Return => return Flow::Return,
            Stmt::Call(argument, index) => {
                let argument = self.expr(argument);
                let pointed = self.variables.i[*index];
                let out = run(self.program, &self.program.helper, self.invocation, argument, pointed);
                self.variables.i[*index] = out.i[1];
                self.variables.f[0] = out.f[1];
                self.variables.i[2] ^= out.i[0].wrapping_add(out.i[2]);
                self.variables.u[1] = out.u[0].wrapping_add(out.u[(self.argument % 3) as usize]);
            }
        }
        Flow::Next
    }

    fn condition(&self, condition: &Condition) -> bool {
        let compare = |ty: Type, sides: &[Expr; 2]| {
            let (a, b) = (self.expr(&sides[0]), self.expr(&sides[1]));
            match ty {
                Type::F => f(a).partial_cmp(&f(b)),
                Type::I => Some(a.cast_signed().cmp(&b.cast_signed())),
                Type::U => Some(a.cmp(&b)),
            }
        };
        match condition {
            Condition::Less(ty, sides) => compare(*ty, sides).is_some_and(|order| order.is_lt()),
            Condition::LessEqual(ty, sides) => compare(*ty, sides).is_some_and(|order| order.is_le()),
            Condition::Equal(ty, sides) => compare(*ty, sides).is_some_and(|order| order.is_eq()),
            Condition::Not(inner) => !self.condition(inner),
            Condition::And(sides) => self.condition(&sides[0]) && self.condition(&sides[1]),
            Condition::Or(sides) => self.condition(&sides[0]) || self.condition(&sides[1]),
        }
    }

    fn expr(&self, expr: &Expr) -> u32 {
        match expr {
            Expr::Literal(_, bits) => *bits,
            Expr::Variable(Type::F, index) => self.variables.f[*index].to_bits(),
            Expr::Variable(Type::I, index) => self.variables.i[*index].cast_unsigned(),
            Expr::Variable(Type::U, index) => self.variables.u[*index],
            Expr::Counter(index) => self.counters[*index],
            Expr::Invocation => self.invocation,
            Expr::Argument => self.argument,
            Expr::Element(index) => self.list[(self.expr(index) % 4) as usize],
            Expr::Unary(function, ty, inner) => self.unary(*function, *ty, self.expr(inner)),
            Expr::Binary(op, ty, sides) => self.binary(*op, *ty, self.expr(&sides[0]), self.expr(&sides[1])),
            Expr::Select(_, condition, sides) => self.expr(&sides[usize::from(self.condition(condition))]),
            Expr::Convert(to, from, inner) => {
                let bits = self.expr(inner);
                let exact = self.program.floats == Floats::Exact;
                match (to, from) {
                    (Type::F, Type::U) if exact => ((bits % 50) as f32).to_bits(),
                    (Type::F, Type::I) if exact => ((bits.cast_signed() % 50) as f32).to_bits(),
                    (Type::F, Type::U) => (bits as f32).to_bits(),
                    (Type::F, Type::I) => (bits.cast_signed() as f32).to_bits(),
                    // Clamped to what both types can hold.
                    (Type::I, Type::F) => (f(bits) as i32).min(2_147_483_520).cast_unsigned(),
                    (Type::U, Type::F) => (f(bits) as u32).min(4_294_967_040),
                    _ => bits,
                }
            }
        }
    }

    fn unary(&self, function: Function, ty: Type, a: u32) -> u32 {
        let signed = a.cast_signed();
        let first = |bits: u32| bits.checked_ilog2().unwrap_or(u32::MAX);
        match (function, ty) {
            (Function::Neg, Type::F) => (-f(a)).to_bits(),
            (Function::Neg, _) => a.wrapping_neg(),
            (Function::Abs, Type::F) => f(a).abs().to_bits(),
            (Function::Abs, _) => signed.wrapping_abs().cast_unsigned(),
            (Function::Floor, _) => f(a).floor().to_bits(),
            (Function::Ceil, _) => f(a).ceil().to_bits(),
            (Function::Trunc, _) => f(a).trunc().to_bits(),
            (Function::Sqrt, _) => f(a).sqrt().to_bits(),
            (Function::Not, _) => !a,
            (Function::CountOneBits, _) => a.count_ones(),
            (Function::FirstLeadingBit, Type::I) if signed < 0 => first(!a),
            (Function::FirstLeadingBit, _) => first(a),
            (Function::ReverseBits, _) => a.reverse_bits(),
        }
    }

    fn binary(&self, op: Op, ty: Type, a: u32, b: u32) -> u32 {
        if ty == Type::F {
            let small = |bits: u32| f(bits).clamp(-64.0, 64.0).floor();
            let (x, y) = (f(a), f(b));
            let result = match op {
                Op::Mul if self.program.floats == Floats::Exact => small(a) * small(b),
                Op::Add => x + y,
                Op::Sub => x - y,
                Op::Mul => x * y,
                Op::Div => x / y,
                Op::Min => x.min(y),
                _ => x.max(y),
            };
            return result.to_bits();
        }
        let (x, y) = (a.cast_signed(), b.cast_signed());
        let signed = ty == Type::I;
        match op {
            Op::Add => a.wrapping_add(b),
            Op::Sub => a.wrapping_sub(b),
            Op::Mul => a.wrapping_mul(b),
            Op::Div if b == 0 => a,
            Op::Rem if b == 0 => 0,
            Op::Div if signed => x.wrapping_div(y).cast_unsigned(),
            Op::Rem if signed => x.wrapping_rem(y).cast_unsigned(),
            Op::Div => a / b,
            Op::Rem => a % b,
            Op::And => a & b,
            Op::Or => a | b,
            Op::Xor => a ^ b,
            Op::Shl => a << (b & 31),
            Op::Shr if signed => (x >> (b & 31)).cast_unsigned(),
            Op::Shr => a >> (b & 31),
            Op::Min if signed => x.min(y).cast_unsigned(),
            Op::Max if signed => x.max(y).cast_unsigned(),
            Op::Min => a.min(b),
            Op::Max => a.max(b),
        }
    }
}
