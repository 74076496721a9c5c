//! The grid of one receiver.

use std::sync::Arc;

use glam::{DVec2, DVec3};

use super::element::{Elements, point_in};
use super::facets::smooth_pieces;
use crate::illumination::Chart;
use crate::illumination::parametrisation::coverage::Polygon;
use crate::light_pass::direct::facet::{Facet, SurfacePoint};
use crate::scene::{Mesh, Scene};

#[derive(Clone, Debug)]
pub struct Grid {
    /// Maps the surface to the texels of the grid.
    pub chart: Arc<Chart>,
    /// Smooth piece of each triangle.
    pub pieces: Vec<u32>,
    pub elements: Elements,
    /// Number of its first element among those of all grids.
    pub first: usize,
    /// Typical area of an element [m²].
    pub usual_m2: f64,
}

impl Grid {
    /// `chart` has the size of the grid; `first` is the number of elements in the grids before it.
    pub fn new(scene: &Scene, chart: &Arc<Chart>, first: usize) -> Self {
        let mesh = scene.objects[chart.object()].mesh_in_scene();
        let pieces = smooth_pieces(mesh, chart);
        let elements = Elements::new(mesh, chart, &pieces);
        let texels = elements.all().chunk_by(|a, b| a.texel == b.texel).count();
        Self {
            chart: Arc::clone(chart),
            usual_m2: mesh.area_m2() / texels.max(1) as f64,
            pieces,
            elements,
            first,
        }
    }

    /// The element at a point of a triangle, numbered over all grids.
    pub fn element_at(&self, triangle: usize, barycentric: [f64; 3]) -> Option<usize> {
        let uv = self.chart.uv(triangle, barycentric);
        let texel_of = |coordinate: f64, count: usize| {
            ((coordinate * count as f64).floor().max(0.0) as usize).min(count - 1) as i64
        };
        let texel = [
            texel_of(uv.x, self.chart.width),
            texel_of(uv.y, self.chart.height),
        ];
        // Rounding may put the point just outside of the element's texel.
        let index = self.nearest(texel, self.pieces[triangle])?;
        Some(self.first + index)
    }

    /// Column and row of an element's texel, and its piece.
    pub fn place(&self, element: usize) -> ([i64; 2], u32) {
        let own = self.elements.all()[element];
        let (texel, width) = (i64::from(own.texel), self.chart.width as i64);
        ([texel % width, texel / width], own.piece)
    }

    /// Index of the element of a piece in a column and row of texels, which may lie outside the grid.
    pub fn element_in(&self, [column, row]: [i64; 2], piece: u32) -> Option<usize> {
        let (width, height) = (self.chart.width as i64, self.chart.height as i64);
        if !(0..width).contains(&column) || !(0..height).contains(&row) {
            return None;
        }
        self.elements.find((row * width + column) as usize, piece)
    }

    /// Elements of a piece in a texel and the eight around it, row by row.
    pub fn around(&self, [column, row]: [i64; 2], piece: u32) -> impl Iterator<Item = usize> {
        let texels = (row - 1..=row + 1)
            .flat_map(move |row| (column - 1..=column + 1).map(move |column| [column, row]));
        texels.filter_map(move |texel| self.element_in(texel, piece))
    }

    /// The element of a piece in a texel, or else one beside it.
    pub fn nearest(&self, texel: [i64; 2], piece: u32) -> Option<usize> {
        let own = self.element_in(texel, piece);
        own.or_else(|| self.around(texel, piece).next())
    }

    /// A point of an element, uniform by area, from a point of the unit square; `None` if its triangle is degenerate.
    pub fn point(&self, mesh: &Mesh, element: usize, square: DVec2) -> Option<SurfacePoint> {
        let (triangle, within) = self.elements.triangle_at(element, square.x);
        let facet = Facet::new(mesh, &self.chart, triangle)?;
        let texel = self.elements.all()[element].texel as usize;
        let [column, row] = [texel % self.chart.width, texel / self.chart.width].map(|index| index as f64);
        let part = Polygon::triangle(facet.corners_texels)
            .clipped(1, row, row + 1.0)
            .clipped(0, column, column + 1.0);
        Some(facet.at(point_in(&part, DVec2::new(within, square.y))))
    }

    /// Memory without the chart.
    pub fn bytes(&self) -> u64 {
        self.elements.bytes() + size_of_val(&self.pieces[..]) as u64
    }
}

/// A direction weighted by the cosine to the shading normal. Directions below the geometric surface are mirrored at it.
pub fn cosine_direction(point: &SurfacePoint, square: DVec2) -> DVec3 {
    let (x, y) = point.shading_normal.any_orthonormal_pair();
    let along = DVec2::from_angle(std::f64::consts::TAU * square.y) * square.x.sqrt();
    let direction = x * along.x + y * along.y + point.shading_normal * (1.0 - square.x).sqrt();
    let below = direction.dot(point.geometric_normal).min(0.0);
    (direction - point.geometric_normal * (2.0 * below)).normalize()
}
