//! Standard illuminants and lamps by name.

use std::sync::LazyLock;

use super::csv::columns;
use super::temperature::planck;
use super::{Spectrum, refused};
use crate::error::{Error, Result};
use crate::optics::{self, Nanometres, key};

/// CIE illuminants with a table or formula of their own, apart from those in [`TABLES`].
const OWN: [&str; 3] = ["A", "D65", "E"];
/// Tables at every nanometre from 380 to 780 (CIE 15:2018; see assets/SOURCES.md).
const TABLES: &str = include_str!("../../../assets/spectra/illuminants.csv");
/// Range of `blackbody:` [K].
const KELVIN: [f64; 2] = [500.0, 25_000.0];
/// Range of `line:` [nm], whose whole width is visible.
const LINE_NM: [f64; 2] = [361.0, 829.0];

/// Every name without a number. `blackbody:KELVIN` and `line:NM` (or `laser:NM`) exist besides.
pub fn names() -> impl Iterator<Item = &'static str> {
    let headings = TABLES.lines().next().unwrap_or_default();
    OWN.into_iter().chain(headings.split(',').skip(1))
}

/// A lamp by name, scaled to one luminous-equivalent watt (∫ Φ ȳ dλ = 1, which is 683 lm).
///
/// One of [`names`], ignoring case and hyphens: CIE illuminants A, D50, D65, E (equal energy), fluorescent FL2, FL7,
/// FL11, and LED-B1 to B5, BH1, RGB1, V1, V2. Or `blackbody:KELVIN` (500 to 25,000 K), or `line:NM` and `laser:NM` (361
/// to 829 nm): a triangle ±1 nm wide. A, D65, E and black bodies range from 360 to 830 nm, the others from 380 to 780
/// nm, as published.
///
/// # Errors
/// An unknown name, with the most similar ones; a number out of range.
pub fn illuminant(name: &str) -> Result<Spectrum> {
    let name = name.trim();
    let relative = match name.split_once(':') {
        Some((kind, number)) => with_number(&key(kind), number).unwrap_or_else(|| Err(unknown(name)))?,
        None => plain(name)?,
    };
    relative.to_luminous_equivalent(1.0)
}

/// D65, scaled to one luminous-equivalent watt.
pub fn d65() -> &'static Spectrum {
    static D65: LazyLock<Spectrum> = LazyLock::new(|| {
        let rows = columns(include_str!("../../../assets/spectra/d65.csv"));
        Spectrum::new(rows.map(|row| (Nanometres(row[0]), row[1])).collect())
            .and_then(|table| table.named("D65").to_luminous_equivalent(1.0))
            .expect("our own table is a spectrum")
    });
    &D65
}

fn plain(name: &str) -> Result<Spectrum> {
    match key(name).as_str() {
        "a" => Ok(Spectrum::from_fn(illuminant_a)?.named("A")),
        "d65" => Ok(d65().clone()),
        "e" => Ok(Spectrum::from_fn(|_| 1.0)?.named("E")),
        wanted => {
            let mut columns_named = names().skip(OWN.len()).zip(1..);
            let found = columns_named.find(|(known, _)| key(known) == wanted);
            let (known, column) = found.ok_or_else(|| unknown(name))?;
            let rows = columns(TABLES).map(|row| (Nanometres(row[0]), row[column]));
            Ok(Spectrum::new(rows.collect())?.named(known))
        }
    }
}

/// Illuminant A by its formula, which keeps the constants of 1931 (CIE 15:2018), relative to 560 nm.
fn illuminant_a(Nanometres(nm): Nanometres) -> f64 {
    let exponent = |nm: f64| (1.435e7 / (2848.0 * nm)).exp_m1();
    (560.0 / nm).powi(5) * exponent(560.0) / exponent(nm)
}

/// A lamp of a kind that takes a number; `None` where there is no such kind.
fn with_number(kind: &str, number: &str) -> Option<Result<Spectrum>> {
    match kind {
        "blackbody" | "planck" => Some(parse(number, KELVIN, "K").and_then(black_body)),
        "line" | "laser" => Some(parse(number, LINE_NM, "nm").and_then(line)),
        _ => None,
    }
}

fn black_body(kelvin: f64) -> Result<Spectrum> {
    let light = Spectrum::from_fn(|wavelength| planck(wavelength, kelvin))?;
    Ok(light.named(&format!("blackbody:{kelvin}")))
}

fn line(nm: f64) -> Result<Spectrum> {
    let triangle = [(nm - 1.0, 0.0), (nm, 1.0), (nm + 1.0, 0.0)];
    let light = Spectrum::new(triangle.map(|(nm, value)| (Nanometres(nm), value)).into())?;
    Ok(light.named(&format!("line:{nm}")))
}

fn parse(text: &str, [least, most]: [f64; 2], unit: &str) -> Result<f64> {
    let number = text.trim().parse().ok();
    number
        .filter(|number| (least..=most).contains(number))
        .ok_or_else(|| {
            let what = format!("`{text}` is not a number from {least} to {most} {unit}");
            refused(what, "choose a number in that range")
        })
}

fn unknown(name: &str) -> Error {
    let remedy = "choose one of them, blackbody:KELVIN, line:NM or a CSV file";
    optics::unknown("spectrum", name, names(), remedy)
}
