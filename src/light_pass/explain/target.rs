//! The texel that is probed.

use std::sync::{Arc, OnceLock};

use glam::{DVec2, DVec3};

use crate::geometry::Ray;
use crate::illumination::{Chart, Receiver, Side};
use crate::light_pass::path::Arrival;
use crate::transport::{SurfaceHit, Tracer};

/// Distance from a ray's hit to its intersection with the texel's plane [texels] above which the surface is not flat
/// enough for the plane.
const FLAT_TEXELS: f64 = 3.0;

/// A point of a receiver and the texel that stores its light.
#[derive(Clone, Debug)]
pub struct Target {
    pub receiver: Receiver,
    /// [m].
    pub point: DVec3,
    /// Unit vector, by the triangle's winding.
    pub geometric_normal: DVec3,
    /// Column and row of the texel's first corner, in finest texels of the chart.
    pub corner: [usize; 2],
    /// Width of the texel in finest texels.
    pub size: usize,
    /// Index among the chart's texels.
    pub texel: usize,
    /// Surface area under the texel [m²].
    pub area_m2: f64,
    pub(super) chart: Arc<Chart>,
    /// The point relative to the texel's corner [texels].
    pub(super) place: DVec2,
    /// Rows of the matrix from a displacement in the plane [m] to texels.
    rows: [DVec3; 2],
}

impl Target {
    /// The texel under a point that is seen along a direction; `None` if the chart has none there.
    pub fn new(tracer: &Tracer, chart: &Arc<Chart>, hit: &SurfaceHit, direction: DVec3) -> Option<Self> {
        // The finest texel under the point. Rounding may put points on the border just outside of the map.
        let receiver = Receiver::new(hit.object, Side::met(direction, hit.geometric_normal));
        let corners = tracer.scene().objects[hit.object]
            .mesh_in_scene()
            .corners(hit.triangle);
        let uv = chart.uv(hit.triangle, hit.barycentric);
        let size = DVec2::new(chart.width as f64, chart.height as f64);
        let at = uv * size;
        let within = |at: f64, count: usize| (at.max(0.0) as usize).min(count - 1);
        let (column, row) = (within(at.x, chart.width), within(at.y, chart.height));

        // In a coarser tile, texels begin at multiples of their own size.
        let level = chart
            .layout
            .as_ref()
            .map_or(0, |layout| layout.level_at(column, row));
        let corner = [column >> level << level, row >> level << level];
        let texels = f64::from(1_u32 << level);
        let texel = chart.texel_at(column, row);
        let area_m2 = chart.texel_area_m2(texel);

        // The Jacobian turns displacements in the triangle's plane into texels. A collapsed triangle has none.
        let rows = chart.texel_from_world(hit.triangle, corners)?;
        (receiver == chart.receiver && area_m2 > 0.0).then(|| Self {
            receiver,
            point: hit.point,
            geometric_normal: hit.geometric_normal,
            corner,
            size: 1 << level,
            texel,
            area_m2,
            chart: Arc::clone(chart),
            place: (at - corner_of(corner)) / texels,
            rows: rows.map(|row| row / texels),
        })
    }

    /// Where light that arrives at the receiver along a ray lands, relative to the texel's corner [texels]: by the
    /// texel's plane near by, by the chart elsewhere.
    pub(super) fn landing(&self, ray: &Ray, arrival: &Arrival) -> DVec2 {
        let slope = ray.direction.dot(self.geometric_normal);
        let distance_m = (self.point - ray.origin).dot(self.geometric_normal) / slope;
        let on_plane = ray.origin + ray.direction * distance_m;
        let step = on_plane - self.point;
        let place = self.place + DVec2::new(self.rows[0].dot(step), self.rows[1].dot(step));
        if on_plane.distance(arrival.point) < FLAT_TEXELS * self.area_m2.sqrt() {
            return place;
        }
        let size = DVec2::new(self.chart.width as f64, self.chart.height as f64);
        let [b, c] = arrival.barycentric.to_array();
        let at = self.chart.uv(arrival.triangle as usize, [1.0 - b - c, b, c]) * size;
        (at - corner_of(self.corner)) / self.size as f64
    }

    /// A chart of this texel alone.
    pub(super) fn chart_of_texel(&self) -> Chart {
        let size = DVec2::new(self.chart.width as f64, self.chart.height as f64);
        let place = |uv: DVec2| (uv * size - corner_of(self.corner)) / self.size as f64;
        Chart {
            corner_uvs: self.chart.corner_uvs.iter().map(|uvs| uvs.map(place)).collect(),
            width: 1,
            height: 1,
            texel_areas_m2: vec![self.area_m2],
            layout: None,
            beyond: Vec::new(),
            joints: Vec::new(),
            islands: OnceLock::new(),
            ..*self.chart
        }
    }
}

fn corner_of([column, row]: [usize; 2]) -> DVec2 {
    DVec2::new(column as f64, row as f64)
}
