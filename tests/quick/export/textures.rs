//! Maps as textures, read by the image crate; and KTX 2.0 as others read it: containers by the crate ktx2, Zstandard by
//! ruzstd, BC6H by bcdec.

use std::f64::consts::FRAC_1_PI;
use std::path::Path;

use image::ImageDecoder as _;
use nephroid::error::ErrorKind;
use nephroid::export::map_set::MapSet;
use nephroid::export::textures::index::{Rectangle, TextureEntry};
use nephroid::export::textures::{
    Content, Encoding, Exposure, Packing, TextureFolder, TextureOptions, TextureReport, Transfer,
};
use nephroid::export::{Quantity, textures};

use super::{Baked, LUMENS_PER_WATT, as_it_is, linear_of_srgb, names, two_lamps};
use crate::prelude::*;
use support::program::read_json;
use support::tools::to;

const FLOAT: Encoding = Encoding::Float;

fn ring() -> Baked {
    Baked::quick(built_in("ring"), &[LayerKind::Caustic])
}

/// Two maps with generated coordinates, of two layers and two lamps.
fn boxes_by_light() -> Baked {
    let settings = BakeSettings {
        layers: vec![LayerKind::Caustic, LayerKind::Direct],
        per_light: true,
        ..to(0.03, 64)
    };
    Baked::new(two_lamps().scene(), &settings)
}

fn texels(file: &Path) -> Vec<[f32; 3]> {
    let image = image::open(file).expect("it is an image").to_rgb32f();
    image.pixels().map(|pixel| pixel.0).collect()
}

fn brightest(values: &[f32; 3]) -> f32 {
    values.iter().fold(0.0, |a, b| a.max(*b))
}

#[test]
fn an_index_says_what_its_files_are() {
    let baked = ring();
    let report = baked.textures(as_it_is(FLOAT), "t").expect("it fits");
    // Bit by bit.
    assert_eq!(texels(&baked.path("t/0000_floor.exr")), baked.light(""));
    let index = read_json(&baked.path("t/index.json"));
    assert_eq!(index, serde_json::to_value(&report.index).expect("it is JSON"));
    let manifest = baked.manifest();
    assert_eq!(index["scene"], manifest["scene"]);
    assert!(
        index["unit"] == "W/m^2" && index["exposure_stops"] == 0.0,
        "{index}"
    );
    let [texture] = &report.index.textures[..] else {
        panic!("one map, one file")
    };
    assert_eq!((texture.width, texture.height), (64, 64));
    assert_eq!(texture.layers, [LayerKind::Caustic]);
    assert!(texture.light.is_none() && texture.lost.relative_rmse == 0.0);
    assert_eq!(texture.maps[0].rectangle, Rectangle::whole((64, 64)));
    for name in ["surface", "node", "primitive", "side", "uv_set", "uv_file"] {
        let told = &index["textures"][0]["maps"][0][name];
        assert_eq!(*told, manifest["maps"][0][name], "{name}");
    }
}

#[test]
fn half_floats_hold_every_unit_and_exposure() {
    let baked = ring();
    let light = baked.light("");
    for (quantity, factor, stops) in [
        (Quantity::Irradiance, 1.0, -2.0),
        (Quantity::IrradianceByPi, FRAC_1_PI, 1.5),
        (Quantity::Illuminance, LUMENS_PER_WATT, -2.0),
        (Quantity::IlluminanceByPi, LUMENS_PER_WATT * FRAC_1_PI, 1.5),
    ] {
        let options = TextureOptions {
            quantity,
            exposure: Exposure::Stops(stops),
            ..as_it_is(Encoding::Half)
        };
        baked.textures(options, "t").expect("it fits");
        let found = texels(&baked.path("t/0000_floor.exr"));
        for (found, wanted) in found.as_flattened().iter().zip(light.as_flattened()) {
            let (found, wanted) = (f64::from(*found), f64::from(*wanted) * factor * stops.exp2());
            // Eleven bits, and steps of 2^-24 below 2^-14.
            let bound = (wanted.abs() * f64::exp2(-11.0) * 1.0001).max(f64::exp2(-25.0));
            assert!(
                (found - wanted).abs() <= bound,
                "{quantity:?}: {found} of {wanted}"
            );
        }
    }
}

#[test]
fn too_bright_light_is_refused_with_advice() {
    let baked = ring();
    let peak = baked.light("").iter().map(brightest).fold(0.0, f32::max);
    let write = |encoding, stops: f64| {
        let exposure = Exposure::Stops(stops);
        baked.textures(with(as_it_is(encoding), |it| it.exposure = exposure), "t")
    };
    let stops = f64::from((65504.0 / peak).log2().ceil());
    let error = write(Encoding::Half, stops).expect_err("too bright");
    says(&error, "0000_floor.exr | 65504 | --bits 32");
    assert_eq!(names(&baked.path(".")), ["out"], "nothing is left");
    let advised = error.remedy.rsplit(' ').next().expect("a number");
    write(Encoding::Half, advised.parse().expect("a number")).expect("as it was advised");
    write(FLOAT, stops).expect("as it was advised");
}

#[test]
fn a_png_says_its_exposure_and_what_is_lost() {
    let baked = ring();
    let light = baked.light("");
    let png = |transfer, quantity, exposure| {
        let options = TextureOptions {
            quantity,
            exposure,
            ..as_it_is(Encoding::Png16 { transfer })
        };
        let report = baked.textures(options, "t").expect("it fits");
        (report.index.exposure_stops, report.index.textures[0].lost)
    };
    for (transfer, marks) in [
        (Transfer::Srgb, &b"sRGB"[..]),
        (Transfer::Linear, b"gAMA\x00\x01\x86\xa0"),
    ] {
        let (stops, lost) = png(transfer, Quantity::Illuminance, Exposure::Cut(0.005));
        let bytes = std::fs::read(baked.path("t/0000_floor.png")).expect("it is there");
        let has = |mark: &[u8]| bytes.windows(mark.len()).any(|window| window == mark);
        assert!(has(marks) && has(b"tEXtUnit\0lx"));
        assert!(stops.fract() == 0.0 && has(format!("tEXtExposure\0{stops} stops").as_bytes()));
        let image = image::load_from_memory(&bytes).expect("it is a PNG");
        assert_eq!(image.color(), image::ColorType::Rgb16);
        let (mut above, mut cut, mut all) = (0, 0.0, 0.0);
        for (pixel, light) in image.to_rgb16().pixels().zip(&light) {
            let wanted = light.map(|value| f64::from(value) * LUMENS_PER_WATT * stops.exp2());
            above += usize::from(wanted.iter().any(|value| *value > 1.0));
            for (code, wanted) in pixel.0.into_iter().zip(wanted) {
                (cut, all) = (cut + (wanted - 1.0).max(0.0), all + wanted);
                let found = match transfer {
                    Transfer::Srgb => linear_of_srgb(code),
                    Transfer::Linear => f64::from(code) / 65535.0,
                };
                let off = (found - wanted.clamp(0.0, 1.0)).abs();
                assert!(off <= 2e-5, "{found} of {wanted}");
            }
        }
        assert_eq!(lost.above_texels, above);
        assert_close(lost.above_share, cut / all, 1e-3, "share that is told");
        assert!(cut / all <= 0.005, "{}", cut / all);
    }
    let lost = |exposure| png(Transfer::Srgb, Quantity::Irradiance, exposure).1;
    assert_eq!(lost(Exposure::Cut(0.0)).above_texels, 0, "nothing may be cut");
    // So it was asked for.
    assert!(lost(Exposure::Stops(20.0)).above_share > 0.9);
}

#[test]
fn a_radiance_file_is_within_its_steps() {
    let baked = ring();
    let light = baked.light("");
    for stops in [0.0, 3.0] {
        let options = TextureOptions {
            exposure: Exposure::Stops(stops),
            ..as_it_is(Encoding::Radiance)
        };
        baked.textures(options, "t").expect("it fits");
        let file = baked.path("t/0000_floor.hdr");
        let bytes = std::fs::read(&file).expect("it is there");
        let decoder = image::codecs::hdr::HdrDecoder::new(&bytes[..]).expect("it is a Radiance file");
        assert_eq!(decoder.dimensions(), (64, 64));
        let stated = decoder.metadata().exposure.unwrap_or(1.0);
        assert_eq!(f64::from(stated), stops.exp2());
        for (found, wanted) in texels(&file).iter().zip(&light) {
            for (found, value) in found.iter().zip(wanted) {
                let off = (found / stated - value).abs();
                assert!(off <= brightest(wanted) / 255.0, "{found} of {value}");
            }
        }
    }
}

fn export(baked: &Baked, content: Content, atlas_side: Option<usize>, folder: &str) -> Vec<TextureEntry> {
    let options = TextureOptions {
        content,
        atlas_side,
        ..as_it_is(FLOAT)
    };
    let TextureReport { index, warnings, .. } = baked.textures(options, folder).expect("it fits");
    assert_eq!(warnings, []);
    index.textures
}

#[test]
fn layers_and_lights_come_apart_and_add_up() {
    let baked = boxes_by_light();
    let read = |folder: &str, entry: &TextureEntry| texels(&baked.path(folder).join(&entry.file));
    let whole = export(&baked, Content::Sum, None, "sum");
    assert_eq!(whole.len(), 2);
    for (content, folder) in [(Content::EachLayer, "layers"), (Content::EachLight, "lights")] {
        let mut parts = export(&baked, content, None, folder);
        for whole in &whole {
            let sum = read("sum", whole);
            assert!(sum.as_flattened().iter().any(|value| *value > 0.0));
            let node = whole.maps[0].node;
            let (own, others) = parts.into_iter().partition(|part| part.maps[0].node == node);
            parts = others;
            let own: Vec<TextureEntry> = own;
            let [a, b] = &own[..] else {
                panic!("{folder}: two parts of each map")
            };
            if content == Content::EachLight {
                let names = [a, b].map(|entry| entry.light.as_deref());
                assert_eq!(names, [Some("lamp"); 2], "of one name, told apart by their files");
            }
            let [a, b] = [a, b].map(|entry| read(folder, entry));
            assert_ne!(a, b);
            let pairs = a.as_flattened().iter().zip(b.as_flattened());
            for ((a, b), sum) in pairs.zip(sum.as_flattened()) {
                let bound = 1e-5 * sum.abs() + 1e-9;
                assert!((a + b - sum).abs() <= bound, "{folder}: {a} and {b} of {sum}");
            }
            // Generated coordinates come along.
            let uv_file = whole.maps[0].uv_file.as_ref().expect("they were generated");
            let [copied, whole] = [folder, "out/maps"]
                .map(|folder| std::fs::read(baked.path(folder).join(uv_file)).expect("it is there"));
            assert_eq!(copied, whole);
        }
        assert!(parts.is_empty());
    }
    let direct = Content::Layer(LayerKind::Direct);
    for entry in export(&baked, direct, None, "one") {
        assert_eq!(entry.layers, [LayerKind::Direct]);
        assert_eq!(read("one", &entry), read("layers", &entry));
    }
    // The back of the mirror has no caustic.
    let mirror = Baked::quick(built_in("mirror"), &[LayerKind::Caustic, LayerKind::Direct]);
    assert_eq!(export(&mirror, Content::Sum, None, "sum").len(), 2);
    assert_eq!(
        export(&mirror, Content::Layer(LayerKind::Caustic), None, "one").len(),
        1
    );
    let indirect = Content::Layer(LayerKind::Indirect);
    for (baked, content, words) in [
        (&baked, indirect, "indirect | --layers"),
        (&ring(), Content::EachLight, "--per-light"),
    ] {
        let options = with(as_it_is(FLOAT), |it| it.content = content);
        says(
            baked.textures(options, "none").expect_err("it is not there"),
            words,
        );
    }
}

#[test]
fn an_atlas_holds_maps_where_its_index_says() {
    let baked = boxes_by_light();
    for content in [Content::Sum, Content::EachLayer, Content::EachLight] {
        let apart = export(&baked, content, None, "apart");
        let together = export(&baked, content, Some(16_384), "together");
        assert_eq!(2 * together.len(), apart.len(), "two maps in each");
        for entry in &together {
            let atlas = texels(&baked.path("together").join(&entry.file));
            // What the name says of the content: `_caustic`, `_lamp-0`, nothing.
            let content = entry.file.trim_start_matches("atlas0");
            for placed in &entry.maps {
                let is_it = |single: &&TextureEntry| {
                    single.maps[0].node == placed.node
                        && single.layers == entry.layers
                        && (content.starts_with('.') || single.file.ends_with(content))
                };
                let single = apart.iter().find(is_it).expect("it is there");
                let Rectangle { x, y, width, height } = placed.rectangle;
                assert_eq!((single.width, single.height), (width, height));
                assert_eq!(single.light, entry.light);
                let own = texels(&baked.path("apart").join(&single.file));
                for row in 0..height + 4 {
                    for column in 0..width + 4 {
                        // Two texels around it go on with those at its border.
                        let inside = |at: usize, side: usize| at.saturating_sub(2).min(side - 1);
                        let wanted = own[inside(row, height) * width + inside(column, width)];
                        let found = atlas[(y + row - 2) * entry.width + x + column - 2];
                        assert_eq!(found, wanted, "{}", entry.file);
                    }
                }
                let uv_file = placed.uv_file.as_ref().expect("they were generated");
                assert!(baked.path("together").join(uv_file).is_file());
            }
        }
    }
    // Smaller ones hold fewer; too small ones none.
    assert_eq!(export(&baked, Content::Sum, Some(70), "small").len(), 2);
    let options = with(as_it_is(FLOAT), |it| it.atlas_side = Some(67));
    let error = baked.textures(options, "none").expect_err("there is no room");
    says(error, "the map of | 64x64 | --atlas");
    assert!(!baked.path("none").exists());
}

#[test]
fn an_export_replaces_its_own_files_alone() {
    let baked = ring();
    let float = as_it_is(FLOAT);
    let each = with(float, |it| it.content = Content::EachLayer);
    let png = as_it_is(Encoding::Png16 {
        transfer: Transfer::Srgb,
    });
    let t = baked.path("t");
    baked.textures(each, "t").expect("it is empty");
    assert_eq!(names(&t), ["0000_floor_caustic.exr", "index.json"]);
    baked.textures(png, "t").expect("they are ours");
    // What was there more is gone.
    assert_eq!(names(&t), ["0000_floor.png", "index.json"]);
    // A folder has the name of a texture.
    std::fs::create_dir(t.join("0000_floor.exr")).expect("it can be made");
    let error = baked.textures(float, "t").expect_err("it is in the way");
    says(error, "0000_floor.exr | folder");
    assert_eq!(names(&t), ["0000_floor.exr", "0000_floor.png", "index.json"]);
    // A cancelled export leaves nothing.
    let maps = baked.path("out");
    let reader = MapSet::open(&maps, &baked.scene).expect("we wrote it");
    let folder = TextureFolder::open(&baked.path("c"), false).expect("it can be written");
    let control = Control::default();
    control.cancel();
    let error = textures::write(&[reader], float, folder, &control).expect_err("it was cancelled");
    assert_eq!(error.kind, ErrorKind::Cancelled);
    assert_eq!(names(&baked.path(".")), ["out", "t"]);
}

type Level = ((usize, usize), Vec<[f32; 3]>);

struct Texture {
    /// The largest first.
    levels: Vec<Level>,
    about: Vec<(String, String)>,
}

impl Texture {
    fn read(bytes: &[u8]) -> Self {
        let reader = ktx2::Reader::new(bytes).expect("it is a KTX 2.0 file");
        let header = reader.header();
        let zstandard = Some(ktx2::SupercompressionScheme::Zstandard);
        assert_eq!(header.supercompression_scheme, zstandard);
        let shape = (header.face_count, header.layer_count, header.pixel_depth);
        assert_eq!(shape, (1, 0, 0));
        assert_eq!(reader.transfer_function(), Some(ktx2::TransferFunction::Linear));
        let size = (header.pixel_width as usize, header.pixel_height as usize);
        let levels = reader.levels().enumerate().map(|(level, stored)| {
            let (width, height) = ((size.0 >> level).max(1), (size.1 >> level).max(1));
            let mut data = Vec::with_capacity(stored.uncompressed_byte_length as usize);
            let mut decoder = ruzstd::decoding::FrameDecoder::new();
            let decoded = decoder.decode_all_to_vec(stored.data, &mut data);
            decoded.expect("it is Zstandard");
            assert_eq!(data.len() as u64, stored.uncompressed_byte_length);
            let values = match header.format {
                Some(ktx2::Format::E5B9G9R9_UFLOAT_PACK32) => shared_exponents(&data),
                Some(ktx2::Format::BC6H_UFLOAT_BLOCK) => blocks(&data, width, height),
                other => panic!("{other:?}"),
            };
            assert_eq!(values.len(), width * height);
            ((width, height), values)
        });
        let text = |value: &[u8]| String::from_utf8_lossy(value).trim_end_matches('\0').to_owned();
        let about = reader
            .key_value_data()
            .map(|(key, value)| (key.to_owned(), text(value)));
        Self {
            levels: levels.collect(),
            about: about.collect(),
        }
    }

    fn about(&self, key: &str) -> &str {
        let found = self.about.iter().find(|(known, _)| known == key);
        &found.unwrap_or_else(|| panic!("no {key}")).1
    }
}

/// As Vulkan decodes E5B9G9R9: mantissa · 2^(exponent − 15 − 9).
fn shared_exponents(data: &[u8]) -> Vec<[f32; 3]> {
    let channels = |word: u32| {
        [0, 9, 18].map(|first| ((word >> first) & 511) as f32 * f32::exp2((word >> 27) as f32 - 24.0))
    };
    let words = data.as_chunks::<4>().0.iter();
    words.map(|word| channels(u32::from_le_bytes(*word))).collect()
}

fn blocks(data: &[u8], width: usize, height: usize) -> Vec<[f32; 3]> {
    let across = width.div_ceil(4);
    let mut values = vec![[0.0; 3]; width * height];
    for (block, bytes) in data.as_chunks::<16>().0.iter().enumerate() {
        let mut texels = [0.0; 48];
        bcdec_rs::bc6h_float(bytes, &mut texels, 12, false);
        for (texel, value) in texels.as_chunks::<3>().0.iter().enumerate() {
            let (column, row) = (block % across * 4 + texel % 4, block / across * 4 + texel / 4);
            if column < width && row < height {
                values[row * width + column] = *value;
            }
        }
    }
    values
}

/// The caustic of a built-in scene on maps of a size.
fn baked(scene: &str, (width, height): (usize, usize)) -> Baked {
    let settings = BakeSettings {
        map_resolution: MapResolution::Fixed { width, height },
        layers: vec![LayerKind::Caustic],
        ..to(0.01, 1)
    };
    Baked::new(built_in(scene), &settings)
}

fn packed(packing: Packing, mips: bool) -> TextureOptions {
    as_it_is(Encoding::Ktx2 { packing, mips })
}

fn first_of(baked: &Baked, options: TextureOptions) -> (Texture, TextureEntry) {
    let report = baked.textures(options, "t").expect("it fits");
    let entry = report.index.textures[0].clone();
    let bytes = std::fs::read(baked.path("t").join(&entry.file)).expect("it was written");
    (Texture::read(&bytes), entry)
}

#[test]
fn shared_exponents_are_within_their_steps() {
    let baked = baked("ring", (61, 34));
    let light = baked.light("");
    for (quantity, unit, factor, stops) in [
        (Quantity::Irradiance, "W/m^2", 1.0, 0.0),
        (Quantity::Illuminance, "lx", LUMENS_PER_WATT, -3.5),
    ] {
        let options = TextureOptions {
            quantity,
            exposure: Exposure::Stops(stops),
            ..packed(Packing::Rgb9e5, false)
        };
        let (texture, _) = first_of(&baked, options);
        let [(size, values)] = &texture.levels[..] else {
            panic!("one size")
        };
        assert_eq!(*size, (61, 34));
        for (found, light) in values.iter().zip(&light) {
            let wanted = light.map(|value| (f64::from(value) * factor * stops.exp2()) as f32);
            let largest = wanted.iter().fold(0.0_f32, |a, b| a.max(*b));
            let bound = (largest / 512.0).max(f32::exp2(-25.0)) * 1.0001;
            for (found, wanted) in found.iter().zip(wanted) {
                assert!((found - wanted.max(0.0)).abs() <= bound, "{found} of {wanted}");
            }
        }
        assert_eq!(texture.about("KTXorientation"), "rd");
        assert!(texture.about("KTXwriter").starts_with("nephroid"));
        assert_eq!(texture.about("nephroid.exposure_stops"), stops.to_string());
        assert_eq!(texture.about("nephroid.unit"), unit);
    }
}

#[test]
fn blocks_are_off_as_much_as_is_told() {
    for (scene, size) in [("ring", (64, 64)), ("ball", (94, 61))] {
        let baked = baked(scene, size);
        let (texture, entry) = first_of(&baked, packed(Packing::Bc6h, false));
        let light = baked.light("");
        let pairs = || texture.levels[0].1.iter().zip(&light);
        let greens = || pairs().map(|(a, b)| (f64::from(a[1]), f64::from(b[1])));
        let all: f64 = greens().map(|(_, light)| light).sum();
        let share = greens().map(|(found, light)| (found - light).abs()).sum::<f64>() / all;
        assert!((1e-4..0.05).contains(&share), "{scene}: {share}");
        let count = light.len() as f64;
        let squares: f64 = greens().map(|(found, light)| (found - light).powi(2)).sum();
        let relative_rmse = (squares / count).sqrt() / (all / count);
        let told = entry.lost.relative_rmse;
        near(relative_rmse, told, 0.3 * told, scene);
    }
}

#[test]
fn sizes_go_down_to_one_texel() {
    let baked = baked("ring", (50, 36));
    let mean = |values: &[[f32; 3]]| values.iter().map(|value| value[1]).sum::<f32>() / values.len() as f32;
    let whole = mean(&baked.light(""));
    // A block of BC6H puts 16 texels on a line between two colours.
    for (packing, bound) in [(Packing::Rgb9e5, 0.01), (Packing::Bc6h, 0.03)] {
        let (texture, entry) = first_of(&baked, packed(packing, true));
        let sizes: Vec<_> = texture.levels.iter().map(|(size, _)| *size).collect();
        assert_eq!(sizes, [(50, 36), (25, 18), (12, 9), (6, 4), (3, 2), (1, 1)]);
        assert_eq!(entry.levels, sizes.len());
        for ((width, _), values) in &texture.levels {
            let share = mean(values) / whole;
            assert!(
                (share - 1.0).abs() < bound,
                "{packing:?}, {width} texels: {share}"
            );
        }
    }
}

#[test]
fn light_beyond_a_packing_is_refused() {
    let baked = baked("ring", (32, 32));
    for (packing, most) in [(Packing::Rgb9e5, "65408"), (Packing::Bc6h, "65504")] {
        let options = with(packed(packing, false), |it| it.exposure = Exposure::Stops(30.0));
        let error = baked.textures(options, "t").expect_err("too bright");
        says(error, &format!("0000_floor.ktx2 | {most} | --exposure"));
        assert!(!baked.path("t").exists(), "nothing is left");
    }
}
