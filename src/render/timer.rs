//! How long the GPU took.

use std::time::Duration;

use super::RenderError;
use super::error::guarded;
use super::objects::Make;

/// Two timestamps, around the pass.
#[derive(Debug)]
pub(super) struct Timer {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    readable: wgpu::Buffer,
    /// Nanoseconds per tick.
    period: f64,
}

const SIZE: u64 = 16;

impl Timer {
    /// A timer, if the device was made with timestamp queries.
    pub(super) fn new(device: &wgpu::Device, queue: &wgpu::Queue) -> Result<Option<Self>, RenderError> {
        if !device.features().contains(wgpu::Features::TIMESTAMP_QUERY) {
            return Ok(None);
        }
        let buffer = |usage| {
            let usage = wgpu::BufferUsages::COPY_DST | usage;
            let label = Some("timestamps");
            device.make_buffer(&wgpu::BufferDescriptor { label, size: SIZE, usage, mapped_at_creation: false })
        };
        guarded(device, "making a timer", || {
            Some(Self {
                queries: device.make_query_set(&wgpu::QuerySetDescriptor {
                    label: Some("timestamps"),
                    ty: wgpu::QueryType::Timestamp,
                    count: 2,
                }),
                resolved: buffer(wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC),
                readable: buffer(wgpu::BufferUsages::MAP_READ),
                period: f64::from(queue.get_timestamp_period()),
            })
        })
    }

    pub(super) fn writes(&self) -> wgpu::RenderPassTimestampWrites<'_> {
        wgpu::RenderPassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: Some(0),
            end_of_pass_write_index: Some(1),
        }
    }

    /// Makes the timestamps readable once the commands before have run.
    pub(super) fn resolve(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.resolve_query_set(&self.queries, 0..2, &self.resolved, 0);
        encoder.copy_buffer_to_buffer(&self.resolved, 0, &self.readable, 0, SIZE);
    }

    /// Waits for the last pass and says how long it took; `None` if the clock jumped.
    pub(super) fn read(&self, device: &wgpu::Device) -> Result<Option<Duration>, RenderError> {
        let bytes = read_buffer(device, &self.readable)?;
        let mut ticks = bytes.chunks_exact(8).map(|b| b.iter().rev().fold(0, |n, &b| n << 8 | u64::from(b)));
        let (begin, end) = (ticks.next().unwrap_or(0), ticks.next().unwrap_or(0));
        let elapsed = end.checked_sub(begin).map(|ticks| ticks as f64 * self.period);
        Ok(elapsed.map(|nanoseconds| Duration::from_nanos(nanoseconds as u64)))
    }
}

/// Waits for the GPU and copies a buffer out of it.
pub(super) fn read_buffer(device: &wgpu::Device, buffer: &wgpu::Buffer) -> Result<Vec<u8>, RenderError> {
    let doing = "reading back from the device";
    let refused = |message: String| RenderError::Device { doing, message };
    let (send, receive) = std::sync::mpsc::channel();
    guarded(device, doing, || {
        buffer.slice(..).map_async(wgpu::MapMode::Read, move |result| {
            // The receiver waits below; if it is gone, nobody wants to know.
            send.send(result).ok();
        });
        device.poll(wgpu::PollType::wait_indefinitely())
    })?
    .map_err(|e| refused(e.to_string()))?;
    receive.recv().map_err(|e| refused(e.to_string()))?.map_err(|e| refused(e.to_string()))?;
    let bytes = buffer.slice(..).get_mapped_range().map_err(|e| refused(e.to_string()))?.to_vec();
    buffer.unmap();
    Ok(bytes)
}
