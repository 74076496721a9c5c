//! Light by wavelength: a prism's spectrum against exact rays, and laws that glass, metals and lamps keep.

use nephroid::illumination::Side;
use nephroid::optics::glass::Glass;
use nephroid::optics::spectrum::{Spectrum, Xyz, illuminant};
use nephroid::settings::{Estimator, Wavelengths};

use crate::bake::common::sized;
use support::prelude::*;
use support::tools::{bake, builtin_scene, energy_fault, set, to};

fn settings(side: usize) -> BakeSettings {
    to(0.01, side)
}

fn at_wavelengths(wavelengths: Wavelengths, settings: BakeSettings) -> BakeSettings {
    set(settings, |s| s.wavelengths = wavelengths)
}

fn sampled(count: u32, estimator: Estimator, side: usize) -> BakeSettings {
    BakeSettings {
        wavelengths: Wavelengths::Fixed(count),
        ..sized(BakeSettings::of(estimator), (side, side))
    }
}

fn lamp(name: &str) -> Arc<Spectrum> {
    Arc::new(illuminant(name).expect("a lamp"))
}

fn glass(text: &str) -> Arc<Glass> {
    Arc::new(Glass::parse(text).expect("a glass"))
}

/// Caustic light on the upper side of the object of a name, row by row.
fn caustic(result: &Bake, scene: &Scene, name: &str) -> Vec<[f32; 3]> {
    let is_wanted = |map: &&IlluminationMap| {
        scene.objects[map.chart.object()].name == name && map.chart.receiver.side() == Side::Front
    };
    let map = result.maps.iter().find(is_wanted).expect("its map");
    map.layer(LayerKind::Caustic)
        .expect("caustic light")
        .irradiance
        .clone()
}

fn floor(scene: &Scene, settings: &BakeSettings) -> Vec<[f32; 3]> {
    caustic(&bake(scene.clone(), settings), scene, "floor")
}

fn ball_of(text: &str) -> Scene {
    let mut scene = builtin_scene("ball");
    for material in &mut scene.materials {
        if material.surface.is_specular() {
            material.set_glass(glass(text));
        }
    }
    scene
}

fn brightest(texels: &[[f32; 3]]) -> f32 {
    texels.iter().map(|texel| texel[1]).fold(0.0, f32::max)
}

#[test]
fn dispersion_parts_colours_not_their_sum() {
    let scene = ball_of("N-SF11");
    let result = bake(scene.clone(), &settings(128));
    let texels = caustic(&result, &scene, "floor");
    let sum = texels.iter().fold(LinearSrgb::BLACK, |sum, texel| {
        sum + LinearSrgb::from(texel.map(f64::from))
    });
    let spreads = texels.iter().map(|texel| (texel[0] - texel[2]).abs());
    assert!(
        spreads.fold(0.0, f32::max) > 0.02 * brightest(&texels),
        "colours part"
    );
    for channel in sum.to_array() {
        // Fresnel's factors differ by a per cent between red and blue.
        assert!((channel / sum.luminance() - 1.0).abs() < 0.04, "{sum:?}");
    }
    assert_eq!(energy_fault(&result), None);
    let energy = result.ledgers[0].energy_w;
    assert!(
        energy.truncated.total().abs() < 1e-3 * energy.emitted,
        "{energy:?}"
    );
}

/// A beam through a thick slab, tilted: wavelengths leave it side by side.
#[test]
fn a_beam_recombines_behind_a_slab() {
    let mut scene = parts::reference_scene(1.0);
    let pane = shapes::cuboid(dvec3(-0.6, 0.5, -0.6), dvec3(0.6, 0.7, 0.6));
    parts::add(&mut scene, "slab", pane, parts::glass("635577"));
    let direction = dvec3(0.5, -1.0, 0.0).normalize();
    scene.lights.push(parts::sun("sun", direction, Irradiance(1.0)));
    scene.lights[0].set_spectrum(lamp("A"));
    let texels = floor(&scene, &settings(64));
    let white = lamp("A").xyz().chromaticity().expect("light");
    // The slab's light covers x from some -0.25 to 0.95 on the floor, alike along z. Photons colour single texels where the
    // light that its side reflects ends.
    for column in 64 * 45 / 100..64 * 85 / 100 {
        let mut sum = LinearSrgb::BLACK;
        for row in 20..44 {
            sum += LinearSrgb::from(texels[row * 64 + column].map(f64::from));
        }
        let xyz = Xyz::from(sum);
        let xy = xyz.chromaticity().expect("light");
        for axis in 0..2 {
            let off = (xy[axis] - white[axis]).abs();
            assert!(off < 1e-3, "column {column}: {xy:?}, lamp {white:?}");
        }
    }
}

#[test]
fn lumens_stay_lumens_whatever_the_spectrum() {
    let plain = builtin_scene("ball");
    let position = plain.lights[0].kind.position().expect("a point light");
    // 1,000 lm, luminous-equivalent.
    let with_lamp = |mut scene: Scene, spectrum: Option<&str>| {
        scene.lights[0] = parts::point_light("lamp", position, Flux(1000.0 / 683.0));
        if let Some(name) = spectrum {
            scene.lights[0].set_spectrum(lamp(name));
        }
        let result = bake(scene, &settings(64));
        assert_eq!(energy_fault(&result), None, "{spectrum:?}");
        result.ledgers[0].energy_w.emitted
    };
    let plain_w = with_lamp(plain, None);
    for name in ["E", "A", "FL2", "LED-B1", "line:589.3"] {
        let sent_w = with_lamp(ball_of("N-BK7"), Some(name));
        // Photons tell how much of the lamp's light meets the ball, with a standard error of 1.5e-4 over six seeds: three
        // of those of a difference.
        assert!(
            (sent_w / plain_w - 1.0).abs() < 6e-4,
            "{name}: {sent_w} W, {plain_w} W of a white lamp"
        );
    }
}

/// A row of the prism's table: wavelength [nm], exit point and direction, height on the wall [m].
fn prism_table(path: &std::path::Path) -> Vec<[f64; 6]> {
    let text = std::fs::read_to_string(path).expect("a table");
    let mut rows = text.lines().map(|line| line.split(',').collect::<Vec<&str>>());
    let wanted = ["lambda_nm", "exit_x", "exit_y", "dir_x", "dir_y", "wall_y"];
    let header = rows.next().expect("a header");
    let columns = wanted.map(|name| {
        header
            .iter()
            .position(|column| *column == name)
            .expect("a column")
    });
    rows.map(|row| columns.map(|column| row[column].parse().expect("a number")))
        .collect()
}

fn shared_prism() -> Option<(Scene, Vec<[f64; 6]>)> {
    let path = support::shared_or_skip("oracle/S4.glb")?;
    let scene = Scene::load(&path.to_string_lossy(), &LoadOptions::default()).expect("a scene");
    Some((scene, prism_table(&path.with_file_name("S4_table.csv"))))
}

#[test]
fn each_wavelength_lands_in_its_texel() {
    let Some((scene, table)) = shared_prism() else {
        return;
    };
    let side = 512;
    for [nm, .., wall_y] in table.into_iter().step_by(9) {
        let mut scene = scene.clone();
        scene.lights[0].set_spectrum(lamp(&format!("line:{nm}")));
        let texels = caustic(&bake(scene.clone(), &to(0.1, side)), &scene, "wall");
        let expected = (wall_y + 0.2) / 1.4 * side as f64;
        let (mut sum, mut weighted) = (0.0, 0.0);
        for (texel, irradiance) in texels.iter().enumerate() {
            let row = (texel / side) as f64 + 0.5;
            let luminance = LinearSrgb::from(irradiance.map(f64::from)).luminance();
            if (row - expected).abs() < 4.0 {
                (sum, weighted) = (sum + luminance, weighted + row * luminance);
            }
        }
        let off = weighted / sum - expected;
        assert!(off.abs() < 1.0, "{nm} nm: {off} texels off");
    }
}

#[test]
fn kept_bands_add_up_to_their_colour() {
    let mut scene = ball_of("N-SF11");
    scene.lights[0].set_spectrum(lamp("E"));
    for estimator in [Estimator::Photon, Estimator::Splat] {
        let kept = set(sampled(7, estimator, 64), |s| s.keep_spectrum = true);
        let result = bake(scene.clone(), &kept);
        assert_eq!(energy_fault(&result), None, "{estimator:?}");
        let texels = caustic(&result, &scene, "floor");
        let floor = result.maps[0].chart.receiver;
        let layers = result.band_layers.iter();
        let layers: Vec<_> = layers.filter(|layer| layer.receiver == floor).collect();
        assert_eq!(layers.len(), 7);
        // Equal energy: within a band E is the same at every wavelength, so that its XYZ is that times the integrals.
        let weights = layers.iter().map(|layer| -> [f64; 3] {
            let flat = Spectrum::from_fn(|_| 1.0).expect("light");
            let range = Nanometres(layer.band.from_nm)..=Nanometres(layer.band.to_nm);
            flat.xyz_within(range).into()
        });
        let weights: Vec<[f64; 3]> = weights.collect();
        let most = 1e-4 * f64::from(brightest(&texels));
        let mut parted = 0.0_f32;
        for (texel, colour) in texels.iter().enumerate() {
            let sum = layers
                .iter()
                .zip(&weights)
                .fold([0.0; 3], |sum, (layer, weight)| {
                    let irradiance = f64::from(layer.irradiance[texel]);
                    std::array::from_fn(|axis| sum[axis] + irradiance * weight[axis])
                });
            let made = Xyz::from(sum).to_linear_srgb().to_array();
            for (made, stored) in made.into_iter().zip(colour) {
                assert!((made - f64::from(*stored)).abs() < most, "{made} beside {stored}");
            }
            parted = parted.max((layers[0].irradiance[texel] - layers[6].irradiance[texel]).abs());
        }
        assert!(parted > 0.05 * layers[3].irradiance.iter().copied().fold(0.0, f32::max));
        // The ledger knows the same light in radiant watts.
        let radiant_w = result.band_layers.iter().map(|layer| {
            let mut maps = result.maps.iter();
            let map = maps
                .find(|map| map.chart.receiver == layer.receiver)
                .expect("its map");
            let texels = layer.irradiance.iter().enumerate();
            let flux = texels.map(|(texel, e)| f64::from(*e) * map.chart.texel_area_m2(texel));
            flux.sum::<f64>() * (layer.band.to_nm - layer.band.from_nm)
        });
        let radiant_w: f64 = radiant_w.sum();
        let ledger = &result.ledgers[0];
        let stated_w = ledger.deposited_radiant_w.expect("bands are kept");
        assert!(
            (radiant_w / stated_w - 1.0).abs() < 1e-4,
            "{radiant_w} {stated_w}"
        );
        assert!(stated_w < ledger.emitted_radiant_w.expect("a spectrum"));
    }
}

/// Around the focus of a ball, light of all wavelengths at once against that of many traced one by one. The ball's
/// silhouette cuts cells here, and their light reaches far: what is wrong at a border shows.
#[test]
fn all_wavelengths_are_as_many_alone() {
    let scene = ball_of("N-BK7");
    let side = 128;
    let [all, many] = [Wavelengths::Continuous, Wavelengths::Fixed(10)]
        .map(|wavelengths| floor(&scene, &at_wavelengths(wavelengths, settings(side))));
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
    // A ray traced again a bracket beside its border moves red by 45 % here; ten wavelengths are off by about 1 % themselves.
    assert!(rms.iter().all(|rms| *rms < 0.03), "{rms:?}");
}
