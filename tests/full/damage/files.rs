//! What is read by itself: environments, textures, maps, camera paths, tables of spectra; folders of maps, as `--maps` and
//! `compare` read them, and of shards, as `merge` does; and values of options: every option of `inspect`, with everything
//! that could be typed after it.

use std::cell::Cell;
use std::io::{Cursor, Read};
use std::path::{Path, PathBuf};

use image::ImageFormat;
use nephroid::bake::{Baker, ShardSums};
use nephroid::error::Result;
use nephroid::export::float_image::{Channel, FloatImage};
use nephroid::export::map_folder::MapFolder;
use nephroid::export::map_set::MapSet;
use nephroid::export::shards::{SceneOrigin, ShardFolder, ShardManifest, ShardSet};
use nephroid::light_pass::shard_index::ShardIndex;
use nephroid::optics::spectrum::Spectrum;
use nephroid::optics::spectrum::csv::read_lamp;
use nephroid::scene::{CameraPath, Environment, environment};

use super::mutate::{Damage, Tally, Way, alone, attack, attack_alone, effort};
use support::glb::load_bytes;
use support::prelude::*;
use support::program::{Run, Sandbox};
use support::sound::scene_fault;
use support::tools::{bake, builtin_scene, photons, set, to};

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
    let skies = [
        ("sky.hdr", picture(ImageFormat::Hdr), Damage::bytes as Way),
        ("sky.exr", picture(ImageFormat::OpenExr), Damage::bytes),
    ];
    let read = by_file(|path| environment::read(path, LIMIT_BYTES));
    let fault = |sky: Environment| {
        let total = sky.total_w_per_m2();
        (!total.is_finite()).then(|| format!("{total} W/m²"))
    };
    attack_alone((1500, 48 * MIB), &skies, read, fault, (100, 100));
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
            let image = json!({ "mimeType": "image/png" });
            let file = Glb::tetrahedron().with_texture(bytes, image, json!({ "source": 0 }));
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
    let pfm = (0..16 * 16 * 3).flat_map(|value| (value as f32).to_le_bytes());
    let pfm = b"PF\n16 16\n-1.0\n".iter().copied().chain(pfm).collect();
    let maps = [
        ("a.exr", exr_map(), Damage::head as Way),
        ("a.pfm", pfm, Damage::head),
    ];
    let fault = |image: FloatImage| {
        let (texels, mut channels) = (image.width * image.height, image.channels.iter());
        let torn = channels.find(|channel| channel.values.len() != texels);
        torn.map(|channel| format!("{} of another size", channel.name))
    };
    let read = by_file(FloatImage::read);
    attack_alone((1500, 32 * MIB), &maps, read, fault, (50, 50));
}

#[test]
fn camera_paths() {
    let key = |x: f64| json!({ "position_m": [x, 1.0, 3.0], "target_m": [0.0, 0.5, -x] });
    let path = json!({ "frames": 30, "vertical_fov_deg": 50, "keys": [key(0.0), key(1.5), key(-2.0)] });
    let text = path.to_string().into_bytes();
    let paths = [
        ("walk", text.clone(), Damage::document as Way),
        ("walk", text, Damage::text),
    ];
    let is_sound =
        |camera: &Camera| camera.position.is_finite() && (camera.forward.length() - 1.0).abs() < 1e-12;
    let read = |bytes: &[u8]| CameraPath::parse(bytes, "walk.json");
    let fault = |path: CameraPath| {
        let cameras = path.cameras(DVec3::ZERO);
        let is_path = !cameras.is_empty() && cameras.iter().all(is_sound);
        (!is_path).then(|| format!("{cameras:?}"))
    };
    attack_alone((1000, 16 * MIB), &paths, read, fault, (100, 100));
}

#[test]
fn tables_of_spectra() {
    let row = |row: u32| format!("{}, {:.3}\n", 380 + 10 * row, f64::from(row % 7) * 0.25);
    let table = "# a lamp\nnm, W/nm\n".to_owned() + &(0..40).map(row).collect::<String>();
    let read = |bytes: &[u8]| {
        let lamp = read_lamp(&String::from_utf8_lossy(bytes));
        let lamp = lamp.and_then(|lamp| lamp.to_luminous_equivalent(1.0));
        lamp.map_err(|error| error.at("lamp.csv"))
    };
    let tables = [("lamp.csv", table.into_bytes(), Damage::text as Way)];
    let fault = |lamp: Spectrum| {
        let colour = lamp.xyz().to_linear_srgb();
        let is_one = colour.is_finite() && (colour.luminance() - 1.0).abs() < 1e-9;
        (!is_one).then(|| format!("{colour:?} of luminance {}", colour.luminance()))
    };
    attack_alone((2000, 16 * MIB), &tables, read, fault, (100, 100));
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

/// Memory that reading or merging so little may take [bytes].
const MAX_BYTES: usize = 32 << 20;

/// Damages one file of a folder after the other, so often each, and reads the folder.
fn attack_files<T>(
    (name, files): (&str, &[PathBuf]),
    times: impl Fn(&Path) -> usize,
    tally: &Tally,
    read: impl Fn() -> Result<T>,
    fault: impl Fn(T) -> Option<String>,
) {
    assert_eq!(read().map(&fault), Ok(None), "nothing is damaged yet");
    for file in files {
        let whole = std::fs::read(file).expect("it was written");
        let is_json = file.extension().is_some_and(|kind| kind == "json");
        let damage = if is_json {
            Damage::document
        } else {
            Damage::head as Way
        };
        let name = format!("{name}-{}", file.file_name().expect("a name").display());
        let read = |bytes: &[u8]| {
            std::fs::write(file, bytes).expect("can be written");
            read()
        };
        let subjects = [(name.as_str(), whole.clone(), damage)];
        attack(tally, (times(file), MAX_BYTES), &subjects, read, &fault);
        std::fs::write(file, whole).expect("can be written");
    }
}

/// Where a map that was read is none.
fn map_fault(map: &IlluminationMap, scene: &Scene) -> Option<String> {
    let texels = map.chart.texel_count();
    let is_light = |value: &f32| value.is_finite() && *value >= 0.0;
    let is_whole = |values: &[[f32; 3]]| values.len() == texels && values.as_flattened().iter().all(is_light);
    let layers = map.layers.iter().all(|layer| is_whole(&layer.irradiance));
    let is_error = |error: &Vec<f32>| error.len() == texels && error.iter().all(is_light);
    let errors = map.error.as_ref().is_none_or(is_error);
    let estimate = map.estimated_relative_rmse;
    let estimate = estimate.is_none_or(|error| error.is_finite() && error >= 0.0);
    let object = map.chart.object() < scene.objects.len();
    (!(layers && errors && estimate && object))
        .then(|| format!("layers {layers}, errors {errors}, estimate {estimate}, object {object}"))
}

#[test]
fn maps() {
    alone(|| {
        let tally = Tally::default();
        for name in ["mirror", "showroom"] {
            let scene = builtin_scene(name);
            let folder = tempfile::tempdir().expect("temporary folder");
            let layers = vec![LayerKind::Caustic, LayerKind::Direct];
            let settings = set(to(0.05, 16), |s| s.layers = layers);
            let result = bake(scene.clone(), &settings);
            let written = MapFolder::open(folder.path(), false).expect("writable");
            written.write(&scene, &settings, &result).expect("writable");
            let maps = std::fs::read_dir(folder.path().join("maps")).expect("it was made");
            let mut files: Vec<PathBuf> = maps.map(|entry| entry.expect("listed").path()).collect();
            files.sort();
            files.push(folder.path().join("manifest.json"));
            let count = files.len();
            // The manifest leads to everything else.
            let times = |file: &Path| {
                if file.ends_with("manifest.json") {
                    20
                } else {
                    20_usize.div_ceil(count)
                }
            };
            let read = || MapSet::open(folder.path(), &scene)?.read_all();
            assert!(read().is_ok_and(|maps| !maps.is_empty()));
            attack_files((name, &files), times, &tally, read, |maps| {
                maps.iter().find_map(|map| map_fault(map, &scene))
            });
        }
        tally.expect(3, 3);
    });
}

/// The first value of a bake that is no number, if there is one.
pub fn result_fault(result: &Bake) -> Option<String> {
    let layers = result.maps.iter().flat_map(|map| &map.layers);
    let values = layers.flat_map(|layer| layer.irradiance.as_flattened());
    let errors = result.maps.iter().filter_map(|map| map.error.as_ref()).flatten();
    let fault = values.chain(errors).find(|value| !value.is_finite());
    fault.map(|value| format!("{value} in a map"))
}

/// A bake in two shards, each in its folder.
struct Shards {
    scene: Arc<Scene>,
    settings: BakeSettings,
    around: tempfile::TempDir,
    sums: Vec<(ShardIndex, ShardSums)>,
}

impl Shards {
    fn bake() -> Self {
        let (scene, settings) = (Arc::new(builtin_scene("mirror")), photons(1e4, 16));
        let shard = |number| {
            let share = ShardIndex::new(number, 2).expect("one of two");
            let mut session = Baker::new(scene.clone()).expect("a session");
            let sums = session.bake_shard(&settings, share, &(), &Control::default());
            (share, sums.expect("a shard"))
        };
        let sums = [1, 2].map(shard).into();
        let around = tempfile::tempdir().expect("temporary folder");
        let shards = Self {
            scene,
            settings,
            around,
            sums,
        };
        shards
            .sums
            .iter()
            .for_each(|(share, sums)| shards.write(*share, sums));
        shards
    }

    fn folder(&self, share: ShardIndex) -> PathBuf {
        self.around.path().join(share.number().to_string())
    }

    /// With checksums that are right, whatever the sums are.
    fn write(&self, share: ShardIndex, sums: &ShardSums) {
        let origin = SceneOrigin {
            source: self.scene.source.clone(),
            default_light: false,
            solid_glass: false,
            environment: None,
        };
        let manifest = ShardManifest::new(&self.scene, origin, &self.settings, share, sums);
        let folder = ShardFolder::open(&self.folder(share), share, false).expect("writable");
        folder.write(&manifest, sums).expect("writable");
    }

    fn read(&self, memory_bytes: u64) -> Result<Bake> {
        let folders: Vec<PathBuf> = self.sums.iter().map(|(share, _)| self.folder(*share)).collect();
        let shards = ShardSet::open(&folders)?;
        shards.check_scene(&self.scene)?;
        let settings = shards.manifest().settings.clone();
        let settings = set(settings, |s| s.memory_bytes = memory_bytes);
        let mut session = Baker::new(self.scene.clone())?;
        session.merge(&settings, Box::new(shards), &(), &Control::default())
    }

    /// The same after a pass of the first shard was replaced by what a reader gives.
    fn read_with(&self, pass: usize, bytes: impl Read, memory_bytes: u64) -> Result<Bake> {
        let (share, mut sums) = self.sums[0].clone();
        let mut encoder = zstd::stream::Encoder::new(Vec::new(), 1).expect("it can begin");
        encoder.include_checksum(true).expect("a checksum");
        std::io::copy(&mut { bytes }, &mut encoder).expect("in memory");
        sums.passes[pass] = encoder.finish().expect("in memory");
        self.write(share, &sums);
        self.read(memory_bytes)
    }
}

#[test]
fn shards_of_a_bake() {
    alone(|| {
        let shards = Shards::bake();
        let files = ["shard.json", "sums.bin"].map(|file| shards.folder(shards.sums[0].0).join(file));
        let (tally, read) = (Tally::default(), || shards.read(1 << 30));
        attack_files(
            ("shards", &files),
            |_| 30,
            &tally,
            read,
            |result| result_fault(&result),
        );
        tally.expect(0, 20);
    });
}

#[test]
fn sums_behind_right_checksums() {
    alone(|| {
        let shards = Shards::bake();
        let tally = Tally::default();
        let passes = &shards.sums[0].1.passes;
        for (pass, packed) in passes.iter().enumerate() {
            let unpacked = zstd::stream::decode_all(&packed[..]).expect("whole");
            let sums = [("sums", unpacked, Damage::head as Way)];
            let bounds = (60_usize.div_ceil(passes.len()), MAX_BYTES);
            let read = |bytes: &[u8]| shards.read_with(pass, bytes, 1 << 30);
            attack(&tally, bounds, &sums, read, |result| result_fault(&result));
        }
        tally.expect(3, 10);
    });
}

#[test]
fn small_file_that_unpacks_to_a_large_one() {
    alone(|| {
        let shards = Shards::bake();
        let tally = Tally::default();
        for byte in [0, 0x01, 0x7f] {
            let read = || shards.read_with(0, std::io::repeat(byte).take(1 << 28), 8 << 20);
            tally.watch((&format!("{byte}-bomb"), &[]), MAX_BYTES, read);
        }
        assert_eq!(tally.refused.get(), 3, "{tally:?}");
    });
}

const OPTIONS: &str = "--preset --estimator --density --max-error --max-time --rays --sigma --kernel \
    --kernel-sampling --footprint --item-buffer --map-resolution --max-depth --branch-threshold --layers --effects --seed \
    --memory --threads --environment --log --solid-glass --per-light";

const VALUES: &str = "| |0|-0|-1|1|2|3.5|64|1e3|1e-320|1e308|1e309|-1e309|nan|NaN|inf|-inf|infinity|18446744073709551616|\
    99999999999999999999999999|0x10|1_000|1,5|1,,2|,|auto|adaptive|on|refraction=on|refraction=|=|64x64|0x0|\
    16384x16384|%|200%|5sx|\u{661}\u{662}|\u{1f4a1}";

/// What is wrong with how a run ended, if anything is: it succeeds, or fails with one line on stderr that says what.
fn ending_fault(run: &Run) -> Option<String> {
    let errors: Vec<&str> = run
        .stderr
        .lines()
        .filter(|line| line.starts_with("error: "))
        .collect();
    let is_fair = match run.code {
        0 => errors.is_empty() && !run.stdout.is_empty(),
        1 | 2 => matches!(errors[..], [sentence] if sentence.contains("; ")) && run.stdout.is_empty(),
        _ => false,
    };
    (!is_fair).then(|| format!("exit {}, {:?}", run.code, run.stderr))
}

#[test]
fn values_are_taken_or_refused_in_one_sentence() {
    let sandbox = Sandbox::new();
    let [options, values] =
        [(OPTIONS, ' '), (VALUES, '|')].map(|(all, by)| all.split(by).collect::<Vec<_>>());
    let (mut taken, mut refused) = (0, 0);
    for number in 0..60 * effort() {
        let mut damage = Damage::to("values", number);
        let mut arguments = vec!["inspect", "builtin:mirror", "--no-cache"];
        for _ in 0..1 + damage.below(4) / 3 {
            arguments.extend([*damage.one_of(&options), *damage.one_of(&values)]);
        }
        let output = sandbox.command(&arguments).output().expect("the program starts");
        assert!(
            output.status.code().is_some(),
            "{arguments:?} was killed: {:?}",
            output.status
        );
        let run = Run::from(output);
        assert_eq!(ending_fault(&run), None, "{arguments:?}");
        if run.code == 0 { taken += 1 } else { refused += 1 }
    }
    assert!(taken >= 1 && refused >= 20, "{taken} taken, {refused} refused");
}
