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

    /// The texel of a place where a bundle of an island deposits; `None` beside the map, and where others lie.
    pub(super) fn texel_of_island(&self, place: DVec2, island: u32) -> Option<u32> {
        let is_inside = place.cmpge(DVec2::ZERO).all() && place.cmplt(self.size()).all();
        let is_ours = || {
            let islands = self.chart.islands();
            islands.is_none_or(|islands| islands.covers(place.x as usize, place.y as usize, island))
        };
        (is_inside && is_ours()).then(|| self.texel_at(place)).flatten()
    }

    /// The four texels around a place with bilinear weights. Texels beyond the border or of other islands leave their
    /// weight to the one that holds the place, and so do those with less than half of its surface: in a sliver, a little
    /// flux would be much irradiance.
    pub(super) fn tent(&self, place: DVec2, island: u32) -> [(Option<u32>, f64); 4] {
        let own = self.texel_at(place);
        let area_m2 = |texel: u32| self.chart.texel_area_m2(texel as usize);
        let least_m2 = own.map_or(0.0, |own| 0.5 * area_m2(own));
        let low = (place - 0.5).floor();
        let part = place - 0.5 - low;
        let mut tent = [(own, 0.0); 4];
        for (corner, (texel, weight)) in tent.iter_mut().enumerate() {
            let (right, down) = ((corner % 2) as f64, (corner / 2) as f64);
            let at = low + DVec2::new(right, down);
            *weight = (1.0 - (right - part.x).abs()) * (1.0 - (down - part.y).abs());
            let around = self.texel_of_island(at, island);
            *texel = around.filter(|around| area_m2(*around) >= least_m2).or(own);
        }
        tent
    }
}
