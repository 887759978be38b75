//! How types are laid out: as consecutive scalars in registers and workgroup memory, and as bytes in buffers.

use naga::{ArraySize, Handle, Module, Type, TypeInner};

/// Whether a register can hold it.
pub(crate) fn is_supported(scalar: naga::Scalar) -> bool {
    scalar.kind == naga::ScalarKind::Bool || scalar.width == 4 || scalar == naga::Scalar::F16
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

/// Bytes from one column of a matrix to the next.
fn column_stride(rows: naga::VectorSize, scalar: naga::Scalar) -> u32 {
    u32::from(scalar.width) * if rows == naga::VectorSize::Bi { 2 } else { 4 }
}

/// A scalar in a buffer.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Slot {
    /// In bytes.
    pub(crate) offset: u32,
    pub(crate) is_half: bool,
}

/// Where in a buffer each scalar of a type is, in the order of registers.
pub(crate) fn slots(module: &Module, inner: &TypeInner, base: u32, out: &mut Vec<Slot>) {
    let mut row = |start: u32, count: u32, scalar: naga::Scalar| {
        let width = u32::from(scalar.width);
        out.extend((0..count).map(|i| Slot { offset: start + i * width, is_half: scalar == naga::Scalar::F16 }));
    };
    match inner {
        TypeInner::Scalar(scalar) | TypeInner::Atomic(scalar) => row(base, 1, *scalar),
        TypeInner::Vector { size, scalar } => row(base, *size as u32, *scalar),
        TypeInner::Matrix { columns, rows, scalar } => {
            for column in 0..*columns as u32 {
                row(base + column * column_stride(*rows, *scalar), *rows as u32, *scalar);
            }
        }
        TypeInner::Array { base: element, size: ArraySize::Constant(count), stride } => {
            for index in 0..count.get() {
                slots(module, &module.types[*element].inner, base + index * stride, out);
            }
        }
        TypeInner::Struct { members, .. } => {
            for member in members {
                slots(module, &module.types[member.ty].inner, base + member.offset, out);
            }
        }
        _ => {}
    }
}

/// The type and place of a part of a composite.
pub(crate) struct Part {
    pub(crate) inner: TypeInner,
    /// Scalars before it.
    pub(crate) scalars: u32,
    /// Bytes before it in a buffer.
    pub(crate) bytes: u32,
}

/// Part `index` of a composite, or with index 0 the element from which others are strides away.
pub(crate) fn part(module: &Module, inner: &TypeInner, index: u32) -> Option<Part> {
    match inner {
        TypeInner::Vector { scalar, .. } => {
            let bytes = index * u32::from(scalar.width);
            Some(Part { inner: TypeInner::Scalar(*scalar), scalars: index, bytes })
        }
        TypeInner::Matrix { rows, scalar, .. } => Some(Part {
            inner: TypeInner::Vector { size: *rows, scalar: *scalar },
            scalars: index * *rows as u32,
            bytes: index * column_stride(*rows, *scalar),
        }),
        TypeInner::Array { base, stride, .. } => {
            let element = &module.types[*base].inner;
            let scalars = scalar_count(module, element).unwrap_or(0);
            Some(Part { inner: element.clone(), scalars: index * scalars, bytes: index * stride })
        }
        TypeInner::Struct { members, .. } => {
            let member = members.get(index as usize)?;
            let before = members[..index as usize].iter();
            let scalars = before.map(|m| scalar_count(module, &module.types[m.ty].inner).unwrap_or(0)).sum();
            Some(Part { inner: module.types[member.ty].inner.clone(), scalars, bytes: member.offset })
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
