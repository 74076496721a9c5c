//! A view at rest becomes a mean of many pictures; and what glass that parts wavelengths shows, against the CPU.

use nephroid::effect::EffectSwitch;
use nephroid::eye_pass::ToneMap;
use nephroid::eye_pass::reference::ReferenceSettings;
use nephroid::eye_pass::renderer::EyeQuality;
use nephroid::eye_pass::tone_mapping::display_rgba8;
use nephroid::scene::PanelShape;

use crate::gpu::rig::{AS_CPU, Rig, or_skip};
use support::flip::mean_flip;
use support::floors::{diffuse, floor_map, floor_scene};
use support::prelude::*;
use support::scenes::{limited, panel, seen, view};

/// Largest mean FLIP between the device's picture at rest and the CPU's of the same chains. Nearly all of it is that
/// they look through other places of the pixels: without dispersion they differ as much.
const LARGEST_FLIP: f64 = 0.02;
/// Pictures of which the one at rest is the mean.
const PICTURES: u32 = 64;

/// A ball and a lying prism over a floor of bright lines, two of them coloured.
fn exhibit(glass: &Material) -> (Scene, Vec<IlluminationMap>) {
    let mut scene = floor_scene(diffuse(LinearSrgb::WHITE));
    let ball = shapes::sphere(dvec3(0.3, 0.24, 0.55), 0.2, 5);
    parts::add(&mut scene, "ball", ball, glass.clone());
    let outline = [[0.62, 0.1, 0.2], [0.82, 0.1, 0.35], [0.66, 0.35, 0.3]];
    let prism = shapes::prism(outline.map(DVec3::from), dvec3(0.1, 0.0, 0.4));
    parts::add(&mut scene, "prism", prism, glass.clone());
    // Wide lines with soft edges: what differs by the places of samples is little beside what glass parts.
    let wave = |place: usize| 0.5 + 0.5 * (TAU * (place as f64 + 0.5) / 8.0).cos();
    let line = |index: usize| {
        let (across, along) = (wave(index % 32), wave(index / 32));
        let lit = 3.0 * across.max(along).powi(2);
        [1.0, along.max(0.3), across.max(0.2)].map(|share| (0.1 + lit * share) as f32)
    };
    let maps = vec![floor_map(0, 32, 32, (0..32 * 32).map(line).collect())];
    (scene, maps)
}

fn ahead() -> View {
    View {
        background: LinearSrgb::grey(0.1),
        ..view(dvec3(0.5, 0.9, 1.7), dvec3(0.46, 0.2, 0.5), 0.26, [96, 64])
    }
}

/// The picture at rest, after so many.
fn at_rest(rig: &mut Rig, pictures: u32) -> Picture {
    // From the first picture on.
    rig.renderer.set_quality(AS_CPU);
    for _ in 0..pictures {
        rig.refined(&ahead());
    }
    assert_eq!(rig.renderer.counts().samples, pictures);
    assert_eq!((rig.gpu.take_error(), rig.renderer.chain_refusal()), (None, None));
    rig.renderer
        .shown_radiance(rig.gpu, &ahead())
        .expect("it is read back")
}

#[test]
fn picture_at_rest_shows_all_wavelengths() {
    let (scene, maps) = exhibit(&parts::glass("N-SF66"));
    let mut rig = or_skip!(Rig::at(AS_CPU, &scene, &maps));
    let tracer = Tracer::new(Arc::new(scene));
    let [parted, unparted] = [16, 0].map(|wavelengths| {
        let settings = ReferenceSettings {
            samples_per_side: 4,
            wavelengths,
            ..limited(|limits| limits.branching_depth = AS_CPU.branching_depth)
        };
        seen(&tracer, &maps, &ahead(), &settings).0
    });
    let found = at_rest(&mut rig, PICTURES);
    rig.renderer.set_dispersion(EffectSwitch::Off);
    let off = at_rest(&mut rig, PICTURES);
    let show = |picture: &Picture| display_rgba8(picture, 0.0, ToneMap::None);
    let flip = |a: &Picture, b: &Picture| mean_flip(&show(a), &show(b), 96);
    let (same, both_off) = (flip(&parted, &found), flip(&unparted, &off));
    assert!(
        same <= LARGEST_FLIP && same < 1.25 * both_off,
        "{same} {both_off}"
    );
    for missing in [&off, &unparted] {
        assert!(flip(&parted, missing) > 2.5 * same, "{same}");
    }
}

#[test]
fn switched_off_glass_has_one_index() {
    let glass = parts::glass("N-SF66");
    let plain = Material {
        glass: None,
        ..glass.clone()
    };
    let picture = |(material, switch): (&Material, EffectSwitch)| {
        let (scene, maps) = exhibit(material);
        let mut rig = Rig::at(AS_CPU, &scene, &maps)?;
        rig.renderer.set_dispersion(switch);
        Some(rig.picture(&ahead()))
    };
    let (auto, on, off) = (EffectSwitch::Auto, EffectSwitch::On, EffectSwitch::Off);
    let [one_index, forced, switched_off, parted] =
        [(&plain, auto), (&plain, on), (&glass, off), (&glass, auto)].map(picture);
    assert!(forced == one_index && switched_off == one_index);
    assert!(one_index.is_none() || parted != one_index);
}

/// A slab before a white background.
fn slab() -> Scene {
    let mut scene = Scene::default();
    let slab = shapes::cuboid(dvec3(-2.0, 0.1, -2.0), dvec3(3.0, 0.4, 3.0));
    parts::add(&mut scene, "slab", slab, parts::glass("N-SF11"));
    scene
}

/// A white panel before a slab, both seen in a mirror.
fn lamp_before_a_slab() -> Scene {
    let mut scene = floor_scene(parts::mirror());
    let slab = shapes::cuboid(dvec3(-3.0, -1.0, -3.0), dvec3(3.0, 4.0, -2.6));
    parts::add(&mut scene, "slab", slab, parts::glass("N-SF11"));
    let half_axes = [dvec3(0.1, 0.0, 0.0), dvec3(0.0, 0.086, 0.05)];
    let centre = dvec3(0.4, 1.0, -1.55);
    scene.lights = vec![panel(centre, half_axes, PanelShape::Disc, 0.3)];
    scene
}

#[test]
fn white_stays_white_in_every_picture() {
    white_stays_white(&slab());
    white_stays_white(&lamp_before_a_slab());
}

fn white_stays_white(scene: &Scene) {
    let mut rig = or_skip!(Rig::at(AS_CPU, scene, &[]));
    for pictures in 1..6 {
        let [by_one_index, seen] = [EffectSwitch::Off, EffectSwitch::Auto].map(|switch| {
            rig.renderer.set_dispersion(switch);
            at_rest(&mut rig, pictures)
        });
        let channels = seen.radiance.iter().flatten();
        let pairs = channels.zip(by_one_index.radiance.iter().flatten());
        let off: Vec<f32> = pairs.map(|(a, b)| (a / b - 1.0).abs()).collect();
        let mean = off.iter().sum::<f32>() / off.len() as f32;
        let largest = off.iter().copied().fold(0.0, f32::max);
        // Half floats hold 5e-4; which way is the stronger after four surfaces may differ by wavelength.
        assert!(mean < 1e-3 && largest < 0.02, "{pictures}: {mean}, {largest}");
    }
}

/// A mirror ball on a floor with a coarse check.
fn rig() -> Option<Rig<'static>> {
    let mut scene = floor_scene(diffuse(LinearSrgb::WHITE));
    let ball = shapes::sphere(dvec3(0.5, 0.2, 0.5), 0.2, 4);
    parts::add(&mut scene, "ball", ball, parts::mirror());
    let is_bright = |index: usize| (index / 16 + index % 16).is_multiple_of(2);
    let texels = (0..256).map(|index| if is_bright(index) { [2.0; 3] } else { [0.2; 3] });
    Rig::new(&scene, &[floor_map(0, 16, 16, texels.collect())])
}

fn from(x: f64, target_y: f64, fov_rad: f64) -> View {
    let (eye, target) = (dvec3(x, 0.8, 1.8), dvec3(0.5, target_y, 0.5));
    View {
        background: LinearSrgb::grey(0.1),
        ..view(eye, target, fov_rad, [60, 40])
    }
}

/// Mean absolute difference.
fn difference<T: Copy + Into<f64>>(a: &[T], b: &[T]) -> f64 {
    let off = a.iter().zip(b).map(|(a, b)| ((*a).into() - (*b).into()).abs());
    off.sum::<f64>() / a.len() as f64
}

#[test]
fn mean_of_many_comes_close_to_many_samples() {
    let mut rig = or_skip!(rig());
    let (first_view, other_view) = (from(0.5, 0.1, 0.7), from(0.7, 0.1, 0.7));
    let reference = display_rgba8(&rig.sampled(&first_view, 8), 0.0, first_view.tone_map);
    let first = rig.refined(&first_view);
    assert_eq!(rig.renderer.counts().samples, 1, "the first one is drawn");
    let mut last = first.clone();
    for samples in 2..=32 {
        last = rig.refined(&first_view);
        assert_eq!(rig.renderer.counts().samples, samples);
    }
    let (alone, mean) = (difference(&first, &reference), difference(&last, &reference));
    assert!(mean < 0.2 * alone, "{mean} after 32 samples, {alone} after one");

    // Another view starts anew.
    rig.refined(&other_view);
    assert_eq!(rig.renderer.counts().samples, 1);
    assert!(rig.refined(&first_view) == first, "nothing of the mean is left");
    // What changes the picture ends the mean too.
    rig.refined(&first_view);
    rig.set_maps(&[]);
    rig.refined(&first_view);
    assert_eq!(rig.renderer.counts().samples, 1);
}

/// Coarser than the picture, finer, and as fine: the same picture but for its sharpness.
#[test]
fn traced_picture_may_be_coarser_or_finer() {
    let mut rig = or_skip!(rig());
    // Nothing but the ball.
    let view = from(0.5, 0.2, 0.15);
    let mut traced = |traced_scale: f64, side: u32| {
        rig.renderer.set_quality(EyeQuality {
            traced_scale,
            ..EyeQuality::STILL
        });
        let picture = rig.sampled(&view, side);
        let pixels = f64::from(60 * 40) * traced_scale * traced_scale;
        assert_eq!(rig.renderer.counts().traced_pixels, pixels as u64);
        picture.radiance.concat()
    };
    let reference = traced(1.0, 8);
    let coarse = traced(0.25, 1);
    let [double, whole, half] = [2.0, 1.0, 0.5].map(|scale| difference(&traced(scale, 1), &reference));
    let quarter = difference(&coarse, &reference);
    assert!(
        double < whole && whole < half && half < quarter,
        "{double} {whole} {half} {quarter}"
    );
    // A mean of many coarse ones is finer than one, though no finer than their pixels blur.
    let off = difference(&traced(0.25, 8), &reference);
    assert!(off < 0.85 * quarter, "{off}, {quarter} of a single one");
    let ratio = coarse.iter().sum::<f32>() / reference.iter().sum::<f32>();
    assert!((ratio - 1.0).abs() < 0.03, "{ratio}");
}
