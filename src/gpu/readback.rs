//! Copies buffers and textures from the device to the CPU.

use super::Gpu;
use crate::error::Result;

/// Texels of level 0 of a 2D texture (usage `COPY_SRC`), row by row without padding.
///
/// # Errors
/// A lost device; an error of the device.
pub fn read_texture(gpu: &Gpu, texture: &wgpu::Texture) -> Result<Vec<u8>> {
    let texel_bytes = texture.format().block_copy_size(None).unwrap_or(0);
    let row_bytes = texture.width() * texel_bytes;

    // Copies need rows aligned to 256 bytes.
    let stride = row_bytes.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let buffer = staging_buffer(gpu, u64::from(stride) * u64::from(texture.height()));
    let mut encoder = gpu
        .device
        .create_command_encoder(&wgpu::CommandEncoderDescriptor {
            label: Some("read-back"),
        });
    encoder.copy_texture_to_buffer(
        texture.as_image_copy(),
        wgpu::TexelCopyBufferInfo {
            buffer: &buffer,
            layout: wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(stride),
                rows_per_image: None,
            },
        },
        texture.size(),
    );
    gpu.queue.submit([encoder.finish()]);

    // Waits for the copy, then drops the padding of each row.
    let padded = mapped(gpu, &buffer)?;
    Ok(padded
        .chunks_exact(stride as usize)
        .flat_map(|row| &row[..row_bytes as usize])
        .copied()
        .collect())
}

/// Contents of a buffer (usage `COPY_SRC`).
///
/// # Errors
/// A lost device; an error of the device.
pub fn read_buffer(gpu: &Gpu, source: &wgpu::Buffer) -> Result<Vec<u8>> {
    let buffer = staging_buffer(gpu, source.size());
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    encoder.copy_buffer_to_buffer(source, 0, &buffer, 0, source.size());
    gpu.queue.submit([encoder.finish()]);
    mapped(gpu, &buffer)
}

/// Waits for a buffer (usage `MAP_READ`) and returns its contents.
fn mapped(gpu: &Gpu, buffer: &wgpu::Buffer) -> Result<Vec<u8>> {
    // If mapping fails, so does `get_mapped_range` below.
    buffer.map_async(wgpu::MapMode::Read, .., |_| ());
    gpu.wait()?;
    let range = buffer
        .get_mapped_range(..)
        .map_err(|error| super::device_error(&error.to_string()))?;
    Ok(range.to_vec())
}

/// A buffer that the device fills and the CPU reads.
fn staging_buffer(gpu: &Gpu, size: u64) -> wgpu::Buffer {
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("read-back"),
        size,
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    })
}
