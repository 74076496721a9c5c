//! Spectra as CSV with two columns: wavelength [nm], value.

use super::{Spectrum, SpectrumError};
use crate::optics::Nanometres;

/// Reads the spectrum of a lamp from the text of a CSV file.
///
/// Two columns, wavelength [nm] and value (relative, or W/nm); further columns are ignored. Separators are commas,
/// semicolons or tabs; `#` begins a comment; one line of headings is allowed. Wavelengths increase, values are 0 or
/// more.
///
/// # Errors
/// [`SpectrumError`] with the line at fault; [`SpectrumError::Dark`] and [`SpectrumError::Invisible`] where the lamp
/// has no visible light.
pub fn read_lamp(text: &str) -> Result<Spectrum, SpectrumError> {
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
                return Err(SpectrumError::NotARow {
                    line: index + 1,
                    text: content.into(),
                });
            }
        }
        may_be_headings = false;
    }
    let spectrum = Spectrum::new(knots).map_err(|error| with_line(error, &lines))?;
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

/// Replaces the row number of an error by its line in the file.
fn with_line(mut error: SpectrumError, lines: &[usize]) -> SpectrumError {
    if let SpectrumError::NotFinite { line, .. }
    | SpectrumError::Negative { line, .. }
    | SpectrumError::NotIncreasing { line, .. } = &mut error
    {
        *line = lines[*line - 1];
    }
    error
}

/// Rows of a built-in table of numbers, without its headings.
pub(in crate::optics) fn columns(text: &str) -> impl Iterator<Item = Vec<f64>> {
    text.lines().skip(1).map(|line| {
        line.split(',')
            .map(|field| field.parse().expect("our own tables hold numbers"))
            .collect()
    })
}
