//! Spectra of lights: `spectrum` in the `extras` of a node, of its light, or of an emissive material; by name or as a
//! CSV file beside the scene.

use std::path::Path;
use std::sync::Arc;

use gltf::json::Value;

use super::context::LoadContext;
use super::extras::{of_file, text};
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

/// Replaces the colour of a light by its stated spectrum.
///
/// # Errors
/// A spectrum that does not exist or is not visible; a file that cannot be read or lies outside `folder`.
pub fn apply(
    light: &mut Light,
    stated: &Value,
    folder: &Path,
    owner: &str,
    load: &mut LoadContext,
) -> Result<()> {
    let spectrum = read(stated, folder, owner)?;
    if light.colour != LinearSrgb::WHITE {
        load.warn(
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
    let stated = text(stated, KEY, owner)?;
    let extension = Path::new(stated).extension();
    if !extension.is_some_and(|extension| extension.eq_ignore_ascii_case("csv")) {
        let spectrum = illuminant(stated).map_err(|error| of_file(error.at(owner)))?;
        return Ok(Arc::new(spectrum));
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
        .map(Arc::new)
        .map_err(|error| of_file(error.at(format!("{owner}, `{stated}`"))))
}
