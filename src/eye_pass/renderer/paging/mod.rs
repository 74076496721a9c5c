//! Tiled images behind a page table: all maps and textures of a scene in two bindings, uploaded tile by tile, and
//! evicted level by level where memory is short.

use bytemuck::Pod;

use crate::gpu::{Gpu, texture_of};

mod image;

pub(super) use image::PagedImage;
pub(super) use image::{Level, stored};

/// Side of a tile [texels]; `TILE` in the shader.
pub(super) const TILE: usize = 64;
/// Side of a tile as stored: one texel more, so that a bilinear lookup never needs two tiles.
pub(super) const STORED: usize = TILE + 1;

/// Images are halved while a side is longer than this [texels]: smaller levels would each take a whole slot for little
/// benefit.
const SMALLEST_LEVEL: usize = 16;

/// Whether a level of this size is followed by a coarser one.
pub(super) fn is_halved(size: [usize; 2]) -> bool {
    size.into_iter().any(|side| side > SMALLEST_LEVEL)
}

/// What was uploaded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Uploaded {
    /// Tiles of illumination maps on all levels, at most 64×64 texels each; black ones cost no bytes.
    pub tiles: u64,
    /// Bytes of these tiles, including the texels of neighbouring tiles that are stored with them.
    pub tile_bytes: u64,
    /// Bytes of everything else: geometry, map coordinates, materials, textures.
    pub other_bytes: u64,
}

impl Uploaded {
    pub(super) fn other(bytes: usize) -> Self {
        Self {
            other_bytes: bytes as u64,
            ..Self::default()
        }
    }
}

impl std::ops::AddAssign for Uploaded {
    fn add_assign(&mut self, other: Self) {
        self.tiles += other.tiles;
        self.tile_bytes += other.tile_bytes;
        self.other_bytes += other.other_bytes;
    }
}

/// Slots side by side in a layer; `POOL_ACROSS` in the shader.
const ACROSS: u32 = 31;
/// Slots of a full layer.
const PER_LAYER: u32 = ACROSS * ACROSS;

/// Slots for tiles of one texel format. The texture grows on demand.
#[derive(Debug)]
pub(in super::super) struct TilePool {
    texture: wgpu::Texture,
    format: wgpu::TextureFormat,
    label: &'static str,
    /// Rows of slots in each layer; full height if there are several layers.
    rows: u32,
    layers: u32,
    /// Slots handed out so far, including those that are free again.
    used: u32,
    free: Vec<u32>,
}

impl TilePool {
    pub(in super::super) fn new(gpu: &Gpu, label: &'static str, format: wgpu::TextureFormat) -> Self {
        Self {
            texture: texture(gpu, label, format, 1, 1),
            format,
            label,
            rows: 1,
            layers: 1,
            used: 0,
            free: Vec::new(),
        }
    }

    /// Makes room for this many more tiles; `None` if it exceeds the limits of the device's textures.
    fn reserve(&mut self, gpu: &Gpu, tiles: u32) -> Option<()> {
        let wanted = (self.used + tiles).saturating_sub(self.free.len() as u32);
        if wanted <= self.capacity() {
            return Some(());
        }
        let rows = wanted.div_ceil(ACROSS).next_power_of_two().min(ACROSS);
        let layers = wanted.div_ceil(PER_LAYER);
        if layers > gpu.limits().max_texture_array_layers {
            return None;
        }
        let grown = texture(gpu, self.label, self.format, rows, layers);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        encoder.copy_texture_to_texture(
            self.texture.as_image_copy(),
            grown.as_image_copy(),
            self.texture.size(),
        );
        gpu.queue.submit([encoder.finish()]);
        (self.texture, self.rows, self.layers) = (grown, rows, layers);
        Some(())
    }

    /// Takes a reserved slot.
    fn take(&mut self) -> u32 {
        self.free.pop().unwrap_or_else(|| {
            self.used += 1;
            self.used - 1
        })
    }

    fn release(&mut self, place: u32) {
        self.free.push(place);
    }

    /// Writes texels into a slot, `width` of them per row, starting at its corner.
    fn write<T: Pod>(&self, gpu: &Gpu, place: u32, texels: &[T], width: usize) {
        let [x, y, z] = origin(place);
        gpu.queue.write_texture(
            wgpu::TexelCopyTextureInfo {
                texture: &self.texture,
                mip_level: 0,
                origin: wgpu::Origin3d { x, y, z },
                aspect: wgpu::TextureAspect::All,
            },
            bytemuck::cast_slice(texels),
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some((width * size_of::<T>()) as u32),
                rows_per_image: None,
            },
            wgpu::Extent3d {
                width: width as u32,
                height: (texels.len() / width) as u32,
                depth_or_array_layers: 1,
            },
        );
    }

    /// Texels of the whole pool, of tiles given by place, width and texels; zero where none is.
    pub(in super::super) fn filled<T: Pod>(
        &self,
        tiles: impl Iterator<Item = (u32, usize, Vec<T>)>,
    ) -> Vec<T> {
        let [across, down, layers] = self.size().map(|side| side as usize);
        let mut filled = vec![T::zeroed(); across * down * layers];
        for (place, width, texels) in tiles {
            let [x, y, layer] = origin(place).map(|at| at as usize);
            for (row, texels) in texels.chunks_exact(width).enumerate() {
                let first = (layer * down + y + row) * across + x;
                filled[first..first + width].copy_from_slice(texels);
            }
        }
        filled
    }

    /// Texels across and down, and layers.
    pub(in super::super) fn size(&self) -> [u32; 3] {
        let size = self.texture.size();
        [size.width, size.height, size.depth_or_array_layers]
    }

    /// Slots in use.
    pub(in super::super) fn tiles(&self) -> u64 {
        u64::from(self.used) - self.free.len() as u64
    }

    /// All slots, as shaders read them.
    pub(in super::super) fn view(&self) -> wgpu::TextureView {
        self.texture.create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(wgpu::TextureViewDimension::D2Array),
            ..Default::default()
        })
    }

    /// Whether most of it is free, so that a smaller one would do.
    pub(in super::super) fn is_sparse(&self) -> bool {
        self.rows > 1 && 4 * self.tiles() < u64::from(self.capacity())
    }

    /// An empty pool in its place.
    pub(in super::super) fn emptied(&self, gpu: &Gpu) -> Self {
        Self::new(gpu, self.label, self.format)
    }

    fn capacity(&self) -> u32 {
        self.rows * ACROSS * self.layers
    }
}

/// The corner of a slot: column, row, layer.
pub(super) fn origin(place: u32) -> [u32; 3] {
    let (within, side) = (place % PER_LAYER, STORED as u32);
    [within % ACROSS * side, within / ACROSS * side, place / PER_LAYER]
}

fn texture(gpu: &Gpu, label: &str, format: wgpu::TextureFormat, rows: u32, layers: u32) -> wgpu::Texture {
    let size = [ACROSS * STORED as u32, rows * STORED as u32, layers];
    let usage =
        wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST | wgpu::TextureUsages::COPY_SRC;
    gpu.device.create_texture(&texture_of(label, size, format, usage))
}
