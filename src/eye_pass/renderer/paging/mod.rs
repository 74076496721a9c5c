//! Images in tiles through a page table: all maps and all textures of a scene in two bindings, sent to the device tile
//! by tile, and dropped from it level by level where memory is short.

mod image;
mod level;
mod pool;

pub(super) use image::PagedImage;
pub(super) use level::{Level, Texels, stored};
pub(super) use pool::TilePool;

/// Side of a tile [texels]; `TILE` in the shader.
pub(super) const TILE: usize = 64;
/// Side of what is stored of it: with the texels that follow it, so that a look-up never needs two tiles.
pub(super) const STORED: usize = TILE + 1;

/// Images are halved as long as a side is longer than this [texels]: smaller levels would take a place each and show
/// little more.
const SMALLEST_LEVEL: usize = 16;

/// Whether a coarser level follows one of this size.
pub(super) fn is_halved(size: [usize; 2]) -> bool {
    size.into_iter().any(|side| side > SMALLEST_LEVEL)
}

/// What went to the device, by what had changed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Uploaded {
    /// Tiles of illumination maps on all levels, at most 64×64 texels each; black ones cost no bytes.
    pub tiles: u64,
    /// Bytes of these tiles, with the texels of their neighbours that are stored with them.
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
