//! The origin of one wavefront: a single point or direction of a light that may be larger.

use glam::{DVec2, DVec3};

use super::glow_sampler::GlowSampler;
use super::{Light, LightKind, LightSize, PanelShape, Scene};
use crate::optics::LinearSrgb;

/// Source of the rays of one wavefront.
#[derive(Clone, Debug, PartialEq)]
pub struct Emitter {
    /// Position and angular distribution.
    pub kind: EmitterKind,
    /// Intensity on the axis [W/sr] or, for parallel light, normal irradiance [W/m²], per channel: of the whole light,
    /// as if it all came from here. The mean over all samples of the light is the light.
    pub strength: LinearSrgb,
}

/// Position and angular distribution of a source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EmitterKind {
    /// Uniform in all directions.
    Point {
        /// [m].
        position: DVec3,
    },
    /// A cone with a soft edge (KHR_lights_punctual).
    Spot {
        /// [m].
        position: DVec3,
        /// Unit, away from the lamp.
        direction: DVec3,
        /// Half-angle of the cone of full strength [rad].
        inner_cone_rad: f64,
        /// Half-angle at which the light ends [rad], at most π/2.
        outer_cone_rad: f64,
    },
    /// A point of an emissive surface: cosine distribution, one-sided.
    Facet {
        /// [m].
        position: DVec3,
        /// Unit, on the side that shines.
        normal: DVec3,
    },
    /// Parallel light from infinity.
    Parallel {
        /// Unit, direction of travel.
        direction: DVec3,
    },
}

impl EmitterKind {
    /// Relative strength in a unit direction, [0, 1].
    pub fn falloff(&self, direction: DVec3) -> f64 {
        match *self {
            Self::Spot {
                direction: axis,
                inner_cone_rad,
                outer_cone_rad,
                ..
            } => spot_falloff(axis.dot(direction), inner_cone_rad, outer_cone_rad),
            Self::Facet { normal, .. } => normal.dot(direction).max(0.0),
            Self::Point { .. } | Self::Parallel { .. } => 1.0,
        }
    }

    /// Unit vector from a point [m] to the source, distance [m] (infinite for parallel light), and E at unit strength
    /// on a surface there that faces the source; `None` at the source itself. A source that represents a patch of a
    /// surface has the irradiance of a disc of its area [m²], which stays finite close by (Wallace, Elmquist and
    /// Haines, "A ray tracing algorithm for progressive radiosity", SIGGRAPH 1989).
    pub fn seen_from(&self, point: DVec3, patch_m2: f64) -> Option<(DVec3, f64, f64)> {
        if let Self::Parallel { direction } = *self {
            return Some((-direction, f64::INFINITY, 1.0));
        }
        let offset = self.position()? - point;
        let to_light = offset.try_normalize()?;
        let spread_m2 = offset.length_squared() + patch_m2 / std::f64::consts::PI;
        Some((to_light, offset.length(), self.falloff(-to_light) / spread_m2))
    }

    /// Axis and half-angle [rad] of the cone that contains all its light; `None` without such a cone.
    pub fn cone(&self) -> Option<(DVec3, f64)> {
        match *self {
            Self::Spot {
                direction,
                outer_cone_rad,
                ..
            } => Some((direction, outer_cone_rad)),
            Self::Facet { normal, .. } => Some((normal, std::f64::consts::FRAC_PI_2)),
            Self::Point { .. } | Self::Parallel { .. } => None,
        }
    }

    /// Position [m]; `None` for parallel light.
    pub fn position(&self) -> Option<DVec3> {
        match *self {
            Self::Point { position } | Self::Spot { position, .. } | Self::Facet { position, .. } => {
                Some(position)
            }
            Self::Parallel { .. } => None,
        }
    }
}

/// Angular falloff of a spot, [0, 1]: square of a linear ramp in the cosine to the axis (KHR_lights_punctual).
pub fn spot_falloff(cosine: f64, inner_cone_rad: f64, outer_cone_rad: f64) -> f64 {
    let (cos_outer, cos_inner) = (outer_cone_rad.cos(), inner_cone_rad.cos());
    let ramp = if cos_inner > cos_outer {
        ((cosine - cos_outer) / (cos_inner - cos_outer)).clamp(0.0, 1.0)
    } else {
        f64::from(u8::from(cosine >= cos_outer))
    };
    ramp * ramp
}

impl Emitter {
    /// Centre of a light, without its extent; of a glowing surface, a point of its front that stands for all of it.
    /// `None` if it has no centre or emits nothing.
    pub fn middle(light: &Light, scene: &Scene) -> Option<Self> {
        EmitterSampler::new(light, scene).middle()
    }
}

/// A light prepared for many samples.
#[derive(Debug)]
pub struct EmitterSampler<'a> {
    light: &'a Light,
    scene: &'a Scene,
    /// Of an emissive object.
    surface: Option<GlowSampler<'a>>,
    /// See [`Self::disc_radius_m`].
    disc_radius_m: Option<f64>,
}

/// Distance in radii of a ball and a sphere together from which the lines between them are those between two discs, but
/// for 3 % of the sphere's radius.
const AFAR: f64 = 3.0;

impl<'a> EmitterSampler<'a> {
    /// Prepares a light of a scene.
    pub fn new(light: &'a Light, scene: &'a Scene) -> Self {
        Self::spread(light, scene, false)
    }

    /// Like [`new`](Self::new), but samples the dark parts of a textured surface as often as bright ones.
    pub fn spread_evenly(light: &'a Light, scene: &'a Scene) -> Self {
        Self::spread(light, scene, true)
    }

    fn spread(light: &'a Light, scene: &'a Scene, is_even: bool) -> Self {
        let surface = match light.kind {
            LightKind::Surface { object, .. } => GlowSampler::new(scene, object, is_even),
            _ => None,
        };
        Self {
            light,
            scene,
            surface,
            disc_radius_m: None,
        }
    }

    /// Samples the light at a point of the unit square; `None` if it emits nothing.
    pub fn sample(&self, square: DVec2) -> Option<Emitter> {
        self.at(Some(square))
    }

    /// The same for light towards spheres alone, given by their centres and radii [m]. If all of them lie on one side of
    /// a flat surface that shines from both, no sample is spent on the other. From afar, a ball of light is a disc.
    #[must_use]
    pub fn towards(mut self, spheres: impl Iterator<Item = (DVec3, f64)> + Clone) -> Self {
        if let Some(surface) = &mut self.surface {
            surface.choose_side(spheres.clone());
        }
        if let (LightKind::Point { position, .. }, LightSize::Radius { radius_m }) =
            (self.light.kind, self.light.size)
        {
            let mut spheres = spheres;
            let is_far =
                |(centre, sphere_m): (DVec3, f64)| centre.distance(position) > AFAR * (radius_m + sphere_m);
            self.disc_radius_m = spheres.all(is_far).then_some(radius_m);
        }
        self
    }

    /// Radius of a ball of light that is far from all that it shines on [m]; `None` for other lights.
    pub fn disc_radius_m(&self) -> Option<f64> {
        self.disc_radius_m
    }

    /// Outline of a light that faces one way, or that looks as if it did, as a ball does; `None` for other lights.
    pub fn outline(&self) -> Option<PanelShape> {
        match self.light.kind {
            LightKind::Sun { .. } | LightKind::Spot { .. } => Some(PanelShape::Disc),
            LightKind::Panel { shape, .. } => Some(shape),
            LightKind::Surface { .. } => {
                let surface = self.surface.as_ref()?;
                let is_panel = surface.parallelogram.is_some() && !surface.both_sides;
                is_panel.then_some(PanelShape::Rectangle)
            }
            LightKind::Point { .. } => self.disc_radius_m.map(|_| PanelShape::Disc),
            LightKind::Environment { .. } => None,
        }
    }

    /// Lamps that shine from afar as an emissive object does, for rough surfaces; empty for other lights.
    pub fn stand_ins(&self) -> Vec<Light> {
        let (LightKind::Surface { object, radiance }, Some(surface)) = (self.light.kind, &self.surface)
        else {
            return Vec::new();
        };
        let has_inside = surface.both_sides && self.scene.objects[object].is_closed();
        let lamps = surface.stand_ins(radiance, has_inside).into_iter();
        let lamp = |(kind, size)| Light {
            kind,
            size,
            ..self.light.clone()
        };
        lamps.map(lamp).collect()
    }

    /// Emitting area of an object, over all its emitting sides, or of a panel [m²]; 0 for other lights.
    pub fn area_m2(&self) -> f64 {
        match self.light.kind {
            LightKind::Panel {
                across, down, shape, ..
            } => {
                let outline = match shape {
                    PanelShape::Rectangle => 4.0,
                    PanelShape::Disc => std::f64::consts::PI,
                };
                across.cross(down).length() * outline
            }
            _ => self.surface.as_ref().map_or(0.0, GlowSampler::area_m2),
        }
    }

    /// Area of a surface of even brightness from which light is spread as it is from this one [m²]: small if a texture
    /// lets little of it shine.
    pub fn bright_area_m2(&self) -> f64 {
        self.surface
            .as_ref()
            .map_or(self.area_m2(), |surface| surface.bright_area_m2)
    }

    /// The light's centre, as [`Emitter::middle`].
    pub fn middle(&self) -> Option<Emitter> {
        self.at(None)
    }

    fn at(&self, square: Option<DVec2>) -> Option<Emitter> {
        // Each sample stands for the whole light, so that the mean over samples has the power of the light.
        let (light, scene) = (self.light, self.scene);
        let strength = light.strength();
        let whole = |kind: EmitterKind, factor: f64| Emitter {
            kind,
            strength: strength * factor,
        };
        match (light.kind, light.size, square) {
            (LightKind::Point { position, .. }, LightSize::Radius { radius_m }, Some(square)) => {
                let normal = on_sphere(square);
                // The sphere's radiance is I/(πr²); each sample stands for its whole area 4πr².
                let position = position + normal * radius_m;
                Some(whole(EmitterKind::Facet { position, normal }, 4.0))
            }
            (LightKind::Point { position, .. }, ..) => Some(whole(EmitterKind::Point { position }, 1.0)),
            (
                LightKind::Spot {
                    position,
                    direction,
                    inner_cone_rad,
                    outer_cone_rad,
                    ..
                },
                size,
                square,
            ) => {
                // Every point of the disc shines as the whole spot does: the cone keeps its axis and its angles.
                let offset = match (size, square) {
                    (LightSize::Radius { radius_m }, Some(square)) => {
                        let (x, y) = direction.any_orthonormal_pair();
                        let place = on_disc(square) * radius_m;
                        x * place.x + y * place.y
                    }
                    _ => DVec3::ZERO,
                };
                Some(whole(
                    EmitterKind::Spot {
                        position: position + offset,
                        direction,
                        inner_cone_rad,
                        outer_cone_rad,
                    },
                    1.0,
                ))
            }
            (LightKind::Sun { direction, .. }, LightSize::Angle { diameter_rad }, Some(square)) => {
                let half_angle_rad = 0.5 * diameter_rad;
                let direction = in_cap(direction, half_angle_rad, square);
                // E⊥ = πL sin²α over the disc's solid angle 2π(1 − cos α).
                let factor = 2.0 / (1.0 + half_angle_rad.cos());
                Some(whole(EmitterKind::Parallel { direction }, factor))
            }
            (LightKind::Sun { direction, .. }, ..) => Some(whole(EmitterKind::Parallel { direction }, 1.0)),
            (
                LightKind::Panel {
                    centre,
                    across,
                    down,
                    shape,
                    ..
                },
                _,
                square,
            ) => {
                // Radiance times area is the intensity along the normal; a facet falls off by the cosine.
                let normal = across.cross(down).try_normalize()?;
                let place = match (shape, square) {
                    (_, None) => DVec2::ZERO,
                    (PanelShape::Rectangle, Some(square)) => in_rectangle(square),
                    (PanelShape::Disc, Some(square)) => on_disc(square),
                };
                let position = centre + across * place.x + down * place.y;
                Some(whole(EmitterKind::Facet { position, normal }, self.area_m2()))
            }
            (LightKind::Surface { .. }, _, square) => {
                // Where an image varies the radiance, a sample has that of its texel; the middle has the mean.
                let surface = self.surface.as_ref()?;
                // A surface that shines from both sides has its front where y is below 0.5.
                let middle = DVec2::new(0.5, if surface.both_sides { 0.25 } else { 0.5 });
                let point = surface.sample(square.unwrap_or(middle))?;
                let brightness = point.brightness.filter(|_| square.is_some());
                Some(Emitter {
                    strength: brightness.map_or(strength, |of| strength * of) * surface.area_m2(),
                    kind: EmitterKind::Facet {
                        position: point.position,
                        normal: point.normal,
                    },
                })
            }
            (LightKind::Environment { .. }, _, square) => {
                // Radiance over the density of its direction is E as if the whole sky shone from there.
                let sample = scene.environment.as_ref()?.sample(square?)?;
                Some(Emitter {
                    kind: EmitterKind::Parallel {
                        direction: -sample.to_light,
                    },
                    strength: strength * sample.irradiance,
                })
            }
        }
    }
}

impl PanelShape {
    /// Maps the unit square to the shape, uniformly: [−1, 1]², in half-axes from its centre.
    pub fn at(self, square: DVec2) -> DVec2 {
        match self {
            Self::Rectangle => in_rectangle(square),
            Self::Disc => on_disc(square),
        }
    }

    /// Mean square of a coordinate, in half-axes from its centre.
    pub fn second_moment(self) -> f64 {
        match self {
            Self::Rectangle => 1.0 / 3.0,
            Self::Disc => 0.25,
        }
    }

    /// Corners of the shape, in half-axes from its centre. For a disc, those of a regular polygon of the same area,
    /// turned by a part of a side.
    pub fn corners(self, sides: u32, turn: f64) -> Vec<DVec2> {
        match self {
            Self::Rectangle => [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
                .map(DVec2::from)
                .to_vec(),
            Self::Disc => {
                let side_rad = std::f64::consts::TAU / f64::from(sides);
                let radius = (side_rad / side_rad.sin()).sqrt();
                (0..sides)
                    .map(|corner| DVec2::from_angle((f64::from(corner) + turn) * side_rad) * radius)
                    .collect()
            }
        }
    }
}

/// Uniform over the square [−1, 1]².
fn in_rectangle(square: DVec2) -> DVec2 {
    square * 2.0 - 1.0
}

/// Uniform unit vectors.
fn on_sphere(square: DVec2) -> DVec3 {
    let z = 1.0 - 2.0 * square.x;
    let radius = (1.0 - z * z).max(0.0).sqrt();
    let (sine, cosine) = (std::f64::consts::TAU * square.y).sin_cos();
    DVec3::new(radius * cosine, radius * sine, z)
}

/// Uniform over the unit disc; concentric map of Shirley and Chiu (1997), under which neighbours stay neighbours.
pub fn on_disc(square: DVec2) -> DVec2 {
    let [x, y] = (square * 2.0 - 1.0).to_array();
    if x == 0.0 && y == 0.0 {
        return DVec2::ZERO;
    }
    let quarter = std::f64::consts::FRAC_PI_4;
    let (radius, angle) = if x.abs() > y.abs() {
        (x, quarter * (y / x))
    } else {
        (y, std::f64::consts::FRAC_PI_2 - quarter * (x / y))
    };
    DVec2::from_angle(angle) * radius
}

/// Unit directions within a half-angle [rad] of an axis, uniform in solid angle.
pub fn in_cap(axis: DVec3, half_angle_rad: f64, square: DVec2) -> DVec3 {
    in_cap_across(axis, axis.any_orthonormal_pair(), half_angle_rad, square)
}

/// The same with two vectors across the axis, along which the square lies.
pub fn in_cap_across(axis: DVec3, (x, y): (DVec3, DVec3), half_angle_rad: f64, square: DVec2) -> DVec3 {
    let place = on_disc(square);
    // 1 − cos θ, without cancellation.
    let height = 2.0 * (0.5 * half_angle_rad).sin().powi(2) * place.length_squared();
    let sine = (height * (2.0 - height)).sqrt();
    let sideways = place.normalize_or_zero() * sine;
    (x * sideways.x + y * sideways.y + axis * (1.0 - height)).normalize()
}

/// Directions per side of the square over which an environment is integrated.
const ENVIRONMENT_SIDE: u32 = 16;

impl Scene {
    /// Unoccluded light of all sources that arrives at the middle of the scene from all directions [W/m²]; meant for
    /// its colour. A source near the middle counts as if it stood at the border of the scene.
    pub fn light_at_middle(&self) -> LinearSrgb {
        let (low, high) = self.bounds().unwrap_or_default();
        let (middle, radius_m) = (0.5 * (low + high), 0.5 * (high - low).length());
        let of_lamp = |light: &Light| match Emitter::middle(light, self) {
            Some(emitter) => emitter.strength * received_per_m2(&emitter.kind, middle, radius_m),
            None => self.environment_at_centre(),
        };
        let lamps = self.lights.iter().map(of_lamp);
        lamps.fold(LinearSrgb::BLACK, |sum, light| sum + light)
    }

    /// The same for the environment.
    fn environment_at_centre(&self) -> LinearSrgb {
        let Some((environment, strength)) = self.sky() else {
            return LinearSrgb::BLACK;
        };
        let place = |index: u32| (f64::from(index) + 0.5) / f64::from(ENVIRONMENT_SIDE);
        let count = ENVIRONMENT_SIDE * ENVIRONMENT_SIDE;
        let squares = (0..count)
            .map(|index| DVec2::new(place(index % ENVIRONMENT_SIDE), place(index / ENVIRONMENT_SIDE)));
        let sum = squares.fold(LinearSrgb::BLACK, |sum, square| {
            sum + environment.smooth_radiance(direction_of(square), f64::INFINITY)
        });
        strength * sum * (4.0 * std::f64::consts::PI / f64::from(count))
    }
}

/// Unit direction for a point of the unit square, uniform in solid angle.
fn direction_of(square: DVec2) -> DVec3 {
    let (sine, cosine) = (std::f64::consts::TAU * square.x).sin_cos();
    let height = 1.0 - 2.0 * square.y;
    let around = (1.0 - height * height).max(0.0).sqrt();
    DVec3::new(around * cosine, height, around * sine)
}

/// Normal irradiance from a source of unit strength at a place [1/m²], or 1 for parallel light; ignores falloff.
fn received_per_m2(kind: &EmitterKind, middle: DVec3, radius_m: f64) -> f64 {
    match *kind {
        EmitterKind::Parallel { .. } => 1.0,
        EmitterKind::Point { position }
        | EmitterKind::Spot { position, .. }
        | EmitterKind::Facet { position, .. } => {
            let distance_m = position.distance(middle).max(radius_m);
            if distance_m > 0.0 {
                distance_m.powi(-2)
            } else {
                1.0
            }
        }
    }
}
