//! An element: the part of one smooth piece of a surface under one texel of a grid. Elements exchange indirect light.

use glam::DVec2;

use crate::illumination::Chart;
use crate::illumination::parametrisation::coverage::{
    Polygon, for_each_texel_in_row, rows, twice_signed_area,
};
use crate::scene::Mesh;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Element {
    /// Row · width + column in the grid.
    pub texel: u32,
    /// Number of its smooth piece.
    pub piece: u32,
    /// On the surface [m²], > 0.
    pub area_m2: f64,
    /// Its centroid [texels of the grid].
    pub middle: DVec2,
    /// Index of its first part. Its parts end where those of the next element begin.
    first_part: u32,
}

/// The part of an element on one triangle.
#[derive(Clone, Copy, Debug)]
struct ElementTriangle {
    triangle: u32,
    /// Share of the element's area up to the end of this part.
    until: f64,
}

/// All elements of a grid, ordered by texel, then piece.
#[derive(Clone, Debug)]
pub struct Elements {
    all: Vec<Element>,
    parts: Vec<ElementTriangle>,
    /// Those of texel t are `all[first[t]..first[t + 1]]`.
    first: Vec<u32>,
}

/// A triangle's share of a texel, before shares are grouped into elements.
struct TriangleShare {
    texel: u32,
    piece: u32,
    triangle: u32,
    area_m2: f64,
    middle: DVec2,
}

impl Elements {
    /// `pieces`: the smooth piece of each triangle.
    pub fn new(mesh: &Mesh, chart: &Chart, pieces: &[u32]) -> Self {
        let mut cuts = cuts(mesh, chart, pieces);
        cuts.sort_unstable_by_key(|cut| (cut.texel, cut.piece, cut.triangle));
        let mut elements = Self {
            all: Vec::new(),
            parts: Vec::with_capacity(cuts.len()),
            first: Vec::new(),
        };
        for group in cuts.chunk_by(|a, b| (a.texel, a.piece) == (b.texel, b.piece)) {
            elements.push(group);
        }
        let texels = chart.width * chart.height;
        elements.first = vec![0; texels + 1];
        for element in &elements.all {
            elements.first[element.texel as usize + 1] += 1;
        }
        for texel in 0..texels {
            elements.first[texel + 1] += elements.first[texel];
        }
        elements
    }

    fn push(&mut self, group: &[TriangleShare]) {
        let area_m2: f64 = group.iter().map(|cut| cut.area_m2).sum();
        let middle: DVec2 = group.iter().map(|cut| cut.middle * cut.area_m2).sum();
        self.all.push(Element {
            texel: group[0].texel,
            piece: group[0].piece,
            area_m2,
            middle: middle / area_m2,
            first_part: self.parts.len() as u32,
        });
        let mut sum_m2 = 0.0;
        for cut in group {
            sum_m2 += cut.area_m2;
            self.parts.push(ElementTriangle {
                triangle: cut.triangle,
                until: sum_m2 / area_m2,
            });
        }
    }

    pub fn all(&self) -> &[Element] {
        &self.all
    }

    /// Indices of a texel's elements.
    pub fn of_texel(&self, texel: usize) -> std::ops::Range<usize> {
        self.first[texel] as usize..self.first[texel + 1] as usize
    }

    /// The element of a piece at a texel.
    pub fn find(&self, texel: usize, piece: u32) -> Option<usize> {
        self.of_texel(texel).find(|&index| self.all[index].piece == piece)
    }

    /// Samples a triangle of an element by a share of the element's area in [0, 1). Also returns the share within the
    /// triangle's part.
    pub fn triangle_at(&self, element: usize, share: f64) -> (u32, f64) {
        let first = self.all[element].first_part as usize;
        let end = self
            .all
            .get(element + 1)
            .map_or(self.parts.len(), |next| next.first_part as usize);
        let parts = &self.parts[first..end];
        let index = parts
            .partition_point(|part| part.until <= share)
            .min(parts.len() - 1);
        let low = if index == 0 { 0.0 } else { parts[index - 1].until };
        let width = parts[index].until - low;
        let within = if width > 0.0 { (share - low) / width } else { 0.5 };
        (parts[index].triangle, within.clamp(0.0, 1.0))
    }

    pub fn bytes(&self) -> u64 {
        (size_of_val(&self.all[..]) + size_of_val(&self.parts[..]) + size_of_val(&self.first[..])) as u64
    }
}

fn cuts(mesh: &Mesh, chart: &Chart, pieces: &[u32]) -> Vec<TriangleShare> {
    let size = DVec2::new(chart.width as f64, chart.height as f64);
    let mut cuts = Vec::new();
    for (triangle, uvs) in chart.corner_uvs.iter().enumerate() {
        let corners = uvs.map(|uv| uv * size);
        let [a, b, c] = mesh.corners(triangle);
        let twice_m2 = (b - a).cross(c - a).length();
        let twice_texel2 = twice_signed_area(corners).abs();
        if twice_m2 <= 0.0 || twice_texel2 <= 0.0 {
            continue;
        }
        for row in rows(corners, chart.height) {
            for_each_texel_in_row(corners, row, chart.width, |column, part| {
                let area_m2 = part.area() * (twice_m2 / twice_texel2);
                if area_m2 > 0.0 {
                    cuts.push(TriangleShare {
                        texel: (row * chart.width + column) as u32,
                        piece: pieces[triangle],
                        triangle: triangle as u32,
                        area_m2,
                        middle: part.centroid(),
                    });
                }
            });
        }
    }
    cuts
}

/// A point of a polygon, uniform by area, from a point of the unit square.
pub fn point_in(polygon: &Polygon, square: DVec2) -> DVec2 {
    let corners = polygon.corners();
    let fan = |index: usize| [corners[0], corners[index], corners[index + 1]];
    let area = |index: usize| 0.5 * twice_signed_area(fan(index)).abs();
    let count = corners.len().saturating_sub(2);
    let whole: f64 = (1..=count).map(area).sum();
    let mut left = square.x * whole;
    for index in 1..=count {
        let own = area(index);
        if left <= own || index == count {
            let across = if own > 0.0 {
                (left / own).clamp(0.0, 1.0)
            } else {
                0.5
            };
            let [a, b, c] = fan(index);
            // Uniform over the triangle: the distance from its first corner grows with the square root.
            let root = across.sqrt();
            return a * (1.0 - root) + b * (root * (1.0 - square.y)) + c * (root * square.y);
        }
        left -= own;
    }
    polygon.centroid()
}
