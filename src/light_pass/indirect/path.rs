//! A ray from a diffuse surface to the surfaces that light it.

use glam::DVec2;

use crate::geometry::Ray;
use crate::illumination::Side;
use crate::optics::LinearSrgb;
use crate::scene::SurfaceKind;
use crate::transport::{Branch, EffectSet, Interaction, MediumStack, SurfaceHit, Tracer};

/// Weight below which rays are truncated.
const MIN_WEIGHT: f64 = 1e-4;

/// Result of tracing a ray.
#[derive(Clone, Debug, Default)]
pub struct PathEnd {
    /// Segments traced.
    pub segments: u64,
    /// Share of the radiance that was truncated.
    pub truncated: f64,
    /// Object of which the back was the first surface, if it is opaque.
    pub first_back: Option<usize>,
}

/// Traces rays through a scene.
pub struct Follower<'a> {
    pub tracer: &'a Tracer,
    /// Maximum number of specular surfaces on a path.
    pub max_depth: u32,
}

impl Follower<'_> {
    /// Traces a ray. `choice` returns a point of the unit square for each random decision. `land` receives each diffuse
    /// surface on the path with the weight of its E: π·L at the ray's start over E at the surface.
    ///
    /// Where light could take two branches, one is sampled in proportion to its share.
    pub fn follow(
        &self,
        mut ray: Ray,
        mut media: MediumStack,
        choice: impl Fn(u32) -> DVec2,
        mut land: impl FnMut(&SurfaceHit, Side, LinearSrgb),
    ) -> PathEnd {
        let scene = self.tracer.scene();
        let ior_around = media.ior(scene);
        let mut found = PathEnd::default();
        let mut weight = LinearSrgb::WHITE;
        for depth in 0..=self.max_depth {
            found.segments += 1;
            let Some(hit) = self.tracer.closest_hit(&ray) else {
                return found;
            };

            // An opaque back as the first surface tells that the ray starts inside a body.
            let material = scene.material_of(hit.object);
            let side = Side::met(ray.direction, hit.geometric_normal);
            let is_back = side == Side::Back;
            if depth == 0 && is_back && material.is_opaque() {
                found.first_back = Some(hit.object);
            }

            // The segment absorbs by the Beer–Lambert law. A rough surface scatters at a microfacet of a random point
            // of its own.
            weight = weight * media.transmittance(scene, hit.distance_m);
            let micro = material.is_rough().then(|| choice(2 * depth + 1));
            let interaction =
                self.tracer
                    .interact_with(EffectSet::EVERYTHING, &hit, ray.direction, &media, micro);

            // A diffuse surface sends π·L = ρ·E, less what its coat keeps. The coat may also mirror the ray onwards.
            if material.surface.is_receiver() {
                if is_back && !material.has_back() {
                    // A back that is not drawn sends no light.
                    return found;
                }
                land(
                    &hit,
                    side,
                    weight * interaction.leaving * self.tracer.base_colour(&hit),
                );
            }

            // Radiance, unlike flux, scales with the squared ratio of indices.
            let Some((branch, share)) = chosen(&interaction, material.surface, choice(2 * depth).x) else {
                return found;
            };
            weight = weight * share * (branch.ior_ratio * branch.ior_ratio);
            (ray, media) = (branch.ray, branch.media);
            if weight.max_channel() < MIN_WEIGHT {
                break;
            }
        }
        // Radiance within a medium is n² times what arrives from it.
        found.truncated = weight.luminance() * (media.ior(scene) / ior_around).powi(2);
        found
    }
}

/// One branch, with its share over the probability of sampling it; `None` if the ray ends.
fn chosen(interaction: &Interaction, surface: SurfaceKind, at: f64) -> Option<(Branch, LinearSrgb)> {
    let [back, through] = [interaction.reflection, interaction.transmission];
    match (back, through) {
        (Some(back), Some(through)) => {
            let [a, b] = [back.share.max_channel(), through.share.max_channel()];
            let likely = a / (a + b);
            if at < likely {
                Some((back, back.share / likely))
            } else if likely < 1.0 {
                Some((through, through.share / (1.0 - likely)))
            } else {
                None
            }
        }
        (Some(back), None) if surface.is_receiver() => {
            let likely = back.share.max_channel();
            (at < likely).then(|| (back, back.share / likely))
        }
        (Some(only), None) | (None, Some(only)) => Some((only, only.share)),
        (None, None) => None,
    }
    .filter(|(_, share)| share.max_channel() > 0.0)
}
