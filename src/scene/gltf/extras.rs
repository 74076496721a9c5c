//! What stands in `extras`, as the file has it: to be picked out before extras are thrown away.

use gltf::json::Value;

use crate::error::{Error, ErrorKind, Result};

/// What the extras of each item of a list have under a key, in file order; none where it is no list.
pub fn of_each(list: Option<&Value>, key: &str) -> Vec<Option<Value>> {
    let items = list.and_then(Value::as_array);
    let stated = |item: &Value| item.get("extras")?.get(key).cloned();
    items.into_iter().flatten().map(stated).collect()
}

/// What has to be a text. `owner` has it, under `key`.
///
/// # Errors
/// Anything else.
pub fn text<'a>(stated: &'a Value, key: &str, owner: &str) -> Result<&'a str> {
    let wrong = || {
        Error::failure(
            owner,
            format!("its `{key}` is no text"),
            "put it into quotation marks",
        )
    };
    stated.as_str().ok_or_else(wrong)
}

/// A fault of what a file says, where the same words on a command line would be its fault.
pub fn of_file(error: Error) -> Error {
    Error {
        kind: ErrorKind::Failure,
        ..error
    }
}
