//! Support for the test binaries: scenes, meshes, files in memory, a sandbox for the program, and counted skips.
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
pub mod prelude;
pub mod program;
pub mod random_scenes;
pub mod references;
pub mod scenes;
pub mod sound;
pub mod tools;

use std::io::Write as _;
use std::path::{Path, PathBuf};

fn root() -> &'static Path {
    let support = Path::new(env!("CARGO_MANIFEST_DIR"));
    support.ancestors().nth(2).expect("tests/support lies in the project")
}

/// Folder of this build's programs; test binaries are in its `deps`.
fn build_folder() -> PathBuf {
    let test = std::env::current_exe().expect("the path of this test binary");
    test.ancestors().nth(2).expect("it lies in the build folder").to_owned()
}

/// Writes a file to the folder `evidence` in the build folder; returns a message with its path.
pub fn keep_bytes(name: &str, bytes: &[u8]) -> String {
    let folder = build_folder().join("evidence");
    std::fs::create_dir_all(&folder).expect("the build folder can be written");
    let path = folder.join(name);
    std::fs::write(&path, bytes).expect("the build folder can be written");
    format!("see {}", path.display())
}

/// Path of a file or folder of the project, which must exist.
pub fn project_file(path: &str) -> PathBuf {
    let full = root().join(path);
    assert!(full.exists(), "{path} is missing from the project");
    full
}

/// Path of a file or folder in the optional collection beside the project (`oracle/`, `scenes/`, `validator/`). If it
/// does not exist, counts a skip and returns `None`.
pub fn shared_or_skip(path: &str) -> Option<PathBuf> {
    let full = root().join("../shared").join(path);
    if full.exists() {
        return Some(full);
    }
    let test = std::thread::current().name().unwrap_or("?").to_owned();
    skip(&test, &format!("../shared/{path} is not there"));
    None
}

/// Reports a skipped test and the reason. Bypasses the output capture of the test harness, so that `tests/run` counts
/// the skip.
///
/// # Panics
/// If CI=true, which allows no skips.
pub fn skip(test: &str, reason: &str) {
    assert!(
        std::env::var("CI").as_deref() != Ok("true"),
        "{test} was skipped ({reason}), which CI=true does not allow"
    );
    let _ = writeln!(std::io::stderr(), "skipped: {test}: {reason}");
}

/// The value of an option, or return from a test whose skip is counted.
#[macro_export]
macro_rules! or_skip {
    ($option:expr) => {
        match $option {
            Some(found) => found,
            None => return,
        }
    };
}

/// Configuration of a property test: a fixed seed, so that every run tries the same cases and failures are
/// reproducible.
pub fn law(cases: u32) -> proptest::test_runner::Config {
    proptest::test_runner::Config {
        cases,
        rng_seed: proptest::test_runner::RngSeed::Fixed(1),
        failure_persistence: None,
        ..proptest::test_runner::Config::default()
    }
}

/// Asserts that two values agree to a relative tolerance, or an absolute one if `expected` is 0.
#[track_caller]
pub fn assert_close(actual: f64, expected: f64, tolerance: f64, what: &str) {
    let scale = if expected == 0.0 { 1.0 } else { expected.abs() };
    assert!(
        (actual - expected).abs() <= tolerance * scale,
        "{what}: {actual} instead of {expected} within {tolerance}"
    );
}

/// Reference map of a scene in `assets/reference`: 256×256 values [W/m²], row 0 first. The files are PFM as the
/// solver writes it: little-endian, one channel, rows in the map's own order.
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
