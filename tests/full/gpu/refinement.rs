//! A view at rest becomes a mean of many pictures.

use glam::DVec3;
use nephroid::eye_pass::View;
use nephroid::eye_pass::renderer::EyeQuality;
use nephroid::eye_pass::tone_mapping::display_rgba8;
use nephroid::optics::LinearSrgb;
use nephroid::scene::builtin::{parts, shapes};

use crate::gpu::rig::{Rig, or_skip};
use support::floors::{diffuse, floor_map, floor_scene};
use support::scenes::view;

/// A mirror ball on a floor with a coarse check.
fn rig() -> Option<Rig<'static>> {
    let mut scene = floor_scene(diffuse(LinearSrgb::WHITE));
    let ball = shapes::sphere(DVec3::new(0.5, 0.2, 0.5), 0.2, 4);
    parts::add(&mut scene, "ball", ball, parts::mirror());
    let is_bright = |index: usize| (index / 16 + index % 16).is_multiple_of(2);
    let texels = (0..256).map(|index| if is_bright(index) { [2.0; 3] } else { [0.2; 3] });
    Rig::new(&scene, &[floor_map(0, 16, 16, texels.collect())])
}

fn from(x: f64, target_y: f64, fov_rad: f64) -> View {
    let (eye, target) = (DVec3::new(x, 0.8, 1.8), DVec3::new(0.5, target_y, 0.5));
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
