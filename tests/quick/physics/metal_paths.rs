//! Metals where light meets them: by wavelength where it has one, by colour where it has three channels.

use std::sync::Arc;

use glam::{DMat3, DVec2, DVec3};
use nephroid::geometry::Ray;
use nephroid::optics::fresnel::{dielectric_reflectance, metal_reflectance};
use nephroid::optics::spectrum::{Spectrum, WavelengthSampler, Xyz, illuminant, xyz_bar};
use nephroid::optics::wavelength::VISIBLE;
use nephroid::optics::{ColourBasis, LinearSrgb, Metal, Nanometres};
use nephroid::scene::builtin::{parts, shapes};
use nephroid::scene::texture::Wrap;
use nephroid::scene::{Material, Mesh, Scene, Texture, TextureRef};
use nephroid::transport::{Interaction, MediumStack, SurfaceHit, Tracer};

/// Wavelengths that a lamp's light is followed at.
const WAVELENGTHS: u32 = 1024;

fn metal(name: &str) -> &'static Metal {
    Metal::by_name(name).unwrap_or_else(|error| panic!("{error}"))
}

/// A polished plate at y = 0.
fn plate() -> Mesh {
    shapes::floor([-1.0, 1.0], [-1.0, 1.0], 0.0)
}

fn mirror_of(name: &str) -> Material {
    let mut material = parts::mirror();
    material.set_metal(metal(name));
    material
}

fn scene_with(material: Material) -> Scene {
    let mut scene = Scene::default();
    parts::add(&mut scene, "plate", plate(), material);
    scene
}

/// A ray down onto the middle of the plate, at an angle of such a cosine to its normal, and what becomes of it.
fn meets(tracer: &Tracer, cos: f64) -> (SurfaceHit, Interaction) {
    let direction = DVec3::new((1.0 - cos * cos).sqrt(), -cos, 0.0);
    let ray = Ray {
        origin: -direction * 0.5 + DVec3::new(0.03, 0.0, 0.07),
        direction,
    };
    let hit = tracer.closest_hit(&ray).expect("the plate");
    let interaction = tracer.interact(&hit, direction, &MediumStack::default());
    (hit, interaction)
}

fn share(tracer: &Tracer, cos: f64) -> LinearSrgb {
    let (_, interaction) = meets(tracer, cos);
    let share = interaction.reflection.expect("a metal reflects").share;
    let sum = share + interaction.absorbed - LinearSrgb::WHITE;
    assert!(sum.map(f64::abs).max_channel() < 1e-15, "nothing is lost");
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

/// The same by the rule of all integrals.
fn integrated(lamp: &Spectrum, factor: impl Fn(Nanometres) -> f64) -> [f64; 3] {
    lamp.integral_times(VISIBLE, |wavelength| {
        xyz_bar(wavelength).map(|channel| channel * factor(wavelength))
    })
}

fn assert_same_colour(found: [f64; 3], expected: [f64; 3], what: &str) {
    for (found, expected) in found.into_iter().zip(expected) {
        // The brightest channel is 1 to 14: what a midpoint rule leaves.
        assert!((found - expected).abs() < 1e-4, "{what}: {found} for {expected}");
    }
}

#[test]
fn metals_reflect_by_their_tables_at_a_wavelength() {
    for metal in Metal::all() {
        let tracer = Tracer::new(Arc::new(scene_with(mirror_of(metal.name()))));
        for nm in [400.0, 490.0, 550.0, 589.3, 700.0] {
            let at = tracer.at_wavelength(Nanometres(nm));
            assert_eq!(at.wavelength(), Some(Nanometres(nm)));
            for cos in [1.0, 0.8, 0.5, 0.1, 1e-3] {
                let found = share(&at, cos);
                let expected = LinearSrgb::grey(metal.reflectance(cos, Nanometres(nm)));
                let error = (found - expected).map(f64::abs).max_channel();
                assert!(error < 1e-12, "{} at {nm}, {cos}: {found:?}", metal.name());
            }
        }
    }
}

#[test]
fn light_of_three_channels_sees_a_metals_colour() {
    let scene = Arc::new(scene_with(mirror_of("copper")));
    let base_colour = scene.materials[0].base_colour;
    let tracer = Tracer::new(Arc::clone(&scene));
    // At a wavelength and back again, as an edit of the scene has it.
    let back = tracer.at_wavelength(Nanometres(450.0)).edited(scene);
    for tracer in [&tracer, &back, &tracer.with_indices_at(Nanometres(450.0))] {
        assert_eq!(tracer.wavelength(), None);
        for cos in [1.0, 0.6, 0.2] {
            let error = share(tracer, cos) - metal_reflectance(cos, base_colour);
            assert!(error.map(f64::abs).max_channel() < 1e-12);
        }
    }
}

#[test]
fn metals_without_a_table_keep_their_colour_at_a_wavelength() {
    let mut material = parts::mirror();
    material.base_colour = LinearSrgb::new(0.9, 0.5, 0.1);
    let tracer = Tracer::new(Arc::new(scene_with(material)));
    let at = tracer.at_wavelength(Nanometres(600.0));
    for cos in [1.0, 0.5] {
        assert_eq!(share(&at, cos), share(&tracer, cos));
    }
}

#[test]
fn a_lamps_reflected_colour_is_the_mean_over_its_wavelengths() {
    for name in ["gold", "copper", "silver"] {
        let scene = scene_with(mirror_of(name));
        let tracer = Tracer::new(Arc::new(scene));
        let reflected = |wavelength| share(&tracer.at_wavelength(wavelength), 1.0).r;
        // Lines and a discharge lamp's bands are where three channels say nothing.
        for lamp_name in ["D65", "A", "FL11", "LED-B1", "line:589.3", "line:470"] {
            let lamp = illuminant(lamp_name).expect("a lamp");
            let expected = integrated(&lamp, |wavelength| metal(name).reflectance(1.0, wavelength));
            let found = followed(&lamp, reflected);
            println!("{name} under {lamp_name}: {found:.5?}, {expected:.5?}");
            assert_same_colour(found, expected, &format!("{name} under {lamp_name}"));
        }
    }
}

#[test]
fn a_metals_factor_under_a_lamp_gives_its_reflected_colour() {
    for metal in Metal::all() {
        let tracer = Tracer::new(Arc::new(scene_with(mirror_of(metal.name()))));
        for name in [
            "D65",
            "A",
            "FL2",
            "FL11",
            "LED-B1",
            "LED-RGB1",
            "line:589.3",
            "line:500",
        ] {
            let lamp = illuminant(name).expect("a lamp");
            let factor = share(&tracer.with_metals_under(&lamp), 1.0);
            let found = integrated(&lamp, |wavelength| ColourBasis::at(wavelength).tone(factor).r);
            let expected = integrated(&lamp, |wavelength| metal.reflectance(1.0, wavelength));
            let usual = metal.reflectance_srgb(1.0);
            let off = (factor - usual).map(f64::abs).max_channel();
            println!(
                "{} under {name}: {factor:.3?}, {found:.5?} for {expected:.5?}",
                metal.name()
            );
            for (found, expected) in found.into_iter().zip(expected) {
                assert!((found - expected).abs() < 1e-4, "{} under {name}", metal.name());
            }
            assert!(
                off < 0.25,
                "{} under {name}: {factor:?} is far from {usual:?}",
                metal.name()
            );
        }
    }
}

#[test]
fn a_metal_under_daylight_has_the_colour_that_channels_see() {
    let daylight = illuminant("D65").expect("a lamp");
    let tracer = Tracer::new(Arc::new(scene_with(mirror_of("gold"))));
    for cos in [1.0, 0.5] {
        let found = followed(&daylight, |wavelength| {
            share(&tracer.at_wavelength(wavelength), cos).r
        });
        let colour = Xyz::from(found).to_linear_srgb();
        let expected = metal("gold").reflectance_srgb(cos);
        // D65's tables are white to some 1e-4.
        let error = (colour - expected).map(f64::abs).max_channel();
        assert!(error < 5e-4, "{colour:?} for {expected:?}");
    }
}

#[test]
fn textures_dim_a_metal_at_a_wavelength_as_in_channels() {
    let mut scene = scene_with(mirror_of("gold"));
    scene.textures.push(Arc::new(Texture {
        name: "dirt".into(),
        width: 1,
        height: 1,
        rgba: vec![[230, 150, 60, 255]],
        wrap: [Wrap::Repeat; 2],
    }));
    scene.materials[0].base_colour_texture = Some(TextureRef {
        texture: 0,
        uv_set: 0,
        uv_transform: DMat3::IDENTITY,
    });
    let tracer = Tracer::new(Arc::new(scene));
    let kept = [230, 150, 60].map(LinearSrgb::decode_channel);
    for (nm, cos) in [(450.0, 1.0), (560.0, 0.7), (640.0, 0.3)] {
        let at = tracer.at_wavelength(Nanometres(nm));
        let clean = metal("gold").reflectance(cos, Nanometres(nm));
        for (found, kept) in share(&at, cos).to_array().into_iter().zip(kept) {
            // As Schlick has it, with the metal's own reflectance in the place of its formula.
            let expected = kept * clean + (1.0 - kept) * (1.0 - cos).powi(5);
            assert!((found - expected).abs() < 1e-12, "{nm}: {found} for {expected}");
        }
    }
}

#[test]
fn light_comes_back_from_gold_behind_dispersive_glass() {
    let mut scene = scene_with(mirror_of("gold"));
    let pane = shapes::cuboid(DVec3::new(-1.0, 0.1, -1.0), DVec3::new(1.0, 0.3, 1.0));
    parts::add(&mut scene, "pane", pane, parts::glass("N-SF11"));
    let index = scene.materials[1].glass.clone().expect("a glass");
    let tracer = Tracer::new(Arc::new(scene));
    let incident = DVec2::new(0.6, -0.8);
    let follow = |wavelength: Nanometres| -> (f64, Ray) {
        let at = tracer.at_wavelength(wavelength);
        let mut ray = Ray {
            origin: DVec3::new(-0.5, 0.6, 0.02),
            direction: incident.extend(0.0),
        };
        let (mut media, mut flux) = (MediumStack::default(), LinearSrgb::WHITE);
        // Through the pane, off the gold, through the pane.
        for step in 0..5 {
            let hit = at.closest_hit(&ray).expect("pane and plate");
            let interaction = at.interact(&hit, ray.direction, &media);
            let branch = if step == 2 {
                interaction.reflection
            } else {
                interaction.transmission
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
        assert!((flux - expected(nm)).abs() < 1e-9, "{nm:?}: {flux}");
        let out = DVec3::new(incident.x, -incident.y, 0.0);
        assert!(
            (ray.direction - out).length() < 1e-9,
            "a pane and a plate turn all light alike"
        );
        // The pane shifts blue more: along the plate it is 0.2 m deep, twice.
        let n = index.dispersion.index(nm);
        let tan_within = incident.x / (n * n - incident.x * incident.x).sqrt();
        let along = -0.5 + (0.3 + 0.2) * 0.75 + 0.4 * tan_within;
        let at_top = ray.origin.x + (0.3 - ray.origin.y) * 0.75;
        assert!((at_top - along).abs() < 1e-9, "{nm:?}: {at_top} for {along}");
        places.push(at_top);
    }
    assert!(places.is_sorted(), "blue light is bent most: {places:?}");
    let lamp = illuminant("FL2").expect("a lamp");
    let found = followed(&lamp, |wavelength| follow(wavelength).0);
    assert_same_colour(found, integrated(&lamp, expected), "gold behind glass under FL2");
}
