//! The device's eye pass against the CPU's, on what both do exactly: diffuse surfaces seen directly.

use std::sync::Arc;

use nephroid::eye_pass::renderer::{EyeQuality, Renderer};
use nephroid::eye_pass::tone_mapping::{auto_exposure_stops, display_rgba8};
use nephroid::eye_pass::{Picture, ToneMap, View, reference};
use nephroid::optics::LinearSrgb;
use nephroid::scene::{SurfaceKind, builtin};
use nephroid::session::BakeSession;
use nephroid::settings::BakeSettings;

use crate::device::gpu;

/// Largest mean difference, in display light with no tone mapping where white is 1, and relative to the mean.
const LARGEST_DIFFERENCE: f64 = 1.0 / 255.0;

/// How two pictures differ on the pixels of a mask.
#[derive(Debug)]
struct Difference {
    /// Mean absolute difference of the bytes shown, white = 1.
    shown: f64,
    /// Mean absolute difference of the radiance over its mean: nothing is cut at white here.
    relative: f64,
}

fn difference(a: &Picture, b: &Picture, mask: &[bool], exposure_stops: f64) -> Difference {
    let [shown_a, shown_b] = [a, b].map(|picture| display_rgba8(picture, exposure_stops, ToneMap::None));
    let (mut shown, mut radiance, mut sum, mut count) = (0.0, 0.0, 0.0, 0.0);
    for pixel in (0..mask.len()).filter(|pixel| mask[*pixel]) {
        for channel in 0..3 {
            shown += f64::from(shown_a[4 * pixel + channel].abs_diff(shown_b[4 * pixel + channel])) / 255.0;
            let [from_a, from_b] = [a, b].map(|picture| f64::from(picture.radiance[pixel][channel]));
            radiance += (from_a - from_b).abs();
            sum += from_b;
            count += 1.0;
        }
    }
    Difference {
        shown: shown / count,
        relative: radiance / sum,
    }
}

/// The picture one pixel to the left.
fn shifted(picture: &Picture) -> Picture {
    let mut radiance = picture.radiance.clone();
    radiance.rotate_left(1);
    Picture {
        radiance,
        ..picture.clone()
    }
}

fn compare(name: &str) {
    let Some(gpu) = gpu() else { return };
    let scene = Arc::new(builtin::build(name).expect("a built-in scene"));
    let mut session = BakeSession::new(scene.clone()).expect("built-in scenes are sound");
    let settings = BakeSettings {
        density_per_sr: 20_000.0,
        ..Default::default()
    };
    let maps = session
        .bake(&settings, &(), &Default::default())
        .expect("it bakes")
        .maps;
    let mut view = View {
        camera: scene.cameras[0].clone(),
        width: 320,
        height: 213,
        exposure_stops: 0.0,
        tone_map: ToneMap::None,
        background: LinearSrgb::BLACK,
    };
    let tracer = session.tracer();
    let on_cpu = reference::render(
        &tracer,
        &maps,
        &view,
        &Default::default(),
        &(),
        &Default::default(),
    );
    let on_cpu = on_cpu.expect("nobody cancels it");
    let mut renderer =
        Renderer::new(&gpu, &scene, wgpu::TextureFormat::Rgba8Unorm, 1).expect("it is uploaded");
    renderer.set_quality(EyeQuality {
        minifies: false,
        ..EyeQuality::STILL
    });
    renderer.set_maps(&gpu, &scene, &maps).expect("the maps fit");
    let on_gpu = renderer.radiance(&gpu, &view).expect("it renders");
    assert_eq!(gpu.take_error(), None);
    view.exposure_stops = auto_exposure_stops(&on_cpu);

    let is_diffuse = |object: usize| scene.material_of(object).surface == SurfaceKind::Diffuse;
    let hits = reference::first_hits(&tracer, &view);
    let mask: Vec<bool> = hits.iter().map(|hit| hit.is_some_and(is_diffuse)).collect();
    let pixels = mask.iter().filter(|diffuse| **diffuse).count();
    assert!(pixels > 2000, "{pixels} diffuse pixels are seen");

    let found = difference(&on_gpu, &on_cpu, &mask, view.exposure_stops);
    assert!(
        found.shown < LARGEST_DIFFERENCE && found.relative < LARGEST_DIFFERENCE,
        "{name}, {pixels} pixels: {found:?}"
    );
    // The comparison sees a slip by one pixel.
    let slipped = difference(&shifted(&on_gpu), &on_cpu, &mask, view.exposure_stops);
    assert!(slipped.relative > LARGEST_DIFFERENCE, "{name}: {slipped:?}");
    log_difference(name, pixels, &found, &slipped);
}

/// The figures, for those who run with `--nocapture`.
fn log_difference(name: &str, pixels: usize, found: &Difference, slipped: &Difference) {
    use std::io::Write as _;
    let _ = writeln!(
        std::io::stdout(),
        "{name}: {pixels} diffuse pixels, {found:?}; a pixel off: {slipped:?}"
    );
}

#[test]
fn ring_looks_the_same_on_both() {
    compare("ring");
}

#[test]
fn mirror_looks_the_same_on_both() {
    compare("mirror");
}
