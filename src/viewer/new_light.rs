//! New lights: placed where there is room in front of the camera, and as bright as suits the picture.

use glam::DVec3;
use strum::{EnumMessage, IntoStaticStr};

use crate::geometry::Ray;
use crate::optics::LinearSrgb;
use crate::scene::{Light, LightKind, LightSize, PanelShape, Scene};
use crate::transport::Tracer;
use crate::units::{Irradiance, Radiance, RadiantIntensity};
use crate::viewer::walking::Collider;

/// Irradiance at the view target for exposure 0 [W/m²]; a grey surface is then well exposed.
const SUITABLE_W_M2: f64 = 4.0;
/// Largest distance from the view target, in scene radii.
const FARTHEST: f64 = 0.45;
/// Positions nearer than this are used only if there is no other, in scene radii.
const NEAR: f64 = 0.2;
/// Fraction of the free distance at which a light is placed [1].
const OF_ROOM: f64 = 0.7;
/// Offset of ray origins from the surface, in scene radii.
const OFF: f64 = 1e-6;
/// Inner and outer half-angle of a spot [rad].
const CONE_RAD: (f64, f64) = (0.35, 0.5);
/// Side of a panel, as a fraction of its distance [1].
const SIDE: f64 = 0.25;
/// Tangent of the angle by which new lights lean from the vertical towards the camera [1].
const LEANING: f64 = 0.4;

/// Kinds of lights that can be added. The panel shows the comment of each variant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, EnumMessage, IntoStaticStr)]
#[strum(serialize_all = "lowercase")]
pub enum NewLight {
    /// A point that shines the same in every direction.
    Lamp,
    /// A cone of light, at what is looked at.
    Spot,
    /// Parallel light from infinitely far.
    Sun,
    /// A flat square lamp, turned to what is looked at.
    Panel,
}

/// The surface point that the camera looks at.
#[derive(Clone, Copy, Debug)]
pub struct ViewTarget {
    /// [m].
    pub point: DVec3,
    /// Unit, on the side of the camera.
    pub normal: DVec3,
    /// Unit, from the point to the camera.
    pub to_eye: DVec3,
}

impl ViewTarget {
    /// The first surface along a view ray; `otherwise` if there is none.
    pub fn of(surfaces: &Tracer, view_ray: &Ray, otherwise: DVec3) -> Self {
        let to_eye = -view_ray.direction;
        let met = surfaces.meets(view_ray.origin, view_ray.direction, f64::INFINITY);
        let (point, normal) = met.map_or((otherwise, to_eye), |(distance_m, normal)| {
            (view_ray.at(distance_m), normal)
        });
        Self {
            point,
            normal,
            to_eye,
        }
    }
}

impl NewLight {
    /// In the order of the panel.
    pub const ALL: [Self; 4] = [Self::Lamp, Self::Spot, Self::Sun, Self::Panel];

    pub fn name(self) -> &'static str {
        self.into()
    }

    /// A white light with a unique name that lights the target, in a scene of radius `radius_m` that is shown with
    /// this exposure.
    pub fn make(
        self,
        (surfaces, radius_m): (&Tracer, f64),
        target: &ViewTarget,
        exposure_stops: f64,
        scene: &Scene,
    ) -> Light {
        // The target gets an irradiance that suits the exposure, whatever the distance.
        let irradiance_w_m2 = SUITABLE_W_M2 * (-exposure_stops).exp2();
        let position = free_position(surfaces, target, radius_m);
        let way = target.point - position;
        let distance_m = way.length();
        let direction = way / distance_m;
        let intensity = RadiantIntensity(irradiance_w_m2 * distance_m * distance_m);

        // Whatever its kind, the light gives the target this irradiance.
        let kind = match self {
            Self::Lamp => LightKind::Point { position, intensity },
            Self::Spot => LightKind::Spot {
                position,
                direction,
                intensity,
                inner_cone_rad: CONE_RAD.0,
                outer_cone_rad: CONE_RAD.1,
            },
            Self::Sun => LightKind::Sun {
                direction: -above(target, LEANING),
                normal_irradiance: Irradiance(irradiance_w_m2),
            },
            Self::Panel => {
                // Seen from the front, a panel of this width gives about E = L · SIDE².
                let half_m = 0.5 * SIDE * distance_m;
                let across = direction.any_orthonormal_vector();
                LightKind::Panel {
                    centre: position,
                    across: across * half_m,
                    down: direction.cross(across) * half_m,
                    shape: PanelShape::Rectangle,
                    radiance: Radiance(irradiance_w_m2 / (SIDE * SIDE)),
                }
            }
        };
        Light {
            name: own_name(self.name(), scene),
            colour: LinearSrgb::WHITE,
            spectrum: None,
            kind,
            size: LightSize::None,
        }
    }
}

/// Unit vector upwards, leaning towards the camera; `leaning` is the tangent of the angle.
fn above(target: &ViewTarget, leaning: f64) -> DVec3 {
    let level = DVec3::new(target.to_eye.x, 0.0, target.to_eye.z).normalize_or(DVec3::X);
    (DVec3::Y + level * leaning).normalize()
}

/// A free position for the light [m]: preferably above the target, else along its normal, else towards the camera.
fn free_position(surfaces: &Tracer, target: &ViewTarget, radius_m: f64) -> DVec3 {
    let from = target.point + target.normal * (OFF * radius_m);
    let room = |direction: DVec3| {
        let ray = Ray {
            origin: from,
            direction,
        };
        let free_m = surfaces
            .intersect(&ray)
            .map_or(f64::INFINITY, |place| place.distance_m);
        (OF_ROOM * free_m).min(FARTHEST * radius_m)
    };
    let ways = [above(target, LEANING), DVec3::Y, target.normal, target.to_eye];
    // Directions below the surface are not free.
    let open = ways.into_iter().filter(|way| way.dot(target.normal) > 0.0);
    let open: Vec<(DVec3, f64)> = open.map(|way| (way, room(way))).collect();
    let roomy = open.iter().find(|(_, room_m)| *room_m > NEAR * radius_m);
    let widest = open.iter().max_by(|a, b| a.1.total_cmp(&b.1));
    let (way, room_m) = roomy
        .or(widest)
        .copied()
        .unwrap_or((target.normal, NEAR * radius_m));
    from + way * room_m
}

/// The name, with a number if another light has the same.
fn own_name(name: &str, scene: &Scene) -> String {
    let is_free = |name: &String| scene.lights.iter().all(|light| light.name != *name);
    let numbered = (2..).map(|number| format!("{name} {number}"));
    std::iter::once(name.to_owned())
        .chain(numbered)
        .find(is_free)
        .unwrap_or_else(|| name.to_owned())
}
