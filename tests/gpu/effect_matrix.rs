//! A dozen scenes against the eye's chains: where nothing specular is in view they take no pipeline, no byte and no ray,
//! counted where the work is done; where something is they take some, and without them the picture is another.

use std::sync::{Arc, LazyLock};

use nephroid::effect::{Effect, EffectSwitch, EffectSwitches};
use nephroid::eye_pass::reference::{self, ChainLimits, EyeRays, ReferenceSettings};
use nephroid::eye_pass::renderer::{EyeCounts, render_counted};
use nephroid::eye_pass::{Picture, ToneMap, View};
use nephroid::gpu::Gpu;
use nephroid::illumination::IlluminationMap;
use nephroid::optics::LinearSrgb;
use nephroid::plan;
use nephroid::scene::Scene;
use nephroid::session::BakeSession;
use nephroid::settings::{BakeSettings, MapResolution};
use nephroid::transport::Tracer;

use crate::device::gpu;
use crate::effect_scenes::{EffectScene, all};

/// Switches that look for chains, and the one that does not.
const SWITCHES: [EffectSwitch; 3] = [EffectSwitch::Auto, EffectSwitch::On, EffectSwitch::Off];

/// All scenes, baked once for all tests.
static SHOWN: LazyLock<Vec<Shown>> = LazyLock::new(|| all().iter().map(Shown::new).collect());

/// A scene, lit, from its own first camera.
struct Shown {
    name: &'static str,
    scene: Arc<Scene>,
    maps: Vec<IlluminationMap>,
    view: View,
    /// Whether anything specular is in view.
    in_view: bool,
    /// Whether a pixel's centre sees something specular: nothing opaque hides it.
    visible: bool,
}

impl Shown {
    fn new(case: &EffectScene) -> Self {
        let settings = BakeSettings {
            density_per_sr: 3_000.0,
            map_resolution: MapResolution::Fixed {
                width: 32,
                height: 32,
            },
            layers: case.layers.clone(),
            ..BakeSettings::default()
        };
        let scene = Arc::new(case.scene.clone());
        let mut session = BakeSession::new(scene.clone()).expect("a session");
        let baked = session.bake(&settings, &(), &Default::default());
        let view = View {
            camera: scene.cameras[0].clone(),
            width: 96,
            height: 64,
            exposure_stops: 0.0,
            tone_map: ToneMap::None,
            background: LinearSrgb::new(0.5, 0.6, 0.7),
        };
        let hits = reference::first_hits(&session.tracer(), &view);
        let is_specular = |object: usize| scene.material_of(object).surface.is_specular();
        Self {
            name: case.name,
            visible: hits.into_iter().flatten().any(is_specular),
            in_view: case.shows_specular,
            maps: baked.expect("a bake").maps,
            view,
            scene,
        }
    }

    fn by_gpu(&self, gpu: &Gpu, chains: EffectSwitch) -> (Picture, EyeCounts) {
        let effects = EffectSwitches::default().with(Effect::Chains, chains);
        render_counted(gpu, &self.scene, &self.maps, &self.view, 1, &effects).expect("it renders")
    }

    fn by_cpu(&self, switch: EffectSwitch) -> (Picture, EyeRays) {
        let settings = ReferenceSettings {
            limits: ChainLimits {
                switch,
                ..ChainLimits::default()
            },
            ..ReferenceSettings::default()
        };
        let tracer = Tracer::new(self.scene.clone());
        let maps = &self.maps;
        reference::render_counted(&tracer, maps, &self.view, &settings, &(), &Default::default())
            .expect("nobody cancels it")
    }
}

fn bits(picture: &Picture) -> Vec<u32> {
    let channels = picture.radiance.iter().flatten();
    channels.map(|channel| channel.to_bits()).collect()
}

#[test]
fn scenes_of_both_kinds_are_there_and_one_hides_what_is_in_view() {
    let shown = &*SHOWN;
    assert!(shown.len() >= 11);
    assert!(shown.iter().filter(|shown| !shown.in_view).count() >= 3);
    assert!(shown.iter().filter(|shown| shown.visible).count() >= 6);
    let hidden = shown.iter().filter(|shown| shown.in_view && !shown.visible);
    assert_eq!(
        hidden.map(|shown| shown.name).collect::<Vec<_>>(),
        ["glass unlit"]
    );
    assert!(shown.iter().all(|shown| shown.in_view || !shown.visible));
    let dark = shown
        .iter()
        .filter(|shown| shown.visible && shown.maps.is_empty());
    assert_eq!(dark.map(|shown| shown.name).collect::<Vec<_>>(), ["no light"]);
}

#[test]
fn the_plan_says_what_is_in_view() {
    for case in all() {
        let camera = &case.scene.cameras[0];
        for (switch, expected) in SWITCHES.into_iter().zip([case.shows_specular, true, false]) {
            let line = plan::chains(&case.scene, Some((camera, 1.5)), switch);
            assert_eq!(line.on, expected, "`{}`, {switch:?}: {}", case.name, line.reason);
        }
    }
}

#[test]
fn the_card_makes_and_draws_for_chains_what_is_in_view() {
    let Some(gpu) = gpu() else { return };
    let mut faults = Vec::new();
    for shown in SHOWN.iter() {
        let [(auto, took), (on, _), (off, left)] = SWITCHES.map(|switch| shown.by_gpu(&gpu, switch));
        let specular = |counts: &EyeCounts| {
            [
                counts.specular_pipelines,
                counts.chain_bytes,
                counts.drawn_specular,
            ]
        };
        let mut check = |holds: bool, what: String| {
            if !holds {
                faults.push(format!("`{}`: {what}", shown.name));
            }
        };
        let took = specular(&took);
        check(
            took.iter().all(|count| (*count > 0) == shown.in_view),
            format!("{took:?}"),
        );
        check(
            specular(&left) == [0; 3],
            format!("off, yet {:?}", specular(&left)),
        );
        check(bits(&auto) == bits(&on), "another picture on than on auto".into());
        check(
            (bits(&auto) != bits(&off)) == shown.visible,
            format!("visible: {}, but off is no such picture", shown.visible),
        );
    }
    assert!(faults.is_empty(), "{faults:#?}");
}

#[test]
fn the_reference_traces_chains_where_something_specular_is_seen() {
    let mut faults = Vec::new();
    for shown in SHOWN.iter() {
        let [(auto, took), (on, forced), (off, left)] = SWITCHES.map(|switch| shown.by_cpu(switch));
        let mut check = |holds: bool, what: String| {
            if !holds {
                faults.push(format!("`{}`: {what}", shown.name));
            }
        };
        check((took.chain_rays > 0) == shown.visible, format!("{took:?}"));
        check(left.chain_rays == 0, format!("off, yet {left:?}"));
        check(
            took == forced && bits(&auto) == bits(&on),
            format!("{took:?} on auto, {forced:?} on"),
        );
        check(
            (bits(&auto) != bits(&off)) == shown.visible,
            format!("visible: {}, but off is no such picture", shown.visible),
        );
        check(took.camera_rays == 96 * 64, format!("{took:?}"));
    }
    assert!(faults.is_empty(), "{faults:#?}");
}
