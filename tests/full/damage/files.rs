//! Files that are read by themselves: environments, textures, maps, camera paths, tables of spectra.

use std::cell::Cell;
use std::io::Cursor;
use std::path::Path;

use image::ImageFormat;
use nephroid::error::Result;
use nephroid::export::float_image::{Channel, FloatImage};
use nephroid::optics::spectrum::csv::read_lamp;
use nephroid::scene::{Camera, CameraPath, LoadOptions, environment};
use serde_json::json;

use super::mutate::Damage;
use super::watch::{Tally, Way, alone, attack};
use support::glb::{Glb, load_bytes};
use support::sound::scene_fault;

const MIB: usize = 1 << 20;

/// Most memory that an environment or a scene may take by itself [bytes].
const LIMIT_BYTES: u64 = 16 << 20;

/// A picture of 24 × 12 pixels in a format.
fn picture(format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let pixel = |x: u32, y: u32| [x as u8 * 9, y as u8 * 20, (x ^ y) as u8];
    let written = if matches!(format, ImageFormat::Hdr | ImageFormat::OpenExr) {
        let pixel = |x, y| image::Rgb(pixel(x, y).map(|value| f32::from(value) / 60.0));
        image::Rgb32FImage::from_fn(24, 12, pixel).write_to(&mut bytes, format)
    } else {
        image::RgbImage::from_fn(24, 12, |x, y| image::Rgb(pixel(x, y))).write_to(&mut bytes, format)
    };
    written.expect("a picture");
    bytes.into_inner()
}

/// A map of 8 × 8 texels with forty layers.
fn exr_map() -> Vec<u8> {
    let layer = |number| Channel {
        name: format!("layer{number}.Y"),
        values: vec![1.0; 64],
    };
    let channels = (0..40).map(layer).collect();
    let image = FloatImage {
        width: 8,
        height: 8,
        channels,
    };
    nephroid::export::exr::encode(image, "", "a.exr").expect("an image")
}

/// Hands bytes to something that reads a file.
fn by_file<T>(read: impl Fn(&Path) -> Result<T>) -> impl Fn(&[u8]) -> Result<T> {
    let file = tempfile::NamedTempFile::new().expect("a temporary file");
    move |bytes| {
        std::fs::write(file.path(), bytes).expect("can be written");
        read(file.path())
    }
}

#[test]
fn environments() {
    alone(|| {
        let skies = [
            ("sky.hdr", picture(ImageFormat::Hdr), Damage::bytes as Way),
            ("sky.exr", picture(ImageFormat::OpenExr), Damage::bytes),
        ];
        let tally = Tally::default();
        let read = by_file(|path| environment::read(path, LIMIT_BYTES));
        attack(&tally, (1500, 48 * MIB), &skies, read, |sky| {
            let total = sky.total_w_per_m2();
            (!total.is_finite()).then(|| format!("{total} W/m²"))
        });
        tally.expect(100, 100);
    });
}

#[test]
fn textures() {
    alone(|| {
        let formats = [
            ("png", ImageFormat::Png),
            ("jpg", ImageFormat::Jpeg),
            ("webp", ImageFormat::WebP),
        ];
        let textures = formats.into_iter().filter(|(_, format)| format.writing_enabled());
        let textures: Vec<_> = textures
            .map(|(name, format)| (name, picture(format), Damage::bytes as Way))
            .collect();
        let options = LoadOptions {
            memory_limit_bytes: LIMIT_BYTES,
            ..LoadOptions::default()
        };
        let read = |bytes: &[u8]| {
            let material = json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } });
            let mut file = Glb::tetrahedron().with_material(material);
            let view = file.push_view(bytes);
            file.push("images", json!({ "bufferView": view, "mimeType": "image/png" }));
            file.push("textures", json!({ "source": 0 }));
            load_bytes(&file.bytes(), &options)
        };
        let (tally, grey) = (Tally::default(), Cell::new(0));
        attack(&tally, (500, 48 * MIB), &textures, read, |scene| {
            let is_grey = scene.warnings.iter().any(|warning| warning.what.contains("grey"));
            grey.set(grey.get() + u32::from(is_grey));
            scene_fault(&scene)
        });
        // One bad image costs one texture and not the scene.
        assert!(tally.taken.get() > 900 && grey.get() > 200, "{tally:?}, {grey:?}");
    });
}

#[test]
fn single_maps() {
    alone(|| {
        let pfm = (0..16 * 16 * 3).flat_map(|value| (value as f32).to_le_bytes());
        let pfm = b"PF\n16 16\n-1.0\n".iter().copied().chain(pfm).collect();
        let maps = [
            ("a.exr", exr_map(), Damage::head as Way),
            ("a.pfm", pfm, Damage::head),
        ];
        let tally = Tally::default();
        attack(
            &tally,
            (1500, 32 * MIB),
            &maps,
            by_file(FloatImage::read),
            |image| {
                let texels = image.width * image.height;
                let torn = image
                    .channels
                    .iter()
                    .find(|channel| channel.values.len() != texels);
                torn.map(|channel| format!("{} of another size", channel.name))
            },
        );
        tally.expect(50, 50);
    });
}

#[test]
fn camera_paths() {
    alone(|| {
        let key = |x: f64| json!({ "position_m": [x, 1.0, 3.0], "target_m": [0.0, 0.5, -x] });
        let path = json!({ "frames": 30, "vertical_fov_deg": 50, "keys": [key(0.0), key(1.5), key(-2.0)] });
        let text = path.to_string().into_bytes();
        let paths = [
            ("walk", text.clone(), Damage::document as Way),
            ("walk", text, Damage::text),
        ];
        let is_sound =
            |camera: &Camera| camera.position.is_finite() && (camera.forward.length() - 1.0).abs() < 1e-12;
        let tally = Tally::default();
        let read = |bytes: &[u8]| CameraPath::parse(bytes, "walk.json");
        attack(&tally, (1000, 16 * MIB), &paths, read, |path| {
            let cameras = path.cameras(glam::DVec3::ZERO);
            let is_path = !cameras.is_empty() && cameras.iter().all(is_sound);
            (!is_path).then(|| format!("{cameras:?}"))
        });
        tally.expect(100, 100);
    });
}

#[test]
fn tables_of_spectra() {
    alone(|| {
        let row = |row: u32| format!("{}, {:.3}\n", 380 + 10 * row, f64::from(row % 7) * 0.25);
        let table = "# a lamp\nnm, W/nm\n".to_owned() + &(0..40).map(row).collect::<String>();
        let tally = Tally::default();
        let read = |bytes: &[u8]| {
            let lamp = read_lamp(&String::from_utf8_lossy(bytes));
            let lamp = lamp.and_then(|lamp| lamp.to_luminous_equivalent(1.0));
            lamp.map_err(|error| error.at("lamp.csv"))
        };
        let tables = [("lamp.csv", table.into_bytes(), Damage::text as Way)];
        attack(&tally, (2000, 16 * MIB), &tables, read, |lamp| {
            let colour = lamp.xyz().to_linear_srgb();
            let is_one = colour.is_finite() && (colour.luminance() - 1.0).abs() < 1e-9;
            (!is_one).then(|| format!("{colour:?} of luminance {}", colour.luminance()))
        });
        tally.expect(100, 100);
    });
}

/// A header of some hundred bytes that claims gigabytes.
#[test]
fn stated_sizes_take_no_memory() {
    alone(|| {
        let tally = Tally::default();
        let read = by_file(|path| environment::read(path, LIMIT_BYTES));
        for (width, height) in [
            (16_384_u64, 16_384_u64),
            (100_000, 2),
            (4_294_967_295, 4_294_967_295),
        ] {
            let header = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\nabcd");
            let input = ("large.hdr", header.as_bytes());
            tally.watch(input, 48 * MIB, || read(input.1));
        }
        let read = by_file(FloatImage::read);
        for side in [100_i32, 2048, 16384, 16385, i32::MAX] {
            let mut exr = exr_map();
            for window in [&b"dataWindow\0box2i\0"[..], b"displayWindow\0box2i\0"] {
                let at = exr.windows(window.len()).position(|bytes| bytes == window);
                let corner = at.expect("it has one") + window.len() + 4 + 8;
                for coordinate in [corner, corner + 4] {
                    exr[coordinate..coordinate + 4].copy_from_slice(&(side - 1).to_le_bytes());
                }
            }
            let pfm = format!("PF\n{side} {side}\n-1.0\nabcd").into_bytes();
            for (name, bytes) in [("large.exr", exr), ("large.pfm", pfm)] {
                tally.watch((name, &bytes), 32 * MIB, || read(&bytes));
            }
        }
        assert_eq!(tally.refused.get(), 13, "{tally:?}");
    });
}
