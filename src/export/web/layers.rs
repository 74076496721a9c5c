//! The light of a map as textures of the page: moment by moment, layer by layer.

use std::collections::BTreeMap;
use std::sync::Arc;

use serde_json::{Map, Value, json};

use super::sizes;
use crate::export::textures::shared_exponent::{RGB9E5, rgb9e5_word};
use crate::export::textures::texels::Texels;
use crate::eye_pass::renderer::Content;
use crate::illumination::{Chart, IlluminationMap, Parametrisation};
use crate::scene::Scene;
use crate::settings::LayerKind;

/// A map of many moments.
pub(super) struct ShownMap {
    chart: Arc<Chart>,
    /// By moment; layers without light are left out.
    pub(super) moments: Vec<BTreeMap<LayerKind, Texture>>,
    /// Of the largest layer [texels].
    size: (usize, usize),
    /// Nothing in it is brighter [W/m²].
    peak_w_m2: f32,
}

/// Irradiance [W/m²], or radiance [W/(m² sr)] over a scale, in E5B9G9R9: words of four bytes, each the difference from the
/// one in the row before.
pub(super) struct Texture {
    size: (usize, usize),
    pub(super) content: Content,
}

impl Texture {
    pub(super) fn new(texels: &Texels) -> Self {
        let (size, values) = (texels.size(), texels.values());
        let words = values
            .iter()
            .map(|value| u32::from_le_bytes(rgb9e5_word(RGB9E5.code(*value))));
        let words: Vec<u32> = words.collect();
        let before = |texel: usize| texel.checked_sub(size.0).map_or(0, |before| words[before]);
        let changes =
            (0..words.len()).flat_map(|texel| words[texel].wrapping_sub(before(texel)).to_le_bytes());
        let content = Content {
            bytes: changes.collect(),
            record_bytes: None,
        };
        Self { size, content }
    }

    pub(super) fn size(&self) -> Value {
        json!([self.size.0, self.size.1])
    }
}

impl ShownMap {
    pub(super) fn new(chart: &Arc<Chart>) -> Self {
        Self {
            chart: Arc::clone(chart),
            moments: Vec::new(),
            size: (1, 1),
            peak_w_m2: 0.0,
        }
    }

    /// Takes up the map at a moment.
    pub(super) fn add(&mut self, moment: usize, map: &IlluminationMap) {
        self.moments.resize_with(moment + 1, BTreeMap::new);
        let mut peak_w_m2 = 0.0;
        for (layer, texels) in map.layers.iter().zip(sizes::fitted(map)) {
            if texels.peak() > 0.0 {
                peak_w_m2 += texels.peak();
                self.size = self.size.max(texels.size());
                self.moments[moment].insert(layer.kind, Texture::new(&texels));
            }
        }
        self.peak_w_m2 = self.peak_w_m2.max(peak_w_m2);
    }

    /// Sizes of its textures at a moment, by layer.
    pub(super) fn sizes(&self, moment: usize) -> Value {
        let layers = self.moments.get(moment).into_iter().flatten();
        let sizes: Map<String, Value> = layers
            .map(|(kind, texture)| (kind.name().into(), texture.size()))
            .collect();
        sizes.into()
    }

    /// A map of its size, as bright all over as it is anywhere.
    pub(super) fn stand_in(&self, scene: &Scene) -> IlluminationMap {
        let (chart, (width, height)) = (&self.chart, self.size);
        let mesh = scene.objects[chart.object()].mesh_in_scene();
        let uvs = chart.corner_uvs.clone();
        let sized = Parametrisation::new(chart.object(), mesh, chart.uv_set, uvs).chart(width, height);
        let sized = Arc::new(sized.of_side(chart.receiver.side()));
        let light = vec![[self.peak_w_m2; 3]; width * height];
        IlluminationMap::of_layer(sized, LayerKind::Caustic, light)
    }
}
