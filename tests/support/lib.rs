//! Shared by the test binaries: scenes, meshes, files made in memory, the program in a sandbox, skips that are counted.
#![allow(missing_docs, clippy::missing_panics_doc)]

pub mod chain_laws;
#[cfg(target_os = "linux")]
pub mod desktop;
pub mod effect_scenes;
#[cfg(target_os = "linux")]
pub mod file_drop;
pub mod files;
pub mod flip;
pub mod floors;
pub mod glb;
pub mod hard_scenes;
pub mod laws;
pub mod meshes;
pub mod program;
pub mod random_scenes;
pub mod references;
pub mod scenes;
pub mod sound;
pub mod tools;

use std::io::Write as _;
use std::path::{Path, PathBuf};

/// The project's folder.
fn root() -> &'static Path {
    let support = Path::new(env!("CARGO_MANIFEST_DIR"));
    support.ancestors().nth(2).expect("tests/support lies in the project")
}

/// The folder of this build's programs; test binaries lie in its `deps`.
fn build_folder() -> PathBuf {
    let test = std::env::current_exe().expect("the path of this test binary");
    test.ancestors().nth(2).expect("it lies in the build folder").to_owned()
}

/// Writes a file into the build folder's `evidence`, and says where it is.
pub fn keep_bytes(name: &str, bytes: &[u8]) -> String {
    let folder = build_folder().join("evidence");
    std::fs::create_dir_all(&folder).expect("the build folder can be written");
    let path = folder.join(name);
    std::fs::write(&path, bytes).expect("the build folder can be written");
    format!("see {}", path.display())
}

/// A file or folder of the project; fails where it is missing.
pub fn project_file(path: &str) -> PathBuf {
    let full = root().join(path);
    assert!(full.exists(), "{path} is missing from the project");
    full
}

/// A file or folder of the optional collection beside the project (`oracle/`, `scenes/`, `validator/`). `None`, after
/// a counted skip, where it is not there.
pub fn shared_or_skip(path: &str) -> Option<PathBuf> {
    let full = root().join("../shared").join(path);
    if full.exists() {
        return Some(full);
    }
    let test = std::thread::current().name().unwrap_or("?").to_owned();
    skip(&test, &format!("../shared/{path} is not there"));
    None
}

/// Says that a test was skipped and why, past the test harness's capture, so that `tests/run` counts it.
///
/// # Panics
/// With CI=true.
pub fn skip(test: &str, reason: &str) {
    assert!(
        std::env::var("CI").as_deref() != Ok("true"),
        "{test} was skipped ({reason}), which CI=true does not allow"
    );
    let _ = writeln!(std::io::stderr(), "skipped: {test}: {reason}");
}

/// What it holds, or the end of a test whose skip was counted.
#[macro_export]
macro_rules! or_skip {
    ($option:expr) => {
        match $option {
            Some(found) => found,
            None => return,
        }
    };
}

/// How a law is tried: many cases, the same ones in every run, so that a failure can be looked at.
pub fn law(cases: u32) -> proptest::test_runner::Config {
    proptest::test_runner::Config {
        cases,
        rng_seed: proptest::test_runner::RngSeed::Fixed(1),
        failure_persistence: None,
        ..proptest::test_runner::Config::default()
    }
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
