// Directions after an interface; twins of optics/refraction.rs.

fn mirrored(incident: vec3f, normal: vec3f) -> vec3f {
    return normalize(incident - normal * (2.0 * dot(incident, normal)));
}

// Square of eta times the cosine of the refracted ray; zero or negative for total internal reflection.
fn scaled_cos2_transmitted(cos_incident: f32, eta: f32) -> f32 {
    // The product, unlike a difference of squares, keeps its digits at grazing incidence and near the critical angle.
    return (eta - 1.0) * (eta + 1.0) + cos_incident * cos_incident;
}

// Snell's law; `normal` is unit and on the side of the incoming ray, eta = n_t / n_i. Invalid for total internal
// reflection.
fn refracted(incident: vec3f, normal: vec3f, eta: f32) -> vec3f {
    let cos_i = clamp(-dot(incident, normal), 0.0, 1.0);
    let cos_t = sqrt(max(scaled_cos2_transmitted(cos_i, eta), 0.0)) / eta;
    return normalize((incident + normal * cos_i) / eta - normal * cos_t);
}
