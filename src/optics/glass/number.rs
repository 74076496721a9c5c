//! Glass numbers: six digits for the index and the Abbe number.

use super::{Dispersion, GlassError};

/// The dispersion of a glass number: 523588 means n_d = 1.523 and V_d = 58.8.
///
/// # Errors
/// [`GlassError::NotANumber`] for anything but six digits, and for an Abbe number of 000.
pub fn parse(text: &str) -> Result<Dispersion, GlassError> {
    let wrong = || GlassError::NotANumber { number: text.into() };
    if text.len() != 6 || !text.bytes().all(|byte| byte.is_ascii_digit()) {
        return Err(wrong());
    }
    let three = |digits: &str| digits.parse::<u16>().map(f64::from).map_err(|_| wrong());
    let (n_d, v_d) = ((1000.0 + three(&text[..3])?) / 1000.0, three(&text[3..])? / 10.0);
    Dispersion::Abbe { n_d, v_d }.checked().map_err(|_| wrong())
}
