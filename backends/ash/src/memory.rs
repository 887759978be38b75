//! Where memory comes from.

use std::ptr::NonNull;

use ash::vk;

/// What a block of memory is for.
#[derive(Debug, Clone)]
pub struct MemoryRequest<'a> {
    /// Names of the resources that will lie in it, for debuggers.
    pub name: &'a str,
    /// Size, alignment and types.
    pub requirements: vk::MemoryRequirements,
    /// Whether the CPU writes it: then it must be host-visible, host-coherent and mapped. Otherwise it should be
    /// device-local.
    pub is_written_by_cpu: bool,
    /// Whether it holds buffers (linear) rather than images with optimal tiling. Both when they share it.
    pub is_linear: bool,
    /// Whether its content matters only while a frame is executed. An engine may place such a block where it
    /// has other data before and after the frame's denoising, and then orders those accesses itself.
    pub is_transient: bool,
}

/// A block of memory.
#[derive(Debug, Clone, Copy)]
pub struct MemoryBlock {
    /// The memory object.
    pub memory: vk::DeviceMemory,
    /// Where in it, aligned as asked for.
    pub offset: u64,
    /// Address of the block's first byte, for blocks that the CPU writes.
    pub mapped: Option<NonNull<u8>>,
    /// For the allocator to know it by.
    pub key: u64,
}

// SAFETY: the pointer is only an address; what may be done with it is a matter of the contract of `MemorySource`.
unsafe impl Send for MemoryBlock {}
// SAFETY: as above.
unsafe impl Sync for MemoryBlock {}

/// Why no memory could be had.
pub type MemoryError = Box<dyn std::error::Error + Send + Sync>;

/// An allocator of device memory: the engine's own, or [`GpuAllocator`].
///
/// # Safety
///
/// A block must meet its request, stay valid and untouched by others until it is freed (but see
/// [`MemoryRequest::is_transient`]), and `mapped` must be given exactly where the CPU writes.
pub unsafe trait MemorySource: Send {
    /// Allocates a block.
    ///
    /// # Errors
    ///
    /// When there is none left.
    fn allocate(&mut self, request: &MemoryRequest<'_>) -> Result<MemoryBlock, MemoryError>;

    /// Frees a block that `allocate` returned. The device no longer uses it.
    fn free(&mut self, block: MemoryBlock);
}

#[cfg(feature = "gpu-allocator")]
pub use with_gpu_allocator::GpuAllocator;

#[cfg(feature = "gpu-allocator")]
mod with_gpu_allocator {
    use std::collections::HashMap;
    use std::sync::{Arc, Mutex, PoisonError};

    use gpu_allocator::MemoryLocation;
    use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme, Allocator};

    use super::{MemoryBlock, MemoryError, MemoryRequest, MemorySource};

    /// Memory from an [`Allocator`] that may be shared with the rest of the application. It must have been made
    /// for the device that the denoiser uses.
    pub struct GpuAllocator {
        allocator: Arc<Mutex<Allocator>>,
        allocations: HashMap<u64, Allocation>,
        next_key: u64,
    }

    impl GpuAllocator {
        /// Takes memory from `allocator`.
        pub fn new(allocator: Arc<Mutex<Allocator>>) -> Self {
            Self { allocator, allocations: HashMap::new(), next_key: 0 }
        }
    }

    // SAFETY: gpu-allocator keeps to requirements and maps what the CPU writes; the allocation is held until it is
    // freed.
    unsafe impl MemorySource for GpuAllocator {
        fn allocate(&mut self, request: &MemoryRequest<'_>) -> Result<MemoryBlock, MemoryError> {
            let location = if request.is_written_by_cpu { MemoryLocation::CpuToGpu } else { MemoryLocation::GpuOnly };
            let descriptor = AllocationCreateDesc {
                name: request.name,
                requirements: request.requirements,
                location,
                linear: request.is_linear,
                allocation_scheme: AllocationScheme::GpuAllocatorManaged,
            };
            let allocation = self.allocator.lock().unwrap_or_else(PoisonError::into_inner).allocate(&descriptor)?;
            let key = self.next_key;
            self.next_key += 1;
            // SAFETY: the memory object is only bound at this allocation's offset, never freed or mapped.
            let memory = unsafe { allocation.memory() };
            let mapped = allocation.mapped_ptr().filter(|_| request.is_written_by_cpu).map(|pointer| pointer.cast());
            let block = MemoryBlock { memory, offset: allocation.offset(), mapped, key };
            self.allocations.insert(key, allocation);
            Ok(block)
        }

        fn free(&mut self, block: MemoryBlock) {
            if let Some(allocation) = self.allocations.remove(&block.key) {
                // It fails only for allocations of another allocator.
                let _ = self.allocator.lock().unwrap_or_else(PoisonError::into_inner).free(allocation);
            }
        }
    }
}
