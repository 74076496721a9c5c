//! A folder of maps: `maps/NNNN_slug.exr`, their generated coordinates, and the manifest, written last.

use std::path::{Path, PathBuf};

use super::manifest::{self, BandChannel, LightChannels, Manifest, MapEntry};
use super::{exr, map_set, uv_file};
use crate::bake::Bake;
use crate::error::Result;
use crate::files::{self, OutputFolder};
use crate::illumination::{IlluminationMap, Side, UvSet};
use crate::scene::{Light, Scene};
use crate::settings::{BakeSettings, MapResolution};

/// Subfolder of the map files.
const MAPS: &str = "maps";

/// An output folder for maps.
#[derive(Debug)]
pub struct MapFolder {
    /// Within `root`. It is dropped first, so that an unused one leaves `root` empty.
    maps: OutputFolder,
    root: OutputFolder,
    /// Files of the previous bake, relative to the folder.
    previous: Vec<String>,
}

impl MapFolder {
    /// Opens or creates the folder, and checks that it can be written. Maps of an earlier bake are replaced file by
    /// file; a folder with other files is taken only with `force`.
    ///
    /// # Errors
    /// A place that cannot be written; a folder with other files.
    pub fn open(path: impl AsRef<Path>, force: bool) -> Result<Self> {
        let path = path.as_ref();
        let previous = map_set::files_of(path);
        let root = OutputFolder::open_own(path, previous.is_some(), force, "a bake")?;
        let maps = OutputFolder::open(&path.join(MAPS))?;
        Ok(Self {
            maps,
            root,
            previous: previous.unwrap_or_default(),
        })
    }

    /// Path of the folder.
    pub fn path(&self) -> &Path {
        self.root.path()
    }

    /// Writes the maps, then the manifest, then removes leftover files of the previous bake.
    ///
    /// # Errors
    /// A full disk; a place that can no longer be written.
    pub fn write(self, scene: &Scene, settings: &BakeSettings, result: &Bake) -> Result<Manifest> {
        let maps = self.write_maps(scene, settings, result, None)?;
        self.finish(Manifest::new(scene, settings, result, maps))
    }

    /// Writes maps; those of a frame (counted from 1) go into one folder per map.
    pub(super) fn write_maps(
        &self,
        scene: &Scene,
        settings: &BakeSettings,
        result: &Bake,
        frame: Option<usize>,
    ) -> Result<Vec<MapEntry>> {
        let maps = result.maps.iter();
        maps.map(|map| self.write_map(scene, settings, map, result, frame))
            .collect()
    }

    /// Writes the manifest and removes leftover files of the previous bake.
    pub(super) fn finish(self, manifest: Manifest) -> Result<Manifest> {
        let path = self.path().join(manifest::FILE_NAME);
        let json = files::to_json(&manifest, &path.display().to_string())?;
        files::write_atomically(&path, |writer| writer.write_all(&json))?;
        files::remove_outdated(self.path(), &self.previous, manifest.files())?;
        Ok(manifest)
    }

    fn write_map(
        &self,
        scene: &Scene,
        settings: &BakeSettings,
        map: &IlluminationMap,
        result: &Bake,
        frame: Option<usize>,
    ) -> Result<MapEntry> {
        let stem = stem(scene, map);
        let name = frame.map_or(format!("{stem}.exr"), |frame| format!("{stem}/{frame:04}.exr"));
        let path = self.maps.path().join(&name);
        let folder = frame.map(|_| OutputFolder::open(&self.maps.path().join(&stem)));
        let _folder = folder.transpose()?;
        let (parts, uv_path) = write_map(&path, scene, settings, map, result)?;
        let in_maps = |path: &Path| {
            let name = path.strip_prefix(self.path()).unwrap_or(path);
            name.to_string_lossy().into_owned()
        };
        Ok(MapEntry::new(
            scene,
            map,
            size(settings, map),
            parts,
            in_maps(&path),
            uv_path.as_deref().map(in_maps),
        ))
    }
}

/// Parts of lights and bands of the spectrum in a map's file.
pub type Parts = (Vec<LightChannels>, Vec<BandChannel>);

/// The name of a map's file without its extension.
pub fn stem(scene: &Scene, map: &IlluminationMap) -> String {
    let object = map.chart.object();
    let name = files::slug(&scene.objects[object].name, "surface");
    let back = match map.chart.receiver.side() {
        Side::Front => "",
        Side::Back => "_back",
    };
    format!("{object:04}_{name}{back}")
}

/// The requested size [texels]; the memory limit may have made the map coarser.
fn size(settings: &BakeSettings, map: &IlluminationMap) -> (usize, usize) {
    match settings.map_resolution {
        MapResolution::Fixed { width, height } => (width, height),
        MapResolution::Auto => (map.width(), map.height()),
    }
}

/// Writes one map of a bake as OpenEXR and, if its coordinates were generated, those to a `.uv` file beside it. Returns
/// which parts of lights and which bands the file holds, and the path of the coordinates.
///
/// # Errors
/// A full disk; a place that cannot be written.
pub fn write_map(
    path: &Path,
    scene: &Scene,
    settings: &BakeSettings,
    map: &IlluminationMap,
    result: &Bake,
) -> Result<(Parts, Option<PathBuf>)> {
    // Generated coordinates are in no other file: without them, nobody could place the map.
    let uv_path = (map.chart.uv_set == UvSet::Generated).then(|| path.with_extension("uv"));
    if let Some(uv_path) = &uv_path {
        let bytes = uv_file::encode(&map.chart.corner_uvs);
        files::write_atomically(uv_path, |writer| writer.write_all(&bytes))?;
    }

    // Shares of lights and bands become channels of the same file; the manifest names them.
    let (mut lights, mut bands, mut channels) = (Vec::new(), Vec::new(), Vec::new());
    let receiver = map.chart.receiver;
    for part in result
        .light_layers
        .iter()
        .filter(|part| part.receiver == receiver)
    {
        let prefix = format!("{}.{}", part.kind.name(), light_slug(scene, part.light));
        channels.extend(exr::rgb_values(&prefix, &part.irradiance));
        lights.push(LightChannels {
            light: scene.lights[part.light].name.clone(),
            layer: part.kind,
            channels: prefix,
        });
    }
    for part in result.band_layers.iter().filter(|part| part.receiver == receiver) {
        let band = BandChannel::new(&part.band);
        let value: exr::MapValue = Box::new(move |texel| part.irradiance[texel]);
        channels.push((band.channel.clone(), value));
        bands.push(band);
    }

    // The file appears whole or not at all, so that an interrupted bake leaves no torn map.
    let bytes = exr::encode_map(
        map,
        size(settings, map),
        channels,
        "irradiance in W/m^2 (lumens / 683 per m^2), linear sRGB; row 0 is v = 0",
        &path.display().to_string(),
    )?;
    files::write_atomically(path, |writer| writer.write_all(&bytes))?;
    Ok(((lights, bands), uv_path))
}

/// A light's name within channel names; with its index unless it is unique.
fn light_slug(scene: &Scene, light: usize) -> String {
    let slug_of = |light: &Light| files::slug(&light.name, "light");
    let own = slug_of(&scene.lights[light]);
    let is_alone = scene.lights.iter().filter(|other| slug_of(other) == own).count() == 1;
    if is_alone { own } else { format!("{own}-{light}") }
}

/// Whether a path in a manifest is one that a bake writes: `maps/NAME`, or `maps/NAME/NAME` for a frame, with no way
/// out of the folder.
pub(super) fn is_map_file(file: &str) -> bool {
    let Some(within) = file.strip_prefix("maps/") else {
        return false;
    };
    within.split('/').count() <= 2 && within.split('/').all(files::is_plain_name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slugs_are_map_files() {
        for name in ["Floor", "../../etc/passwd", "", "床", "C:\\x"] {
            assert!(is_map_file(&format!(
                "maps/0001_{}.exr",
                files::slug(name, "surface")
            )));
        }
    }

    #[test]
    fn paths_that_lead_elsewhere_are_no_map_files() {
        for file in [
            "maps/../x",
            "/etc/passwd",
            "maps/",
            "x.exr",
            "maps/.hidden",
            "maps/a/b/c",
            "maps/a/../b",
            "maps//b",
            "maps\\a",
        ] {
            assert!(!is_map_file(file), "{file}");
        }
    }
}
