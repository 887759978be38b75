//! How types are laid out: as consecutive scalars in registers, and as words in memory.

use naga::{ArraySize, Handle, Module, Type, TypeInner};

/// Whether a register can hold it.
pub(crate) fn is_supported(scalar: naga::Scalar) -> bool {
    scalar.kind == naga::ScalarKind::Bool || scalar.width == 4
}

/// Number of scalars of a type of fixed size; none for types that are not supported either.
pub(crate) fn scalar_count(module: &Module, inner: &TypeInner) -> Option<u32> {
    let of = |ty: Handle<Type>| scalar_count(module, &module.types[ty].inner);
    let scalar = if let TypeInner::Atomic(scalar) = inner { Some(*scalar) } else { inner.scalar() };
    if scalar.is_some_and(|scalar| !is_supported(scalar)) {
        return None;
    }
    match inner {
        TypeInner::Scalar(_) | TypeInner::Atomic(_) => Some(1),
        TypeInner::Vector { size, .. } => Some(*size as u32),
        TypeInner::Matrix { columns, rows, .. } => Some(*columns as u32 * *rows as u32),
        TypeInner::Array { base, size: ArraySize::Constant(count), .. } => Some(of(*base)? * count.get()),
        TypeInner::Struct { members, .. } => members.iter().map(|member| of(member.ty)).sum(),
        _ => None,
    }
}

/// Words from one column of a matrix to the next.
pub(crate) fn column_stride(rows: naga::VectorSize) -> u32 {
    if rows == naga::VectorSize::Bi { 2 } else { 4 }
}

/// Where in memory each scalar of a type is, in words, in the order of registers.
pub(crate) fn word_offsets(module: &Module, inner: &TypeInner, base: u32, out: &mut Vec<u32>) {
    match inner {
        TypeInner::Vector { size, .. } => out.extend((0..*size as u32).map(|i| base + i)),
        TypeInner::Matrix { columns, rows, .. } => {
            for column in 0..*columns as u32 {
                out.extend((0..*rows as u32).map(|row| base + column * column_stride(*rows) + row));
            }
        }
        TypeInner::Array { base: element, size: ArraySize::Constant(count), stride } => {
            for index in 0..count.get() {
                word_offsets(module, &module.types[*element].inner, base + index * stride / 4, out);
            }
        }
        TypeInner::Struct { members, .. } => {
            for member in members {
                word_offsets(module, &module.types[member.ty].inner, base + member.offset / 4, out);
            }
        }
        _ => out.push(base),
    }
}

/// The type and place of a part of a composite.
pub(crate) struct Part {
    pub(crate) inner: TypeInner,
    /// Scalars before it.
    pub(crate) scalars: u32,
    /// Words before it.
    pub(crate) words: u32,
}

/// Part `index` of a composite, or with index 0 the element from which others are strides away.
pub(crate) fn part(module: &Module, inner: &TypeInner, index: u32) -> Option<Part> {
    match inner {
        TypeInner::Vector { scalar, .. } => {
            Some(Part { inner: TypeInner::Scalar(*scalar), scalars: index, words: index })
        }
        TypeInner::Matrix { rows, scalar, .. } => Some(Part {
            inner: TypeInner::Vector { size: *rows, scalar: *scalar },
            scalars: index * *rows as u32,
            words: index * column_stride(*rows),
        }),
        TypeInner::Array { base, stride, .. } => {
            let element = &module.types[*base].inner;
            let scalars = scalar_count(module, element).unwrap_or(0);
            Some(Part { inner: element.clone(), scalars: index * scalars, words: index * stride / 4 })
        }
        TypeInner::Struct { members, .. } => {
            let member = members.get(index as usize)?;
            let before = members[..index as usize].iter();
            let scalars = before.map(|m| scalar_count(module, &module.types[m.ty].inner).unwrap_or(0)).sum();
            Some(Part { inner: module.types[member.ty].inner.clone(), scalars, words: member.offset / 4 })
        }
        _ => None,
    }
}

/// Number of elements that a dynamic index may reach; none for a runtime-sized array.
pub(crate) fn element_count(inner: &TypeInner) -> Option<u32> {
    match inner {
        TypeInner::Vector { size, .. } => Some(*size as u32),
        TypeInner::Matrix { columns, .. } => Some(*columns as u32),
        TypeInner::Array { size: ArraySize::Constant(count), .. } => Some(count.get()),
        _ => None,
    }
}
