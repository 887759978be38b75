//! Memory for the resources of a plan.

use glam::UVec2;
use limpid::Plan;
use limpid::resource::{Copy, Format, Kind, Resource};

use crate::Error;

/// What a resource of the plan is on the device, one entry for each copy.
pub(crate) enum Allocation {
    Textures(Vec<(wgpu::Texture, wgpu::TextureView)>),
    Buffer(wgpu::Buffer),
    /// Supplied by the caller each frame, or the constants.
    External,
}

/// All resources, in the order of the plan.
pub(crate) struct Allocations(Vec<Allocation>);

pub(crate) fn texture_format(format: Format) -> wgpu::TextureFormat {
    match format {
        Format::Rgba16Float => wgpu::TextureFormat::Rgba16Float,
        Format::Rgba32Uint => wgpu::TextureFormat::Rgba32Uint,
        Format::Rg32Uint => wgpu::TextureFormat::Rg32Uint,
        Format::R32Uint => wgpu::TextureFormat::R32Uint,
    }
}

fn check_limits(device: &wgpu::Device, resource: &Resource, size: UVec2) -> Result<(), Error> {
    let limits = device.limits();
    let fail = |limit, needed, available, unit| {
        Err(Error::Limit { resource: resource.name.clone(), limit, needed, available, unit })
    };
    match resource.kind {
        Kind::Texture { extent, .. } => {
            let largest = extent.of(size).max_element();
            if largest > limits.max_texture_dimension_2d {
                let available = limits.max_texture_dimension_2d.into();
                return fail("max_texture_dimension_2d", largest.into(), available, "pixels");
            }
        }
        Kind::Buffer { stride, count, .. } => {
            let bytes = stride * count.of(size);
            let available = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
            if bytes > available {
                return fail("max_storage_buffer_binding_size", bytes, available, "bytes");
            }
        }
        Kind::Constants | Kind::Input => {}
    }
    Ok(())
}

fn allocate(device: &wgpu::Device, resource: &Resource, size: UVec2, readable: bool) -> Allocation {
    let label = format!("limpid.{}", resource.name);
    match resource.kind {
        Kind::Texture { format, extent } => {
            let extent = extent.of(size);
            let mut usage = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::STORAGE_BINDING;
            usage.set(wgpu::TextureUsages::COPY_SRC, readable || resource.exported);
            let make = || {
                let texture = device.create_texture(&wgpu::TextureDescriptor {
                    label: Some(&label),
                    size: wgpu::Extent3d { width: extent.x, height: extent.y, depth_or_array_layers: 1 },
                    mip_level_count: 1,
                    sample_count: 1,
                    dimension: wgpu::TextureDimension::D2,
                    format: texture_format(format),
                    usage,
                    view_formats: &[],
                });
                let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
                (texture, view)
            };
            Allocation::Textures((0..=usize::from(resource.ping_pong)).map(|_| make()).collect())
        }
        Kind::Buffer { stride, count, indirect } => {
            let mut usage = wgpu::BufferUsages::STORAGE;
            usage.set(wgpu::BufferUsages::INDIRECT, indirect);
            usage.set(wgpu::BufferUsages::COPY_SRC, readable || resource.exported);
            let size = stride * count.of(size);
            Allocation::Buffer(device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(&label),
                size,
                usage,
                mapped_at_creation: false,
            }))
        }
        Kind::Constants | Kind::Input => Allocation::External,
    }
}

impl Allocations {
    /// Allocates everything, zeroed.
    pub(crate) fn new(device: &wgpu::Device, plan: &Plan, readable: bool) -> Result<Self, Error> {
        for resource in &plan.resources {
            check_limits(device, resource, plan.size)?;
        }
        Ok(Self(plan.resources.iter().map(|resource| allocate(device, resource, plan.size, readable)).collect()))
    }

    fn find(&self, plan: &Plan, name: &str) -> Option<(&Allocation, bool)> {
        let index = plan.resources.iter().position(|resource| resource.name == name)?;
        Some((&self.0[index], plan.resources[index].ping_pong))
    }

    /// The texture of a resource in a frame of the given phase.
    pub(crate) fn texture(
        &self,
        plan: &Plan,
        name: &str,
        copy: Copy,
        phase: usize,
    ) -> Option<&(wgpu::Texture, wgpu::TextureView)> {
        match self.find(plan, name)? {
            (Allocation::Textures(textures), ping_pong) => textures.get(copy.index(ping_pong, phase)),
            _ => None,
        }
    }

    /// The buffer of a resource.
    pub(crate) fn buffer(&self, plan: &Plan, name: &str) -> Option<&wgpu::Buffer> {
        match self.find(plan, name)?.0 {
            Allocation::Buffer(buffer) => Some(buffer),
            _ => None,
        }
    }

    /// What to bind for a resource of limpid.
    pub(crate) fn binding(
        &self,
        plan: &Plan,
        name: &str,
        copy: Copy,
        phase: usize,
    ) -> Option<wgpu::BindingResource<'_>> {
        if let Some((_, view)) = self.texture(plan, name, copy, phase) {
            return Some(wgpu::BindingResource::TextureView(view));
        }
        Some(self.buffer(plan, name)?.as_entire_binding())
    }
}
