//! Maps as textures for other programs: one file per map or an atlas, and an index that describes each file.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};

use self::content::TextureLight;
use self::encoding::FileMetadata;
use self::index::{PlacedMap, Rectangle, TextureEntry, TextureIndex};
use self::texels::Texels;
use super::Quantity;
use super::manifest::MapEntry;
use super::map_set::{MapSet, StoredMap};
use super::quantity::white;
use crate::error::{Error, Result, Warning};
use crate::files::{self, OutputFolder, StagedFolder};
use crate::progress::Control;

pub mod atlas;
mod bc6h;
mod content;
pub(super) mod encoding;
pub mod index;
pub(super) mod ktx2;
mod png16;
mod radiance;
pub(super) mod shared_exponent;
pub(super) mod texels;

pub use self::content::Content;
pub use self::encoding::{Encoding, Transfer};
pub use self::index::Loss;
pub use self::ktx2::Packing;

/// Factor of stored values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exposure {
    /// 2 to this power [stops]; 0 keeps light as it is.
    Stops(f64),
    /// The same whole number of stops for all textures, chosen so that none clips more than this share of its light,
    /// [0, 1), above white = 1.
    Cut(f64),
}

/// Options of the export.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureOptions {
    /// Kind of file.
    pub encoding: Encoding,
    /// Meaning of the numbers.
    pub quantity: Quantity,
    /// Light in the textures.
    pub content: Content,
    /// Factor of stored values.
    pub exposure: Exposure,
    /// Packs many maps into textures with sides of up to so many texels; `None`: one file per map.
    pub atlas_side: Option<usize>,
}

impl Default for TextureOptions {
    /// OpenEXR files of half floats, one per map: all light, in W/m².
    fn default() -> Self {
        Self {
            encoding: Encoding::Half,
            quantity: Quantity::Irradiance,
            content: Content::Sum,
            exposure: Exposure::Stops(0.0),
            atlas_side: None,
        }
    }
}

/// Report of an export.
#[derive(Clone, Debug, Serialize)]
pub struct TextureReport {
    /// The index as written.
    #[serde(flatten)]
    pub index: TextureIndex,
    /// Size of all files, including the index [bytes].
    pub bytes: u64,
    /// What the textures cannot hold.
    #[serde(skip)]
    pub warnings: Vec<Warning>,
}

/// Writes all maps of a folder as textures, those of a sequence frame by frame: all files or none.
///
/// # Errors
/// Maps that cannot be read or lack the requested light; light that the format cannot hold; output that cannot be
/// written; [`Error::cancelled`].
pub fn write(
    readers: &[MapSet<'_>],
    options: TextureOptions,
    mut folder: TextureFolder,
    control: &Control,
) -> Result<TextureReport> {
    let Some(first) = readers.first() else {
        return Err(Error::failure("maps", "there are none", "bake the scene again"));
    };
    options.content.check(first)?;

    // Frames of a sequence share the index and, if there is one, the atlas.
    let maps: Vec<MapOf> = readers
        .iter()
        .flat_map(|reader| reader.entries().iter().map(move |entry| (reader, entry)))
        .collect();

    // All textures share an exposure, which has to be known before the first of them is encoded.
    let mut writer = Writer {
        options,
        exposure_stops: 0.0,
        control,
        bytes: 0,
        warnings: first.warnings(),
        folder: &mut folder,
    };
    writer.exposure_stops = writer.choose_exposure(&maps)?;
    let textures = match options.atlas_side {
        Some(side) => writer.write_atlas(&maps, side)?,
        None => writer.write_each(&maps)?,
    };

    // All files are staged with their index and move to their places together.
    let index = TextureIndex::new(first, options, writer.exposure_stops, textures);
    let json = files::to_json(&index, index::FILE_NAME)?;
    writer.put(index::FILE_NAME.into(), &json)?;
    let (bytes, warnings) = (writer.bytes, writer.warnings);
    folder.commit(&index)?;
    Ok(TextureReport {
        index,
        bytes,
        warnings,
    })
}

/// A map and the set that reads it.
type MapOf<'a> = (&'a MapSet<'a>, &'a MapEntry);

/// State that the files of one export share.
struct Writer<'a> {
    options: TextureOptions,
    exposure_stops: f64,
    control: &'a Control,
    bytes: u64,
    warnings: Vec<Warning>,
    folder: &'a mut TextureFolder,
}

impl Writer<'_> {
    fn choose_exposure(&self, maps: &[MapOf]) -> Result<f64> {
        let cut = match self.options.exposure {
            Exposure::Stops(stops) => return Ok(stops),
            Exposure::Cut(cut) => cut,
        };
        let mut white: f64 = 0.0;
        for (reader, entry) in maps {
            let stored = reader.read(entry)?;
            for part in self.options.content.parts(&stored)?.0 {
                self.check()?;
                let texels = Texels::new(
                    &stored.map.chart,
                    &part.irradiance,
                    self.options.quantity.factor(),
                );
                let values = texels.values().as_flattened().iter().copied().map(f64::from);
                white = white.max(self::white(values, cut).unwrap_or(0.0));
            }
        }
        Ok(if white > 0.0 { -white.log2().ceil() } else { 0.0 })
    }

    /// Writes one file per map.
    fn write_each(&mut self, maps: &[MapOf]) -> Result<Vec<TextureEntry>> {
        let mut textures = Vec::new();
        for &(reader, entry) in maps {
            let stored = reader.read(entry)?;
            let uv_file = self.put_coordinates(reader, entry)?;
            for part in self.parts(&stored)? {
                let texels = self.texels(&stored, &part);
                let map = PlacedMap::new((reader, entry), uv_file.clone(), Rectangle::whole(texels.size()));
                let name = format!("{}{}", stem(entry), part.suffix());
                textures.push(self.write_texels(&name, &texels, &part, vec![map])?);
            }
        }
        Ok(textures)
    }

    /// Writes as few files as hold all maps.
    fn write_atlas(&mut self, maps: &[MapOf], most_side: usize) -> Result<Vec<TextureEntry>> {
        // The layout depends on sizes alone, so that maps are read page by page.
        let sizes: Vec<(usize, usize)> = maps
            .iter()
            .map(|(_, entry)| (entry.width, entry.height))
            .collect();
        let options = self.options.encoding.atlas_options(most_side);
        let name = |map: usize| format!("the map of {}", maps[map].1.surface);

        let mut textures = Vec::new();
        for (number, page) in atlas::pack(&sizes, options, name)?.into_iter().enumerate() {
            // One sheet for each layer or light; all sheets of a page have the same layout.
            let mut sheets: BTreeMap<String, Sheet> = BTreeMap::new();
            for &(map, place) in &page.places {
                let (reader, entry) = maps[map];
                let stored = reader.read(entry)?;
                let uv_file = self.put_coordinates(reader, entry)?;
                for part in self.parts(&stored)? {
                    self.check()?;
                    let texels = self.texels(&stored, &part);
                    let sheet = sheets.entry(part.key.clone()).or_insert_with(|| Sheet {
                        texels: Texels::black((page.width, page.height)),
                        part: part.without_light(),
                        maps: Vec::new(),
                    });
                    sheet.texels.place(&texels, place, options.gutter);
                    sheet.part.layers.extend(&part.layers);
                    sheet
                        .maps
                        .push(PlacedMap::new((reader, entry), uv_file.clone(), place));
                }
            }

            // Sheets are written page by page, so that memory holds those of one.
            for mut sheet in sheets.into_values() {
                sheet.part.layers.sort_unstable();
                sheet.part.layers.dedup();
                let name = format!("atlas{number}{}", sheet.part.suffix());
                textures.push(self.write_texels(&name, &sheet.texels, &sheet.part, sheet.maps)?);
            }
        }
        Ok(textures)
    }

    /// Copies a map's generated coordinates; `None` if it uses the scene's own.
    fn put_coordinates(&mut self, reader: &MapSet<'_>, entry: &MapEntry) -> Result<Option<String>> {
        let bytes = reader.read_coordinates(entry)?;
        bytes
            .map(|bytes| self.put(format!("{}.uv", stem(entry)), &bytes))
            .transpose()
    }

    fn parts(&mut self, stored: &StoredMap) -> Result<Vec<TextureLight>> {
        let (parts, warning) = self.options.content.parts(stored)?;
        self.warnings.extend(warning);
        Ok(parts)
    }

    /// Values of a part of a map as they will be stored.
    fn texels(&self, stored: &StoredMap, part: &TextureLight) -> Texels {
        let factor = self.options.quantity.factor() * self.exposure_stops.exp2();
        Texels::new(&stored.map.chart, &part.irradiance, factor)
    }

    /// Writes one texture with the maps that it holds.
    fn write_texels(
        &mut self,
        name: &str,
        texels: &Texels,
        part: &TextureLight,
        maps: Vec<PlacedMap>,
    ) -> Result<TextureEntry> {
        self.check()?;
        let file = format!("{name}.{}", self.options.encoding.extension());
        let location = self.folder.path().join(&file).display().to_string();
        let notes = FileMetadata {
            quantity: self.options.quantity,
            exposure_stops: self.exposure_stops,
            what: part.what(&maps),
            location: &location,
        };
        let encoded = self.options.encoding.encode(texels, &notes)?;
        let lost = Loss::measure(texels.values(), &encoded.stored, self.options.encoding.most());
        self.put(file.clone(), &encoded.bytes)?;
        Ok(TextureEntry {
            file,
            width: texels.size().0,
            height: texels.size().1,
            levels: encoded.levels,
            layers: part.layers.clone(),
            light: part.light.clone(),
            lost,
            maps,
        })
    }

    fn put(&mut self, name: String, bytes: &[u8]) -> Result<String> {
        self.folder.staged.write(&name, bytes)?;
        self.bytes += bytes.len() as u64;
        Ok(name)
    }

    fn check(&self) -> Result<()> {
        if self.control.is_cancelled() {
            return Err(Error::cancelled(self.folder.path().display().to_string()));
        }
        Ok(())
    }
}

/// An atlas texture that is being filled.
struct Sheet {
    texels: Texels,
    part: TextureLight,
    maps: Vec<PlacedMap>,
}

/// Name of a map's files without the suffix of their content; that of a frame ends with its number.
pub(super) fn stem(entry: &MapEntry) -> String {
    let file = entry.file.strip_prefix("maps/").unwrap_or(&entry.file);
    file.strip_suffix(".exr").unwrap_or(file).replace('/', "_")
}

/// Maximum size of an index [bytes].
const MAX_INDEX_BYTES: u64 = 64 << 20;

/// An output folder for textures.
#[derive(Debug)]
pub struct TextureFolder {
    staged: StagedFolder,
    /// Files of the export that is replaced.
    previous: Vec<String>,
}

impl TextureFolder {
    /// Opens or creates the folder, and checks that it can be written. An earlier export is replaced; a folder with
    /// other files is taken only with `force`.
    ///
    /// # Errors
    /// A place that cannot be written; a folder with other files.
    pub fn open(path: &Path, force: bool) -> Result<Self> {
        let previous = files_of_ours(path);
        let root = OutputFolder::open_own(path, previous.is_some(), force, "an export of textures")?;
        Ok(Self {
            staged: StagedFolder::new(root)?,
            previous: previous.unwrap_or_default(),
        })
    }

    /// Path of the folder.
    pub fn path(&self) -> &Path {
        self.staged.path()
    }

    /// Moves all files to their places and removes leftover files of the previous export.
    ///
    /// # Errors
    /// As [`StagedFolder::commit`]; outdated files that cannot be removed.
    fn commit(self, index: &TextureIndex) -> Result<()> {
        let path = self.path().to_path_buf();
        self.staged.commit()?;
        let written = index.textures.iter().flat_map(TextureEntry::files);
        files::remove_outdated(&path, &self.previous, written)
    }
}

/// The parts of an index that identify it and its files.
#[derive(Deserialize)]
struct KnownIndex {
    kind: String,
    textures: Vec<TextureEntry>,
}

/// Files of the export in a folder; `None` if there is none.
fn files_of_ours(path: &Path) -> Option<Vec<String>> {
    let bytes = files::read_file(&path.join(index::FILE_NAME), MAX_INDEX_BYTES).ok()?;
    let known: KnownIndex = serde_json::from_slice(&bytes).ok()?;
    if known.kind != index::KIND {
        return None;
    }
    let files = known.textures.iter().flat_map(TextureEntry::files);
    Some(
        files
            .filter(|file| is_texture_file(file))
            .map(str::to_owned)
            .collect(),
    )
}

/// Whether a name in an index is one that an export writes, with no way out of the folder.
fn is_texture_file(name: &str) -> bool {
    let ends = [".exr", ".png", ".hdr", ".ktx2", ".uv"];
    files::is_plain_name(name) && ends.iter().any(|end| name.ends_with(end))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_lead_elsewhere_are_none_of_ours() {
        for name in [
            "0001_floor.exr",
            "0001_floor_lamp-2.ktx2",
            "atlas-1.png",
            "0001_floor.uv",
        ] {
            assert!(is_texture_file(name), "{name}");
        }
        for name in [
            "",
            ".exr",
            "../a.exr",
            "a/b.exr",
            "a\\b.exr",
            "/a.exr",
            "a.txt",
            ".hidden.png",
        ] {
            assert!(!is_texture_file(name), "{name}");
        }
    }
}
