//! The difference between maps and their references over all surfaces at once, each texel weighted by its area.

use crate::illumination::IlluminationMap;
use crate::illumination::compare::TexelPair;
use crate::illumination::difference::by_receiver;
use crate::optics::LinearSrgb;
use crate::settings::LayerKind;

/// Pairs the caustic layers of maps and their references, texel by texel; a map that only one side has is dark on the
/// other. `None` if two maps of one surface differ in size.
pub fn pair_maps(maps: &[IlluminationMap], references: &[IlluminationMap]) -> Option<Vec<TexelPair>> {
    let pairs = pair_texels(maps, references, caustic_luminance)?.into_iter();
    let pair = |(image, reference, area_m2)| TexelPair {
        image,
        reference,
        area_m2,
    };
    Some(pairs.map(pair).collect())
}

/// [`pair_maps`] for any values per texel, each pair with the surface area under the texel [m²].
pub fn pair_texels<T: Copy + Default>(
    maps: &[IlluminationMap],
    references: &[IlluminationMap],
    values: fn(&IlluminationMap) -> Vec<T>,
) -> Option<Vec<(T, T, f64)>> {
    let mut pairs = Vec::new();
    for sides in by_receiver([maps, references]) {
        let own = sides[0].or(sides[1])?;
        let size = |map: &IlluminationMap| (map.width(), map.height());
        if sides.iter().flatten().any(|map| size(map) != size(own)) {
            return None;
        }
        let dark = || vec![T::default(); own.width() * own.height()];
        let [images, references] = sides.map(|map| map.map_or_else(dark, values));
        let dense = own.dense();
        for (texel, (image, reference)) in images.into_iter().zip(references).enumerate() {
            let area_m2 = dense.chart.texel_area_m2(texel);
            if area_m2 > 0.0 {
                pairs.push((image, reference, area_m2));
            }
        }
    }
    Some(pairs)
}

/// The caustic layer per texel [W/m²], row by row; black if it was not baked.
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

pub fn caustic_luminance(map: &IlluminationMap) -> Vec<f64> {
    caustic_colours(map)
        .into_iter()
        .map(LinearSrgb::luminance)
        .collect()
}
