//! A session that goes on: an edit costs what it touches and nothing more, and its maps are those of a fresh bake, bit
//! for bit.

use std::sync::Arc;

use glam::{DQuat, DVec3};
use nephroid::optics::LinearSrgb;
use nephroid::progress::Control;
use nephroid::scene::builtin::{parts, shapes};
use nephroid::scene::edit::Edit;
use nephroid::scene::{LightKind, LightSize, Scene};
use nephroid::session::{BakeResult, BakeSession, StopReason};
use nephroid::settings::{BakeSettings, LayerKind, MapResolution, Sigma};
use nephroid::units::{Flux, Radiance, RadiantIntensity};
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};

use crate::tools::{at, bits, builtin_scene, energy_fault};

fn session(scene: &Scene) -> BakeSession {
    BakeSession::new(Arc::new(scene.clone())).expect("a session")
}

fn run(session: &mut BakeSession, settings: &BakeSettings) -> BakeResult {
    session.bake(settings, &(), &Control::default()).expect("a bake")
}

fn fresh(scene: &Scene, settings: &BakeSettings) -> BakeResult {
    run(&mut session(scene), settings)
}

/// Applies an edit to a session's scene.
fn edit(session: &mut BakeSession, edit: &Edit) {
    let (scene, _) = edit.apply(session.scene()).expect("a sound edit");
    session.set_scene(Arc::new(scene)).expect("a sound scene");
}

/// What differs between two results beside what they took; `None` where nothing does.
fn difference(a: &BakeResult, b: &BakeResult) -> Option<String> {
    if a.ledgers != b.ledgers {
        return Some(format!("ledgers: {:?} and {:?}", a.ledgers, b.ledgers));
    }
    if a.maps.len() != b.maps.len() {
        return Some(format!("{} and {} maps", a.maps.len(), b.maps.len()));
    }
    if a.estimated_relative_rmse.map(f64::to_bits) != b.estimated_relative_rmse.map(f64::to_bits) {
        return Some(format!(
            "errors: {:?} and {:?}",
            a.estimated_relative_rmse, b.estimated_relative_rmse
        ));
    }
    a.maps.iter().zip(&b.maps).find_map(|(a, b)| {
        let error = |map: &nephroid::illumination::IlluminationMap| {
            let bits = |e: &Vec<f32>| e.iter().map(|e| e.to_bits()).collect::<Vec<_>>();
            map.error.as_ref().map(bits)
        };
        let object = a.chart.object();
        let same = object == b.chart.object()
            && (a.width(), a.height()) == (b.width(), b.height())
            && a.layers.len() == b.layers.len()
            && bits(a) == bits(b);
        if !same {
            return Some(format!("the map of object {object}"));
        }
        (error(a) != error(b)).then(|| format!("the error of object {object}"))
    })
}

#[test]
fn smoothing_and_dimming_take_no_ray_and_no_deposit() {
    let scene = builtin_scene("ring");
    let base = BakeSettings {
        layers: vec![LayerKind::Caustic, LayerKind::Direct],
        ..at(5e3, 96)
    };
    let mut session = session(&scene);
    let first = run(&mut session, &base);
    assert!(first.counts.rays > 0 && first.counts.cells > 0 && first.counts.shadow_rays > 0);
    let LightKind::Point { intensity, .. } = scene.lights[0].kind else {
        panic!("the ring has a point light")
    };
    let edits = [
        Edit::LightIntensity {
            light: 0,
            intensity: RadiantIntensity(0.37 * intensity.0),
        },
        Edit::LightColour {
            light: 0,
            colour: LinearSrgb::new(1.0, 0.6, 0.2),
        },
    ];
    for (sigma, change) in [(0.0, Some(&edits[0])), (0.0, Some(&edits[1])), (2.5, None)] {
        if let Some(change) = change {
            edit(&mut session, change);
        }
        let settings = BakeSettings {
            sigma: Sigma::Constant(sigma),
            ..base.clone()
        };
        let again = run(&mut session, &settings);
        assert_eq!(again.counts, Default::default(), "sigma {sigma}, {change:?}");
        let scene = session.scene().clone();
        assert_eq!(
            difference(&again, &fresh(&scene, &settings)),
            None,
            "sigma {sigma}, {change:?}"
        );
        assert_eq!(energy_fault(&again).filter(|_| sigma == 0.0), None);
    }
}

#[test]
fn rays_of_the_next_nested_level_are_not_traced_again() {
    for name in ["ring", "ball"] {
        let scene = builtin_scene(name);
        let mut session = session(&scene);
        let coarse = run(&mut session, &at(8e3, 64));
        let fine = run(&mut session, &at(3.2e4, 64));
        let whole = fresh(&scene, &at(3.2e4, 64));
        assert_eq!(difference(&fine, &whole), None, "{name}");
        // The finer bake goes through the coarser lattice anyway: together both took what the finer one takes alone.
        assert_eq!(coarse.counts.rays + fine.counts.rays, whole.counts.rays, "{name}");
        assert!(coarse.counts.rays * 5 > whole.counts.rays, "{name}: {coarse:?}");
        // And back: nothing to trace.
        assert_eq!(run(&mut session, &at(8e3, 64)).counts.rays, 0, "{name}");
    }
}

/// Two glass balls over a floor; a lamp above.
fn two_casters() -> Scene {
    let mut scene = parts::reference_scene(2.0);
    for (name, x) in [("left", -0.8), ("right", 0.8)] {
        let ball = shapes::sphere(DVec3::new(x, 0.5, 0.0), 0.3, 3);
        parts::add(&mut scene, name, ball, parts::dielectric(name, 1.5));
    }
    scene
        .lights
        .push(parts::point_light("lamp", DVec3::new(0.0, 3.0, 0.0), Flux(12.0)));
    scene.name = "two casters".into();
    scene
}

#[test]
fn of_two_casters_only_the_one_that_was_moved_is_traced_again() {
    let scene = two_casters();
    let settings = at(5e3, 96);
    let mut session = session(&scene);
    let first = run(&mut session, &settings);
    let object = scene
        .objects
        .iter()
        .position(|object| object.name == "right")
        .expect("a ball");
    edit(
        &mut session,
        &Edit::ObjectMoved {
            object,
            rotation: DQuat::IDENTITY,
            translation: DVec3::new(0.1, 0.05, 0.0),
        },
    );
    let moved = run(&mut session, &settings);
    let edited = session.scene().clone();
    let whole = fresh(&edited, &settings);
    assert_eq!(difference(&moved, &whole), None);
    // Half of the light goes to either ball.
    assert!(moved.counts.rays > 0);
    let share = moved.counts.rays as f64 / whole.counts.rays as f64;
    assert!(share < 0.62, "{share} of the rays, {} before", first.counts.rays);
}

#[test]
fn another_glass_traces_its_own_paths_and_another_tint_none() {
    let scene = two_casters();
    let settings = at(3e3, 64);
    let mut session = session(&scene);
    let first = run(&mut session, &settings);
    let material = scene
        .objects
        .iter()
        .find(|object| object.name == "left")
        .expect("a ball")
        .material;
    edit(&mut session, &Edit::MaterialIor { material, ior: 1.7 });
    let bent = run(&mut session, &settings);
    assert_eq!(
        difference(&bent, &fresh(&session.scene().clone(), &settings)),
        None,
        "ior"
    );
    assert!(
        bent.counts.rays > 0 && bent.counts.rays * 3 < first.counts.rays * 2,
        "{:?}",
        bent.counts
    );
    let base_colour = LinearSrgb::new(0.9, 0.8, 0.95);
    edit(
        &mut session,
        &Edit::MaterialTint {
            material,
            base_colour,
        },
    );
    let tinted = run(&mut session, &settings);
    assert_eq!(
        difference(&tinted, &fresh(&session.scene().clone(), &settings)),
        None,
        "tint"
    );
    // Only branches that another tint lifts over the threshold are new.
    assert!(tinted.counts.rays * 20 < first.counts.rays, "{:?}", tinted.counts);
}

#[test]
fn a_moved_light_is_traced_again_and_the_other_is_not() {
    let mut scene = two_casters();
    scene
        .lights
        .push(parts::point_light("other", DVec3::new(0.5, 2.5, 0.6), Flux(25.0)));
    let settings = at(2e3, 64);
    let mut session = session(&scene);
    let first = run(&mut session, &settings);
    let position = DVec3::new(0.1, 2.6, 0.5);
    edit(&mut session, &Edit::LightPosition { light: 1, position });
    let moved = run(&mut session, &settings);
    assert_eq!(
        difference(&moved, &fresh(&session.scene().clone(), &settings)),
        None
    );
    let share = moved.counts.rays as f64 / first.counts.rays as f64;
    assert!((0.3..0.7).contains(&share), "{share} of the rays of both lights");
}

/// The size of a lamp, and the place of an object that glows, are as good as another light.
#[test]
fn a_light_of_another_size_or_whose_surface_moved_is_looked_for_again() {
    let mut scene = builtin_scene("ball");
    let patch = shapes::floor([-0.1, 0.1], [-0.1, 0.1], 1.5);
    let mut glow = parts::matte("glow", LinearSrgb::BLACK);
    glow.emitted_radiance = LinearSrgb::WHITE;
    parts::add(&mut scene, "glow", patch, glow);
    let object = scene.objects.len() - 1;
    let mut lamp = scene.lights[0].clone();
    lamp.kind = LightKind::Surface {
        object,
        radiance: Radiance(1.0),
    };
    scene.lights.push(lamp);
    let settings = BakeSettings {
        layers: vec![LayerKind::Direct],
        ..at(1e3, 32)
    };
    let mut session = session(&scene);
    let mut before = run(&mut session, &settings);
    let size = LightSize::Radius { radius_m: 0.3 };
    let larger = Edit::LightSize { light: 0, size };
    let moved = Edit::ObjectMoved {
        object,
        rotation: DQuat::IDENTITY,
        translation: DVec3::X * 0.3,
    };
    for change in [larger, moved] {
        edit(&mut session, &change);
        let after = run(&mut session, &settings);
        let whole = fresh(&session.scene().clone(), &settings);
        assert_eq!(difference(&after, &whole), None, "{change:?}");
        assert!(
            difference(&after, &before).is_some(),
            "{change:?} changes something"
        );
        before = after;
    }
}

#[test]
fn a_deeper_path_traces_only_what_goes_deeper() {
    let scene = builtin_scene("ball");
    let with = |max_depth| BakeSettings {
        max_depth,
        ..at(2e3, 64)
    };
    let mut session = session(&scene);
    run(&mut session, &with(3));
    let deeper = run(&mut session, &with(8));
    let whole = fresh(&scene, &with(8));
    assert_eq!(difference(&deeper, &whole), None);
    assert!(
        deeper.counts.segments < whole.counts.segments,
        "{} of {} segments",
        deeper.counts.segments,
        whole.counts.segments
    );
    assert_eq!(run(&mut session, &with(3)).counts.rays, 0);
}

/// Edits and settings in a random order, each bake cancelled at a random place.
struct Storm {
    random: Pcg64Mcg,
    settings: BakeSettings,
}

impl Storm {
    fn below(&mut self, count: u64) -> u64 {
        self.random.next_u64() % count
    }

    fn unit(&mut self) -> f64 {
        (self.random.next_u64() >> 11) as f64 * (-53_f64).exp2()
    }

    /// The next change: of the settings, or an edit.
    fn change(&mut self, scene: &Scene) -> Option<Edit> {
        let spread = |storm: &mut Self| DVec3::new(storm.unit(), storm.unit(), storm.unit()) * 0.2 - 0.1;
        match self.below(8) {
            0 => self.settings.sigma = Sigma::Constant(self.unit() * 3.0),
            1 => self.settings.density_per_sr = [500.0, 2e3, 8e3][self.below(3) as usize],
            2 => {
                let side = [48, 64, 96][self.below(3) as usize];
                self.settings.map_resolution = MapResolution::Fixed {
                    width: side,
                    height: side,
                };
            }
            3 => self.settings.max_depth = 2 + self.below(5) as u32,
            4 => {
                return Some(Edit::LightIntensity {
                    light: self.below(scene.lights.len() as u64) as usize,
                    intensity: RadiantIntensity(0.1 + self.unit()),
                });
            }
            5 => {
                let light = self.below(scene.lights.len() as u64) as usize;
                let (LightKind::Point { position, .. } | LightKind::Spot { position, .. }) =
                    scene.lights[light].kind
                else {
                    return None;
                };
                return Some(Edit::LightPosition {
                    light,
                    position: position + spread(self),
                });
            }
            6 => {
                return Some(Edit::MaterialIor {
                    material: scene.objects[1 + self.below(2) as usize].material,
                    ior: 1.2 + 0.6 * self.unit(),
                });
            }
            _ => {
                return Some(Edit::ObjectMoved {
                    object: 1 + self.below(2) as usize,
                    rotation: DQuat::from_rotation_y(self.unit()),
                    translation: spread(self) * 0.3,
                });
            }
        }
        None
    }
}

#[test]
fn a_hundred_edits_while_baking_end_at_a_fresh_bakes_maps_and_leave_nothing_behind() {
    let scene = two_casters();
    let mut session = session(&scene);
    let mut storm = Storm {
        random: Pcg64Mcg::seed_from_u64(7),
        settings: at(2e3, 64),
    };
    let (mut cancelled, mut complete) = (0, 0);
    for round in 0..100 {
        if let Some(change) = storm.change(&session.scene().clone()) {
            edit(&mut session, &change);
        }
        let control = Control::default();
        let budget = storm.below(40);
        let result = std::thread::scope(|scope| {
            let stopper = &control;
            scope.spawn(move || {
                std::thread::sleep(std::time::Duration::from_millis(budget));
                stopper.cancel();
            });
            session.bake(&storm.settings, &(), &control).expect("a bake")
        });
        if result.stop_reason == StopReason::Cancelled {
            cancelled += 1;
        } else {
            complete += 1;
            if round % 10 == 0 {
                let scene = session.scene().clone();
                assert_eq!(
                    difference(&result, &fresh(&scene, &storm.settings)),
                    None,
                    "round {round}"
                );
            }
        }
    }
    println!("{cancelled} bakes were cut short, {complete} ran to their end");
    assert!(cancelled > 10, "{cancelled} bakes were cut short");
    let last = run(&mut session, &storm.settings);
    let scene = session.scene().clone();
    assert_eq!(difference(&last, &fresh(&scene, &storm.settings)), None);
    assert_eq!(
        energy_fault(&last).filter(|_| storm.settings.sigma == Sigma::Constant(0.0)),
        None
    );
}

#[test]
fn hard_edits_end_at_a_fresh_bakes_bits_and_lose_no_watt() {
    let scene = two_casters();
    let glass = scene.objects[1].material;
    let moved = |object: usize, translation: DVec3| Edit::ObjectMoved {
        object,
        rotation: DQuat::IDENTITY,
        translation,
    };
    let hard = [
        (
            "a lamp within glass",
            Edit::LightPosition {
                light: 0,
                position: DVec3::new(-0.8, 0.5, 0.0),
            },
        ),
        (
            "a lamp in the floor",
            Edit::LightPosition {
                light: 0,
                position: DVec3::new(0.3, 0.0, 0.2),
            },
        ),
        ("a ball through the other", moved(1, DVec3::new(1.3, 0.1, 0.05))),
        (
            "a ball half under the floor",
            moved(1, DVec3::new(0.0, -0.5, 0.0)),
        ),
        ("a ball beyond all light", moved(1, DVec3::new(0.0, 0.0, 1e6))),
        ("the floor above the lamp", moved(0, DVec3::new(0.0, 5.0, 0.0))),
        (
            "glass like air",
            Edit::MaterialIor {
                material: glass,
                ior: 1.0,
            },
        ),
        (
            "glass of index 40",
            Edit::MaterialIor {
                material: glass,
                ior: 40.0,
            },
        ),
        (
            "black glass",
            Edit::MaterialTint {
                material: glass,
                base_colour: LinearSrgb::BLACK,
            },
        ),
        (
            "rough glass",
            Edit::MaterialRoughness {
                material: glass,
                roughness: 1.0,
            },
        ),
    ];
    let settings = at(1e3, 48);
    for (what, change) in hard {
        let mut session = session(&scene);
        run(&mut session, &settings);
        edit(&mut session, &change);
        let edited = run(&mut session, &settings);
        let whole = fresh(&session.scene().clone(), &settings);
        assert_eq!(difference(&edited, &whole), None, "{what}");
        assert_eq!(energy_fault(&edited), None, "{what}");
        // And back, as if nothing had been.
        session.set_scene(Arc::new(scene.clone())).expect("a sound scene");
        let back = run(&mut session, &settings);
        assert_eq!(
            difference(&back, &fresh(&scene, &settings)),
            None,
            "{what}, taken back"
        );
    }
}

#[test]
fn no_time_at_all_still_gives_a_whole_picture() {
    let scene = builtin_scene("ring");
    let hurried = BakeSettings {
        max_error: Some(1e-4),
        max_time_s: Some(1e-3),
        ..at(1.6e3, 64)
    };
    let result = fresh(&scene, &hurried);
    assert_eq!(result.stop_reason, StopReason::MaxTime);
    assert!(!result.partial);
    assert_eq!(result.maps.len(), 1);
    assert_eq!(energy_fault(&result), None);
}
