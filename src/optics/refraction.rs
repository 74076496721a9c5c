//! Directions of reflected and refracted rays.

use glam::DVec3;

/// Mirror direction of `incident` about `normal` (both unit, any orientation).
#[inline]
pub fn reflect(incident: DVec3, normal: DVec3) -> DVec3 {
    (incident - normal * (2.0 * incident.dot(normal))).normalize()
}

/// Cosine of the refracted ray from that of the incident one, `cos_incident` [0, 1] and `eta` = n_t/n_i > 0; `None` for
/// total internal reflection.
///
/// cos²θt = (η² − 1 + cos²θi)/η², with the difference of squares as a product: 1 − sin²θi/η² would lose all its digits
/// at grazing incidence on a weak interface and near the critical angle.
#[inline]
pub fn cos_transmitted(cos_incident: f64, eta: f64) -> Option<f64> {
    let scaled = (eta - 1.0) * (eta + 1.0) + cos_incident * cos_incident;
    // The critical ray carries no energy away and counts as reflected; without an interface nothing is reflected.
    (scaled > 0.0 || eta == 1.0).then(|| scaled.sqrt() / eta)
}

/// Snell's law in vector form. `normal` is unit and on the side of the incident ray (incident · normal ≤ 0), `eta` =
/// n_t/n_i > 0. `None` for total internal reflection.
#[inline]
pub fn refract(incident: DVec3, normal: DVec3, eta: f64) -> Option<DVec3> {
    let cos_i = (-incident.dot(normal)).clamp(0.0, 1.0);
    let cos_t = cos_transmitted(cos_i, eta)?;
    let tangential = (incident + normal * cos_i) / eta;
    Some((tangential - normal * cos_t).normalize())
}
