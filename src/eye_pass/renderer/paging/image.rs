//! An image in tiles: what of it the device holds, and where.

use bytemuck::Pod;

use super::pool::TilePool;
use super::{STORED, TILE, Uploaded};
use crate::gpu::Gpu;
use crate::scene::texture::Wrap;

/// Entry of a tile that is all zero: it takes no place. `EMPTY` in the shader.
const EMPTY: u32 = u32::MAX;

/// An image at one resolution.
#[derive(Clone, Debug, PartialEq)]
pub(in super::super) struct Level<T> {
    /// Texels across and down, > 0.
    pub(in super::super) size: [usize; 2],
    /// Texels that the unit square of coordinates covers; the last ones may reach beyond it.
    pub(in super::super) extent: [f32; 2],
    /// Row by row.
    pub(in super::super) texels: Vec<T>,
}

impl<T> Level<T> {
    fn tiles(&self) -> [usize; 2] {
        self.size.map(|side| side.div_ceil(TILE))
    }
}

/// Levels of an image, from fine to coarse; from `finest` on the device holds them.
#[derive(Debug)]
pub(in super::super) struct PagedImage<T> {
    levels: Vec<Level<T>>,
    wrap: [Wrap; 2],
    finest: usize,
    /// Of each level, row by row: the tile's place, or [`EMPTY`].
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
        let [across, down] = level.tiles();
        let tiles = (0..down).flat_map(|row| (0..across).map(move |column| [column, row]));
        tiles.filter(|tile| !self.is_empty(level, *tile)).count() as u64
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
        let [across, down] = level.tiles();
        let mut uploaded = Uploaded::default();
        let mut texels = Vec::with_capacity(STORED * STORED);
        for tile in (0..down).flat_map(|row| (0..across).map(move |column| [column, row])) {
            if before.is_some_and(|before| !self.differs(level, before, tile)) {
                continue;
            }
            let page = &mut self.pages[index][tile[1] * across + tile[0]];
            texels.clear();
            gather(level, self.wrap, tile, &mut texels);
            uploaded.tiles += 1;
            if texels.iter().all(is_zero) {
                release(pool, page);
                continue;
            }
            if *page == EMPTY {
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

    fn is_empty(&self, level: &Level<T>, tile: [usize; 2]) -> bool {
        rows(level, self.wrap, tile).all(|mut row| row.all(|index| is_zero(&level.texels[index])))
    }

    /// Whether any bit of a tile differs. What is stored beyond the image's end repeats texels that are looked at.
    fn differs(&self, level: &Level<T>, before: &Level<T>, [column, row]: [usize; 2]) -> bool {
        let [width, height] = level.size;
        let columns = column * TILE..width.min(column * TILE + STORED);
        let mut rows = row * TILE..height.min(row * TILE + STORED);
        rows.any(|row| {
            let range = row * width + columns.start..row * width + columns.end;
            let (old, new) = (&before.texels[range.clone()], &level.texels[range]);
            bytemuck::cast_slice::<T, u8>(old) != bytemuck::cast_slice::<T, u8>(new)
        })
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

fn is_zero<T: Pod>(texel: &T) -> bool {
    bytemuck::bytes_of(texel) == bytemuck::bytes_of(&T::zeroed())
}

fn release(pool: &mut TilePool, page: &mut u32) {
    if *page != EMPTY {
        pool.release(*page);
        *page = EMPTY;
    }
}

/// Indices of what is stored for a tile, row by row: its texels and one more each way, which a bilinear look-up between
/// its last ones needs.
fn rows<T>(
    level: &Level<T>,
    wrap: [Wrap; 2],
    tile: [usize; 2],
) -> impl Iterator<Item = impl Iterator<Item = usize> + use<T>> + use<T> {
    let [width, height] = level.size;
    let [left, top] = tile.map(|index| index * TILE);
    let [across, down] = [0, 1].map(|axis| stored(tile[axis], level.size[axis]));
    (top..top + down).map(move |row| {
        let row = beyond(row, height, wrap[1]);
        (left..left + across).map(move |column| row * width + beyond(column, width, wrap[0]))
    })
}

/// How many texels are stored of a tile along a line of `size`: those that are there and one more.
fn stored(tile: usize, size: usize) -> usize {
    STORED.min(size - tile * TILE + 1)
}

/// A place at or after the end of a line, brought back into it. Mirrored coordinates are folded before they are looked up.
fn beyond(index: usize, size: usize, wrap: Wrap) -> usize {
    match wrap {
        Wrap::Repeat => index % size,
        Wrap::ClampToEdge | Wrap::MirroredRepeat => index.min(size - 1),
    }
}

fn gather<T: Copy>(level: &Level<T>, wrap: [Wrap; 2], tile: [usize; 2], texels: &mut Vec<T>) {
    for row in rows(level, wrap, tile) {
        texels.extend(row.map(|index| level.texels[index]));
    }
}
