//! Scattering of light at a surface. The shares of reflection, transmission, deposit and absorption add up to one in
//! every channel.

use glam::{DVec2, DVec3};

use super::microfacets::{self, Facet, MicrofacetEvent};
use super::{EffectSet, MediumStack, SurfaceHit, Tracer};
use crate::geometry::Ray;
use crate::optics::{LinearSrgb, fresnel, refraction};
use crate::scene::material::SMOOTH_ROUGHNESS;
use crate::scene::{Material, Mixture, SurfaceKind};

/// Scattering event at a specular surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Event {
    Reflection,
    TotalInternalReflection,
    Refraction,
    /// Straight through a thin wall.
    ThinTransmission,
    /// Straight through the uncovered part of a surface. Such light is still direct light.
    Passage,
}

impl Event {
    /// Whether light stays on its side of the surface.
    pub fn is_reflection(self) -> bool {
        matches!(self, Self::Reflection | Self::TotalInternalReflection)
    }
}

/// One outgoing ray of an interaction.
#[derive(Clone, Copy, Debug)]
pub struct Branch {
    pub ray: Ray,
    /// Fraction of the flux, [0, 1] per channel.
    pub share: LinearSrgb,
    pub event: Event,
    /// Media after the event.
    pub media: MediumStack,
    /// Refractive index on the side that the ray leaves over that on the side it enters; 1 for reflections. Radiance
    /// that travels back along the branch scales with its square, flux does not.
    pub ior_ratio: f64,
    /// Unit normal about which the light scattered, on the side of the incident ray.
    pub normal: DVec3,
    /// Kind of that normal.
    pub by: NormalSource,
}

/// Normal about which light scatters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NormalSource {
    /// The triangle's normal, where the shading normal would send the ray to the wrong side of the triangle.
    Geometric,
    Shading,
    /// A microfacet's normal around the shading normal.
    Micro(Facet),
}

/// Response of a surface's diffuse component to incident light, for its illumination map.
#[derive(Clone, Copy, Debug)]
pub struct DiffuseResponse {
    /// Diffuse fraction of the surface, [0, 1].
    pub share: f64,
    /// Fraction of it under a coat, [0, 1].
    pub coat: f64,
    /// Refractive index of the coat.
    pub ior: f64,
}

impl DiffuseResponse {
    /// Fraction of light taken at an angle of incidence from a medium of index `ior_around`.
    pub fn of(&self, cosine: f64, ior_around: f64) -> f64 {
        if self.coat == 0.0 {
            return self.share;
        }
        self.share * (1.0 - self.coat * fresnel::dielectric_reflectance(cosine, self.ior / ior_around))
    }
}

/// How light splits at a hit, with the outgoing rays.
#[derive(Clone, Copy, Debug)]
pub struct Interaction {
    pub reflection: Option<Branch>,
    pub transmission: Option<Branch>,
    /// Fraction taken by the illumination map, before the albedo.
    pub deposit: LinearSrgb,
    /// Factor on the map's light for radiance that leaves against the incident ray.
    pub leaving: LinearSrgb,
    pub absorbed: LinearSrgb,
    /// Fraction of the branches that are switched off.
    pub switched_off: LinearSrgb,
}

/// A hit with its normals turned to the side of the incident ray.
struct HitFrame {
    /// Whether the outside was hit.
    front: bool,
    geometric: DVec3,
    /// Shading normal; the geometric one where the shading normal faces away from the ray.
    shading: DVec3,
    /// Whether `shading` is the shading normal.
    is_smooth: bool,
    /// Sampled microfacet of a rough surface.
    micro: Option<Facet>,
}

/// A direction with the normal about which the light scattered.
struct ScatteredDirection {
    direction: DVec3,
    normal: DVec3,
    by: NormalSource,
}

impl SurfaceHit {
    /// The triangle's normal and the one for scattering, on the side of a ray along the unit vector `incident`: where
    /// the shading normal faces away from the ray, both are the triangle's.
    pub fn normals_towards(&self, incident: DVec3) -> [DVec3; 2] {
        let frame = HitFrame::new(self, incident);
        [frame.geometric, frame.shading]
    }
}

impl HitFrame {
    fn new(hit: &SurfaceHit, incident: DVec3) -> Self {
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
            micro: None,
        }
    }

    /// Cosine of incidence at the microfacet, or at the shading normal of a smooth surface.
    fn cos_incident(&self, incident: DVec3) -> f64 {
        match self.micro {
            Some(facet) => -incident.dot(facet.normal(incident, self.shading)),
            None => -incident.dot(self.shading),
        }
    }

    /// Scatters at a microfacet, always to the correct side of the triangle. `None` for total internal reflection.
    fn at_facet(&self, facet: Facet, incident: DVec3, event: MicrofacetEvent) -> Option<ScatteredDirection> {
        let side = if event == MicrofacetEvent::Reflected {
            1.0
        } else {
            -1.0
        };
        let direction = facet.scattered(incident, self.shading, event)?;
        Some(ScatteredDirection {
            direction: microfacets::out_of(direction, self.geometric, side),
            normal: self.shading,
            by: NormalSource::Micro(facet),
        })
    }

    /// Mirror direction about the shading normal; about the geometric one where the former points below the surface.
    #[inline(always)]
    fn reflected(&self, incident: DVec3) -> ScatteredDirection {
        let by_micro = self
            .micro
            .and_then(|facet| self.at_facet(facet, incident, MicrofacetEvent::Reflected));
        if let Some(scattered) = by_micro {
            return scattered;
        }
        let direction = refraction::reflect(incident, self.shading);
        if direction.dot(self.geometric) > 0.0 {
            self.about_shading(direction)
        } else {
            ScatteredDirection {
                direction: refraction::reflect(incident, self.geometric),
                normal: self.geometric,
                by: NormalSource::Geometric,
            }
        }
    }

    /// Refracted direction about the shading normal; about the geometric one where the former stays above the surface.
    /// `None` for total internal reflection.
    #[inline(always)]
    fn refracted(&self, incident: DVec3, eta: f64) -> Option<ScatteredDirection> {
        if let Some(facet) = self.micro {
            return self.at_facet(facet, incident, MicrofacetEvent::Refracted { eta });
        }
        let direction = refraction::refract(incident, self.shading, eta)?;
        if direction.dot(self.geometric) < 0.0 {
            Some(self.about_shading(direction))
        } else {
            Some(ScatteredDirection {
                direction: refraction::refract(incident, self.geometric, eta)?,
                normal: self.geometric,
                by: NormalSource::Geometric,
            })
        }
    }

    /// Straight on through a thin wall, deflected only by its roughness.
    fn passed(&self, incident: DVec3) -> ScatteredDirection {
        let by_micro = self
            .micro
            .and_then(|facet| self.at_facet(facet, incident, MicrofacetEvent::ThroughThinWall));
        by_micro.unwrap_or_else(|| self.about_shading(incident))
    }

    /// A direction that scattered about `shading`.
    fn about_shading(&self, direction: DVec3) -> ScatteredDirection {
        ScatteredDirection {
            direction,
            normal: self.shading,
            by: if self.is_smooth {
                NormalSource::Shading
            } else {
                NormalSource::Geometric
            },
        }
    }
}

/// How light splits at a hit. The outgoing rays are computed on demand.
pub struct Meeting<'a> {
    hit: &'a SurfaceHit,
    incident: DVec3,
    media: &'a MediumStack,
    frame: HitFrame,
    /// Reflected fraction; `None` without reflection.
    pub reflected: Option<LinearSrgb>,
    /// Transmitted fraction; `None` without transmission.
    pub transmitted: Option<LinearSrgb>,
    /// Fraction taken by the illumination map, before the albedo.
    pub deposit: LinearSrgb,
    /// Factor on the map's light for radiance that leaves against the incident ray, where it differs from `deposit`:
    /// the map already includes the diffuse fraction of the surface.
    leaving: Option<LinearSrgb>,
    pub absorbed: LinearSrgb,
    /// Fraction of the branches that are switched off.
    pub switched_off: LinearSrgb,
    through: BehindSurface,
}

enum BehindSurface {
    /// An opaque body: what is not reflected stays.
    Nothing,
    /// A medium beyond the critical angle.
    Unreachable,
    ThinWall,
    /// The far side of the uncovered part of a surface.
    Hole,
    Medium {
        scattered: ScatteredDirection,
        media: MediumStack,
        ior_ratio: f64,
    },
}

impl<'a> Meeting<'a> {
    /// Light that arrives at `hit` along the unit direction `incident` within `media`, before it is split.
    #[inline(always)]
    pub fn new(hit: &'a SurfaceHit, incident: DVec3, media: &'a MediumStack) -> Self {
        Self {
            hit,
            incident,
            media,
            frame: HitFrame::new(hit, incident),
            reflected: None,
            transmitted: None,
            deposit: LinearSrgb::BLACK,
            leaving: None,
            absorbed: LinearSrgb::BLACK,
            switched_off: LinearSrgb::BLACK,
            through: BehindSurface::Nothing,
        }
    }

    #[inline(always)]
    pub fn reflection(&self) -> Option<Branch> {
        let share = self.reflected?;
        let event = match self.through {
            BehindSurface::Unreachable => Event::TotalInternalReflection,
            _ => Event::Reflection,
        };
        Some(self.branch(
            &self.frame.reflected(self.incident),
            share,
            event,
            (self.media, 1.0),
        ))
    }

    #[inline(always)]
    fn branch(
        &self,
        to: &ScatteredDirection,
        share: LinearSrgb,
        event: Event,
        (media, ior_ratio): (&MediumStack, f64),
    ) -> Branch {
        Branch {
            ray: self.hit.spawn(to.direction),
            share,
            event,
            media: *media,
            ior_ratio,
            normal: to.normal,
            by: to.by,
        }
    }

    #[inline(always)]
    pub fn transmission(&self) -> Option<Branch> {
        let share = self.transmitted?;
        let straight = (self.media, 1.0);
        Some(match &self.through {
            BehindSurface::Nothing | BehindSurface::Unreachable => return None,
            BehindSurface::Hole => {
                let passed = self.frame.about_shading(self.incident);
                self.branch(&passed, share, Event::Passage, straight)
            }
            BehindSurface::ThinWall => {
                let passed = self.frame.passed(self.incident);
                self.branch(&passed, share, Event::ThinTransmission, straight)
            }
            BehindSurface::Medium {
                scattered,
                media,
                ior_ratio,
            } => self.branch(scattered, share, Event::Refraction, (media, *ior_ratio)),
        })
    }

    /// Adds a reflected fraction, or books it as switched off if reflection is off.
    #[inline]
    fn add_reflection(&mut self, effects: EffectSet, share: LinearSrgb) {
        if effects.reflection {
            self.reflected = Some(self.reflected.map_or(share, |before| before + share));
        } else {
            self.switched_off += share;
        }
    }

    /// Scales all fractions set so far, except the deposit.
    fn scale(&mut self, part: f64) {
        self.reflected = self.reflected.map(|share| share * part);
        self.transmitted = self.transmitted.map(|share| share * part);
        self.absorbed = self.absorbed * part;
        self.switched_off = self.switched_off * part;
    }

    /// Transmits what is not reflected; the tint's loss is absorbed.
    #[inline]
    fn add_transmission(&mut self, effects: EffectSet, reflectance: f64, tint: impl FnOnce() -> LinearSrgb) {
        let beneath = LinearSrgb::grey(1.0 - reflectance);
        if effects.transmission {
            let share = tint() * (1.0 - reflectance);
            self.absorbed = beneath - share;
            self.transmitted = Some(share);
        } else {
            self.switched_off += beneath;
        }
    }
}

impl Tracer {
    /// Splits light that arrives at `hit` along the unit direction `incident` within `media`, with every effect on.
    pub fn interact(&self, hit: &SurfaceHit, incident: DVec3, media: &MediumStack) -> Interaction {
        self.interact_with(EffectSet::EVERYTHING, hit, incident, media, None)
    }

    /// Splits light with some effects only; parameters as of [`Self::meet`].
    pub fn interact_with(
        &self,
        effects: EffectSet,
        hit: &SurfaceHit,
        incident: DVec3,
        media: &MediumStack,
        micro: Option<DVec2>,
    ) -> Interaction {
        let mut meeting = Meeting::new(hit, incident, media);
        self.meet(effects, micro, &mut meeting);
        Interaction {
            reflection: meeting.reflection(),
            transmission: meeting.transmission(),
            deposit: meeting.deposit,
            leaving: meeting.leaving.unwrap_or(meeting.deposit),
            absorbed: meeting.absorbed,
            switched_off: meeting.switched_off,
        }
    }

    /// GGX α of the lobes at a hit; 0 where the surface is smooth.
    pub fn lobe_alpha(&self, hit: &SurfaceHit) -> f64 {
        let material = self.scene().material_of(hit.object);
        let roughness = match material.variation {
            Some(_) => {
                self.mixture(hit.object, (hit.triangle, hit.barycentric), true)
                    .roughness
            }
            None => material.roughness,
        };
        let is_rough = material.surface.is_specular() && roughness > SMOOTH_ROUGHNESS;
        if is_rough { roughness * roughness } else { 0.0 }
    }

    /// Splits light. Fractions of branches outside `effects` are `switched_off`; without textures, the material's
    /// factor alone tints. `micro` selects the microfacet of a rough surface by a point of the unit square; without it,
    /// or without lobes among the effects, rough surfaces are smooth.
    #[inline(always)]
    pub fn meet(&self, effects: EffectSet, micro: Option<DVec2>, meeting: &mut Meeting) {
        let &mut Meeting {
            hit, incident, media, ..
        } = meeting;

        // The mixture of surface classes is looked up only where classes or roughness vary over the surface.
        let material = self.scene().material_of(hit.object);
        let place = (hit.triangle, hit.barycentric);
        let is_varied = material.surface == SurfaceKind::Varied;
        let varies = is_varied || (material.variation.is_some() && material.surface.is_specular());
        let mixture = varies.then(|| self.mixture(hit.object, place, effects.textures));

        // Light scatters at one microfacet of the rough surface; squared roughness is the α of its GGX distribution.
        let roughness = mixture.map_or(material.roughness, |mixture| mixture.roughness);
        let is_rough = material.surface.is_specular() && roughness > SMOOTH_ROUGHNESS;
        meeting.frame.micro = micro.filter(|_| effects.lobes && is_rough).map(|point| Facet {
            alpha: roughness * roughness,
            point,
        });

        // Fresnel's equations split the flux. What is neither reflected nor transmitted is deposited or absorbed.
        match material.surface {
            SurfaceKind::Diffuse => meeting.deposit = LinearSrgb::WHITE,
            SurfaceKind::Mirror => {
                let cos_incident = meeting.frame.cos_incident(incident);
                let share = self.metal_share(effects, hit, material, cos_incident);
                meeting.absorbed = LinearSrgb::WHITE - share;
                meeting.add_reflection(effects, share);
            }
            SurfaceKind::Coated => {
                let eta = material.ior / media.ior(self.scene());
                let cos_incident = meeting.frame.cos_incident(incident);
                let reflectance = fresnel::dielectric_reflectance(cos_incident, eta);
                let share = LinearSrgb::grey(material.coat * reflectance);
                meeting.deposit = LinearSrgb::WHITE - share;
                meeting.add_reflection(effects, share);
            }
            SurfaceKind::ThinWall => self.meet_thin_wall(effects, material, meeting),
            SurfaceKind::Dielectric => self.meet_dielectric(effects, material, meeting),
            SurfaceKind::Varied => {
                if let Some(mixture) = mixture {
                    self.meet_mixture(effects, material, mixture, meeting);
                }
            }
        }
    }

    fn meet_thin_wall(&self, effects: EffectSet, material: &Material, meeting: &mut Meeting) {
        let &mut Meeting {
            hit, incident, media, ..
        } = meeting;
        let eta = material.ior / media.ior(self.scene());
        let cos_incident = meeting.frame.cos_incident(incident);
        let reflectance = fresnel::thin_wall_reflectance(cos_incident, eta);
        meeting.through = BehindSurface::ThinWall;
        meeting.add_reflection(effects, LinearSrgb::grey(reflectance));
        meeting.add_transmission(effects, reflectance, || self.tint(effects, hit, material));
    }

    /// Splits each fraction of a mixture as its surface class does. No mixture is both clear and partly uncovered.
    fn meet_mixture(&self, effects: EffectSet, material: &Material, mixture: Mixture, meeting: &mut Meeting) {
        let &mut Meeting {
            hit, incident, media, ..
        } = meeting;
        if mixture.clear > 0.0 {
            if material.is_solid() {
                self.meet_dielectric(effects, material, meeting);
            } else {
                self.meet_thin_wall(effects, material, meeting);
            }
            meeting.scale(mixture.clear);
        } else if mixture.hole > 0.0 {
            meeting.through = BehindSurface::Hole;
            meeting.add_transmission(effects, 0.0, || LinearSrgb::WHITE);
            meeting.scale(mixture.hole);
        }
        let cos_incident = meeting.frame.cos_incident(incident);
        if mixture.metal > 0.0 {
            let share = self.metal_share(effects, hit, material, cos_incident);
            meeting.absorbed += (LinearSrgb::WHITE - share) * mixture.metal;
            meeting.add_reflection(effects, share * mixture.metal);
        }
        let eta = material.ior / media.ior(self.scene());
        let coat = mixture.coat * fresnel::dielectric_reflectance(cos_incident, eta);
        meeting.leaving = Some(LinearSrgb::grey(1.0 - coat));
        meeting.deposit = LinearSrgb::grey(mixture.body * (1.0 - coat));
        if mixture.body * coat > 0.0 {
            meeting.add_reflection(effects, LinearSrgb::grey(mixture.body * coat));
        }
    }

    // Inlined, as is all that photons do at clear glass: they meet it more often than all else.
    #[inline(always)]
    fn meet_dielectric(&self, effects: EffectSet, material: &Material, meeting: &mut Meeting) {
        let &mut Meeting {
            hit, incident, media, ..
        } = meeting;

        // Both indices follow from the bodies that the path is inside of, not from the material alone.
        let is_front = meeting.frame.front;
        let body = self.scene().body_of(hit.object);
        let beyond = if is_front {
            media.entered(body)
        } else {
            media.left(body)
        };
        let (ior_near, ior_far) = if is_front {
            (media.ior(self.scene()), material.ior)
        } else if beyond.objects().len() == media.objects().len() {
            // Never entered: an open sheet, or a path that starts inside.
            (material.ior, media.ior(self.scene()))
        } else {
            // Where bodies overlap, the one entered last is the medium until it is left.
            (media.ior(self.scene()), beyond.ior(self.scene()))
        };

        // Beyond the critical angle all light is reflected.
        let eta = ior_far / ior_near;
        let Some(scattered) = meeting.frame.refracted(incident, eta) else {
            meeting.through = BehindSurface::Unreachable;
            return meeting.add_reflection(effects, LinearSrgb::WHITE);
        };
        meeting.through = BehindSurface::Medium {
            scattered,
            media: beyond,
            ior_ratio: ior_near / ior_far,
        };

        // Fresnel reflectance splits the flux, and the tint absorbs part of what passes.
        let reflectance = fresnel::dielectric_reflectance(meeting.frame.cos_incident(incident), eta);
        if reflectance > 0.0 {
            meeting.add_reflection(effects, LinearSrgb::grey(reflectance));
        }
        meeting.add_transmission(effects, reflectance, || self.tint(effects, hit, material));
    }

    /// Base colour at a hit, with its texture where textures are on.
    fn tint(&self, effects: EffectSet, hit: &SurfaceHit, material: &Material) -> LinearSrgb {
        if effects.textures {
            self.base_colour(hit)
        } else {
            material.base_colour
        }
    }

    /// Reflectance of a metal: tabulated where its substance and the wavelength are known, otherwise by Schlick's
    /// approximation.
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
        // Schlick's formula is linear in F0, which the texture scales: blend the metal itself with the rise of a black
        // F0.
        let kept = self.texture_colour(hit);
        let rise = fresnel::metal_reflectance(cos_incident, LinearSrgb::BLACK);
        clean * kept + rise * (LinearSrgb::WHITE - kept)
    }
}
