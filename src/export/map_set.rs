//! Reads a folder of maps. Nothing in it is trusted: it may be damaged, edited, or of another scene.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::Deserialize;

use super::manifest::{self, LightChannels, MapEntry, SceneSummary, Sequence};
use super::map_folder::is_map_file;
use super::{FloatImage, float_image, uv_file};
use crate::error::{Error, Result, Warning};
use crate::files;
use crate::illumination::{Chart, IlluminationMap, Layer, Parametrisation, UvSet, parametrise};
use crate::optics::LinearSrgb;
use crate::scene::{Object, Scene};

/// The parts of a manifest that are needed to read maps.
#[derive(Debug, Deserialize)]
struct StoredMaps {
    schema: u32,
    scene: SceneSummary,
    partial: bool,
    #[serde(default)]
    energy_w: StoredEnergy,
    maps: Vec<MapEntry>,
    sequence: Option<Sequence>,
}

/// Energy of the bake [W].
#[derive(Clone, Copy, Debug, Default, Deserialize)]
struct StoredEnergy {
    #[serde(default)]
    emitted: f64,
}

impl StoredEnergy {
    /// Flux by which rounding may take a texel below 0 [W]. Sums have steps of 2⁻⁶⁰ of the power or finer, and colours
    /// outside of sRGB are rounded channel by channel: this is room for a million roundings.
    fn rounding_w(self) -> f64 {
        let is_power = self.emitted.is_finite() && self.emitted > 0.0;
        if is_power {
            self.emitted * 2.0_f64.powi(-40)
        } else {
            0.0
        }
    }
}

/// The error for a folder whose contents do not fit together.
fn unusable(location: impl Into<String>, what: impl Into<String>) -> Error {
    Error::failure(location, what, "bake the scene again")
}

/// A map as read from its folder.
#[derive(Clone, Debug)]
pub struct StoredMap {
    /// Its entry in the manifest.
    pub entry: MapEntry,
    /// The map.
    pub map: IlluminationMap,
    /// Each light's part, if it was baked.
    pub lights: Vec<StoredLight>,
}

/// One light's part of one layer of a map.
#[derive(Clone, Debug)]
pub struct StoredLight {
    /// Light and layer.
    pub channels: LightChannels,
    /// E per texel [W/m²], linear sRGB.
    pub irradiance: Vec<[f32; 3]>,
}

/// A folder of maps and their scene; maps are read one at a time.
#[derive(Debug)]
pub struct MapSet<'a> {
    folder: PathBuf,
    scene: &'a Scene,
    stored: StoredMaps,
    location: String,
    /// Frame of a sequence, counted from 0.
    frame: Option<usize>,
}

impl<'a> MapSet<'a> {
    /// Reads the manifest.
    ///
    /// # Errors
    /// No manifest, or one of another format or scene.
    pub fn open(folder: impl Into<PathBuf>, scene: &'a Scene) -> Result<Self> {
        let folder = folder.into();
        let manifest = read_manifest(&folder)?;
        Self::of(folder, scene, manifest, None)
    }

    /// Opens a frame of a sequence, counted from 0; `scene` is the scene at its time.
    ///
    /// # Errors
    /// As [`Self::open`]; no such frame.
    pub fn open_frame(folder: impl Into<PathBuf>, scene: &'a Scene, frame: usize) -> Result<Self> {
        let folder = folder.into();
        let (mut stored, location) = read_manifest(&folder)?;
        let frames = || stored.sequence.iter().flat_map(|sequence| &sequence.frames);
        let Some(found) = frames().find(|entry| entry.frame == frame + 1).cloned() else {
            let count = frames().count();
            return Err(Error::failure(
                &location,
                format!("it has {count} frames, and none is number {}", frame + 1),
                "bake so many frames, or name fewer",
            ));
        };
        (stored.maps, stored.scene.geometry_hash) = (found.maps, found.geometry_hash);
        Self::of(folder, scene, (stored, location), Some(frame))
    }

    fn of(
        folder: PathBuf,
        scene: &'a Scene,
        (stored, location): (StoredMaps, String),
        frame: Option<usize>,
    ) -> Result<Self> {
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
        Ok(Self {
            folder,
            scene,
            stored,
            location,
            frame,
        })
    }

    /// The scene that the maps light.
    pub fn scene(&self) -> &'a Scene {
        self.scene
    }

    /// Frame of the sequence, counted from 0.
    pub fn frame(&self) -> Option<usize> {
        self.frame
    }

    /// Frames per second of the sequence.
    pub fn fps(&self) -> Option<f64> {
        self.stored.sequence.as_ref().map(|sequence| sequence.fps)
    }

    /// Folder of the maps.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Entries of all maps.
    pub fn entries(&self) -> &[MapEntry] {
        &self.stored.maps
    }

    /// The scene as the bake knew it.
    pub fn scene_summary(&self) -> &SceneSummary {
        &self.stored.scene
    }

    /// Warnings about the state of the maps.
    pub fn warnings(&self) -> Vec<Warning> {
        let partial = self.stored.partial.then(|| {
            Warning::new(
                &self.location,
                "its bake was interrupted",
                "bake the scene again for all of its light",
            )
        });
        partial.into_iter().collect()
    }

    /// The scene of the maps in a folder as the user named it: a path, or `builtin:NAME`.
    ///
    /// # Errors
    /// No manifest, or one of another format.
    pub fn source_of(folder: &Path) -> Result<String> {
        read_manifest(folder).map(|(stored, _)| stored.scene.source)
    }

    /// The sequence in a folder; `None` if it holds a single moment.
    ///
    /// # Errors
    /// As [`Self::source_of`].
    pub fn sequence_of(folder: &Path) -> Result<Option<Sequence>> {
        read_manifest(folder).map(|(stored, _)| stored.sequence)
    }

    /// Reads all maps, without the parts of lights.
    ///
    /// # Errors
    /// As [`Self::read`]; two maps of the same side of a surface.
    pub fn read_all(&self) -> Result<Vec<IlluminationMap>> {
        let mut maps: Vec<IlluminationMap> = Vec::new();
        for entry in self.entries() {
            let map = self.read_with(entry, &[])?.map;
            let mut others = maps.iter();
            if others.any(|other| other.chart.receiver == map.chart.receiver) {
                let what = format!("it names two maps of one side of {}", entry.surface);
                return Err(unusable(&self.location, what));
            }
            maps.push(map);
        }
        maps.sort_by_key(|map| map.chart.receiver);
        Ok(maps)
    }

    /// Reads one map.
    ///
    /// # Errors
    /// Files that are missing, damaged or do not fit the manifest.
    pub fn read(&self, entry: &MapEntry) -> Result<StoredMap> {
        self.read_with(entry, &entry.lights)
    }

    /// Reads one map with the parts of some lights.
    fn read_with(&self, entry: &MapEntry, lights: &[LightChannels]) -> Result<StoredMap> {
        // The file has to be what the manifest says of it.
        let object = self.object_of(entry)?;
        let path = self.inside(&entry.file)?;
        let location = path.display().to_string();
        let image = FloatImage::read(&path)?;
        if (image.width, image.height) != (entry.width, entry.height) {
            let what = format!(
                "its size {}x{} is not the manifest's {}x{}",
                image.width, image.height, entry.width, entry.height
            );
            return Err(unusable(location, what));
        }

        // Light below 0 is damage unless rounding explains it; rounded flux weighs more where texels are small.
        let chart = self.chart(entry, object)?;
        let rounding_w = self.stored.energy_w.rounding_w();
        let light = |prefix: &str, what: &str| {
            let irradiance = image.rgb(prefix).ok_or_else(|| {
                let what = format!("the {what} that the manifest names are not in it");
                unusable(&location, what)
            })?;
            let mut texels = irradiance.iter().enumerate();
            if texels.all(|(texel, light)| is_light(light, rounding_w / chart.texel_area_m2(texel))) {
                return Ok(irradiance);
            }
            let what = format!("its {prefix} layer holds values that are not irradiance");
            Err(unusable(&location, what))
        };

        // Layers are read in the order of their kinds, each once, however the manifest lists them.
        let mut kinds = entry.layers.clone();
        kinds.sort_unstable();
        kinds.dedup();
        let layers = kinds.into_iter().map(|kind| {
            let irradiance = light(kind.name(), &format!("channels of the {} layer", kind.name()))?;
            Ok(Layer { kind, irradiance })
        });
        let layers = layers.collect::<Result<_>>()?;

        // Shares of lights are as large as layers, and are read only where they are asked for.
        let lights = lights.iter().map(|stated| {
            let irradiance = light(&stated.channels, &format!("channels {}", stated.channels))?;
            Ok(StoredLight {
                channels: stated.clone(),
                irradiance,
            })
        });

        Ok(StoredMap {
            entry: entry.clone(),
            lights: lights.collect::<Result<_>>()?,
            map: IlluminationMap {
                chart: Arc::new(chart),
                layers,
                error: image.channel("error.Y").map(<[f32]>::to_vec),
                estimated_relative_rmse: entry.estimated_relative_rmse,
                estimated_visible: entry.estimated_visible,
            },
        })
    }

    /// Contents of the file of generated coordinates of a map; `None` if it uses the scene's own.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub fn read_coordinates(&self, entry: &MapEntry) -> Result<Option<Vec<u8>>> {
        let Some(file) = &entry.uv_file else {
            return Ok(None);
        };
        let triangles = self.object_of(entry)?.1.mesh().triangles.len();
        files::read_file(&self.inside(file)?, uv_file::size_bytes(triangles)).map(Some)
    }

    /// The object of a map, with its index.
    fn object_of(&self, entry: &MapEntry) -> Result<(usize, &'a Object)> {
        let mut objects = self.scene.objects.iter().enumerate();
        let found =
            objects.find(|(_, object)| object.node == entry.node && object.primitive == entry.primitive);
        let missing = || format!("the scene has no surface {}", entry.surface);
        found.ok_or_else(|| unusable(&self.location, missing()))
    }

    fn chart(&self, entry: &MapEntry, (index, object): (usize, &Object)) -> Result<Chart> {
        float_image::check_size(entry.width, entry.height, &self.location)?;
        let mesh = object.mesh_in_scene();
        let parametrisation = match (entry.uv_set, &entry.uv_file) {
            (UvSet::Generated, Some(file)) => {
                let bytes = self.read_coordinates(entry)?.unwrap_or_default();
                let corner_uvs = uv_file::decode(
                    &bytes,
                    mesh.triangles.len(),
                    &self.inside(file)?.display().to_string(),
                )?;
                Some(Parametrisation::new(index, mesh, UvSet::Generated, corner_uvs))
            }
            (UvSet::Generated, None) => None,
            // The scene's own UV sets are processed as in the bake.
            (set, _) => parametrise(index, mesh).filter(|own| own.uv_set == set),
        };
        let missing = || format!("the texture coordinates of {} are not there", entry.surface);
        let parametrisation = parametrisation.ok_or_else(|| unusable(&self.location, missing()))?;
        let chart = parametrisation.chart(entry.width, entry.height);
        Ok(chart.of_side(entry.side))
    }

    /// Path of a file in the folder; refuses names that lead out of it.
    fn inside(&self, file: &str) -> Result<PathBuf> {
        if is_map_file(file) {
            return Ok(self.folder.join(file));
        }
        let what = format!("it names the file {file:?}, which is none that a bake writes");
        Err(unusable(&self.location, what))
    }
}

/// Files of the maps in a folder, relative to it; `None` without a manifest.
pub(super) fn files_of(folder: &Path) -> Option<Vec<String>> {
    let (stored, _) = read_manifest(folder).ok()?;
    let frames = stored.sequence.iter().flat_map(|sequence| &sequence.frames);
    let maps = stored.maps.iter().chain(frames.flat_map(|frame| &frame.maps));
    let files = maps.flat_map(MapEntry::files);
    Some(
        files
            .filter(|file| is_map_file(file))
            .map(str::to_owned)
            .collect(),
    )
}

/// Maximum size of a manifest [bytes].
const MAX_MANIFEST_BYTES: u64 = 64 << 20;

/// The manifest of a folder, and its path for errors.
fn read_manifest(folder: &Path) -> Result<(StoredMaps, String)> {
    let path = folder.join(manifest::FILE_NAME);
    let location = path.display().to_string();
    let bytes = files::read_file(&path, MAX_MANIFEST_BYTES)?;
    let stored: StoredMaps = serde_json::from_slice(&bytes).map_err(|error| {
        Error::failure(
            &location,
            format!("this is not a manifest of maps ({error})"),
            "name a folder that `bake` wrote",
        )
    })?;
    if stored.schema != manifest::SCHEMA {
        let what = format!("its format is version {} of the manifest", stored.schema);
        return Err(unusable(location, what));
    }
    Ok((stored, location))
}

/// Whether a texel is finite and its luminance not negative, except for rounding of its numbers and of the counts
/// behind them [W/m²]. A channel below 0 is a colour outside of sRGB, as dispersion makes it.
fn is_light(texel: &[f32; 3], rounding: f64) -> bool {
    let channels = texel.map(f64::from);
    let largest = channels
        .iter()
        .fold(0.0_f64, |largest, value| largest.max(value.abs()));
    let luminance = LinearSrgb::from(channels).luminance();
    let lost = f64::from(f32::EPSILON) * largest + rounding;
    // A texel without area has its neighbours' light, and no bound.
    largest.is_finite() && (lost.is_nan() || luminance >= -lost)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_may_be_below_black_by_rounding_alone() {
        let rounding = StoredEnergy { emitted: 2.0 }.rounding_w() / 1e-4;
        let count = (2.0_f64.powi(-60) * 4.0 / 1e-4) as f32;
        for texel in [
            [2.0 * count, -count, count],
            [0.0, -5.0 * count, 35.0 * count],
            [0.0; 3],
        ] {
            assert!(is_light(&texel, rounding), "{texel:?}");
        }
        for texel in [
            [0.0, -1e-3, 0.0],
            [-1.0; 3],
            [f32::NAN, 0.0, 0.0],
            [f32::INFINITY; 3],
        ] {
            assert!(!is_light(&texel, rounding), "{texel:?}");
        }
        let unknown = StoredEnergy { emitted: f64::NAN }.rounding_w();
        assert!(unknown == 0.0 && !is_light(&[-count; 3], unknown));
    }
}
