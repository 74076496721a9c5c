//! Single-precision numbers of the JSON, converted to double precision.

/// The shortest decimal that rounds to this number: the digits of the file, unless these are more than seven. An index
/// of 1.33 is read as 1.33, not as 1.330000043.
pub fn widen(value: f32) -> f64 {
    // Infinity and NaN print as `inf` and `NaN`, which parse too.
    value.to_string().parse().unwrap_or(f64::from(value))
}

pub fn widen_all(values: [f32; 3]) -> [f64; 3] {
    values.map(widen)
}
