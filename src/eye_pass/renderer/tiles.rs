//! Images of half floats on the device, of which only the tiles that changed are sent again.

use half::f16;
use wgpu::util::DeviceExt;

use crate::gpu::Gpu;

/// Largest value written: below the end of half floats, 65504, with room to spare.
const LARGEST_VALUE: f32 = 32768.0;
/// Least peak that a kept scale leaves [written value]: 21 binary orders of half floats are below it.
const LEAST_PEAK: f32 = 128.0;
/// Side of a tile [texels].
pub(super) const TILE: usize = 64;

/// A texel: linear red, green, blue and one.
pub(super) type Texel = [f16; 4];

/// What went to the device, by what had changed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Uploaded {
    /// Tiles of illumination maps, at most 64×64 texels each.
    pub tiles: u64,
    /// Bytes of these tiles.
    pub tile_bytes: u64,
    /// Bytes of everything else: geometry, map coordinates, materials.
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

/// The power of two by which a peak [any unit] is divided to lie in (16384, 32768]; 1 for nothing. Powers of two
/// change no digit, and half floats keep all of theirs down to 2⁻²⁹ of the peak.
pub(super) fn scale_for_half_floats(peak: f32) -> f32 {
    if peak > 0.0 && peak.is_finite() {
        (peak / LARGEST_VALUE).log2().ceil().exp2()
    } else {
        1.0
    }
}

/// The present scale where a peak still fits it, so that what did not change keeps its bits; else the peak's own.
pub(super) fn kept_scale(present: f32, peak: f32) -> f32 {
    let written = peak / present;
    if (LEAST_PEAK..=LARGEST_VALUE).contains(&written) {
        present
    } else {
        scale_for_half_floats(peak)
    }
}

/// Layers of the same size on the device, with a copy of their texels.
#[derive(Debug)]
pub(super) struct TiledImage {
    texture: wgpu::Texture,
    size: [usize; 2],
    /// Layer by layer, row by row.
    texels: Vec<Texel>,
}

impl TiledImage {
    /// Uploads `layers` × height × width texels.
    pub(super) fn new(
        gpu: &Gpu,
        label: &str,
        [width, height]: [usize; 2],
        texels: Vec<Texel>,
    ) -> (Self, Uploaded) {
        let layers = texels.len() / (width * height);
        let texture = gpu.device.create_texture_with_data(
            &gpu.queue,
            &wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d {
                    width: width as u32,
                    height: height as u32,
                    depth_or_array_layers: layers as u32,
                },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: wgpu::TextureFormat::Rgba16Float,
                usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
                view_formats: &[],
            },
            wgpu::util::TextureDataOrder::LayerMajor,
            bytemuck::cast_slice(&texels),
        );
        let uploaded = Uploaded {
            tiles: (layers * width.div_ceil(TILE) * height.div_ceil(TILE)) as u64,
            tile_bytes: size_of_val(texels.as_slice()) as u64,
            other_bytes: 0,
        };
        let size = [width, height];
        (
            Self {
                texture,
                size,
                texels,
            },
            uploaded,
        )
    }

    /// Texels across and down.
    pub(super) fn size(&self) -> [usize; 2] {
        self.size
    }

    /// Texels of all layers, layer by layer, row by row.
    pub(super) fn texels(&self) -> &[Texel] {
        &self.texels
    }

    /// What they take on the device [bytes].
    pub(super) fn bytes(&self) -> u64 {
        size_of_val(self.texels.as_slice()) as u64
    }

    /// To be read by shaders as one layer, or as an array of all.
    pub(super) fn view(&self, dimension: wgpu::TextureViewDimension) -> wgpu::TextureView {
        self.texture.create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(dimension),
            ..Default::default()
        })
    }

    /// Replaces all texels, as many as there are, and uploads the tiles in which any bit differs.
    pub(super) fn update(&mut self, gpu: &Gpu, texels: Vec<Texel>) -> Uploaded {
        debug_assert_eq!(texels.len(), self.texels.len(), "an image keeps its size");
        let before = std::mem::replace(&mut self.texels, texels);
        let [width, height] = self.size;
        let mut uploaded = Uploaded::default();
        for layer in 0..self.texels.len() / (width * height) {
            for row in (0..height).step_by(TILE) {
                for column in (0..width).step_by(TILE) {
                    let extent = [TILE.min(width - column), TILE.min(height - row)];
                    if self.differs(&before, [column, row, layer], extent) {
                        self.write(gpu, [column, row, layer], extent);
                        uploaded.tiles += 1;
                        uploaded.tile_bytes += (extent[0] * extent[1] * size_of::<Texel>()) as u64;
                    }
                }
            }
        }
        uploaded
    }

    fn index(&self, [column, row, layer]: [usize; 3]) -> usize {
        let [width, height] = self.size;
        (layer * height + row) * width + column
    }

    fn differs(&self, before: &[Texel], [column, row, layer]: [usize; 3], extent: [usize; 2]) -> bool {
        (row..row + extent[1]).any(|row| {
            let first = self.index([column, row, layer]);
            let range = first..first + extent[0];
            let (old, new) = (&before[range.clone()], &self.texels[range]);
            bytemuck::cast_slice::<Texel, u8>(old) != bytemuck::cast_slice::<Texel, u8>(new)
        })
    }

    fn write(&self, gpu: &Gpu, origin: [usize; 3], [width, height]: [usize; 2]) {
        let [x, y, z] = origin.map(|index| index as u32);
        gpu.queue.write_texture(
            wgpu::TexelCopyTextureInfo {
                texture: &self.texture,
                mip_level: 0,
                origin: wgpu::Origin3d { x, y, z },
                aspect: wgpu::TextureAspect::All,
            },
            bytemuck::cast_slice(&self.texels[self.index(origin)..]),
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some((self.size[0] * size_of::<Texel>()) as u32),
                rows_per_image: None,
            },
            wgpu::Extent3d {
                width: width as u32,
                height: height as u32,
                depth_or_array_layers: 1,
            },
        );
    }
}

/// Half floats of values [any unit] divided by a scale.
pub(super) fn texel(values: [f32; 3], scale: f32) -> Texel {
    let [r, g, b] = values.map(|value| f16::from_f32(value / scale));
    [r, g, b, f16::ONE]
}
