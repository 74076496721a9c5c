// Reflectance of an interface; twins of optics/fresnel.rs.

// Smooth dielectric, unpolarised; eta = n_t / n_i. 1 beyond the critical angle.
fn dielectric_reflectance(cos_incident: f32, eta: f32) -> f32 {
    if eta == 1.0 {
        return 0.0;
    }
    let cos_i = clamp(cos_incident, 0.0, 1.0);
    let scaled_cos2 = scaled_cos2_transmitted(cos_i, eta);
    if scaled_cos2 <= 0.0 {
        return 1.0;
    }
    let cos_t = sqrt(scaled_cos2) / eta;
    let rs = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    let rp = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    return 0.5 * (rs * rs + rp * rp);
}

// Metal, by Schlick's approximation from its reflectance at normal incidence.
fn metal_reflectance(cos_incident: f32, f0: vec3f) -> vec3f {
    let grazing = pow(1.0 - clamp(cos_incident, 0.0, 1.0), 5.0);
    return f0 + (vec3f(1.0) - f0) * grazing;
}

// Thin pane: the sum of all reflections between its two faces.
fn thin_wall_reflectance(cos_incident: f32, eta: f32) -> f32 {
    let single = dielectric_reflectance(cos_incident, eta);
    return 2.0 * single / (1.0 + single);
}
