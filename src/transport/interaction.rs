//! What becomes of light that meets a surface. The shares of reflection, transmission, deposit and absorption add up
//! to one in every channel.

use glam::{DVec2, DVec3};

use super::effects::EffectSet;
use super::microfacets::{self, Facet, Turn};
use super::{MediumStack, SurfaceHit, Tracer};
use crate::geometry::Ray;
use crate::optics::{LinearSrgb, fresnel, refraction};
use crate::scene::{Material, SurfaceKind};

/// What happened to a ray at a specular surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Event {
    /// Sent back.
    Reflection,
    /// Sent back by total internal reflection.
    TotalInternalReflection,
    /// Bent through an interface.
    Refraction,
    /// Straight through a thin wall.
    ThinTransmission,
}

/// One way on from a surface.
#[derive(Clone, Copy, Debug)]
pub struct Branch {
    /// Leaves the surface.
    pub ray: Ray,
    /// Share of the flux, [0, 1] per channel.
    pub share: LinearSrgb,
    /// What sent it there.
    pub event: Event,
    /// Media after the event.
    pub media: MediumStack,
    /// n of the side it leaves over n of the side it enters; 1 for reflections. Radiance that comes back along the
    /// branch is scaled by its square, flux is not.
    pub ior_ratio: f64,
    /// Unit normal of the surface on the side of the incoming ray that gave the direction.
    pub normal: DVec3,
    /// How it did.
    pub by: TurnedBy,
}

/// What light turns about.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TurnedBy {
    /// The triangle's normal, where the shading normal would send light through the facet.
    Geometric,
    /// The shading normal.
    Shading,
    /// A micro-facet around the shading normal.
    Micro(Facet),
}

/// The shares of the light at one hit.
#[derive(Clone, Copy, Debug)]
pub struct Interaction {
    /// Mirror direction.
    pub reflection: Option<Branch>,
    /// Through the surface.
    pub transmission: Option<Branch>,
    /// Taken by the illumination map, before the albedo.
    pub deposit: LinearSrgb,
    /// Turned into heat here.
    pub absorbed: LinearSrgb,
    /// What a branch would have taken that is switched off.
    pub switched_off: LinearSrgb,
}

impl Interaction {
    /// No light is anywhere yet.
    const NOTHING: Self = Self {
        reflection: None,
        transmission: None,
        deposit: LinearSrgb::BLACK,
        absorbed: LinearSrgb::BLACK,
        switched_off: LinearSrgb::BLACK,
    };
}

/// Orientation of a hit: normals on the side of the incoming ray.
struct Facing {
    /// Whether the outside was met.
    front: bool,
    geometric: DVec3,
    /// Shading normal, or the geometric one where the shading normal faces away from the ray.
    shading: DVec3,
    /// Whether `shading` is the shading normal.
    is_smooth: bool,
    /// The micro-facet that is met, where the surface is rough.
    micro: Option<Facet>,
}

/// A direction with the normal that gave it.
struct Turned {
    direction: DVec3,
    normal: DVec3,
    by: TurnedBy,
}

impl Facing {
    fn new(hit: &SurfaceHit, incident: DVec3, micro: Option<Facet>) -> Self {
        let front = incident.dot(hit.geometric_normal) < 0.0;
        let side = if front { 1.0 } else { -1.0 };
        let geometric = hit.geometric_normal * side;
        let shading = hit.shading_normal
            * if hit.shading_normal.dot(geometric) < 0.0 {
                -1.0
            } else {
                1.0
            };
        let is_smooth = incident.dot(shading) < 0.0;
        Self {
            front,
            geometric,
            shading: if is_smooth { shading } else { geometric },
            is_smooth,
            micro,
        }
    }

    /// Cosine between the incoming ray and what it is reflected by.
    fn cos_incident(&self, incident: DVec3) -> f64 {
        match self.micro {
            Some(facet) => -incident.dot(facet.normal(incident, self.shading)),
            None => -incident.dot(self.shading),
        }
    }

    /// By a micro-facet; on the facet's right side in any case.
    fn turned_by(&self, facet: Facet, incident: DVec3, turn: Turn) -> Option<Turned> {
        let side = if turn == Turn::Reflected { 1.0 } else { -1.0 };
        let direction = facet.turned(incident, self.shading, turn)?;
        Some(Turned {
            direction: microfacets::out_of(direction, self.geometric, side),
            normal: self.shading,
            by: TurnedBy::Micro(facet),
        })
    }

    /// Mirror direction by the shading normal; by the geometric one where the former would end below the surface.
    fn reflected(&self, incident: DVec3) -> Turned {
        let by_micro = self
            .micro
            .and_then(|facet| self.turned_by(facet, incident, Turn::Reflected));
        if let Some(turned) = by_micro {
            return turned;
        }
        let direction = refraction::reflect(incident, self.shading);
        if direction.dot(self.geometric) > 0.0 {
            self.turned(direction)
        } else {
            Turned {
                direction: refraction::reflect(incident, self.geometric),
                normal: self.geometric,
                by: TurnedBy::Geometric,
            }
        }
    }

    /// Refracted direction by the shading normal; by the geometric one where the former would stay above the surface.
    fn refracted(&self, incident: DVec3, eta: f64) -> Option<Turned> {
        if let Some(facet) = self.micro {
            return self.turned_by(facet, incident, Turn::Refracted { eta });
        }
        let direction = refraction::refract(incident, self.shading, eta)?;
        if direction.dot(self.geometric) < 0.0 {
            Some(self.turned(direction))
        } else {
            Some(Turned {
                direction: refraction::refract(incident, self.geometric, eta)?,
                normal: self.geometric,
                by: TurnedBy::Geometric,
            })
        }
    }

    /// Straight on through a thin wall, but for its roughness.
    fn passed(&self, incident: DVec3) -> Turned {
        let by_micro = self
            .micro
            .and_then(|facet| self.turned_by(facet, incident, Turn::ThroughThinWall));
        by_micro.unwrap_or_else(|| self.turned(incident))
    }

    /// A direction that came by the shading normal.
    fn turned(&self, direction: DVec3) -> Turned {
        Turned {
            direction,
            normal: self.shading,
            by: if self.is_smooth {
                TurnedBy::Shading
            } else {
                TurnedBy::Geometric
            },
        }
    }
}

impl Tracer {
    /// What becomes of light that arrives at `hit` along the unit direction `incident`, within `media`, with every effect.
    pub fn interact(&self, hit: &SurfaceHit, incident: DVec3, media: &MediumStack) -> Interaction {
        self.interact_with(EffectSet::EVERYTHING, hit, incident, media, None)
    }

    /// The same with some effects. Light that would need a branch which is not among them is `switched_off`; where
    /// textures are not, the material's factor alone tints. `micro`: which micro-facet a rough surface shows, as a point
    /// of the unit square; rough surfaces are smooth without it, or without lobes among the effects.
    pub fn interact_with(
        &self,
        effects: EffectSet,
        hit: &SurfaceHit,
        incident: DVec3,
        media: &MediumStack,
        micro: Option<DVec2>,
    ) -> Interaction {
        let material = self.scene().material_of(hit.object);
        let micro = micro
            .filter(|_| effects.lobes && material.is_rough())
            .map(|point| Facet {
                alpha: material.roughness * material.roughness,
                point,
            });
        let facing = Facing::new(hit, incident, micro);
        let cos_incident = facing.cos_incident(incident);
        match material.surface {
            SurfaceKind::Diffuse => Interaction {
                deposit: LinearSrgb::WHITE,
                ..Interaction::NOTHING
            },
            SurfaceKind::Mirror => {
                let share = self.metal_share(effects, hit, material, cos_incident);
                let back = || reflection(hit, &facing, incident, media, share);
                Interaction {
                    absorbed: LinearSrgb::WHITE - share,
                    ..sent_back(effects, share, back)
                }
            }
            SurfaceKind::Mixed => {
                let eta = material.ior / media.ior(self.scene());
                let reflectance = fresnel::dielectric_reflectance(cos_incident, eta);
                let share = LinearSrgb::grey(material.polish * reflectance);
                let back = || reflection(hit, &facing, incident, media, share);
                Interaction {
                    deposit: LinearSrgb::WHITE - share,
                    ..sent_back(effects, share, back)
                }
            }
            SurfaceKind::ThinWall => self.thin_wall(effects, hit, &facing, incident, media, material),
            SurfaceKind::Dielectric => self.dielectric(effects, hit, &facing, incident, media, material),
        }
    }

    /// Base colour at a hit, its texture included where textures are.
    fn tint(&self, effects: EffectSet, hit: &SurfaceHit, material: &Material) -> LinearSrgb {
        if effects.textures {
            self.base_colour(hit)
        } else {
            material.base_colour
        }
    }

    /// What a metal sends back: by the table of its substance where that and the wavelength are known, else by
    /// Schlick's formula.
    fn metal_share(
        &self,
        effects: EffectSet,
        hit: &SurfaceHit,
        material: &Material,
        cos_incident: f64,
    ) -> LinearSrgb {
        let (Some(metal), Some(wavelength)) = (material.metal, self.wavelength()) else {
            return fresnel::metal_reflectance(cos_incident, self.tint(effects, hit, material));
        };
        let clean = LinearSrgb::grey(metal.reflectance(cos_incident, wavelength));
        if !effects.textures {
            return clean;
        }
        // Schlick's formula is linear in what the texture multiplies: the metal where it is white, else the rise alone.
        let kept = self.texture_colour(hit);
        let rise = fresnel::metal_reflectance(cos_incident, LinearSrgb::BLACK);
        clean * kept + rise * (LinearSrgb::WHITE - kept)
    }

    fn thin_wall(
        &self,
        effects: EffectSet,
        hit: &SurfaceHit,
        facing: &Facing,
        incident: DVec3,
        media: &MediumStack,
        material: &Material,
    ) -> Interaction {
        let cos_incident = facing.cos_incident(incident);
        let reflectance =
            fresnel::thin_wall_reflectance(cos_incident, material.ior / media.ior(self.scene()));
        let share = LinearSrgb::grey(reflectance);
        let returned = sent_back(effects, share, || reflection(hit, facing, incident, media, share));
        let_through(effects, returned, reflectance, || {
            let turned = facing.passed(incident);
            Branch {
                ray: hit.spawn(turned.direction),
                share: self.tint(effects, hit, material) * (1.0 - reflectance),
                event: Event::ThinTransmission,
                media: *media,
                ior_ratio: 1.0,
                normal: turned.normal,
                by: turned.by,
            }
        })
    }

    fn dielectric(
        &self,
        effects: EffectSet,
        hit: &SurfaceHit,
        facing: &Facing,
        incident: DVec3,
        media: &MediumStack,
        material: &Material,
    ) -> Interaction {
        let beyond = if facing.front {
            media.entered(hit.object)
        } else {
            media.left(hit.object)
        };
        let (ior_near, ior_far) = if facing.front {
            (media.ior(self.scene()), material.ior)
        } else if beyond == *media {
            // Never entered: an open sheet, or a start within.
            (material.ior, media.ior(self.scene()))
        } else {
            // Where bodies overlap, the one that was entered last is the medium until it is left.
            (media.ior(self.scene()), beyond.ior(self.scene()))
        };
        let eta = ior_far / ior_near;
        let Some(turned) = facing.refracted(incident, eta) else {
            return sent_back(effects, LinearSrgb::WHITE, || {
                let mut total = reflection(hit, facing, incident, media, LinearSrgb::WHITE);
                total.event = Event::TotalInternalReflection;
                total
            });
        };
        let reflectance = fresnel::dielectric_reflectance(facing.cos_incident(incident), eta);
        let share = LinearSrgb::grey(reflectance);
        let returned = if reflectance > 0.0 {
            sent_back(effects, share, || reflection(hit, facing, incident, media, share))
        } else {
            Interaction::NOTHING
        };
        let_through(effects, returned, reflectance, || Branch {
            ray: hit.spawn(turned.direction),
            share: self.tint(effects, hit, material) * (1.0 - reflectance),
            event: Event::Refraction,
            media: beyond,
            ior_ratio: ior_near / ior_far,
            normal: turned.normal,
            by: turned.by,
        })
    }
}

/// What does not go back goes through, but for what the surface's tint takes.
fn let_through(
    effects: EffectSet,
    returned: Interaction,
    reflectance: f64,
    branch: impl FnOnce() -> Branch,
) -> Interaction {
    let beneath = LinearSrgb::grey(1.0 - reflectance);
    if !effects.transmission {
        return Interaction {
            switched_off: returned.switched_off + beneath,
            ..returned
        };
    }
    let transmission = branch();
    Interaction {
        absorbed: beneath - transmission.share,
        transmission: Some(transmission),
        ..returned
    }
}

/// A share of the light goes back.
fn sent_back(effects: EffectSet, share: LinearSrgb, branch: impl FnOnce() -> Branch) -> Interaction {
    if effects.reflection {
        Interaction {
            reflection: Some(branch()),
            ..Interaction::NOTHING
        }
    } else {
        Interaction {
            switched_off: share,
            ..Interaction::NOTHING
        }
    }
}

fn reflection(
    hit: &SurfaceHit,
    facing: &Facing,
    incident: DVec3,
    media: &MediumStack,
    share: LinearSrgb,
) -> Branch {
    let turned = facing.reflected(incident);
    Branch {
        ray: hit.spawn(turned.direction),
        share,
        event: Event::Reflection,
        media: *media,
        ior_ratio: 1.0,
        normal: turned.normal,
        by: turned.by,
    }
}
