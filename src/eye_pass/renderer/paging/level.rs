//! One resolution of an image, row by row or tile by tile.

use bytemuck::Pod;

use super::{STORED, TILE};
use crate::scene::texture::Wrap;

/// An image at one resolution.
#[derive(Clone, Debug, PartialEq)]
pub(in super::super) struct Level<T> {
    /// Texels across and down, > 0.
    pub(in super::super) size: [usize; 2],
    /// Texels that the unit square of coordinates covers; the last ones may reach beyond it.
    pub(in super::super) extent: [f32; 2],
    pub(in super::super) texels: Texels<T>,
}

/// The texels of a level.
#[derive(Clone, Debug, PartialEq)]
pub(in super::super) enum Texels<T> {
    /// Row by row.
    Rows(Vec<T>),
    /// By tile, row by row: what is stored of it; `None` where it is no finer than the next level.
    Tiles(Vec<Option<Vec<T>>>),
}

impl<T: Pod> Level<T> {
    /// Tiles across and down.
    pub(in super::super) fn tiles(&self) -> [usize; 2] {
        self.size.map(|side| side.div_ceil(TILE))
    }

    /// Column and row of all tiles, row by row.
    pub(super) fn places(&self) -> impl Iterator<Item = [usize; 2]> + use<T> {
        let [across, down] = self.tiles();
        (0..down).flat_map(move |row| (0..across).map(move |column| [column, row]))
    }

    /// Whether a tile takes no place: it is all zero, or no finer than the next level.
    pub(super) fn is_empty(&self, wrap: [Wrap; 2], tile: [usize; 2]) -> bool {
        match &self.texels {
            Texels::Rows(texels) => {
                rows(self.size, wrap, tile).all(|mut row| row.all(|index| is_zero(&texels[index])))
            }
            Texels::Tiles(tiles) => tiles[self.index(tile)]
                .as_ref()
                .is_none_or(|texels| texels.iter().all(is_zero)),
        }
    }

    /// Whether any bit of a tile differs from that of a level of the same size. What is stored beyond the image's end
    /// repeats texels that are looked at.
    pub(super) fn differs(&self, before: &Self, tile: [usize; 2]) -> bool {
        let bits = bytemuck::cast_slice::<T, u8>;
        match (&self.texels, &before.texels) {
            (Texels::Rows(new), Texels::Rows(old)) => {
                let ([width, height], [column, row]) = (self.size, tile);
                let columns = column * TILE..width.min(column * TILE + STORED);
                let mut rows = row * TILE..height.min(row * TILE + STORED);
                rows.any(|row| {
                    let range = row * width + columns.start..row * width + columns.end;
                    bits(&old[range.clone()]) != bits(&new[range])
                })
            }
            (Texels::Tiles(new), Texels::Tiles(old)) => {
                match (&old[self.index(tile)], &new[self.index(tile)]) {
                    (Some(old), Some(new)) => bits(old) != bits(new),
                    (old, new) => old.is_some() != new.is_some(),
                }
            }
            _ => true,
        }
    }

    /// Adds what is stored of a tile; false where it is no finer than the next level.
    pub(super) fn gather(&self, wrap: [Wrap; 2], tile: [usize; 2], gathered: &mut Vec<T>) -> bool {
        match &self.texels {
            Texels::Rows(texels) => {
                for row in rows(self.size, wrap, tile) {
                    gathered.extend(row.map(|index| texels[index]));
                }
                true
            }
            Texels::Tiles(tiles) => match &tiles[self.index(tile)] {
                Some(texels) => {
                    gathered.extend_from_slice(texels);
                    true
                }
                None => false,
            },
        }
    }

    fn index(&self, [column, row]: [usize; 2]) -> usize {
        row * self.tiles()[0] + column
    }
}

pub(super) fn is_zero<T: Pod>(texel: &T) -> bool {
    bytemuck::bytes_of(texel) == bytemuck::bytes_of(&T::zeroed())
}

/// Indices of what is stored for a tile, row by row: its texels and one more each way, which a bilinear look-up between
/// its last ones needs.
fn rows(
    [width, height]: [usize; 2],
    wrap: [Wrap; 2],
    tile: [usize; 2],
) -> impl Iterator<Item = impl Iterator<Item = usize>> {
    let [left, top] = tile.map(|index| index * TILE);
    let [across, down] = [stored(tile[0], width), stored(tile[1], height)];
    (top..top + down).map(move |row| {
        let row = beyond(row, height, wrap[1]);
        (left..left + across).map(move |column| row * width + beyond(column, width, wrap[0]))
    })
}

/// How many texels are stored of a tile along a line of `size`: those that are there and one more.
pub(in super::super) fn stored(tile: usize, size: usize) -> usize {
    STORED.min(size - tile * TILE + 1)
}

/// A place at or after the end of a line, brought back into it. Mirrored coordinates are folded before they are looked up.
fn beyond(index: usize, size: usize, wrap: Wrap) -> usize {
    match wrap {
        Wrap::Repeat => index % size,
        Wrap::ClampToEdge | Wrap::MirroredRepeat => index.min(size - 1),
    }
}
