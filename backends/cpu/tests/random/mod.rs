//! Small programs made from random bytes, as WGSL and as the results that they should have. Shared by the tests that
//! run them on the CPU executor and on a device.
//!
//! A program is two functions, `test` and `helper`, over three variables of each type, an array, and a struct as
//! result. All loops are bounded. Literals are `let` values, for WGSL rejects constant expressions that overflow.

#![allow(dead_code, reason = "each test file uses a part of it")]

pub(crate) mod interpret;
pub(crate) mod print;

/// What floats may do in a program.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Floats {
    /// Anything IEEE 754 defines exactly, with infinities and NaN.
    Ieee,
    /// Small numbers without rounding errors, which drivers agree on whatever they reorder or fuse.
    Exact,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Type {
    F,
    I,
    U,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Op {
    Add,
    Sub,
    Mul,
    Div,
    Rem,
    And,
    Or,
    Xor,
    Shl,
    Shr,
    Min,
    Max,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Function {
    Neg,
    Abs,
    Floor,
    Ceil,
    Trunc,
    Sqrt,
    Not,
    CountOneBits,
    FirstLeadingBit,
    ReverseBits,
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Expr {
    Literal(Type, u32),
    Variable(Type, usize),
    /// Counter of one of the loops around.
    Counter(usize),
    Invocation,
    Argument,
    /// Element of the array of u32.
    Element(Box<Expr>),
    Unary(Function, Type, Box<Expr>),
    Binary(Op, Type, Box<[Expr; 2]>),
    Select(Type, Box<Condition>, Box<[Expr; 2]>),
    /// To the first type from the second.
    Convert(Type, Type, Box<Expr>),
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Condition {
    Less(Type, Box<[Expr; 2]>),
    LessEqual(Type, Box<[Expr; 2]>),
    Equal(Type, Box<[Expr; 2]>),
    Not(Box<Condition>),
    And(Box<[Condition; 2]>),
    Or(Box<[Condition; 2]>),
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Stmt {
    Assign(Type, usize, Expr),
    SetElement(Expr, Expr),
    /// Takes a pointer to an element, sets an unsigned variable, and then the element through the pointer.
    Through(Expr, usize, Expr, Expr),
    If(Condition, Vec<Stmt>, Vec<Stmt>),
    /// `for`: at most as many rounds as the expression says, at most 5.
    For(Expr, Vec<Stmt>),
    /// `loop` with `break if` in its continuing block; at most 6 rounds.
    Loop(Vec<Stmt>, Vec<Stmt>, Condition),
    /// `loop` that ends with `if … { break; }` in its body, which `continue` passes by; at most 6 rounds.
    Repeat(Vec<Stmt>, Condition),
    /// Values that share a body; the default case comes first of all or last.
    Switch(Expr, Vec<(Vec<u32>, Vec<Stmt>)>, Vec<Stmt>, bool),
    Break,
    Continue,
    Return,
    /// Calls `helper` with an argument and a pointer to a signed variable, and takes a part of the result.
    Call(Expr, usize),
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Program {
    pub(crate) floats: Floats,
    pub(crate) helper: Vec<Stmt>,
    pub(crate) test: Vec<Stmt>,
}

/// Makes a program from bytes: the first choice of everything, once they are used up.
pub(crate) struct Generator<'a> {
    bytes: std::slice::Iter<'a, u8>,
    floats: Floats,
    loops: usize,
    /// What `break` and `continue` leave here.
    can_break: bool,
    in_helper: bool,
}

const LITERALS: [u32; 12] = [0, 1, 2, 3, 5, 7, 31, 100, 0x7fff_ffff, 0x8000_0000, 0xffff_ffff, 0x1234_5678];
const EXACT_FLOATS: [f32; 8] = [0.0, 1.0, -1.0, 0.5, 2.0, 3.25, -7.75, 40.0];
const IEEE_FLOATS: [f32; 12] = [0.0, 1.0, -1.5, 0.1, 3.0, 1e-3, 1e10, -3e38, 1e-38, 16_777_217.0, -0.0, 0.333];

impl<'a> Generator<'a> {
    pub(crate) fn program(bytes: &'a [u8], floats: Floats) -> Program {
        let mut generator = Self { bytes: bytes.iter(), floats, loops: 0, can_break: false, in_helper: true };
        let helper = generator.block(2);
        generator.in_helper = false;
        Program { floats, helper, test: generator.block(4) }
    }

    fn choose(&mut self, count: usize) -> usize {
        self.bytes.next().map_or(0, |byte| *byte as usize % count)
    }

    fn ty(&mut self) -> Type {
        [Type::U, Type::I, Type::F][self.choose(3)]
    }

    fn block(&mut self, depth: usize) -> Vec<Stmt> {
        let count = self.choose(5) + usize::from(depth > 2);
        let mut statements = Vec::new();
        for _ in 0..count {
            let statement = self.statement(depth);
            let leaves = matches!(statement, Stmt::Break | Stmt::Continue | Stmt::Return);
            statements.push(statement);
            if leaves {
                break;
            }
        }
        statements
    }

    fn statement(&mut self, depth: usize) -> Stmt {
        let kind = self.choose(if depth == 0 { 10 } else { 20 });
        match kind {
            0..4 => {
                let ty = self.ty();
                Stmt::Assign(ty, self.choose(3), self.expr(ty, 3))
            }
            4 => Stmt::SetElement(self.expr(Type::U, 2), self.expr(Type::U, 3)),
            5 if self.can_break => Stmt::Break,
            6 if self.loops > 0 => Stmt::Continue,
            7 => Stmt::Return,
            8 if !self.in_helper => Stmt::Call(self.expr(Type::U, 2), self.choose(3)),
            9 => {
                let (index, variable) = (self.expr(Type::U, 2), self.choose(3));
                Stmt::Through(index, variable, self.expr(Type::U, 2), self.expr(Type::U, 2))
            }
            10..14 => {
                let condition = self.condition(2);
                let accept = self.block(depth - 1);
                let reject = if self.choose(2) == 0 { Vec::new() } else { self.block(depth - 1) };
                Stmt::If(condition, accept, reject)
            }
            14 | 15 => {
                let rounds = self.expr(Type::U, 1);
                Stmt::For(rounds, self.loop_body(depth))
            }
            16 => {
                let body = self.loop_body(depth);
                self.loops += 1;
                let (can_break, condition) = (std::mem::replace(&mut self.can_break, false), self.condition(1));
                let ty = self.ty();
                let continuing = vec![Stmt::Assign(ty, self.choose(3), self.expr(ty, 2))];
                self.loops -= 1;
                self.can_break = can_break;
                Stmt::Loop(body, continuing, condition)
            }
            17 | 18 => {
                let selector = self.expr(Type::U, 2);
                let can_break = std::mem::replace(&mut self.can_break, true);
                let mut values = (0..5u32).filter(|_| self.choose(4) != 0).collect::<Vec<_>>().into_iter().peekable();
                let mut cases = Vec::new();
                while values.peek().is_some() {
                    let shared = 1 + self.choose(2);
                    cases.push((values.by_ref().take(shared).collect(), self.block(depth - 1)));
                }
                let default = self.block(depth - 1);
                self.can_break = can_break;
                Stmt::Switch(selector, cases, default, self.choose(2) == 0)
            }
            19 => {
                let body = self.loop_body(depth);
                self.loops += 1;
                let condition = self.condition(1);
                self.loops -= 1;
                Stmt::Repeat(body, condition)
            }
            _ => Stmt::Assign(Type::U, 0, self.expr(Type::U, 2)),
        }
    }

    fn loop_body(&mut self, depth: usize) -> Vec<Stmt> {
        let can_break = std::mem::replace(&mut self.can_break, true);
        self.loops += 1;
        let body = self.block(depth - 1);
        self.loops -= 1;
        self.can_break = can_break;
        body
    }

    fn condition(&mut self, depth: usize) -> Condition {
        let kind = self.choose(if depth == 0 { 3 } else { 6 });
        if kind < 3 {
            let ty = self.ty();
            let sides = Box::new([self.expr(ty, 1), self.expr(ty, 1)]);
            return match kind {
                0 => Condition::Less(ty, sides),
                1 => Condition::LessEqual(ty, sides),
                _ => Condition::Equal(ty, sides),
            };
        }
        match kind {
            3 => Condition::Not(Box::new(self.condition(depth - 1))),
            4 => Condition::And(Box::new([self.condition(depth - 1), self.condition(depth - 1)])),
            _ => Condition::Or(Box::new([self.condition(depth - 1), self.condition(depth - 1)])),
        }
    }

    fn expr(&mut self, ty: Type, depth: usize) -> Expr {
        let kind = self.choose(if depth == 0 { 4 } else { 12 });
        match kind {
            0 | 4 => Expr::Variable(ty, self.choose(3)),
            1 if ty == Type::F => {
                let floats = if self.floats == Floats::Exact { &EXACT_FLOATS[..] } else { &IEEE_FLOATS };
                Expr::Literal(ty, floats[self.choose(floats.len())].to_bits())
            }
            1 => Expr::Literal(ty, LITERALS[self.choose(LITERALS.len())]),
            2 | 3 if ty != Type::U => {
                let from = [Type::U, Type::I, Type::F][self.choose(3)];
                if from == ty || depth == 0 {
                    return Expr::Variable(ty, self.choose(3));
                }
                Expr::Convert(ty, from, Box::new(self.expr(from, depth - 1)))
            }
            2 if self.loops > 0 && self.choose(2) == 0 => Expr::Counter(self.choose(self.loops)),
            2 => Expr::Invocation,
            3 => Expr::Argument,
            5 if ty == Type::U => Expr::Element(Box::new(self.expr(Type::U, depth - 1))),
            5 | 6 => {
                let function = match ty {
                    Type::F if self.floats == Floats::Exact => {
                        [Function::Neg, Function::Abs, Function::Floor][self.choose(3)]
                    }
                    Type::F => {
                        use Function::{Abs, Ceil, Floor, Neg, Sqrt, Trunc};
                        [Neg, Abs, Floor, Ceil, Trunc, Sqrt][self.choose(6)]
                    }
                    Type::I => [Function::Neg, Function::Abs, Function::Not, Function::FirstLeadingBit][self.choose(4)],
                    Type::U => {
                        use Function::{CountOneBits, FirstLeadingBit, Not, ReverseBits};
                        [Not, CountOneBits, FirstLeadingBit, ReverseBits][self.choose(4)]
                    }
                };
                Expr::Unary(function, ty, Box::new(self.expr(ty, depth - 1)))
            }
            7 => {
                let condition = Box::new(self.condition(0));
                Expr::Select(ty, condition, Box::new([self.expr(ty, depth - 1), self.expr(ty, depth - 1)]))
            }
            _ => {
                use Op::{Add, And, Div, Max, Min, Mul, Or, Rem, Shl, Shr, Sub, Xor};
                let ops: &[Op] = match (ty, self.floats) {
                    (Type::F, Floats::Exact) => &[Add, Sub, Mul, Min, Max],
                    (Type::F, Floats::Ieee) => &[Add, Sub, Mul, Div],
                    _ => &[Add, Sub, Mul, Div, Rem, And, Or, Xor, Shl, Shr, Min, Max],
                };
                let op = ops[self.choose(ops.len())];
                let (left, mut right) = (self.expr(ty, depth - 1), self.expr(ty, depth - 1));
                if let (Div | Rem, Expr::Literal(Type::I | Type::U, bits @ 0)) = (op, &mut right) {
                    // Rejected where it can be seen.
                    *bits = 3;
                }
                Expr::Binary(op, ty, Box::new([left, right]))
            }
        }
    }
}

/// Compares what a program wrote for each invocation with what it should have written.
pub(crate) fn compare(program: &Program, words: &[u32], argument: fn(u32) -> u32) -> Result<(), String> {
    for (i, words) in (0..).zip(words.chunks(print::OUT_WORDS)) {
        let expected = interpret::interpret(program, i, argument(i));
        let floats = [0, 1, 2].map(|index| f32::from_bits(words[index]));
        let same = |(actual, expected): (&f32, f32)| {
            let equal = actual.to_bits() == expected.to_bits() || (actual.is_nan() && expected.is_nan());
            // What the sign of a zero is may depend on how a driver simplifies.
            equal || (program.floats == Floats::Exact && *actual == expected)
        };
        let signed = expected.i.map(i32::cast_unsigned);
        if !floats.iter().zip(expected.f).all(same) || words[4..7] != signed || words[8..11] != expected.u {
            return Err(format!("invocation {i}: {floats:?}, {words:x?}, expected {expected:x?}"));
        }
    }
    Ok(())
}
