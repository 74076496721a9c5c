//! Coarser levels of a map: area-weighted means of irradiance that never mix texels of places that are adjacent only in
//! the map.

use rayon::iter::{IntoParallelIterator, ParallelIterator};

use super::paging::is_halved;
use crate::illumination::Chart;
use crate::illumination::gutter::neighbours;
use crate::illumination::islands::Islands;

/// Irradiance per texel [W/m²].
type Irradiance = Vec<[f32; 3]>;

/// How the mip levels of a map follow from each other, except for tiled maps.
#[derive(Debug)]
pub(super) struct Minification {
    /// Size of each level [texels], from fine to coarse.
    sizes: Vec<[usize; 2]>,
    /// Surface area under each texel [m²], by level; empty if all are equal.
    areas: Vec<Vec<f32>>,
}

impl Minification {
    pub(super) fn of(chart: &Chart) -> Self {
        // A surface that fills its map evenly has texels of equal area and no islands: sizes of levels tell all.
        let mut sizes = vec![[chart.width, chart.height]];
        if chart.is_full() {
            while let Some(&last) = sizes.last().filter(|size| is_halved(**size)) {
                sizes.push(halved(last));
            }
            return Self {
                sizes,
                areas: Vec::new(),
            };
        }

        // Elsewhere means are weighted by surface area, so that texels without surface do not darken the levels.
        let mut areas = vec![
            chart
                .texel_areas_m2
                .iter()
                .map(|area| *area as f32)
                .collect::<Vec<_>>(),
        ];

        // Islands are adjacent only in the map: levels end before a texel, or a lookup, would blend two of them.
        let mut owners = chart.islands().map(|islands| {
            let texels = 0..chart.width * chart.height;
            texels.map(|texel| Owner::of(islands, texel)).collect::<Vec<_>>()
        });
        while let Some(&fine) = sizes.last().filter(|size| is_halved(**size)) {
            if let Some(fine_owners) = &owners {
                match coarser_owners(fine_owners, fine) {
                    Some(coarse) => owners = Some(coarse),
                    None => break,
                }
            }
            let area = |texel: usize| {
                children(texel, fine)
                    .map(|child| areas[sizes.len() - 1][child])
                    .sum()
            };
            let size = halved(fine);
            areas.push((0..size[0] * size[1]).map(area).collect());
            sizes.push(size);
        }
        Self { sizes, areas }
    }

    pub(super) fn sizes(&self) -> &[[usize; 2]] {
        &self.sizes
    }

    /// The mip levels of a map, without level 0.
    pub(super) fn coarser(&self, irradiance: &[[f32; 3]]) -> Vec<Irradiance> {
        let mut levels: Vec<Irradiance> = Vec::with_capacity(self.sizes.len() - 1);
        for index in 1..self.sizes.len() {
            let fine = levels.last().map_or(irradiance, Vec::as_slice);
            let level = self.level(index, fine);
            levels.push(level);
        }
        levels
    }

    fn level(&self, index: usize, fine: &[[f32; 3]]) -> Irradiance {
        let (fine_size, size) = (self.sizes[index - 1], self.sizes[index]);
        let fine_areas = self.areas.get(index - 1);
        let mean = |texel: usize| {
            let (mut sum, mut weight) = ([0.0f32; 3], 0.0f32);
            for child in children(texel, fine_size) {
                let area = fine_areas.map_or(1.0, |areas| areas[child]);
                for (sum, value) in sum.iter_mut().zip(fine[child]) {
                    *sum += area * value;
                }
                weight += area;
            }
            if weight > 0.0 {
                sum.map(|sum| sum / weight)
            } else {
                [0.0; 3]
            }
        };
        let rows = 0..size[1];
        let mut level: Irradiance = rows
            .into_par_iter()
            .flat_map_iter(|row| (0..size[0]).map(move |column| mean(row * size[0] + column)))
            .collect();
        if let Some(areas) = self.areas.get(index) {
            fill_beside(&mut level, areas, size);
        }
        level
    }
}

/// Fills uncovered texels with the mean of their covered neighbours: lookups at a border reach half a texel beyond it.
fn fill_beside(level: &mut [[f32; 3]], areas: &[f32], [width, height]: [usize; 2]) {
    for texel in (0..level.len()).filter(|texel| areas[*texel] <= 0.0) {
        let around = neighbours(texel, width, height).filter(|neighbour| areas[*neighbour] > 0.0);
        let (sum, count) = around.fold(([0.0f32; 3], 0.0f32), |(mut sum, count), neighbour| {
            for (sum, value) in sum.iter_mut().zip(level[neighbour]) {
                *sum += value;
            }
            (sum, count + 1.0)
        });
        if count > 0.0 {
            level[texel] = sum.map(|sum| sum / count);
        }
    }
}

fn halved(size: [usize; 2]) -> [usize; 2] {
    size.map(|side| side.div_ceil(2))
}

/// The up to four texels of the finer level, of the given size, that a texel covers.
fn children(texel: usize, [width, height]: [usize; 2]) -> impl Iterator<Item = usize> {
    let across = width.div_ceil(2);
    let (column, row) = (2 * (texel % across), 2 * (texel / across));
    let rows = row..(row + 2).min(height);
    rows.flat_map(move |row| (column..(column + 2).min(width)).map(move |column| row * width + column))
}

/// The island that a texel belongs to.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Owner {
    Nobody,
    Island(u32),
    /// Several islands share the texel, already in level 0.
    Several,
}

impl Owner {
    fn of(islands: &Islands, texel: usize) -> Self {
        match islands.owner(texel) {
            Ok(island) => Self::Island(island),
            Err(true) => Self::Several,
            Err(false) => Self::Nobody,
        }
    }

    /// Whether texels of the two may be blended.
    fn may_mix(self, other: Self) -> bool {
        match (self, other) {
            (Self::Island(a), Self::Island(b)) => a == b,
            (Self::Several, Self::Island(_)) | (Self::Island(_), Self::Several) => false,
            _ => true,
        }
    }

    fn with(self, other: Self) -> Self {
        if self == Self::Nobody { other } else { self }
    }
}

/// Owners of the texels of the next level; `None` if a texel, or a lookup between two texels, would blend islands.
fn coarser_owners(fine: &[Owner], fine_size: [usize; 2]) -> Option<Vec<Owner>> {
    let [width, height] = halved(fine_size);
    let mut coarse = Vec::with_capacity(width * height);
    for texel in 0..width * height {
        let mut owner = Owner::Nobody;
        for child in children(texel, fine_size) {
            if !owner.may_mix(fine[child]) {
                return None;
            }
            owner = owner.with(fine[child]);
        }
        coarse.push(owner);
    }
    let is_apart = |texel: usize| {
        let mut around = neighbours(texel, width, height);
        around.all(|neighbour| coarse[texel].may_mix(coarse[neighbour]))
    };
    (0..width * height).all(is_apart).then_some(coarse)
}
