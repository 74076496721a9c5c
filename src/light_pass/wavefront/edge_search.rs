//! How closely the wavefront is searched for borders and small features.

/// How closely a wavefront is looked at where its light changes its way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeSearch {
    /// Bisections of an edge on which the brightest light changes its way; dimmer light is cut as much more coarsely.
    pub cut_bits: i32,
    /// How often a cell is divided for a sharp corner in it.
    pub corner_levels: u32,
    /// Cells across a caster that is smaller than a few cells, once they are fine enough.
    pub cells_across_casters: f64,
}

impl EdgeSearch {
    /// Each border shows on the map. A corner is cut off in a 1,024th of its cell.
    pub const SHARP: Self = Self {
        cut_bits: 8,
        corner_levels: 5,
        cells_across_casters: 160.0,
    };

    /// Light that hardly shows beside that of others.
    pub const DIM: Self = Self {
        cut_bits: 5,
        corner_levels: 1,
        cells_across_casters: 32.0,
    };
}
