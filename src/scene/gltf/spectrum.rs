//! Spectra of lights: `spectrum` in the `extras` of a node, of its light, or of an emissive material; by name or as a
//! CSV file beside the scene.

use std::path::Path;
use std::sync::Arc;

use gltf::json::Value;

use super::document::Document;
use super::extras::{self, of_file, text};
use super::report::Report;
use super::uri;
use crate::error::{Error, Result};
use crate::optics::LinearSrgb;
use crate::optics::spectrum::csv::read_lamp;
use crate::optics::spectrum::{Spectrum, illuminant};
use crate::scene::Light;

/// Key of a spectrum in extras.
pub const KEY: &str = "spectrum";

/// Size limit, larger than any table of a spectrum [bytes].
const MAX_CSV_BYTES: u64 = 16 << 20;

/// Spectrum stated for a light: by its node, or else by its entry in a list of lights.
pub fn stated<'a>(
    document: &'a Document,
    node: usize,
    of_lights: &'a [Value],
    light: usize,
) -> Option<&'a Value> {
    let of_node = extras::stated(&document.extras.nodes, node, KEY);
    of_node.or_else(|| extras::stated(of_lights, light, KEY))
}

/// Replaces the colour of a light by its stated spectrum, if any.
///
/// # Errors
/// A spectrum that does not exist or is not visible; a file that cannot be read or lies outside `folder`.
pub fn apply(
    light: &mut Light,
    stated: Option<&Value>,
    folder: &Path,
    owner: &str,
    report: &mut Report,
) -> Result<()> {
    let Some(stated) = stated else {
        return Ok(());
    };
    let spectrum = read(stated, folder, owner)?;
    if light.colour != LinearSrgb::WHITE {
        report.warn(
            owner,
            format!("its colour was left out, since it has a `{KEY}`"),
            "leave the colour white",
        );
    }
    light.set_spectrum(spectrum);
    Ok(())
}

/// Reads a stated spectrum and scales it to one luminous-equivalent watt.
///
/// # Errors
/// Those of [`apply`].
pub fn read(stated: &Value, folder: &Path, owner: &str) -> Result<Arc<Spectrum>> {
    by_name_or_file(text(stated, KEY, owner)?, folder, owner).map(Arc::new)
}

fn by_name_or_file(stated: &str, folder: &Path, owner: &str) -> Result<Spectrum> {
    let is_file = Path::new(stated)
        .extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("csv"));
    if !is_file {
        return illuminant(stated).map_err(|error| of_file(error.at(owner)));
    }
    let bytes = uri::read(stated, folder, MAX_CSV_BYTES, owner)?;
    let no_text = |_| {
        Error::failure(
            owner,
            format!("its `{KEY}` is not a text file"),
            "save it as UTF-8",
        )
    };
    let table = String::from_utf8(bytes).map_err(no_text)?;
    read_lamp(&table)
        .and_then(|lamp| lamp.named(stated).to_luminous_equivalent(1.0))
        .map_err(|error| of_file(error.at(format!("{owner}, `{stated}`"))))
}
