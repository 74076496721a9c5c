//! Measures of how far a bake deviates from a law. They are relative errors unless the wording says otherwise.

use glam::DMat2;
use nephroid::illumination::compare::{Agreement, Grid, TexelPair, relative_rmse};
use nephroid::illumination::Layer;
use nephroid::light_pass::ledger::EnergyLedger;
use nephroid::study::agreement::pair_maps;

use super::{Baked, Case, number};
use crate::prelude::*;
use crate::tools::bits;

/// Relative error of a flux that chance allows: three standard errors for the photons that arrived, plus 2 % for
/// correlated light.
fn chance(bake: &Baked) -> f64 {
    0.02 + 3.0 / (bake.result.counts.splats.max(1) as f64).sqrt()
}

/// Relative error of the flux on all maps that the estimated error allows: three standard errors, if texels err
/// independently.
pub fn flux_noise(bake: &Baked) -> f64 {
    let texels: usize = bake.result.maps.iter().map(|map| map.chart.texel_count()).sum();
    3.0 * bake.noise() / (texels.max(1) as f64).sqrt()
}

/// Relative RMSE of all maps that the estimated error allows.
fn map_noise(bake: &Baked) -> f64 {
    2.0 * bake.noise()
}

fn last(bakes: &[Baked]) -> &Baked {
    bakes.last().expect("a bake before its law")
}

impl Case {
    /// Adds a measure of the last bake.
    pub fn measure(&mut self, says: &str, bound: f64, of: impl Fn(&Baked) -> f64 + Send + 'static) -> &mut Self {
        self.law(says, bound, move |bakes| of(last(bakes)))
    }

    /// Adds a measure of the last bake whose bound grows with the noise of that bake.
    pub fn measure_within(
        &mut self,
        says: &str,
        (bound, noise): (f64, fn(&Baked) -> f64),
        of: impl Fn(&Baked) -> f64 + Send + 'static,
    ) -> &mut Self {
        self.law_within(says, move |bakes| bound + noise(last(bakes)), move |bakes| of(last(bakes)))
    }

    /// Adds a condition on the last bake.
    pub fn must(&mut self, says: &str, is_so: impl Fn(&Baked) -> bool + Send + 'static) -> &mut Self {
        self.measure(says, 0.0, move |bake| no(is_so(bake)))
    }

    /// Adds a measure of the first light's energy in the last bake.
    pub fn ledger(&mut self, says: &str, bound: f64, of: impl Fn(&EnergyLedger) -> f64 + Send + 'static) -> &mut Self {
        self.measure(says, bound, move |bake| of(&bake.result.ledgers[0].energy_w))
    }

    /// Adds a ledger entry of the first light in the last bake, as a fraction of the emitted flux.
    pub fn share(&mut self, says: &str, bound: f64, of: impl Fn(&EnergyLedger) -> f64 + Send + 'static) -> &mut Self {
        self.ledger(says, bound, move |energy| of(energy) / energy.emitted)
    }

    /// Adds a comparison of the last bake with the first.
    pub fn compare(&mut self, says: &str, bound: f64, of: impl Fn(&Baked, &Baked) -> f64 + Send + 'static) -> &mut Self {
        self.law(says, bound, move |bakes| of(last(bakes), &bakes[0]))
    }

    /// Adds a comparison of the last bake with the first, whose bound grows with the noise of both.
    fn compare_within(
        &mut self,
        says: &str,
        (bound, noise): (f64, fn(&Baked) -> f64),
        of: impl Fn(&Baked, &Baked) -> f64 + Send + 'static,
    ) -> &mut Self {
        self.law_within(
            says,
            move |bakes| bound + noise(last(bakes)) + noise(&bakes[0]),
            move |bakes| of(last(bakes), &bakes[0]),
        )
    }

    /// Adds a measure that needs no bake.
    pub fn fact(&mut self, says: &str, bound: f64, of: impl Fn() -> f64 + Send + 'static) -> &mut Self {
        self.law(says, bound, move |_| of())
    }

    /// Adds a check that needs no bake and panics if it fails.
    pub fn check(&mut self, says: &str, asserts: impl Fn() + Send + 'static) -> &mut Self {
        self.fact(says, 0.0, move || {
            asserts();
            0.0
        })
    }

    /// The deposited flux [W].
    pub fn watts(&mut self, expected_w: f64, bound: f64) -> &mut Self {
        let says = format!("{} W arrive", number(expected_w));
        self.measure_within(&says, (bound, flux_noise), move |bake| off(deposited_w(bake), expected_w))
            .carried(&says, move |bake| off(deposited_w(bake), expected_w) / (bound + chance(bake)))
    }

    /// The flux emitted towards mirrors and glass [W].
    pub fn sent(&mut self, expected_w: f64, bound: f64) -> &mut Self {
        let says = format!("{} W are sent", number(expected_w));
        self.measure(&says, bound, move |bake| off(emitted_w(bake), expected_w))
            .carried(&says, move |bake| off(emitted_w(bake), expected_w) / (bound + chance(bake)))
    }

    /// Energy conservation: at most this fraction of the emitted flux is deposited.
    pub fn arrives_of_sent(&mut self, most: f64) -> &mut Self {
        let arrives = |bake: &Baked| deposited_w(bake) / emitted_w(bake).max(f64::MIN_POSITIVE);
        let says = "arrives, of what was sent";
        self.measure(says, most, arrives)
            .carried(says, move |bake| arrives(bake) / (most + chance(bake)))
    }

    /// An upper bound for the deposited flux [W].
    pub fn arrives(&mut self, most_w: f64) -> &mut Self {
        self.measure("arrives, W", most_w, deposited_w)
    }

    /// Irradiance E of the flat object `floor`, point by point [W/m²]: relative RMSE.
    pub fn e(&mut self, says: &str, bound: f64, theory: impl Fn(DVec3) -> f64 + Send + Sync + 'static) -> &mut Self {
        let (says, theory) = (format!("E is {says}"), Arc::new(theory));
        let same = Arc::clone(&theory);
        self.measure_within(&says, (bound, map_noise), move |bake| against_theory(bake, &*theory))
            .carried(&says, move |bake| against_theory(bake, &*same) / (bound + map_noise(bake)))
    }

    /// E of a lamp of 1 W/sr at a point.
    pub fn e_of_lamp(&mut self, says: &str, bound: f64, place: DVec3) -> &mut Self {
        self.e(says, bound, move |point| from_lamp(point, place))
    }

    /// The scene has a warning that contains the word.
    pub fn warned(&mut self, word: &'static str) -> &mut Self {
        self.must(&format!("a warning names the {word}"), move |bake| {
            bake.scene.warnings.iter().any(|warning| warning.what.contains(word))
        })
    }

    /// The maps equal those of the first bake times a factor: relative RMSE. Exactly, if the bound is 0.
    pub fn as_first(&mut self, says: &str, bound: f64, factor: f64) -> &mut Self {
        let noise = if bound > 0.0 { map_noise } else { |_: &Baked| 0.0 };
        self.compare_within(says, (bound, noise), move |bake, first| maps_apart(&bake.result.maps, &first.result.maps, factor))
    }

    /// The maps equal those of the first bake to within the estimated errors of both.
    pub fn as_first_within_errors(&mut self) -> &mut Self {
        self.compare("maps as of the first bake, over both estimated errors", 1.0, |bake, first| {
            maps_apart(&bake.result.maps, &first.result.maps, 1.0) / estimates(bake, first)
        })
    }

    /// The deposited flux equals that of the first bake.
    pub fn watts_as_first(&mut self, says: &str, bound: f64) -> &mut Self {
        self.compare_within(says, (bound, flux_noise), |bake, first| off(deposited_w(bake), deposited_w(first)))
    }

    /// The maps equal those of the first bake bit for bit.
    pub fn bits_as_first(&mut self, says: &str) -> &mut Self {
        self.compare(says, 0.0, |bake, first| no(same_bits(&bake.result.maps, &first.result.maps)))
    }

    /// The floor's map equals that of the first bake averaged over 2 × 2 texels: the first bake has twice the texels
    /// along each side.
    pub fn averages_to_coarser(&mut self) -> &mut Self {
        let says = "texels in fours make the coarser map, over both estimated errors";
        self.compare(says, 1.0, |coarse, fine| {
            let [coarser, finer] = [coarse, fine].map(|bake| {
                let map = floor_map(bake).expect("a lit floor");
                Grid {
                    width: map.width(),
                    height: map.height(),
                    values: luminance(map, LayerKind::Caustic),
                }
            });
            let averaged = finer.box_averaged(2, 2).expect("an even number of texels");
            let rmse = relative_rmse(&averaged.values, &coarser.values).expect("light");
            rmse / estimates(fine, coarse)
        })
    }
}

/// 0 if the condition holds, else 1.
pub fn no(is_so: bool) -> f64 {
    f64::from(u8::from(!is_so))
}

/// Flux deposited on all surfaces, for all lights [W].
pub fn deposited_w(bake: &Baked) -> f64 {
    bake.result.ledgers.iter().map(|ledger| ledger.energy_w.deposited).sum()
}

/// Flux emitted towards mirrors and glass, for all lights [W].
pub fn emitted_w(bake: &Baked) -> f64 {
    bake.result.ledgers.iter().map(|ledger| ledger.energy_w.emitted).sum()
}

/// |actual − expected| / |expected|.
pub fn off(actual: f64, expected: f64) -> f64 {
    (actual - expected).abs() / expected.abs()
}

/// Irradiance of a lamp of 1 W/sr on a horizontal surface [W/m²].
pub fn from_lamp(point: DVec3, lamp: DVec3) -> f64 {
    let away = lamp - point;
    away.y.abs() / away.length().powi(3)
}

/// Solid angle of all triangles seen from a point [sr], without occlusion (van Oosterom and Strackee 1983).
pub fn solid_angle_sr(mesh: &Mesh, eye: DVec3) -> f64 {
    let of = |triangle: usize| {
        let [a, b, c] = mesh.corners(triangle).map(|corner| corner - eye);
        let [la, lb, lc] = [a, b, c].map(DVec3::length);
        let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
        2.0 * a.dot(b.cross(c)).atan2(below).abs()
    };
    (0..mesh.triangles.len()).map(of).sum()
}

/// Relative RMSE of caustic maps against references times a factor. 0 if both are dark; infinite if one of them is
/// dark or sizes differ.
pub fn maps_apart(maps: &[IlluminationMap], references: &[IlluminationMap], factor: f64) -> f64 {
    let Some(mut pairs) = pair_maps(maps, references) else {
        return f64::INFINITY;
    };
    for pair in &mut pairs {
        pair.reference *= factor;
    }
    if pairs.iter().all(|pair| pair.image == 0.0 && pair.reference == 0.0) {
        return 0.0;
    }
    Agreement::of(&pairs).map_or(f64::INFINITY, |agreement| agreement.relative_rmse)
}

/// Sum of the errors that both bakes estimate for themselves.
pub fn estimates(a: &Baked, b: &Baked) -> f64 {
    let estimate = |bake: &Baked| bake.result.estimated_relative_rmse.unwrap_or(0.0);
    estimate(a) + estimate(b)
}

/// Sum of the caustic maps of one surface over several bakes.
pub fn map_sum(like: &IlluminationMap, bakes: &[Baked]) -> IlluminationMap {
    let mut irradiance = vec![[0.0_f32; 3]; like.chart.texel_count()];
    let maps = bakes.iter().flat_map(|bake| &bake.result.maps);
    let parts = maps.filter(|map| map.chart.receiver == like.chart.receiver);
    for layer in parts.filter_map(|map| map.layer(LayerKind::Caustic)) {
        for (total, part) in irradiance.iter_mut().zip(&layer.irradiance) {
            for channel in 0..3 {
                total[channel] += part[channel];
            }
        }
    }
    let mut sum = like.clone();
    sum.layers = vec![Layer {
        kind: LayerKind::Caustic,
        irradiance,
    }];
    sum
}

/// Whether maps are equal bit for bit.
pub fn same_bits(a: &[IlluminationMap], b: &[IlluminationMap]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| bits(a) == bits(b))
}

/// The map of the floor; `None` if it received no light.
pub fn floor_map(bake: &Baked) -> Option<&IlluminationMap> {
    map_of(bake, "floor")
}

/// The map of the named object; `None` if it received no light.
pub fn map_of<'a>(bake: &'a Baked, name: &str) -> Option<&'a IlluminationMap> {
    let mut maps = bake.result.maps.iter();
    maps.find(|map| bake.scene.objects[map.chart.object()].name == name)
}

/// Luminance of a layer for each texel [W/m²]; empty if the layer was not baked.
pub fn luminance(map: &IlluminationMap, kind: LayerKind) -> Vec<f64> {
    let texels = map.layer(kind).map_or(&[][..], |layer| &layer.irradiance);
    let of = |rgb: &[f32; 3]| LinearSrgb::from(rgb.map(f64::from)).luminance();
    texels.iter().map(of).collect()
}

/// Relative RMSE of the floor's caustic layer against theory, which is averaged over 4 × 4 points of each texel.
fn against_theory(bake: &Baked, theory: impl Fn(DVec3) -> f64) -> f64 {
    const POINTS: usize = 4;
    let Some(map) = floor_map(bake) else {
        return f64::INFINITY;
    };
    let (width, height) = (map.width(), map.height());
    let pair = |(texel, image): (usize, f64)| {
        let mean = (0..POINTS * POINTS).map(|point| {
            let within = dvec2((point % POINTS) as f64 + 0.5, (point / POINTS) as f64 + 0.5) / POINTS as f64;
            let texel = dvec2((texel % width) as f64, (texel / width) as f64);
            theory(place(&bake.scene, map, (texel + within) / dvec2(width as f64, height as f64)))
        });
        TexelPair {
            image,
            reference: mean.sum::<f64>() / (POINTS * POINTS) as f64,
            area_m2: 1.0,
        }
    };
    let values = luminance(map, LayerKind::Caustic);
    let pairs: Vec<TexelPair> = values.into_iter().enumerate().map(pair).collect();
    Agreement::of(&pairs).map_or(f64::INFINITY, |agreement| agreement.relative_rmse)
}

/// Position of a map coordinate on a flat surface.
fn place(scene: &Scene, map: &IlluminationMap, uv: DVec2) -> DVec3 {
    let [a, b, c] = map.chart.corner_uvs[0];
    let [pa, pb, pc] = scene.objects[map.chart.object()].mesh_in_scene().corners(0);
    let weights = DMat2::from_cols(b - a, c - a).inverse() * (uv - a);
    pa + (pb - pa) * weights.x + (pc - pa) * weights.y + scene.origin_world
}
