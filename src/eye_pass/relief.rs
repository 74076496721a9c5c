//! Relief: how the normal map of a diffuse surface shades the irradiance of its illumination map.
//!
//! Maps hold the irradiance E of the smooth surface. What a bent normal changes depends on where the light comes from,
//! which maps do not tell, but the lights do: without shadows, sky and lamps would bring the irradiance U_s and U_d. As
//! much of E as the sky would bring is taken for sky light, the rest for lamp light as far as that goes. Both change as
//! U_s and U_d do. Where the lamps are shadowed E falls short of them, and so does the relief. Indirect light and
//! caustics beyond that stay as they are.

use glam::DVec3;

use crate::optics::LinearSrgb;
use crate::scene::emitter::Emitter;
use crate::scene::{Scene, SmoothIrradiance};

/// Limit of the gain of lamp light. Where light grazes the surface bumps shadow each other, which is not known.
const MAX_GAIN: f64 = 4.0;

/// The lights of a scene as they shade relief: lamps by their centres, the sky by its linear part.
#[derive(Clone, Debug)]
pub struct ReliefLights {
    /// One per lamp.
    pub emitters: Vec<Emitter>,
    /// Of the environment.
    pub sky: SmoothIrradiance,
}

impl ReliefLights {
    /// The lights of a scene; black without any.
    pub fn of(scene: &Scene) -> Self {
        let middles = scene
            .lights
            .iter()
            .filter_map(|light| Emitter::middle(light, scene));
        let sky = scene
            .sky()
            .map_or_else(SmoothIrradiance::default, |(sky, strength)| {
                let SmoothIrradiance { mean, by_normal } = *sky.smooth_irradiance();
                SmoothIrradiance {
                    mean: mean * strength,
                    by_normal: by_normal.map(|change| change * strength),
                }
            });
        Self {
            emitters: middles.collect(),
            sky,
        }
    }

    /// E [W/m²] of a surface at a position [m] whose normal map bends its unit normal, given E of the smooth surface.
    pub fn shaded(&self, flat: LinearSrgb, position: DVec3, [normal, bent]: [DVec3; 2]) -> LinearSrgb {
        let [sky, bent_sky] = [normal, bent].map(|normal| self.sky.at(normal));
        let [lamps, bent_lamps] = self.of_lamps(position, [normal, bent]);
        let [luminance, of_sky, of_lamps] = [flat, sky, lamps].map(LinearSrgb::luminance);
        let share = |part: f64, whole: f64| {
            if whole > 0.0 {
                (part / whole).clamp(0.0, 1.0)
            } else {
                0.0
            }
        };
        let gain = share(MAX_GAIN * of_lamps, bent_lamps.luminance());
        let shaded = flat
            + (bent_sky - sky) * share(luminance, of_sky)
            + (bent_lamps * gain - lamps) * share(luminance - of_sky, of_lamps);
        shaded.map(|channel| channel.max(0.0))
    }

    /// E [W/m²] from all lamps without shadows, for two normals.
    fn of_lamps(&self, position: DVec3, normals: [DVec3; 2]) -> [LinearSrgb; 2] {
        let mut sums = [LinearSrgb::BLACK; 2];
        for Emitter { kind, strength } in &self.emitters {
            if let Some((to_light, _, across_beam)) = kind.seen_from(position, 0.0) {
                for (sum, normal) in sums.iter_mut().zip(normals) {
                    *sum += *strength * (across_beam * to_light.dot(normal).max(0.0));
                }
            }
        }
        sums
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::emitter::EmitterKind;

    const SUN: LinearSrgb = LinearSrgb::new(3.0, 2.0, 1.0);

    fn under_the_sun() -> ReliefLights {
        ReliefLights {
            emitters: vec![Emitter {
                kind: EmitterKind::Parallel {
                    direction: -DVec3::new(0.6, 0.8, 0.0),
                },
                strength: SUN,
            }],
            sky: SmoothIrradiance {
                mean: LinearSrgb::grey(0.5),
                by_normal: [LinearSrgb::BLACK, LinearSrgb::grey(0.5), LinearSrgb::BLACK],
            },
        }
    }

    #[test]
    fn unshadowed_light_follows_the_bent_normal() {
        let lights = under_the_sun();
        let bent = DVec3::new(0.28, 0.96, 0.0);
        let lit = |normal: DVec3| SUN * DVec3::new(0.6, 0.8, 0.0).dot(normal) + lights.sky.at(normal);
        let found = lights.shaded(lit(DVec3::Y), DVec3::ZERO, [DVec3::Y, bent]);
        let expected = lit(bent);
        assert!(
            (found - expected).map(f64::abs).max_channel() < 1e-12,
            "{found:?} {expected:?}"
        );
        let same = lights.shaded(SUN, DVec3::ZERO, [bent, bent]);
        assert_eq!(same, SUN);
    }

    #[test]
    fn shadow_is_shaded_by_the_sky_alone() {
        let lights = under_the_sun();
        let [bright, dark] = [0.6, -0.6].map(|x| DVec3::new(x, 0.8, 0.0));
        let flat = lights.sky.at(DVec3::Y);
        let shaded = [bright, dark].map(|bent| lights.shaded(flat, DVec3::ZERO, [DVec3::Y, bent]));
        assert_eq!(shaded[0], shaded[1]);
        assert!((shaded[0].luminance() - 0.9).abs() < 1e-12);
        let deep = lights.shaded(flat * 0.1, DVec3::ZERO, [DVec3::Y, bright]);
        assert!((deep.luminance() - 0.09).abs() < 1e-12);
    }

    #[test]
    fn grazing_light_gains_little_and_light_from_nowhere_stays() {
        let lights = under_the_sun();
        let normal = DVec3::new(-0.79, 0.61, 0.08).normalize();
        let [lamps, _] = lights.of_lamps(DVec3::ZERO, [normal, normal]);
        let flat = lamps + lights.sky.at(normal);
        let towards = DVec3::new(0.6, 0.8, 0.0);
        let gained = lights.shaded(flat, DVec3::ZERO, [normal, towards]) - lights.sky.at(towards);
        assert!((gained.luminance() / lamps.luminance() - MAX_GAIN).abs() < 1e-9);
        let none = ReliefLights::of(&Scene::default());
        assert_eq!(none.shaded(SUN, DVec3::ZERO, [DVec3::Y, towards]), SUN);
    }
}
