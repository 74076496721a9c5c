//! Names from a file, sanitised for printing.

/// The file's name for a thing, else `kind` and its index. Control characters could steer a terminal: they are
/// replaced.
pub fn name(given: Option<&String>, kind: &str, index: usize) -> String {
    match given {
        Some(name) if !name.is_empty() => name
            .chars()
            .map(|c| if c.is_control() { '\u{FFFD}' } else { c })
            .collect(),
        _ => format!("{kind}{index}"),
    }
}
