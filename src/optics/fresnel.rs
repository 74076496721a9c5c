//! Reflectance of dielectric interfaces: Fresnel's equations.

use super::LinearSrgb;
use super::refraction::cos_transmitted;

/// Reflectance of a smooth dielectric interface for unpolarised light, (Rs + Rp)/2.
///
/// `cos_incident` [0, 1] is the cosine between the incident ray and the normal on its side, `eta` = n_t/n_i > 0.
/// Returns 1 beyond the critical angle, decided exactly as in [`refract`](super::refraction::refract), and 0 at every
/// angle where `eta` is 1. At normal incidence this is ((η − 1)/(η + 1))². No angle divides by zero, because the
/// p-polarised part uses the amplitude ratio instead of tangents. Source: Born and Wolf, Principles of Optics, 1.5.2.
#[inline]
pub fn dielectric_reflectance(cos_incident: f64, eta: f64) -> f64 {
    if eta == 1.0 {
        return 0.0;
    }
    let cos_i = cos_incident.clamp(0.0, 1.0);
    let Some(cos_t) = cos_transmitted(cos_i, eta) else {
        return 1.0;
    };
    let rs = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    let rp = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    0.5 * (rs * rs + rp * rp)
}

/// Reflectance of a metal by Schlick's approximation from its reflectance at normal incidence `f0` [0, 1] per channel
/// (glTF 2.0, appendix B.3.2); exactly 1 at every angle where `f0` is 1.
pub fn metal_reflectance(cos_incident: f64, f0: LinearSrgb) -> LinearSrgb {
    let grazing = (1.0 - cos_incident.clamp(0.0, 1.0)).powi(5);
    f0 + (LinearSrgb::WHITE - f0) * grazing
}

/// Reflectance of a thin wall: two parallel interfaces with all interreflections, without interference: 2R/(1 + R) with
/// R of one interface. Transmittance is one minus this.
pub fn thin_wall_reflectance(cos_incident: f64, eta: f64) -> f64 {
    let single = dielectric_reflectance(cos_incident, eta);
    2.0 * single / (1.0 + single)
}
