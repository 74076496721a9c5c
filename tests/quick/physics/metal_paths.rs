//! Metals where light meets them: by wavelength where it has one, by colour where it has three channels.

use nephroid::optics::fresnel::{dielectric_reflectance, metal_reflectance};
use nephroid::optics::spectrum::{Spectrum, WavelengthSampler, illuminant, xyz_bar};
use nephroid::optics::wavelength::VISIBLE;
use nephroid::optics::{ColourBasis, Metal};

use super::metals::metal;
use crate::prelude::*;
use support::floors::{image, texture_reference};

const WAVELENGTHS: u32 = 1024;

fn plate_of(material: Material) -> Scene {
    let mut scene = Scene::default();
    parts::add(
        &mut scene,
        "plate",
        shapes::floor([-1.0, 1.0], [-1.0, 1.0], 0.0),
        material,
    );
    scene
}

fn plate(name: &str) -> Scene {
    let mut material = parts::mirror();
    material.set_metal(metal(name));
    plate_of(material)
}

fn tracer(name: &str) -> Tracer {
    Tracer::new(Arc::new(plate(name)))
}

/// The share that comes back of a ray down onto the plate, at an angle of such a cosine to its normal.
fn share(tracer: &Tracer, cos: f64) -> LinearSrgb {
    let direction = dvec3((1.0 - cos * cos).sqrt(), -cos, 0.0);
    let origin = -direction * 0.5 + dvec3(0.03, 0.0, 0.07);
    let hit = tracer.closest_hit(&Ray { origin, direction }).expect("the plate");
    let interaction = tracer.interact(&hit, direction, &MediumStack::default());
    let share = interaction.reflection.expect("a metal reflects").share;
    near(
        share + interaction.absorbed,
        LinearSrgb::WHITE,
        1e-15,
        "nothing is lost",
    );
    share
}

/// What is seen of a lamp's light when each of many wavelengths, taken by importance, is left by such a factor.
fn followed(lamp: &Spectrum, factor: impl Fn(Nanometres) -> f64) -> [f64; 3] {
    let sampler = WavelengthSampler::for_lamp(lamp).expect("light");
    let mut sum = [0.0; 3];
    for index in 0..WAVELENGTHS {
        let (wavelength, density_per_nm) = sampler.sample((f64::from(index) + 0.5) / f64::from(WAVELENGTHS));
        let weight = lamp.at(wavelength) * factor(wavelength) / (density_per_nm * f64::from(WAVELENGTHS));
        for (sum, channel) in sum.iter_mut().zip(xyz_bar(wavelength)) {
            *sum += weight * channel;
        }
    }
    sum
}

/// The same by the rule of all integrals. The brightest channel is 1 to 14: a midpoint rule leaves 1e-4 of it.
fn integrated(lamp: &Spectrum, factor: impl Fn(Nanometres) -> f64) -> [f64; 3] {
    lamp.integral_times(VISIBLE, |wavelength| {
        xyz_bar(wavelength).map(|channel| channel * factor(wavelength))
    })
}

#[test]
fn tables_count_at_a_wavelength() {
    for metal in Metal::all() {
        let tracer = tracer(metal.name());
        for nm in [400.0, 490.0, 550.0, 589.3, 700.0].map(Nanometres) {
            let at = tracer.at_wavelength(nm);
            assert_eq!(at.wavelength(), Some(nm));
            for cos in [1.0, 0.8, 0.5, 0.1, 1e-3] {
                let expected = LinearSrgb::grey(metal.reflectance(cos, nm));
                near(share(&at, cos), expected, 1e-12, (metal.name(), nm, cos));
            }
        }
    }
}

#[test]
fn colours_count_in_channels() {
    let scene = Arc::new(plate("copper"));
    let base_colour = scene.materials[0].base_colour;
    let tracer = Tracer::new(Arc::clone(&scene));
    // At a wavelength and back again, as an edit of the scene has it.
    let back = tracer.at_wavelength(Nanometres(450.0)).edited(scene);
    for tracer in [&tracer, &back, &tracer.with_indices_at(Nanometres(450.0))] {
        assert_eq!(tracer.wavelength(), None);
        for cos in [1.0, 0.6, 0.2] {
            near(
                share(tracer, cos),
                metal_reflectance(cos, base_colour),
                1e-12,
                cos,
            );
        }
    }
    // Without a table, at a wavelength too.
    let mut material = parts::mirror();
    material.base_colour = rgb(0.9, 0.5, 0.1);
    let tracer = Tracer::new(Arc::new(plate_of(material)));
    for cos in [1.0, 0.5] {
        assert_eq!(
            share(&tracer.at_wavelength(Nanometres(600.0)), cos),
            share(&tracer, cos)
        );
    }
}

#[test]
fn factor_under_a_lamp_gives_its_colour() {
    for metal in Metal::all() {
        let tracer = tracer(metal.name());
        for name in "D65 A FL2 FL11 LED-B1 LED-RGB1 line:589.3 line:500".split(' ') {
            let lamp = illuminant(name).expect("a lamp");
            let factor = share(&tracer.with_metals_under(&lamp), 1.0);
            let found = integrated(&lamp, |wavelength| ColourBasis::at(wavelength).tone(factor).r);
            let expected = integrated(&lamp, |wavelength| metal.reflectance(1.0, wavelength));
            near(found, expected, 1e-4, (metal.name(), name));
            near(factor, metal.reflectance_srgb(1.0), 0.25, (metal.name(), name));
        }
    }
}

#[test]
fn textures_dim_a_metal_at_a_wavelength() {
    let mut scene = plate("gold");
    let dirt = image(1, vec![[230, 150, 60, 255]], Wrap::Repeat);
    scene.textures.push(Arc::new(dirt));
    scene.materials[0].base_colour_texture = Some(texture_reference());
    let tracer = Tracer::new(Arc::new(scene));
    let kept = [230, 150, 60].map(LinearSrgb::decode_channel);
    for (nm, cos) in [(450.0, 1.0), (560.0, 0.7), (640.0, 0.3)] {
        let clean = metal("gold").reflectance(cos, Nanometres(nm));
        // As Schlick has it, with the metal's own reflectance in the place of its formula.
        let expected = kept.map(|kept| kept * clean + (1.0 - kept) * (1.0 - cos).powi(5));
        near(
            share(&tracer.at_wavelength(Nanometres(nm)), cos).to_array(),
            expected,
            1e-12,
            nm,
        );
    }
}

#[test]
fn light_comes_back_from_gold_behind_glass() {
    let mut scene = plate("gold");
    let pane = shapes::cuboid(dvec3(-1.0, 0.1, -1.0), dvec3(1.0, 0.3, 1.0));
    parts::add(&mut scene, "pane", pane, parts::glass("N-SF11"));
    let index = scene.materials[1].glass.clone().expect("a glass");
    let tracer = Tracer::new(Arc::new(scene));
    let incident = dvec2(0.6, -0.8);
    let follow = |wavelength: Nanometres| -> (f64, Ray) {
        let at = tracer.at_wavelength(wavelength);
        let mut ray = Ray {
            origin: dvec3(-0.5, 0.6, 0.02),
            direction: incident.extend(0.0),
        };
        let (mut media, mut flux) = (MediumStack::default(), LinearSrgb::WHITE);
        // Through the pane, off the gold, through the pane.
        for step in 0..5 {
            let hit = at.closest_hit(&ray).expect("pane and plate");
            let met = at.interact(&hit, ray.direction, &media);
            let branch = if step == 2 {
                met.reflection
            } else {
                met.transmission
            };
            let branch = branch.expect("light goes on");
            (ray, media, flux) = (branch.ray, branch.media, flux * branch.share);
        }
        assert!(at.closest_hit(&ray).is_none(), "it is out");
        assert_eq!([flux.g, flux.b], [flux.r; 2], "one wavelength, one channel");
        (flux.r, ray)
    };
    let expected = |wavelength: Nanometres| {
        let glass = dielectric_reflectance(0.8, index.dispersion.index(wavelength));
        (1.0 - glass).powi(4) * metal("gold").reflectance(0.8, wavelength)
    };
    let mut places = Vec::new();
    for nm in [420.0, 500.0, 580.0, 680.0].map(Nanometres) {
        let (flux, ray) = follow(nm);
        near(flux, expected(nm), 1e-9, nm);
        // A pane and a plate turn all light alike.
        near(ray.direction, dvec3(incident.x, -incident.y, 0.0), 1e-9, nm);
        // The pane shifts blue more: along the plate it is 0.2 m deep, twice.
        let n = index.dispersion.index(nm);
        let tan_within = incident.x / (n * n - incident.x * incident.x).sqrt();
        let at_top = ray.origin.x + (0.3 - ray.origin.y) * 0.75;
        near(at_top, -0.5 + (0.3 + 0.2) * 0.75 + 0.4 * tan_within, 1e-9, nm);
        places.push(at_top);
    }
    assert!(places.is_sorted(), "blue light is bent most: {places:?}");
    let lamp = illuminant("FL2").expect("a lamp");
    let found = followed(&lamp, |wavelength| follow(wavelength).0);
    near(found, integrated(&lamp, expected), 1e-4, "under FL2");
}
