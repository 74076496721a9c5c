//! Metals by wavelength in a bake: gold under a pane of glass that parts light, against the sum of all its reflections.

use std::sync::Arc;

use glam::DVec3;
use nephroid::illumination::Side;
use nephroid::optics::fresnel::dielectric_reflectance;
use nephroid::optics::spectrum::{Spectrum, Xyz, illuminant, xyz_bar};
use nephroid::optics::wavelength::VISIBLE;
use nephroid::optics::{Glass, LinearSrgb, Metal, Nanometres};
use nephroid::progress::Control;
use nephroid::scene::Scene;
use nephroid::scene::builtin::{parts, shapes};
use nephroid::session::BakeSession;
use nephroid::settings::{BakeSettings, LayerKind, MapResolution, Wavelengths};
use nephroid::units::Flux;

/// Of the beam to the plates' normal.
const TILT_RAD: f64 = 0.1;
const CEILING_HALF_M: f64 = 1.0;
const GLASS: &str = "N-SF11";

fn gold() -> &'static Metal {
    Metal::by_name("gold").expect("a metal")
}

/// A narrow beam of one luminous-equivalent watt down onto a pane over a plate of gold, beneath a ceiling.
fn scene(lamp: &Arc<Spectrum>) -> Scene {
    let mut scene = Scene::default();
    let mut plate = parts::mirror();
    plate.set_metal(gold());
    parts::add(
        &mut scene,
        "plate",
        shapes::floor([-3.0, 3.0], [-3.0, 3.0], 0.0),
        plate,
    );
    let pane = shapes::cuboid(DVec3::new(-3.0, 0.1, -3.0), DVec3::new(3.0, 0.2, 3.0));
    parts::add(&mut scene, "pane", pane, parts::glass(GLASS));
    let half = CEILING_HALF_M;
    let ceiling = shapes::rectangle(DVec3::Y * 1.5, DVec3::X * half, DVec3::Z * half);
    let grey = parts::matte("ceiling", LinearSrgb::grey(0.5));
    parts::add(&mut scene, "ceiling", ceiling, grey);
    let down = DVec3::new(TILT_RAD.sin(), -TILT_RAD.cos(), 0.0);
    scene
        .lights
        .push(parts::beam("lamp", DVec3::Y, down, 0.02, Flux(1.0)));
    scene.lights[0].set_spectrum(Arc::clone(lamp));
    scene
}

/// What comes to the ceiling of each luminous-equivalent watt that comes to the pane [W per channel].
fn to_ceiling(lamp: &Arc<Spectrum>, wavelengths: Wavelengths) -> LinearSrgb {
    let side = 64;
    let settings = BakeSettings {
        wavelengths,
        branch_threshold: Some(1e-5),
        map_resolution: MapResolution::Fixed {
            width: side,
            height: side,
        },
        ..BakeSettings::default()
    };
    let mut session = BakeSession::new(Arc::new(scene(lamp))).expect("a valid scene");
    let result = session.bake(&settings, &(), &Control::default()).expect("a bake");
    let is_wanted = |side: Side| {
        result
            .maps
            .iter()
            .find(|map| map.chart.object() == 2 && map.chart.receiver.side() == side)
    };
    let texel_m2 = (2.0 * CEILING_HALF_M / side as f64).powi(2);
    let maps = [Side::Front, Side::Back].into_iter().filter_map(is_wanted);
    let layers = maps.filter_map(|map| map.layer(LayerKind::Caustic));
    let texels = layers.flat_map(|layer| &layer.irradiance);
    let sum = texels.fold(LinearSrgb::BLACK, |sum, texel| {
        sum + LinearSrgb::from(texel.map(f64::from)) * texel_m2
    });
    sum / result.ledgers[0].energy_w.emitted
}

/// All that a pane and a metal send back, whose many reflections form a geometric series each.
fn sent_back(wavelength: Nanometres) -> f64 {
    let glass = Glass::parse(GLASS).expect("a glass");
    let interface = dielectric_reflectance(TILT_RAD.cos(), glass.dispersion.index(wavelength));
    let (pane, through) = (
        2.0 * interface / (1.0 + interface),
        (1.0 - interface) / (1.0 + interface),
    );
    let metal = gold().reflectance(TILT_RAD.cos(), wavelength);
    pane + through * through * metal / (1.0 - pane * metal)
}

#[test]
fn gold_behind_dispersive_glass_reflects_wavelength_by_wavelength() {
    for name in ["D65", "LED-B1", "line:500"] {
        let lamp = Arc::new(illuminant(name).expect("a lamp"));
        let xyz = lamp.integral_times(VISIBLE, |wavelength| {
            xyz_bar(wavelength).map(|channel| channel * sent_back(wavelength))
        });
        let expected = Xyz::from(xyz).to_linear_srgb();
        for (wavelengths, tolerance) in [(Wavelengths::Continuous, 0.012), (Wavelengths::Fixed(24), 0.004)] {
            let found = to_ceiling(&lamp, wavelengths);
            println!("{name}, {wavelengths:?}: {found:.4?}, expected {expected:.4?}");
            let error = (found - expected).map(f64::abs).max_channel();
            assert!(
                error < tolerance * expected.max_channel(),
                "{name}: {found:?} for {expected:?}"
            );
        }
    }
}
