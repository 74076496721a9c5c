//! Glass and metal of a material: KHR_materials_dispersion, and `glass` or `metal` in its `extras`.

use std::ops::RangeInclusive;

use gltf::json::Value;

use super::context::LoadContext;
use super::extras::{of_file, text};
use crate::error::{Error, Result};
use crate::optics::glass::Dispersion;
use crate::optics::wavelength::VISIBLE;
use crate::optics::{Glass, Metal, Nanometres};
use crate::scene::Scene;

/// Extension that states an Abbe number, as 20/V_d.
pub const NAME: &str = "KHR_materials_dispersion";
/// Key of a glass in the extras of a material.
pub const GLASS_KEY: &str = "glass";
/// Key of a metal in the extras of a material.
pub const METAL_KEY: &str = "metal";

/// Substance that a material states.
#[derive(Debug)]
pub enum Composition {
    /// By number, name or formula.
    Glass(Glass),
    /// By name.
    Metal(&'static Metal),
}

/// Reads the extras; `None` if they state nothing.
///
/// # Errors
/// An unknown glass or metal, or both at once. `owner` is named in errors.
pub fn read(glass: Option<&Value>, metal: Option<&Value>, owner: &str) -> Result<Option<Composition>> {
    let substance = match (glass, metal) {
        (None, None) => return Ok(None),
        (Some(glass), None) => {
            let glass = Glass::parse(text(glass, GLASS_KEY, owner)?);
            Composition::Glass(glass.map_err(|error| of_file(error.at(owner)))?)
        }
        (None, Some(metal)) => {
            let metal = Metal::by_name(text(metal, METAL_KEY, owner)?);
            Composition::Metal(metal.map_err(|error| of_file(error.at(owner)))?)
        }
        (Some(_), Some(_)) => {
            let what = format!("is said to be both `{GLASS_KEY}` and `{METAL_KEY}`");
            return Err(Error::failure(owner, what, "name one of them"));
        }
    };
    Ok(Some(substance))
}

/// How a file states a glass, apart from its index at 587.56 nm.
#[derive(Debug)]
pub enum GlassStatement<'a> {
    /// In the extras, under [`GLASS_KEY`].
    Name(&'a str),
    /// As 20/V_d, by the extension [`NAME`].
    Dispersion(f64),
    /// Not at all: the index is constant.
    Nothing,
}

/// How to state a glass; `None` if a file cannot.
pub fn stated(glass: &Glass) -> Option<GlassStatement<'_>> {
    let is_named = Glass::parse(&glass.name).is_ok_and(|found| found.dispersion == glass.dispersion);
    match glass.dispersion {
        _ if is_named => Some(GlassStatement::Name(&glass.name)),
        Dispersion::Abbe { v_d, .. } => Some(GlassStatement::Dispersion(20.0 / v_d)),
        Dispersion::Constant(_) => Some(GlassStatement::Nothing),
        _ => None,
    }
}

/// Glass of an index at 587.56 nm with the dispersion that the extension states; `None` without dispersion.
///
/// # Errors
/// The fault and how it was handled, for a warning.
pub fn dispersion(ior: f64, extension: &Value) -> std::result::Result<Option<Glass>, String> {
    let stated = match extension.get("dispersion") {
        None => return Ok(None),
        Some(stated) => stated.as_f64().filter(|dispersion| *dispersion >= 0.0),
    };
    let read_as_0 = || "its dispersion cannot be, and was read as 0".to_owned();
    let dispersion = stated.ok_or_else(read_as_0)?;
    if dispersion == 0.0 {
        return Ok(None);
    }
    let glass = Glass::with_abbe_number(ior, 20.0 / dispersion);
    match glass.dispersion.checked() {
        Ok(_) => Ok(Some(glass)),
        Err(error) => Err(format!("{}, and its dispersion was read as 0", error.what)),
    }
}

/// Warns of dispersive objects whose glass is used outside the range of its formula, in the scene's light.
pub fn warn_of_ranges(scene: &Scene, load: &mut LoadContext) {
    let light = wavelengths(scene);
    for (index, material) in scene.materials.iter().enumerate() {
        let is_used = scene.objects.iter().any(|object| object.material == index);
        let Some(glass) = material
            .glass
            .as_ref()
            .filter(|_| is_used && material.is_dispersive())
        else {
            continue;
        };
        for warning in glass.warnings(&light, &format!("material `{}`", material.name)) {
            load.warn(warning.location, warning.what, warning.remedy);
        }
    }
}

/// Range of visible wavelengths in the scene's light; a light without a spectrum has all of them.
fn wavelengths(scene: &Scene) -> RangeInclusive<Nanometres> {
    let (first, last) = VISIBLE.into_inner();
    let range = |light: &crate::scene::Light| {
        let own = light
            .spectrum
            .as_ref()
            .map_or(VISIBLE, |spectrum| spectrum.range());
        (own.start().0.max(first.0), own.end().0.min(last.0))
    };
    let ranges = scene.lights.iter().map(range);
    let (from, to) = ranges
        .reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
        .unwrap_or((first.0, last.0));
    Nanometres(from)..=Nanometres(to)
}
