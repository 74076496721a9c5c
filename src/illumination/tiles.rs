//! A map in square tiles, each as fine as its light needs, so that memory goes where the caustic is.
//!
//! Positions are given in texels of the finest size, in which files are also written. Each tile of [`SIDE`]² such
//! texels has a level: its own texels are 2^level times as long. Texels are stored tile after tile, row by row in each.

use std::ops::Range;

/// Side of a tile [texels of the finest size].
pub const SIDE: usize = 64;

/// Coarsest level of a tile: it is a single texel.
pub const COARSEST: u8 = 6;

/// Resolution of each tile of a map.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TileLayout {
    width: usize,
    height: usize,
    columns: usize,
    /// By tile, row by row.
    levels: Vec<u8>,
    /// Levels by which each tile is coarser than its light needs.
    lost: Vec<u8>,
    /// Index of the first texel of each tile, followed by the number of all texels.
    begins: Vec<usize>,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tile {
    /// Its texels are 2^level times as long as the finest ones.
    pub level: u8,
    /// Levels by which it is coarser than its light needs.
    pub lost: u8,
    /// First column and row [finest texels].
    pub origin: (usize, usize),
    /// Columns and rows [its own texels].
    pub size: (usize, usize),
    /// Its range among the texels of the map.
    pub texels: Range<usize>,
}

impl TileLayout {
    /// A map of `width` × `height` finest texels, both > 0. `levels` are the levels of its tiles, row by row; `wanted`
    /// are those that their light needs. Levels are limited to [`COARSEST`], and at the border to sizes that a tile
    /// divides into.
    ///
    /// # Panics
    ///
    /// The number of levels must equal that of tiles.
    pub fn new((width, height): (usize, usize), levels: &[u8], wanted: &[u8]) -> Self {
        let (columns, rows) = tile_counts(width, height);
        assert!(
            levels.len() == columns * rows && wanted.len() == levels.len(),
            "one level for each tile"
        );
        let mut layout = Self {
            width,
            height,
            columns,
            levels: Vec::with_capacity(levels.len()),
            lost: Vec::with_capacity(levels.len()),
            begins: vec![0],
        };
        let mut end = 0;
        for (tile, (&level, &wanted)) in levels.iter().zip(wanted).enumerate() {
            let covered = layout.covered(tile);
            let whole = (covered.0 | covered.1).trailing_zeros().min(u32::from(COARSEST)) as u8;
            let level = level.min(whole);
            layout.levels.push(level);
            layout.lost.push(level.saturating_sub(wanted));
            end += (covered.0 >> level) * (covered.1 >> level);
            layout.begins.push(end);
        }
        layout
    }

    /// Width and height [finest texels].
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    pub fn texel_count(&self) -> usize {
        self.begins[self.levels.len()]
    }

    pub fn tile_count(&self) -> usize {
        self.levels.len()
    }

    /// Tiles across and down.
    pub fn tile_counts(&self) -> (usize, usize) {
        (self.columns, self.levels.len() / self.columns)
    }

    /// A tile by its index, row by row.
    pub fn tile(&self, tile: usize) -> Tile {
        let level = self.levels[tile];
        let (width, height) = self.covered(tile);
        Tile {
            level,
            lost: self.lost[tile],
            origin: (tile % self.columns * SIDE, tile / self.columns * SIDE),
            size: (width >> level, height >> level),
            texels: self.begins[tile]..self.begins[tile + 1],
        }
    }

    /// All tiles, row by row.
    pub fn tiles(&self) -> impl Iterator<Item = Tile> + '_ {
        (0..self.levels.len()).map(|tile| self.tile(tile))
    }

    /// Level of the tile that contains a finest texel.
    pub fn level_at(&self, column: usize, row: usize) -> u8 {
        self.levels[self.tile_at(column, row)]
    }

    /// Index of the tile that contains a finest texel.
    pub fn tile_at(&self, column: usize, row: usize) -> usize {
        row / SIDE * self.columns + column / SIDE
    }

    /// The finest level of all tiles in a rectangle [finest texels, inclusive] within the map.
    pub fn finest_between(&self, low: (usize, usize), high: (usize, usize)) -> u8 {
        let rows = low.1 / SIDE..=high.1 / SIDE;
        let columns = low.0 / SIDE..=high.0 / SIDE;
        rows.flat_map(|row| columns.clone().map(move |column| row * self.columns + column))
            .map(|tile| self.levels[tile])
            .min()
            .unwrap_or(0)
    }

    /// Index of the texel that contains a finest texel.
    pub fn texel(&self, column: usize, row: usize) -> usize {
        let tile = self.tile_at(column, row);
        let level = self.levels[tile];
        let across = self.covered(tile).0 >> level;
        self.begins[tile] + ((row % SIDE) >> level) * across + ((column % SIDE) >> level)
    }

    /// Texels under a row of the finest size, from left to right; each repeats once per finest texel of its width.
    pub fn row_texels(&self, row: usize) -> impl Iterator<Item = usize> + '_ {
        let first = row / SIDE * self.columns;
        (first..first + self.columns).flat_map(move |tile| {
            let level = self.levels[tile];
            let (covered, _) = self.covered(tile);
            let begin = self.begins[tile] + ((row % SIDE) >> level) * (covered >> level);
            (0..covered).map(move |column| begin + (column >> level))
        })
    }

    /// Expands values to the finest size, row by row: each texel's value is repeated over its area.
    pub fn dense<T: Copy>(&self, values: &[T]) -> Vec<T> {
        let rows = (0..self.height).flat_map(|row| self.row_texels(row));
        rows.map(|texel| values[texel]).collect()
    }

    /// For each texel, the block of `side` × `side` finest texels that contains its first one, counted row by row.
    /// `side` is a power of two up to [`SIDE`].
    pub fn blocks(&self, side: usize) -> Vec<u32> {
        let columns = self.width.div_ceil(side);
        let mut blocks = Vec::with_capacity(self.texel_count());
        for tile in self.tiles() {
            let (left, top) = tile.origin;
            for row in 0..tile.size.1 {
                let begin = (top + (row << tile.level)) / side * columns;
                let block = |column: usize| (begin + (left + (column << tile.level)) / side) as u32;
                blocks.extend((0..tile.size.0).map(block));
            }
        }
        blocks
    }

    /// Columns and rows of finest texels that a tile covers.
    fn covered(&self, tile: usize) -> (usize, usize) {
        let (column, row) = (tile % self.columns, tile / self.columns);
        (
            SIDE.min(self.width - column * SIDE),
            SIDE.min(self.height - row * SIDE),
        )
    }
}

/// Tiles across and down a map of the given finest size.
pub fn tile_counts(width: usize, height: usize) -> (usize, usize) {
    (width.div_ceil(SIDE), height.div_ceil(SIDE))
}

/// Refines tiles until no two of eight-connected neighbours differ by more than one level.
pub fn balance(levels: &mut [u8], columns: usize) {
    let rows = levels.len() / columns;
    // From fine to coarse, so that no level changes what an earlier one has settled.
    for level in 0..COARSEST {
        let fine: Vec<usize> = (0..levels.len()).filter(|&tile| levels[tile] == level).collect();
        for tile in fine {
            let (column, row) = (tile % columns, tile / columns);
            for row in row.saturating_sub(1)..(row + 2).min(rows) {
                for column in column.saturating_sub(1)..(column + 2).min(columns) {
                    let beside = &mut levels[row * columns + column];
                    *beside = (*beside).min(level + 1);
                }
            }
        }
    }
}
