//! Light by wavelength: a prism's spectrum against exact rays, and laws that glass and lamps keep.

use std::sync::Arc;

use glam::DVec3;
use nephroid::geometry::Ray;
use nephroid::illumination::Side;
use nephroid::optics::glass::Glass;
use nephroid::optics::spectrum::{Spectrum, Xyz, illuminant};
use nephroid::optics::{LinearSrgb, Nanometres};
use nephroid::progress::Control;
use nephroid::scene::builtin::{self, parts, shapes};
use nephroid::scene::{LightKind, LoadOptions, Scene, load};
use nephroid::session::{BakeResult, BakeSession};
use nephroid::settings::{BakeSettings, Estimator, LayerKind, MapResolution, Wavelengths};
use nephroid::transport::{MediumStack, Tracer};
use nephroid::units::{Flux, Irradiance};

use crate::support;

fn bake(scene: Scene, settings: &BakeSettings) -> BakeResult {
    let mut session = BakeSession::new(Arc::new(scene)).expect("a valid scene");
    session.bake(settings, &(), &Control::default()).expect("a bake")
}

fn settings(side: usize) -> BakeSettings {
    BakeSettings {
        map_resolution: MapResolution::Fixed {
            width: side,
            height: side,
        },
        ..BakeSettings::default()
    }
}

fn glass(text: &str) -> Arc<Glass> {
    Arc::new(Glass::parse(text).expect("a glass"))
}

/// Caustic light on the upper side of the object of a name, row by row.
fn caustic<'a>(result: &'a BakeResult, scene: &Scene, name: &str) -> (usize, &'a [[f32; 3]]) {
    let object = scene.objects.iter().position(|object| object.name == name);
    let object = object.expect("the receiver");
    let map = (result.maps.iter())
        .find(|map| map.chart.object() == object && map.chart.receiver.side() == Side::Front)
        .expect("its map");
    let layer = map.layer(LayerKind::Caustic).expect("caustic light");
    (map.chart.width, &layer.irradiance)
}

fn ball_of(text: &str) -> Scene {
    let mut scene = builtin::build("ball").expect("a built-in scene");
    for material in scene
        .materials
        .iter_mut()
        .filter(|material| material.surface.is_specular())
    {
        material.set_glass(glass(text));
    }
    scene
}

fn mean_and_difference(a: &[[f32; 3]], b: &[[f32; 3]]) -> (f64, f64) {
    let (mut square, mut sum) = (0.0, 0.0);
    for (a, b) in a.iter().zip(b) {
        for channel in 0..3 {
            square += f64::from(a[channel] - b[channel]).powi(2);
            sum += f64::from(a[channel]);
        }
    }
    let count = 3.0 * a.len() as f64;
    (sum / count, (square / count).sqrt())
}

#[test]
fn next_to_no_dispersion_is_none() {
    let without = ball_of("abbe:1.5,1e12");
    let with = ball_of("abbe:1.5,2e7");
    let settings = settings(128);
    let [a, b] = [without, with].map(|scene| {
        let result = bake(scene.clone(), &settings);
        caustic(&result, &scene, "floor").1.to_vec()
    });
    let (mean, rms) = mean_and_difference(&a, &b);
    println!("relative RMS difference {:.1e}", rms / mean);
    assert!(mean > 0.0 && rms < 1e-4 * mean, "{rms} of {mean}");
}

#[test]
fn dispersion_parts_colours_and_keeps_their_sum() {
    let scene = ball_of("N-SF11");
    let result = bake(scene.clone(), &settings(128));
    let (_, texels) = caustic(&result, &scene, "floor");
    let sum = texels.iter().fold(LinearSrgb::BLACK, |sum, texel| {
        sum + LinearSrgb::from(texel.map(f64::from))
    });
    let spread = texels
        .iter()
        .map(|texel| (texel[0] - texel[2]).abs())
        .fold(0.0, f32::max);
    let brightest = texels.iter().map(|texel| texel[1]).fold(0.0, f32::max);
    println!("sum {sum:?}, largest difference of channels {spread}, brightest {brightest}");
    assert!(spread > 0.02 * brightest, "colours part");
    for channel in sum.to_array() {
        // Fresnel's factors differ by a per cent between red and blue.
        assert!((channel / sum.luminance() - 1.0).abs() < 0.04, "{sum:?}");
    }
    let energy = result.ledgers[0].energy_w;
    println!("{:?}", energy.truncated);
    let out = energy.deposited + energy.absorbed + energy.escaped + energy.truncated.total();
    assert!((out / energy.emitted - 1.0).abs() < 1e-6, "{energy:?}");
    assert!(
        energy.truncated.total().abs() < 1e-3 * energy.emitted,
        "{energy:?}"
    );
}

/// A beam through a thick slab, tilted: wavelengths leave it side by side.
fn slab(text: &str) -> Scene {
    let mut scene = parts::reference_scene(1.0);
    let pane = shapes::cuboid(DVec3::new(-0.6, 0.5, -0.6), DVec3::new(0.6, 0.7, 0.6));
    let mut material = parts::dielectric("glass", 1.5);
    material.set_glass(glass(text));
    parts::add(&mut scene, "slab", pane, material);
    let direction = DVec3::new(0.5, -1.0, 0.0).normalize();
    scene.lights.push(parts::sun("sun", direction, Irradiance(1.0)));
    scene
}

#[test]
fn a_beam_recombines_behind_a_slab() {
    let mut scene = slab("635577");
    let lamp = Arc::new(illuminant("A").expect("a lamp"));
    scene.lights[0].set_spectrum(Arc::clone(&lamp));
    let result = bake(scene.clone(), &settings(64));
    let (width, texels) = caustic(&result, &scene, "floor");
    let white = lamp.xyz().chromaticity().expect("light");
    // The slab's light covers x from some -0.25 to 0.95 on the floor.
    for column in (width * 45 / 100)..(width * 85 / 100) {
        let texel = texels[(width / 2) * width + column];
        let xyz = Xyz::from(LinearSrgb::from(texel.map(f64::from)));
        let xy = xyz.chromaticity().expect("light");
        for axis in 0..2 {
            assert!(
                (xy[axis] - white[axis]).abs() < 1e-3,
                "column {column}: {xy:?}, lamp {white:?}"
            );
        }
    }
}

#[test]
fn lumens_stay_lumens_whatever_the_spectrum() {
    let mut plain = builtin::build("ball").expect("a built-in scene");
    let LightKind::Point { position, .. } = plain.lights[0].kind else {
        panic!("a point light");
    };
    plain.lights[0] = parts::point_light("lamp", position, Flux(1000.0 / 683.0));
    let plain = &bake(plain, &settings(64)).ledgers[0];
    let plain_w = plain.energy_w.emitted + plain.not_emitted_w;
    for lamp in ["E", "A", "FL2", "LED-B1", "line:589.3"] {
        let mut scene = ball_of("N-BK7");
        // 1,000 lm, luminous-equivalent.
        scene.lights[0] = parts::point_light("lamp", position, Flux(1000.0 / 683.0));
        scene.lights[0].set_spectrum(Arc::new(illuminant(lamp).expect("a lamp")));
        let ledger = &bake(scene, &settings(64)).ledgers[0];
        let energy = ledger.energy_w;
        let out_w = energy.deposited + energy.absorbed + energy.escaped + energy.truncated.total();
        let sent_w = energy.emitted + ledger.not_emitted_w;
        println!(
            "{lamp}: {:.5} lm towards the ball's cells, {:.5} of them to the ball, {:.5} in maps and losses",
            683.0 * sent_w,
            683.0 * energy.emitted,
            683.0 * out_w
        );
        assert!(
            (sent_w / plain_w - 1.0).abs() < 1e-4,
            "{lamp}: {sent_w} W, {plain_w} W of a white lamp"
        );
        assert!((out_w / energy.emitted - 1.0).abs() < 1e-4, "{lamp}: {energy:?}");
    }
}

/// A row of the prism's table: wavelength [nm], exit point and direction, height on the wall [m].
fn prism_table(path: &std::path::Path) -> Vec<[f64; 6]> {
    let mut rows = csv::Reader::from_path(path).expect("a table");
    let wanted = ["lambda_nm", "exit_x", "exit_y", "dir_x", "dir_y", "wall_y"];
    let header = rows.headers().expect("a header").clone();
    let columns = wanted.map(|name| header.iter().position(|column| column == name).expect("a column"));
    rows.records()
        .map(|row| {
            let row = row.expect("a row");
            columns.map(|column| row[column].parse().expect("a number"))
        })
        .collect()
}

fn shared_prism() -> Option<(Scene, Vec<[f64; 6]>)> {
    let path = support::shared_or_skip("oracle/S4.glb")?;
    let scene = load(&path.to_string_lossy(), &LoadOptions::default()).expect("a scene");
    Some((scene, prism_table(&path.with_file_name("S4_table.csv"))))
}

#[test]
fn rays_leave_a_prism_where_snell_says() {
    let Some((scene, table)) = shared_prism() else {
        return;
    };
    let tracer = Tracer::new(Arc::new(scene));
    let direction = DVec3::new(0.907_518_796_638_282_2, 0.420_011_468_591_280_8, 0.0).normalize();
    let entry = DVec3::new(-0.015, 1.0 + 0.015 / 3.0_f64.sqrt(), 0.0);
    let mut worst = [0.0_f64; 2];
    for [nm, exit_x, exit_y, dir_x, dir_y, wall_y] in table {
        let at = tracer.at_wavelength(Nanometres(nm));
        let mut ray = Ray {
            origin: entry - direction * 0.005 - tracer.scene().origin_world,
            direction,
        };
        let mut media = MediumStack::default();
        for _ in 0..2 {
            let hit = at.closest_hit(&ray).expect("the prism");
            let branch = at
                .interact(&hit, ray.direction, &media)
                .transmission
                .expect("light goes through");
            (ray, media) = (branch.ray, branch.media);
        }
        let exit = ray.origin + tracer.scene().origin_world;
        let at_wall = exit.y + (1.5 - exit.x) * ray.direction.y / ray.direction.x;
        worst[0] = worst[0].max((ray.direction - DVec3::new(dir_x, dir_y, 0.0)).length());
        worst[1] = worst[1]
            .max((at_wall - wall_y).abs())
            .max((exit.x - exit_x).hypot(exit.y - exit_y));
    }
    println!("worst direction {:.1e}, worst place {:.1e} m", worst[0], worst[1]);
    assert!(worst[0] < 1e-5 && worst[1] < 1e-5);
}

#[test]
fn each_wavelength_of_a_spectrum_lands_in_its_texel() {
    let Some((scene, table)) = shared_prism() else {
        return;
    };
    let side = 512;
    for [nm, .., wall_y] in table.into_iter().step_by(9) {
        let mut scene = scene.clone();
        scene.lights[0].set_spectrum(Arc::new(illuminant(&format!("line:{nm}")).expect("a line")));
        // The slit is a millimetre wide: half of that between rays.
        let fine = BakeSettings {
            density_per_sr: 1.2e7,
            ..settings(side)
        };
        let result = bake(scene.clone(), &fine);
        let (width, texels) = caustic(&result, &scene, "wall");
        let expected = (wall_y + 0.2) / 1.4 * side as f64;
        let (mut sum, mut weighted) = (0.0, 0.0);
        for (texel, irradiance) in texels.iter().enumerate() {
            let row = (texel / width) as f64 + 0.5;
            let luminance = LinearSrgb::from(irradiance.map(f64::from)).luminance();
            if (row - expected).abs() < 4.0 {
                (sum, weighted) = (sum + luminance, weighted + row * luminance);
            }
        }
        let off = weighted / sum - expected;
        println!("{nm} nm: {off:+.3} texels off");
        assert!(off.abs() < 1.0, "{nm} nm: {off}");
    }
}

fn sampled(count: u32, estimator: Estimator, side: usize) -> BakeSettings {
    let settings = settings(side);
    BakeSettings {
        estimator,
        sigma: estimator.default_sigma(),
        wavelengths: Wavelengths::Fixed(count),
        ..settings
    }
}

#[test]
fn kept_bands_add_up_to_the_colour_they_make() {
    let mut scene = ball_of("N-SF11");
    scene.lights[0].set_spectrum(Arc::new(illuminant("E").expect("a lamp")));
    for estimator in [Estimator::Wavefront, Estimator::Splat] {
        let result = bake(
            scene.clone(),
            &BakeSettings {
                keep_spectrum: true,
                ..sampled(7, estimator, 64)
            },
        );
        let (_, texels) = caustic(&result, &scene, "floor");
        let floor = result.maps[0].chart.receiver;
        let layers: Vec<_> = (result.band_layers.iter())
            .filter(|layer| layer.receiver == floor)
            .collect();
        assert_eq!(layers.len(), 7);
        let brightest = texels.iter().map(|texel| texel[1]).fold(0.0, f32::max);
        // Equal energy: within a band E is the same at every wavelength, so that its XYZ is that times the integrals.
        let weights: Vec<[f64; 3]> = (layers.iter())
            .map(|layer| {
                let flat = Spectrum::from_fn(|_| 1.0).expect("light");
                let range = Nanometres(layer.band.from_nm)..=Nanometres(layer.band.to_nm);
                flat.xyz_within(range).into()
            })
            .collect();
        let mut parted = 0.0_f32;
        for (texel, colour) in texels.iter().enumerate() {
            let sum = (layers.iter().zip(&weights)).fold([0.0; 3], |sum, (layer, weight)| {
                let irradiance = f64::from(layer.irradiance[texel]);
                std::array::from_fn(|axis| sum[axis] + irradiance * weight[axis])
            });
            let made = Xyz::from(sum).to_linear_srgb().to_array();
            for (made, stored) in made.into_iter().zip(colour) {
                let off = (made - f64::from(*stored)).abs();
                assert!(off < 1e-4 * f64::from(brightest), "{made} beside {stored}");
            }
            let [violet, red] = [0, 6].map(|band| layers[band].irradiance[texel]);
            parted = parted.max((violet - red).abs());
        }
        assert!(parted > 0.05 * layers[3].irradiance.iter().copied().fold(0.0, f32::max));
        // The ledger knows the same light in radiant watts.
        let ledger = &result.ledgers[0];
        let radiant_w: f64 = (result.band_layers.iter())
            .map(|layer| {
                let map = (result.maps.iter()).find(|map| map.chart.receiver == layer.receiver);
                let chart = &map.expect("its map").chart;
                let texels = layer.irradiance.iter().enumerate();
                let flux =
                    texels.map(|(texel, irradiance)| f64::from(*irradiance) * chart.texel_area_m2(texel));
                flux.sum::<f64>() * (layer.band.to_nm - layer.band.from_nm)
            })
            .sum();
        let stated = ledger.deposited_radiant_w.expect("bands are kept");
        println!(
            "{estimator:?}: {radiant_w} W in maps, {stated} W stated, {:?} W emitted",
            ledger.emitted_radiant_w
        );
        assert!((radiant_w / stated - 1.0).abs() < 1e-4);
        assert!(stated < ledger.emitted_radiant_w.expect("a spectrum"));
    }
}

#[test]
fn one_wavelength_parts_nothing() {
    let scene = ball_of("N-SF11");
    for estimator in [Estimator::Wavefront, Estimator::Splat] {
        let result = bake(scene.clone(), &sampled(1, estimator, 64));
        let (_, texels) = caustic(&result, &scene, "floor");
        let white = texels.iter().map(|texel| texel[1]).fold(0.0, f32::max);
        for [r, g, b] in texels {
            assert!(
                (r - g).abs() < 1e-4 * white && (b - g).abs() < 1e-4 * white,
                "{r} {g} {b}"
            );
        }
    }
}

#[test]
fn more_wavelengths_come_nearer_to_all_of_them() {
    let scene = ball_of("N-SF11");
    let side = 64;
    let whole = bake(scene.clone(), &settings(side));
    let whole = caustic(&whole, &scene, "floor").1;
    let error = |settings: &BakeSettings| {
        let result = bake(scene.clone(), settings);
        let (mean, rms) = mean_and_difference(whole, caustic(&result, &scene, "floor").1);
        rms / mean
    };
    let errors = [1, 4, 16].map(|count| error(&sampled(count, Estimator::Wavefront, side)));
    println!("1, 4 and 16 wavelengths: {errors:?}");
    assert!(errors[1] < errors[0] && errors[2] < 0.3 * errors[0]);
    // Splats over the whole spectrum see the same colours, as far as kernels are sharp.
    let splats = |wavelengths: Wavelengths| BakeSettings {
        density_per_sr: 4e5,
        wavelengths,
        ..sampled(1, Estimator::Splat, side)
    };
    let [all, one] = [Wavelengths::Continuous, Wavelengths::Fixed(1)].map(|way| error(&splats(way)));
    println!("splats: {all} with all wavelengths, {one} with one");
    assert!(all < 0.5 * one);
}

/// Around the focus of a ball, light of all wavelengths at once against that of many traced one by one. The ball's
/// silhouette cuts cells here, and their light reaches far: what is wrong at a border shows.
#[test]
fn light_of_all_wavelengths_at_once_is_that_of_many_beside_borders_too() {
    let scene = ball_of("N-BK7");
    let side = 128;
    let way = |wavelengths: Wavelengths| BakeSettings {
        density_per_sr: 4e3,
        wavelengths,
        ..settings(side)
    };
    let [all, many] = [Wavelengths::Continuous, Wavelengths::Fixed(10)].map(|wavelengths| {
        let result = bake(scene.clone(), &way(wavelengths));
        caustic(&result, &scene, "floor").1.to_vec()
    });
    let middle = 0.5 * side as f64;
    let is_around = |texel: usize| {
        let place = |index: usize| (index as f64 + 0.5 - middle) / side as f64;
        (0.05..0.2).contains(&place(texel % side).hypot(place(texel / side)))
    };
    let around: Vec<usize> = (0..side * side).filter(|texel| is_around(*texel)).collect();
    let rms = |channel: usize| {
        let off = |texel: &usize| f64::from(all[*texel][channel] / many[*texel][channel] - 1.0).powi(2);
        (around.iter().map(off).sum::<f64>() / around.len() as f64).sqrt()
    };
    let rms = [0, 1, 2].map(rms);
    println!("{rms:?} off in {} texels", around.len());
    // A ray traced again a bracket beside its border moves red by 45 % here; ten wavelengths are off by about 1 % themselves.
    assert!(rms.iter().all(|rms| *rms < 0.03), "{rms:?}");
}

#[test]
fn wavelengths_are_traced_only_where_glass_is_dispersive() {
    let scene = ball_of("cauchy:1.5,0");
    assert!(!scene.materials.iter().any(|material| material.is_dispersive()));
    for estimator in [Estimator::Wavefront, Estimator::Splat] {
        let plain = BakeSettings {
            wavelengths: Wavelengths::Continuous,
            ..sampled(1, estimator, 64)
        };
        let [a, b] = [plain, sampled(13, estimator, 64)].map(|settings| bake(scene.clone(), &settings));
        assert_eq!(a.counts.rays, b.counts.rays);
        assert_eq!(caustic(&a, &scene, "floor").1, caustic(&b, &scene, "floor").1);
    }
}

#[test]
fn a_prism_throws_a_spectrum_without_bands() {
    let scene = builtin::build("prism").expect("a built-in scene");
    let wall = |wavelengths: Wavelengths| {
        let result = bake(
            scene.clone(),
            &BakeSettings {
                density_per_sr: 1e8,
                wavelengths,
                ..settings(512)
            },
        );
        caustic(&result, &scene, "wall").1.to_vec()
    };
    let split = wall(Wavelengths::Fixed(128));
    let norm = |texels: &[[f32; 3]]| {
        let squares = texels.iter().flatten().map(|value| f64::from(*value).powi(2));
        squares.sum::<f64>().sqrt()
    };
    let off = |texels: &[[f32; 3]]| {
        let pairs = texels.iter().zip(&split);
        let differences: Vec<[f32; 3]> = pairs
            .map(|(a, b)| std::array::from_fn(|channel| a[channel] - b[channel]))
            .collect();
        norm(&differences) / norm(&split)
    };
    let [continuous, three] = [Wavelengths::Continuous, Wavelengths::Fixed(3)].map(|way| off(&wall(way)));
    println!("off 128 wavelengths: {continuous} of the whole spectrum, {three} of three wavelengths");
    assert!(three > 1.0, "three lines are no spectrum");
    assert!(continuous < 0.15, "{continuous}");
}
