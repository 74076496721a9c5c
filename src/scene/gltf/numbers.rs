//! Single-precision numbers of the JSON, converted to double precision.

/// The shortest decimal that rounds to this number: what the file says, as long as it says no more than seven digits.
/// So an index of 1.33 is read as 1.33 and not as 1.330000043.
pub fn widen(value: f32) -> f64 {
    // Not finite: the decimal is `inf` or `NaN`, which parse too.
    value.to_string().parse().unwrap_or(f64::from(value))
}

/// Three of them.
pub fn widen_all(values: [f32; 3]) -> [f64; 3] {
    values.map(widen)
}
