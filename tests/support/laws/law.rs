//! Laws: each says how far a bake is from what it must be, as a share unless its wording says otherwise.

use std::sync::Arc;

use glam::{DMat2, DVec2, DVec3};
use nephroid::illumination::compare::{Agreement, Grid, TexelPair, relative_rmse};
use nephroid::illumination::{IlluminationMap, Layer};
use nephroid::light_pass::ledger::EnergyLedger;
use nephroid::optics::LinearSrgb;
use nephroid::scene::{Mesh, Scene};
use nephroid::settings::LayerKind;
use nephroid::study::agreement::pair_maps;

use super::{Baked, Case, number};
use crate::tools::bits;

/// The share by which watts may be off by chance: three standard errors of as many photons as arrived, and a little for
/// light that is the same for many.
fn chance(bake: &Baked) -> f64 {
    0.02 + 3.0 / (bake.result.counts.splats.max(1) as f64).sqrt()
}

impl Case {
    /// A figure of the last bake.
    pub fn measure(&mut self, says: &str, bound: f64, of: impl Fn(&Baked) -> f64 + Send + 'static) -> &mut Self {
        self.law(says, bound, move |bakes| of(bakes.last().expect("a bake before its law")))
    }

    /// Something that must be so of the last bake: 0 or 1 of 0.
    pub fn must(&mut self, says: &str, is_so: impl Fn(&Baked) -> bool + Send + 'static) -> &mut Self {
        self.measure(says, 0.0, move |bake| no(is_so(bake)))
    }

    /// A figure of the first lamp's energy in the last bake.
    pub fn ledger(&mut self, says: &str, bound: f64, of: impl Fn(&EnergyLedger) -> f64 + Send + 'static) -> &mut Self {
        self.measure(says, bound, move |bake| of(&bake.result.ledgers[0].energy_w))
    }

    /// An account of the first lamp in the last bake, of what it emitted.
    pub fn share(&mut self, says: &str, bound: f64, of: impl Fn(&EnergyLedger) -> f64 + Send + 'static) -> &mut Self {
        self.ledger(says, bound, move |energy| of(energy) / energy.emitted)
    }

    /// A comparison of the last bake with the first.
    pub fn compare(&mut self, says: &str, bound: f64, of: impl Fn(&Baked, &Baked) -> f64 + Send + 'static) -> &mut Self {
        self.law(says, bound, move |bakes| of(bakes.last().expect("a bake before its law"), &bakes[0]))
    }

    /// What needs no bake: how far it is off.
    pub fn fact(&mut self, says: &str, bound: f64, of: impl Fn() -> f64 + Send + 'static) -> &mut Self {
        self.law(says, bound, move |_| of())
    }

    /// What needs no bake and panics where it does not hold.
    pub fn check(&mut self, says: &str, asserts: impl Fn() + Send + 'static) -> &mut Self {
        self.fact(says, 0.0, move || {
            asserts();
            0.0
        })
    }

    /// What arrives [W].
    pub fn watts(&mut self, expected_w: f64, bound: f64) -> &mut Self {
        let says = format!("{} W arrive", number(expected_w));
        self.measure(&says, bound, move |bake| off(deposited_w(bake), expected_w))
            .carried(&says, move |bake| off(deposited_w(bake), expected_w) / (bound + chance(bake)))
    }

    /// What lamps send to mirrors and glass [W].
    pub fn sent(&mut self, expected_w: f64, bound: f64) -> &mut Self {
        let says = format!("{} W are sent", number(expected_w));
        self.measure(&says, bound, move |bake| off(emitted_w(bake), expected_w))
            .carried(&says, move |bake| off(emitted_w(bake), expected_w) / (bound + chance(bake)))
    }

    /// No light is made: at most a share of what was sent arrives.
    pub fn arrives_of_sent(&mut self, most: f64) -> &mut Self {
        let arrives = |bake: &Baked| deposited_w(bake) / emitted_w(bake).max(f64::MIN_POSITIVE);
        let says = "arrives, of what was sent";
        self.measure(says, most, arrives)
            .carried(says, move |bake| arrives(bake) / (most + chance(bake)))
    }

    /// What arrives at most [W].
    pub fn arrives(&mut self, most_w: f64) -> &mut Self {
        self.measure("arrives, W", most_w, deposited_w)
    }

    /// E of the floor, or of another flat `floor`, point by point [W/m²]: relative RMSE.
    pub fn e(&mut self, says: &str, bound: f64, theory: impl Fn(DVec3) -> f64 + Send + Sync + 'static) -> &mut Self {
        let (says, theory) = (format!("E is {says}"), Arc::new(theory));
        let same = Arc::clone(&theory);
        self.measure(&says, bound, move |bake| against_theory(bake, &*theory))
            .carried(&says, move |bake| {
                let stated = bake.result.estimated_relative_rmse.unwrap_or(0.0);
                against_theory(bake, &*same) / (bound + 2.0 * stated)
            })
    }

    /// E of a lamp of 1 W/sr at a place.
    pub fn e_of_lamp(&mut self, says: &str, bound: f64, place: DVec3) -> &mut Self {
        self.e(says, bound, move |point| from_lamp(point, place))
    }

    /// The scene was read with a warning that has the word.
    pub fn warned(&mut self, word: &'static str) -> &mut Self {
        self.must(&format!("a warning names the {word}"), move |bake| {
            bake.scene.warnings.iter().any(|warning| warning.what.contains(word))
        })
    }

    /// Maps as those of the first bake times a factor: relative RMSE.
    pub fn as_first(&mut self, says: &str, bound: f64, factor: f64) -> &mut Self {
        self.compare(says, bound, move |bake, first| maps_apart(&bake.result.maps, &first.result.maps, factor))
    }

    /// Maps as those of the first bake, over the errors that both estimate.
    pub fn as_first_within_errors(&mut self) -> &mut Self {
        self.compare("maps as of the first bake, over both estimated errors", 1.0, |bake, first| {
            maps_apart(&bake.result.maps, &first.result.maps, 1.0) / estimates(bake, first)
        })
    }

    /// The watts of the first bake.
    pub fn watts_as_first(&mut self, says: &str, bound: f64) -> &mut Self {
        self.compare(says, bound, |bake, first| off(deposited_w(bake), deposited_w(first)))
    }

    /// The maps of the first bake, bit for bit.
    pub fn bits_as_first(&mut self, says: &str) -> &mut Self {
        self.compare(says, 0.0, |bake, first| no(same_bits(&bake.result.maps, &first.result.maps)))
    }

    /// The floor's map with its texels averaged in fours: the first bake has twice the texels each way.
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

/// 0 for what is so, 1 for what is not.
pub fn no(is_so: bool) -> f64 {
    f64::from(u8::from(!is_so))
}

/// Deposited on all surfaces, over all lights [W].
pub fn deposited_w(bake: &Baked) -> f64 {
    bake.result.ledgers.iter().map(|ledger| ledger.energy_w.deposited).sum()
}

/// Emitted towards mirrors and glass, over all lights [W].
pub fn emitted_w(bake: &Baked) -> f64 {
    bake.result.ledgers.iter().map(|ledger| ledger.energy_w.emitted).sum()
}

/// |actual − expected| over the expected.
pub fn off(actual: f64, expected: f64) -> f64 {
    (actual - expected).abs() / expected.abs()
}

/// E of a lamp of 1 W/sr on a horizontal surface [W/m²].
pub fn from_lamp(point: DVec3, lamp: DVec3) -> f64 {
    let away = lamp - point;
    away.y.abs() / away.length().powi(3)
}

/// Solid angle of triangles as seen from a point [sr], each as if nothing hid it (van Oosterom and Strackee 1983).
pub fn solid_angle_sr(mesh: &Mesh, eye: DVec3) -> f64 {
    let of = |triangle: usize| {
        let [a, b, c] = mesh.corners(triangle).map(|corner| corner - eye);
        let [la, lb, lc] = [a, b, c].map(DVec3::length);
        let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
        2.0 * a.dot(b.cross(c)).atan2(below).abs()
    };
    (0..mesh.triangles.len()).map(of).sum()
}

/// Relative RMSE of caustic maps against others times a factor; 0 where both are dark, infinite where one is or where
/// sizes differ.
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

/// What both bakes think of their own errors, together.
pub fn estimates(a: &Baked, b: &Baked) -> f64 {
    let estimate = |bake: &Baked| bake.result.estimated_relative_rmse.unwrap_or(0.0);
    estimate(a) + estimate(b)
}

/// The caustic maps of one surface in several bakes, added up; a bake without one adds nothing.
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

/// Whether maps are the same, bit for bit.
pub fn same_bits(a: &[IlluminationMap], b: &[IlluminationMap]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| bits(a) == bits(b))
}

/// The map of the floor, if it received light.
pub fn floor_map(bake: &Baked) -> Option<&IlluminationMap> {
    map_of(bake, "floor")
}

/// The map of the object of that name, if it received light.
pub fn map_of<'a>(bake: &'a Baked, name: &str) -> Option<&'a IlluminationMap> {
    let mut maps = bake.result.maps.iter();
    maps.find(|map| bake.scene.objects[map.chart.object()].name == name)
}

/// Luminance of a layer, texel by texel [W/m²]; nothing where it was not baked.
pub fn luminance(map: &IlluminationMap, kind: LayerKind) -> Vec<f64> {
    let texels = map.layer(kind).map_or(&[][..], |layer| &layer.irradiance);
    let of = |rgb: &[f32; 3]| LinearSrgb::from(rgb.map(f64::from)).luminance();
    texels.iter().map(of).collect()
}

/// Relative RMSE of the floor's caustic layer against theory; each texel against the mean of 4 × 4 of its points.
fn against_theory(bake: &Baked, theory: impl Fn(DVec3) -> f64) -> f64 {
    const POINTS: usize = 4;
    let Some(map) = floor_map(bake) else {
        return f64::INFINITY;
    };
    let (width, height) = (map.width(), map.height());
    let pair = |(texel, image): (usize, f64)| {
        let mean = (0..POINTS * POINTS).map(|point| {
            let within = DVec2::new((point % POINTS) as f64 + 0.5, (point / POINTS) as f64 + 0.5) / POINTS as f64;
            let texel = DVec2::new((texel % width) as f64, (texel / width) as f64);
            theory(place(&bake.scene, map, (texel + within) / DVec2::new(width as f64, height as f64)))
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

/// Where coordinates of a map lie on a flat surface.
fn place(scene: &Scene, map: &IlluminationMap, uv: DVec2) -> DVec3 {
    let [a, b, c] = map.chart.corner_uvs[0];
    let [pa, pb, pc] = scene.objects[map.chart.object()].mesh_in_scene().corners(0);
    let weights = DMat2::from_cols(b - a, c - a).inverse() * (uv - a);
    pa + (pb - pa) * weights.x + (pc - pa) * weights.y + scene.origin_world
}
