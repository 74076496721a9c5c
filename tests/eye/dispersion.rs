//! What the eye sees through glass that parts wavelengths.

use std::sync::Arc;

use glam::{DMat3, DVec3};
use nephroid::effect::{Effect, EffectSwitch};
use nephroid::eye_pass::reference::{ChainLimits, EyeRays, ReferenceSettings, render_counted};
use nephroid::eye_pass::wavelengths::{
    MOST_PER_PICTURE, SeenWavelength, bands, of_picture, share_below, shift_of_sample,
};
use nephroid::eye_pass::{Picture, ToneMap, View};
use nephroid::optics::wavelength::VISIBLE;
use nephroid::optics::{Glass, LinearSrgb, Nanometres};
use nephroid::plan::{self, EffectLine};
use nephroid::progress::Control;
use nephroid::scene::builtin::prism::{GLASS, Prism};
use nephroid::scene::builtin::{self, parts, shapes};
use nephroid::scene::{Camera, Material, Scene};
use nephroid::transport::Tracer;

use crate::meshes::sphere;
use crate::scenes::{diffuse, tracer};

/// Radiance of the background [W/(m² sr)].
const SKY: f64 = 3.0;

fn seen(tracer: &Tracer, view: &View, wavelengths: u32, side: u32) -> (Picture, EyeRays) {
    let settings = ReferenceSettings {
        samples_per_side: side,
        limits: ChainLimits {
            max_depth: 64,
            branch_threshold: 1e-10,
            ..ChainLimits::default()
        },
        wavelengths,
    };
    render_counted(tracer, &[], view, &settings, &(), &Control::default()).expect("nobody cancels")
}

fn view(camera: Camera, width: u32, height: u32) -> View {
    View {
        camera,
        width,
        height,
        exposure_stops: 0.0,
        tone_map: ToneMap::None,
        background: LinearSrgb::BLACK,
    }
}

fn from(eye: DVec3, target: DVec3) -> View {
    view(Camera::look_at("eye", eye, target, 0.6), 24, 16)
}

fn bits(picture: &Picture) -> Vec<u32> {
    let channels = picture.radiance.iter().flatten();
    channels.map(|channel| channel.to_bits()).collect()
}

fn largest_difference(a: DMat3, b: DMat3) -> f64 {
    let difference = (a - b).to_cols_array();
    difference
        .into_iter()
        .fold(0.0, |most, value| value.abs().max(most))
}

#[test]
fn every_set_of_wavelengths_adds_up_to_the_identity() {
    let whole = |set: &[SeenWavelength]| set.iter().fold(DMat3::ZERO, |sum, seen| sum + seen.share);
    let of_samples =
        (1..40).flat_map(|count| (0..8).map(move |sample| bands(count, shift_of_sample(sample))));
    let of_pictures = (0..256).map(of_picture);
    let mut sets = 0;
    for set in of_samples.chain(of_pictures) {
        let off = largest_difference(whole(&set), DMat3::IDENTITY);
        assert!(off < 1e-12, "{off} with {} wavelengths", set.len());
        assert!(set.iter().all(|seen| VISIBLE.contains(&seen.wavelength)));
        sets += 1;
    }
    assert_eq!(sets, 39 * 8 + 256);
    assert!((0..256).all(|index| of_picture(index).len() <= MOST_PER_PICTURE));
}

#[test]
fn each_wavelength_of_white_has_its_own_colour() {
    // Chromaticities of the spectral locus (CIE 018:2019) at the middle of a narrow band.
    for (nm, x, y) in [
        (450.0, 0.156_641, 0.017_705),
        (520.0, 0.074_302, 0.833_803),
        (600.0, 0.627_037, 0.372_491),
    ] {
        let band = share_below(Nanometres(nm + 0.5)) - share_below(Nanometres(nm - 0.5));
        let colour = LinearSrgb::from((band * DVec3::ONE).to_array());
        let [found_x, found_y] = nephroid::optics::spectrum::Xyz::from(colour)
            .chromaticity()
            .expect("light has a chromaticity");
        assert!(
            (found_x - x).abs() < 2e-3 && (found_y - y).abs() < 2e-3,
            "{nm}: {found_x} {found_y}"
        );
    }
}

#[test]
fn the_mean_of_many_pictures_approaches_all_wavelengths() {
    // What is seen of light that passes below some wavelength.
    let passed = |limit: f64, index: u32| {
        let set = of_picture(index).into_iter();
        set.filter(|seen| seen.wavelength.0 < limit)
            .fold(DMat3::ZERO, |sum, seen| sum + seen.share)
    };
    let off = |limit: f64, pictures: u32| {
        let sum = (0..pictures).fold(DMat3::ZERO, |sum, index| sum + passed(limit, index));
        largest_difference(sum * (1.0 / f64::from(pictures)), share_below(Nanometres(limit)))
    };
    let limits = || (0..24).map(|step| 430.0 + 9.0 * f64::from(step));
    let worst = |pictures| limits().map(|limit| off(limit, pictures)).fold(0.0, f64::max);
    let (few, many, most) = (worst(4), worst(64), worst(1024));
    assert!(
        many < 0.06 && many < 0.25 * few && most < 0.25 * many,
        "{few} {many} {most}"
    );
}

#[test]
fn nothing_is_followed_by_wavelength_without_dispersive_glass_on_the_way() {
    let ball = || sphere(DVec3::new(0.0, 1.0, 0.0), 0.5, 24, 12);
    let plain = tracer(vec![(ball(), parts::dielectric("glass", 1.7))], vec![]);
    let mut ahead = from(DVec3::new(0.0, 1.5, 3.0), DVec3::Y);
    ahead.background = LinearSrgb::new(1.0, 2.0, 3.0);
    let (of_one, few) = seen(&plain, &ahead, 0, 2);
    let (of_many, same) = seen(&plain, &ahead, 16, 2);
    assert_eq!((bits(&of_one), few), (bits(&of_many), same));
    assert!(few.chain_rays > 0 && few.rays_by_wavelength == 0, "{few:?}");

    let parting = tracer(vec![(ball(), parts::glass("N-SF11"))], vec![]);
    let away = from(DVec3::new(0.0, 1.5, 3.0), DVec3::new(0.0, 1.0, 9.0));
    assert_eq!(seen(&parting, &away, 16, 1).1.rays_by_wavelength, 0);
    let (_, unparted) = seen(&parting, &ahead, 0, 1);
    assert_eq!(unparted.rays_by_wavelength, 0);
    let (_, parted) = seen(&parting, &ahead, 16, 1);
    assert!(parted.rays_by_wavelength > 10 * unparted.chain_rays, "{parted:?}");
}

#[test]
fn white_surroundings_stay_white_through_a_dispersive_slab() {
    let slab = shapes::cuboid(DVec3::new(-1.0, -0.2, -1.0), DVec3::new(1.0, 0.2, 1.0));
    let scene = tracer(vec![(slab, parts::glass("N-SF11"))], vec![]);
    let mut through = from(DVec3::new(0.7, 2.0, 1.0), DVec3::ZERO);
    through.background = LinearSrgb::grey(SKY);
    for (wavelengths, side) in [(1, 1), (3, 1), (16, 1), (5, 2)] {
        let (picture, rays) = seen(&scene, &through, wavelengths, side);
        assert!(rays.rays_by_wavelength > 0);
        for channel in picture.radiance.iter().flatten() {
            assert!(
                (f64::from(*channel) / SKY - 1.0).abs() < 1e-3,
                "{wavelengths}: {channel}"
            );
        }
    }
}

#[test]
fn glass_that_hardly_parts_light_shows_every_colour_as_one_index_does() {
    let ball = || sphere(DVec3::new(0.0, 1.0, 0.0), 0.5, 24, 12);
    let mut material = Material {
        base_colour: LinearSrgb::new(0.9, 0.5, 0.2),
        ..parts::dielectric("glass", 1.5)
    };
    material.set_glass(Arc::new(Glass::with_abbe_number(1.5, 1e9)));
    assert!(material.is_dispersive());
    let backdrop = Material {
        emitted_radiance: LinearSrgb::new(0.1, 1.0, 4.0),
        ..diffuse(0.0)
    };
    let plate = shapes::rectangle(DVec3::new(0.4, 1.0, -2.0), DVec3::X, DVec3::Y);
    let scene = tracer(vec![(ball(), material), (plate, backdrop)], vec![]);
    let mut ahead = from(DVec3::new(0.0, 1.5, 3.0), DVec3::Y);
    ahead.background = LinearSrgb::new(2.0, 0.3, 0.05);
    let (one, many) = (seen(&scene, &ahead, 0, 1).0, seen(&scene, &ahead, 7, 1).0);
    for (a, b) in one.radiance.iter().zip(&many.radiance) {
        for (a, b) in a.iter().zip(b) {
            assert!((a - b).abs() <= 1e-5, "{a} {b}");
        }
    }
}

/// Share of unpolarised light that crosses an interface, by both angles from its normal [rad] (Fresnel).
fn crossing(incident: f64, refracted: f64) -> f64 {
    let (difference, sum) = (incident - refracted, incident + refracted);
    let across = (difference.sin() / sum.sin()).powi(2);
    let along = (difference.tan() / sum.tan()).powi(2);
    1.0 - 0.5 * (across + along)
}

/// Where a look at an angle from the base of an equilateral prism goes on behind it [rad], and the share of radiance
/// from there that arrives, by Snell's law in the plane: its faces are turned by −30 and 30 degrees.
fn behind(look: f64, n: f64) -> (f64, f64) {
    let face = 30.0_f64.to_radians();
    let entering = look + face;
    let entered = (entering.sin() / n).asin();
    let leaving = entered - 2.0 * face;
    let left = (n * leaving.sin()).asin();
    let through = crossing(entering, entered) * crossing(leaving, left);
    (face + left, through)
}

/// A bright line far behind a prism, through which an eye looks at it: the prism shows it at each wavelength where
/// Snell's law has it.
#[test]
fn a_line_behind_a_prism_is_seen_where_snells_law_puts_each_wavelength() {
    const FAR_M: f64 = 1e5;
    const PIXELS: u32 = 600;
    const FIELD_RAD: f64 = 0.1;
    const HALF_LINE_RAD: f64 = 0.003;
    let prism = Prism {
        centroid: DVec3::ZERO,
        along_base: DVec3::X,
        to_base: DVec3::NEG_Y,
        side_m: 0.06,
    };
    let glass = parts::glass(GLASS);
    let look_rad = (0.5 * glass.ior).asin() - 30.0_f64.to_radians();
    let (line_rad, _) = behind(look_rad, glass.ior);
    let (sine, cosine) = line_rad.sin_cos();
    let line = shapes::rectangle(
        DVec3::new(cosine, sine, 0.0) * FAR_M,
        DVec3::Z * FAR_M,
        DVec3::new(-sine, cosine, 0.0) * (FAR_M * HALF_LINE_RAD.tan()),
    );
    let bright = Material {
        emitted_radiance: LinearSrgb::WHITE,
        ..diffuse(0.0)
    };
    let scene = tracer(vec![(prism.mesh(0.06), glass.clone()), (line, bright)], vec![]);
    let eye = prism.entry() - prism.incoming(glass.ior) * 0.2;
    let camera = Camera::look_at("eye", eye, prism.entry(), FIELD_RAD);
    let (picture, _) = seen(&scene, &view(camera, 1, PIXELS), 16, 1);

    let expected_at = |row: u32| {
        let up = 1.0 - (f64::from(row) + 0.5) / f64::from(PIXELS) * 2.0;
        let look = look_rad + (up * (0.5 * FIELD_RAD).tan()).atan();
        let of_wavelength = |seen: SeenWavelength| {
            let (direction, share) = behind(look, glass.index_at(seen.wavelength));
            let meets = (direction - line_rad).abs() < HALF_LINE_RAD;
            seen.of(LinearSrgb::grey(if meets { share } else { 0.0 }))
        };
        let all = bands(16, 0.0).into_iter().map(of_wavelength);
        all.fold(LinearSrgb::BLACK, |sum, colour| sum + colour).to_array()
    };
    let expected: Vec<[f64; 3]> = (0..PIXELS).map(expected_at).collect();
    let found: Vec<[f64; 3]> = picture
        .radiance
        .iter()
        .map(|pixel| pixel.map(f64::from))
        .collect();
    let centroid = |pixels: &[[f64; 3]], channel: usize| {
        // Spectral colours have negative channels too; where a channel is bright counts.
        let bright = |pixel: &[f64; 3]| pixel[channel].max(0.0);
        let rows = (0..)
            .zip(pixels)
            .map(|(row, pixel)| f64::from(row) * bright(pixel));
        rows.sum::<f64>() / pixels.iter().map(bright).sum::<f64>()
    };
    let [red, blue] = [0, 2].map(|channel| (centroid(&found, channel), centroid(&expected, channel)));
    for (found, expected) in [red, blue] {
        assert!((found - expected).abs() < 0.1, "{found} {expected}");
    }
    // Glass bends blue more: the line is seen farther up there, towards the apex.
    assert!(blue.0 < red.0 - 60.0, "{blue:?} {red:?}");
    let is_off =
        |(a, b): &(&[f64; 3], &[f64; 3])| (0..3).any(|channel| (a[channel] - b[channel]).abs() > 1e-3);
    let off = found.iter().zip(&expected).filter(is_off).count();
    // Each wavelength has two edges, which rounding may put into the next pixel.
    assert!(off <= 8, "{off} of {PIXELS} pixels");
}

#[test]
fn the_plan_says_in_which_passes_light_is_parted() {
    let prism = builtin::build("prism").expect("a built-in scene");
    let ball = builtin::build("ball").expect("a built-in scene");
    let of_light = |switch| EffectLine {
        effect: Effect::Dispersion,
        switch,
        on: false,
        reason: "no lit solid bends one wavelength more than another".into(),
    };
    let line = |scene: &Scene, chains, switch| {
        let camera = Some((&scene.cameras[0], 1.5));
        let chains = plan::chains(scene, camera, chains);
        plan::dispersion(of_light(switch), scene, camera, &chains)
    };
    let (auto, off) = (EffectSwitch::Auto, EffectSwitch::Off);
    let by_eye = line(&prism, auto, auto);
    assert!(
        by_eye.on && by_eye.reason.ends_with("eye pass: `prism` parts wavelengths"),
        "{by_eye:?}"
    );
    let blind = line(&prism, off, auto);
    assert!(
        !blind.on && blind.reason.ends_with("eye pass: its chains are off"),
        "{blind:?}"
    );
    assert_eq!(line(&prism, auto, off), of_light(off));
    assert_eq!(line(&ball, auto, auto), of_light(auto));
}
