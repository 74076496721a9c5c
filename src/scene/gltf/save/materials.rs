//! Materials as their file is to have them.

use glam::DVec3;
use serde_json::json;

use super::json_text::JsonText;
use crate::error::{Error, Result};
use crate::scene::gltf::substance::Stated;
use crate::scene::gltf::{substance, waves};
use crate::scene::{Material, Wave};

/// Writes a material, which is number `index` of the file. The world's origin lies at −`shift` of the scene [m].
///
/// # Errors
/// A glass that has neither a name nor an Abbe number.
pub fn write(index: usize, was: &Material, is: &Material, shift: DVec3, text: &mut JsonText) -> Result<()> {
    let path = |name: &str| format!("/materials/{index}/{name}");
    if was.roughness != is.roughness {
        text.set(
            &path("pbrMetallicRoughness/roughnessFactor"),
            &json!(is.roughness),
        );
    }
    if was.metal != is.metal {
        let metal = path(&format!("extras/{}", substance::METAL_KEY));
        match is.metal {
            Some(named) => {
                text.set(&metal, &json!(named.name()));
            }
            None => text.remove(&metal),
        }
    }
    if was.base_colour != is.base_colour {
        let path = path("pbrMetallicRoughness/baseColorFactor");
        let stated = text
            .get(&path)
            .and_then(|written| serde_json::from_str(written).ok());
        let [.., alpha]: [f64; 4] = stated.unwrap_or([1.0; 4]);
        let [red, green, blue] = is.base_colour.to_array();
        text.set(&path, &json!([red, green, blue, alpha]));
    }
    if was.ior != is.ior || was.glass.as_deref() != is.glass.as_deref() {
        write_glass(index, is, text)?;
    }
    if was.waves != is.waves {
        write_waves(&path(&format!("extras/{}", waves::KEY)), is, shift, text);
    }
    Ok(())
}

fn write_glass(index: usize, is: &Material, text: &mut JsonText) -> Result<()> {
    let path = |name: &str| format!("/materials/{index}/{name}");
    let extension = |name: &str| format!("/materials/{index}/extensions/{name}");
    let by_name = path(&format!("extras/{}", substance::GLASS_KEY));
    let dispersion = format!("{}/dispersion", extension(substance::NAME));
    let stated = match is.glass.as_deref().map(|glass| (glass, substance::stated(glass))) {
        Some((_, Some(Stated::Name(name)))) => {
            text.set(&by_name, &json!(name));
            return Ok(());
        }
        Some((_, Some(Stated::Dispersion(dispersion)))) => dispersion,
        Some((_, Some(Stated::Nothing))) | None => 0.0,
        Some((glass, None)) => {
            return Err(Error::failure(
                format!("material `{}`", is.name),
                format!("is of glass `{}`, which a file cannot name", glass.name),
                "choose a glass by its name and save again",
            ));
        }
    };
    text.remove(&by_name);
    text.set(&format!("{}/ior", extension("KHR_materials_ior")), &json!(is.ior));
    super::use_extension(text, "KHR_materials_ior");
    if stated > 0.0 || text.get(&dispersion).is_some() {
        text.set(&dispersion, &json!(stated));
        super::use_extension(text, substance::NAME);
    }
    Ok(())
}

fn write_waves(path: &str, is: &Material, shift: DVec3, text: &mut JsonText) {
    let Some(waves) = &is.waves else {
        text.remove(path);
        return;
    };
    let in_world = Vec::<Wave>::from(waves.with_origin(-shift));
    let stated: Vec<_> = in_world
        .iter()
        .map(|wave| {
            json!({
                "amplitude_m": wave.amplitude_m,
                "wavelength_m": wave.wavelength_m,
                "direction": wave.direction.to_array(),
                "phase_rad": wave.phase_rad,
            })
        })
        .collect();
    text.set(path, &json!(stated));
}
