//! Storage buffers that grow with what they hold.

use bytemuck::Pod;

use crate::gpu::Gpu;

/// A buffer that shaders read, with a copy of what it holds.
#[derive(Debug)]
pub(super) struct Storage {
    label: &'static str,
    buffer: wgpu::Buffer,
    written: Vec<u8>,
}

/// Buffers have some size even without content [bytes].
const LEAST_BYTES: u64 = 256;

impl Storage {
    pub(super) fn new(gpu: &Gpu, label: &'static str) -> Self {
        Self {
            label,
            buffer: buffer(gpu, label, LEAST_BYTES),
            written: Vec::new(),
        }
    }

    /// Holds these items; sends them where they differ from what it held, and tells how many bytes that took.
    pub(super) fn write<T: Pod>(&mut self, gpu: &Gpu, items: &[T]) -> usize {
        let bytes: &[u8] = bytemuck::cast_slice(items);
        if bytes == self.written {
            return 0;
        }
        if bytes.len() as u64 > self.buffer.size() {
            self.buffer = buffer(gpu, self.label, (bytes.len() as u64).next_power_of_two());
        }
        gpu.queue.write_buffer(&self.buffer, 0, bytes);
        self.written = bytes.to_vec();
        bytes.len()
    }

    pub(super) fn binding(&self) -> wgpu::BindingResource<'_> {
        self.buffer.as_entire_binding()
    }
}

fn buffer(gpu: &Gpu, label: &str, size: u64) -> wgpu::Buffer {
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size,
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}
