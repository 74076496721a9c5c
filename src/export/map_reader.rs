//! A folder of maps, read back. Nothing in it is trusted: it may be damaged, edited or of another scene.

use std::path::Path;
use std::sync::Arc;

use serde::Deserialize;

use super::manifest::{self, MapEntry, SceneSummary};
use super::map_folder::{MAX_MANIFEST_BYTES, is_map_file};
use super::{FloatImage, float_image, uv_file};
use crate::error::{Error, Result, Warning};
use crate::files;
use crate::illumination::parametrisation::DEFAULT_NOMINAL_SIDE;
use crate::illumination::{Chart, IlluminationMap, Layer, Parametrisation, UvSet, parametrise};
use crate::optics::LinearSrgb;
use crate::scene::{Object, Scene};

/// The parts of a manifest that maps are read by.
#[derive(Deserialize)]
struct StoredMaps {
    schema: u32,
    scene: SceneSummary,
    partial: bool,
    maps: Vec<MapEntry>,
}

/// Maps of a scene from a folder, with warnings about their state.
///
/// # Errors
/// No manifest, one of another format or scene, files that are missing, damaged or do not fit the manifest.
pub fn read(folder: &Path, scene: &Scene) -> Result<(Vec<IlluminationMap>, Vec<Warning>)> {
    let path = folder.join(manifest::FILE_NAME);
    let location = path.display().to_string();
    let bytes = files::read_file(&path, MAX_MANIFEST_BYTES)?;
    let stored: StoredMaps = serde_json::from_slice(&bytes).map_err(|error| {
        Error::failure(
            &location,
            format!("this is no manifest of maps ({error})"),
            "name a folder that `bake` wrote",
        )
    })?;
    if stored.schema != manifest::SCHEMA {
        return Err(Error::failure(
            &location,
            format!("its format is version {} of the manifest", stored.schema),
            "bake the scene again",
        ));
    }
    if stored.scene.geometry_hash != SceneSummary::of(scene).geometry_hash {
        return Err(Error::failure(
            &location,
            format!(
                "its maps are of {}, whose geometry is not that of {}",
                stored.scene.source, scene.source
            ),
            "bake this scene or name the one of the maps",
        ));
    }
    let mut maps: Vec<IlluminationMap> = Vec::new();
    for entry in &stored.maps {
        let map = read_map(folder, entry, scene, &location)?;
        if maps
            .iter()
            .any(|other| other.chart.receiver == map.chart.receiver)
        {
            return Err(Error::failure(
                &location,
                format!("it names two maps of one side of {}", entry.surface),
                "bake the scene again",
            ));
        }
        maps.push(map);
    }
    maps.sort_by_key(|map| map.chart.receiver);
    let warnings = stored.partial.then(|| {
        Warning::new(
            location,
            "its bake was stopped before it was done",
            "bake the scene again for all of its light",
        )
    });
    Ok((maps, warnings.into_iter().collect()))
}

fn read_map(folder: &Path, entry: &MapEntry, scene: &Scene, manifest: &str) -> Result<IlluminationMap> {
    let (object, surface) = scene
        .objects
        .iter()
        .enumerate()
        .find(|(_, object)| object.node == entry.node && object.primitive == entry.primitive)
        .ok_or_else(|| {
            Error::failure(
                manifest,
                format!("the scene has no surface {}", entry.surface),
                "bake the scene again",
            )
        })?;
    let path = inside(folder, &entry.file, manifest)?;
    let location = path.display().to_string();
    let image = FloatImage::read(&path)?;
    if (image.width, image.height) != (entry.width, entry.height) {
        return Err(Error::failure(
            location,
            format!(
                "its size {}x{} is not the manifest's {}x{}",
                image.width, image.height, entry.width, entry.height
            ),
            "bake the scene again",
        ));
    }
    let layers = read_layers(&image, entry, &location)?;
    let chart = read_chart(folder, entry, (object, surface), manifest)?;
    Ok(IlluminationMap {
        chart: Arc::new(chart),
        layers,
        error: image.channel("error.Y").map(<[f32]>::to_vec),
        estimated_relative_rmse: entry.estimated_relative_rmse,
    })
}

fn read_layers(image: &FloatImage, entry: &MapEntry, location: &str) -> Result<Vec<Layer>> {
    let mut kinds = entry.layers.clone();
    kinds.sort_unstable();
    kinds.dedup();
    let mut layers = Vec::new();
    for kind in kinds {
        let irradiance = image.rgb(kind.name()).ok_or_else(|| {
            Error::failure(
                location,
                format!("the {} layer that the manifest names is not in it", kind.name()),
                "bake the scene again",
            )
        })?;
        if !irradiance.iter().all(is_light) {
            return Err(Error::failure(
                location,
                format!("its {} layer holds values that are no irradiance", kind.name()),
                "bake the scene again",
            ));
        }
        layers.push(Layer { kind, irradiance });
    }
    Ok(layers)
}

/// Whether a texel holds finite light of no negative luminance, but for rounding. A channel below 0 is a colour outside
/// of sRGB, as dispersion makes it.
fn is_light(texel: &[f32; 3]) -> bool {
    let channels = texel.map(f64::from);
    let largest = channels
        .iter()
        .fold(0.0_f64, |largest, value| largest.max(value.abs()));
    let luminance = LinearSrgb::from(channels).luminance();
    largest.is_finite() && luminance >= -f64::from(f32::EPSILON) * largest
}

fn read_chart(
    folder: &Path,
    entry: &MapEntry,
    (index, object): (usize, &Object),
    manifest: &str,
) -> Result<Chart> {
    float_image::check_size(entry.width, entry.height, manifest)?;
    let parametrisation = match (entry.uv_set, &entry.uv_file) {
        (UvSet::Generated, Some(file)) => {
            let path = inside(folder, file, manifest)?;
            let triangles = object.mesh.triangles.len();
            let bytes = files::read_file(&path, uv_file::size_bytes(triangles))?;
            let corner_uvs = uv_file::decode(&bytes, triangles, &path.display().to_string())?;
            Some(Parametrisation::new(
                index,
                &object.mesh,
                UvSet::Generated,
                corner_uvs,
            ))
        }
        (UvSet::Generated, None) => None,
        // The file's own sets are taken up the same way as in the bake.
        (set, _) => parametrise(index, &object.mesh, DEFAULT_NOMINAL_SIDE).filter(|own| own.uv_set == set),
    };
    let parametrisation = parametrisation.ok_or_else(|| {
        Error::failure(
            manifest,
            format!("the texture coordinates of {} are not there", entry.surface),
            "bake the scene again",
        )
    })?;
    Ok(parametrisation
        .chart(entry.width, entry.height)
        .of_side(entry.side))
}

/// A file of the folder; names that lead out of it are refused.
fn inside(folder: &Path, file: &str, manifest: &str) -> Result<std::path::PathBuf> {
    if is_map_file(file) {
        return Ok(folder.join(file));
    }
    Err(Error::failure(
        manifest,
        format!("it names the file {file:?}, which is none that a bake writes"),
        "bake the scene again",
    ))
}
