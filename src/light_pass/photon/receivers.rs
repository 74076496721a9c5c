//! Maps that light arrives on: places, texels, and what an error on each of them weighs.

use std::sync::{Arc, OnceLock};

use glam::DVec2;

use crate::illumination::{Chart, Receiver};
use crate::light_pass::receiver_maps::ChartFor;

/// The charts of all receivers, each made when it is first asked for.
pub(super) struct Receivers<'a> {
    chart_for: &'a ChartFor<'a>,
    known: Vec<OnceLock<Option<MeasuredChart>>>,
}

/// A chart with its measures.
pub(super) struct MeasuredChart {
    pub(super) chart: Arc<Chart>,
    /// Surface in the map [m²].
    pub(super) area_m2: f64,
    /// Weight of flux [1/m]: the error of a texel's irradiance is relative to the root of its area.
    pub(super) weight: f64,
}

impl<'a> Receivers<'a> {
    /// For a scene with this number of objects.
    pub(super) fn new(objects: usize, chart_for: &'a ChartFor<'a>) -> Self {
        Self {
            chart_for,
            known: Receiver::all(objects).map(|_| OnceLock::new()).collect(),
        }
    }

    /// `None` for a surface that cannot take a map.
    #[inline]
    pub(super) fn get(&self, receiver: Receiver) -> Option<&MeasuredChart> {
        let known = &self.known[receiver.index()];
        known
            .get_or_init(|| (self.chart_for)(receiver).map(MeasuredChart::new))
            .as_ref()
    }

    /// [`MeasuredChart::weight`]; 0 without a map.
    pub(super) fn weight(&self, receiver: Receiver) -> f64 {
        self.get(receiver).map_or(0.0, |chart| chart.weight)
    }
}

impl MeasuredChart {
    fn new(chart: Arc<Chart>) -> Self {
        let area_m2 = chart.area_m2();
        Self {
            area_m2,
            weight: (chart.texel_count() as f64 / area_m2).sqrt(),
            chart,
        }
    }

    /// Texels across and down.
    fn size(&self) -> DVec2 {
        DVec2::new(self.chart.width as f64, self.chart.height as f64)
    }

    /// A point of the surface on the map [texels].
    pub(super) fn place(&self, triangle: usize, barycentric: [f64; 3]) -> DVec2 {
        self.chart.uv(triangle, barycentric) * self.size()
    }

    /// The texel of a place on the map [texels]; `None` if it has no surface.
    pub(super) fn texel_at(&self, place: DVec2) -> Option<u32> {
        let place = place.clamp(DVec2::ZERO, self.size() - 0.5);
        let texel = self.chart.texel_at(place.x as usize, place.y as usize);
        (self.chart.texel_area_m2(texel) > 0.0).then_some(texel as u32)
    }

    /// The four texels around a place with bilinear weights. Texels beyond the border or of other islands leave their
    /// weight to the one that holds the place.
    pub(super) fn tent(&self, place: DVec2, island: u32) -> [(Option<u32>, f64); 4] {
        let own = self.texel_at(place);
        let islands = self.chart.islands();
        let low = (place - 0.5).floor();
        let part = place - 0.5 - low;
        let mut tent = [(own, 0.0); 4];
        for (corner, (texel, weight)) in tent.iter_mut().enumerate() {
            let (right, down) = ((corner % 2) as f64, (corner / 2) as f64);
            let at = low + DVec2::new(right, down);
            *weight = (1.0 - (right - part.x).abs()) * (1.0 - (down - part.y).abs());
            let is_inside = at.cmpge(DVec2::ZERO).all() && at.cmplt(self.size()).all();
            let is_ours =
                || islands.is_none_or(|islands| islands.covers(at.x as usize, at.y as usize, island));
            if is_inside && is_ours() {
                *texel = self.texel_at(at).or(own);
            }
        }
        tent
    }
}
