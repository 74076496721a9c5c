//! OpenEXR: single part, 32-bit float, ZIP.

use std::io::Cursor;

use exr::prelude as oxr;
use exr::prelude::ReadChannels as _;
use exr::prelude::ReadLayers as _;
use exr::prelude::WritableImage as _;

use super::float_image::{Channel, FloatImage, check_size, rgb_names};
use crate::error::{Error, Result};
use crate::eye_pass::Picture;
use crate::illumination::IlluminationMap;

/// Most channels that a file is read with: a map has at most 13, and 6 for each light.
const MAX_CHANNELS: usize = 4096;

/// Whether a file starts as an OpenEXR file does.
pub fn is_exr(bytes: &[u8]) -> bool {
    bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01])
}

/// The channels of a map: `LAYER.R/G/B` for each layer, `error.Y` where it was estimated, and `R/G/B` = the sum of the
/// layers [W/m²].
pub fn image_of_map(map: &IlluminationMap) -> FloatImage {
    let mut channels = Vec::new();
    for layer in &map.layers {
        channels.extend(rgb_channels(layer.kind.name(), &layer.irradiance));
    }
    if let Some(error) = &map.error {
        channels.push(Channel {
            name: "error.Y".into(),
            values: error.clone(),
        });
    }
    channels.extend(rgb_channels("", &map.total()));
    FloatImage {
        width: map.width(),
        height: map.height(),
        channels,
    }
}

/// `R/G/B` of a picture [W/(m² sr)], row 0 at the top.
pub fn image_of_picture(picture: &Picture) -> FloatImage {
    FloatImage {
        width: picture.width as usize,
        height: picture.height as usize,
        channels: rgb_channels("", &picture.radiance),
    }
}

/// Adds a light's part of a layer to the channels of its map, by a name such as `caustic.lamp`.
pub fn add_light(image: &mut FloatImage, name: &str, irradiance: &[[f32; 3]]) {
    image.channels.extend(rgb_channels(name, irradiance));
}

fn rgb_channels(prefix: &str, values: &[[f32; 3]]) -> Vec<Channel> {
    rgb_names(prefix)
        .into_iter()
        .enumerate()
        .map(|(channel, name)| Channel {
            name,
            values: values.iter().map(|rgb| rgb[channel]).collect(),
        })
        .collect()
}

/// The bytes of an OpenEXR file; the same image always gives the same bytes. `comment` states what the values are and
/// in which unit; `location` is named in errors.
///
/// # Errors
/// An image that the format cannot hold.
pub fn encode(image: FloatImage, comment: &str, location: &str) -> Result<Vec<u8>> {
    let size = (image.width, image.height);
    let channels = image
        .channels
        .into_iter()
        .map(|channel| oxr::AnyChannel::new(channel.name.as_str(), oxr::FlatSamples::F32(channel.values)))
        .collect();
    let attributes = oxr::LayerAttributes {
        comments: Some(comment.into()),
        software_name: Some(concat!("nephroid ", env!("CARGO_PKG_VERSION")).into()),
        ..Default::default()
    };
    let encoding = oxr::Encoding {
        compression: oxr::Compression::ZIP16,
        blocks: oxr::Blocks::ScanLines,
        line_order: oxr::LineOrder::Increasing,
    };
    let layer = oxr::Layer::new(size, attributes, encoding, oxr::AnyChannels::sort(channels));
    let mut bytes = Cursor::new(Vec::new());
    oxr::Image::from_layer(layer)
        .write()
        .to_buffered(&mut bytes)
        .map_err(|error| {
            Error::failure(
                location,
                format!("the image does not fit the format ({error})"),
                "choose another size",
            )
        })?;
    Ok(bytes.into_inner())
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
    // Sizes are checked before memory is taken for them.
    let headers = exr::meta::MetaData::read_from_buffered(Cursor::new(bytes), false)
        .map_err(|error| damaged(error.to_string()))?
        .headers;
    for header in &headers {
        check_size(header.layer_size.width(), header.layer_size.height(), location)?;
        if header.channels.list.len() > MAX_CHANNELS {
            return Err(damaged(format!("it has more than {MAX_CHANNELS} channels")));
        }
    }
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
