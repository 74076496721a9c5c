//! What the test binaries share. Each uses a part of it.
#![allow(dead_code)]

pub mod evidence;
pub mod skip;
pub mod sound;

use std::path::{Path, PathBuf};

pub use skip::skip;

/// A file or folder of the project; fails where it is missing.
pub fn project_file(path: &str) -> PathBuf {
    let full = Path::new(env!("CARGO_MANIFEST_DIR")).join(path);
    assert!(full.exists(), "{path} is missing from the project");
    full
}

/// A file or folder of the optional collection beside the project (`oracle/`, `scenes/`, `validator/`). `None`, after
/// a counted skip, where it is not there.
pub fn shared_or_skip(path: &str) -> Option<PathBuf> {
    let full = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared").join(path);
    if full.exists() {
        return Some(full);
    }
    let test = std::thread::current().name().unwrap_or("?").to_owned();
    skip(&test, &format!("../shared/{path} is not there"));
    None
}

/// Fails unless two values agree to a relative tolerance (absolute where the expected one is zero).
#[track_caller]
pub fn assert_close(actual: f64, expected: f64, tolerance: f64, what: &str) {
    let scale = if expected == 0.0 { 1.0 } else { expected.abs() };
    assert!(
        (actual - expected).abs() <= tolerance * scale,
        "{what}: {actual} instead of {expected} within {tolerance}"
    );
}

/// A reference map of `assets/reference` by its scene's name: 256×256 values [W/m²], row 0 first. PFM as the solver
/// writes it: little-endian, one channel, rows in the map's own order.
pub fn reference_map(name: &str) -> Vec<f64> {
    let path = project_file(&format!("assets/reference/{name}.pfm"));
    let bytes = std::fs::read(path).expect("a readable reference");
    let values = bytes.len().checked_sub(256 * 256 * 4).expect("a map of 256×256");
    assert!(
        bytes.starts_with(b"Pf\n256 256\n-1"),
        "{name} is no little-endian 256×256 PFM"
    );
    bytes[values..]
        .chunks_exact(4)
        .map(|b| f64::from(f32::from_le_bytes(b.try_into().expect("four bytes"))))
        .collect()
}
