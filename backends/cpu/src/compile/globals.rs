//! Variables and constants of a module.

use naga::{AddressSpace, Expression, GlobalVariable, Handle, TypeInner};

use super::{BindingSlot, Compiler, Place, Result, Root, SlotKind, Value, unsupported};
use crate::op::{Memory, Operand};

impl Compiler<'_> {
    pub(super) fn globals(&mut self) -> Result<()> {
        for (handle, variable) in self.module.global_variables.iter() {
            self.span = self.module.global_variables.get_span(handle);
            let value = self.global(variable)?;
            self.globals.insert(handle, value);
        }
        self.span = naga::Span::UNDEFINED;
        Ok(())
    }

    fn global(&mut self, variable: &GlobalVariable) -> Result<Value> {
        let inner = self.module.types[variable.ty].inner.clone();
        let name = variable.name.clone().unwrap_or_default();
        let place = |root| Value::Place(Place { root, inner: inner.clone(), offset: 0, dynamic: Vec::new() });
        let slot = self.bindings.len() as u32;
        let mut bind = |kind| -> Result<()> {
            let Some(at) = variable.binding else { return unsupported(format!("`{name}` without a binding")) };
            self.bindings.push(BindingSlot { name: name.clone(), group: at.group, binding: at.binding, kind });
            Ok(())
        };
        match variable.space {
            AddressSpace::Uniform => {
                bind(SlotKind::Buffer { writable: false })?;
                Ok(place(Root::Memory(Memory::Buffer(slot))))
            }
            AddressSpace::Storage { access } => {
                bind(SlotKind::Buffer { writable: access.contains(naga::StorageAccess::STORE) })?;
                Ok(place(Root::Memory(Memory::Buffer(slot))))
            }
            AddressSpace::Handle => match inner {
                TypeInner::Image { dim: naga::ImageDimension::D2, arrayed: false, class }
                    if !class.is_multisampled() && class != naga::ImageClass::External =>
                {
                    let can_store = |access: naga::StorageAccess| access.contains(naga::StorageAccess::STORE);
                    let writable = matches!(class, naga::ImageClass::Storage { access, .. } if can_store(access));
                    bind(SlotKind::Texture { writable })?;
                    Ok(Value::Resource(slot))
                }
                TypeInner::Sampler { comparison } => {
                    bind(SlotKind::Sampler { comparison })?;
                    Ok(Value::Resource(slot))
                }
                _ => unsupported(format!("`{name}`: a resource that is no plain two-dimensional texture")),
            },
            AddressSpace::WorkGroup => {
                let offset = self.workgroup_words;
                self.workgroup_words += self.count(&inner)?;
                let place = Place { root: Root::Memory(Memory::Workgroup), inner, offset, dynamic: Vec::new() };
                Ok(Value::Place(place))
            }
            AddressSpace::Private => {
                let count = self.count(&inner)?;
                let index = self.declare(count);
                let initial = match variable.init {
                    Some(init) => self.constant(init)?,
                    None => vec![0; count as usize],
                };
                self.initialize(index, &initial.into_iter().map(Operand::Const).collect::<Vec<_>>());
                Ok(place(Root::Variable(index)))
            }
            _ => unsupported(format!("`{name}`: address space {:?}", variable.space)),
        }
    }

    /// The scalars of a constant expression, as bits.
    pub(super) fn constant(&self, handle: Handle<Expression>) -> Result<Vec<u32>> {
        let expressions = &self.module.global_expressions;
        match &expressions[handle] {
            Expression::Literal(literal) => Ok(vec![literal_bits(*literal)?]),
            Expression::Constant(constant) => self.constant(self.module.constants[*constant].init),
            Expression::ZeroValue(ty) => Ok(vec![0; self.count(&self.module.types[*ty].inner)? as usize]),
            Expression::Compose { components, .. } => {
                let parts: Result<Vec<_>> = components.iter().map(|&part| self.constant(part)).collect();
                Ok(parts?.concat())
            }
            Expression::Splat { size, value } => {
                let value = self.constant(*value)?;
                Ok((0..*size as u32).flat_map(|_| value.iter().copied()).collect())
            }
            other => unsupported(format!("constant expression {other:?}")),
        }
    }
}

pub(super) fn literal_bits(literal: naga::Literal) -> Result<u32> {
    match literal {
        naga::Literal::F32(value) => Ok(value.to_bits()),
        naga::Literal::F16(value) => Ok(value.to_f32().to_bits()),
        naga::Literal::U32(value) => Ok(value),
        naga::Literal::I32(value) => Ok(value.cast_unsigned()),
        naga::Literal::Bool(value) => Ok(if value { u32::MAX } else { 0 }),
        other => unsupported(format!("literal {other:?}")),
    }
}
