//! Lights as texels sample them: points and directions once, extended lights by samples of their area.
//!
//! All texels share one sequence of samples of an extended light. Each run of 2ᵏ samples that begins at a multiple of
//! 2ᵏ is evenly spread. A texel selects a run by its hash and divides it among its sample points, so that both the
//! texel and the light are covered evenly and no pattern repeats from texel to texel.

use std::f64::consts::{PI, TAU};
use std::ops::Range;
use std::sync::Arc;

use glam::{DVec2, DVec3};

use super::facet::SurfacePoint;
use super::lighting::{IncidentLight, UnshadowedLight};
use super::polygon::Polygon;
use super::texel::SamplingDetail;
use crate::geometry::sampling::{even_point, mix64};
use crate::optics::LinearSrgb;
use crate::scene::emitter::{Emitter, EmitterSampler};
use crate::scene::{Environment, Light, LightKind, LightSize, Material, PanelShape, Scene};
use crate::transport::{DiffuseResponse, MediumStack, Tracer, media_at};

/// Number of samples that are prepared for a light: a power of 2.
const READY: usize = 1 << 13;
/// Number of directions that are prepared for a sky, of which texels need more.
const READY_OF_SKY: usize = 1 << 14;
/// Angular diameter of a sun [rad] up to which irradiance hardly varies over its disc.
const NARROW_RAD: f64 = 0.03;
/// Luminous surfaces of more triangles are integrated by samples alone.
const MAX_POLYGONS: usize = 16;
/// Corners of the polygon of the same area that approximates a disc, close by and from afar.
const DISC_CORNERS: [u32; 2] = [64, 12];
/// Half-axes of a disc from which on it is far: E is then within 1e-4 of the disc's.
const FAR: f64 = 4.0;
/// Part of its length by which a shadow ray ends short of a light, so as not to hit the light's own surface.
const SHADOW_RAY_MARGIN: f64 = 1e-9;
const SEED: u64 = 0x6c69_6768_7473;

/// A light prepared for sampling.
pub struct DirectSource {
    pub emission: Emission,
    /// Media around its middle. Direct light crosses no surface, and so stays within them.
    pub media: MediumStack,
}

pub enum Emission {
    /// A single point or direction.
    Single(Emitter),
    Extended(ExtendedLight),
}

/// An extended light.
pub struct ExtendedLight {
    places: LightSamples,
    /// Polygons of a simple light: its unoccluded E is analytic, and samples only estimate occlusion.
    shape: Option<Shape>,
    light: u64,
    /// Whether a few samples are enough, unless the light is partly occluded.
    pub is_even: bool,
}

enum LightSamples {
    /// Each as if all light came from there.
    Emitters { all: Vec<Emitter>, bright_m2: f64 },
    /// Directions: half of a run sampled from the sky, half by the cosine at the surface.
    Sky {
        sky: Arc<Environment>,
        strength: LinearSrgb,
        to_light: Vec<DVec3>,
        squares: Vec<DVec2>,
    },
    /// A sphere, by points of its visible cap.
    Ball {
        centre: DVec3,
        radius_m: f64,
        radiance: LinearSrgb,
        squares: Vec<DVec2>,
    },
}

struct Shape {
    polygons: Vec<Polygon>,
    from_afar: Option<FarDisc>,
    /// Of all emitting sides [m²].
    area_m2: f64,
}

/// A simpler polygon in place of a disc.
struct FarDisc {
    centre: DVec3,
    /// Distance from which on it does [m].
    far_m: f64,
    polygon: Polygon,
}

/// Irradiance at a point from an extended light.
#[derive(Clone, Copy, Default)]
pub struct Gathered {
    /// E [W/m²].
    pub irradiance: LinearSrgb,
    pub shadow_rays: u64,
    /// Shadow rays that were blocked, in whole or in part.
    pub blocked_rays: u64,
}

impl DirectSource {
    /// `index` is the light's place in the list of sources. `None` if the light emits nothing.
    pub fn new(light: &Light, tracer: &Tracer, index: usize) -> Option<Self> {
        let scene = tracer.scene();
        let middle = Emitter::middle(light, scene);
        let place = middle.as_ref().and_then(|middle| middle.kind.position());
        let media = place.map_or_else(MediumStack::default, |place| media_at(tracer, place));
        let emission = if light.has_extent() {
            let shape = shape(light, scene);
            let has_image =
                matches!(light.kind, LightKind::Surface { object, .. } if scene.glows.contains_key(&object));
            let is_narrow = |size: LightSize| matches!(size, LightSize::Angle { diameter_rad } if diameter_rad <= NARROW_RAD);
            let places = LightSamples::new(light, scene, index, shape.is_some())?;
            let is_ball = matches!(places, LightSamples::Ball { .. });
            Emission::Extended(ExtendedLight {
                places,
                light: index as u64,
                is_even: (shape.is_some() && !has_image) || is_ball || is_narrow(light.size),
                shape,
            })
        } else {
            Emission::Single(middle?)
        };
        Some(Self { emission, media })
    }
}

impl LightSamples {
    /// A light with a shape is sampled uniformly by area.
    fn new(light: &Light, scene: &Scene, index: usize, has_shape: bool) -> Option<Self> {
        // Owen-scrambled Sobol points, which all texels share.
        let sequence = |count: usize, pair| {
            (0..count as u32).map(move |place| even_point(place, pair, SEED + index as u64))
        };
        let squares = || sequence(READY, 0);
        Some(match (light.kind, light.size) {
            // Seen from afar, a sphere of intensity I is a disc of area πr²: its radiance is I/(πr²).
            (LightKind::Point { position, .. }, LightSize::Radius { radius_m }) => Self::Ball {
                centre: position,
                radius_m,
                radiance: light.strength() / (PI * radius_m * radius_m),
                squares: squares().collect(),
            },
            // Half of the samples follow the sky's radiance; the second sequence is for those that follow the
            // receiver's cosine.
            (LightKind::Environment { .. }, _) => {
                let sky = scene.environment.as_ref()?;
                let to_light: Option<Vec<DVec3>> = sequence(READY_OF_SKY, 0)
                    .map(|square| sky.sample(square).map(|sample| sample.to_light))
                    .collect();
                Self::Sky {
                    sky: Arc::clone(sky),
                    strength: light.strength(),
                    to_light: to_light?,
                    squares: sequence(READY_OF_SKY, 1).collect(),
                }
            }
            _ => {
                // Where the unoccluded E is analytic, samples only compare occluded with unoccluded light, evenly over
                // the area.
                let places = match has_shape {
                    true => EmitterSampler::spread_evenly(light, scene),
                    false => EmitterSampler::new(light, scene),
                };
                let all: Option<Vec<Emitter>> = squares().map(|square| places.sample(square)).collect();
                Self::Emitters {
                    all: all?,
                    bright_m2: places.bright_area_m2(),
                }
            }
        })
    }
}

/// The polygons of a light if they are few.
fn shape(light: &Light, scene: &Scene) -> Option<Shape> {
    // Panels and meshes of few triangles have a closed form of E; all other lights are left to samples.
    let mut from_afar = None;
    let polygons = match light.kind {
        LightKind::Panel {
            centre,
            across,
            down,
            shape,
            ..
        } => {
            let normal = across.cross(down).try_normalize()?;
            let outlined = |corners: u32| {
                let outline = shape.corners(corners, 0.0).into_iter();
                let corners = outline.map(|place| centre + across * place.x + down * place.y);
                Polygon::new(corners.collect(), normal, false)
            };
            let [near, far] = DISC_CORNERS;
            from_afar = (shape == PanelShape::Disc).then(|| FarDisc {
                centre,
                far_m: FAR * across.length().max(down.length()),
                polygon: outlined(far),
            });
            vec![outlined(near)]
        }
        // At each sample point, the closed form of every triangle is computed, which pays for few triangles only. Few
        // even samples would find the bright parts of a dark image.
        LightKind::Surface { object, .. } => {
            let mesh = scene.objects.get(object)?.in_scene();
            let is_even = scene.glows.get(&object).is_none_or(|glow| glow.is_even());
            if mesh.triangle_count() > MAX_POLYGONS || !is_even {
                return None;
            }
            let both_sides = scene.material_of(object).double_sided;
            let with_area =
                (0..mesh.triangle_count()).filter(|triangle| mesh.face_normal(*triangle) != DVec3::ZERO);
            with_area
                .map(|triangle| {
                    let corners = mesh.corners(triangle).to_vec();
                    Polygon::new(corners, mesh.face_normal(triangle), both_sides)
                })
                .collect()
        }
        _ => return None,
    };
    Some(Shape {
        polygons,
        from_afar,
        area_m2: EmitterSampler::new(light, scene).area_m2(),
    })
}

impl ExtendedLight {
    /// The light's samples for sample point `place` of a texel, which has `places` sample points.
    pub fn run(&self, texel: u64, place: usize, (places, detail): (usize, SamplingDetail)) -> Range<usize> {
        let (ready, of_texel) = match self.places {
            LightSamples::Sky { .. } => (2 * READY_OF_SKY, detail.samples_of_sky),
            _ => (READY, detail.samples_of_lamp),
        };
        let each = (of_texel / places.max(1)).max(2);
        let runs = ready / (each * places.next_power_of_two());
        let run = (mix64(texel ^ mix64(self.light)) % runs.max(1) as u64) as usize;
        let first = (run * places + place) * each % ready;
        first..first + each
    }

    /// Light at a point, estimated from a run of samples.
    pub fn gather(
        &self,
        tracer: &Tracer,
        point: &SurfacePoint,
        (material, response): (&Material, &DiffuseResponse),
        media: &MediumStack,
        run: Range<usize>,
    ) -> Gathered {
        // Each sample stands for the whole light and costs one shadow ray, which ends short of the light's own surface.
        let count = run.len() as f64;
        let mut sum = Sum::default();
        for index in run.clone() {
            let arriving = self
                .beam(index, &run, point, material)
                .and_then(|beam| UnshadowedLight::from_beam(&beam, point, response, (tracer.scene(), media)));
            let Some(arriving) = arriving else { continue };
            sum.shadow_rays += 1;
            sum.unoccluded += arriving.unoccluded;
            let distance_m = arriving.distance_m * (1.0 - SHADOW_RAY_MARGIN);
            let passing = tracer.passing_share(&point.spawn(arriving.to_light), distance_m);
            sum.blocked_rays += u64::from(passing < 1.0);
            sum.irradiance += arriving.irradiance * passing;
        }

        // The share of light that is not occluded scales the analytic E, so that fully lit places are free of noise.
        let irradiance = match self.unoccluded(point) {
            // Heitz, Hill and McGuire, "Combining analytic direct illumination and stochastic shadows", I3D 2018. The
            // ratio includes the image on a light, as it includes shadows.
            Some(unoccluded) if sum.unoccluded > 0.0 => sum.irradiance * (unoccluded / sum.unoccluded),
            Some(_) => LinearSrgb::BLACK,
            None => sum.irradiance / count,
        };
        Gathered {
            irradiance,
            shadow_rays: sum.shadow_rays,
            blocked_rays: sum.blocked_rays,
        }
    }

    /// Unoccluded E at unit strength of a sample, where there is a closed form.
    fn unoccluded(&self, point: &SurfacePoint) -> Option<f64> {
        match (&self.shape, &self.places) {
            (Some(shape), _) => Some(shape.projected_solid_angle_sr(point) / shape.area_m2),
            // That of a ball holds where no part of it is below the horizon.
            (None, LightSamples::Ball { centre, radius_m, .. }) => {
                let offset = *centre - point.position;
                let heights = [point.geometric_normal, point.shading_normal].map(|normal| normal.dot(offset));
                let distance_m = offset.length();
                let sine = radius_m / distance_m;
                let is_above = heights.iter().all(|height| *height >= *radius_m);
                is_above.then_some(PI * sine * sine * heights[1] / distance_m)
            }
            _ => None,
        }
    }

    /// One sample of a run, weighted as if all light came from it.
    fn beam(
        &self,
        index: usize,
        run: &Range<usize>,
        point: &SurfacePoint,
        material: &Material,
    ) -> Option<IncidentLight> {
        match &self.places {
            // A sample of a light without a closed form stands for a patch of it, since a point would be singular close
            // by.
            LightSamples::Emitters { all, bright_m2 } => {
                let patch_m2 = if self.shape.is_some() {
                    0.0
                } else {
                    bright_m2 / run.len() as f64
                };
                IncidentLight::of_patch(&all[index], point.position, patch_m2)
            }
            LightSamples::Sky {
                sky,
                strength,
                to_light,
                squares,
            } => {
                // Half of the run follows the sky's radiance and half the receiver's cosine: either alone is noisy
                // where the other varies.
                let surface = Cosines::of(point, material);
                let half = run.len() / 2;
                let place = run.start / 2 + (index - run.start) % half;
                let to_light = if index - run.start < half {
                    to_light[place]
                } else {
                    surface.sample(squares[place])
                };
                // Veach and Guibas, "Optimally combining sampling techniques", SIGGRAPH 1995: the balance heuristic.
                let density_per_sr = 0.5 * (sky.density_per_sr(to_light) + surface.density_per_sr(to_light));
                (density_per_sr > 0.0).then(|| IncidentLight {
                    to_light,
                    distance_m: f64::INFINITY,
                    across_beam: 1.0 / density_per_sr,
                    strength: *strength * sky.radiance(to_light),
                })
            }
            LightSamples::Ball {
                centre,
                radius_m,
                radiance,
                squares,
            } => ball(*centre, *radius_m, *radiance, point.position, squares[index]),
        }
    }
}

/// Cosine-weighted directions on one side of a surface or both.
struct Cosines {
    normal: DVec3,
    both_sides: bool,
}

impl Cosines {
    fn of(point: &SurfacePoint, material: &Material) -> Self {
        Self {
            normal: point.shading_normal,
            both_sides: material.double_sided,
        }
    }

    fn sample(&self, mut square: DVec2) -> DVec3 {
        let mut side = 1.0;
        if self.both_sides {
            square.x *= 2.0;
            if square.x >= 1.0 {
                (side, square.x) = (-1.0, square.x - 1.0);
            }
        }
        let (x, y) = self.normal.any_orthonormal_pair();
        let along = DVec2::from_angle(TAU * square.y) * square.x.sqrt();
        x * along.x + y * along.y + self.normal * (side * (1.0 - square.x).sqrt())
    }

    fn density_per_sr(&self, direction: DVec3) -> f64 {
        let cosine = self.normal.dot(direction);
        if self.both_sides {
            cosine.abs() / TAU
        } else {
            cosine.max(0.0) / PI
        }
    }
}

#[derive(Default)]
struct Sum {
    irradiance: LinearSrgb,
    /// Σ [`UnshadowedLight::unoccluded`].
    unoccluded: f64,
    shadow_rays: u64,
    blocked_rays: u64,
}

impl Shape {
    /// Unoccluded E/L [sr] at a point.
    fn projected_solid_angle_sr(&self, point: &SurfacePoint) -> f64 {
        let afar = self.from_afar.as_ref();
        let afar = afar.filter(|disc| point.position.distance_squared(disc.centre) > disc.far_m * disc.far_m);
        let polygons = afar.map_or(&self.polygons[..], |disc| std::slice::from_ref(&disc.polygon));
        let seen = polygons.iter().map(|polygon| {
            polygon.projected_solid_angle_sr(point.position, point.geometric_normal, point.shading_normal)
        });
        seen.sum()
    }
}

/// A sample of a sphere of uniform radiance, uniform in solid angle (Shirley, Wang and Zimmerman, "Monte Carlo
/// techniques for direct lighting calculations", 1996); `None` inside the sphere.
fn ball(
    centre: DVec3,
    radius_m: f64,
    radiance: LinearSrgb,
    point: DVec3,
    square: DVec2,
) -> Option<IncidentLight> {
    let offset = centre - point;
    let distance_m = offset.length();
    let axis = offset.try_normalize().filter(|_| distance_m > radius_m)?;
    let sine = radius_m / distance_m;
    // 1 − cos of the half-angle, without cancellation.
    let cap = sine * sine / (1.0 + (1.0 - sine * sine).sqrt());
    let height = cap * square.x;
    let sideways = (height * (2.0 - height)).sqrt();
    let (x, y) = axis.any_orthonormal_pair();
    let around = DVec2::from_angle(TAU * square.y) * sideways;
    let to_light = (x * around.x + y * around.y + axis * (1.0 - height)).try_normalize()?;
    let nearest = distance_m * (1.0 - height);
    let within = (radius_m * radius_m - (distance_m * sideways).powi(2))
        .max(0.0)
        .sqrt();
    Some(IncidentLight {
        to_light,
        distance_m: nearest - within,
        across_beam: TAU * cap,
        strength: radiance,
    })
}
