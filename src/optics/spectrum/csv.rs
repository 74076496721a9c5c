//! Spectra as CSV with two columns: wavelength [nm], value.

use super::{Spectrum, refused};
use crate::error::Result;
use crate::optics::Nanometres;

/// Reads the spectrum of a lamp from the text of a CSV file.
///
/// Two columns, wavelength [nm] and value (relative, or W/nm); further columns are ignored. Separators are commas,
/// semicolons or tabs; `#` begins a comment; one line of headings is allowed. Wavelengths increase, values are 0 or
/// more.
///
/// # Errors
/// What is wrong, with the line at fault; a lamp without visible light.
pub fn read_lamp(text: &str) -> Result<Spectrum> {
    let mut knots = Vec::new();
    let mut lines = Vec::new();
    let mut may_be_headings = true;
    for (index, line) in text.trim_start_matches('\u{feff}').lines().enumerate() {
        let content = line.split('#').next().unwrap_or_default().trim();
        if content.is_empty() {
            continue;
        }
        match row(content) {
            Some(knot) => {
                knots.push(knot);
                lines.push(index + 1);
            }
            None if may_be_headings => {}
            None => {
                let what = format!("line {}: `{content}` is not a wavelength and a value", index + 1);
                let remedy = "write two columns, wavelength in nm and value, between commas";
                return Err(refused(what, remedy));
            }
        }
        may_be_headings = false;
    }
    let spectrum = Spectrum::of_lines(knots, |row| lines[row])?;
    spectrum.check_visible()?;
    Ok(spectrum)
}

/// Wavelength and value of a line; `None` if it has none.
fn row(content: &str) -> Option<(Nanometres, f64)> {
    let separator = [';', '\t', ','].into_iter().find(|c| content.contains(*c))?;
    let mut fields = content
        .split(separator)
        .map(|field| field.trim().parse::<f64>().ok());
    Some((Nanometres(fields.next()??), fields.next()??))
}

/// Rows of a built-in table of numbers, without its headings.
pub(in crate::optics) fn columns(text: &str) -> impl Iterator<Item = Vec<f64>> {
    text.lines().skip(1).map(|line| {
        line.split(',')
            .map(|field| field.parse().expect("our own tables hold numbers"))
            .collect()
    })
}
