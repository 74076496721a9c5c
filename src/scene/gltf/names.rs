//! Names from a file, sanitised for printing.

/// Name in the file, or else `kind` and index. Control characters are replaced, since they could steer a terminal.
pub fn name(given: Option<&String>, kind: &str, index: usize) -> String {
    match given {
        Some(name) if !name.is_empty() => name
            .chars()
            .map(|c| if c.is_control() { '\u{FFFD}' } else { c })
            .collect(),
        _ => format!("{kind}{index}"),
    }
}
