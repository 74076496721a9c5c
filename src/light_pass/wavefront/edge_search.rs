//! How closely the wavefront is searched for borders and small features.

/// How closely a wavefront is searched where the path of its light changes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeSearch {
    /// Bisections of an edge along which the path of the brightest light changes; dimmer light gets fewer.
    pub cut_bits: i32,
    /// Most divisions of a cell for a sharp corner in it.
    pub corner_levels: u32,
    /// Cells across a caster that is smaller than a few cells, after division.
    pub cells_across_casters: f64,
}

impl EdgeSearch {
    /// Every border shows on the map. A corner is cut off in a 1,024th of its cell.
    pub const SHARP: Self = Self {
        cut_bits: 8,
        corner_levels: 5,
        cells_across_casters: 160.0,
    };

    /// To find small casters at all.
    pub const ROUGH: Self = Self {
        cut_bits: 0,
        corner_levels: 0,
        cells_across_casters: 2.0,
    };

    /// For light that hardly shows next to that of other lights.
    pub const DIM: Self = Self {
        cut_bits: 5,
        corner_levels: 1,
        cells_across_casters: 32.0,
    };
}
