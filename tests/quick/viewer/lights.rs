//! Lights that are added and removed in the window, the brightest spot, and where light lands, as it is drawn over the
//! picture.

use nephroid::illumination::{Chart, Receiver};
use nephroid::light_pass::sketch::{SketchLimits, sketch};
use nephroid::scene::load::save;
use nephroid::viewer::brightest;
use nephroid::viewer::new_light::ViewTarget;

use super::fixtures::added;
use super::*;

fn lamp(name: &str) -> Light {
    parts::point_light(name, dvec3(0.3, 2.0, 0.1), Flux(30.0))
}

/// The first is dimmed, the second taken out, two come, and of these the first goes again and the second moves.
fn edits() -> Vec<Edit> {
    vec![
        Edit::Light(0, LightEdit::Colour(rgb(1.0, 0.5, 0.25), None)),
        added(lamp("new")),
        added(lamp("newer")),
        Edit::RemoveLight(1),
        Edit::RemoveLight(2),
        Edit::Light(2, LightEdit::Position(dvec3(-0.5, 1.5, 0.25))),
    ]
}

#[test]
fn each_change_of_lights_is_one_step() {
    let loaded = Arc::new(fixtures::scene());
    let mut edits_of = EditedScene::new(Arc::clone(&loaded));
    let choices = &mut Choices::new(BakeSettings::default());
    let state = |of: &EditedScene| (of.scene().lights.clone(), of.scene().light_list.clone());
    let mut states = vec![state(&edits_of)];
    for edit in edits() {
        edits_of.edit(&edit).expect("it can be edited");
        states.push(state(&edits_of));
    }
    let scene = edits_of.scene();
    let names: Vec<&str> = scene.lights.iter().map(|light| light.name.as_str()).collect();
    assert_eq!(names, ["lamp", "spot", "newer"]);
    assert_eq!(
        [1, 2].map(|light| scene.original_light_index(light)),
        [Some(2), None]
    );
    // As it came, and not as it is now.
    assert_eq!(scene.original_light(2, &loaded), &lamp("newer"));
    for before in states.iter().rev().skip(1) {
        edits_of.step(true, choices).expect("it is taken back");
        assert_eq!(state(&edits_of), *before);
    }
    for after in &states[1..] {
        edits_of.step(false, choices).expect("it is done again");
        assert_eq!(state(&edits_of), *after);
    }
    for what in ["position of `newer`", "removal of `new`"] {
        assert_eq!(edits_of.history().next_undo(), Some(what));
        edits_of.step(true, choices).expect("it is taken back");
    }
}

#[test]
fn kept_changes_lead_to_the_same_lights() {
    let loaded = fixtures::scene();
    let now = edited(&loaded, &edits());
    let changes = Change::diff(&loaded, &now);
    let text = serde_json::to_string(&changes).expect("it can be written");
    let read: Vec<Change> = serde_json::from_str(&text).expect("it can be read");
    let again = read
        .iter()
        .map(|change| change.for_scene(&loaded).expect("it has a place"));
    let again = edited(&loaded, &again.collect::<Vec<_>>());
    assert_eq!(again.lights, now.lights);
    assert_eq!(again.light_list.removed, now.light_list.removed);
    // A file that was saved with them needs none of it.
    assert_eq!(read.iter().filter(|change| change.is_done_in(&now)).count(), 2);
    assert!(!read.iter().any(|change| change.is_done_in(&loaded)));
}

fn read(path: &Path, default_light: bool) -> Scene {
    let options = crate::prelude::options(|options| options.default_light = default_light);
    Scene::load(&path.display().to_string(), &options).expect("it is read")
}

#[test]
fn lights_come_into_files_and_go_from_them() {
    let folder = folder();
    let loaded = read(&scene_file::glb(folder.path(), "a", "300"), false);
    let tracer = Tracer::new(Arc::new(loaded.clone()));
    let aim = ViewTarget {
        point: dvec3(0.2, 0.0, 0.4),
        normal: DVec3::Y,
        to_eye: dvec3(0.6, 0.8, 0.0),
    };
    let mut scene = loaded.clone();
    for kind in NewLight::ALL {
        let light = kind.make((&tracer, 2.0), &aim, 0.0, &scene);
        scene = edited(&scene, &[added(light)]);
    }
    scene = edited(&scene, &[Edit::RemoveLight(0)]);
    let target = folder.path().join("saved.glb");
    save(&target, &loaded, &scene, &LoadOptions::default()).expect("it is saved");
    let again = read(&target, false);
    assert_eq!(again.lights.len(), 4);
    for (is, saved) in again.lights.iter().zip(&scene.lights) {
        assert_eq!(is.name, saved.name);
        near(is.kind.strength() / saved.kind.strength(), 1.0, 1e-6, &is.name);
        for (a, b) in vectors(&is.kind).into_iter().zip(vectors(&saved.kind)) {
            near(a, b, 1e-6, &is.name);
        }
    }
}

fn vectors(kind: &LightKind) -> Vec<DVec3> {
    let mut vectors: Vec<DVec3> = kind.position().into_iter().collect();
    match *kind {
        LightKind::Sun { direction, .. } => vectors.push(direction),
        LightKind::Panel { across, down, .. } => vectors.extend([across, down]),
        LightKind::Spot {
            direction,
            inner_cone_rad,
            outer_cone_rad,
            ..
        } => vectors.extend([direction, dvec3(inner_cone_rad, outer_cone_rad, 0.0)]),
        _ => {}
    }
    vectors
}

/// A file without light has the program's sun in the window. The file gets it when it is edited, or when other light
/// comes, with which nobody would give the file a sun any more.
#[test]
fn default_sun_is_written_when_it_must_be() {
    let folder = folder();
    // A lamp without power is none.
    let source = scene_file::glb(folder.path(), "dark", "0");
    assert!(read(&source, false).lights.is_empty());
    let loaded = read(&source, true);
    let target = folder.path().join("saved.glb");
    let turn = Edit::Light(0, LightEdit::Direction(dvec3(0.3, -0.9, 0.2)));
    let comes = added(lamp("new"));
    for (edits, expected) in [
        (vec![], 0),
        (vec![turn], 1),
        (vec![comes.clone()], 2),
        (vec![comes, Edit::RemoveLight(0)], 1),
    ] {
        let scene = edited(&loaded, &edits);
        save(&target, &loaded, &scene, &LoadOptions::default()).expect("it is saved");
        assert_eq!(read(&target, false).lights.len(), expected, "{edits:?}");
    }
}

/// Two triangles over the whole map of a floor of 4 m × 2 m, in which one texel is the brightest.
#[test]
fn brightest_texel_is_found_where_it_lies() {
    let mut scene = Scene::default();
    let corners = [(-2.0, -1.0), (-2.0, 1.0), (2.0, 1.0), (2.0, -1.0)];
    let mesh = Mesh {
        positions: corners.map(|(x, z)| dvec3(x, 0.0, z)).to_vec(),
        normals: vec![DVec3::Y; 4],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    };
    parts::add(
        &mut scene,
        "floor",
        mesh,
        parts::matte("grey", LinearSrgb::WHITE * 0.5),
    );
    let uv = corners.map(|(x, z)| dvec2(0.25 * (x + 2.0), 0.5 * (z + 1.0)));
    let map = |receiver: Receiver, texel: usize, value: f32| {
        let mut irradiance = vec![[0.5; 3]; 32];
        irradiance[texel] = [value; 3];
        let chart = Chart {
            receiver,
            corner_uvs: vec![[uv[0], uv[1], uv[2]], [uv[0], uv[2], uv[3]]],
            ..(*chart(0, 8, 4, vec![0.25])).clone()
        };
        caustic(Arc::new(chart), irradiance)
    };
    let maps = [map(Receiver::front(0), 13, 2.0), map(Receiver::back(0), 22, 3.0)];
    for (maps, x, z, normal, w_m2) in [
        (&maps[..1], 0.75, -0.25, DVec3::Y, 2.0),
        // Column 6, row 2, seen from below.
        (&maps[..], 1.25, 0.25, DVec3::NEG_Y, 3.0),
    ] {
        let spot = brightest::find(&scene, maps).expect("there is light");
        near(spot.point, dvec3(x, 0.0, z), 1e-12, "spot");
        assert_eq!(spot.normal, normal);
        near(spot.irradiance_w_m2, w_m2, 1e-6, "irradiance");
    }
    assert_eq!(brightest::find(&scene, &[]), None);
}

#[test]
fn window_adds_a_light_and_tells_the_brightest() {
    let mut model = fixtures::model(&with(options("ring"), |it| it.exposure_stops = Some(0.0)));
    let before = model.scene().lights.len();
    let asked = vec![Command::AddLight(NewLight::Spot)];
    act(&mut model, asked);
    until(&mut model, "the light", |model| {
        model.scene().lights.len() > before
    });
    assert_eq!(model.edits().history().next_undo(), Some("`spot`, a new light"));
    bake(&mut model);
    let asked = vec![Command::Brightest];
    act(&mut model, asked);
    until(&mut model, "the answer", |model| {
        model.probed().is_some_and(|probed| probed.explanation.is_some())
    });
    let probed = model.probed().expect("it is told");
    let texel = probed.texel.as_ref().expect("light is baked there");
    let values = model.maps().iter().flat_map(IlluminationMap::total);
    let luminance = |value: [f32; 3]| LinearSrgb::from(value.map(f64::from)).luminance();
    let most = values.map(luminance).fold(0.0, f64::max);
    near(texel.total_w_m2() / most, 1.0, 1e-5, texel);
    let camera = model.navigator.camera();
    let way = (probed.point - camera.position).normalize();
    assert!(
        camera.forward.dot(way) > 1.0 - 1e-9 && camera.is_sound(),
        "{camera:?}"
    );
}

const LIMITS: SketchLimits = SketchLimits {
    max_depth: 8,
    branch_threshold: 0.05,
    cells: 3000,
};

fn tracer(name: &str) -> Arc<Tracer> {
    Arc::new(Tracer::new(options(name).scene))
}

/// Mirrored at it, rays from the lamp go straight: landings lie on lines from the lamp's image through the mirror.
#[test]
fn flat_mirrors_send_light_as_from_an_image() {
    let tracer = tracer("mirror");
    let scene = tracer.scene();
    let found = sketch(&tracer, LIMITS, &Control::default());
    assert!(
        found.rays > 500 && !found.patches.is_empty(),
        "{} rays",
        found.rays
    );
    let is_mirror = |object: &usize| scene.material_of(*object).surface == SurfaceKind::Mirror;
    let mirror = (0..scene.objects.len())
        .find(is_mirror)
        .expect("there is a mirror");
    let mirror = scene.objects[mirror].mesh_in_scene();
    let [a, b, c] = mirror.corners(0);
    let normal = (b - a).cross(c - a).normalize();
    let (low, high) = mirror.bounds().expect("it has corners");
    for landing in &found.landings {
        let lamp = scene.lights[landing.light].kind.position().expect("it is a lamp");
        let image = lamp - normal * (2.0 * (lamp - a).dot(normal));
        let way = landing.point - image;
        let share = (a - image).dot(normal) / way.dot(normal);
        let met = image + way * share;
        let margin = DVec3::splat(1e-6);
        let within = met.cmpge(low - margin).all() && met.cmple(high + margin).all();
        assert!((0.0..=1.0).contains(&share) && within, "{landing:?} over {met}");
    }
}
