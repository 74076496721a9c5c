//! Light at an interface, and its colour.

pub mod colour;
pub mod conductor;
pub mod fresnel;
pub mod glass;
pub mod metal;
pub mod refraction;
pub mod spectrum;
pub mod wavelength;

pub use colour::ColourBasis;
pub use colour::ColourMatrix;
pub use colour::LinearSrgb;
pub use colour::luminance;
pub use glass::Glass;
pub use metal::Metal;
pub use wavelength::Nanometres;

use crate::error::Error;

/// Letters and digits of a name in lower case: `N-BK7`, `n bk7` and `nbk7` are equal.
fn key(name: &str) -> String {
    name.chars()
        .filter(|c| c.is_alphanumeric())
        .flat_map(char::to_lowercase)
        .collect()
}

/// The usage error for a name that nothing of a kind has, with the most similar known names.
fn unknown<'a>(kind: &str, name: &str, known: impl Iterator<Item = &'a str>, remedy: &str) -> Error {
    let nearest = nearest(name, known);
    let what = format!("no {kind} is named `{name}`; the nearest names are {nearest}");
    Error::usage(kind, what, remedy)
}

/// The three known names most similar to a text, nearest first, for a sentence: `A, B or C`.
fn nearest<'a>(text: &str, known: impl Iterator<Item = &'a str>) -> String {
    let wanted = key(text);
    let mut ranked: Vec<_> = known.map(|name| (distance(&wanted, &key(name)), name)).collect();
    ranked.sort_by_key(|(distance, _)| *distance);
    let names: Vec<_> = ranked.iter().take(3).map(|(_, name)| *name).collect();
    match names.split_last() {
        Some((last, [])) => (*last).into(),
        Some((last, others)) => format!("{} or {last}", others.join(", ")),
        None => String::new(),
    }
}

/// Twice the Levenshtein distance of two texts, less the length of their common prefix.
fn distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, from) in a.chars().enumerate() {
        let mut diagonal = std::mem::replace(&mut row[0], i + 1);
        for (j, to) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(from != *to);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(diagonal + 1).min(row[j] + 1);
        }
    }
    let alike = a.chars().zip(&b).take_while(|(from, to)| from == *to).count();
    (2 * row[b.len()]).saturating_sub(alike)
}
