//! Buffers that are used again in the next frame and grow when they have to.

use super::RenderError;
use super::error::guarded;
use super::objects::Make;

/// A buffer that is at least as large as was asked for last.
#[derive(Debug)]
pub(super) struct GrowingBuffer {
    label: &'static str,
    usage: wgpu::BufferUsages,
    buffer: Option<wgpu::Buffer>,
}

impl GrowingBuffer {
    /// An empty one.
    pub(super) fn new(label: &'static str, usage: wgpu::BufferUsages) -> Self {
        Self { label, usage: usage | wgpu::BufferUsages::COPY_DST, buffer: None }
    }

    /// Puts data at its start. Returns whether the buffer is another one than before.
    pub(super) fn write(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        data: &[u8],
    ) -> Result<bool, RenderError> {
        let size = data.len() as u64;
        let grows = size > 0 && self.size() < size;
        if grows {
            // Doubling, so that a view that comes closer does not make a new buffer each frame.
            let size = size.next_power_of_two().min(device.limits().max_buffer_size.max(size));
            self.buffer = None;
            let descriptor =
                wgpu::BufferDescriptor { label: Some(self.label), size, usage: self.usage, mapped_at_creation: false };
            self.buffer = Some(guarded(device, self.label, || device.make_buffer(&descriptor))?);
        }
        if let Some(buffer) = &self.buffer
            && size > 0
        {
            queue.write_buffer(buffer, 0, data);
        }
        Ok(grows)
    }

    pub(super) fn size(&self) -> u64 {
        self.buffer.as_ref().map_or(0, wgpu::Buffer::size)
    }

    pub(super) fn get(&self) -> Option<&wgpu::Buffer> {
        self.buffer.as_ref()
    }
}
