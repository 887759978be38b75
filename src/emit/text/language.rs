//! What differs between the languages.

use naga::{AtomicFunction, BinaryOperator, ImageQuery, Literal, MathFunction, Scalar, ScalarKind, TypeInner};

use crate::kernel::{Binding, Kernel};

/// Text of an expression and how tightly its outermost operator binds.
#[derive(Debug, Clone)]
pub(super) struct Text {
    pub(super) text: String,
    pub(super) binds: Binds,
}

/// How tightly an operator binds, loosest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Binds {
    Ternary,
    Logic(BinaryOperatorGroup),
    Compare,
    Bits(BinaryOperatorGroup),
    Shift,
    Sum,
    Product,
    Unary,
    Whole,
}

/// Operators that may stand side by side without parentheses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum BinaryOperatorGroup {
    And,
    Or,
    Xor,
}

impl Text {
    pub(super) fn whole(text: impl Into<String>) -> Self {
        Self { text: text.into(), binds: Binds::Whole }
    }

    /// In parentheses unless it binds at least so tightly.
    pub(super) fn at_least(self, binds: Binds) -> String {
        if self.binds >= binds { self.text } else { format!("({})", self.text) }
    }
}

/// `name(a, b)`.
pub(super) fn call(name: &str, arguments: &[&str]) -> Text {
    Text::whole(format!("{name}({})", arguments.join(", ")))
}

/// Scalar and number of components of a scalar or vector.
pub(super) fn shape(inner: &TypeInner) -> Option<(Scalar, u8)> {
    match *inner {
        TypeInner::Scalar(scalar) | TypeInner::Atomic(scalar) => Some((scalar, 1)),
        TypeInner::Vector { size, scalar } => Some((scalar, size as u8)),
        _ => None,
    }
}

pub(super) fn is_unsigned(inner: &TypeInner) -> bool {
    shape(inner).is_some_and(|(scalar, _)| scalar.kind == ScalarKind::Uint)
}

/// Whether a scalar or vector is one of integers, signed or not.
pub(super) fn is_integer(inner: &TypeInner) -> bool {
    shape(inner).is_some_and(|(scalar, _)| matches!(scalar.kind, ScalarKind::Sint | ScalarKind::Uint))
}

/// An operand: its text and type.
pub(super) struct Operand<'a> {
    pub(super) text: Text,
    pub(super) ty: &'a TypeInner,
}

/// A name that stands for a helper function, if it was one.
pub(super) type Helper = &'static str;

/// A language of shaders. The defaults are those of its relatives of C.
pub(super) trait Language {
    /// For errors.
    fn stage(&self) -> &'static str;

    /// Words that name nothing of ours.
    fn reserved(&self) -> &[&'static [&'static str]];

    fn entry_name(&self, kernel: &Kernel) -> &'static str {
        kernel.name
    }

    /// Lines between the heading and the program.
    fn prologue(&self, kernel: &Kernel) -> String;

    fn scalar(&self, scalar: Scalar) -> Result<&'static str, String> {
        match (scalar.kind, scalar.width) {
            (ScalarKind::Float, 4) => Ok("float"),
            (ScalarKind::Uint, 4) => Ok("uint"),
            (ScalarKind::Sint, 4) => Ok("int"),
            (ScalarKind::Bool, _) => Ok("bool"),
            _ => Err(format!("the type {scalar:?} has no text form")),
        }
    }

    fn vector(&self, size: u8, scalar: Scalar) -> Result<String, String> {
        Ok(format!("{}{size}", self.scalar(scalar)?))
    }

    fn matrix(&self, columns: u8, rows: u8) -> String;

    /// The name of a member of a struct.
    fn member(&self, name: &str) -> String {
        let is_reserved = self.reserved().iter().any(|list| list.contains(&name));
        if is_reserved { format!("{name}_") } else { name.to_owned() }
    }

    fn field(&self, ty: &str, name: &str) -> String {
        format!("{ty} {name};")
    }

    fn struct_end(&self) -> &'static str {
        "};\n"
    }

    /// A function that makes a struct, where the language has no expression for it.
    fn constructor(&self, _name: &str, _fields: &[(String, String)]) -> String {
        String::new()
    }

    fn construct_struct(&self, name: &str, values: &[String]) -> Text;

    fn constant(&self, ty: &str, count: Option<u32>, name: &str, value: &str) -> String;

    fn array_value(&self, ty: &str, values: &[String]) -> String;

    fn resource(&self, kernel: &Kernel, binding: &Binding, name: &str, element: &str) -> String;

    /// Where a resource is bound, for tables.
    fn slot(&self, kernel: &Kernel, binding: &Binding) -> String;

    fn workgroup(&self, ty: &str, is_atomic: bool, count: Option<u32>, name: &str) -> String;

    /// Whether functions receive what they use of resources and workgroup memory as arguments.
    fn passes_globals(&self) -> bool {
        false
    }

    fn helper(&self, name: &str) -> &'static str;

    fn function(&self, result: Option<&str>, name: &str, arguments: &[(String, String)]) -> String {
        let arguments: Vec<_> = arguments.iter().map(|(ty, name)| format!("{ty} {name}")).collect();
        format!("{} {name}({}) {{\n", result.unwrap_or("void"), arguments.join(", "))
    }

    /// The head of the entry point.
    fn entry_point(&self, kernel: &Kernel, arguments: &[(String, String)]) -> String;

    /// Type, attribute or replacement of a built-in input.
    fn built_in(&self, built_in: naga::BuiltIn) -> Option<&'static str>;

    /// Whether built-in inputs are variables of the language, and no arguments.
    fn built_ins_are_global(&self) -> bool {
        false
    }

    fn named_value(&self, ty: &str, name: &str, value: &str) -> String {
        format!("{ty} {name} = {value};")
    }

    fn variable(&self, ty: &str, name: &str, value: &str) -> String {
        format!("{ty} {name} = {value};")
    }

    fn array_variable(&self, ty: &str, name: &str, count: u32) -> String {
        format!("{ty} {name}[{count}];")
    }

    /// A condition behind `if` or `while`.
    fn condition(&self, text: &str) -> String {
        format!("({text})")
    }

    fn for_head(&self, first: &str, condition: &str, step: &str) -> String {
        let space = |text: &str| if text.is_empty() { String::new() } else { format!(" {text}") };
        format!("for ({first};{};{}) {{", space(condition), space(step))
    }

    /// Whether a loop's variable is visible behind the loop.
    fn loop_variables_leak(&self) -> bool {
        false
    }

    fn literal(&self, literal: Literal) -> Result<String, String> {
        c_literal(literal)
    }

    fn zero(&self, ty: &str, inner: &TypeInner) -> Result<Text, String>;

    fn splat(&self, ty: &str, size: u8, value: Text) -> Text;

    /// Whether a vector compares with a scalar.
    fn compares_with_scalars(&self) -> bool {
        false
    }

    /// Comparison of vectors, where it is no operator.
    fn compare(&self, _operator: BinaryOperator, _left: &Text, _right: &Text) -> Option<Text> {
        None
    }

    fn not(&self, value: Text, _size: u8) -> Text {
        negated(value)
    }

    /// Product that is no operator, of a matrix and a vector.
    fn matrix_product(&self, _left: &Text, _right: &Text) -> Option<Text> {
        None
    }

    fn has_matrix_columns(&self) -> bool {
        true
    }

    /// `size` components of the condition; 1 for a scalar. `ty` is the type of the result.
    fn select(&self, condition: Text, accept: Text, reject: Text, size: u8, ty: &str) -> (Text, Option<Helper>);

    fn convert(&self, ty: &str, value: &Text) -> Text {
        call(ty, &[&value.text])
    }

    fn bitcast(&self, to: ScalarKind, ty: &str, from: &TypeInner, value: &Text) -> Option<Text>;

    fn math(&self, fun: MathFunction, operands: &[Operand]) -> Option<(Text, Option<Helper>)>;

    fn image_load(&self, image: &str, coordinate: &Operand, level: &str) -> Text;

    fn image_query(&self, image: &str, query: ImageQuery, level: Option<&str>) -> Option<(Text, Option<Helper>)>;

    /// `value` has as many components as the format, unless `full_values`.
    fn image_store(&self, image: &str, coordinate: &Operand, value: &str) -> String;

    /// Whether storing takes four components whatever the format.
    fn stores_full_values(&self) -> bool {
        true
    }

    fn atomic_load(&self, place: &str) -> Text {
        Text::whole(place)
    }

    fn atomic_store(&self, place: &str, value: &str) -> String {
        format!("{place} = {value};")
    }

    /// A statement; `result` is type and name of what the place held before.
    fn atomic(&self, fun: AtomicFunction, place: &str, value: &str, result: Option<(&str, &str)>) -> Option<String>;

    fn barrier(&self) -> &'static str;
}

/// A number as the relatives of C write it.
pub(super) fn c_literal(literal: Literal) -> Result<String, String> {
    match literal {
        Literal::F32(value) if value.is_finite() => Ok(format!("{value:?}")),
        // Masks are easier to read by their digits.
        Literal::U32(value) if value >= 0x7fff => Ok(format!("0x{value:x}u")),
        Literal::U32(value) => Ok(format!("{value}u")),
        Literal::I32(i32::MIN) => Ok("(-2147483647 - 1)".to_owned()),
        Literal::I32(value) => Ok(value.to_string()),
        Literal::Bool(value) => Ok(value.to_string()),
        other => Err(format!("the number {other:?} has no text form")),
    }
}

/// `condition ? accept : reject`.
pub(super) fn ternary(condition: Text, accept: Text, reject: Text) -> Text {
    let condition = condition.at_least(Binds::Unary);
    let part = |text: Text| if text.binds == Binds::Ternary { format!("({})", text.text) } else { text.text };
    Text { text: format!("{condition} ? {} : {}", part(accept), part(reject)), binds: Binds::Ternary }
}

/// Values in braces, a few in each line.
pub(super) fn wrapped(values: &[String]) -> String {
    let lines: Vec<_> = values.chunks(5).map(|line| format!("\n    {},", line.join(", "))).collect();
    format!("{{{}\n}}", lines.concat().trim_end_matches(','))
}

/// The zero of a scalar.
pub(super) fn zero_literal(inner: &TypeInner) -> Option<&'static str> {
    match *inner {
        TypeInner::Scalar(Scalar { kind: ScalarKind::Float, .. }) => Some("0.0"),
        TypeInner::Scalar(Scalar { kind: ScalarKind::Uint, .. }) => Some("0u"),
        TypeInner::Scalar(Scalar { kind: ScalarKind::Sint, .. }) => Some("0"),
        TypeInner::Scalar(Scalar { kind: ScalarKind::Bool, .. }) => Some("false"),
        _ => None,
    }
}

/// Functions of the same name in all languages.
pub(super) fn common_function(fun: MathFunction) -> Option<&'static str> {
    use MathFunction as M;
    Some(match fun {
        M::Abs => "abs",
        M::Min => "min",
        M::Max => "max",
        M::Clamp => "clamp",
        M::Cos => "cos",
        M::Sin => "sin",
        M::Tan => "tan",
        M::Acos => "acos",
        M::Asin => "asin",
        M::Atan => "atan",
        M::Ceil => "ceil",
        M::Floor => "floor",
        M::Trunc => "trunc",
        M::Exp => "exp",
        M::Exp2 => "exp2",
        M::Log => "log",
        M::Log2 => "log2",
        M::Pow => "pow",
        M::Dot => "dot",
        M::Cross => "cross",
        M::Distance => "distance",
        M::Length => "length",
        M::Normalize => "normalize",
        M::Reflect => "reflect",
        M::Sign => "sign",
        M::Step => "step",
        M::SmoothStep => "smoothstep",
        M::Sqrt => "sqrt",
        _ => return None,
    })
}

/// The name that WGSL and GLSL have for an atomic function.
pub(super) fn atomic_function(fun: AtomicFunction) -> Option<&'static str> {
    Some(match fun {
        AtomicFunction::Add => "atomicAdd",
        AtomicFunction::And => "atomicAnd",
        AtomicFunction::ExclusiveOr => "atomicXor",
        AtomicFunction::InclusiveOr => "atomicOr",
        AtomicFunction::Min => "atomicMin",
        AtomicFunction::Max => "atomicMax",
        AtomicFunction::Subtract | AtomicFunction::Exchange { .. } => return None,
    })
}

fn element_of<'k>(kernel: &'k Kernel, binding: &Binding) -> Option<(&'k TypeInner, Option<u32>)> {
    let variable = kernel.module.global_variables.iter().find_map(|(_, variable)| {
        let at = variable.binding.as_ref()?;
        ((at.group, at.binding) == (binding.group, binding.binding)).then_some(variable)
    })?;
    match kernel.module.types[variable.ty].inner {
        TypeInner::Array { base, size: naga::ArraySize::Constant(count), .. } => {
            Some((&kernel.module.types[base].inner, Some(count.get())))
        }
        TypeInner::Array { base, .. } => Some((&kernel.module.types[base].inner, None)),
        _ => None,
    }
}

/// Elements of a buffer that has a fixed number of them.
pub(super) fn array_length(kernel: &Kernel, binding: &Binding) -> Option<u32> {
    element_of(kernel, binding)?.1
}

/// Whether the elements of a buffer are atomic.
pub(super) fn is_atomic(kernel: &Kernel, binding: &Binding) -> bool {
    matches!(element_of(kernel, binding), Some((TypeInner::Atomic(_), _)))
}

/// Number of the bindings before this one, among all that the kernel has in any settings and that are like it.
pub(super) fn position(kernel: &Kernel, binding: &Binding, is_like: impl Fn(&&Binding) -> bool) -> u32 {
    let before = |other: &&Binding| (other.group, other.binding) < (binding.group, binding.binding);
    kernel.all_bindings.iter().filter(is_like).filter(before).count() as u32
}

/// `!value`.
pub(super) fn negated(value: Text) -> Text {
    Text { text: format!("!{}", value.at_least(Binds::Unary)), binds: Binds::Unary }
}
