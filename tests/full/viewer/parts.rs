//! Parts of the window without a display: the whole panel on small and on dense screens, lights that are added, scenes that
//! other programs change, frames that are written, exposure, and how long a bake is said to take still.

use std::fs;
use std::time::{Duration, Instant};

use egui::accesskit::Role;
use egui::pos2;
use nephroid::bake::CostPoint;
use nephroid::effect::EffectSwitches;
use nephroid::eye_pass::tone_mapping::display_rgba8;
use nephroid::eye_pass::{self, ToneMap};
use nephroid::optics::spectrum::xyz::IDENTITY;
use nephroid::progress::Stage;
use nephroid::scene::turntable;
use nephroid::settings::{ErrorMetric, Estimator, Sigma};
use nephroid::viewer::ViewerOptions;
use nephroid::viewer::background::Wake;
use nephroid::viewer::command::Command;
use nephroid::viewer::exporting::{ExportState, Exporter};
use nephroid::viewer::files::FilesOptions;
use nephroid::viewer::filming::FilmJob;
use nephroid::viewer::new_light::{NewLight, ViewTarget};
use nephroid::viewer::time_left::{in_words, time_left_s};
use nephroid::viewer::worker::{BakeRequest, BakeState, BakedLevel};

use super::fixtures::{
    act, added, bake, change, edited, folder, model, options, read, scene, set, until, wait_for,
};
use super::headless::{Headless, SCREEN, splats};
use super::scene_file;
use support::prelude::*;
use support::tools;

fn shooting(frames: usize) -> FilmJob {
    let scene = Arc::new(scene());
    let first = Camera::framing("all", scene.bounds().expect("it has surfaces"), 1.5);
    FilmJob {
        maps: Vec::new(),
        cameras: turntable::around(&scene, &first, frames),
        view: View {
            camera: first,
            width: 48,
            height: 32,
            exposure_stops: 0.0,
            tone_map: ToneMap::None,
            background: LinearSrgb::BLACK,
        },
        effects: EffectSwitches::default(),
        white_balance: IDENTITY,
        name: "turntable",
        scene,
    }
}

#[test]
fn filming_can_be_stopped() {
    let folder = folder();
    let mut exporter = Exporter::new(&Wake::new(|| ()));
    exporter.film(shooting(10_000), folder.path().to_owned());
    assert_eq!(
        exporter.state,
        ExportState::Filming {
            done: 0,
            total: 10_000
        }
    );
    std::thread::sleep(Duration::from_millis(300));
    exporter.stop();
    wait_for("the end", || exporter.poll());
    assert!(
        matches!(exporter.state, ExportState::Failed(_)),
        "{:?}",
        exporter.state
    );
}

/// With the layers of a window.
fn with_direct(settings: BakeSettings) -> BakeSettings {
    tools::set(settings, |s| {
        s.layers = vec![LayerKind::Caustic, LayerKind::Direct]
    })
}

#[test]
fn a_film_is_a_folder_of_pictures() {
    let folder = folder();
    let job = FilmJob {
        maps: tools::bake(scene(), &with_direct(tools::settings(1000.0, 64))).maps,
        ..shooting(4)
    };
    let mut exporter = Exporter::new(&Wake::new(|| ()));
    exporter.film(job, folder.path().to_owned());
    wait_for("the end", || exporter.poll());
    let ExportState::Done(written) = &exporter.state else {
        panic!("{:?}", exporter.state)
    };
    let frame = |number: usize| image::open(written.join(format!("frame-{number:05}.png")));
    let frames: Vec<_> = (1..=4)
        .map(|number| frame(number).expect("a PNG").to_rgb8())
        .collect();
    assert!(frame(5).is_err());
    for pair in frames.windows(2) {
        assert_eq!(pair[0].dimensions(), (48, 32));
        let bright = pair[0].pixels().filter(|pixel| pixel.0[1] > 60).count();
        assert!(bright > 100, "{bright} pixels of light");
        let moved = pair[0].pixels().zip(pair[1].pixels());
        let moved = moved.filter(|(a, b)| a.0[1].abs_diff(b.0[1]) > 20).count();
        assert!(moved > 20, "{moved} pixels differ from frame to frame");
    }
}

/// As the window shows it first: neither white nor dark.
#[test]
fn exposure_suits_a_room() {
    let scene = builtin::build("showroom").expect("it is built in");
    let basin = scene.cameras.iter().find(|camera| camera.name == "basin");
    let view = View::new(basin.expect("a camera").clone(), [184, 144]);
    let coarse = BakeSettings {
        error_metric: ErrorMetric::default(),
        ..tools::to(0.5, 64)
    };
    let maps = tools::bake(scene.clone(), &with_direct(coarse)).maps;
    let picture = eye_pass::render(&Arc::new(scene), &maps, &view, &(), &Control::default());
    let picture = picture.expect("a picture");
    let stops = picture.auto_exposure_stops();
    assert!(stops.abs() < 2.0, "{stops}");
    let shown = display_rgba8(&picture, stops, ToneMap::default());
    let share = |is_so: fn(&[u8]) -> bool| {
        let pixels = shown.chunks(4).filter(|rgba| is_so(&rgba[..3]));
        pixels.count() as f64 / (shown.len() / 4) as f64
    };
    let (white, dark) = (share(|rgb| *rgb == [255; 3]), share(|rgb| rgb[1] < 32));
    assert!(white < 0.2 && dark < 0.5, "{white} of it white, {dark} dark");
}

#[test]
fn camera_settings_and_edits_stay() {
    let folder = folder();
    let path = scene_file::gltf(folder.path(), "watched", "300");
    let mut model = model(&ViewerOptions {
        scene: Arc::new(read(&path)),
        files: FilesOptions {
            watch: true,
            ..FilesOptions::default()
        },
        ..options("ring")
    });
    let rough = Edit::Material(1, MaterialEdit::Roughness(0.25));
    act(&mut model, change(rough));
    model.navigator.look(dvec2(100.0, 30.0));
    set(&mut model, |it| {
        (it.settings.seed, it.settings.estimator) = (7, Estimator::Photon)
    });
    bake(&mut model);
    let (gaze, was) = (model.navigator.camera().forward, Arc::clone(model.scene()));

    // Half a file says what is wrong with it, and the scene stays.
    scene_file::break_off(&path);
    until(&mut model, "refused", |model| model.files.refusal.is_some());
    assert!(Arc::ptr_eq(model.scene(), &was));
    let sentence = model.files.refusal.clone().expect("it is refused");
    assert!(sentence.contains("watched.gltf"), "{sentence}");

    // The next change tries again: a lamp ten times as strong.
    scene_file::gltf(folder.path(), "watched", "3000");
    until(&mut model, "read again", |model| {
        !Arc::ptr_eq(model.scene(), &was)
    });
    assert!(model.files.refusal.is_none());
    let times = model.scene().lights[0].kind.strength() / was.lights[0].kind.strength();
    assert!((times - 10.0).abs() < 1e-9, "{times}");
    assert_eq!(model.scene().materials[1].roughness, 0.25, "the edit stays");
    assert_eq!(model.choices.settings.seed, 7);
    assert!(model.navigator.camera().forward.distance(gaze) < 1e-12);
    let [mesh, before] = [model.scene(), &was].map(|scene| scene.objects[0].mesh_in_scene());
    assert!(Arc::ptr_eq(mesh, before), "what is the same is shared");
    assert!(
        !model.maps().is_empty(),
        "shapes are the same, so that there is light meanwhile"
    );

    // So does a change of the buffer alone.
    let now = Arc::clone(model.scene());
    let buffer = folder.path().join("watched.bin");
    let mut bytes = fs::read(&buffer).expect("it is there");
    bytes[..4].copy_from_slice(&(-2.0_f32).to_le_bytes());
    fs::write(&buffer, bytes).expect("it is written");
    until(&mut model, "read again", |model| {
        !Arc::ptr_eq(model.scene(), &now)
    });
    assert_eq!(model.scene().objects[0].mesh_in_scene().positions[0].x, -2.0);
    // A material that is gone takes its edits with it.
    let text = fs::read_to_string(&path).expect("it is there");
    fs::write(&path, text.replace("\"silver\"", "\"gold\"")).expect("it is written");
    until(&mut model, "warned", |model| model.files.warning.is_some());
    let warning = model.files.warning.clone().expect("it is told");
    assert!(warning.contains("`silver`"), "{warning}");
    assert_eq!(model.edits().history().undoable(), 0);
}

#[test]
fn new_lights_have_room_and_suit_the_exposure() {
    for name in ["ring", "ball", "pool", "showroom"] {
        let scene = Arc::new(builtin::build(name).expect("it is built in"));
        let tracer = Tracer::new(Arc::clone(&scene));
        let (low, high) = scene.bounds().expect("there are surfaces");
        let radius_m = 0.5 * (high - low).length();
        let middle = 0.5 * (low + high);
        for from in [dvec3(1.0, 1.2, 1.5), dvec3(-2.0, 0.7, 0.1), DVec3::Y * 2.0] {
            let gaze = Ray {
                origin: middle + from * radius_m,
                direction: -from.normalize(),
            };
            let aim = ViewTarget::of(&tracer, &gaze, middle);
            for stops in [0.0, -3.0] {
                for kind in NewLight::ALL {
                    let light = kind.make((&tracer, radius_m), &aim, stops, &scene);
                    let lit = edited(&scene, &[added(light.clone())]);
                    assert_eq!(lit.lights.len(), scene.lights.len() + 1);
                    assert!(scene.lights.iter().all(|other| other.name != light.name));
                    suits(&tracer, &light, &aim, 4.0 * f64::exp2(-stops));
                }
            }
        }
    }
}

/// Nothing stands between a light and what it is for, which faces it, and its irradiance across the way is that.
fn suits(tracer: &Tracer, light: &Light, aim: &ViewTarget, irradiance_w_m2: f64) {
    let strength = light.kind.strength();
    if let LightKind::Sun { direction, .. } = light.kind {
        assert_eq!(strength, irradiance_w_m2);
        assert!(direction.is_normalized() && direction.y < 0.0);
        return;
    }
    let position = light.kind.position().expect("it has a place");
    let way = aim.point - position;
    assert!(way.dot(aim.normal) < 0.0, "{light:?} is behind {aim:?}");
    let ray = Ray {
        origin: position,
        direction: way.normalize(),
    };
    let met = tracer.intersect(&ray).expect("it is aimed at a surface");
    let share = met.distance_m / way.length();
    assert!((share - 1.0).abs() < 1e-3, "{light:?} is hidden from {aim:?}");
    let per_m2 = way.length_squared().recip();
    let found = match light.kind {
        // Of a panel that is small against its distance: radiance times solid angle.
        LightKind::Panel { across, down, .. } => {
            let normal = across.cross(down);
            assert!(normal.normalize().dot(way.normalize()) > 0.999);
            strength * 4.0 * normal.length() * per_m2
        }
        _ => strength * per_m2,
    };
    assert!((found / irradiance_w_m2 - 1.0).abs() < 1e-9, "{found} W/m²");
    if let LightKind::Spot { direction, .. } = light.kind {
        assert!(direction.dot(way.normalize()) > 1.0 - 1e-9);
    }
}

/// As the program opens it, the same on a dense screen, and the smallest.
const SCREENS: [((f32, f32), f32); 3] = [SCREEN, (SCREEN.0, 2.0), ((700.0, 400.0), 2.0)];

#[test]
fn every_control_says_what_it_does() {
    for screen in SCREENS {
        let mut panel = Headless::opened(splats(), screen);
        // Of the splats' panel all, and what only refining estimators have.
        panel.choose("Bake until", "max time");
        panel.assert_names();
        for (role, name, _) in panel.controls() {
            panel.move_to(pos2(690.0, 300.0));
            panel.settle();
            let before = panel.texts();
            panel.hover(role, &name);
            assert!(
                !panel.texts().is_subset(&before),
                "{role:?} {name:?} says nothing on {screen:?}"
            );
        }
    }
}

#[test]
fn nothing_is_cut_off_or_overlaps() {
    let adaptive = BakeSettings {
        sigma: Sigma::Adaptive,
        density_per_sr: 102_400_000.0,
        ..splats()
    };
    for screen in SCREENS {
        for settings in [splats(), adaptive.clone(), BakeSettings::default()] {
            let mut panel = Headless::opened(settings, screen);
            // With what sets them back beside them.
            let edits = [
                Edit::Light(0, LightEdit::Position(dvec3(-10.75, -20.125, -30.25))),
                Edit::Place(0, Motion::turned(0.0, DVec3::splat(-1.125))),
            ];
            panel.tell(|model| {
                for edit in edits {
                    model.apply(Command::Edit(edit));
                }
            });
            panel.choose("Tone map", "aces");
            panel.click(Role::RadioButton, "caustic");
            panel.assert_layout();
        }
    }
}

fn request(settings: BakeSettings) -> BakeRequest {
    BakeRequest::new(Arc::new(tools::builtin_scene("ring")), settings)
}

/// So many seconds after the start, at a share of a stage that began then.
fn left(wanted: &BakeRequest, level: Option<&BakedLevel>, fraction: f64, seconds: f64) -> Option<f64> {
    let (stage, since) = (Stage::Caustic, Instant::now());
    let state = BakeState::Baking {
        stage,
        fraction,
        since,
    };
    time_left_s(&state, wanted, level, since + Duration::from_secs_f64(seconds))
}

#[test]
fn a_stage_keeps_its_pace_within_a_limit() {
    let limited = |max_time_s| request(tools::set(BakeSettings::default(), |s| s.max_time_s = max_time_s));
    for (max_time_s, expected) in [
        (None, 12.0),
        (Some(10.0), 6.0),
        (Some(100.0), 12.0),
        (Some(3.0), 0.0),
    ] {
        let left = left(&limited(max_time_s), None, 0.25, 4.0).expect("it is known");
        assert!((left - expected).abs() < 1e-9, "{left} s with {max_time_s:?}");
    }
    // Too little is done, or nothing is to be done.
    assert_eq!(left(&limited(None), None, 0.01, 5.0), None);
    assert_eq!(
        time_left_s(&BakeState::Done, &limited(None), None, Instant::now()),
        None
    );
}

#[test]
fn the_course_tells_what_is_left_of_it() {
    let wanted = request(tools::set(BakeSettings::default(), |s| s.max_error = Some(0.01)));
    let point = |cpu_s, error| CostPoint {
        rays: 1000,
        cpu_s,
        wall_s: cpu_s / 2.0,
        bytes: 0,
        error,
        is_by_photons: false,
    };
    let mut level = BakedLevel {
        serial: 1,
        request: wanted.clone(),
        level: 1,
        is_final: false,
        result: tools::bake(tools::builtin_scene("ring"), &tools::to(0.05, 8)),
        seconds: 3.0,
    };
    level.result.course = vec![point(2.0, 0.04), point(6.0, 0.02)];
    let after = |level: &BakedLevel, seconds| left(&wanted, Some(level), 0.5, seconds);
    let at_level = after(&level, 3.0).expect("it is known");
    // Half the error takes more than nothing and, at an exponent of at most 2, at most three times as much again; two
    // threads work.
    assert!(at_level > 0.0 && at_level <= 0.5 * 3.0 * 6.0, "{at_level}");
    // A second later a second less, and never less than none.
    let later = after(&level, 4.0).expect("it is known");
    assert!((at_level - later - 1.0).abs() < 1e-9, "{at_level}, {later}");
    assert_eq!(after(&level, 1e6), Some(0.0));
    // Maps of another bake say nothing of this one.
    level.request.settings.seed = 9;
    assert_eq!(after(&level, 3.0), None);
}

#[test]
fn times_are_told_as_well_as_they_are_known() {
    for (seconds, words) in [
        (0.2, "about a second left"),
        (41.7, "about 42 s left"),
        (130.0, "about 3 min left"),
        (7300.0, "about 3 h left"),
    ] {
        assert_eq!(in_words(seconds), words);
    }
}
