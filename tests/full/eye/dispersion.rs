//! What the eye sees through glass that parts wavelengths.

use nephroid::effect::{Effect, EffectSwitch};
use nephroid::eye_pass::reference::{EyeRays, ReferenceSettings};
use nephroid::eye_pass::wavelengths::{
    MAX_PER_PICTURE, SeenWavelength, bands, of_picture, share_below, shift_of_sample,
};
use nephroid::optics::wavelength::VISIBLE;
use nephroid::plan::{self, EffectLine};
use nephroid::scene::builtin::prism::{GLASS, Prism};

use support::meshes::sphere;
use support::prelude::*;
use support::scenes::{bits, diffuse, to_the_end, tracer, view, view_of};
use support::tools::builtin_scene;

fn seen(tracer: &Tracer, view: &View, wavelengths: u32, side: u32) -> (Picture, EyeRays) {
    let settings = ReferenceSettings {
        wavelengths,
        ..to_the_end(side)
    };
    support::scenes::seen(tracer, &[], view, &settings)
}

/// Before a background.
fn looking(eye: [f64; 3], target: [f64; 3], background: [f64; 3]) -> View {
    View {
        background: background.into(),
        ..view(eye.into(), target.into(), 0.6, [24, 16])
    }
}

fn ball() -> Mesh {
    sphere(DVec3::Y, 0.5, 24, 12)
}

fn shining(radiance: LinearSrgb) -> Material {
    Material {
        emitted_radiance: radiance,
        ..diffuse(0.0)
    }
}

fn largest_difference(a: DMat3, b: DMat3) -> f64 {
    let difference = (a - b).to_cols_array().into_iter();
    difference.fold(0.0, |most, value| value.abs().max(most))
}

/// What is seen of white light.
fn sum_of<'a>(set: impl IntoIterator<Item = &'a SeenWavelength>) -> DMat3 {
    set.into_iter().fold(DMat3::ZERO, |sum, seen| sum + seen.share)
}

#[test]
fn every_set_of_wavelengths_adds_up_to_one() {
    let of_samples =
        (1..40).flat_map(|count| (0..8).map(move |sample| bands(count, shift_of_sample(sample))));
    let sets: Vec<_> = of_samples.chain((0..256).map(of_picture)).collect();
    assert_eq!(sets.len(), 39 * 8 + 256);
    for set in sets {
        let off = largest_difference(sum_of(&set), DMat3::IDENTITY);
        assert!(off < 1e-12, "{off} with {} wavelengths", set.len());
        assert!(set.iter().all(|seen| VISIBLE.contains(&seen.wavelength)));
    }
    assert!((0..256).all(|index| of_picture(index).len() <= MAX_PER_PICTURE));
}

#[test]
fn mean_of_many_pictures_nears_all_wavelengths() {
    // What is seen of light that passes below some wavelength.
    let off = |limit: f64, pictures: u32| {
        let sets: Vec<_> = (0..pictures).map(of_picture).collect();
        let passed = sets.iter().flatten().filter(|seen| seen.wavelength.0 < limit);
        let mean = sum_of(passed) * (1.0 / f64::from(pictures));
        largest_difference(mean, share_below(Nanometres(limit)))
    };
    let limits = || (0..24).map(|step| 430.0 + 9.0 * f64::from(step));
    let worst = |pictures| limits().map(|limit| off(limit, pictures)).fold(0.0, f64::max);
    let [few, many, most] = [4, 64, 1024].map(worst);
    assert!(
        many < 0.06 && many < 0.25 * few && most < 0.25 * many,
        "{few} {many} {most}"
    );
}

#[test]
fn only_dispersive_glass_in_view_parts_rays() {
    let plain = tracer(vec![(ball(), parts::dielectric("glass", 1.7))], vec![]);
    let eye = [0.0, 1.5, 3.0];
    let ahead = looking(eye, [0.0, 1.0, 0.0], [1.0, 2.0, 3.0]);
    let (of_one, few) = seen(&plain, &ahead, 0, 2);
    let (of_many, same) = seen(&plain, &ahead, 16, 2);
    assert_eq!((bits(&of_one), few), (bits(&of_many), same));
    assert!(few.chain_rays > 0 && few.rays_by_wavelength == 0, "{few:?}");

    let parting = tracer(vec![(ball(), parts::glass("N-SF11"))], vec![]);
    let rays = |view: &View, wavelengths| seen(&parting, view, wavelengths, 1).1;
    let away = looking(eye, [0.0, 1.0, 9.0], [0.0; 3]);
    assert_eq!(rays(&away, 16).rays_by_wavelength, 0);
    let (unparted, parted) = (rays(&ahead, 0), rays(&ahead, 16));
    assert_eq!(unparted.rays_by_wavelength, 0);
    assert!(parted.rays_by_wavelength > 10 * unparted.chain_rays, "{parted:?}");
}

#[test]
fn white_stays_white_through_a_dispersive_slab() {
    let slab = shapes::cuboid(dvec3(-1.0, -0.2, -1.0), dvec3(1.0, 0.2, 1.0));
    let scene = tracer(vec![(slab, parts::glass("N-SF11"))], vec![]);
    let through = looking([0.7, 2.0, 1.0], [0.0; 3], [3.0; 3]);
    for (wavelengths, side) in [(1, 1), (3, 1), (16, 1), (5, 2)] {
        let (picture, rays) = seen(&scene, &through, wavelengths, side);
        assert!(rays.rays_by_wavelength > 0);
        for channel in picture.radiance.iter().flatten() {
            let off = (f64::from(*channel) / 3.0 - 1.0).abs();
            assert!(off < 1e-3, "{wavelengths}: {channel}");
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
fn prism_shows_each_wavelength_by_snells_law() {
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
        dvec3(cosine, sine, 0.0) * FAR_M,
        DVec3::Z * FAR_M,
        dvec3(-sine, cosine, 0.0) * (FAR_M * HALF_LINE_RAD.tan()),
    );
    let line = (line, shining(LinearSrgb::WHITE));
    let scene = tracer(vec![(prism.mesh(0.06), glass.clone()), line], vec![]);
    let eye = prism.entry() - prism.incoming(glass.ior) * 0.2;
    let camera = Camera::look_at("eye", eye, prism.entry(), FIELD_RAD);
    let (picture, _) = seen(&scene, &view_of(camera, [1, PIXELS]), 16, 1);

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
    let pixels = picture.radiance.iter();
    let found: Vec<[f64; 3]> = pixels.map(|pixel| pixel.map(f64::from)).collect();
    let centroid = |pixels: &[[f64; 3]], channel: usize| {
        // Spectral colours have negative channels too; where a channel is bright counts.
        let bright = |pixel: &[f64; 3]| pixel[channel].max(0.0);
        let rows = (0..).zip(pixels);
        let sum: f64 = rows.map(|(row, pixel)| f64::from(row) * bright(pixel)).sum();
        sum / pixels.iter().map(bright).sum::<f64>()
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
fn the_plan_says_where_light_is_parted() {
    let [prism, ball] = ["prism", "ball"].map(builtin_scene);
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
    for (chains, on, reason) in [
        (auto, true, "eye pass: `prism` parts wavelengths"),
        (off, false, "eye pass: its chains are off"),
    ] {
        let line = line(&prism, chains, auto);
        assert_eq!((line.on, line.reason.ends_with(reason)), (on, true), "{line:?}");
    }
    assert_eq!(line(&prism, auto, off), of_light(off));
    assert_eq!(line(&ball, auto, auto), of_light(auto));
}
