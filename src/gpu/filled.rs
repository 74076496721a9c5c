//! Buffers that are made with their contents.

use super::Gpu;

impl Gpu {
    /// A buffer that holds these bytes, with zeros up to the next multiple of four, and four bytes at least. On a lost
    /// device nothing is written: what is made there is of no use, and [`Gpu::take_error`] tells why.
    pub fn filled_buffer(&self, label: &str, contents: &[u8], usage: wgpu::BufferUsages) -> wgpu::Buffer {
        let whole = contents.len().max(1) as u64;
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: whole.next_multiple_of(wgpu::COPY_BUFFER_ALIGNMENT),
            usage,
            mapped_at_creation: true,
        });
        if let Ok(mut range) = buffer.get_mapped_range_mut(..) {
            range.slice(..contents.len()).copy_from_slice(contents);
        }
        buffer.unmap();
        buffer
    }
}
