//! Decodes images one by one, so that a bad image costs one texture and not the scene.

use std::collections::{BTreeSet, HashMap};
use std::io::Cursor;
use std::path::Path;
use std::sync::Arc;

use basisu::{DecodeFlags, SourceFormat, TargetFormat, Transcoder};
use gltf::json::texture::{MagFilter, WrappingMode};
use gltf::json::validation::Checked;
use gltf::json::{Index, Root};
use image::{ImageFormat, ImageReader, Limits, RgbaImage};
use rayon::prelude::*;

use super::buffers::Buffers;
use super::context::LoadContext;
use super::{extras, guard, uri};
use crate::error::{Error, Result};
use crate::optics::LinearSrgb;
use crate::scene::Texture;
use crate::scene::texture::Wrap;

/// Largest width and height of an image [texels].
const LARGEST_SIDE: u32 = 16_384;

/// sRGB code of linear 0.5: stands in for an image that cannot be read.
const GREY: u8 = 188;

/// Texels, wrap modes in u and v, and whether look-ups take the nearest texel.
type Pixels = (Arc<RgbaImage>, [Wrap; 2], bool);

/// Reads the images that materials ask for, each once.
#[derive(Debug)]
pub struct Images<'a> {
    root: &'a Root,
    buffers: &'a Buffers<'a>,
    folder: &'a Path,
    decoded: HashMap<usize, Arc<RgbaImage>>,
    by_source: HashMap<(usize, [u8; 2], bool), usize>,
    textures: Vec<Texture>,
}

impl<'a> Images<'a> {
    /// Nothing read yet.
    pub fn new(root: &'a Root, buffers: &'a Buffers<'a>, folder: &'a Path) -> Self {
        Self {
            root,
            buffers,
            folder,
            decoded: HashMap::new(),
            by_source: HashMap::new(),
            textures: Vec::new(),
        }
    }

    /// The scene's textures.
    pub fn into_textures(self) -> Vec<Texture> {
        self.textures
    }

    /// Decodes the images of glTF textures side by side, for whoever asks for them later. What cannot be read is left to
    /// that.
    ///
    /// # Errors
    /// More memory than the budget has.
    pub fn decode_ahead(
        &mut self,
        textures: impl Iterator<Item = Index<gltf::json::Texture>>,
        load: &mut LoadContext,
    ) -> Result<()> {
        let images: BTreeSet<usize> = textures.filter_map(|texture| self.source(texture)).collect();
        let missing = images
            .into_iter()
            .filter(|image| !self.decoded.contains_key(image));
        for images in missing.collect::<Vec<_>>().chunks(rayon::current_num_threads()) {
            let most_bytes = load.left() / images.len() as u64;
            let read = |image: &usize| Some((*image, self.read(*image, "image", most_bytes).ok()?));
            let decoded: Vec<_> = images.par_iter().filter_map(read).collect();
            for (image, pixels) in decoded {
                let owner = format!("image `{}`", self.name(image));
                load.take(pixels.as_raw().len() as u64, &owner)?;
                self.decoded.insert(image, Arc::new(pixels));
            }
        }
        Ok(())
    }

    /// Index among the scene's textures of a glTF texture; `None`, with a warning, where it has no image.
    ///
    /// # Errors
    /// More memory than the budget has.
    pub fn texture(
        &mut self,
        texture: Index<gltf::json::Texture>,
        owner: &str,
        load: &mut LoadContext,
    ) -> Result<Option<usize>> {
        let Some(image) = self.image_index(texture, owner, load) else {
            return Ok(None);
        };
        let (wrap, is_nearest) = self.sampling(texture);
        let key = (image, wrap.map(|wrap| wrap as u8), is_nearest);
        if let Some(known) = self.by_source.get(&key) {
            return Ok(Some(*known));
        }
        let pixels = self.decode(image, load)?;
        let texture = Texture {
            name: self.name(image),
            width: pixels.width(),
            height: pixels.height(),
            rgba: pixels.pixels().map(|pixel| pixel.0).collect(),
            wrap,
            is_nearest,
        };
        let added = self.add(texture, load)?;
        self.by_source.insert(key, added);
        Ok(Some(added))
    }

    /// The texels of a glTF texture; `None` where it has no image.
    ///
    /// # Errors
    /// More memory than the budget has.
    pub fn pixels(
        &mut self,
        texture: Index<gltf::json::Texture>,
        owner: &str,
        load: &mut LoadContext,
    ) -> Result<Option<Pixels>> {
        let Some(image) = self.image_index(texture, owner, load) else {
            return Ok(None);
        };
        let (wrap, is_nearest) = self.sampling(texture);
        Ok(Some((self.decode(image, load)?, wrap, is_nearest)))
    }

    /// Adds a texture that is no image of the file; gives its index among the scene's textures.
    ///
    /// # Errors
    /// More memory than the budget has.
    pub fn add(&mut self, texture: Texture, load: &mut LoadContext) -> Result<usize> {
        load.take(size_of_val(&texture.rgba[..]) as u64, &texture.name)?;
        self.textures.push(texture);
        Ok(self.textures.len() - 1)
    }

    /// A texture by its index among the scene's textures.
    pub fn get(&self, texture: usize) -> &Texture {
        &self.textures[texture]
    }

    /// Mean of `value` over the texels of a texture; `None` if it has no image.
    ///
    /// # Errors
    /// More memory than the budget has.
    pub fn mean(
        &mut self,
        texture: Index<gltf::json::Texture>,
        value: impl Fn([u8; 4]) -> LinearSrgb,
        owner: &str,
        load: &mut LoadContext,
    ) -> Result<Option<LinearSrgb>> {
        let Some((pixels, ..)) = self.pixels(texture, owner, load)? else {
            return Ok(None);
        };
        let sum = pixels
            .pixels()
            .fold(LinearSrgb::BLACK, |sum, pixel| sum + value(pixel.0));
        Ok(Some(sum / f64::from(pixels.width() * pixels.height())))
    }

    fn image_index(
        &self,
        texture: Index<gltf::json::Texture>,
        owner: &str,
        load: &mut LoadContext,
    ) -> Option<usize> {
        let found = self.source(texture);
        if found.is_none() {
            load.warn(
                owner,
                "refers to an image that does not exist; it was left out",
                "add the image",
            );
        }
        found
    }

    /// The image of a glTF texture, if it has one.
    fn source(&self, texture: Index<gltf::json::Texture>) -> Option<usize> {
        let texture = self.root.textures.get(texture.value());
        let stated = |name: &str| {
            let extensions = texture?.extensions.as_ref()?;
            let source = extensions.others.get(name)?.get("source")?;
            usize::try_from(source.as_u64()?).ok()
        };
        let image = ["EXT_texture_webp", "KHR_texture_basisu"]
            .into_iter()
            .find_map(stated);
        let image = image.or(texture.map(|texture| texture.source.value()));
        image.filter(|image| *image < self.root.images.len())
    }

    /// How texels are repeated beyond the image, and whether they are not interpolated.
    fn sampling(&self, texture: Index<gltf::json::Texture>) -> ([Wrap; 2], bool) {
        let texture = self.root.textures.get(texture.value());
        let sampler = texture.and_then(|texture| self.root.samplers.get(texture.sampler?.value()));
        let Some(sampler) = sampler else {
            return ([Wrap::Repeat; 2], false);
        };
        let wrap = [sampler.wrap_s, sampler.wrap_t].map(|mode| match mode {
            Checked::Valid(WrappingMode::ClampToEdge) => Wrap::ClampToEdge,
            Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::MirroredRepeat,
            Checked::Valid(WrappingMode::Repeat) | Checked::Invalid => Wrap::Repeat,
        });
        (
            wrap,
            sampler.mag_filter == Some(Checked::Valid(MagFilter::Nearest)),
        )
    }

    fn name(&self, image: usize) -> String {
        extras::name(self.root.images[image].name.as_deref(), "image", image)
    }

    fn decode(&mut self, image: usize, load: &mut LoadContext) -> Result<Arc<RgbaImage>> {
        if let Some(known) = self.decoded.get(&image) {
            return Ok(known.clone());
        }
        let owner = format!("image `{}`", self.name(image));
        let pixels = match self.read(image, &owner, load.left()) {
            Ok(pixels) => pixels,
            Err(why) => {
                load.warn(
                    owner.clone(),
                    match why.location == owner {
                        true => format!("{}; it was replaced by grey", why.what),
                        false => format!("{}: {}; it was replaced by grey", why.location, why.what),
                    },
                    why.remedy,
                );
                RgbaImage::from_pixel(1, 1, image::Rgba([GREY, GREY, GREY, 255]))
            }
        };
        load.take(pixels.as_raw().len() as u64, &owner)?;
        let pixels = Arc::new(pixels);
        self.decoded.insert(image, pixels.clone());
        Ok(pixels)
    }

    fn read(&self, image: usize, owner: &str, most_bytes: u64) -> Result<RgbaImage> {
        let image = &self.root.images[image];
        let loaded;
        let bytes = match (image.buffer_view, &image.uri) {
            (Some(view), _) => self.buffers.view(view, owner)?.data,
            (None, Some(uri)) => {
                loaded = uri::read(uri, self.folder, most_bytes, owner)?;
                &loaded
            }
            (None, None) => return Err(unreadable(owner, "has no data")),
        };
        let decoded = guard::without_panic(|| decode(bytes, most_bytes));
        let decoded = decoded.unwrap_or_else(|| Err("is damaged".into()));
        decoded.map_err(|why| unreadable(owner, why))
    }
}

fn unreadable(owner: &str, why: impl Into<String>) -> Error {
    Error::failure(owner, why, "repair the image")
}

fn decode(bytes: &[u8], most_bytes: u64) -> std::result::Result<RgbaImage, String> {
    let mut reader = ImageReader::new(Cursor::new(bytes))
        .with_guessed_format()
        .map_err(|error| format!("cannot be read ({error})"))?;
    let known = [ImageFormat::Png, ImageFormat::Jpeg, ImageFormat::WebP];
    if bytes.starts_with(b"\xabKTX 20\xbb") {
        return decode_basis(bytes, most_bytes);
    }
    if !reader.format().is_some_and(|format| known.contains(&format)) {
        return Err("is neither PNG nor JPEG nor WebP nor Basis Universal".into());
    }
    let mut limits = Limits::default();
    limits.max_image_width = Some(LARGEST_SIDE);
    limits.max_image_height = Some(LARGEST_SIDE);
    limits.max_alloc = Some(most_bytes);
    reader.limits(limits);
    let image = reader
        .decode()
        .map_err(|error| format!("cannot be decoded ({error})"))?;
    Ok(image.into_rgba8())
}

/// Decodes a Basis Universal image in a KTX2 file. Its header is checked first, since the transcoder trusts it.
fn decode_basis(bytes: &[u8], most_bytes: u64) -> std::result::Result<RgbaImage, String> {
    let damaged = |why: String| format!("cannot be decoded ({why})");
    let file = ktx2::Reader::new(bytes).map_err(|error| damaged(error.to_string()))?;
    let (width, height) = (file.header().pixel_width, file.header().pixel_height);
    let texels_bytes = 4 * u64::from(width) * u64::from(height);
    let unpacked_bytes = file.levels().map(|level| level.uncompressed_byte_length).max();
    if width.max(height) > LARGEST_SIDE || texels_bytes.max(unpacked_bytes.unwrap_or(0)) > most_bytes / 2 {
        return Err("is too large".into());
    }
    let image = Transcoder::new(bytes).map_err(|error| damaged(format!("{error:?}")))?;
    if !matches!(
        image.source_format(),
        SourceFormat::Etc1s | SourceFormat::UastcLdr
    ) {
        return Err("has a format that glTF does not allow".into());
    }
    let texels = image.transcode(0, TargetFormat::Rgba32, DecodeFlags::NONE);
    let texels = texels.map_err(|error| damaged(format!("{error:?}")))?;
    RgbaImage::from_raw(width, height, texels).ok_or_else(|| "differs from the size that it states".into())
}
