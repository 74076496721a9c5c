//! Compares two bakes of one scene texel by texel: where one brings more light than the other, and how much.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::{Chart, IlluminationMap, Receiver};
use crate::error::{Error, Result};
use crate::optics::luminance;

#[derive(Clone, Debug)]
pub struct SignedMap {
    /// Chart of the finer map.
    pub chart: Arc<Chart>,
    /// Luminance of the first bake minus that of the second, per texel of the chart [W/m²].
    pub irradiance: Vec<f32>,
    /// Mean luminance of the first bake over the surface [W/m²], or of the second if the first has no map.
    pub mean_w_m2: f64,
}

/// Difference of two bakes in the luminance of all layers together.
#[derive(Clone, Debug)]
pub struct Difference {
    /// One per surface that has a map in either bake, in the order of `Scene::objects`.
    pub maps: Vec<SignedMap>,
    /// Flux of all maps of the first bake [W].
    pub with_w: f64,
    /// Flux of all maps of the second bake [W].
    pub without_w: f64,
    /// sqrt(mean((with − without)²)) / mean(with), area-weighted over all maps; `None` if the first bake is dark.
    pub relative_rmse: Option<f64>,
}

impl Difference {
    /// Flux by which the first bake exceeds the second [W].
    pub fn difference_w(&self) -> f64 {
        self.with_w - self.without_w
    }
}

/// Area, and the sum of squared differences over area.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    area_m2: f64,
    squares: f64,
}

/// Subtracts the second bake from the first. Of two maps of different sizes, the coarser is upsampled by repetition. A
/// map that only one bake has counts as zero in the other.
///
/// # Errors
/// Two maps of one surface, neither of whose sizes divides the other.
pub fn difference(with: &[IlluminationMap], without: &[IlluminationMap]) -> Result<Difference> {
    let pairs = by_receiver([with, without]);
    let mut found = Difference {
        maps: Vec::with_capacity(pairs.len()),
        with_w: 0.0,
        without_w: 0.0,
        relative_rmse: None,
    };
    let mut sums = Sums::default();
    for [with, without] in pairs {
        let dense = [with, without].map(|map| map.map(IlluminationMap::dense));
        let sides = dense.each_ref().map(|map| map.as_ref().map(|map| Side::of(map)));
        let [with_w, without_w] = sides
            .each_ref()
            .map(|side| side.as_ref().map_or(0.0, Side::flux_w));
        found.with_w += with_w;
        found.without_w += without_w;
        found.maps.extend(signed_map(&sides, &mut sums)?);
    }
    if found.with_w > 0.0 && sums.area_m2 > 0.0 {
        let mean = found.with_w / sums.area_m2;
        found.relative_rmse = Some((sums.squares / sums.area_m2).sqrt() / mean);
    }
    Ok(found)
}

/// The maps of each receiver in two bakes.
pub fn by_receiver(bakes: [&[IlluminationMap]; 2]) -> Vec<[Option<&IlluminationMap>; 2]> {
    let mut pairs: BTreeMap<Receiver, [Option<&IlluminationMap>; 2]> = BTreeMap::new();
    for (side, maps) in bakes.into_iter().enumerate() {
        for map in maps {
            pairs.entry(map.chart.receiver).or_default()[side] = Some(map);
        }
    }
    pairs.into_values().collect()
}

/// A map's luminance [W/m²].
struct Side<'a> {
    chart: &'a Arc<Chart>,
    luminance: Vec<f64>,
}

impl<'a> Side<'a> {
    fn of(map: &'a IlluminationMap) -> Self {
        Self {
            chart: &map.chart,
            luminance: map.total().iter().map(luminance).collect(),
        }
    }

    fn flux_w(&self) -> f64 {
        let texels = self.luminance.iter().enumerate();
        texels
            .map(|(texel, luminance)| luminance * self.chart.texel_area_m2(texel))
            .sum()
    }

    fn size(&self) -> [usize; 2] {
        [self.chart.width, self.chart.height]
    }

    /// Whether each of its texels covers a whole number of the other's.
    fn divides(&self, finer: &Self) -> bool {
        (0..2).all(|axis| finer.size()[axis].is_multiple_of(self.size()[axis]))
    }

    /// The value at a texel of a finer map.
    fn under(&self, texel: usize, finer: &Chart) -> f64 {
        let (column, row) = (texel % finer.width, texel / finer.width);
        let (across, down) = (finer.width / self.chart.width, finer.height / self.chart.height);
        self.luminance[row / down * self.chart.width + column / across]
    }
}

fn signed_map(sides: &[Option<Side<'_>>; 2], sums: &mut Sums) -> Result<Option<SignedMap>> {
    let [with, without] = sides;
    let chart = match (with, without) {
        (Some(a), Some(b)) if b.divides(a) => a.chart,
        (Some(a), Some(b)) if a.divides(b) => b.chart,
        (Some(a), Some(b)) => return Err(sizes_do_not_meet(a, b)),
        (Some(alone), None) | (None, Some(alone)) => alone.chart,
        (None, None) => return Ok(None),
    };
    let under = |side: &Option<Side<'_>>, texel| side.as_ref().map_or(0.0, |side| side.under(texel, chart));
    let mut area_m2 = 0.0;
    let mut irradiance = Vec::with_capacity(chart.width * chart.height);
    for texel in 0..chart.width * chart.height {
        let difference = under(with, texel) - under(without, texel);
        let texel_m2 = chart.texel_area_m2(texel);
        area_m2 += texel_m2;
        sums.squares += difference * difference * texel_m2;
        irradiance.push(difference as f32);
    }
    sums.area_m2 += area_m2;
    let flux_w = with.as_ref().or(without.as_ref()).map_or(0.0, Side::flux_w);
    Ok(Some(SignedMap {
        chart: Arc::clone(chart),
        irradiance,
        mean_w_m2: if area_m2 > 0.0 { flux_w / area_m2 } else { 0.0 },
    }))
}

fn sizes_do_not_meet(with: &Side<'_>, without: &Side<'_>) -> Error {
    let [a, b] = [with, without].map(|side| format!("{}×{}", side.chart.width, side.chart.height));
    Error::failure(
        format!("map of the {:?}", with.chart.receiver),
        format!("its sizes {a} and {b} cannot be compared texel by texel"),
        "bake both with the same map size",
    )
}

#[cfg(test)]
mod tests {
    use std::sync::OnceLock;

    use glam::DVec2;

    use super::*;
    use crate::illumination::{Layer, UvSet};
    use crate::settings::LayerKind;

    /// A grey map over a surface, with texels of equal area.
    fn map(object: usize, [width, height]: [usize; 2], area_m2: f64, grey: &[f32]) -> IlluminationMap {
        assert_eq!(grey.len(), width * height);
        IlluminationMap {
            chart: Arc::new(Chart {
                receiver: Receiver::front(object),
                uv_set: UvSet::Generated,
                corner_uvs: vec![[DVec2::ZERO, DVec2::X, DVec2::Y]],
                width,
                height,
                texel_areas_m2: vec![area_m2 / (width * height) as f64],
                layout: None,
                beyond: Vec::new(),
                joints: Vec::new(),
                islands: OnceLock::new(),
            }),
            layers: vec![Layer {
                kind: LayerKind::Caustic,
                irradiance: grey.iter().map(|value| [*value; 3]).collect(),
            }],
            error: None,
            estimated_relative_rmse: None,
            estimated_visible: None,
        }
    }

    #[test]
    fn light_is_added_here_and_taken_there() {
        let (with, without) = (map(0, [2, 1], 4.0, &[3.0, 1.0]), map(0, [2, 1], 4.0, &[1.0, 2.0]));
        let found = difference(&[with], &[without]).expect("one size");
        assert_eq!(found.maps[0].irradiance, [2.0, -1.0]);
        assert!((found.with_w - 8.0).abs() < 1e-12 && (found.without_w - 6.0).abs() < 1e-12);
        assert!((found.difference_w() - 2.0).abs() < 1e-12);
        // Mean of 4 and 1, over a mean of 2.
        let rmse = found.relative_rmse.expect("it is lit");
        assert!((rmse - 2.5_f64.sqrt() / 2.0).abs() < 1e-12, "{rmse}");
        assert!((found.maps[0].mean_w_m2 - 2.0).abs() < 1e-12);
    }

    #[test]
    fn the_coarser_map_is_repeated_whichever_side_it_is_on() {
        let fine = map(0, [4, 2], 2.0, &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]);
        let coarse = map(0, [2, 1], 2.0, &[1.0, 3.0]);
        let down = [0.0, 1.0, 0.0, 1.0, 4.0, 5.0, 4.0, 5.0];
        let found = difference(std::slice::from_ref(&fine), std::slice::from_ref(&coarse)).expect("doubled");
        assert_eq!(found.maps[0].irradiance, down);
        assert_eq!(found.maps[0].chart.width, 4);
        let back = difference(&[coarse], &[fine]).expect("doubled");
        assert_eq!(back.maps[0].irradiance, down.map(|value: f32| -value));
        assert!((back.difference_w() + found.difference_w()).abs() < 1e-12);
    }

    #[test]
    fn a_map_on_one_side_counts_as_zero_on_the_other() {
        let (a, b) = (map(0, [1, 1], 1.0, &[2.0]), map(3, [1, 1], 3.0, &[4.0]));
        let found = difference(std::slice::from_ref(&a), std::slice::from_ref(&b)).expect("they never meet");
        assert_eq!(found.maps.len(), 2);
        assert_eq!(found.maps[0].irradiance, [2.0]);
        assert_eq!(found.maps[1].irradiance, [-4.0]);
        assert!((found.maps[1].mean_w_m2 - 4.0).abs() < 1e-12);
        assert!((found.with_w - 2.0).abs() < 1e-12 && (found.without_w - 12.0).abs() < 1e-12);
        // (4·1 + 16·3) / 4 m² against 2 W / 4 m².
        let rmse = found.relative_rmse.expect("it is lit");
        assert!((rmse - 13.0_f64.sqrt() / 0.5).abs() < 1e-12, "{rmse}");
    }

    #[test]
    fn layers_count_together_and_uncovered_texels_weigh_nothing() {
        let mut with = map(0, [2, 1], 1.0, &[1.0, 9.0]);
        let mut chart = (*with.chart).clone();
        chart.texel_areas_m2 = vec![1.0, 0.0];
        with.chart = Arc::new(chart);
        with.layers.push(Layer {
            kind: LayerKind::Direct,
            irradiance: vec![[2.0; 3], [9.0; 3]],
        });
        let found = difference(&[with], &[]).expect("nothing to meet");
        assert!((found.with_w - 3.0).abs() < 1e-12 && found.without_w == 0.0);
        assert!((found.relative_rmse.expect("it is lit") - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_dark_bake_has_no_relative_measure() {
        let lit = map(0, [1, 1], 1.0, &[1.0]);
        let found = difference(&[], &[lit]).expect("nothing to meet");
        assert_eq!(found.relative_rmse, None);
        assert!(difference(&[], &[]).expect("nothing").maps.is_empty());
    }

    #[test]
    fn sizes_that_do_not_divide_are_refused() {
        for (a, b) in [([3, 1], [2, 1]), ([4, 1], [1, 4])] {
            let maps = [a, b].map(|size: [usize; 2]| map(0, size, 1.0, &vec![1.0; size[0] * size[1]]));
            let [a, b] = maps.map(|map| vec![map]);
            assert!(difference(&a, &b).is_err());
        }
    }
}
