//! The light of a map as textures of the page: moment by moment, layer by layer.

use std::sync::Arc;

use super::sizes;
use crate::export::textures::shared_exponent::{RGB9E5, rgb9e5_word};
use crate::export::textures::texels::Texels;
use crate::eye_pass::renderer::Content;
use crate::illumination::{Chart, IlluminationMap, Parametrisation};
use crate::scene::{Environment, Scene};
use crate::settings::LayerKind;

/// What the maps of a receiver have in common, whatever the moment.
pub(super) struct ShownMap {
    chart: Arc<Chart>,
    /// Of the largest layer [texels].
    size: (usize, usize),
    /// Nothing in it is brighter [W/m²].
    peak_w_m2: f32,
}

/// Irradiance [W/m²], or radiance [W/(m² sr)] over a scale, in E5B9G9R9: words of four bytes, each the difference from
/// the one in the row before.
pub(super) struct Texture {
    pub(super) size: (usize, usize),
    pub(super) scale: f32,
    pub(super) content: Content,
}

impl Texture {
    fn new(texels: &Texels, scale: f32) -> Self {
        let size = texels.size();
        let word =
            |value: &[f32; 3]| u32::from_le_bytes(rgb9e5_word(RGB9E5.code(value.map(|of| of / scale))));
        let words: Vec<u32> = texels.values().iter().map(word).collect();
        let before = |texel: usize| texel.checked_sub(size.0).map_or(0, |before| words[before]);
        let changes = (0..words.len()).map(|texel| words[texel].wrapping_sub(before(texel)));
        let content = Content {
            bytes: changes.flat_map(u32::to_le_bytes).collect(),
            record_bytes: None,
        };
        Self { size, scale, content }
    }

    /// Radiance of an environment, halved until it fits the page.
    pub(super) fn of_sky(environment: &Environment) -> Self {
        let mut texels = Texels::of(environment.size(), environment.pixels().to_vec());
        // Powers of two are lossless.
        let scale = (texels.peak() / RGB9E5.most).log2().ceil().exp2().max(1.0);
        while texels.size().0 > sizes::MAX_SIDE {
            texels = texels.halved();
        }
        Self::new(&texels, scale)
    }
}

impl ShownMap {
    pub(super) fn new(chart: &Arc<Chart>) -> Self {
        Self {
            chart: Arc::clone(chart),
            size: (1, 1),
            peak_w_m2: 0.0,
        }
    }

    /// Takes up the map at a moment: its layers but for those without light.
    pub(super) fn add(&mut self, map: &IlluminationMap) -> Vec<(LayerKind, Texture)> {
        let layers = map.layers.iter().map(|layer| layer.kind).zip(sizes::fitted(map));
        let lit: Vec<_> = layers.filter(|(_, texels)| texels.peak() > 0.0).collect();
        let peak_w_m2 = lit.iter().map(|(_, texels)| texels.peak()).sum();
        self.peak_w_m2 = self.peak_w_m2.max(peak_w_m2);
        self.size = lit
            .iter()
            .fold(self.size, |size, (_, texels)| size.max(texels.size()));
        lit.iter()
            .map(|(kind, texels)| (*kind, Texture::new(texels, 1.0)))
            .collect()
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
