//! Reflectance of metals: Fresnel's equations with a complex index.

/// Reflectances [s-polarised, p-polarised] of a smooth interface with a medium of complex index (n + ik) relative to
/// the one that the light comes in.
///
/// `cos_incident` [0, 1] is the cosine between the incoming ray and the normal, `n` > 0, `k` ≥ 0. With k = 0 these are
/// a dielectric's, total reflection included, and 0 where n is 1 too; at grazing incidence both are 1.
/// Source: Born and Wolf, Principles of Optics, 14.2; here the cosine of the refracted wave is kept as a complex
/// number, so that nothing cancels.
pub fn conductor_reflectance_sp(cos_incident: f64, n: f64, k: f64) -> [f64; 2] {
    if n == 1.0 && k == 0.0 {
        return [0.0; 2];
    }
    let cos = cos_incident.clamp(0.0, 1.0);
    let (square_re, square_im) = (n * n - k * k, 2.0 * n * k);
    let (a, b) = complex_root(square_re - (1.0 - cos * cos), square_im);
    let ratio = |re: f64, im: f64| {
        let from = (re - a).powi(2) + (im - b).powi(2);
        let to = (re + a).powi(2) + (im + b).powi(2);
        // Both vanish at once where the light neither comes in nor goes on: it grazes.
        if to > 0.0 { from / to } else { 1.0 }
    };
    [ratio(cos, 0.0), ratio(square_re * cos, square_im * cos)]
}

/// The same for unpolarised light, (Rs + Rp)/2.
pub fn conductor_reflectance(cos_incident: f64, n: f64, k: f64) -> f64 {
    let [s, p] = conductor_reflectance_sp(cos_incident, n, k);
    0.5 * (s + p)
}

/// The square root, with both its parts 0 or more, of a complex number whose imaginary part is 0 or more.
fn complex_root(re: f64, im: f64) -> (f64, f64) {
    let size = re.hypot(im);
    if size == 0.0 {
        return (0.0, 0.0);
    }
    let larger = (0.5 * (size + re.abs())).sqrt();
    let smaller = 0.5 * im / larger;
    if re >= 0.0 {
        (larger, smaller)
    } else {
        (smaller, larger)
    }
}
