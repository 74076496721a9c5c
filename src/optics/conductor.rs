//! Reflectance of metals: Fresnel's equations with a complex index.

/// Reflectances [s-polarised, p-polarised] of a smooth interface with a medium of complex index (n + ik), relative to
/// the medium of the incident light.
///
/// `cos_incident` [0, 1] is the cosine between the incident ray and the normal, `n` > 0, `k` ≥ 0. With k = 0 these are
/// the reflectances of a dielectric, total reflection included, and 0 where n is 1 too; both are 1 at grazing
/// incidence. Source: Born and Wolf, Principles of Optics, 14.2; the cosine of the refracted wave is kept as a complex
/// number to avoid cancellation.
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
        // Both are 0 only at grazing incidence on a medium that light does not enter.
        if to > 0.0 { from / to } else { 1.0 }
    };
    [ratio(cos, 0.0), ratio(square_re * cos, square_im * cos)]
}

/// For unpolarised light, (Rs + Rp)/2.
pub fn conductor_reflectance(cos_incident: f64, n: f64, k: f64) -> f64 {
    let [s, p] = conductor_reflectance_sp(cos_incident, n, k);
    0.5 * (s + p)
}

/// Square root with non-negative parts of a complex number with a non-negative imaginary part.
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
