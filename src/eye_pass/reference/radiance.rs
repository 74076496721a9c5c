//! Radiance along a ray: DS*E chains followed from the eye.

use crate::geometry::Ray;
use crate::illumination::lookup::bilinear;
use crate::illumination::{Chart, IlluminationMap};
use crate::optics::LinearSrgb;
use crate::scene::SurfaceKind;
use crate::transport::{Branch, MediumStack, SurfaceHit, Tracer};

/// How far chains are followed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChainLimits {
    /// Largest number of specular surfaces between the eye and a diffuse one.
    pub max_depth: u32,
    /// Branches that carry less than this share of their pixel are black.
    pub branch_threshold: f64,
}

impl Default for ChainLimits {
    fn default() -> Self {
        Self {
            max_depth: 32,
            branch_threshold: 1e-4,
        }
    }
}

/// A scene with its maps, ready to be looked at.
pub struct LitScene<'a> {
    tracer: &'a Tracer,
    /// By object.
    maps: Vec<Option<MapTotal<'a>>>,
    background: LinearSrgb,
    limits: ChainLimits,
}

/// All layers of a map together.
struct MapTotal<'a> {
    chart: &'a Chart,
    irradiance: Vec<[f32; 3]>,
}

/// A ray on its way from the eye.
struct Gaze {
    ray: Ray,
    media: MediumStack,
    /// Share of the pixel's radiance that the ray brings, per channel.
    weight: LinearSrgb,
    /// Specular surfaces met so far.
    depth: u32,
}

impl<'a> LitScene<'a> {
    /// A scene lit by maps, before a background radiance [W/(m² sr)].
    pub fn new(
        tracer: &'a Tracer,
        maps: &'a [IlluminationMap],
        background: LinearSrgb,
        limits: ChainLimits,
    ) -> Self {
        let mut by_object: Vec<Option<MapTotal>> = (0..tracer.scene().objects.len()).map(|_| None).collect();
        for map in maps {
            by_object[map.chart.object] = Some(MapTotal {
                chart: &map.chart,
                irradiance: map.total(),
            });
        }
        Self {
            tracer,
            maps: by_object,
            background,
            limits,
        }
    }

    /// Radiance [W/(m² sr)] that arrives against a ray which starts within `media`.
    pub fn radiance(&self, ray: Ray, media: MediumStack) -> LinearSrgb {
        let mut seen = LinearSrgb::BLACK;
        let mut waiting = vec![Gaze {
            ray,
            media,
            weight: LinearSrgb::WHITE,
            depth: 0,
        }];
        while let Some(mut gaze) = waiting.pop() {
            let Some((hit, distance_m)) = visible_hit(self.tracer, gaze.ray) else {
                seen += gaze.weight * self.background;
                continue;
            };
            gaze.weight = gaze.weight * gaze.media.transmittance(self.tracer.scene(), distance_m);
            let incident = gaze.ray.direction;
            let interaction = self.tracer.interact(&hit, incident, &gaze.media);
            seen += gaze.weight * self.own_radiance(&hit, interaction.deposit);
            for branch in [interaction.reflection, interaction.transmission]
                .into_iter()
                .flatten()
            {
                waiting.extend(self.followed(&gaze, &branch));
            }
        }
        seen
    }

    /// What a surface sends by itself: emission, and the share of its map that its polish lets out, L = ρE/π.
    fn own_radiance(&self, hit: &SurfaceHit, share: LinearSrgb) -> LinearSrgb {
        let emitted = self.tracer.scene().material_of(hit.object).emitted_radiance;
        let Some(map) = self.maps[hit.object]
            .as_ref()
            .filter(|_| share != LinearSrgb::BLACK)
        else {
            return emitted;
        };
        let chart = map.chart;
        let uv = chart.uv(hit.triangle, hit.barycentric);
        let irradiance = bilinear(&map.irradiance, chart.width, chart.height, uv);
        emitted + share * self.tracer.base_colour(hit) * irradiance / std::f64::consts::PI
    }

    /// The gaze along a branch, unless it lies beyond the limits. Radiance through a refraction scales by the square
    /// of n on the eye's side over n on the far side.
    fn followed(&self, gaze: &Gaze, branch: &Branch) -> Option<Gaze> {
        let weight = gaze.weight * branch.share * (branch.ior_ratio * branch.ior_ratio);
        let within = gaze.depth < self.limits.max_depth
            && weight.max_channel() > 0.0
            && weight.max_channel() >= self.limits.branch_threshold;
        within.then(|| Gaze {
            ray: branch.ray,
            media: branch.media,
            weight,
            depth: gaze.depth + 1,
        })
    }
}

/// The nearest surface that is drawn, with its distance from the ray's origin [m]: backs of single-sided opaque
/// surfaces are not.
pub fn visible_hit(tracer: &Tracer, mut ray: Ray) -> Option<(SurfaceHit, f64)> {
    let mut passed_m = 0.0;
    loop {
        let hit = tracer.closest_hit(&ray)?;
        let material = tracer.scene().material_of(hit.object);
        let opaque = !matches!(material.surface, SurfaceKind::Dielectric | SurfaceKind::ThinWall);
        let back = hit.geometric_normal.dot(ray.direction) > 0.0;
        passed_m += hit.distance_m;
        if !(opaque && back && !material.double_sided) {
            return Some((hit, passed_m));
        }
        ray = hit.spawn(ray.direction);
    }
}
