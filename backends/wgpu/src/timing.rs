//! Time of each pass by timestamp queries.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};
use std::time::Duration;

/// How long a pass took on the device.
#[derive(Debug, Clone, PartialEq)]
pub struct PassTime {
    /// Name of the pass.
    pub pass: String,
    /// From its start to its end.
    pub duration: Duration,
}

const FREE: u8 = 0;
const RECORDED: u8 = 1;
const MAPPED: u8 = 2;

/// A buffer that one frame's timestamps are copied to, until they are read.
struct Slot {
    readback: wgpu::Buffer,
    state: Arc<AtomicU8>,
}

pub(crate) struct Timing {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    slots: Vec<Slot>,
    latest: Option<usize>,
    passes: Vec<String>,
    /// Nanoseconds of a tick.
    period: f32,
}

/// Frames whose times can be waiting to be read.
const SLOT_COUNT: usize = 3;

impl Timing {
    pub(crate) fn new(device: &wgpu::Device, queue: &wgpu::Queue, passes: Vec<String>) -> Self {
        let count = 2 * passes.len() as u32;
        let size = u64::from(count) * u64::from(wgpu::QUERY_SIZE);
        let buffer = |usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("limpid.timestamps"),
                size,
                usage,
                mapped_at_creation: false,
            })
        };
        Self {
            queries: device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("limpid.timestamps"),
                ty: wgpu::QueryType::Timestamp,
                count,
            }),
            resolved: buffer(wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC),
            slots: (0..SLOT_COUNT)
                .map(|_| Slot {
                    readback: buffer(wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ),
                    state: Arc::new(AtomicU8::new(FREE)),
                })
                .collect(),
            latest: None,
            passes,
            period: queue.get_timestamp_period(),
        }
    }

    pub(crate) fn writes(&self, pass: usize) -> wgpu::ComputePassTimestampWrites<'_> {
        wgpu::ComputePassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: Some(2 * pass as u32),
            end_of_pass_write_index: Some(2 * pass as u32 + 1),
        }
    }

    /// Copies the times of all passes to a slot that nobody is reading; drops them if there is none.
    pub(crate) fn resolve(&mut self, encoder: &mut wgpu::CommandEncoder) {
        let free = self.slots.iter().position(|slot| slot.state.load(Ordering::Acquire) != MAPPED);
        self.latest = free;
        if let Some(slot) = free.map(|index| &self.slots[index]) {
            let count = 2 * self.passes.len() as u32;
            encoder.resolve_query_set(&self.queries, 0..count, &self.resolved, 0);
            encoder.copy_buffer_to_buffer(&self.resolved, 0, &slot.readback, 0, slot.readback.size());
            slot.state.store(RECORDED, Ordering::Release);
        }
    }

    /// Calls back with the times of the frame recorded and submitted last, once the device has been polled.
    pub(crate) fn read(&self, callback: impl FnOnce(Vec<PassTime>) + Send + 'static) {
        let Some(slot) = self.latest.map(|index| &self.slots[index]) else { return };
        if slot.state.swap(MAPPED, Ordering::AcqRel) != RECORDED {
            return;
        }
        let (readback, state) = (slot.readback.clone(), Arc::clone(&slot.state));
        let (passes, period) = (self.passes.clone(), self.period);
        slot.readback.map_async(wgpu::MapMode::Read, .., move |result| {
            let view = result.ok().and_then(|()| readback.get_mapped_range(..).ok());
            if let Some(view) = view {
                let times = pass_times(bytemuck::pod_collect_to_vec(&view[..]), passes, period);
                drop(view);
                readback.unmap();
                state.store(FREE, Ordering::Release);
                callback(times);
            }
        });
    }
}

fn pass_times(ticks: Vec<u64>, passes: Vec<String>, period: f32) -> Vec<PassTime> {
    let time = |(pass, ticks): (String, &[u64])| {
        let nanoseconds = ticks[1].saturating_sub(ticks[0]) as f64 * f64::from(period);
        PassTime { pass, duration: Duration::from_nanos(nanoseconds as u64) }
    };
    passes.into_iter().zip(ticks.chunks_exact(2)).map(time).collect()
}
