//! What lights a point of a surface: map values at once, light paths from a thread of its own.

use std::sync::Arc;

use egui::{Color32, Painter, Stroke, pos2};
use glam::DVec3;
use serde_json::{Value, json};

use super::background::{Background, Task, Wake};
use super::flat_map::layers_at;
use super::lens::Viewport;
use crate::geometry::Ray;
use crate::illumination::{IlluminationMap, Side};
use crate::light_pass::explain::{Explanation, LightPath, Limits, Target, explain};
use crate::optics::LinearSrgb;
use crate::settings::LayerKind;
use crate::transport::{MediumStack, SurfaceHit, Tracer, media_at};
use crate::units::LUMENS_PER_WATT;

/// Largest number of specular surfaces between the camera and the probed point.
const MAX_SEEN_THROUGH: usize = 32;
/// Texels darker than this fraction of their map's mean are explained with no finer threshold.
const MIN_SHARE: f64 = 1e-3;

/// Result of a probe.
#[derive(Clone, Debug)]
pub struct Probed {
    /// Name of the object.
    pub surface: String,
    /// Position [m].
    pub point: DVec3,
    pub side: Side,
    /// `None` if the surface has no map.
    pub texel: Option<ProbedTexel>,
    /// The light paths; `None` until they are found.
    pub explanation: Option<Explanation>,
}

/// The map's texel at a probed point.
#[derive(Clone, Debug)]
pub struct ProbedTexel {
    /// Column and row, in texels of the map's finest size.
    pub corner: [usize; 2],
    /// Width in finest texels.
    pub size: usize,
    /// Width and height of the map in finest texels.
    pub map: [usize; 2],
    /// Surface area of the texel [m²].
    pub area_m2: f64,
    /// Luminance of the irradiance in each layer [W/m²].
    pub layers: Vec<(LayerKind, f64)>,
    /// Estimated error of the total [W/m²]; `None` if it was not estimated.
    pub error_w_m2: Option<f64>,
}

impl ProbedTexel {
    /// Luminance of the irradiance in all layers [W/m²].
    pub fn total_w_m2(&self) -> f64 {
        self.layers.iter().map(|(_, luminance)| luminance).sum()
    }

    fn layer(&self, wanted: LayerKind) -> f64 {
        let found = self.layers.iter().find(|(kind, _)| *kind == wanted);
        found.map_or(0.0, |(_, luminance)| *luminance)
    }
}

impl Probed {
    /// Share of a path in the texel's light: the light of all paths found plus the map's indirect light.
    pub fn share(&self, path: &LightPath) -> f64 {
        let indirect = self
            .texel
            .as_ref()
            .map_or(0.0, |texel| texel.layer(LayerKind::Indirect));
        let paths = self
            .explanation
            .as_ref()
            .map_or(LinearSrgb::BLACK, |explanation| {
                explanation.caustic() + explanation.direct()
            });
        let all = paths.luminance() + indirect;
        if all > 0.0 {
            path.irradiance.luminance() / all
        } else {
            0.0
        }
    }

    pub fn to_json(&self) -> Value {
        // Irradiance is given by its luminance, as in the panel.
        let texel = self.texel.as_ref().map(|texel| {
            let layers = texel.layers.iter();
            let layers: serde_json::Map<_, _> = layers
                .map(|(kind, luminance)| (kind.name().to_owned(), json!(luminance)))
                .collect();
            json!({
                "column": texel.corner[0],
                "row": texel.corner[1],
                "size": texel.size,
                "map": texel.map,
                "area_m2": texel.area_m2,
                "irradiance_w_m2": layers,
                "error_w_m2": texel.error_w_m2,
                "illuminance_lx": LUMENS_PER_WATT * texel.total_w_m2(),
            })
        });

        let path = |path: &LightPath| {
            let places = path.vertices.iter().map(|vertex| vertex.point.to_array());
            json!({
                "light": path.light,
                "start_m": path.start.to_array(),
                "vertices_m": places.collect::<Vec<_>>(),
                "end_m": path.end.to_array(),
                "irradiance_w_m2": path.irradiance.luminance(),
                "share": self.share(path),
            })
        };

        // Paths, rays and completeness are null until the search for paths has ended.
        let paths = self
            .explanation
            .as_ref()
            .map(|explanation| explanation.paths.iter().map(path).collect::<Vec<_>>());
        json!({
            "surface": self.surface,
            "position_m": self.point.to_array(),
            "texel": texel,
            "paths": paths,
            "rays": self.explanation.as_ref().map(|explanation| explanation.rays),
            "complete": self.explanation.as_ref().map(|explanation| explanation.is_complete),
        })
    }
}

/// A probed surface and the direction from which it is seen.
#[derive(Clone, Copy, Debug)]
pub struct ProbeTarget {
    /// On a matte surface.
    pub hit: SurfaceHit,
    /// Unit direction of the ray towards the surface.
    pub direction: DVec3,
}

/// The matte surface that a ray ends on. At glass and mirrors it follows the stronger branch. `None` if it ends on
/// none.
pub fn seen(tracer: &Tracer, view_ray: &Ray) -> Option<ProbeTarget> {
    let mut ray = *view_ray;
    let mut media: MediumStack = media_at(tracer, view_ray.origin);
    for _ in 0..MAX_SEEN_THROUGH {
        let hit = tracer.closest_hit(&ray)?;
        let interaction = tracer.interact(&hit, ray.direction, &media);
        if interaction.deposit.max_channel() > 0.0 {
            return Some(ProbeTarget {
                hit,
                direction: ray.direction,
            });
        }
        let ways = [interaction.reflection, interaction.transmission];
        let strongest = ways
            .into_iter()
            .flatten()
            .max_by(|a, b| a.share.luminance().total_cmp(&b.share.luminance()))?;
        (ray, media) = (strongest.ray, strongest.media);
    }
    None
}

/// Reads the maps at the probed surface. The target for [`explain`] is `None` if the surface has no map.
pub fn read(tracer: &Tracer, maps: &[IlluminationMap], seen: &ProbeTarget) -> (Probed, Option<Target>) {
    let found = maps.iter().find_map(|map| {
        let target = Target::new(tracer, &map.chart, &seen.hit, seen.direction)?;
        Some((map, target))
    });
    let texel = found.as_ref().map(|(map, target)| ProbedTexel {
        corner: target.corner,
        size: target.size,
        map: [map.width(), map.height()],
        area_m2: target.area_m2,
        layers: layers_at(map, target.texel),
        error_w_m2: map.error.as_ref().map(|error| f64::from(error[target.texel])),
    });
    let probed = Probed {
        surface: tracer.scene().objects[seen.hit.object].name.clone(),
        point: seen.hit.point,
        side: Side::met(seen.direction, seen.hit.geometric_normal),
        texel,
        explanation: None,
    };
    (probed, found.map(|(_, target)| target))
}

/// Scale of the texel's brightness, relative to which paths are searched [W/m²].
fn scale_w_m2(maps: &[IlluminationMap], target: &Target, texel: &ProbedTexel) -> f64 {
    let map = maps.iter().find(|map| map.chart.receiver == target.receiver);
    let mean = map.map_or(0.0, |map| {
        let flux_w: f64 = map
            .layers
            .iter()
            .map(|layer| map.flux_w(layer.kind).luminance())
            .sum();
        flux_w / map.chart.area_m2()
    });
    let scale = texel.total_w_m2().max(MIN_SHARE * mean);
    if scale > 0.0 { scale } else { MIN_SHARE }
}

/// The probed point and what is known of it.
#[derive(Debug)]
pub struct Prober {
    view_ray: Option<Ray>,
    /// Whether the ray still has to be traced.
    is_due: bool,
    shown: Option<Probed>,
    coming: Background<(), Explanation>,
}

impl Prober {
    /// No point is probed yet. `wake` is called when light paths are found.
    pub fn new(wake: &Wake) -> Self {
        Self {
            view_ray: None,
            is_due: false,
            shown: None,
            coming: Background::new("probe", wake),
        }
    }

    /// Probes what is visible along a ray; `None` clears the probe.
    pub fn ask(&mut self, view_ray: Option<Ray>) {
        self.view_ray = view_ray;
        self.is_due = view_ray.is_some();
        self.coming.stop();
        self.shown = None;
    }

    /// Repeats the probe because the scene or its maps have changed.
    pub fn ask_again(&mut self) {
        self.is_due = self.view_ray.is_some();
    }

    /// Whether [`look`](Self::look) has to be called with the scene's surfaces.
    pub fn is_due(&self) -> bool {
        self.is_due
    }

    pub fn shown(&self) -> Option<&Probed> {
        self.shown.as_ref()
    }

    /// Traces the pending ray and starts to search light paths.
    pub fn look(&mut self, tracer: &Arc<Tracer>, maps: &[IlluminationMap], limits: Limits) {
        let Some(view_ray) = self.view_ray.filter(|_| self.is_due) else {
            return;
        };
        self.is_due = false;
        self.coming.stop();
        self.shown = None;
        let Some(seen) = seen(tracer, &view_ray) else {
            return;
        };
        let (probed, target) = read(tracer, maps, &seen);
        if let (Some(target), Some(texel)) = (target, &probed.texel) {
            let scale = scale_w_m2(maps, &target, texel);
            let tracer = Arc::clone(tracer);
            let search = move |task: &Task| explain(&tracer, &target, limits, scale, &task.control);
            if let Err(error) = self.coming.start((), search) {
                log::warn!("{error}");
            }
        }
        self.shown = Some(probed);
    }

    /// Takes the light paths; returns whether they have been found since the last call.
    pub fn poll(&mut self) -> bool {
        let Some(((), outcome)) = self.coming.take() else {
            return false;
        };
        let is_found = outcome.is_some();
        if let Some(shown) = &mut self.shown {
            shown.explanation = outcome.or_else(|| shown.explanation.take());
        }
        is_found
    }
}

/// Number of the strongest paths that are drawn.
const MAX_PATHS: usize = 24;
const CAUSTIC: Color32 = Color32::from_rgb(255, 196, 64);
const DIRECT: Color32 = Color32::from_rgb(120, 190, 255);
const POINT: Color32 = Color32::from_rgb(255, 80, 80);

/// Draws the paths over the picture; stronger paths are wider.
pub fn draw(painter: &Painter, lens: &Viewport<'_>, probed: &Probed) {
    let painter = painter.with_clip_rect(lens.picture);

    // Each path from its light to the surface, with a dot on every glass or mirror and a ring around its start.
    let paths = probed
        .explanation
        .iter()
        .flat_map(|explanation| &explanation.paths);
    for path in paths.take(MAX_PATHS) {
        let share = probed.share(path) as f32;
        let colour = if path.vertices.is_empty() { DIRECT } else { CAUSTIC };
        let stroke = Stroke::new(1.2 + 2.5 * share.clamp(0.0, 1.0), colour.gamma_multiply(0.9));
        let corners = path.vertices.iter().map(|vertex| vertex.point);
        let mut from = path.start;
        for to in corners.chain([path.end]) {
            if let Some(ends) = lens.line(from, to) {
                painter.line_segment(ends, stroke);
            }
            from = to;
        }
        for vertex in &path.vertices {
            if lens.is_before(vertex.point) {
                painter.circle_filled(lens.project(vertex.point), 3.0, colour);
            }
        }
        if lens.is_before(path.start) {
            painter.circle_stroke(lens.project(path.start), 5.0, Stroke::new(1.5, colour));
        }
    }

    // A cross hair on the probed point.
    if lens.is_before(probed.point) {
        let at = lens.project(probed.point);
        for (x, y) in [(6.0, 0.0), (0.0, 6.0)] {
            let ends = [pos2(at.x - x, at.y - y), pos2(at.x + x, at.y + y)];
            painter.line_segment(ends, Stroke::new(2.0, POINT));
        }
        painter.circle_stroke(at, 5.0, Stroke::new(1.5, POINT));
    }
}
