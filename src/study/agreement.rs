//! How far maps are from their references, over all surfaces at once, each texel weighted by its area.

use crate::illumination::IlluminationMap;
use crate::illumination::compare::SIGNIFICANT_SHARE_OF_MEAN;
use crate::optics::LinearSrgb;
use crate::settings::LayerKind;

/// One texel of a map beside its reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TexelPair {
    /// E of the image [W/m²], luminance.
    pub image: f64,
    /// E of the reference [W/m²], luminance.
    pub reference: f64,
    /// Surface under the texel [m²]; any unit where all texels are alike.
    pub area_m2: f64,
}

/// Measures of an image against its reference, over all texels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Agreement {
    /// sqrt(mean((I − R)²)) / mean(R).
    pub relative_rmse: f64,
    /// mean(|I − R| / R) over texels with R > 1 % of mean(R).
    pub average_relative_difference: f64,
    /// Largest I over largest R.
    pub peak_ratio: f64,
    /// mean(I) / mean(R).
    pub flux_ratio: f64,
}

impl Agreement {
    /// Of all texels together; `None` where the reference is dark.
    pub fn of(texels: &[TexelPair]) -> Option<Self> {
        let sum = |value: &dyn Fn(&TexelPair) -> f64| -> f64 {
            texels.iter().map(|texel| value(texel) * texel.area_m2).sum()
        };
        let area = sum(&|_| 1.0);
        let mean = sum(&|texel| texel.reference) / area;
        if !(mean.is_finite() && mean > 0.0) {
            return None;
        }
        let mean_square = sum(&|texel| (texel.image - texel.reference).powi(2)) / area;
        let significant = |texel: &TexelPair| texel.reference > SIGNIFICANT_SHARE_OF_MEAN * mean;
        let share = |texel: &TexelPair, value: f64| if significant(texel) { value } else { 0.0 };
        let differences = sum(&|texel| share(texel, (texel.image - texel.reference).abs() / texel.reference));
        let peak = |value: fn(&TexelPair) -> f64| texels.iter().map(value).fold(0.0, f64::max);
        Some(Self {
            relative_rmse: mean_square.sqrt() / mean,
            average_relative_difference: differences / sum(&|texel| share(texel, 1.0)),
            peak_ratio: peak(|texel| texel.image) / peak(|texel| texel.reference),
            flux_ratio: sum(&|texel| texel.image) / (mean * area),
        })
    }
}

/// Texels of the caustic layer of all maps beside those of their references; a map that only one side has is dark on
/// the other. `None` where two maps of one surface differ in size.
pub fn pair_maps(maps: &[IlluminationMap], references: &[IlluminationMap]) -> Option<Vec<TexelPair>> {
    let pairs = pair_texels(maps, references, caustic_luminance)?.into_iter();
    let pair = |(image, reference, area_m2)| TexelPair {
        image,
        reference,
        area_m2,
    };
    Some(pairs.map(pair).collect())
}

/// The same of any values that a map has, each pair with the surface under the texel [m²].
pub fn pair_texels<T: Copy + Default>(
    maps: &[IlluminationMap],
    references: &[IlluminationMap],
    values: fn(&IlluminationMap) -> Vec<T>,
) -> Option<Vec<(T, T, f64)>> {
    let of_surface = |map: &IlluminationMap, among: &'_ [IlluminationMap]| {
        let receiver = map.chart.receiver;
        among.iter().position(|other| other.chart.receiver == receiver)
    };
    let is_alone = |map: &&IlluminationMap| of_surface(map, maps).is_none();
    let mut pairs = Vec::new();
    for map in maps.iter().chain(references.iter().filter(is_alone)) {
        let counterpart = |among: &[IlluminationMap]| match of_surface(map, among).map(|index| &among[index])
        {
            Some(other) if (other.width(), other.height()) != (map.width(), map.height()) => None,
            Some(other) => Some(values(other)),
            None => Some(vec![T::default(); map.width() * map.height()]),
        };
        let (images, references) = (counterpart(maps)?, counterpart(references)?);
        let dense = map.dense();
        for (texel, (image, reference)) in images.into_iter().zip(references).enumerate() {
            let area_m2 = dense.chart.texel_area_m2(texel);
            if area_m2 > 0.0 {
                pairs.push((image, reference, area_m2));
            }
        }
    }
    Some(pairs)
}

/// The caustic layer per texel [W/m²], row by row; black where the layer was not baked.
pub fn caustic_colours(map: &IlluminationMap) -> Vec<LinearSrgb> {
    match map.dense().layer(LayerKind::Caustic) {
        Some(layer) => layer
            .irradiance
            .iter()
            .map(|rgb| LinearSrgb::from(rgb.map(f64::from)))
            .collect(),
        None => vec![LinearSrgb::BLACK; map.width() * map.height()],
    }
}

/// Its luminance.
pub fn caustic_luminance(map: &IlluminationMap) -> Vec<f64> {
    caustic_colours(map)
        .into_iter()
        .map(LinearSrgb::luminance)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texels(values: &[(f64, f64, f64)]) -> Vec<TexelPair> {
        let texel = |&(image, reference, area_m2)| TexelPair {
            image,
            reference,
            area_m2,
        };
        values.iter().map(texel).collect()
    }

    #[test]
    fn large_texels_weigh_more() {
        let agreement = Agreement::of(&texels(&[(2.0, 1.0, 3.0), (1.0, 1.0, 1.0)])).expect("lit");
        assert!((agreement.relative_rmse - 0.75_f64.sqrt()).abs() < 1e-15);
        assert!((agreement.average_relative_difference - 0.75).abs() < 1e-15);
        assert!((agreement.flux_ratio - 1.75).abs() < 1e-15);
        assert!((agreement.peak_ratio - 2.0).abs() < 1e-15);
    }

    #[test]
    fn dark_texels_have_no_relative_difference() {
        let agreement = Agreement::of(&texels(&[(1.0, 1.0, 1.0), (0.1, 0.0, 1.0)])).expect("lit");
        assert!(agreement.average_relative_difference.abs() < 1e-15);
        assert!(agreement.relative_rmse > 0.1);
        assert_eq!(Agreement::of(&texels(&[(1.0, 0.0, 1.0)])), None);
        assert_eq!(Agreement::of(&[]), None);
    }
}
