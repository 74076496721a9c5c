//! Values of options: how they are written.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use nephroid::effect::{Effect, EffectSwitch};
use nephroid::light_pass::share::Share;
use nephroid::scene::camera_path::MAX_FRAMES;
use nephroid::settings::{MAX_MAP_SIDE, MapResolution, Sigma, Wavelengths};
use strum::{EnumMessage, VariantArray};

/// A number of frames.
pub fn frames(text: &str) -> Result<usize, String> {
    let frames = text.parse().ok();
    frames
        .filter(|frames| (1..=MAX_FRAMES).contains(frames))
        .ok_or_else(|| format!("give 1 to {MAX_FRAMES} frames"))
}

/// The longest side of an atlas [texels].
pub fn atlas_side(text: &str) -> Result<usize, String> {
    let side = text.parse().ok();
    side.filter(|side| (LEAST_ATLAS_SIDE..=MAX_MAP_SIDE).contains(side))
        .ok_or_else(|| format!("give {LEAST_ATLAS_SIDE} to {MAX_MAP_SIDE} texels"))
}

/// Below, gutters take most of an atlas [texels].
const LEAST_ATLAS_SIDE: usize = 16;

/// `1.5` or `adaptive`.
pub fn sigma(text: &str) -> Result<Sigma, String> {
    match text {
        "adaptive" => Ok(Sigma::Adaptive),
        number => number
            .parse()
            .map(Sigma::Constant)
            .map_err(|_| "give a number or `adaptive`".to_string()),
    }
}

/// `continuous`, `rainbow` or a number.
pub fn wavelengths(text: &str) -> Result<Wavelengths, String> {
    match text {
        "continuous" => Ok(Wavelengths::Continuous),
        "rainbow" => Ok(Wavelengths::Rainbow),
        number => number
            .parse()
            .map(Wavelengths::Fixed)
            .map_err(|_| "give a number, `rainbow` or `continuous`".to_string()),
    }
}

/// `on` or `off`.
pub fn on_off(text: &str) -> Result<bool, String> {
    match text {
        "on" => Ok(true),
        "off" => Ok(false),
        _ => Err("give on or off".to_string()),
    }
}

/// `2%` or `0.02`.
pub fn share(text: &str) -> Result<f64, String> {
    let number = match text.strip_suffix('%') {
        Some(percent) => percent.trim().parse::<f64>().map(|percent| percent / 100.0),
        None => text.parse(),
    };
    number.map_err(|_| "give a share such as 2% or 0.02".to_string())
}

/// Most parts of a bake.
const MOST_SHARDS: u32 = 100_000;

/// `I/N`: one part of several.
pub fn share_of_bake(text: &str) -> Result<Share, String> {
    let numbers = text.split_once('/').and_then(|(number, count)| {
        let count = count.parse().ok().filter(|count| *count <= MOST_SHARDS)?;
        Share::new(number.parse().ok()?, count)
    });
    numbers.ok_or_else(|| format!("give one of several, such as 3/8, of up to {MOST_SHARDS}"))
}

/// `10s`, `500ms`, `2min`, or seconds without a unit.
pub fn seconds(text: &str) -> Result<f64, String> {
    let units = [("ms", 1e-3), ("min", 60.0), ("s", 1.0), ("", 1.0)];
    let parsed = units.iter().find_map(|(unit, seconds)| {
        let number: f64 = text.strip_suffix(unit)?.trim().parse().ok()?;
        Some(number * seconds)
    });
    parsed.ok_or_else(|| "give a time such as 10s, 500ms or 2min".to_string())
}

/// `auto`, `N` (square) or `WxH` [texels].
pub fn map_resolution(text: &str) -> Result<MapResolution, String> {
    if text == "auto" {
        return Ok(MapResolution::Auto);
    }
    let fixed = match text.split_once('x') {
        Some((width, height)) => width.parse().ok().zip(height.parse().ok()),
        None => text.parse().ok().map(|side| (side, side)),
    };
    fixed
        .map(|(width, height)| MapResolution::Fixed { width, height })
        .ok_or_else(|| "give `auto`, N or WxH in texels, such as 512 or 512x256".to_string())
}

/// Largest side of a picture [pixels].
const MAX_PICTURE_SIDE: u32 = 16384;

/// `WxH` [pixels].
pub fn picture_size(text: &str) -> Result<(u32, u32), String> {
    let sides = 1..=MAX_PICTURE_SIDE;
    text.split_once('x')
        .and_then(|(width, height)| Some((width.parse().ok()?, height.parse().ok()?)))
        .filter(|(width, height)| sides.contains(width) && sides.contains(height))
        .ok_or_else(|| format!("give WxH with 1 to {MAX_PICTURE_SIDE} pixels a side, such as 1280x720"))
}

/// Least memory that a bake is run with [bytes].
const MIN_MEMORY_BYTES: u64 = 1 << 20;

/// Bytes with a binary suffix: `512M`, `2G`, `1.5G`.
pub fn memory(text: &str) -> Result<u64, String> {
    let (number, factor) = match text.char_indices().last() {
        Some((at, 'k' | 'K')) => (&text[..at], 1_u64 << 10),
        Some((at, 'm' | 'M')) => (&text[..at], 1 << 20),
        Some((at, 'g' | 'G')) => (&text[..at], 1 << 30),
        Some((at, 't' | 'T')) => (&text[..at], 1 << 40),
        _ => (text, 1),
    };
    number
        .parse::<f64>()
        .ok()
        .map(|number| number * factor as f64)
        .filter(|bytes| (MIN_MEMORY_BYTES as f64..1e18).contains(bytes))
        .map(|bytes| bytes as u64)
        .ok_or_else(|| "give at least 1M, as bytes or with K, M, G or T, such as 512M or 2G".to_string())
}

/// `refraction=off`: an effect and its switch.
pub fn effect_switch(text: &str) -> Result<(Effect, EffectSwitch), String> {
    let names = || Effect::ALL.map(Effect::name).join(", ");
    let Some((name, switch)) = text.split_once('=') else {
        return Err(format!(
            "{text} is not of the form NAME=auto|on|off; NAME is one of {}",
            names()
        ));
    };
    let effect = variant(name).ok_or_else(|| format!("there is no effect {name}; there are {}", names()))?;
    let switch = variant(switch).ok_or_else(|| format!("{switch} is no switch; use auto, on or off"))?;
    Ok((effect, switch))
}

/// The variant of that name.
fn variant<T: VariantArray + Copy + Into<&'static str>>(name: &str) -> Option<T> {
    T::VARIANTS
        .iter()
        .copied()
        .find(|variant| (*variant).into() == name)
}

/// `off`, `error` and so on.
pub fn log_level() -> impl TypedValueParser<Value = log::LevelFilter> {
    let names = ["off", "error", "warn", "info", "debug", "trace"];
    PossibleValuesParser::new(names).try_map(|name| name.parse::<log::LevelFilter>())
}

/// A name, what it stands for, and what is told about it.
pub type Named<T> = (&'static str, T, &'static str);

/// Reads one of the names of a table.
pub fn named<T: Copy + Send + Sync + 'static>(
    table: &'static [Named<T>],
) -> impl TypedValueParser<Value = T> {
    let possible = table
        .iter()
        .map(|(name, _, help)| PossibleValue::new(*name).help(*help));
    PossibleValuesParser::new(possible).try_map(|name| {
        let found = table.iter().find(|known| known.0 == name);
        found.map(|known| known.1).ok_or("an unknown name")
    })
}

/// Reads one of the names of an enumeration; its documentation becomes the help of each.
pub fn one_of<T>() -> impl TypedValueParser<Value = T>
where
    T: VariantArray + EnumMessage + Into<&'static str> + Copy + Send + Sync,
{
    let possible = T::VARIANTS
        .iter()
        .map(|variant| PossibleValue::new((*variant).into()).help(variant.get_documentation()));
    PossibleValuesParser::new(possible).try_map(|name| variant(&name).ok_or("an unknown name"))
}

/// `auto` (none) or a number of stops, −64 to 64.
pub fn exposure(text: &str) -> Result<Exposure, String> {
    if text == "auto" {
        return Ok(Exposure::Auto);
    }
    text.parse()
        .ok()
        .filter(|stops| (-64.0..=64.0).contains(stops))
        .map(Exposure::Stops)
        .ok_or_else(|| "give `auto` or a number of stops from -64 to 64".to_string())
}

/// How bright a picture is shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exposure {
    /// Chosen from the picture.
    Auto,
    /// Radiance is multiplied by 2^stops.
    Stops(f64),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read_as_they_are_written() {
        assert_eq!(map_resolution("auto"), Ok(MapResolution::Auto));
        let fixed = |width, height| Ok(MapResolution::Fixed { width, height });
        assert_eq!(map_resolution("64"), fixed(64, 64));
        assert_eq!(map_resolution("64x32"), fixed(64, 32));
        for text in ["", "x", "64x", "-3", "1.5", "64x32x1", "big"] {
            assert!(map_resolution(text).is_err(), "{text}");
        }
        assert_eq!(picture_size("640x480"), Ok((640, 480)));
        for text in ["640", "0x480", "640x0", "99999x1", "axb"] {
            assert!(picture_size(text).is_err(), "{text}");
        }
    }

    #[test]
    fn memory_has_binary_suffixes() {
        assert_eq!(memory("2G"), Ok(2 << 30));
        assert_eq!(memory("1.5g"), Ok(3 << 29));
        assert_eq!(memory("1048576"), Ok(1 << 20));
        for text in ["", "G", "0", "-2G", "1K", "nan", "infG", "1e300"] {
            assert!(memory(text).is_err(), "{text}");
        }
    }

    #[test]
    fn numbers_have_their_words() {
        assert_eq!(sigma("adaptive"), Ok(Sigma::Adaptive));
        assert_eq!(sigma("0.5"), Ok(Sigma::Constant(0.5)));
        assert!(sigma("wide").is_err());
        assert_eq!(exposure("auto"), Ok(Exposure::Auto));
        assert_eq!(exposure("-1.5"), Ok(Exposure::Stops(-1.5)));
        for text in ["nan", "65", "bright"] {
            assert!(exposure(text).is_err(), "{text}");
        }
    }
}
