//! KTX 2.0 files as others read them: containers by the crate ktx2, Zstandard by ruzstd, BC6H by bcdec.

use nephroid::export::FloatImage;
use serde_json::Value;

use crate::program::{Sandbox, read_json};

const QUICK: &str = "--density 1e3 --map-resolution";

/// A file taken apart: its sizes, the largest first, as linear values.
struct Texture {
    levels: Vec<(usize, usize, Vec<[f32; 3]>)>,
    about: Vec<(String, String)>,
}

impl Texture {
    fn read(sandbox: &Sandbox, file: &str) -> Self {
        let bytes = std::fs::read(sandbox.path(file)).expect("it was written");
        let reader = ktx2::Reader::new(&bytes[..]).expect("it is a KTX 2.0 file");
        let header = reader.header();
        assert_eq!(
            header.supercompression_scheme,
            Some(ktx2::SupercompressionScheme::Zstandard)
        );
        assert_eq!(
            (header.face_count, header.layer_count, header.pixel_depth),
            (1, 0, 0)
        );
        assert_eq!(reader.transfer_function(), Some(ktx2::TransferFunction::Linear));
        let size = (header.pixel_width as usize, header.pixel_height as usize);
        let levels = reader.levels().enumerate().map(|(level, stored)| {
            let (width, height) = ((size.0 >> level).max(1), (size.1 >> level).max(1));
            let mut data = Vec::with_capacity(stored.uncompressed_byte_length as usize);
            let mut decoder = ruzstd::decoding::FrameDecoder::new();
            decoder
                .decode_all_to_vec(stored.data, &mut data)
                .expect("it is Zstandard");
            assert_eq!(data.len() as u64, stored.uncompressed_byte_length);
            let values = match header.format {
                Some(ktx2::Format::E5B9G9R9_UFLOAT_PACK32) => shared_exponents(&data),
                Some(ktx2::Format::BC6H_UFLOAT_BLOCK) => blocks(&data, width, height),
                other => panic!("{other:?}"),
            };
            assert_eq!(values.len(), width * height);
            (width, height, values)
        });
        let text = |value: &[u8]| String::from_utf8_lossy(value).trim_end_matches('\0').to_owned();
        Self {
            levels: levels.collect(),
            about: reader
                .key_value_data()
                .map(|(key, value)| (key.to_owned(), text(value)))
                .collect(),
        }
    }

    fn about(&self, key: &str) -> Option<&str> {
        let found = self.about.iter().find(|(known, _)| known == key);
        found.map(|(_, value)| value.as_str())
    }
}

/// As Vulkan decodes E5B9G9R9: mantissa · 2^(exponent − 15 − 9).
fn shared_exponents(data: &[u8]) -> Vec<[f32; 3]> {
    let words = data
        .as_chunks::<4>()
        .0
        .iter()
        .map(|word| u32::from_le_bytes(*word));
    words
        .map(|word| {
            [0, 9, 18].map(|first| ((word >> first) & 511) as f32 * f32::exp2((word >> 27) as f32 - 24.0))
        })
        .collect()
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

fn baked(sandbox: &Sandbox, folder: &str) -> Vec<[f32; 3]> {
    let manifest = sandbox.manifest(folder);
    let file = manifest["maps"][0]["file"].as_str().expect("a name");
    let image = FloatImage::read(&sandbox.path(folder).join(file)).expect("it can be read");
    image.rgb("").expect("it has a sum")
}

fn texture_entry(sandbox: &Sandbox, folder: &str) -> Value {
    read_json(&sandbox.path(folder).join("index.json"))["textures"][0].clone()
}

/// √(mean((a − b)²)) / mean(b) of the green channel.
fn relative_rmse(a: &[[f32; 3]], b: &[[f32; 3]]) -> f64 {
    let squares = a.iter().zip(b).map(|(a, b)| f64::from(a[1] - b[1]).powi(2));
    let mean = b.iter().map(|b| f64::from(b[1])).sum::<f64>() / b.len() as f64;
    (squares.sum::<f64>() / b.len() as f64).sqrt() / mean
}

#[test]
fn shared_exponents_hold_light_within_their_steps() {
    let sandbox = Sandbox::new();
    sandbox.succeed(&format!("bake builtin:ring -o out {QUICK} 61x34"));
    let wanted = baked(&sandbox, "out");
    for (units, factor, stops) in [("E", 1.0, 0.0), ("lux", 683.0, -3.5)] {
        sandbox.succeed(&format!(
            "export out --format ktx2 --units {units} --exposure {stops} -o t"
        ));
        let texture = Texture::read(&sandbox, "t/0000_floor.ktx2");
        assert_eq!(texture.levels.len(), 1);
        let (width, height, values) = &texture.levels[0];
        assert_eq!((*width, *height), (61, 34));
        for (found, wanted) in values.iter().zip(&wanted) {
            let wanted = wanted.map(|value| value * factor * f32::exp2(stops));
            let largest = wanted.iter().fold(0.0_f32, |a, b| a.max(*b));
            for (found, wanted) in found.iter().zip(wanted) {
                let bound = (largest / 512.0).max(f32::exp2(-25.0)) * 1.0001;
                assert!((found - wanted.max(0.0)).abs() <= bound, "{found} of {wanted}");
            }
        }
        assert_eq!(texture.about("KTXorientation"), Some("rd"));
        assert!(
            texture
                .about("KTXwriter")
                .is_some_and(|writer| writer.starts_with("nephroid"))
        );
        assert_eq!(
            texture.about("nephroid.exposure_stops"),
            Some(&*stops.to_string())
        );
        assert_eq!(
            texture.about("nephroid.unit"),
            Some(if units == "E" { "W/m^2" } else { "lx" })
        );
    }
}

#[test]
fn blocks_hold_light_as_exactly_as_is_told() {
    let sandbox = Sandbox::new();
    for (scene, size) in [("ring", "128"), ("ball", "94x61"), ("pool", "128")] {
        sandbox.succeed(&format!("bake builtin:{scene} -o out --force {QUICK} {size}"));
        sandbox.succeed("export out --format ktx2 --packing bc6h -o t");
        let texture = Texture::read(
            &sandbox,
            &format!(
                "t/{}",
                texture_entry(&sandbox, "t")["file"].as_str().expect("a name")
            ),
        );
        let (_, _, values) = &texture.levels[0];
        let off = relative_rmse(values, &baked(&sandbox, "out"));
        let told = texture_entry(&sandbox, "t")["lost"]["relative_rmse"]
            .as_f64()
            .expect("a number");
        let light = baked(&sandbox, "out");
        let differences = values.iter().zip(&light).map(|(a, b)| (a[1] - b[1]).abs());
        let share = differences.sum::<f32>() / light.iter().map(|texel| texel[1]).sum::<f32>();
        assert!((1e-4..0.05).contains(&share), "{scene}: {share}");
        assert!(
            (off - told).abs() < 0.3 * told,
            "{scene}: {off} where {told} is told"
        );
    }
}

#[test]
fn sizes_go_down_to_one_texel_and_hold_the_same_light() {
    let sandbox = Sandbox::new();
    sandbox.succeed(&format!("bake builtin:ring -o out {QUICK} 50x36"));
    for packing in ["rgb9e5", "bc6h"] {
        let line = format!("export out --format ktx2 --mips --packing {packing} -o t --json");
        let told = sandbox.succeed(&line).json()["textures"][0]["levels"].clone();
        let texture = Texture::read(&sandbox, "t/0000_floor.ktx2");
        let sizes: Vec<_> = texture
            .levels
            .iter()
            .map(|(width, height, _)| (*width, *height))
            .collect();
        assert_eq!(sizes, [(50, 36), (25, 18), (12, 9), (6, 4), (3, 2), (1, 1)]);
        assert_eq!(told, sizes.len());
        let mean =
            |values: &[[f32; 3]]| values.iter().map(|value| value[1]).sum::<f32>() / values.len() as f32;
        let whole = mean(&baked(&sandbox, "out"));
        for (width, _, values) in &texture.levels {
            let share = mean(values) / whole;
            assert!((share - 1.0).abs() < 0.02, "{packing}, {width} texels: {share}");
        }
    }
}

#[test]
fn what_graphics_cards_cannot_hold_is_refused() {
    let sandbox = Sandbox::new();
    sandbox.succeed(&format!("bake builtin:ring -o out {QUICK} 32"));
    for (packing, most) in [("rgb9e5", "65408"), ("bc6h", "65504")] {
        let run = sandbox.run(&format!(
            "export out --format ktx2 --packing {packing} --exposure 30"
        ));
        run.failed_in_one_sentence(1, &["0000_floor.ktx2", most, "--exposure"]);
    }
    for (line, word) in [
        ("export out --format ktx2 --bits 16", "--bits"),
        ("export out --format ktx2 --cut 1%", "--cut"),
        ("export out --format exr --mips", "--mips"),
        ("export out --format exr --packing bc6h", "--packing"),
        ("export out --mips", "--mips"),
    ] {
        sandbox.run(line).failed_in_one_sentence(2, &[word]);
    }
    assert_eq!(sandbox.files("."), ["out"]);
    assert_eq!(sandbox.files("out"), ["manifest.json", "maps"]);
}
