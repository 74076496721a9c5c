//! Materials as their file is to have them.

use glam::DVec3;
use serde_json::json;

use super::JsonDocument;
use crate::error::{Error, Result};
use crate::scene::Material;
use crate::scene::gltf::substance::Stated;
use crate::scene::gltf::{substance, waves};

/// Writes a material, which is number `index` of the file. The world's origin lies at −`shift` of the scene [m].
///
/// # Errors
/// A glass that has neither a name nor an Abbe number.
pub fn write(
    index: usize,
    was: &Material,
    is: &Material,
    shift: DVec3,
    json: &mut JsonDocument,
) -> Result<()> {
    let path = |name: &str| format!("/materials/{index}/{name}");
    if was.roughness != is.roughness {
        json.set(&path("pbrMetallicRoughness/roughnessFactor"), json!(is.roughness));
    }
    if was.metal != is.metal {
        let metal = path(&format!("extras/{}", substance::METAL_KEY));
        match is.metal {
            Some(named) => {
                json.set(&metal, json!(named.name()));
            }
            None => json.remove(&metal),
        }
    }
    if was.base_colour != is.base_colour {
        let path = path("pbrMetallicRoughness/baseColorFactor");
        let stated = json
            .get(&path)
            .and_then(|stated| serde_json::from_value(stated.clone()).ok());
        let [.., alpha]: [f64; 4] = stated.unwrap_or([1.0; 4]);
        let [red, green, blue] = is.base_colour.to_array();
        json.set(&path, json!([red, green, blue, alpha]));
    }
    if was.ior != is.ior || was.glass.as_deref() != is.glass.as_deref() {
        write_glass(index, is, json)?;
    }
    if was.waves != is.waves {
        write_waves(&path(&format!("extras/{}", waves::KEY)), is, shift, json);
    }
    Ok(())
}

fn write_glass(index: usize, is: &Material, json: &mut JsonDocument) -> Result<()> {
    let path = |name: &str| format!("/materials/{index}/{name}");
    let extension = |name: &str| format!("/materials/{index}/extensions/{name}");
    let by_name = path(&format!("extras/{}", substance::GLASS_KEY));
    let dispersion = format!("{}/dispersion", extension(substance::NAME));
    let stated = match is.glass.as_deref().map(|glass| (glass, substance::stated(glass))) {
        Some((_, Some(Stated::Name(name)))) => {
            json.set(&by_name, json!(name));
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
    json.remove(&by_name);
    json.set(&format!("{}/ior", extension("KHR_materials_ior")), json!(is.ior));
    json.use_extension("KHR_materials_ior");
    if stated > 0.0 || json.get(&dispersion).is_some() {
        json.set(&dispersion, json!(stated));
        json.use_extension(substance::NAME);
    }
    Ok(())
}

fn write_waves(path: &str, is: &Material, shift: DVec3, json: &mut JsonDocument) {
    let Some(waves) = &is.waves else {
        json.remove(path);
        return;
    };
    json.set(path, waves::written(waves, shift));
}
