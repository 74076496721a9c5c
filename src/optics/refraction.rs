//! Directions after an interface.

use glam::DVec3;

/// Mirror direction of `incident` about `normal` (both unit, any orientation).
pub fn reflect(incident: DVec3, normal: DVec3) -> DVec3 {
    (incident - normal * (2.0 * incident.dot(normal))).normalize()
}

/// Snell's law in vector form. `normal` is unit and on the side of the incoming ray (incident · normal ≤ 0), `eta` =
/// n_t/n_i > 0. `None` where the reflection is total.
pub fn refract(incident: DVec3, normal: DVec3, eta: f64) -> Option<DVec3> {
    let cos_i = -incident.dot(normal);
    let tangential = (incident + normal * cos_i) / eta;
    let sin2_t = tangential.length_squared();
    if sin2_t >= 1.0 {
        return None;
    }
    Some((tangential - normal * (1.0 - sin2_t).sqrt()).normalize())
}
