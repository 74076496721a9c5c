//! The catalogue of glasses, by name.

use std::sync::LazyLock;

use super::{Dispersion, Glass};
use crate::error::Result;
use crate::optics::{Nanometres, key, unknown};

struct Entry {
    glass: Glass,
    aliases: Vec<&'static str>,
}

/// The catalogue, from its table (see assets/SOURCES.md).
static ENTRIES: LazyLock<Vec<Entry>> = LazyLock::new(|| {
    let table = include_str!("../../../assets/glass/catalogue.csv");
    let rows = table.lines().skip(1);
    rows.map(|row| entry(row).expect("our own table holds glasses"))
        .collect()
});

/// Every glass, in the order of the table.
pub fn all() -> impl Iterator<Item = &'static Glass> {
    ENTRIES.iter().map(|entry| &entry.glass)
}

/// Finds a glass by name, ignoring case and punctuation: `N-BK7`, `nbk7`. Some have aliases, such as `PMMA` for
/// Acrylic; `BK7` and `LASF9` find the lead-free N-BK7 and N-LASF9, whose index and Abbe number agree to every
/// published digit. Other old names are unknown, as those glasses differ from the new ones.
///
/// # Errors
/// An unknown name, with the nearest known ones.
pub fn find(name: &str) -> Result<Glass> {
    let wanted = key(name);
    let is_it = |entry: &&Entry| names(entry).any(|known| key(known) == wanted);
    let found = ENTRIES.iter().find(is_it).map(|entry| entry.glass.clone());
    let remedy = "choose one of them, a six-digit glass number or a formula";
    found.ok_or_else(|| unknown("glass", name, ENTRIES.iter().flat_map(names), remedy))
}

fn names(entry: &Entry) -> impl Iterator<Item = &str> {
    std::iter::once(entry.glass.name.as_str()).chain(entry.aliases.iter().copied())
}

/// `name;aliases;formula;constants;first µm;last µm;source`, with spaces between constants and commas between aliases.
fn entry(row: &'static str) -> Option<Entry> {
    let mut fields = row.split(';').map(str::trim);
    let name = fields.next()?.into();
    let aliases = fields
        .next()?
        .split(',')
        .filter(|alias| !alias.is_empty())
        .collect();
    let formula = fields.next()?;
    let constants: Vec<f64> = fields
        .next()?
        .split(' ')
        .map(|field| field.parse().ok())
        .collect::<Option<_>>()?;
    let [first, last] = [fields.next()?, fields.next()?].map(|um| um.parse::<f64>().ok());
    let nanometres = |um: f64| Nanometres(um * 1e3);
    let glass = Glass {
        name,
        dispersion: dispersion(formula, &constants)?.checked().ok()?,
        range: Some(nanometres(first?)..=nanometres(last?)),
        source: fields.next()?.into(),
    };
    Some(Entry { glass, aliases })
}

/// `sellmeier`: the constant, then pairs of strength and squared resonance [µm²]; `resonances`: the same with
/// resonances not yet squared [µm]; `cauchy`: a, b, c, d.
fn dispersion(formula: &str, constants: &[f64]) -> Option<Dispersion> {
    if let ("cauchy", &[a, b, c, d]) = (formula, constants) {
        return Some(Dispersion::Cauchy { a, b, c, d });
    }
    let squared = match formula {
        "sellmeier" => |c: f64| c,
        "resonances" => |c: f64| c * c,
        _ => return None,
    };
    let (constant, pairs) = constants.split_first()?;
    let (mut b, mut c_um2) = ([0.0; 4], [0.0; 4]);
    for (index, pair) in pairs.chunks(2).enumerate() {
        *b.get_mut(index)? = pair[0];
        c_um2[index] = squared(*pair.get(1)?);
    }
    Some(Dispersion::Sellmeier {
        constant: *constant,
        b,
        c_um2,
    })
}
