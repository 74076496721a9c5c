//! Radiance along a ray: DS*E chains followed from the eye.

use crate::effect::EffectSwitch;
use crate::eye_pass::facets::{FacetPoint, FacetPoints};
use crate::eye_pass::highlights::{self, Lobe, LobeLeft, RayCone, VisibleLamp};
use crate::eye_pass::relief::ReliefLights;
use crate::eye_pass::wavelengths::{self, SeenWavelength};
use crate::geometry::Ray;
use crate::illumination::lookup::in_chart;
use crate::illumination::{Chart, IlluminationMap, Receiver, Side};
use crate::optics::LinearSrgb;
use crate::scene::SurfaceKind;
use crate::transport::{Branch, EffectSet, Event, Interaction, MediumStack, SurfaceHit, Tracer};

/// Highlights that reflect a smaller radiance per irradiance [1/sr] are left out: a thousandth of a white surface in
/// the same light has 0.0003.
const DIMMEST_HIGHLIGHT: f64 = 3e-4;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChainLimits {
    /// Maximum number of specular surfaces between the eye and a diffuse one.
    pub max_depth: u32,
    /// Branches whose throughput is below this are black.
    pub branch_threshold: f64,
    /// Number of specular surfaces on a chain at which both branches are followed; beyond, only the stronger one is.
    pub branching_depth: u32,
    /// Whether a rough surface is seen by all microfacets of a sample even where it is dim, as on the device; else by
    /// fewer there.
    pub every_facet: bool,
    /// Off: mirrors show only their emission, coated surfaces their diffuse part, and clear bodies are left out. Auto
    /// and on are equivalent, since chains need no preparation.
    pub switch: EffectSwitch,
}

impl Default for ChainLimits {
    fn default() -> Self {
        Self {
            max_depth: 32,
            branch_threshold: 1e-4,
            branching_depth: u32::MAX,
            every_facet: false,
            switch: EffectSwitch::Auto,
        }
    }
}

/// Number of rays traced for a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EyeRays {
    /// Rays from the eye, one per sample.
    pub camera_rays: u64,
    /// Rays that continue after a specular surface.
    pub chain_rays: u64,
    /// Chain rays that carry a single wavelength.
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

/// A scene with its illumination maps, ready to be rendered.
pub struct LitScene<'a> {
    tracer: &'a Tracer,
    /// By [`Receiver::index`].
    maps: Vec<Option<MapTotal<'a>>>,
    /// Emitted radiance by object [W/(m² sr)].
    emitted: Vec<LinearSrgb>,
    relief: ReliefLights,
    lamps: Vec<VisibleLamp>,
    /// What stands for glowing objects and the suns of a sky in lobes.
    lobe_lamps: Vec<VisibleLamp>,
    background: LinearSrgb,
    limits: ChainLimits,
    has_chains: bool,
}

/// The sum of all layers of a map.
struct MapTotal<'a> {
    chart: &'a Chart,
    irradiance: Vec<[f32; 3]>,
}

/// One sample of a pixel.
pub struct EyeSample<'a> {
    pub cone: RayCone,
    /// Media around the eye.
    pub media: MediumStack,
    /// Wavelengths of the path from the first dispersive surface on.
    pub spectrum: &'a SpectralScene,
    pub facets: FacetPoints,
}

/// One ray of a chain, traced from the eye.
#[derive(Clone, Copy)]
struct EyePath<'a> {
    cone: RayCone,
    media: MediumStack,
    /// Throughput: share of the ray's radiance that reaches the pixel, per channel.
    weight: LinearSrgb,
    /// Specular surfaces met so far.
    depth: u32,
    /// Rough ones among them.
    lobes: u32,
    /// The microfacet, once the first rough one is met.
    facet: Option<FacetPoint>,
    coat: CoatPassed,
    /// The wavelength that is traced; `None` before the path splits into wavelengths.
    at: Option<&'a SceneAtWavelength>,
}

/// Whether a path has been reflected off a rough coat. Light that comes to one by way of mirrors and glass is a caustic,
/// which its map has: the few rays of its lobe would turn it into bright dots.
#[derive(Clone, Copy, Debug, PartialEq)]
enum CoatPassed {
    None,
    /// The coat was the last surface: lamps and glowing objects are seen.
    Last,
    /// A mirror or glass came after it: they are not.
    Before,
}

impl EyePath<'_> {
    /// Contribution to the pixel of a radiance at the far end of the ray.
    fn brings(&self, radiance: LinearSrgb) -> LinearSrgb {
        let brought = self.weight * radiance;
        match self.at {
            Some(at) => at.seen.of(brought),
            None => brought,
        }
    }

    /// Part of a lobe's width that the footprint keeps: all of it where one microfacet stands for the lobe.
    fn kept_width(&self) -> f64 {
        match (self.lobes, self.facet) {
            (1, Some(facet)) => facet.kept_width(),
            _ => 1.0,
        }
    }

    /// Largest share of the pixel that a branch of an interaction carries.
    fn carried_on(&self, met: &Interaction) -> f64 {
        let branches = [&met.reflection, &met.transmission].into_iter().flatten();
        let carried = branches.map(|branch| self.brings(branch.share).max_channel());
        carried.fold(0.0, f64::max)
    }
}

impl<'a> LitScene<'a> {
    /// A scene lit by maps. Rays that escape see its environment or, without one, a background radiance [W/(m² sr)].
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
            relief: ReliefLights::of(tracer.scene()),
            lamps: VisibleLamp::all(tracer.scene()),
            lobe_lamps: VisibleLamp::in_lobes(tracer.scene()),
            background,
            limits,
            has_chains: limits.switch != EffectSwitch::Off,
        }
    }

    /// Radiance [W/(m² sr)] that arrives within the cone of a sample. Without chains the ray ends at the first surface
    /// that is not clear.
    pub fn radiance(&self, sample: &EyeSample<'_>, rays: &mut EyeRays) -> LinearSrgb {
        // Paths that wait form a stack, so that long chains need no deep recursion.
        rays.camera_rays += 1;
        let mut seen = LinearSrgb::BLACK;
        let mut waiting = vec![EyePath {
            cone: sample.cone,
            media: sample.media,
            weight: LinearSrgb::WHITE,
            depth: 0,
            lobes: 0,
            facet: None,
            coat: CoatPassed::None,
            at: None,
        }];
        while let Some(mut path) = waiting.pop() {
            // Lamps are no surfaces: each segment of a chain sees those that lie before its end.
            let next = nearest(self.tracer, path.cone.ray, self.has_chains);
            seen += self.lamps_on(&path, next.map_or(f64::INFINITY, |(_, distance_m)| distance_m));
            let Some((hit, distance_m)) = next else {
                seen += path.brings(self.beyond(&path));
                continue;
            };

            // Along the segment the footprint changes, and the medium absorbs (Beer and Lambert).
            path.cone.width_m += path.cone.spread_rad * distance_m;
            if self.has_chains {
                path.weight = path.weight * path.media.transmittance(self.tracer.scene(), distance_m);
            }

            // At the first dispersive surface the path becomes one path per wavelength, each with indices of its own.
            if self.has_chains
                && path.at.is_none()
                && sample.spectrum.splits_at(self.tracer, &hit, &path.media)
            {
                for at in &sample.spectrum.wavelengths {
                    let at = Some(at);
                    seen += self.meet(sample, EyePath { at, ..path }, &hit, &mut waiting, rays);
                }
            } else {
                seen += self.meet(sample, path, &hit, &mut waiting, rays);
            }
        }
        seen
    }

    /// Radiance that a surface itself adds to a path. The branches to follow are pushed onto `waiting`.
    fn meet<'b>(
        &self,
        sample: &EyeSample<'_>,
        path: EyePath<'b>,
        hit: &SurfaceHit,
        waiting: &mut Vec<EyePath<'b>>,
        rays: &mut EyeRays,
    ) -> LinearSrgb {
        // A surface without branches shows its emission and its diffuse light.
        let incident = path.cone.ray.direction;
        let tracer = path.at.map_or(self.tracer, |at| &at.tracer);
        let smooth = tracer.interact(hit, incident, &path.media);
        let side = Side::met(incident, hit.geometric_normal);
        let emission = path.brings(self.emission(&path, hit));
        if !self.has_chains || (smooth.reflection.is_none() && smooth.transmission.is_none()) {
            return emission + path.brings(self.own_radiance(hit, side, smooth.leaving));
        }
        let shape = ChainSurface {
            curvature: tracer.curvature(hit) * side.sign(),
            alpha: tracer.lobe_alpha(hit),
            has_map: tracer.scene().material_of(hit.object).surface.is_receiver(),
        };
        if shape.alpha == 0.0 {
            self.go_on(&path, &smooth, &shape, waiting, rays);
            return emission + path.brings(self.own_radiance(hit, side, smooth.leaving));
        }

        // The first rough surface is seen by many of its microfacets, the later ones by one for each of those.
        let facets: Vec<FacetPoint> = match path.facet {
            Some(facet) => vec![facet],
            None => {
                let share = if self.limits.every_facet {
                    1.0
                } else {
                    path.carried_on(&smooth)
                };
                let count = sample.facets.count_for(share);
                (0..count).map(|index| sample.facets.point(index)).collect()
            }
        };
        let mut leaving = LinearSrgb::BLACK;
        for &facet in &facets {
            let at = Some(facet.at(path.lobes));
            let met = tracer.interact_with(EffectSet::EVERYTHING, hit, incident, &path.media, at);
            leaving += met.leaving / facets.len() as f64;
            let of_facet = EyePath {
                weight: path.weight / facets.len() as f64,
                lobes: path.lobes + 1,
                facet: Some(facet),
                ..path
            };
            self.go_on(&of_facet, &met, &shape, waiting, rays);
        }
        let mut seen = emission + path.brings(self.own_radiance(hit, side, leaving));

        // So few directions would miss most lamps that are smaller than the lobe: those are highlights.
        if let Some(reflection) = &smooth.reflection {
            seen += path.brings(self.highlights(tracer, &path, hit, reflection, shape.alpha));
        }
        seen
    }

    /// Pushes the branches of a path that are to be followed onto `waiting`.
    fn go_on<'b>(
        &self,
        path: &EyePath<'b>,
        met: &Interaction,
        shape: &ChainSurface,
        waiting: &mut Vec<EyePath<'b>>,
        rays: &mut EyeRays,
    ) {
        // Beyond the branching depth only the stronger branch goes on: the paths would double at each surface.
        let [back, through] = [met.reflection, met.transmission]
            .map(|branch| branch.and_then(|branch| self.followed(path, &branch, shape)));
        let is_through_stronger = match (&back, &through) {
            (Some(back), Some(through)) => through.weight.max_channel() >= back.weight.max_channel(),
            _ => through.is_some(),
        };
        let follows_both = path.depth < self.limits.branching_depth;
        let back = back.filter(|_| follows_both || !is_through_stronger);
        let through = through.filter(|_| follows_both || is_through_stronger);
        for next in [back, through].into_iter().flatten() {
            rays.chain_rays += 1;
            rays.rays_by_wavelength += u64::from(next.at.is_some());
            waiting.push(next);
        }
    }

    /// Contribution of the lamps between a surface that a path has left and the next one.
    fn lamps_on(&self, path: &EyePath<'_>, reach_m: f64) -> LinearSrgb {
        if path.coat == CoatPassed::Before {
            return LinearSrgb::BLACK;
        }
        // The eye does not see points directly.
        let mut seen = LinearSrgb::BLACK;
        let lamps = self.lamps.iter().filter(|lamp| path.depth > 0 || lamp.has_extent);
        let lamps = lamps.map(|lamp| lamp.seen(&path.cone, reach_m));
        let in_lobe = self
            .lobe_lamps
            .iter()
            .map(|lamp| lamp.seen_in_lobe(&path.cone, reach_m));
        for (radiance, distance_m) in lamps.chain(in_lobe).flatten() {
            seen += path.brings(radiance * self.transmittance(&path.media, distance_m));
        }
        seen
    }

    /// Reflected radiance [W/(m² sr)] of the lamps that are smaller than the lobe of a rough surface, and of others in its
    /// tails.
    fn highlights(
        &self,
        tracer: &Tracer,
        path: &EyePath<'_>,
        hit: &SurfaceHit,
        reflection: &Branch,
        alpha: f64,
    ) -> LinearSrgb {
        // Bumps bend the normal of the lobe; the plane of the triangle decides which lamps are above the surface.
        let incident = path.cone.ray.direction;
        let [geometric, normal] = hit.normals_towards(incident);
        let lobe = Lobe {
            point: hit.point,
            to_eye: -incident,
            normal,
            alpha,
            // That of a pixel is the same for all of a picture's surfaces.
            seen_by: if path.lobes > 0 { path.cone.spread_rad } else { 0.0 },
        };

        // Highlights too dim to be seen get no shadow ray: the throughput of the chain's own reflection decides.
        let reflected = (path.weight * reflection.share).max_channel();
        let mut seen = LinearSrgb::BLACK;
        for lamp in self.lamps.iter().chain(&self.lobe_lamps) {
            lamp.highlights(&lobe, |highlight| {
                let is_seen = highlight.response * reflected >= DIMMEST_HIGHLIGHT;
                let ray = hit.spawn(highlight.to_light);
                if !is_seen
                    || highlight.to_light.dot(geometric) <= 0.0
                    || tracer.is_blocked(&ray, highlight.distance_m)
                {
                    return;
                }

                // The reflectance of the microfacets that shine.
                let facet = SurfaceHit {
                    shading_normal: highlight.half,
                    ..*hit
                };
                let reflection = tracer.interact(&facet, incident, &path.media).reflection;
                let share = reflection.map_or(LinearSrgb::BLACK, |branch| branch.share);
                let left = self.transmittance(&path.media, highlight.distance_m);
                seen += highlight.irradiance * share * left * highlight.response;
            });
        }
        seen
    }

    /// Share of light that is left after a distance in a medium; all of what comes from infinity.
    fn transmittance(&self, media: &MediumStack, distance_m: f64) -> LinearSrgb {
        if distance_m.is_infinite() {
            return LinearSrgb::WHITE;
        }
        media.transmittance(self.tracer.scene(), distance_m)
    }

    /// Radiance of the environment, less its suns where they count as lamps, or of the background [W/(m² sr)].
    fn beyond(&self, path: &EyePath<'_>) -> LinearSrgb {
        let is_in_lobe = path.cone.lobe.alpha() > highlights::SKY_SUN_ALPHA;
        match self.tracer.scene().sky() {
            Some((sky, strength)) => {
                let has_suns = !is_in_lobe && path.coat != CoatPassed::Before;
                let cut = if has_suns { f64::INFINITY } else { sky.suns().cut };
                strength * sky.smooth_radiance(path.cone.ray.direction, cut)
            }
            None => self.background,
        }
    }

    /// Emission that is not shown as a highlight of the surface that the ray left.
    fn emission(&self, path: &EyePath<'_>, hit: &SurfaceHit) -> LinearSrgb {
        let is_highlight = || {
            self.lobe_lamps
                .iter()
                .any(|lamp| lamp.replaces(hit.object, &path.cone))
        };
        if self.emitted[hit.object] == LinearSrgb::BLACK || path.coat == CoatPassed::Before || is_highlight()
        {
            return LinearSrgb::BLACK;
        }
        let scene = self.tracer.scene();
        self.emitted[hit.object] * scene.glow_at(hit.object, hit.triangle, hit.barycentric)
    }

    /// Diffuse radiance L = ρE/π of the map, of which the coat lets `share` out.
    fn own_radiance(&self, hit: &SurfaceHit, side: Side, share: LinearSrgb) -> LinearSrgb {
        let Some(map) = self.maps[Receiver::new(hit.object, side).index()]
            .as_ref()
            .filter(|_| share != LinearSrgb::BLACK)
        else {
            return LinearSrgb::BLACK;
        };
        let chart = map.chart;
        let uv = chart.uv(hit.triangle, hit.barycentric);
        let mut irradiance = in_chart(chart, &map.irradiance, uv);
        if let Some(bent) = self.tracer.relief_normal(hit) {
            let normals = [hit.interpolated_normal, bent].map(|normal| normal * side.sign());
            irradiance = self.relief.shaded(irradiance, hit.point, normals);
        }
        share * self.tracer.base_colour(hit) * irradiance / std::f64::consts::PI
    }

    /// The path along a branch; `None` beyond the limits. Refraction scales radiance by the square of n on the eye's
    /// side over n on the far side.
    fn followed<'b>(
        &self,
        path: &EyePath<'b>,
        branch: &Branch,
        surface: &ChainSurface,
    ) -> Option<EyePath<'b>> {
        let weight = path.weight * branch.share * (branch.ior_ratio * branch.ior_ratio);
        let within = path.depth < self.limits.max_depth
            && weight.max_channel() > 0.0
            && weight.max_channel() >= self.limits.branch_threshold;
        within.then(|| EyePath {
            cone: surface.bent(&path.cone, branch, path.kept_width()),
            coat: surface.coat_after(path.coat, branch.event),
            media: branch.media,
            weight,
            depth: path.depth + 1,
            ..*path
        })
    }
}

/// What turns the edges of a cone at a specular surface.
struct ChainSurface {
    /// Divergence of the normals per length on the side of the ray [1/m].
    curvature: f64,
    /// GGX α; 0 where the surface is smooth.
    alpha: f64,
    /// Whether it has an illumination map.
    has_map: bool,
}

impl ChainSurface {
    fn coat_after(&self, before: CoatPassed, event: Event) -> CoatPassed {
        let is_in_lobe = event.is_reflection() && self.alpha > 0.0;
        match before {
            CoatPassed::None if is_in_lobe && self.has_map => CoatPassed::Last,
            CoatPassed::Last if !is_in_lobe && event != Event::Passage => CoatPassed::Before,
            before => before,
        }
    }

    /// The cone along a branch, which starts as wide as another arrives and keeps a part of the lobe's width.
    fn bent(&self, cone: &RayCone, branch: &Branch, kept: f64) -> RayCone {
        // Between the reflections off microfacets that are tilted by atan α one way and the other.
        let lobe_rad = kept * 4.0 * self.alpha.atan();
        let (spread_rad, widened_rad, lobe) = match branch.event {
            Event::Reflection | Event::TotalInternalReflection => {
                let of_shape = 2.0 * self.curvature * cone.width_m;
                let facet = (branch.ray.direction - cone.ray.direction).normalize();
                let tilt = if self.alpha > 0.0 {
                    highlights::tilt(facet, branch.normal)
                } else {
                    0.0
                };
                let lobe = LobeLeft::Reflection(self.alpha.max(0.5 * tilt));
                (cone.spread_rad + of_shape, lobe_rad, lobe)
            }
            Event::Refraction => {
                let ratio = branch.ior_ratio;
                let of_shape = (ratio - 1.0) * self.curvature * cone.width_m;
                // A facet's tilt turns a refracted ray by |ratio − 1| times the tilt, and a reflected one by twice the
                // tilt.
                let narrower = 0.5 * (ratio - 1.0).abs();
                (
                    cone.spread_rad * ratio + of_shape,
                    narrower * lobe_rad,
                    LobeLeft::Transmission(narrower * self.alpha),
                )
            }
            Event::ThinTransmission => (cone.spread_rad, lobe_rad, LobeLeft::Transmission(self.alpha)),
            Event::Passage => (cone.spread_rad, 0.0, cone.lobe),
        };

        // What a lobe has widened comes to no focus, as if the cone grew from here on.
        let (width_m, spread_rad) = if widened_rad > 0.0 {
            (cone.width_m.abs(), spread_rad.abs() + widened_rad)
        } else {
            (cone.width_m, spread_rad)
        };
        RayCone {
            ray: branch.ray,
            width_m,
            spread_rad,
            lobe,
        }
    }
}

/// The nearest visible surface, with its distance from the ray's origin [m]. Backs of single-sided opaque surfaces are
/// not visible.
pub fn visible_hit(tracer: &Tracer, ray: Ray) -> Option<(SurfaceHit, f64)> {
    nearest(tracer, ray, true)
}

/// The nearest visible surface; without chains, clear ones are skipped too.
fn nearest(tracer: &Tracer, mut ray: Ray, has_chains: bool) -> Option<(SurfaceHit, f64)> {
    let mut passed_m = 0.0;
    loop {
        let hit = tracer.closest_hit(&ray)?;
        let material = tracer.scene().material_of(hit.object);
        let back = hit.geometric_normal.dot(ray.direction) > 0.0;
        passed_m += hit.distance_m;
        let is_drawn = if material.surface.is_clear() {
            has_chains
        } else {
            !back || material.has_back()
        };
        if is_drawn {
            return Some((hit, passed_m));
        }
        ray = hit.spawn(ray.direction);
    }
}

/// The scene at a single wavelength.
#[derive(Debug)]
pub struct SceneAtWavelength {
    pub seen: SeenWavelength,
    /// Uses the refractive indices at the wavelength.
    pub tracer: Tracer,
}

/// The wavelengths of one sample; none in scenes without dispersion.
#[derive(Debug, Default)]
pub struct SpectralScene {
    /// Their matrices add up to the identity.
    pub wavelengths: Vec<SceneAtWavelength>,
}

impl SpectralScene {
    /// For each sample of a pixel `count` wavelengths, whose shift varies between samples; none in scenes without
    /// dispersion.
    pub fn of_samples(tracer: &Tracer, count: u32, samples: u32) -> Vec<Self> {
        let is_dispersive_scene = tracer.scene().parts_wavelengths() && count > 0;
        let sample = |index: u32| {
            if !is_dispersive_scene {
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

    /// Whether the directions or shares of light that leaves a surface depend on the wavelength.
    pub fn splits_at(&self, tracer: &Tracer, hit: &SurfaceHit, media: &MediumStack) -> bool {
        let scene = tracer.scene();
        let is_dispersive = |object: usize| scene.material_of(object).is_dispersive();
        let goes_by_index = match scene.material_of(hit.object).surface {
            SurfaceKind::Dielectric | SurfaceKind::ThinWall | SurfaceKind::Coated | SurfaceKind::Varied => {
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
