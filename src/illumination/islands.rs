//! The islands of a chart. Islands that touch in the map need not touch on the surface, so a kernel of flux must not
//! cross from one to the next.

use std::collections::HashMap;

use glam::DVec2;

use super::Chart;
use super::parametrisation::coverage;
use crate::geometry::DisjointSets;

/// Marks a texel that several islands share.
const SHARED: u32 = u32::MAX;
/// Marks an uncovered texel.
const NONE: u32 = u32::MAX - 1;

/// The island of each triangle and texel.
#[derive(Clone, Debug)]
pub struct Islands {
    of_triangle: Vec<u32>,
    of_texel: Vec<u32>,
    width: usize,
}

impl Islands {
    /// Finds the islands of a chart; `None` if there is only one.
    pub fn find(chart: &Chart) -> Option<Self> {
        // A single island needs no owners of texels: no kernel can leave it.
        let of_triangle = connect(&chart.corner_uvs);
        let first = *of_triangle.first()?;
        if of_triangle.iter().all(|&island| island == first) {
            return None;
        }
        // Only surfaces that fill their map are tiled: texels need no owner there.
        let (width, height) = match chart.layout {
            Some(_) => (1, 1),
            None => (chart.width, chart.height),
        };

        // A texel that several islands touch has no owner, however little each covers of it.
        let size = DVec2::new(width as f64, height as f64);
        let mut of_texel = vec![NONE; width * height];
        for (corners, &island) in chart.corner_uvs.iter().zip(&of_triangle) {
            let corners = corners.map(|corner| corner * size);
            for row in coverage::rows(corners, height) {
                coverage::for_each_texel_in_row(corners, row, width, |column, _| {
                    let texel = &mut of_texel[row * width + column];
                    *texel = if *texel == NONE || *texel == island {
                        island
                    } else {
                        SHARED
                    };
                });
            }
        }
        Some(Self {
            of_triangle,
            of_texel,
            width,
        })
    }

    /// The island of a triangle.
    pub fn of_triangle(&self, triangle: usize) -> u32 {
        self.of_triangle[triangle]
    }

    /// The only island that covers a texel. `Err(true)` if several do, `Err(false)` if none does.
    pub fn owner(&self, texel: usize) -> Result<u32, bool> {
        match self.of_texel[texel] {
            SHARED => Err(true),
            NONE => Err(false),
            island => Ok(island),
        }
    }

    /// Whether an island covers any part of a texel.
    pub fn covers(&self, column: usize, row: usize, island: u32) -> bool {
        let owner = self.of_texel[row * self.width + column];
        owner == island || owner == SHARED
    }
}

/// The island of each triangle, counted from 0. Triangles that share a corner position are connected.
fn connect(corner_uvs: &[[DVec2; 3]]) -> Vec<u32> {
    let mut islands = DisjointSets::new(corner_uvs.len());
    let mut at: HashMap<(u64, u64), usize> = HashMap::new();
    for (triangle, corners) in corner_uvs.iter().enumerate() {
        for corner in corners {
            // Adding zero turns −0 into +0.
            let place = ((corner.x + 0.0).to_bits(), (corner.y + 0.0).to_bits());
            islands.join(triangle, *at.entry(place).or_insert(triangle));
        }
    }
    islands.sets()
}
