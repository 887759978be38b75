//! Programs as WGSL.

use std::fmt::Write;

use super::{Condition, Expr, Floats, Function, Op, Program, Stmt, Type};

struct Printer {
    floats: Floats,
    code: String,
    literals: Vec<(Type, u32)>,
    depth: usize,
    in_helper: bool,
}

/// WGSL and the value that it has for an invocation.
type Argument = (&'static str, fn(u32) -> u32);

/// Which value the argument `u` has.
pub(crate) const ARGUMENTS: [Argument; 3] = [("i * 5u % 11u", |i| i * 5 % 11), ("numbers.y", |_| 6), ("4u", |_| 4)];

/// Words of a result.
pub(crate) const OUT_WORDS: usize = 12;

/// A kernel that runs a program for each invocation, with one of `ARGUMENTS`.
pub(crate) fn kernel(program: &Program, argument: &str, workgroup_size: u32) -> String {
    let functions = print(program);
    format!(
        "@group(0) @binding(0) var<storage, read_write> out: array<Out>;
        @group(0) @binding(1) var<uniform> numbers: vec4<u32>;
        {functions}
        @compute @workgroup_size({workgroup_size})
        fn main(@builtin(global_invocation_id) id: vec3<u32>) {{
            let i = id.x;
            let u = {argument};
            if i < arrayLength(&out) {{ out[i] = test(i, u); }}
        }}"
    )
}

/// The functions `helper` and `test`, the latter as `fn test(i: u32, u: u32) -> Out`.
pub(crate) fn print(program: &Program) -> String {
    let mut code = "struct Out { f: vec3<f32>, i: vec3<i32>, u: vec3<u32> }\n".to_owned();
    for (name, body) in [("helper", &program.helper), ("test", &program.test)] {
        let in_helper = name == "helper";
        let mut printer =
            Printer { floats: program.floats, code: String::new(), literals: Vec::new(), depth: 0, in_helper };
        printer.block(body);
        let pointer = if in_helper { ", p: ptr<function, i32>" } else { "" };
        let i1 = if in_helper { "" } else { "var i1 = 3i;" };
        let _ = write!(
            code,
            "fn {name}(i: u32, u: u32{pointer}) -> Out {{
            var f0 = 1.0; var f1 = f32(i % 16u); var f2 = f32(u % 16u);
            var i0 = i32(i) - 20; {i1} var i2 = i32(u);
            var u0 = i; var u1 = u; var u2 = 9u;
            var list = array(1u, i, u, 7u);\n"
        );
        for (index, (ty, bits)) in printer.literals.iter().enumerate() {
            let value = match ty {
                Type::F => format!("{:?}f", f32::from_bits(*bits)),
                Type::I if bits.cast_signed() == i32::MIN => "i32(-2147483648)".to_owned(),
                Type::I => format!("{}i", bits.cast_signed()),
                Type::U => format!("{bits}u"),
            };
            let _ = writeln!(code, "let c{index} = {value};");
        }
        code += &printer.code;
        code += &printer.result();
        code += "}\n";
    }
    code
}

impl Printer {
    fn variable(&self, ty: Type, index: usize) -> String {
        match ty {
            Type::I if self.in_helper && index == 1 => "(*p)".to_owned(),
            Type::F => format!("f{index}"),
            Type::I => format!("i{index}"),
            Type::U => format!("u{index}"),
        }
    }

    fn result(&self) -> String {
        let middle = self.variable(Type::I, 1);
        format!("return Out(vec3(f0, f1, f2), vec3(i0, {middle}, i2), vec3(u0 ^ list[0] ^ list[3], u1, u2));\n")
    }

    fn line(&mut self, line: &str) {
        self.code += line;
        self.code += "\n";
    }

    fn block(&mut self, block: &[Stmt]) {
        block.iter().for_each(|statement| self.statement(statement));
    }

    fn body(&mut self, block: &[Stmt]) {
        self.depth += 1;
        self.block(block);
        self.depth -= 1;
    }

    fn statement(&mut self, statement: &Stmt) {
        let depth = self.depth;
        match statement {
            Stmt::Assign(ty, index, value) => {
                let mut value = self.expr(value);
                if *ty == Type::F && self.floats == Floats::Exact {
                    value = format!("clamp({value}, -64.0, 64.0)");
                }
                let line = format!("{} = {value};", self.variable(*ty, *index));
                self.line(&line);
            }
            Stmt::SetElement(index, value) => {
                let line = format!("list[{} % 4u] = {};", self.expr(index), self.expr(value));
                self.line(&line);
            }
            Stmt::Through(index, variable, set, value) => {
                let [index, set, value] = [index, set, value].map(|expr| self.expr(expr));
                self.line(&format!("{{ let q = &list[{index} % 4u]; u{variable} = {set}; *q = {value} + *q; }}"));
            }
            Stmt::If(condition, accept, reject) => {
                let line = format!("if {} {{", self.condition(condition));
                self.line(&line);
                self.block(accept);
                if !reject.is_empty() {
                    self.line("} else {");
                    self.block(reject);
                }
                self.line("}");
            }
            Stmt::For(rounds, body) => {
                let line = format!("for (var k{depth} = 0u; k{depth} < {} % 6u; k{depth}++) {{", self.expr(rounds));
                self.line(&line);
                self.body(body);
                self.line("}");
            }
            Stmt::Loop(body, continuing, condition) => {
                self.line(&format!("{{ var k{depth} = 0u; loop {{"));
                self.body(body);
                self.line("continuing {");
                self.depth += 1;
                self.block(continuing);
                self.line(&format!("k{depth}++;"));
                let line = format!("break if k{depth} > 5u || {}; }} }} }}", self.condition(condition));
                self.depth -= 1;
                self.line(&line);
            }
            Stmt::Repeat(body, condition) => {
                self.line(&format!("{{ var k{depth} = 0u; loop {{ k{depth}++; if k{depth} < 6u {{"));
                self.body(body);
                let line = format!("}} if k{depth} >= 6u || {} {{ break; }} }} }}", self.condition(condition));
                self.line(&line);
            }
            Stmt::Switch(selector, cases, default, default_first) => {
                let line = format!("switch {} % 6u {{", self.expr(selector));
                self.line(&line);
                for first in [true, false] {
                    if *default_first == first {
                        self.line("default {");
                        self.block(default);
                        self.line("}");
                    }
                    for (values, body) in cases.iter().filter(|_| first) {
                        let values: Vec<_> = values.iter().map(|value| format!("{value}u")).collect();
                        self.line(&format!("case {} {{", values.join(", ")));
                        self.block(body);
                        self.line("}");
                    }
                }
                self.line("}");
            }
            Stmt::Break => self.line("break;"),
            Stmt::Continue => self.line("continue;"),
            Stmt::Return => {
                let line = self.result();
                self.line(&line);
            }
            Stmt::Call(argument, index) => {
                let line = format!(
                    "{{ let r = helper(i, {}, &i{index}); f0 = r.f.y; i2 ^= r.i.x + r.i.z; u1 = r.u.x + r.u[u % 3u]; }}",
                    self.expr(argument)
                );
                self.line(&line);
            }
        }
    }

    fn pair(&mut self, [a, b]: &[Expr; 2]) -> [String; 2] {
        [self.expr(a), self.expr(b)]
    }

    fn condition(&mut self, condition: &Condition) -> String {
        let mut compared = |sides: &[Expr; 2], operator: &str| {
            let [a, b] = self.pair(sides);
            format!("({a} {operator} {b})")
        };
        match condition {
            Condition::Less(_, sides) => compared(sides, "<"),
            Condition::LessEqual(_, sides) => compared(sides, "<="),
            Condition::Equal(_, sides) => compared(sides, "=="),
            Condition::Not(inner) => format!("!{}", self.condition(inner)),
            Condition::And(sides) => format!("({} && {})", self.condition(&sides[0]), self.condition(&sides[1])),
            Condition::Or(sides) => format!("({} || {})", self.condition(&sides[0]), self.condition(&sides[1])),
        }
    }

    fn expr(&mut self, expr: &Expr) -> String {
        match expr {
            Expr::Literal(ty, bits) => {
                self.literals.push((*ty, *bits));
                format!("c{}", self.literals.len() - 1)
            }
            Expr::Variable(ty, index) => self.variable(*ty, *index),
            Expr::Counter(index) => format!("k{index}"),
            Expr::Invocation => "i".to_owned(),
            Expr::Argument => "u".to_owned(),
            Expr::Element(index) => format!("list[{} % 4u]", self.expr(index)),
            Expr::Unary(function, _, inner) => {
                let inner = self.expr(inner);
                let name = match function {
                    Function::Neg => return format!("(-{inner})"),
                    Function::Not => return format!("(~{inner})"),
                    Function::Abs => "abs",
                    Function::Floor => "floor",
                    Function::Ceil => "ceil",
                    Function::Trunc => "trunc",
                    Function::Sqrt => "sqrt",
                    Function::CountOneBits => "countOneBits",
                    Function::FirstLeadingBit => "firstLeadingBit",
                    Function::ReverseBits => "reverseBits",
                };
                format!("{name}({inner})")
            }
            Expr::Binary(op, ty, sides) => {
                let [a, b] = self.pair(sides);
                match (op, ty) {
                    (Op::Mul, Type::F) if self.floats == Floats::Exact => {
                        format!("(floor(clamp({a}, -64.0, 64.0)) * floor(clamp({b}, -64.0, 64.0)))")
                    }
                    (Op::Add, _) => format!("({a} + {b})"),
                    (Op::Sub, _) => format!("({a} - {b})"),
                    (Op::Mul, _) => format!("({a} * {b})"),
                    (Op::Div, _) => format!("({a} / {b})"),
                    (Op::Rem, _) => format!("({a} % {b})"),
                    (Op::And, _) => format!("({a} & {b})"),
                    (Op::Or, _) => format!("({a} | {b})"),
                    (Op::Xor, _) => format!("({a} ^ {b})"),
                    (Op::Shl, _) => format!("({a} << (bitcast<u32>({b}) & 31u))"),
                    (Op::Shr, _) => format!("({a} >> (bitcast<u32>({b}) & 31u))"),
                    (Op::Min, _) => format!("min({a}, {b})"),
                    (Op::Max, _) => format!("max({a}, {b})"),
                }
            }
            Expr::Select(_, condition, sides) => {
                let condition = self.condition(condition);
                let [a, b] = self.pair(sides);
                format!("select({a}, {b}, {condition})")
            }
            Expr::Convert(to, from, inner) => {
                let inner = self.expr(inner);
                match (to, from) {
                    // Small enough to stay exact.
                    (Type::F, Type::U) if self.floats == Floats::Exact => format!("f32({inner} % 50u)"),
                    (Type::F, Type::I) if self.floats == Floats::Exact => format!("f32({inner} % 50i)"),
                    (Type::F, _) => format!("f32({inner})"),
                    (Type::I, _) => format!("i32({inner})"),
                    (Type::U, _) => format!("u32({inner})"),
                }
            }
        }
    }
}
