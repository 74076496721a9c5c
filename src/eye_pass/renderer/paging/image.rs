//! An image in tiles: what of it the device holds, and where.

use bytemuck::Pod;

use super::level::{Level, is_zero, stored};
use super::pool::TilePool;
use super::{STORED, TILE, Uploaded};
use crate::gpu::Gpu;
use crate::scene::texture::Wrap;

/// Entry of a tile that is all zero: it takes no place. `EMPTY` in the shader.
const EMPTY: u32 = u32::MAX;

/// Entry of a tile that is no finer than the next level: it takes no place. `COARSER` in the shader.
const COARSER: u32 = EMPTY - 1;

/// Levels of an image, from fine to coarse; from `finest` on the device holds them.
#[derive(Debug)]
pub(in super::super) struct PagedImage<T> {
    levels: Vec<Level<T>>,
    wrap: [Wrap; 2],
    finest: usize,
    /// Of each level, row by row: the tile's place, [`EMPTY`] or [`COARSER`].
    pages: Vec<Vec<u32>>,
}

impl<T: Pod + PartialEq> PagedImage<T> {
    /// Uploads levels, at least one, each half as large as the one before; of those before `finest` nothing.
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
                .map(|level| vec![EMPTY; level.tiles().iter().product()])
                .collect(),
            finest: levels.len(),
            levels,
            wrap,
        };
        let uploaded = image.set_finest(gpu, pool, finest);
        (image, uploaded)
    }

    /// Texels across and down of the whole image.
    pub(in super::super) fn size(&self) -> [usize; 2] {
        self.levels[0].size
    }

    pub(in super::super) fn level_count(&self) -> usize {
        self.levels.len()
    }

    /// The finest level that the device holds.
    pub(in super::super) fn finest(&self) -> usize {
        self.finest
    }

    /// Places that a level takes, or would take.
    pub(in super::super) fn tiles_of_level(&self, level: usize) -> u64 {
        let level = &self.levels[level];
        let tiles = level.places();
        tiles.filter(|tile| !level.is_empty(self.wrap, *tile)).count() as u64
    }

    /// Replaces the texels of all levels, of the same sizes; uploads the tiles in which any bit differs.
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

    /// Holds the levels from `finest` on, and no finer ones.
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

    /// Gives all places back.
    pub(in super::super) fn release(&mut self, pool: &mut TilePool) {
        for page in self.pages.iter_mut().flatten() {
            release(pool, page);
        }
        self.finest = self.levels.len();
    }

    /// Uploads the tiles of a level that differ from `before`; all of them without.
    fn upload(
        &mut self,
        gpu: &Gpu,
        pool: &mut TilePool,
        index: usize,
        before: Option<&Level<T>>,
    ) -> Uploaded {
        let level = &self.levels[index];
        let [across, _] = level.tiles();
        let mut uploaded = Uploaded::default();
        let mut texels = Vec::with_capacity(STORED * STORED);
        for tile in level.places() {
            if before.is_some_and(|before| !level.differs(before, tile)) {
                continue;
            }
            let page = &mut self.pages[index][tile[1] * across + tile[0]];
            texels.clear();
            if !level.gather(self.wrap, tile, &mut texels) {
                release(pool, page);
                *page = COARSER;
                continue;
            }
            uploaded.tiles += 1;
            if texels.iter().all(is_zero) {
                release(pool, page);
                continue;
            }
            if *page >= COARSER {
                // Where the device has no more room the tile stays dark; the budget keeps well below that.
                if pool.reserve(gpu, 1).is_none() {
                    log::warn!(
                        "the device has no room for another tile of {} texels",
                        TILE * TILE
                    );
                    continue;
                }
                *page = pool.take();
            }
            pool.write(gpu, *page, &texels, stored(tile[0], level.size[0]));
            uploaded.tile_bytes += size_of_val(texels.as_slice()) as u64;
        }
        uploaded
    }

    /// The image's record for the shader, behind `words`: see `paged.wgsl`.
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
                level.tiles()[0] as u32,
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
