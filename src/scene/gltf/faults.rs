//! Violations of the glTF specification, reported as warnings. Those that affect what is read stop the loading where
//! the faulty part is needed.

use gltf::json::Root;
use gltf::json::path::Path;
use gltf::json::validation::{Error, Validate};

use super::context::LoadContext;
use super::guard;

/// Reports violations in the typed JSON.
pub fn warn(root: &Root, load: &mut LoadContext) {
    let mut found = Vec::new();
    // Validation panics on some broken references.
    let finished = guard::without_panic(|| {
        root.validate(root, Path::new, &mut |path, error| {
            found.push((path().to_string(), error))
        });
    });
    for (path, error) in found {
        // Extensions have been checked already, against those that this program reads.
        if path.starts_with("extensionsRequired") {
            continue;
        }
        // Accessors may lack a buffer view (all zero), and textures a plain image (WebP).
        let may_miss = path.ends_with("bufferView") || path.ends_with("source");
        // Bounds are computed, whatever the file states.
        let unread = path.ends_with(".min") || path.ends_with(".max");
        if unread || error == Error::Missing && may_miss {
            continue;
        }
        let what = match error {
            Error::IndexOutOfBounds => "refers to something that does not exist",
            Error::Invalid => "has a value that glTF does not allow",
            Error::Missing => "is missing",
            Error::Oversize => "is too large",
            Error::Unsupported => "is not supported",
        };
        load.warn_damaged(path, what);
    }
    if finished.is_none() {
        load.warn_damaged("JSON", "has references that lead nowhere");
    }
}
