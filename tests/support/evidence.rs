//! What a test that fails leaves behind to look at.

use std::path::{Path, PathBuf};

use nephroid::export::exr::encode;
use nephroid::export::float_image::{Channel, FloatImage, rgb_names};

/// Where it goes, within the build folder.
fn folder() -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join("evidence")
}

/// Writes an image, its reference and their difference as OpenEXR files of a width [texels], and says where they are:
/// a part of the sentence that a test fails with.
///
/// # Panics
/// Images of different sizes, or no whole rows.
pub fn keep_images(name: &str, image: &[[f32; 3]], reference: &[[f32; 3]], width: usize) -> String {
    assert_eq!(image.len(), reference.len(), "{name}: images of one size");
    assert!(image.len().is_multiple_of(width), "{name}: whole rows");
    let difference: Vec<[f32; 3]> = image
        .iter()
        .zip(reference)
        .map(|(a, b)| std::array::from_fn(|channel| a[channel] - b[channel]))
        .collect();
    let parts = [
        ("image", image),
        ("reference", reference),
        ("difference", &difference),
    ];
    for (part, pixels) in parts {
        let bytes = encode(float_image(pixels, width), "evidence of a failed test", name);
        keep_bytes(&format!("{name}-{part}.exr"), &bytes.expect("an image"));
    }
    let place = folder().join(name);
    format!(
        "see {}-image.exr, -reference.exr and -difference.exr",
        place.display()
    )
}

/// Writes a file, and says where it is.
pub fn keep_bytes(name: &str, bytes: &[u8]) -> String {
    std::fs::create_dir_all(folder()).expect("the build folder can be written");
    let path = folder().join(name);
    std::fs::write(&path, bytes).expect("the build folder can be written");
    format!("see {}", path.display())
}

fn float_image(pixels: &[[f32; 3]], width: usize) -> FloatImage {
    let channel = |(channel, name): (usize, String)| Channel {
        name,
        values: pixels.iter().map(|pixel| pixel[channel]).collect(),
    };
    FloatImage {
        width,
        height: pixels.len() / width,
        channels: rgb_names("").into_iter().enumerate().map(channel).collect(),
    }
}
