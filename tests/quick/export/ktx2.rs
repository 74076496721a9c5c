//! KTX 2.0 textures as others read them: containers by the crate ktx2, Zstandard by ruzstd, BC6H by bcdec.

use nephroid::export::Quantity;
use nephroid::export::textures::index::TextureEntry;
use nephroid::export::textures::{Encoding, Exposure, Packing, TextureOptions};

use super::{Baked, LUMENS_PER_WATT, as_it_is};
use crate::prelude::*;
use support::tools::at;

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
        ..at(1e3, 1)
    };
    Baked::new(built_in(scene), &settings)
}

fn packed(packing: Packing, mips: bool) -> TextureOptions {
    as_it_is(Encoding::Ktx2 { packing, mips })
}

fn export(baked: &Baked, options: TextureOptions) -> (Texture, TextureEntry) {
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
        let (texture, _) = export(&baked, options);
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
        let (texture, entry) = export(&baked, packed(Packing::Bc6h, false));
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
    for packing in [Packing::Rgb9e5, Packing::Bc6h] {
        let (texture, entry) = export(&baked, packed(packing, true));
        let sizes: Vec<_> = texture.levels.iter().map(|(size, _)| *size).collect();
        assert_eq!(sizes, [(50, 36), (25, 18), (12, 9), (6, 4), (3, 2), (1, 1)]);
        assert_eq!(entry.levels, sizes.len());
        for ((width, _), values) in &texture.levels {
            let share = mean(values) / whole;
            assert!((share - 1.0).abs() < 0.02, "{packing:?}, {width} texels: {share}");
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
