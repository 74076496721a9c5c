//! Combines the errors of texels into the error that a bake refines towards.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::caustic::{CausticLayer, LightProgress, shown};
use super::finish::CompletedLevel;
use super::light_level::LightLevel;
use super::showing::Showing;
use crate::illumination::visible::{self, BlockLight, Blocks};
use crate::illumination::{Chart, Receiver};
use crate::light_pass::accuracy::{self, Image, LightError};
use crate::settings::ErrorMetric;

/// Light of other layers, by receiver.
pub(super) type Backdrop = BTreeMap<Receiver, ComparisonView>;

/// Light of other layers on one map: luminance of E per texel [W/m²].
pub(super) struct ComparisonView {
    pub(super) chart: Arc<Chart>,
    pub(super) direct: Vec<f64>,
    pub(super) indirect: Vec<f64>,
}

/// The terms that a bake's error is made of.
pub(super) enum ErrorTerms {
    Rmse,
    /// Squared errors weighted by visibility.
    Visible(Counts),
}

/// Weight of a texel's squared error times its area [m²/W²], by receiver.
pub(super) struct Counts(BTreeMap<Receiver, Vec<f64>>);

impl CausticLayer<'_> {
    /// How errors are weighted, given the shown levels of all lights and the light of other layers.
    pub(super) fn error_terms(&self, lights: &[LightProgress], showing: Option<&mut Showing>) -> ErrorTerms {
        if self.settings.error_metric == ErrorMetric::Rmse || self.settings.max_error.is_none() {
            return ErrorTerms::Rmse;
        }
        let levels = shown(lights);
        let backdrop = showing.map_or_else(Backdrop::new, |showing| showing.backdrop(&levels));
        ErrorTerms::Visible(self.visible_counts(&levels, &backdrop))
    }

    fn visible_counts(&self, levels: &[CompletedLevel], backdrop: &Backdrop) -> Counts {
        // Irradiance by the caustics of all lights together, at their strengths.
        let mut charts: BTreeMap<Receiver, Arc<Chart>> = BTreeMap::new();
        let mut traced: BTreeMap<Receiver, Vec<f64>> = BTreeMap::new();
        for (light, level) in levels {
            let strength = level.strength(&self.tracer.scene().lights[*light]);
            for (receiver, image) in accuracy::images(&level.maps, level.unit) {
                let sums = traced.entry(receiver);
                let sums = sums.or_insert_with(|| vec![0.0; image.luminance.len()]);
                for (sum, e) in sums.iter_mut().zip(&image.luminance) {
                    *sum += e * strength.luminance();
                }
            }
            let known = level.maps.iter();
            charts.extend(known.map(|(receiver, map)| (receiver, Arc::clone(&map.chart))));
        }

        // Maps without caustics have no error, but help to set the exposure.
        for (&receiver, beside) in backdrop {
            charts
                .entry(receiver)
                .or_insert_with(|| Arc::clone(&beside.chart));
        }

        // Means over blocks of texels: of caustics, and of all light that their errors are seen in.
        let lit = charts.iter().map(|(receiver, chart)| {
            let blocks = Blocks::new(chart);
            let own = traced.get(receiver);
            // A chart of another size belongs to a level that was not shown.
            let beside = backdrop.get(receiver);
            let beside = beside.filter(|beside| beside.chart.texel_count() == chart.texel_count());
            let at = |values: Option<&Vec<f64>>, texel: usize| {
                values.and_then(|values| values.get(texel)).map_or(0.0, |e| *e)
            };
            // Weights follow the caustics. Indirect light has an error of its own and only adds to the brightness.
            let own_means = blocks.means(chart, |texel| at(own, texel));
            let all = blocks.means(chart, |texel| {
                let others =
                    beside.map(|beside| at(Some(&beside.direct), texel) + at(Some(&beside.indirect), texel));
                at(own, texel) + others.unwrap_or(0.0)
            });
            let light: Vec<BlockLight> = blocks.lit(&all, &own_means).collect();
            (*receiver, blocks, light)
        });
        let lit: Vec<(Receiver, Blocks, Vec<BlockLight>)> = lit.collect();

        // One exposure holds for all maps, as for an eye that looks around in the scene.
        let blocks = || lit.iter().flat_map(|(_, _, light)| light.iter().copied());
        let Some(white) = visible::white(blocks()) else {
            return Counts(BTreeMap::new());
        };

        // The weights and scales of the metric are folded into one factor for each texel, so that a light's squared
        // error is a plain sum over its texels.
        let all_m2: f64 = blocks().map(|block| block.weight_m2(white)).sum();
        let counts = lit.iter().map(|(receiver, blocks, light)| {
            let of_block = |block: &BlockLight| {
                if block.area_m2 > 0.0 && all_m2 > 0.0 {
                    block.weight_m2(white) / (block.scale(white).powi(2) * block.area_m2 * all_m2)
                } else {
                    0.0
                }
            };
            let of_blocks: Vec<f64> = light.iter().map(of_block).collect();
            let of_texels = blocks.of_texels().iter().map(|&block| of_blocks[block as usize]);
            (*receiver, of_texels.collect())
        });
        Counts(counts.collect())
    }
}

impl Counts {
    /// Error of a light's maps at unit strength [1 per unit of strength].
    pub(super) fn of_light(&self, level: &LightLevel, error: &LightError) -> f64 {
        let truncated = accuracy::truncated_share(&level.energy());
        let images = accuracy::images(&level.maps, level.unit);
        let squares = images.iter().map(|(receiver, image)| {
            let squares = self.squares(*receiver, image, error, truncated);
            let by_area = squares.iter().enumerate();
            by_area
                .map(|(texel, square)| square * image.chart.texel_area_m2(texel))
                .sum::<f64>()
        });
        squares.sum::<f64>().sqrt()
    }

    /// Weighted squared errors of texels, including the truncated share of their light.
    fn squares(&self, receiver: Receiver, image: &Image, error: &LightError, truncated: f64) -> Vec<f64> {
        let (Some(counts), Some(map)) = (self.0.get(&receiver), error.maps.get(&receiver)) else {
            return vec![0.0; image.luminance.len()];
        };
        let texels = counts.iter().zip(map).zip(&image.luminance);
        texels
            .map(|((count, error), e)| count * (f64::from(*error).powi(2) + (truncated * e).powi(2)))
            .collect()
    }
}
