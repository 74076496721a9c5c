//! The finished map of one surface.

use std::borrow::Cow;
use std::sync::Arc;

use super::Chart;
use crate::optics::{LinearSrgb, luminance};
use crate::settings::LayerKind;

/// One layer of a map: mean irradiance of each texel of its chart [W/m²], linear sRGB; row 0 at v = 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// Kind of light.
    pub kind: LayerKind,
    /// E per texel [W/m²].
    pub irradiance: Vec<[f32; 3]>,
}

/// The illumination map of one side of a surface.
#[derive(Clone, Debug)]
pub struct IlluminationMap {
    /// Map coordinates of the surface, size of the map and texel areas.
    pub chart: Arc<Chart>,
    /// The baked layers, at least one, in the order of [`LayerKind`].
    pub layers: Vec<Layer>,
    /// Estimated error √(variance + bias²) of the luminance of all layers [W/m²], per texel; `None` if not estimated.
    pub error: Option<Vec<f32>>,
    /// Estimated relative RMSE of this map; `None` if not estimated.
    pub estimated_relative_rmse: Option<f64>,
    /// Estimated visible error of this map; `None` if not estimated.
    pub estimated_visible: Option<f64>,
}

impl IlluminationMap {
    /// A map with a single layer and no error estimate.
    pub fn of_layer(chart: Arc<Chart>, kind: LayerKind, irradiance: Vec<[f32; 3]>) -> Self {
        Self {
            chart,
            layers: vec![Layer { kind, irradiance }],
            error: None,
            estimated_relative_rmse: None,
            estimated_visible: None,
        }
    }

    /// Texels across.
    pub fn width(&self) -> usize {
        self.chart.width
    }

    /// Texels down.
    pub fn height(&self) -> usize {
        self.chart.height
    }

    /// Sum of all layers: E per texel of the chart [W/m²].
    pub fn total(&self) -> Vec<[f32; 3]> {
        let mut sum = vec![[0.0; 3]; self.chart.texel_count()];
        for layer in &self.layers {
            for (total, part) in sum.iter_mut().zip(&layer.irradiance) {
                for channel in 0..3 {
                    total[channel] += part[channel];
                }
            }
        }
        sum
    }

    /// The map without tiles, row by row at its finest size; each texel's values are repeated over its area.
    pub fn dense(&self) -> Cow<'_, Self> {
        let Some(layout) = &self.chart.layout else {
            return Cow::Borrowed(self);
        };
        let chart = self.chart.without_tiles();
        let layers = self.layers.iter().map(|layer| Layer {
            kind: layer.kind,
            irradiance: layout.dense(&layer.irradiance),
        });
        Cow::Owned(Self {
            chart: Arc::new(chart),
            layers: layers.collect(),
            error: self.error.as_ref().map(|error| layout.dense(error)),
            ..*self
        })
    }

    /// The layer of this kind, if it was baked.
    pub fn layer(&self, kind: LayerKind) -> Option<&Layer> {
        self.layers.iter().find(|layer| layer.kind == kind)
    }

    /// Total flux of a layer [W per channel]: Σ E·A.
    pub fn flux_w(&self, kind: LayerKind) -> LinearSrgb {
        let mut flux = LinearSrgb::BLACK;
        for (texel, e) in self
            .layer(kind)
            .map_or(&[][..], |layer| &layer.irradiance)
            .iter()
            .enumerate()
        {
            let area = self.chart.texel_area_m2(texel);
            flux += LinearSrgb::new(f64::from(e[0]), f64::from(e[1]), f64::from(e[2])) * area;
        }
        flux
    }
}

/// RMSE of the caustic and indirect layers over their mean irradiance, weighted by area; `None` if the error of a map
/// is unknown, or no light arrived.
pub fn estimated_relative_rmse(maps: &[IlluminationMap]) -> Option<f64> {
    let (mut squares, mut flux_w, mut area_m2) = (0.0, 0.0, 0.0);
    for map in maps {
        let estimated = [LayerKind::Caustic, LayerKind::Indirect];
        let layers: Vec<&Layer> = estimated.iter().filter_map(|&kind| map.layer(kind)).collect();
        if layers.is_empty() {
            continue;
        }
        for (texel, error) in map.error.as_ref()?.iter().enumerate() {
            let texel_m2 = map.chart.texel_area_m2(texel);
            squares += f64::from(*error) * f64::from(*error) * texel_m2;
            for layer in &layers {
                flux_w += luminance(&layer.irradiance[texel]) * texel_m2;
            }
            area_m2 += texel_m2;
        }
    }
    (flux_w > 0.0).then(|| (squares * area_m2).sqrt() / flux_w)
}
