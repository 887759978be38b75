//! Operators with as few parentheses as languages and readers agree on.

use naga::{BinaryOperator, TypeInner, VectorSize};

use super::language::{BinaryOperatorGroup as Group, Binds, Language, Operand, Text, shape};

/// Symbol of an operator.
pub(super) fn symbol(operator: BinaryOperator) -> &'static str {
    use BinaryOperator as B;
    match operator {
        B::Add => "+",
        B::Subtract => "-",
        B::Multiply => "*",
        B::Divide => "/",
        B::Modulo => "%",
        B::Equal => "==",
        B::NotEqual => "!=",
        B::Less => "<",
        B::LessEqual => "<=",
        B::Greater => ">",
        B::GreaterEqual => ">=",
        B::And => "&",
        B::ExclusiveOr => "^",
        B::InclusiveOr => "|",
        B::LogicalAnd => "&&",
        B::LogicalOr => "||",
        B::ShiftLeft => "<<",
        B::ShiftRight => ">>",
    }
}

fn binds(operator: BinaryOperator) -> Binds {
    use BinaryOperator as B;
    match operator {
        B::Multiply | B::Divide | B::Modulo => Binds::Product,
        B::Add | B::Subtract => Binds::Sum,
        B::ShiftLeft | B::ShiftRight => Binds::Shift,
        B::Less | B::LessEqual | B::Greater | B::GreaterEqual | B::Equal | B::NotEqual => Binds::Compare,
        B::And => Binds::Bits(Group::And),
        B::InclusiveOr => Binds::Bits(Group::Or),
        B::ExclusiveOr => Binds::Bits(Group::Xor),
        B::LogicalAnd => Binds::Logic(Group::And),
        B::LogicalOr => Binds::Logic(Group::Or),
    }
}

/// Whether a side of an operator stands without parentheses. Everything that readers, or WGSL, might take
/// otherwise gets them; so does the right side of an operator as tight, for floats are not associative.
fn stands_bare(side: Binds, operator: Binds, is_right: bool) -> bool {
    match (operator, side) {
        (_, Binds::Whole | Binds::Unary) => true,
        (Binds::Sum, Binds::Product) | (Binds::Compare, Binds::Sum | Binds::Product) => true,
        (Binds::Logic(_), Binds::Compare) => true,
        (Binds::Sum, Binds::Sum) | (Binds::Product, Binds::Product) => !is_right,
        (Binds::Logic(a), Binds::Logic(b)) | (Binds::Bits(a), Binds::Bits(b)) => a == b && !is_right,
        _ => false,
    }
}

fn side(text: &Text, operator: Binds, is_right: bool) -> String {
    if stands_bare(text.binds, operator, is_right) { text.text.clone() } else { format!("({})", text.text) }
}

/// `left operator right`.
pub(super) fn binary(language: &dyn Language, operator: BinaryOperator, left: Operand, right: Operand) -> Text {
    use BinaryOperator as B;
    let is_matrix = |inner: &TypeInner| matches!(inner, TypeInner::Matrix { .. });
    if operator == B::Multiply
        && (is_matrix(left.ty) || is_matrix(right.ty))
        && let Some(product) = language.matrix_product(&left.text, &right.text)
    {
        return product;
    }
    let is_vector = shape(left.ty).is_some_and(|(_, size)| size >= VectorSize::Bi as u8);
    if is_vector
        && binds(operator) == Binds::Compare
        && let Some(comparison) = language.compare(operator, &left.text, &right.text)
    {
        return comparison;
    }
    let binds = binds(operator);
    let text = format!("{} {} {}", side(&left.text, binds, false), symbol(operator), side(&right.text, binds, true));
    Text { text, binds }
}

/// Whether an operator takes a scalar beside a vector.
pub(super) fn takes_scalars(language: &dyn Language, operator: BinaryOperator) -> bool {
    match binds(operator) {
        Binds::Product | Binds::Sum => true,
        Binds::Compare => language.compares_with_scalars(),
        _ => false,
    }
}
