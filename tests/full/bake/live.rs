//! Sessions that live: what a change takes, and that the result is that of a new one, to the last bit. So are shards of a
//! bake that are added up.

use nephroid::bake::{ShardSource, ShardSums, StopReason};
use nephroid::error::Result;
use nephroid::light_pass::shard_index::ShardIndex;
use nephroid::settings::{
    Footprint, ItemBufferKind, Kernel, KernelSampling, RayPlacement, Sigma, Wavelengths,
};

use crate::bake::common::{
    CAUSTIC_AND_DIRECT, assert_fresh, assert_same, automatic, difference, edit, run, session, sized,
    with_layers,
};
use support::hard_scenes::under_square_lamp;
use support::laws::scenes::random;
use support::prelude::*;
use support::tools::{bake, builtin_scene, energy_fault, photons, set, settings, to};

fn moved(object: usize, translation: DVec3) -> Edit {
    Edit::Place(object, Motion::turned(0.0, translation))
}

fn material_of(scene: &Scene, object: &str) -> usize {
    let mut objects = scene.objects.iter();
    objects
        .find(|found| found.name == object)
        .expect("it is there")
        .material
}

type Change = fn(&mut BakeSettings);

fn changed(base: &BakeSettings, change: Change) -> BakeSettings {
    let mut settings = base.clone();
    change(&mut settings);
    settings
}

#[test]
fn another_deposit_of_splats_takes_no_ray() {
    let changes: [Change; 11] = [
        |settings| *settings = sized(settings.clone(), (96, 40)),
        |settings| *settings = automatic(settings.clone()),
        |settings| settings.kernel = Kernel::Cone,
        |settings| settings.kernel_sampling = KernelSampling::Point,
        |settings| settings.sigma = Sigma::Constant(0.3),
        |settings| settings.sigma = Sigma::Adaptive,
        |settings| settings.footprint = Footprint::Fixed,
        |settings| settings.footprint = Footprint::Distance,
        |settings| settings.layers = CAUSTIC_AND_DIRECT.to_vec(),
        |settings| settings.threads = 1,
        |_| {},
    ];
    for (name, rays) in [
        ("ring", RayPlacement::Lattice),
        ("ball", RayPlacement::Jittered),
        ("pool", RayPlacement::Lattice),
    ] {
        let mut scene = builtin_scene(name);
        if name == "ring" {
            scene.lights[0].colour = rgb(1.0, 0.7, 0.2);
        }
        let base = set(settings(1e4, 48), |s| s.rays = rays);
        let mut session = session(&scene);
        assert!(run(&mut session, &base).counts.rays > 0);
        for change in changes {
            let other = changed(&base, change);
            let what = format!("{name}, {other:?}");
            let (kept, _) = assert_fresh(&mut session, &other, &what);
            assert_eq!((kept.counts.rays, kept.counts.segments), (0, 0), "{what}");
            assert_eq!(energy_fault(&kept), None, "{what}");
        }
    }
}

#[test]
fn what_changes_the_rays_traces_them_again() {
    let base = settings(5e3, 32);
    let changes: [Change; 6] = [
        |settings| settings.density_per_sr = 6e3,
        |settings| settings.rays = RayPlacement::Jittered,
        |settings| settings.seed = 1,
        |settings| settings.max_depth = Some(2),
        |settings| settings.branch_threshold = Some(0.01),
        |settings| settings.item_buffer = ItemBufferKind::Cube,
    ];
    let mut session = session(&builtin_scene("ball"));
    for change in changes {
        run(&mut session, &base);
        let other = changed(&base, change);
        let (result, _) = assert_fresh(&mut session, &other, &format!("{other:?}"));
        assert!(result.counts.rays > 0, "{other:?}");
    }
}

/// Some ten thousand arrivals of 56 bytes against a quarter of the memory.
#[test]
fn light_beyond_its_memory_is_not_kept() {
    let mut session = session(&builtin_scene("ring"));
    // Another size than the bake before: its maps are of no use.
    let mut side = 32;
    let mut rays = |memory_bytes: u64| {
        side += 2;
        let settings = set(sized(settings(2e4, 32), (side, side)), |s| {
            s.memory_bytes = memory_bytes
        });
        run(&mut session, &settings).counts.rays
    };
    let (little, much) = (1 << 20, 256 << 20);
    assert!(rays(little) > 0);
    assert!(rays(little) > 0, "it was kept all the same");
    assert!(rays(much) > 0);
    assert_eq!(rays(much), 0);
    // A smaller limit gives back what is kept.
    assert!(rays(little) > 0);
    assert!(rays(much) > 0);
}

#[test]
fn a_cancelled_bake_leaves_nothing_behind() {
    let settings = settings(2e4, 32);
    let mut session = session(&builtin_scene("ring"));
    let control = Control::default();
    control.cancel();
    assert!(session.bake(&settings, &(), &control).expect("a part").partial);
    let (whole, _) = assert_fresh(&mut session, &settings, "after a cancelled one");
    assert!(whole.counts.rays > 0);
}

#[test]
fn dimming_and_smoothing_take_no_work() {
    let scene = builtin_scene("ring");
    let base = with_layers(&CAUSTIC_AND_DIRECT, to(0.02, 96));
    let mut session = session(&scene);
    let first = run(&mut session, &base).counts;
    assert!(first.rays > 0 && first.cells > 0 && first.shadow_rays > 0);
    let LightKind::Point { intensity, .. } = scene.lights[0].kind else {
        panic!("the ring has a point light")
    };
    let dimmer = Edit::Light(0, LightEdit::Strength(0.37 * intensity.0));
    let colour = rgb(1.0, 0.6, 0.2);
    let warmer = Edit::Light(0, LightEdit::Colour(colour, None));
    for (sigma, change) in [(0.0, Some(dimmer)), (0.0, Some(warmer)), (2.5, None)] {
        if let Some(change) = &change {
            edit(&mut session, change);
        }
        let settings = set(base.clone(), |s| s.sigma = Sigma::Constant(sigma));
        let what = format!("sigma {sigma}, {change:?}");
        let (again, _) = assert_fresh(&mut session, &settings, &what);
        assert_eq!(again.counts, Default::default(), "{what}");
        assert_eq!(energy_fault(&again).filter(|_| sigma == 0.0), None);
    }
}

/// Two glass balls over a floor; a lamp above.
fn two_casters() -> Scene {
    let mut scene = parts::reference_scene(2.0);
    for (name, x) in [("left", -0.8), ("right", 0.8)] {
        let ball = shapes::sphere(dvec3(x, 0.5, 0.0), 0.3, 3);
        parts::add(&mut scene, name, ball, parts::dielectric(name, 1.5));
    }
    scene
        .lights
        .push(parts::point_light("lamp", dvec3(0.0, 3.0, 0.0), Flux(12.0)));
    scene.name = "two casters".into();
    scene
}

/// A lamp that is dragged a little leaves the light of the other as it is, whose goals stay what they were.
#[test]
fn an_edit_traces_only_what_it_touches() {
    let mut scene = two_casters();
    scene
        .lights
        .push(parts::point_light("other", dvec3(0.5, 2.5, 0.6), Flux(25.0)));
    let settings = to(0.03, 64);
    let mut session = session(&scene);
    run(&mut session, &settings);
    let change = Edit::Light(1, LightEdit::Position(dvec3(0.49, 2.5, 0.6)));
    edit(&mut session, &change);
    let (now, whole) = assert_fresh(&mut session, &settings, "a lamp moved");
    let share = now.counts.rays as f64 / whole.counts.rays as f64;
    assert!((0.2..0.8).contains(&share), "{share} of the rays");
}

/// The size of a lamp, and the place of an object that glows, are as good as another light.
#[test]
fn a_resized_lamp_and_a_moved_glow_are_seen() {
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
    let settings = with_layers(&[LayerKind::Direct], to(0.03, 32));
    let mut session = session(&scene);
    let mut before = run(&mut session, &settings);
    let size = LightSize::Radius { radius_m: 0.3 };
    for change in [
        Edit::Light(0, LightEdit::Size(size)),
        moved(object, DVec3::X * 0.3),
    ] {
        edit(&mut session, &change);
        let (after, _) = assert_fresh(&mut session, &settings, &format!("{change:?}"));
        assert!(
            difference(&after, &before).is_some(),
            "{change:?} changes nothing"
        );
        before = after;
    }
}

/// Edits and settings in a random order, each bake cancelled at a random place.
struct Storm {
    random: Box<dyn FnMut() -> f64>,
    settings: BakeSettings,
}

impl Storm {
    fn below(&mut self, count: usize) -> usize {
        (self.unit() * count as f64) as usize
    }

    fn unit(&mut self) -> f64 {
        (self.random)()
    }

    /// The next change: of the settings, or an edit.
    fn change(&mut self, scene: &Scene) -> Option<Edit> {
        let spread = dvec3(self.unit(), self.unit(), self.unit()) * 0.2 - 0.1;
        let light = self.below(scene.lights.len());
        let object = 1 + self.below(2);
        match self.below(8) {
            0 => self.settings.sigma = Sigma::Constant(self.unit() * 3.0),
            1 => self.settings.max_error = Some([0.1, 0.05, 0.02][self.below(3)]),
            2 => {
                let side = [48, 64, 96][self.below(3)];
                self.settings = sized(self.settings.clone(), (side, side));
            }
            3 => self.settings.max_depth = Some(2 + self.below(5) as u32),
            4 => {
                return Some(Edit::Light(light, LightEdit::Strength(0.1 + self.unit())));
            }
            5 => {
                let position = scene.lights[light].kind.position()? + spread;
                return Some(Edit::Light(light, LightEdit::Position(position)));
            }
            6 => {
                let (material, ior) = (scene.objects[object].material, 1.2 + 0.6 * self.unit());
                return Some(Edit::Material(material, MaterialEdit::Ior(ior)));
            }
            _ => {
                let motion = Motion::turned(self.unit(), spread * 0.3);
                return Some(Edit::Place(object, motion));
            }
        }
        None
    }
}

#[test]
fn edits_while_baking_leave_nothing_behind() {
    let mut session = session(&two_casters());
    let mut storm = Storm {
        random: Box::new(random(7)),
        settings: to(0.03, 64),
    };
    let (mut cancelled, mut complete) = (0, 0);
    for round in 0..60 {
        if let Some(change) = storm.change(&Scene::clone(session.scene())) {
            edit(&mut session, &change);
        }
        let control = Control::default();
        let budget_ms = storm.below(40) as u64;
        let result = std::thread::scope(|scope| {
            scope.spawn(|| {
                std::thread::sleep(std::time::Duration::from_millis(budget_ms));
                control.cancel();
            });
            session.bake(&storm.settings, &(), &control).expect("a bake")
        });
        if result.stop_reason == StopReason::Cancelled {
            cancelled += 1;
            continue;
        }
        complete += 1;
        if complete % 5 == 0 {
            let fresh = bake(Scene::clone(session.scene()), &storm.settings);
            assert_same(&result, &fresh, &format!("round {round}"));
        }
    }
    assert!(cancelled > 6, "{cancelled} bakes were cut short");
    let (last, _) = assert_fresh(&mut session, &storm.settings, "the last");
    let is_sharp = storm.settings.sigma == Sigma::Constant(0.0);
    assert_eq!(energy_fault(&last).filter(|_| is_sharp), None);
}

#[test]
fn hard_edits_and_back_lose_no_watt() {
    let scene = two_casters();
    let material = material_of(&scene, "left");
    let lamp = |x, y, z| Edit::Light(0, LightEdit::Position(dvec3(x, y, z)));
    let hard = [
        ("a lamp within glass", lamp(-0.8, 0.5, 0.0)),
        ("a lamp in the floor", lamp(0.3, 0.0, 0.2)),
        ("a ball through the other", moved(1, dvec3(1.3, 0.1, 0.05))),
        ("a ball half under the floor", moved(1, dvec3(0.0, -0.5, 0.0))),
        ("a ball beyond all light", moved(1, dvec3(0.0, 0.0, 1e6))),
        ("the floor above the lamp", moved(0, dvec3(0.0, 5.0, 0.0))),
        ("glass like air", Edit::Material(material, MaterialEdit::Ior(1.0))),
        (
            "glass of index 40",
            Edit::Material(material, MaterialEdit::Ior(40.0)),
        ),
        (
            "black glass",
            Edit::Material(material, MaterialEdit::BaseColour(LinearSrgb::BLACK)),
        ),
    ];
    let rough = Edit::Material(material, MaterialEdit::Roughness(1.0));
    let by_bundles = hard.map(|(what, change)| (what, change, to(0.03, 48)));
    let all = by_bundles
        .into_iter()
        .chain([("rough glass", rough, photons(1e3, 48))]);
    for (what, change, settings) in all {
        let untouched = bake(scene.clone(), &settings);
        let mut session = session(&scene);
        run(&mut session, &settings);
        edit(&mut session, &change);
        let (edited, _) = assert_fresh(&mut session, &settings, what);
        assert_eq!(energy_fault(&edited), None, "{what}");
        // And back, as if nothing had been.
        session.set_scene(Arc::new(scene.clone())).expect("a sound scene");
        assert_same(&run(&mut session, &settings), &untouched, what);
    }
}

#[test]
fn no_time_at_all_gives_a_whole_picture() {
    let hurried = BakeSettings {
        max_error: Some(1e-4),
        max_time_s: Some(1e-3),
        ..to(0.03, 64)
    };
    let result = bake(builtin_scene("ring"), &hurried);
    assert_eq!(result.stop_reason, StopReason::MaxTime);
    assert!(!result.partial);
    assert_eq!(result.maps.len(), 1);
    assert_eq!(energy_fault(&result), None);
}

/// Shards in memory.
struct Shards(Vec<ShardSums>);

impl ShardSource for Shards {
    fn shard_count(&self) -> usize {
        self.0.len()
    }

    fn pass_count(&self, shard: usize) -> usize {
        self.0[shard].passes.len()
    }

    fn pass(&self, shard: usize, pass: usize) -> Result<Vec<u8>> {
        Ok(self.0[shard].passes[pass].clone())
    }

    fn name(&self, shard: usize) -> String {
        format!("shard {}", shard + 1)
    }
}

/// All shards, one after the other: none knows what the one before it did.
fn shards(scene: &Scene, settings: &BakeSettings, count: u32) -> Vec<ShardSums> {
    let mut session = session(scene);
    let shard = |number| {
        let share = ShardIndex::new(number, count).expect("a share");
        let shard = session.bake_shard(settings, share, &(), &Control::default());
        shard.expect("a shard")
    };
    (1..=count).map(shard).collect()
}

fn merge(scene: &Scene, settings: &BakeSettings, shards: Vec<ShardSums>) -> Result<Bake> {
    session(scene).merge(settings, Box::new(Shards(shards)), &(), &Control::default())
}

#[track_caller]
fn assert_adds_up(what: &str, scene: &Scene, settings: &BakeSettings, counts: &[u32]) {
    let whole = bake(scene.clone(), settings);
    assert!(whole.counts.rays > 0 && !whole.maps.is_empty(), "{what}");
    for &count in counts {
        let what = format!("{what} in {count} shards");
        let merged = merge(scene, settings, shards(scene, settings, count));
        let merged = merged.expect("they belong together");
        assert_same(&merged, &whole, &what);
        assert_eq!(merged.warnings, whole.warnings, "{what}");
        // Layers of lights and bands, as text: numbers with all their digits.
        let parts = |result: &Bake| format!("{:?} {:?}", result.light_layers, result.band_layers);
        assert!(
            parts(&merged) == parts(&whole),
            "{what}: layers of lights or bands"
        );
    }
}

#[test]
fn shards_add_up_to_the_whole() {
    let per_light = set(with_layers(&LayerKind::ALL, photons(1e5, 24)), |s| {
        s.per_light = true
    });
    let mut scene = builtin_scene("mirror");
    let mut other = scene.lights[0].clone();
    other.colour = rgb(0.2, 1.0, 3.0);
    other.kind = other.kind.moved(dvec3(0.1, 0.2, 0.05));
    scene.lights.push(other);
    let adaptive = set(settings(10_000.0, 32), |s| s.sigma = Sigma::Adaptive);
    // Rays of the first bands are kept, the others are traced again.
    let scarce = set(settings(20_000.0, 16), |s| s.memory_bytes = 1 << 20);
    let bands = BakeSettings {
        wavelengths: Wavelengths::Fixed(3),
        keep_spectrum: true,
        ..photons(1e6, 32)
    };
    let [ring, ball, prism] = ["ring", "ball", "prism"].map(builtin_scene);
    let soft = under_square_lamp("ball", 0.1);
    for (what, scene, settings, counts) in [
        ("each light", &scene, per_light, &[3][..]),
        ("photons", &ball, photons(1e5, 24), &[1, 5]),
        ("splats", &ball, settings(15_000.0, 32), &[4]),
        ("adaptive splats", &ring, adaptive, &[2]),
        ("little memory", &ball, scarce, &[3]),
        ("photons of a spectrum", &prism, photons(1e6, 32), &[3]),
        ("kept bands", &prism, bands, &[3]),
        ("splats of a spectrum", &prism, settings(1e6, 32), &[3]),
        ("soft light", &soft, photons(1e6, 24), &[3]),
    ] {
        assert_adds_up(what, scene, &settings, counts);
    }
}

#[test]
fn what_the_light_decides_is_refused() {
    let scene = builtin_scene("ring");
    type Change = fn(&mut BakeSettings);
    let cases: [(&str, Change); 5] = [
        ("--max-error", |settings| settings.max_error = Some(0.02)),
        ("--max-time", |settings| settings.max_time_s = Some(1.0)),
        ("--map-resolution", |settings| {
            settings.map_resolution = MapResolution::Auto
        }),
        ("--layers", |settings| settings.layers = vec![LayerKind::Direct]),
        ("--memory", |settings| settings.memory_bytes = 1 << 20),
    ];
    for (option, change) in cases {
        let mut settings = photons(1e3, 512);
        change(&mut settings);
        let share = ShardIndex::new(1, 2).expect("a share");
        let refused = session(&scene).bake_shard(&settings, share, &(), &Control::default());
        assert_eq!(refused.expect_err(option).location, option);
        let refused = merge(&scene, &settings, Vec::new()).expect_err(option);
        assert_eq!(refused.location, option);
    }
}
