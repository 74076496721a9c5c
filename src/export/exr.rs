//! OpenEXR: single part, ZIP, 32-bit floats or halves.

use std::io::Cursor;

use exr::block::lines::LineRefMut;
use exr::image::write::samples::{SamplesWriter, WritableSamples};
use exr::math::RoundingMode;
use exr::meta::attribute::{LevelMode, SampleType};
use exr::meta::header::Header;
use exr::prelude as oxr;
use exr::prelude::{ReadChannels as _, ReadLayers as _, WritableImage as _};
use half::f16;

use super::float_image::{Channel, FloatImage, check_size, rgb_names};
use crate::error::{Error, Result};
use crate::illumination::{Chart, IlluminationMap};

/// Maximum number of channels of a file; a map has at most 13, and 9 for each light.
const MAX_CHANNELS: usize = 4096;

/// Whether the bytes begin like an OpenEXR file.
pub fn is_exr(bytes: &[u8]) -> bool {
    bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01])
}

/// One channel of a map's file, which is larger than the chart if the map had to be made coarser.
struct MapChannel<'a> {
    chart: &'a Chart,
    /// Width and height of the file [texels].
    size: (usize, usize),
    value: MapValue<'a>,
}

/// Value of a map by texel.
pub type MapValue<'a> = Box<dyn Fn(usize) -> f32 + Sync + 'a>;

/// The channels `PREFIX.R/G/B` of a map's texels.
pub fn rgb_values<'a>(
    prefix: &str,
    irradiance: &'a [[f32; 3]],
) -> impl Iterator<Item = (String, MapValue<'a>)> + use<'a> {
    let value = move |channel: usize| -> MapValue<'a> { Box::new(move |texel| irradiance[texel][channel]) };
    let names = rgb_names(prefix).into_iter().enumerate();
    names.map(move |(channel, name)| (name, value(channel)))
}

/// Encodes a map as OpenEXR: `LAYER.R/G/B` for each layer, `error.Y` if it was estimated, `R/G/B` = the sum of the
/// layers [W/m²], and `others`. Works row by row, without a dense copy of the map. The same map always gives the same
/// bytes; `comment` and `location` as for [`encode`].
///
/// # Errors
/// An image that the format cannot hold.
pub fn encode_map<'a>(
    map: &'a IlluminationMap,
    size: (usize, usize),
    others: Vec<(String, MapValue<'a>)>,
    comment: &str,
    location: &str,
) -> Result<Vec<u8>> {
    let mut channels = others;
    for layer in &map.layers {
        channels.extend(rgb_values(layer.kind.name(), &layer.irradiance));
    }
    if let Some(error) = &map.error {
        channels.push(("error.Y".into(), Box::new(|texel| error[texel])));
    }
    for (channel, name) in rgb_names("").into_iter().enumerate() {
        let sum = move |texel: usize| {
            let of_layers = map.layers.iter().map(|layer| layer.irradiance[texel][channel]);
            of_layers.fold(0.0, |sum, part| sum + part)
        };
        channels.push((name, Box::new(sum)));
    }
    let chart: &Chart = &map.chart;
    let channels = channels.into_iter();
    let channels = channels.map(|(name, value)| (name, MapChannel { chart, size, value }));
    let image = image_of(channels, size, comment);
    let mut bytes = Cursor::new(Vec::new());
    let written = image.write().to_buffered(&mut bytes);
    written.map_err(|error| does_not_fit(location, &error))?;
    Ok(bytes.into_inner())
}

impl<'a, 'm: 'a> WritableSamples<'a> for MapChannel<'m> {
    type Writer = &'a Self;

    fn sample_type(&self) -> SampleType {
        SampleType::F32
    }

    fn infer_level_modes(&self) -> (LevelMode, RoundingMode) {
        (LevelMode::Singular, RoundingMode::Down)
    }

    fn create_samples_writer(&'a self, _: &Header) -> &'a Self {
        self
    }
}

impl SamplesWriter for &MapChannel<'_> {
    fn extract_line(&self, line: LineRefMut<'_>) {
        let row = self.row(line.location.position.y());
        let begin = line.location.position.x();
        let samples = &row[begin..begin + line.location.sample_count];
        // The buffer has the length of the line: this cannot fail.
        drop(line.write_samples_from_slice(samples));
    }
}

/// Encodes an image as OpenEXR. The same image always gives the same bytes. `comment` states what the values are and in
/// which unit; `location` is named in errors.
///
/// # Errors
/// An image that the format cannot hold.
pub fn encode(image: FloatImage, comment: &str, location: &str) -> Result<Vec<u8>> {
    let size = (image.width, image.height);
    let channels = image.channels.into_iter();
    let channels = channels.map(|channel| (channel.name, oxr::FlatSamples::F32(channel.values)));
    encode_samples(channels, size, comment, location)
}

/// The same with half floats, as `R/G/B`.
///
/// # Errors
/// An image that the format cannot hold.
pub fn encode_half(
    values: &[[f16; 3]],
    size: (usize, usize),
    comment: &str,
    location: &str,
) -> Result<Vec<u8>> {
    let channels = rgb_names("").into_iter().enumerate().map(|(channel, name)| {
        let values = values.iter().map(|rgb| rgb[channel]).collect();
        (name, oxr::FlatSamples::F16(values))
    });
    encode_samples(channels, size, comment, location)
}

fn encode_samples(
    channels: impl Iterator<Item = (String, oxr::FlatSamples)>,
    size: (usize, usize),
    comment: &str,
    location: &str,
) -> Result<Vec<u8>> {
    let image = image_of(channels, size, comment);
    let mut bytes = Cursor::new(Vec::new());
    let written = image.write().to_buffered(&mut bytes);
    written.map_err(|error| does_not_fit(location, &error))?;
    Ok(bytes.into_inner())
}

fn image_of<'s, S: WritableSamples<'s> + 's>(
    channels: impl IntoIterator<Item = (String, S)>,
    size: (usize, usize),
    comment: &str,
) -> oxr::Image<oxr::Layer<oxr::AnyChannels<S>>> {
    let channels = channels.into_iter();
    let channels = channels.map(|(name, samples)| oxr::AnyChannel::new(name.as_str(), samples));
    let encoding = oxr::Encoding {
        compression: oxr::Compression::ZIP16,
        blocks: oxr::Blocks::ScanLines,
        line_order: oxr::LineOrder::Increasing,
    };
    let attributes = oxr::LayerAttributes {
        comments: Some(comment.into()),
        software_name: Some(concat!("nephroid ", env!("CARGO_PKG_VERSION")).into()),
        ..Default::default()
    };
    let channels = oxr::AnyChannels::sort(channels.collect());
    oxr::Image::from_layer(oxr::Layer::new(size, attributes, encoding, channels))
}

fn does_not_fit(location: &str, error: &exr::error::Error) -> Error {
    let what = format!("the image does not fit the format ({error})");
    Error::failure(location, what, "choose another size")
}

/// Decodes the first part of an OpenEXR file; `location` is named in errors.
///
/// # Errors
/// A damaged file, or one of an unusable size.
pub fn decode(bytes: &[u8], location: &str) -> Result<FloatImage> {
    let damaged = |reason: String| {
        Error::failure(
            location,
            format!("this OpenEXR file cannot be read ({reason})"),
            "write the file again",
        )
    };

    // Sizes are checked before memory is allocated.
    let headers = exr::meta::MetaData::read_from_buffered(Cursor::new(bytes), false)
        .map_err(|error| damaged(error.to_string()))?
        .headers;
    for header in &headers {
        check_size(header.layer_size.width(), header.layer_size.height(), location)?;
        if header.channels.list.len() > MAX_CHANNELS {
            return Err(damaged(format!("it has more than {MAX_CHANNELS} channels")));
        }
        if sample_bytes(header) > most_expansion(header) * bytes.len() as u64 {
            return Err(damaged("it ends long before its samples do".into()));
        }
    }

    // Maps and pictures are flat and of one resolution: deep samples and smaller levels are left out.
    let image = oxr::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .map_err(|error| damaged(error.to_string()))?;
    let layer = image.layer_data;
    let (width, height) = (layer.size.width(), layer.size.height());

    // A subsampled channel has fewer samples than texels, so that it does not match the others.
    let mut channels: Vec<Channel> = Vec::new();
    for channel in &layer.channel_data.list {
        if channel.sample_data.len() != width * height {
            return Err(damaged(format!("channel {} is subsampled", channel.name)));
        }
        channels.push(Channel {
            name: channel.name.to_string(),
            values: channel.sample_data.values_as_f32().collect(),
        });
    }
    Ok(FloatImage {
        width,
        height,
        channels,
    })
}

/// Maximum bytes of samples per byte of a file, above what any compression achieves on a constant image: about 1000
/// where deflate comes last (1400 for PXR24); DWA first keeps one number of 64.
fn most_expansion(header: &Header) -> u64 {
    match header.compression {
        oxr::Compression::DWAA(_) | oxr::Compression::DWAB(_) => 1 << 18,
        _ => 1 << 11,
    }
}

/// Memory of a part's samples [bytes].
fn sample_bytes(header: &Header) -> u64 {
    let texels = header.layer_size.area() as u64;
    let channels = header.channels.list.iter();
    channels
        .map(|channel| texels * channel.sample_type.bytes_per_sample() as u64)
        .sum()
}

impl MapChannel<'_> {
    /// Values of a row of the file. Each texel gets the mean over what it covers, so that the file holds the flux of
    /// the map.
    fn row(&self, row: usize) -> Vec<f32> {
        let value = &self.value;
        let (width, height) = (self.chart.width, self.chart.height);
        if let Some(layout) = &self.chart.layout {
            return layout.row_texels(row).map(value).collect();
        }
        if (width, height) == self.size {
            return (row * width..(row + 1) * width).map(value).collect();
        }
        let rows = shares(row, self.size.1, height);
        let mean = |column: usize| {
            let mut sum = 0.0;
            for (from, part) in shares(column, self.size.0, width) {
                for &(row, height) in &rows {
                    sum += part * height * f64::from(value(row * width + from));
                }
            }
            sum as f32
        };
        (0..self.size.0).map(mean).collect()
    }
}

/// The `coarse` cells of a line that one of `fine` cells overlaps, each with its share of that one.
pub(super) fn shares(index: usize, fine: usize, coarse: usize) -> Vec<(usize, f64)> {
    // Both kinds of cells have whole lengths in these units.
    let (begin, end) = (index * coarse, (index + 1) * coarse);
    let part = |cell: usize| end.min((cell + 1) * fine) - begin.max(cell * fine);
    (begin / fine..end.div_ceil(fine).min(coarse))
        .map(|cell| (cell, part(cell) as f64 / coarse as f64))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_of_a_line_add_up() {
        for (fine, coarse) in [(5, 3), (8, 2), (7, 7), (100, 13)] {
            let mut got = vec![0.0; coarse];
            for index in 0..fine {
                let shares = shares(index, fine, coarse);
                let all: f64 = shares.iter().map(|(_, part)| part).sum();
                assert!((all - 1.0).abs() < 1e-12, "{fine} of {coarse}: {all}");
                for (cell, part) in shares {
                    got[cell] += part;
                }
            }
            let whole = fine as f64 / coarse as f64;
            assert!(got.iter().all(|part| (part - whole).abs() < 1e-12), "{got:?}");
        }
    }
}
