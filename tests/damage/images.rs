//! Environments and textures.

use std::io::Cursor;

use nephroid::scene::{LoadOptions, environment};
use serde_json::json;

use crate::glb::{Glb, load_bytes};
use crate::mutate::{Damage, effort};
use crate::support::sound::scene_fault;
use crate::watch::Tally;

/// Most memory that an environment or a scene may take by itself [bytes], and in all while it is read.
const LIMIT_BYTES: u64 = 16 << 20;
const MOST_BYTES: usize = 3 * LIMIT_BYTES as usize;

/// A picture of 24 × 12 pixels in a format.
fn picture(format: image::ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let pixel = |x: u32, y: u32| [x as u8 * 9, y as u8 * 20, (x ^ y) as u8];
    let written = if matches!(format, image::ImageFormat::Hdr | image::ImageFormat::OpenExr) {
        let pixel = |x, y| image::Rgb(pixel(x, y).map(|value| f32::from(value) / 60.0));
        image::Rgb32FImage::from_fn(24, 12, pixel).write_to(&mut bytes, format)
    } else {
        image::RgbImage::from_fn(24, 12, |x, y| image::Rgb(pixel(x, y))).write_to(&mut bytes, format)
    };
    written.expect("a picture");
    bytes.into_inner()
}

#[test]
fn environments() {
    let _alone = crate::watch::alone();
    let tally = Tally::default();
    let folder = tempfile::tempdir().expect("temporary folder");
    let path = folder.path().join("sky");
    for (name, format) in [
        ("sky.hdr", image::ImageFormat::Hdr),
        ("sky.exr", image::ImageFormat::OpenExr),
    ] {
        let whole = picture(format);
        for number in 0..1_500 * effort() {
            let mut damage = Damage::to(name, number);
            let mut bytes = whole.clone();
            damage.bytes(&mut bytes);
            std::fs::write(&path, &bytes).expect("can be written");
            let read = || environment::read(&path, LIMIT_BYTES);
            if let Some(sky) = tally.watch((&format!("{number}-{name}"), &bytes), MOST_BYTES, read) {
                assert!(sky.total_w_per_m2().is_finite(), "{name}, {number}");
            }
        }
    }
    println!("environments: {tally:?}");
    assert!(tally.taken.get() > 100 && tally.refused.get() > 100, "{tally:?}");
}

#[test]
fn skies_that_only_claim_to_be_large() {
    let _alone = crate::watch::alone();
    let tally = Tally::default();
    let folder = tempfile::tempdir().expect("temporary folder");
    let path = folder.path().join("sky");
    for (width, height) in [
        (16_384_u64, 16_384_u64),
        (100_000, 2),
        (4_294_967_295, 4_294_967_295),
    ] {
        let bytes =
            format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\nabcd").into_bytes();
        std::fs::write(&path, &bytes).expect("can be written");
        tally.watch(("large.hdr", &bytes), MOST_BYTES, || {
            environment::read(&path, LIMIT_BYTES)
        });
    }
    assert_eq!(tally.refused.get(), 3, "{tally:?}");
}

#[test]
fn textures() {
    let _alone = crate::watch::alone();
    let tally = Tally::default();
    let options = LoadOptions {
        memory_limit_bytes: LIMIT_BYTES,
        ..LoadOptions::default()
    };
    let formats = [
        ("png", image::ImageFormat::Png),
        ("jpg", image::ImageFormat::Jpeg),
        ("webp", image::ImageFormat::WebP),
    ];
    let mut grey = 0;
    let encodable = |format: image::ImageFormat| {
        format != image::ImageFormat::Jpeg || image::ImageFormat::Jpeg.writing_enabled()
    };
    for (name, format) in formats.into_iter().filter(|(_, format)| encodable(*format)) {
        let whole = picture(format);
        for number in 0..500 * effort() {
            let mut bytes = whole.clone();
            Damage::to(name, number).bytes(&mut bytes);
            let texture = json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } });
            let mut file = Glb::tetrahedron().with_material(texture);
            let view = file.push_view(&bytes);
            file.push("images", json!({ "bufferView": view, "mimeType": "image/png" }));
            file.push("textures", json!({ "source": 0 }));
            let file = file.bytes();
            let kept = format!("{number}-{name}.glb");
            let scene = tally.watch((&kept, &file), MOST_BYTES, || load_bytes(&file, &options));
            if let Some(scene) = scene {
                assert_eq!(scene_fault(&scene), None, "{kept}");
                grey += u32::from(scene.warnings.iter().any(|warning| warning.what.contains("grey")));
            }
        }
    }
    println!("textures: {tally:?}, {grey} replaced by grey");
    // One bad image costs one texture and not the scene.
    assert!(tally.taken.get() > 900 && grey > 200, "{tally:?}, {grey}");
}
