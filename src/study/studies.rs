//! The studies of built-in scenes by name.

use super::sweep::{Bench, Sweep};
use super::{accuracy, paper};
use crate::error::Result;

/// A study of built-in scenes.
#[derive(Clone, Copy, Debug)]
pub struct Study {
    /// Name on the command line.
    pub name: &'static str,
    /// Purpose, in one line.
    pub what: &'static str,
    sweep: fn(&Bench) -> Result<Sweep>,
}

impl Study {
    const fn new(name: &'static str, what: &'static str, sweep: fn(&Bench) -> Result<Sweep>) -> Self {
        Self { name, what, sweep }
    }

    /// The bakes of the study.
    ///
    /// # Errors
    /// None for built-in scenes and references as shipped.
    pub fn sweep(&self, bench: &Bench) -> Result<Sweep> {
        Ok(Sweep {
            name: self.name,
            what: self.what,
            ..(self.sweep)(bench)?
        })
    }
}

/// All studies: first those that the paper does not have, then those that it has, in its order.
pub const STUDIES: [Study; 11] = [
    Study::new(
        "accuracy",
        "error against CPU time and rays for every built-in scene, with what was predicted",
        accuracy::accuracy,
    ),
    Study::new(
        "scaling",
        "how cost grows with rays, triangles, texels and threads",
        accuracy::scaling,
    ),
    Study::new(
        "table1",
        "Table 1: error, rays and times at the paper's three densities, beside its own figures",
        paper::table1,
    ),
    Study::new(
        "rays",
        "Figure 6a: error against the number of light rays",
        paper::rays,
    ),
    Study::new("sigma", "Figure 6b: error against sigma", paper::sigma),
    Study::new(
        "resolution",
        "Plate 6: maps of 30, 100 and 300 texels across",
        paper::resolution,
    ),
    Study::new(
        "kernels",
        "Figure 5, Plates 1 and 2: shapes and sizes of kernels",
        paper::kernels,
    ),
    Study::new(
        "connectivity",
        "Figure 3: density of nearest hits against areas between neighbouring rays",
        paper::connectivity,
    ),
    Study::new(
        "item-buffer",
        "section 3.1.2: cells of a cube against cells of equal solid angle",
        paper::item_buffer,
    ),
    Study::new(
        "pool",
        "Plates 7 and 8: a pool from above and from below, its waves as a mesh and as bumps",
        paper::pool_plates,
    ),
    Study::new(
        "complex",
        "Plate 9: how a mesh of some 4,000 polygons shows in its caustic",
        paper::complex,
    ),
];
