//! Names, numbers and `extras` of a file; the latter are read from the raw JSON before the typed document drops them.

use crate::error::{Error, ErrorKind, Result};
use gltf::json::Value;

/// Extras of items, in file order; null for an item without any.
#[derive(Clone, Debug)]
pub struct Extras {
    pub materials: Vec<Value>,
    pub nodes: Vec<Value>,
    /// KHR_lights_punctual.
    pub lights: Vec<Value>,
    /// EXT_lights_area.
    pub area_lights: Vec<Value>,
}

impl Extras {
    pub fn of(file: &Value) -> Self {
        let of_each = |list: &str| {
            let items = file.pointer(list).and_then(Value::as_array);
            let extras = |item: &Value| item.get("extras").cloned().unwrap_or_default();
            items.into_iter().flatten().map(extras).collect()
        };
        Self {
            materials: of_each("/materials"),
            nodes: of_each("/nodes"),
            lights: of_each("/extensions/KHR_lights_punctual/lights"),
            area_lights: of_each("/extensions/EXT_lights_area/lights"),
        }
    }
}

/// Value that an item of a list states under a key.
pub fn stated<'a>(list: &'a [Value], item: usize, key: &str) -> Option<&'a Value> {
    list.get(item)?.get(key)
}

/// A value that must be text. `owner` and `key` are named in the error.
///
/// # Errors
/// Any other type.
pub fn text<'a>(stated: &'a Value, key: &str, owner: &str) -> Result<&'a str> {
    let wrong = || {
        Error::failure(
            owner,
            format!("its `{key}` is not text"),
            "put it into quotation marks",
        )
    };
    stated.as_str().ok_or_else(wrong)
}

/// Makes a usage error one of the file: the same text may come from the command line or from a file.
pub fn of_file(error: Error) -> Error {
    Error {
        kind: ErrorKind::Failure,
        ..error
    }
}

/// Name in the file, or else `kind` and index. Control characters are replaced, since they could steer a terminal.
pub fn name(given: Option<&str>, kind: &str, index: usize) -> String {
    match given {
        Some(name) if !name.is_empty() => name
            .chars()
            .map(|c| if c.is_control() { '\u{FFFD}' } else { c })
            .collect(),
        _ => format!("{kind}{index}"),
    }
}

/// The shortest decimal that rounds to this number: the digits of the file, unless these are more than seven. An index
/// of 1.33 is read as 1.33, not as 1.330000043.
pub fn widen(value: f32) -> f64 {
    // Infinity and NaN print as `inf` and `NaN`, which parse too.
    value.to_string().parse().unwrap_or(f64::from(value))
}

pub fn widen_all(values: [f32; 3]) -> [f64; 3] {
    values.map(widen)
}
