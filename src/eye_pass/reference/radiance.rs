//! Radiance along a ray: DS*E chains followed from the eye.

use glam::DVec3;

use crate::effect::EffectSwitch;
use crate::eye_pass::wavelengths::{self, SeenWavelength};
use crate::geometry::Ray;
use crate::illumination::lookup::in_chart;
use crate::illumination::{Chart, IlluminationMap, Receiver, Side};
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
    /// Up to this many surfaces on a chain both ways on are followed, and after them the one that carries more.
    pub branching_depth: u32,
    /// Off: mirrors show what they emit, polished surfaces their diffuse part, and clear bodies are left out. Auto and
    /// on are the same here: nothing is prepared for chains.
    pub switch: EffectSwitch,
}

impl Default for ChainLimits {
    fn default() -> Self {
        Self {
            max_depth: 32,
            branch_threshold: 1e-4,
            branching_depth: u32::MAX,
            switch: EffectSwitch::Auto,
        }
    }
}

/// Rays of a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EyeRays {
    /// From the eye, one for each sample.
    pub camera_rays: u64,
    /// Further ones, each after a specular surface.
    pub chain_rays: u64,
    /// Those of them that were followed at one wavelength.
    pub rays_by_wavelength: u64,
}

impl std::ops::Add for EyeRays {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            camera_rays: self.camera_rays + other.camera_rays,
            chain_rays: self.chain_rays + other.chain_rays,
            rays_by_wavelength: self.rays_by_wavelength + other.rays_by_wavelength,
        }
    }
}

/// A scene with its maps, ready to be looked at.
pub struct LitScene<'a> {
    tracer: &'a Tracer,
    /// By object.
    maps: Vec<Option<MapTotal<'a>>>,
    /// Emission of each object [W/(m² sr)].
    emitted: Vec<LinearSrgb>,
    background: LinearSrgb,
    limits: ChainLimits,
}

/// All layers of a map together.
struct MapTotal<'a> {
    chart: &'a Chart,
    irradiance: Vec<[f32; 3]>,
}

/// A ray on its way from the eye.
#[derive(Clone, Copy)]
struct EyePath<'a> {
    ray: Ray,
    media: MediumStack,
    /// Share of the pixel's radiance that the ray brings, per channel.
    weight: LinearSrgb,
    /// Specular surfaces met so far.
    depth: u32,
    /// The wavelength that it is followed at; `None` where it stands for all of them.
    at: Option<&'a SceneAtWavelength>,
}

impl EyePath<'_> {
    /// What a radiance at its end adds to the pixel's.
    fn brings(&self, radiance: LinearSrgb) -> LinearSrgb {
        let brought = self.weight * radiance;
        match self.at {
            Some(at) => at.seen.of(brought),
            None => brought,
        }
    }
}

impl<'a> LitScene<'a> {
    /// A scene lit by maps, before its environment or else a background radiance [W/(m² sr)].
    pub fn new(
        tracer: &'a Tracer,
        maps: &'a [IlluminationMap],
        background: LinearSrgb,
        limits: ChainLimits,
    ) -> Self {
        let objects = tracer.scene().objects.len();
        let mut by_receiver: Vec<Option<MapTotal>> = Receiver::all(objects).map(|_| None).collect();
        for map in maps {
            by_receiver[map.chart.receiver.index()] = Some(MapTotal {
                chart: &map.chart,
                irradiance: map.total(),
            });
        }
        let emitted = (0..tracer.scene().objects.len()).map(|object| tracer.scene().emitted_radiance(object));
        Self {
            tracer,
            maps: by_receiver,
            emitted: emitted.collect(),
            background,
            limits,
        }
    }

    /// Radiance [W/(m² sr)] that arrives against a ray which starts within `media`, at the wavelengths of `spectrum`
    /// where it is parted. Without `CHAINS` the ray ends at the first surface that is not clear.
    pub fn radiance<const CHAINS: bool>(
        &self,
        ray: Ray,
        media: MediumStack,
        spectrum: &SpectralScene,
        rays: &mut EyeRays,
    ) -> LinearSrgb {
        rays.camera_rays += 1;
        let mut seen = LinearSrgb::BLACK;
        let mut waiting = vec![EyePath {
            ray,
            media,
            weight: LinearSrgb::WHITE,
            depth: 0,
            at: None,
        }];
        while let Some(mut gaze) = waiting.pop() {
            let Some((hit, distance_m)) = nearest::<CHAINS>(self.tracer, gaze.ray) else {
                seen += gaze.brings(self.beyond(gaze.ray.direction));
                continue;
            };
            if CHAINS {
                gaze.weight = gaze.weight * gaze.media.transmittance(self.tracer.scene(), distance_m);
            }
            if CHAINS && gaze.at.is_none() && spectrum.parts(self.tracer, &hit, &gaze.media) {
                for at in &spectrum.wavelengths {
                    let at = Some(at);
                    seen += self.meet::<CHAINS>(EyePath { at, ..gaze }, &hit, &mut waiting, rays);
                }
            } else {
                seen += self.meet::<CHAINS>(gaze, &hit, &mut waiting, rays);
            }
        }
        seen
    }

    /// What a gaze sees of the surface that it meets; the ways on wait.
    fn meet<'b, const CHAINS: bool>(
        &self,
        gaze: EyePath<'b>,
        hit: &SurfaceHit,
        waiting: &mut Vec<EyePath<'b>>,
        rays: &mut EyeRays,
    ) -> LinearSrgb {
        let incident = gaze.ray.direction;
        let tracer = gaze.at.map_or(self.tracer, |at| &at.tracer);
        let interaction = tracer.interact(hit, incident, &gaze.media);
        let side = Side::met(incident, hit.geometric_normal);
        let seen = gaze.brings(self.own_radiance(hit, side, interaction.leaving));
        if !CHAINS {
            return seen;
        }
        let [back, through] = [interaction.reflection, interaction.transmission]
            .map(|branch| branch.and_then(|branch| self.followed(&gaze, &branch)));
        let is_through_stronger = match (&back, &through) {
            (Some(back), Some(through)) => through.weight.max_channel() >= back.weight.max_channel(),
            _ => through.is_some(),
        };
        let follows_both = gaze.depth < self.limits.branching_depth;
        let back = back.filter(|_| follows_both || !is_through_stronger);
        let through = through.filter(|_| follows_both || is_through_stronger);
        for next in [back, through].into_iter().flatten() {
            rays.chain_rays += 1;
            rays.rays_by_wavelength += u64::from(next.at.is_some());
            waiting.push(next);
        }
        seen
    }

    /// What is seen where nothing stands in the way [W/(m² sr)].
    fn beyond(&self, direction: DVec3) -> LinearSrgb {
        match self.tracer.scene().sky() {
            Some((sky, strength)) => strength * sky.smooth_radiance(direction),
            None => self.background,
        }
    }

    /// What a surface sends by itself: emission, and the share of its map that its polish lets out, L = ρE/π.
    fn own_radiance(&self, hit: &SurfaceHit, side: Side, share: LinearSrgb) -> LinearSrgb {
        let scene = self.tracer.scene();
        let emitted = self.emitted[hit.object] * scene.glow_at(hit.object, hit.triangle, hit.barycentric);
        let Some(map) = self.maps[Receiver::new(hit.object, side).index()]
            .as_ref()
            .filter(|_| share != LinearSrgb::BLACK)
        else {
            return emitted;
        };
        let chart = map.chart;
        let uv = chart.uv(hit.triangle, hit.barycentric);
        let irradiance = in_chart(chart, &map.irradiance, uv);
        emitted + share * self.tracer.base_colour(hit) * irradiance / std::f64::consts::PI
    }

    /// The gaze along a branch, unless it lies beyond the limits. Radiance through a refraction scales by the square
    /// of n on the eye's side over n on the far side.
    fn followed<'b>(&self, gaze: &EyePath<'b>, branch: &Branch) -> Option<EyePath<'b>> {
        let weight = gaze.weight * branch.share * (branch.ior_ratio * branch.ior_ratio);
        let within = gaze.depth < self.limits.max_depth
            && weight.max_channel() > 0.0
            && weight.max_channel() >= self.limits.branch_threshold;
        within.then(|| EyePath {
            ray: branch.ray,
            media: branch.media,
            weight,
            depth: gaze.depth + 1,
            at: gaze.at,
        })
    }
}

/// The nearest surface that is drawn, with its distance from the ray's origin [m]: backs of single-sided opaque
/// surfaces are not.
pub fn visible_hit(tracer: &Tracer, ray: Ray) -> Option<(SurfaceHit, f64)> {
    nearest::<true>(tracer, ray)
}

/// The nearest surface that is drawn; without `CHAINS` clear ones are not.
fn nearest<const CHAINS: bool>(tracer: &Tracer, mut ray: Ray) -> Option<(SurfaceHit, f64)> {
    let mut passed_m = 0.0;
    loop {
        let hit = tracer.closest_hit(&ray)?;
        let material = tracer.scene().material_of(hit.object);
        let back = hit.geometric_normal.dot(ray.direction) > 0.0;
        passed_m += hit.distance_m;
        let is_drawn = if material.surface.is_clear() {
            CHAINS
        } else {
            !back || material.has_back()
        };
        if is_drawn {
            return Some((hit, passed_m));
        }
        ray = hit.spawn(ray.direction);
    }
}

/// The scene as light of one wavelength meets it.
#[derive(Debug)]
pub struct SceneAtWavelength {
    /// What the eye sees of that wavelength.
    pub seen: SeenWavelength,
    /// With the indices of that wavelength.
    pub tracer: Tracer,
}

/// The wavelengths of one sample; none where nothing is to be parted.
#[derive(Debug, Default)]
pub struct SpectralScene {
    /// Together they are all light.
    pub wavelengths: Vec<SceneAtWavelength>,
}

impl SpectralScene {
    /// For each of a pixel's samples `count` wavelengths, shifted from sample to sample; none in scenes where all
    /// light goes the same ways.
    pub fn of_samples(tracer: &Tracer, count: u32, samples: u32) -> Vec<Self> {
        let is_parting = tracer.scene().parts_wavelengths() && count > 0;
        let sample = |index: u32| {
            if !is_parting {
                return Self::default();
            }
            let bands = wavelengths::bands(count, wavelengths::shift_of_sample(index));
            let at = |seen: SeenWavelength| SceneAtWavelength {
                tracer: tracer.with_indices_at(seen.wavelength),
                seen,
            };
            Self {
                wavelengths: bands.into_iter().map(at).collect(),
            }
        };
        (0..samples).map(sample).collect()
    }

    /// Whether light goes on from a surface another way at another wavelength, or another part of it does.
    pub fn parts(&self, tracer: &Tracer, hit: &SurfaceHit, media: &MediumStack) -> bool {
        let scene = tracer.scene();
        let is_dispersive = |object: usize| scene.material_of(object).is_dispersive();
        let goes_by_index = match scene.material_of(hit.object).surface {
            SurfaceKind::Dielectric | SurfaceKind::ThinWall | SurfaceKind::Mixed | SurfaceKind::Varied => {
                true
            }
            SurfaceKind::Diffuse | SurfaceKind::Mirror => false,
        };
        !self.wavelengths.is_empty()
            && goes_by_index
            && (is_dispersive(hit.object)
                || media
                    .objects()
                    .iter()
                    .any(|object| is_dispersive(*object as usize)))
    }
}
