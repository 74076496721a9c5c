//! Every built-in scene draws without a fault.

use std::sync::Arc;

use nephroid::eye_pass::renderer::render_sampled;
use nephroid::eye_pass::{ToneMap, View};
use nephroid::illumination::IlluminationMap;
use nephroid::optics::LinearSrgb;
use nephroid::scene::{Scene, builtin};
use nephroid::session::BakeSession;
use nephroid::settings::{BakeSettings, MapResolution};

use crate::device::gpu;

/// Maps of few rays: what is drawn is looked at, not measured.
fn quick_maps(scene: Scene) -> Vec<IlluminationMap> {
    // Light goes on and on between the facets of cut glass: its patches would take a minute.
    let base = if scene.name == "bowl" {
        BakeSettings::splat()
    } else {
        BakeSettings::default()
    };
    let settings = BakeSettings {
        density_per_sr: 500.0,
        map_resolution: MapResolution::Fixed {
            width: 64,
            height: 64,
        },
        ..base
    };
    let mut session = BakeSession::new(Arc::new(scene)).expect("built-in scenes are sound");
    session
        .bake(&settings, &(), &Default::default())
        .expect("it bakes")
        .maps
}

#[test]
fn built_in_scenes_draw_without_a_fault_and_show_light() {
    let Some(gpu) = gpu() else { return };
    for name in builtin::NAMES {
        let scene = builtin::build(name).expect("listed");
        let maps = quick_maps(scene.clone());
        let view = View {
            camera: scene.cameras[0].clone(),
            width: 99,
            height: 66,
            exposure_stops: 0.0,
            tone_map: ToneMap::Neutral,
            background: LinearSrgb::BLACK,
        };
        for samples_per_side in [1, 2] {
            let picture = render_sampled(&gpu, &scene, &maps, &view, samples_per_side).expect("it renders");
            assert_eq!(gpu.take_error(), None, "{name}");
            // Light of few wavelengths is no colour of a display: a channel of it may be negative.
            let least = if scene.parts_wavelengths() { f32::MIN } else { 0.0 };
            let finite = picture
                .radiance
                .iter()
                .flatten()
                .all(|channel| channel.is_finite() && *channel >= least);
            let lit = picture.radiance.iter().filter(|pixel| pixel[1] > 0.0).count();
            // So few rays find no slit of a millimetre.
            let is_enough = lit > 99 * 66 / 100 || name == "prism";
            assert!(finite && is_enough, "{name}: {lit} pixels are lit");
        }
    }
}
