//! Maps of what an effect adds or takes away, in false colours.

use std::sync::Arc;

use crate::illumination::difference::{Difference, SignedMap};
use crate::illumination::{IlluminationMap, difference_colours};
use crate::optics::LinearSrgb;
use crate::settings::LayerKind;

/// The differences as colours in linear light, to be shown as they are.
pub fn maps(difference: &Difference) -> Vec<IlluminationMap> {
    difference.maps.iter().map(coloured).collect()
}

fn coloured(map: &SignedMap) -> IlluminationMap {
    let linear = |colour: [u8; 3]| colour.map(|code| LinearSrgb::decode_channel(code) as f32);
    let colours = difference_colours::of_map(map).map(linear);
    IlluminationMap::of_layer(Arc::clone(&map.chart), LayerKind::Caustic, colours.collect())
}
