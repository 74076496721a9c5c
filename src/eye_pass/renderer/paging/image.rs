//! A tiled image, and which of its tiles are resident on the device.

use bytemuck::Pod;
use rayon::iter::{IntoParallelIterator, ParallelIterator};

use super::{STORED, TILE, TilePool, Uploaded};
use crate::gpu::Gpu;
use crate::scene::texture::Wrap;

/// Page of an all-zero tile, which takes no slot. `EMPTY` in the shader.
const EMPTY: u32 = u32::MAX;

/// Page of a tile that is no finer than the next level and takes no slot. `COARSER` in the shader.
const COARSER: u32 = EMPTY - 1;

/// An image with its mip levels, from fine to coarse. Levels from `finest` on are resident.
#[derive(Debug)]
pub(in super::super) struct PagedImage<T> {
    levels: Vec<Level<T>>,
    wrap: [Wrap; 2],
    finest: usize,
    /// By level, row by row: the slot of a tile, [`EMPTY`] or [`COARSER`].
    pages: Vec<Vec<u32>>,
}

impl<T: Pod> PagedImage<T> {
    /// Uploads an image from level `finest` on. There is at least one level, and each is half as large as the one
    /// before.
    pub(in super::super) fn new(
        gpu: &Gpu,
        pool: &mut TilePool,
        levels: Vec<Level<T>>,
        wrap: [Wrap; 2],
        finest: usize,
    ) -> (Self, Uploaded) {
        let mut image = Self {
            pages: levels
                .iter()
                .map(|level| vec![EMPTY; level.tiles.len()])
                .collect(),
            finest: levels.len(),
            levels,
            wrap,
        };
        let uploaded = image.set_finest(gpu, pool, finest);
        (image, uploaded)
    }

    /// Size of the finest level [texels].
    pub(in super::super) fn size(&self) -> [usize; 2] {
        self.levels[0].size
    }

    pub(in super::super) fn level_count(&self) -> usize {
        self.levels.len()
    }

    /// The finest resident level.
    pub(in super::super) fn finest(&self) -> usize {
        self.finest
    }

    /// Number of slots that a level takes when resident.
    pub(in super::super) fn tiles_of_level(&self, level: usize) -> u64 {
        let tiles = self.levels[level].tiles.iter().flatten();
        tiles.filter(|texels| !texels.iter().all(is_zero)).count() as u64
    }

    /// Replaces the texels of all levels, whose sizes stay, and uploads the tiles in which any bit differs.
    pub(in super::super) fn update(
        &mut self,
        gpu: &Gpu,
        pool: &mut TilePool,
        levels: Vec<Level<T>>,
    ) -> Uploaded {
        let before = std::mem::replace(&mut self.levels, levels);
        let mut uploaded = Uploaded::default();
        for (level, before) in before.iter().enumerate().skip(self.finest) {
            uploaded += self.upload(gpu, pool, level, Some(before));
        }
        uploaded
    }

    /// The tiles that take a slot: slot, level, and index within the level.
    pub(in super::super) fn held(&self) -> impl Iterator<Item = (u32, &Level<T>, usize)> {
        self.levels.iter().zip(&self.pages).flat_map(|(level, pages)| {
            let held = pages.iter().enumerate().filter(|(_, page)| **page < COARSER);
            held.map(move |(tile, page)| (*page, level, tile))
        })
    }

    /// Slot, width and texels of each tile that takes one.
    pub(in super::super) fn tiles(&self) -> impl Iterator<Item = (u32, usize, Vec<T>)> {
        self.held().filter_map(|(page, level, tile)| {
            Some((page, level.stored_across(tile), level.tiles[tile].clone()?))
        })
    }

    /// Makes levels from `finest` on resident and evicts finer ones.
    pub(in super::super) fn set_finest(&mut self, gpu: &Gpu, pool: &mut TilePool, finest: usize) -> Uploaded {
        let finest = finest.min(self.levels.len() - 1);
        for page in self.pages[..finest].iter_mut().flatten() {
            release(pool, page);
        }
        let mut uploaded = Uploaded::default();
        for level in finest..self.finest {
            uploaded += self.upload(gpu, pool, level, None);
        }
        self.finest = finest;
        uploaded
    }

    /// Uploads the resident levels into a pool that has taken the place of the one before.
    pub(in super::super) fn move_to(&mut self, gpu: &Gpu, pool: &mut TilePool) -> Uploaded {
        let finest = std::mem::replace(&mut self.finest, self.levels.len());
        self.pages.iter_mut().for_each(|pages| pages.fill(EMPTY));
        self.set_finest(gpu, pool, finest)
    }

    /// Frees all slots.
    pub(in super::super) fn release(&mut self, pool: &mut TilePool) {
        for page in self.pages.iter_mut().flatten() {
            release(pool, page);
        }
        self.finest = self.levels.len();
    }

    /// Uploads the tiles of a level that differ from `before`, or all tiles if that is `None`.
    fn upload(
        &mut self,
        gpu: &Gpu,
        pool: &mut TilePool,
        index: usize,
        before: Option<&Level<T>>,
    ) -> Uploaded {
        // Tiles are compared bit by bit; those that did not change stay where they are.
        let level = &self.levels[index];
        let mut uploaded = Uploaded::default();
        for (tile, texels) in level.tiles.iter().enumerate() {
            if before.is_some_and(|before| bits(before.tiles[tile].as_deref()) == bits(texels.as_deref())) {
                continue;
            }

            // Black tiles and those that are no finer than the next level take no slot: their page tells the shader.
            let page = &mut self.pages[index][tile];
            let Some(texels) = texels else {
                release(pool, page);
                *page = COARSER;
                continue;
            };
            uploaded.tiles += 1;
            if texels.iter().all(is_zero) {
                release(pool, page);
                continue;
            }

            if *page >= COARSER {
                // If the device has no room left, the tile stays dark; the budget keeps well below that.
                if pool.reserve(gpu, 1).is_none() {
                    log::warn!(
                        "the device has no room for another tile of {} texels",
                        TILE * TILE
                    );
                    continue;
                }
                *page = pool.take();
            }

            pool.write(gpu, *page, texels, level.stored_across(tile));
            uploaded.tile_bytes += size_of_val(texels.as_slice()) as u64;
        }
        uploaded
    }

    /// Appends the image's record for the shader to `words`: see `images.wgsl`.
    pub(in super::super) fn write_record(&self, words: &mut Vec<u32>, scale: f32) {
        let wrap = self.wrap.map(|wrap| match wrap {
            Wrap::ClampToEdge => 0,
            Wrap::Repeat => 1,
            Wrap::MirroredRepeat => 2,
        });
        words.extend([
            self.finest as u32,
            self.levels.len() as u32,
            scale.to_bits(),
            wrap[0] | wrap[1] << 2,
        ]);
        let mut first_page = words.len() + 6 * self.levels.len();
        for (level, pages) in self.levels.iter().zip(&self.pages) {
            let [width, height] = level.size.map(|side| side as u32);
            words.extend([
                width,
                height,
                level.extent[0].to_bits(),
                level.extent[1].to_bits(),
                first_page as u32,
                level.across() as u32,
            ]);
            first_page += pages.len();
        }
        words.extend(self.pages.iter().flatten());
    }
}

fn release(pool: &mut TilePool, page: &mut u32) {
    if *page < COARSER {
        pool.release(*page);
    }
    *page = EMPTY;
}

/// One mip level of an image.
#[derive(Clone, Debug, PartialEq)]
pub(in super::super) struct Level<T> {
    /// Texels across and down, > 0.
    pub(in super::super) size: [usize; 2],
    /// Texels that the unit square of coordinates spans; the last ones may extend beyond it.
    pub(in super::super) extent: [f32; 2],
    /// Stored texels of each tile, row by row; `None` if it is no finer than the next level.
    pub(in super::super) tiles: Vec<Option<Vec<T>>>,
}

impl<T: Pod + Send + Sync> Level<T> {
    /// A level of texels row by row, all of which are held.
    pub(in super::super) fn of_rows(
        size: [usize; 2],
        extent: [f32; 2],
        wrap: [Wrap; 2],
        texels: &[T],
    ) -> Self {
        let [across, down] = size.map(|side| side.div_ceil(TILE));
        let gather = |tile: usize| Some(stored_texels(size, wrap, [tile % across, tile / across], texels));
        Self {
            size,
            extent,
            tiles: (0..across * down).into_par_iter().map(gather).collect(),
        }
    }
}

impl<T> Level<T> {
    /// Tiles across.
    fn across(&self) -> usize {
        self.size[0].div_ceil(TILE)
    }

    /// Column and row of a tile.
    pub(in super::super) fn place(&self, tile: usize) -> [usize; 2] {
        [tile % self.across(), tile / self.across()]
    }

    /// Stored texels across a tile.
    fn stored_across(&self, tile: usize) -> usize {
        stored(tile % self.across(), self.size[0])
    }
}

/// The bytes of a tile's texels, since texels that are not numbers never equal themselves.
fn bits<T: Pod>(texels: Option<&[T]>) -> Option<&[u8]> {
    texels.map(bytemuck::cast_slice)
}

pub(super) fn is_zero<T: Pod>(texel: &T) -> bool {
    bytemuck::bytes_of(texel) == bytemuck::bytes_of(&T::zeroed())
}

/// The stored texels of a tile, row by row: its own, and one more in each direction for bilinear lookups between its
/// last ones.
fn stored_texels<T: Copy>(
    [width, height]: [usize; 2],
    wrap: [Wrap; 2],
    tile: [usize; 2],
    texels: &[T],
) -> Vec<T> {
    let [left, top] = tile.map(|index| index * TILE);
    let [across, down] = [stored(tile[0], width), stored(tile[1], height)];
    let rows = (top..top + down).map(|row| width * beyond(row, height, wrap[1]));
    let columns = (left..left + across).map(|column| beyond(column, width, wrap[0]));
    rows.flat_map(|row| columns.clone().map(move |column| texels[row + column]))
        .collect()
}

/// Number of stored texels of a tile along a side of `size` texels: those that exist, and one more.
pub(in super::super) fn stored(tile: usize, size: usize) -> usize {
    STORED.min(size - tile * TILE + 1)
}

/// Wraps an index that may lie beyond the end of a side. Mirrored coordinates are folded before the lookup.
fn beyond(index: usize, size: usize, wrap: Wrap) -> usize {
    match wrap {
        Wrap::Repeat => index % size,
        Wrap::ClampToEdge | Wrap::MirroredRepeat => index.min(size - 1),
    }
}
