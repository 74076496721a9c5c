//! Glass and metal of a material: KHR_materials_dispersion, and `glass` or `metal` in its `extras`.

use std::ops::RangeInclusive;

use gltf::json::Value;

use super::extras::{of_file, text};
use super::report::Report;
use crate::error::{Error, Result};
use crate::optics::glass::Dispersion;
use crate::optics::wavelength::VISIBLE;
use crate::optics::{Glass, Metal, Nanometres};
use crate::scene::Scene;

/// The extension that states an Abbe number, as 20/V_d.
pub const NAME: &str = "KHR_materials_dispersion";
/// Where a glass stands in a material's extras.
pub const GLASS_KEY: &str = "glass";
/// Where a metal does.
pub const METAL_KEY: &str = "metal";

/// What a material says that it is made of.
#[derive(Debug)]
pub enum Composition {
    /// A glass by number, name or formula.
    Glass(Glass),
    /// A metal by name.
    Metal(&'static Metal),
}

/// What extras state; `None` where they state nothing.
///
/// # Errors
/// A glass or metal that does not exist, or both at once. `owner` says whose they are.
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

/// How a file states a glass beside its index at 587.56 nm.
#[derive(Debug)]
pub enum GlassStatement<'a> {
    /// In the extras, under [`GLASS_KEY`].
    Name(&'a str),
    /// By the extension [`NAME`]: 20/V_d.
    Dispersion(f64),
    /// Not at all: it has one index.
    Nothing,
}

/// How to state a glass; `None` where a file cannot.
pub fn stated(glass: &Glass) -> Option<GlassStatement<'_>> {
    let is_named = Glass::parse(&glass.name).is_ok_and(|found| found.dispersion == glass.dispersion);
    match glass.dispersion {
        _ if is_named => Some(GlassStatement::Name(&glass.name)),
        Dispersion::Abbe { v_d, .. } => Some(GlassStatement::Dispersion(20.0 / v_d)),
        Dispersion::Constant(_) => Some(GlassStatement::Nothing),
        _ => None,
    }
}

/// The glass of an index at 587.56 nm and of what the extension states; `None` for no dispersion.
///
/// # Errors
/// What cannot be, and what was done about it, for a warning.
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
        Err(error) => Err(format!("{error}, and its dispersion was read as 0")),
    }
}

/// Says of which dispersive objects the glass is used beyond what its formula was made for, in the scene's light.
pub fn warn_of_ranges(scene: &Scene, report: &mut Report) {
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
            report.warn(warning.location, warning.what, warning.remedy);
        }
    }
}

/// The visible wavelengths that the lamps have; all of them where a lamp says nothing of its own.
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
