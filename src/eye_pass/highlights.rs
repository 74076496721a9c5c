//! Lamps as they are seen: directly if they have an extent, in mirrors, in glass and on glossy surfaces; twin of
//! `shaders/eye_pass/lamps.wgsl` and `highlights.wgsl`.
//!
//! A ray of a chain stands for a cone, the footprint of its pixel, and sees a lamp by the share of the cone that the
//! lamp fills. Bulbs and suns that are smaller than the footprint are spread over a disc of its size. The image of a
//! lamp thus holds the same energy at any resolution, and lamps without extent are seen too, though not by the eye
//! directly.
//!
//! The rays that leave a rough surface are too few to meet a lamp that is smaller than the lobe. It is a highlight there
//! instead: the lobe times the lamp's irradiance, with a shadow ray, to which clear surfaces are opaque, as they are to
//! direct light. So is a larger one in the lobe's tails: for microfacets that are tilted further than a reflection of the
//! lamp is wide. Rays see it by the others. Glowing objects and the suns of a sky count as lamps there, and are not seen
//! by the rays that leave the surface. Behind a rough pane or interface, which has no highlights, they are seen as lamps
//! by the cones of the rays.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use crate::geometry::Ray;
use crate::optics::LinearSrgb;
use crate::scene::emitter::{Emitter, EmitterKind, EmitterSampler};
use crate::scene::environment::suns::{self, SkySun};
use crate::scene::{Light, LightKind, LightSize, PanelShape, Scene};
use crate::transport::ggx_reflection;
use crate::units::Irradiance;

/// Angular radius of lamps without extent where a focus leaves no footprint [rad]: a fifth of a pixel of 1 mrad.
const POINT_RADIUS_RAD: f64 = 2e-4;
/// A lamp lies on a ray if it is nearer than the next surface by this part of the distance: panels often lie on the
/// glowing surface that shows them.
const BEFORE_SURFACE: f64 = 1e-4;
/// Lobes of a larger GGX α show the suns of a sky as highlights: half the tangent of their radius.
pub const SKY_SUN_ALPHA: f64 = 0.5 * suns::TAN_RADIUS;
/// A glowing object counts as a ball where a lobe as wide has a smaller GGX α: five radii away.
const LARGEST_BALL: f64 = 0.1;
/// Most patches across and down a panel that are highlights of their own.
const PATCHES: u32 = 4;

/// A ray with the cone of directions that it stands for.
#[derive(Clone, Copy, Debug)]
pub struct RayCone {
    pub ray: Ray,
    /// Width of the cone at the origin [m].
    pub width_m: f64,
    /// Growth of the width per length [rad]; negative where the cone narrows.
    pub spread_rad: f64,
    pub lobe: LobeLeft,
}

/// The lobe that a ray comes from: lamps smaller than a reflection of this GGX α are seen otherwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LobeLeft {
    /// The ray left a smooth surface or the eye.
    None,
    /// As highlights of the surface that reflected the ray.
    Reflection(f64),
    /// As lamps, however small.
    Transmission(f64),
}

impl LobeLeft {
    /// 0 without a lobe.
    pub fn alpha(self) -> f64 {
        match self {
            Self::None => 0.0,
            Self::Reflection(alpha) | Self::Transmission(alpha) => alpha,
        }
    }
}

impl RayCone {
    /// Width [m] at a distance [m]; negative beyond a focus.
    fn width_at(&self, distance_m: f64) -> f64 {
        self.width_m + self.spread_rad * distance_m
    }
}

/// A point of a rough surface and the direction from which it is seen.
#[derive(Clone, Copy, Debug)]
pub struct Lobe {
    /// [m].
    pub point: DVec3,
    /// Unit, towards the eye.
    pub to_eye: DVec3,
    /// Unit normal for scattering, on the side of the eye.
    pub normal: DVec3,
    /// GGX α, > 0.
    pub alpha: f64,
    /// Spread of the cone that sees it [rad], which widens its highlights.
    pub seen_by: f64,
}

/// Unshadowed reflection of one lamp, or of a patch of it.
#[derive(Clone, Copy, Debug)]
pub struct Highlight {
    /// Unit.
    pub to_light: DVec3,
    /// Infinite for suns.
    pub distance_m: f64,
    /// Unit normal of the microfacets that reflect it, whose reflectance is a factor of the radiance.
    pub half: DVec3,
    /// Reflected radiance per irradiance across the beam [1/sr], at a reflectance of 1.
    pub response: f64,
    /// Irradiance across the beam [W/m²].
    pub irradiance: LinearSrgb,
}

/// A lamp without glowing surface, or one that stands for a glowing object in the lobes of rough surfaces.
#[derive(Clone, Debug)]
pub struct VisibleLamp {
    /// The glowing object.
    object: Option<usize>,
    /// The whole lamp, from its centre.
    emitter: Emitter,
    outline: Outline,
    /// Of a panel; 0 for others.
    area_m2: f64,
    /// Whether the eye sees it directly.
    pub has_extent: bool,
}

/// What a lamp looks like.
#[derive(Clone, Copy, Debug)]
pub(super) enum Outline {
    /// A sun: a disc in the sky.
    Angle {
        /// Tangent of its angular radius.
        tan_radius: f64,
    },
    /// A bulb: a circle from all sides.
    Round { radius_m: f64 },
    /// A panel.
    Flat {
        /// Half-axis [m].
        across: DVec3,
        /// Half-axis [m].
        down: DVec3,
        shape: PanelShape,
    },
}

impl Outline {
    /// `None` for surfaces, which are seen themselves, and the sky.
    pub(super) fn of(light: &Light) -> Option<Self> {
        let radius = match light.size {
            LightSize::None => 0.0,
            LightSize::Radius { radius_m } => radius_m,
            LightSize::Angle { diameter_rad } => (0.5 * diameter_rad).tan(),
        };
        match light.kind {
            LightKind::Surface { .. } | LightKind::Environment { .. } => None,
            LightKind::Panel {
                across, down, shape, ..
            } => Some(Self::Flat { across, down, shape }),
            LightKind::Sun { .. } => Some(Self::Angle { tan_radius: radius }),
            LightKind::Point { .. } | LightKind::Spot { .. } => Some(Self::Round { radius_m: radius }),
        }
    }
}

impl VisibleLamp {
    /// All lamps of a scene that are no surfaces and no sky.
    pub fn all(scene: &Scene) -> Vec<Self> {
        let lamps = scene.lights.iter();
        lamps.filter_map(|light| Self::of(light, scene)).collect()
    }

    /// What stands for the glowing objects and the suns of a sky in the lobes of rough surfaces.
    pub fn in_lobes(scene: &Scene) -> Vec<Self> {
        let lamp = |(object, light): (Option<usize>, Light)| {
            let lamp = Self::of(&light, scene)?;
            Some(Self { object, ..lamp })
        };
        lamps_in_lobes(scene).into_iter().filter_map(lamp).collect()
    }

    /// Whether it stands for an object in the lobe that a cone comes from.
    pub fn replaces(&self, object: usize, cone: &RayCone) -> bool {
        self.object == Some(object) && self.is_smaller_than(cone.lobe.alpha(), cone.ray.origin)
    }

    /// Whether it is smaller than a lobe seen from a point, and far enough for what it stands for.
    fn is_smaller_than(&self, alpha: f64, point: DVec3) -> bool {
        self.alpha_from(point) < alpha.min(self.largest())
    }

    /// GGX α of a lobe as wide as it may be seen at most.
    fn largest(&self) -> f64 {
        match (self.object, self.outline) {
            (Some(_), Outline::Round { .. }) => LARGEST_BALL,
            _ => f64::INFINITY,
        }
    }

    /// [`seen`](Self::seen) of what stands for a glowing object or a sun of the sky.
    pub fn seen_in_lobe(&self, cone: &RayCone, reach_m: f64) -> Option<(LinearSrgb, f64)> {
        match cone.lobe {
            LobeLeft::Transmission(alpha) if self.is_smaller_than(alpha, cone.ray.origin) => {
                // The surface of the object itself ends the reach.
                let beyond_m = reach_m * (1.0 + 2.0 * BEFORE_SURFACE) + self.depth_m();
                self.seen(cone, beyond_m)
            }
            _ => None,
        }
    }

    fn of(light: &Light, scene: &Scene) -> Option<Self> {
        let outline = Outline::of(light)?;
        let sampler = EmitterSampler::new(light, scene);
        Some(Self {
            object: None,
            outline,
            emitter: sampler.middle()?,
            area_m2: sampler.area_m2(),
            has_extent: light.has_extent(),
        })
    }

    /// Intensity on the axis [W/sr]; of suns normal irradiance [W/m²].
    #[cfg(feature = "gpu")]
    pub(super) fn strength(&self) -> LinearSrgb {
        self.emitter.strength
    }

    /// Radiance [W/(m² sr)] that a cone sees, averaged over it, with the distance of the lamp [m]. `reach_m`: distance
    /// of the next surface, infinite if there is none.
    pub fn seen(&self, cone: &RayCone, reach_m: f64) -> Option<(LinearSrgb, f64)> {
        if matches!(cone.lobe, LobeLeft::Reflection(alpha) if self.is_smaller_than(alpha, cone.ray.origin)) {
            return None;
        }
        match self.outline {
            Outline::Angle { tan_radius } if reach_m.is_infinite() => self.seen_sun(cone, tan_radius),
            Outline::Angle { .. } => None,
            Outline::Round { radius_m } => self.seen_bulb(cone, radius_m),
            Outline::Flat { across, down, shape } => self.seen_panel(cone, [across, down], shape),
        }
        .filter(|(_, distance_m)| reach_m.is_infinite() || *distance_m < reach_m * (1.0 - BEFORE_SURFACE))
    }

    fn seen_sun(&self, cone: &RayCone, tan_radius: f64) -> Option<(LinearSrgb, f64)> {
        let (to_sun, ..) = self.emitter.kind.seen_from(DVec3::ZERO, 0.0)?;
        let direction = cone.ray.direction;
        let cosine = to_sun.dot(direction);
        if cosine <= 0.0 {
            return None;
        }
        let offset = (direction / cosine - to_sun).length();
        let footprint = disc_of(cone.spread_rad);
        let radius = tan_radius.max(POINT_RADIUS_RAD).max(footprint);
        let share = share_of_disc(offset, radius, footprint);
        // E⊥ = πL sin²α.
        let per_irradiance = (1.0 + radius * radius) / (PI * radius * radius);
        (share > 0.0).then_some((self.emitter.strength * (share * per_irradiance), f64::INFINITY))
    }

    fn seen_bulb(&self, cone: &RayCone, radius_m: f64) -> Option<(LinearSrgb, f64)> {
        let Ray { origin, direction } = cone.ray;
        let to_lamp = self.emitter.kind.position()? - origin;
        let along_m = to_lamp.dot(direction);
        if along_m <= 0.0 {
            return None;
        }
        let offset_m = (to_lamp - direction * along_m).length();
        let footprint_m = disc_of(cone.width_at(along_m));
        let radius_m = radius_m.max(POINT_RADIUS_RAD * along_m).max(footprint_m);
        let share = share_of_disc(offset_m, radius_m, footprint_m) * self.emitter.kind.falloff(-direction);
        let radiance = self.emitter.strength * (share / (PI * radius_m * radius_m));
        (share > 0.0).then_some((radiance, along_m))
    }

    fn seen_panel(
        &self,
        cone: &RayCone,
        [across, down]: [DVec3; 2],
        shape: PanelShape,
    ) -> Option<(LinearSrgb, f64)> {
        let Ray { origin, direction } = cone.ray;
        let normal = across.cross(down);
        let slope = direction.dot(normal);
        let to_lamp = self.emitter.kind.position()? - origin;
        let distance_m = to_lamp.dot(normal) / slope;
        // Also where the quotient is not a number.
        if !(slope < 0.0 && distance_m > 0.0) {
            return None;
        }
        let from_centre = direction * distance_m - to_lamp;
        let along = DVec2::new(
            from_centre.cross(down).dot(normal),
            across.cross(from_centre).dot(normal),
        );
        let width = 0.5 * cone.width_at(distance_m).abs();
        let half_widths = [across, down].map(|axis| width / axis.length());
        let share = share_of_panel(along / normal.length_squared(), half_widths, shape);
        let radiance = self.emitter.strength * (share / self.area_m2);
        (share > 0.0).then_some((radiance, distance_m))
    }

    /// Highlights of the lamp in a lobe that is wider than it, or in the tails of one that is not.
    pub fn highlights(&self, lobe: &Lobe, mut met: impl FnMut(&Highlight)) {
        // Of a lamp, or a patch of a panel, that is wider than the lobe, rays see what microfacets reflect that are tilted
        // less: each counts once.
        let size = self.alpha_from(lobe.point);
        if size >= self.largest() {
            return;
        }
        let sides = self.patches_across(lobe.alpha, size);
        let (least_tilt, of_patch) = if size < lobe.alpha {
            (0.0, size * f64::from(PATCHES) / f64::from(sides))
        } else {
            // Tails vary little over a patch.
            (2.0 * size, 0.0)
        };

        // A lobe as wide as the real one, the patch and the cone together: a tilt of α turns a ray by 4 α from edge to
        // edge.
        let of_cone = 0.25 * lobe.seen_by;
        let alpha_squared = lobe.alpha * lobe.alpha + of_patch * of_patch + of_cone * of_cone;

        // The shadow ray ends short of the lamp, whose own glowing surface would block it.
        let mut from = |emitter: &Emitter, patch_m2: f64| {
            let Some((to_light, distance_m, across_beam)) = emitter.kind.seen_from(lobe.point, patch_m2)
            else {
                return;
            };
            let response = ggx_reflection(lobe.normal, lobe.to_eye, to_light, alpha_squared);
            let half = (lobe.to_eye + to_light).normalize();
            let is_tilted = tilt(half, lobe.normal) >= least_tilt;
            if response > 0.0 && across_beam > 0.0 && is_tilted {
                met(&Highlight {
                    to_light,
                    distance_m: (distance_m - self.depth_m()) * (1.0 - BEFORE_SURFACE),
                    half,
                    response,
                    irradiance: emitter.strength * across_beam,
                });
            }
        };

        // Only panels are divided into patches, of which each is smaller than the lobe.
        let (EmitterKind::Facet { position, normal }, Outline::Flat { across, down, shape }) =
            (self.emitter.kind, self.outline)
        else {
            return from(&self.emitter, 0.0);
        };
        let places = patches(shape, sides);
        let share = 1.0 / places.len() as f64;
        let patch_m2 = self.area_m2 * share;
        for place in places {
            let kind = EmitterKind::Facet {
                position: position + across * place.x + down * place.y,
                normal,
            };
            let strength = self.emitter.strength * share;
            from(&Emitter { kind, strength }, patch_m2);
        }
    }

    /// Patches across and down a panel, of which the smallest have the α `size`: as few as are half as wide as the lobe.
    /// Other lamps are as wide as their patches.
    fn patches_across(&self, alpha: f64, size: f64) -> u32 {
        let Outline::Flat { .. } = self.outline else {
            return PATCHES;
        };
        let whole = size * f64::from(PATCHES);
        let mut sides = 1;
        while sides < PATCHES && whole > 0.5 * alpha * f64::from(sides) {
            sides *= 2;
        }
        sides
    }

    /// Depth of its centre below the surface of a glowing object that it stands for, at most [m]: to a corner of the cube
    /// around it.
    fn depth_m(&self) -> f64 {
        match (self.object, self.outline) {
            (Some(_), Outline::Round { radius_m }) => 3.0_f64.sqrt() * radius_m,
            _ => 0.0,
        }
    }

    /// GGX α of a lobe as wide as a lamp, or a patch of a panel, is seen from a point: half the tangent of its angular
    /// radius, as a microfacet's tilt turns its reflection twice as far.
    fn alpha_from(&self, point: DVec3) -> f64 {
        let distance = self
            .emitter
            .kind
            .position()
            .map_or(1.0, |place| place.distance(point));
        let radius = match self.outline {
            Outline::Angle { tan_radius } => tan_radius,
            Outline::Round { radius_m } => radius_m,
            Outline::Flat { across, down, .. } => across.length().max(down.length()) / f64::from(PATCHES),
        };
        0.5 * radius / distance.max(f64::MIN_POSITIVE)
    }
}

/// Tangent of the angle between the unit normal of a microfacet and that of its surface.
pub fn tilt(facet: DVec3, normal: DVec3) -> f64 {
    facet.cross(normal).length() / facet.dot(normal).max(f64::MIN_POSITIVE)
}

/// Lamps that stand for glowing objects, and for the suns of a sky; an object that shines from two sides has two.
pub(super) fn lamps_in_lobes(scene: &Scene) -> Vec<(Option<usize>, Light)> {
    let mut lamps = Vec::new();
    for light in &scene.lights {
        match (light.kind, &scene.environment) {
            (LightKind::Surface { object, .. }, _) => {
                let all = EmitterSampler::new(light, scene).stand_ins();
                lamps.extend(all.into_iter().map(|lamp| (Some(object), lamp)));
            }
            (LightKind::Environment { .. }, Some(sky)) => {
                lamps.extend(sky.suns().suns.iter().map(|sun| (None, of_sky(light, sun))));
            }
            _ => {}
        }
    }
    lamps
}

/// The light of a sun in a sky.
fn of_sky(sky: &Light, sun: &SkySun) -> Light {
    Light {
        colour: sky.strength() * sun.irradiance,
        kind: LightKind::Sun {
            direction: -sun.to_sun,
            normal_irradiance: Irradiance(1.0),
        },
        size: LightSize::Angle {
            diameter_rad: 2.0 * suns::TAN_RADIUS.atan(),
        },
        ..sky.clone()
    }
}

/// Centres of the patches of a panel in the coordinates of its half-axes.
fn patches(shape: PanelShape, sides: u32) -> Vec<DVec2> {
    let centre = |step: u32| (f64::from(step) + 0.5) * 2.0 / f64::from(sides) - 1.0;
    let all = (0..sides * sides).map(|patch| DVec2::new(centre(patch % sides), centre(patch / sides)));
    all.filter(|place| shape == PanelShape::Rectangle || place.length() < 1.0)
        .collect()
}

/// Radius of the disc with the area of a square footprint.
fn disc_of(width: f64) -> f64 {
    width.abs() / PI.sqrt()
}

/// Share of a disc, the footprint, that lies within another at an offset.
fn share_of_disc(offset: f64, radius: f64, footprint: f64) -> f64 {
    let footprint = footprint.max(1e-3 * radius);
    if offset >= radius + footprint {
        return 0.0;
    }
    let (small, large) = (radius.min(footprint), radius.max(footprint));
    let whole = (small / footprint).powi(2);
    if offset <= large - small {
        return whole;
    }
    // The lens between two circles.
    let angle = |of: f64, other: f64| {
        let cosine = (offset * offset + of * of - other * other) / (2.0 * offset * of);
        let angle = cosine.clamp(-1.0, 1.0).acos();
        of * of * (angle - angle.sin() * angle.cos())
    };
    let lens = angle(small, large) + angle(large, small);
    lens / (PI * footprint * footprint)
}

/// Share of a footprint of these half-widths that lies on a panel, all in coordinates of its half-axes.
fn share_of_panel(place: DVec2, half_widths: [f64; 2], shape: PanelShape) -> f64 {
    let [x, y] = half_widths.map(|width| width.max(1e-3));
    match shape {
        PanelShape::Rectangle => share_of_side(place.x, x) * share_of_side(place.y, y),
        PanelShape::Disc => share_of_disc(place.length(), 1.0, 2.0 * (x * y / PI).sqrt()),
    }
}

/// Share of an interval of a half-width about a place that lies between -1 and 1.
fn share_of_side(place: f64, half_width: f64) -> f64 {
    let (low, high) = ((place - half_width).max(-1.0), (place + half_width).min(1.0));
    (high - low).max(0.0) / (2.0 * half_width)
}
