//! Times of passes.

use std::sync::Arc;
use std::time::Duration;

use ash::vk;

use crate::Error;
use crate::gpu::Shared;

/// How long a pass took on the device.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PassTime {
    /// Name of the pass.
    pub pass: String,
    /// From its start to its end. Passes may overlap.
    pub duration: Duration,
}

/// Two queries for each pass, for each frame in flight.
pub(crate) struct Timing {
    gpu: Arc<Shared>,
    queries: vk::QueryPool,
    passes: u32,
}

impl Drop for Timing {
    fn drop(&mut self) {
        // SAFETY: the device has finished with it.
        unsafe { self.gpu.device.destroy_query_pool(self.queries, None) };
    }
}

impl Timing {
    pub(crate) fn new(gpu: &Arc<Shared>, passes: usize, frames: usize) -> Result<Self, Error> {
        if gpu.timestamp_valid_bits == 0 {
            return Err(Error::Unsupported { what: "timestamps on the queue family".to_owned() });
        }
        let passes = passes as u32;
        let info = vk::QueryPoolCreateInfo::default()
            .query_type(vk::QueryType::TIMESTAMP)
            .query_count(2 * passes * frames as u32);
        // SAFETY: there is at least one query.
        let queries = unsafe { gpu.device.create_query_pool(&info, None) }
            .map_err(Error::vulkan("creating the timestamp queries"))?;
        gpu.name(queries, "limpid timestamps");
        Ok(Self { gpu: Arc::clone(gpu), queries, passes })
    }

    fn first(&self, slot: usize) -> u32 {
        2 * self.passes * slot as u32
    }

    /// # Safety
    ///
    /// `commands` is being recorded outside of a render pass, and the device has finished the slot's last frame.
    pub(crate) unsafe fn reset(&self, commands: vk::CommandBuffer, slot: usize) {
        // SAFETY: as the caller promises.
        unsafe { self.gpu.device.cmd_reset_query_pool(commands, self.queries, self.first(slot), 2 * self.passes) };
    }

    /// Notes the start of a pass, or its end.
    ///
    /// # Safety
    ///
    /// `commands` is being recorded, after the slot was reset.
    pub(crate) unsafe fn write(&self, commands: vk::CommandBuffer, slot: usize, pass: usize, is_end: bool) {
        let stage = if is_end { vk::PipelineStageFlags::COMPUTE_SHADER } else { vk::PipelineStageFlags::TOP_OF_PIPE };
        let query = self.first(slot) + 2 * pass as u32 + u32::from(is_end);
        // SAFETY: as the caller promises.
        unsafe { self.gpu.device.cmd_write_timestamp(commands, stage, self.queries, query) };
    }

    /// The times of a slot, if the device has finished it.
    pub(crate) fn read<'n>(
        &self,
        slot: usize,
        passes: impl Iterator<Item = &'n str>,
    ) -> Result<Option<Vec<PassTime>>, Error> {
        let mut ticks = vec![0u64; 2 * self.passes as usize];
        let flags = vk::QueryResultFlags::TYPE_64;
        // SAFETY: queries of the slot were reset and written.
        match unsafe { self.gpu.device.get_query_pool_results(self.queries, self.first(slot), &mut ticks, flags) } {
            Ok(()) => {}
            Err(vk::Result::NOT_READY) => return Ok(None),
            Err(result) => return Err(Error::vulkan("reading timestamps")(result)),
        }
        let period = f64::from(self.gpu.limits.timestamp_period);
        let mask = u64::MAX >> (64 - self.gpu.timestamp_valid_bits.min(64));
        let time = |(pass, ticks): (&str, &[u64])| {
            let nanoseconds = (ticks[1].wrapping_sub(ticks[0]) & mask) as f64 * period;
            PassTime { pass: pass.to_owned(), duration: Duration::from_nanos(nanoseconds as u64) }
        };
        Ok(Some(passes.zip(ticks.chunks_exact(2)).map(time).collect()))
    }
}
