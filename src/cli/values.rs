//! Parsers of option values.

use std::fmt::Display;
use std::ops::RangeInclusive;
use std::str::FromStr;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use nephroid::light_pass::shard_index::ShardIndex;
use nephroid::settings::options;
use strum::VariantArray;

/// Parser of a number in a range.
pub fn within<T>(
    range: RangeInclusive<T>,
    things: &'static str,
) -> impl Fn(&str) -> Result<T, String> + Clone + Send + Sync
where
    T: FromStr + PartialOrd + Display + Clone + Send + Sync,
{
    move |text| {
        let number = text.parse().ok().filter(|number| range.contains(number));
        number.ok_or_else(|| format!("give {} to {} {things}", range.start(), range.end()))
    }
}

/// Maximum number of shards.
const MAX_SHARDS: u32 = 100_000;

/// Parses `I/N`, one shard of several.
pub fn share_of_bake(text: &str) -> Result<ShardIndex, String> {
    let numbers = text.split_once('/').and_then(|(number, count)| {
        let count = count.parse().ok().filter(|count| *count <= MAX_SHARDS)?;
        ShardIndex::new(number.parse().ok()?, count)
    });
    numbers.ok_or_else(|| format!("give one of several, such as 3/8, of up to {MAX_SHARDS}"))
}

/// Maximum side of a picture [pixels].
const MAX_PICTURE_SIDE: u32 = 16384;

/// Parses `WxH` [pixels].
pub fn picture_size(text: &str) -> Result<(u32, u32), String> {
    let sides = 1..=MAX_PICTURE_SIDE;
    text.split_once('x')
        .and_then(|(width, height)| Some((width.parse().ok()?, height.parse().ok()?)))
        .filter(|(width, height)| sides.contains(width) && sides.contains(height))
        .ok_or_else(|| format!("give WxH with 1 to {MAX_PICTURE_SIDE} pixels a side, such as 1280x720"))
}

/// Parser of a log level: `off`, `error` and so on.
pub fn log_level() -> impl TypedValueParser<Value = log::LevelFilter> {
    let names = ["off", "error", "warn", "info", "debug", "trace"];
    PossibleValuesParser::new(names).try_map(|name| name.parse::<log::LevelFilter>())
}

/// A name and its value.
pub type Named<T> = (&'static str, T);

/// Parser of the names in a table.
pub fn named<T: Copy + Send + Sync + 'static>(
    table: &'static [Named<T>],
) -> impl TypedValueParser<Value = T> {
    PossibleValuesParser::new(table.iter().map(|(name, _)| *name)).try_map(|name| {
        let found = table.iter().find(|known| known.0 == name);
        found.map(|known| known.1).ok_or("an unknown name")
    })
}

/// Parser of the names of an enumeration.
pub fn one_of<T>() -> impl TypedValueParser<Value = T>
where
    T: VariantArray + Into<&'static str> + Copy + Send + Sync,
{
    let names = T::VARIANTS.iter().map(|variant| (*variant).into());
    PossibleValuesParser::new(names.collect::<Vec<&'static str>>()).try_map(|name| options::named(&name))
}

/// Largest exposure, either way; beyond it, numbers are mistakes [stops].
pub const MAX_STOPS: f64 = 64.0;

/// Parses `auto` or a number of stops, −64 to 64.
pub fn exposure(text: &str) -> Result<Exposure, String> {
    if text == "auto" {
        return Ok(Exposure::Auto);
    }
    let stops = within(-MAX_STOPS..=MAX_STOPS, "stops");
    stops(text)
        .map(Exposure::Stops)
        .map_err(|why| format!("{why}, or `auto`"))
}

/// Exposure of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exposure {
    /// Chosen from the picture.
    Auto,
    /// Radiance is multiplied by 2^stops.
    Stops(f64),
}
