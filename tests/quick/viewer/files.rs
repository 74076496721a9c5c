//! Opening scenes while the window is open, and an edited scene as a file: the original, with nothing changed but what was
//! edited.

use nephroid::optics::Glass;
use nephroid::optics::spectrum::illuminant;
use nephroid::optics::wavelength::D_LINE;
use nephroid::viewer::files::{MAX_RECENT as MOST, Recent, typed};

use super::fixtures::read;
use super::*;
use support::scenes::wave;

fn model() -> (Model, tempfile::TempDir) {
    let folder = folder();
    let mut model = fixtures::model(&ViewerOptions {
        event_log: Some(folder.path().join("log")),
        ..options("ring")
    });
    act(&mut model, change(intensity(0, 77.0)));
    bake(&mut model);
    (model, folder)
}

fn opened(folder: &tempfile::TempDir) -> Vec<String> {
    let mut events = events(&folder.path().join("log"));
    events.retain(|event| event["event"] == "opened");
    let scene = |event: &Value| event["scene"].as_str().expect("a name").to_owned();
    events.iter().map(scene).collect()
}

#[test]
fn another_scene_takes_the_place_of_the_first() {
    let (mut model, folder) = model();
    assert_eq!(model.edits().history().undoable(), 1);
    let ring = Arc::clone(model.scene());
    let path = scene_file::glb(folder.path(), "second", "100");
    model.open(&format!(" \"{}\" ", path.display()));
    // The first stays until the other is there.
    assert!(Arc::ptr_eq(model.scene(), &ring));
    until(&mut model, "opened", |model| model.scene().name == "second");
    assert_eq!(model.edits().history().undoable(), 0);
    assert!(Arc::ptr_eq(model.edits().loaded(), model.scene()));
    // Its maps are its own.
    bake(&mut model);
    let path = path.canonicalize().expect("it is there");
    assert_eq!(model.files.recent.paths(), [path]);
    // What is asked for while another is being read takes its place.
    model.open("builtin:slab");
    model.open("builtin:ball");
    until(&mut model, "opened", |model| model.scene().name == "ball");
    assert_eq!(opened(&folder), ["second", "ball"]);
    // Built-in scenes are no files.
    assert_eq!(model.files.recent.paths().len(), 1);
}

#[test]
fn a_refused_file_leaves_all_as_it_was() {
    let (mut model, folder) = model();
    let scene = Arc::clone(model.scene());
    let last = model.last.clone().expect("it was baked");
    let broken = scene_file::no_scene(folder.path()).display().to_string();
    for source in [&broken, "no such file.glb", "builtin:nothing"] {
        model.open(source);
        until(&mut model, "refused", |model| model.files.refusal.is_some());
        let sentence = model.files.refusal.clone().expect("it is refused");
        assert!(sentence.contains(source), "{sentence}");
        assert!(model.files.loading().is_none());
        assert!(Arc::ptr_eq(model.scene(), &scene));
        assert!(Arc::ptr_eq(model.last.as_ref().expect("it was baked"), &last));
        assert_eq!(model.edits().history().undoable(), 1);
    }
    assert_eq!(opened(&folder), [""; 0]);
    model.open("  ");
    assert!(model.files.loading().is_none(), "nothing was typed");
}

#[test]
fn recent_files_are_newest_first_and_there() {
    let folder = folder();
    let path = |index: usize| {
        let path = folder.path().join(format!("{index}.glb"));
        fs::write(&path, "").expect("it is written");
        path.canonicalize().expect("it is there")
    };
    let paths: Vec<_> = (0..MOST + 2).map(path).collect();
    let mut recent = Recent::default();
    for path in &paths {
        recent.opened(&path.display().to_string());
    }
    assert!(recent.paths().iter().eq(paths.iter().rev().take(MOST)));
    // By another spelling it is the same file.
    recent.opened(&format!("{}/./5.glb", folder.path().display()));
    assert_eq!(recent.paths()[0], paths[5]);
    assert_eq!(recent.paths().len(), MOST);
    fs::remove_file(&paths[5]).expect("it was there");
    assert_eq!(Recent::of(recent.paths().to_vec()).paths().len(), MOST - 1);
    recent.opened("builtin:ring");
    recent.opened("gone.glb");
    assert_eq!(recent.paths().len(), MOST, "neither is a file");
}

#[test]
fn paths_are_taken_as_pasted() {
    let home = std::env::var("HOME").expect("tests run in a home");
    let at_home = format!("{}/x.glb", home.trim_end_matches('/'));
    for (text, meant) in [
        (" a b.glb\n", "a b.glb"),
        ("\"C:\\x.glb\"", "C:\\x.glb"),
        ("'x.glb'", "x.glb"),
        ("\"x.glb", "\"x.glb"),
        ("builtin:ring", "builtin:ring"),
        ("", ""),
        ("~/x.glb", &at_home),
    ] {
        assert_eq!(typed(text), meant);
    }
}

#[test]
fn panel_opens_paths_and_builtin_scenes() {
    let mut panel = Headless::new(BakeSettings::splat());
    panel.open("Scene");
    let field = panel.find(Role::TextInput, |_| true).expect("a field").rect();
    assert!(field.width() > 150.0, "a path has room there: {field:?}");
    panel.click_at(field.center());
    panel.type_text("x.glb");
    assert_eq!(panel.asked(), [Command::Open("x.glb".into())]);
    panel.press("Built-in");
    panel.press("slab");
    assert_eq!(panel.asked(), [Command::Open("builtin:slab".into())]);
    panel.press("Open…");
    assert_eq!(panel.asked(), [Command::Browse]);
    assert!(!panel.says("The graphics device was lost"));
    panel.tell(|model| {
        model.picture.lost_device = true;
        model.open("y.glb");
        model.files.refusal = Some("y.glb: is no scene".into());
    });
    panel.assert_says(&[
        "loading y.glb …",
        "y.glb: is no scene",
        "device was lost and came back",
    ]);
}

/// Everything that can be edited of the scene, without a look at what stands in its file.
fn edits() -> Vec<Edit> {
    let moved = |object, yaw_rad, way| Edit::Place(object, Motion::turned(yaw_rad, way));
    let light = |edit| Edit::Light(0, edit);
    let waves = Some(Waves::new(vec![wave(0.01, 0.25, DVec3::X, 0.5)]).expect("it is one"));
    vec![
        light(LightEdit::Strength(2.5)),
        light(LightEdit::Position(dvec3(0.25, 2.0, 0.5))),
        light(LightEdit::Colour(rgb(1.0, 0.5, 0.25), None)),
        light(LightEdit::Size(LightSize::Radius { radius_m: 0.05 })),
        Edit::Material(0, MaterialEdit::BaseColour(rgb(0.1, 0.2, 0.3))),
        Edit::Material(1, MaterialEdit::Roughness(0.25)),
        Edit::Material(1, MaterialEdit::Waves(waves)),
        moved(1, 0.3, dvec3(0.1, 0.2, -0.3)),
        moved(0, 0.0, dvec3(0.0, -0.125, 0.0)),
    ]
}

/// A scene that is read back is the one that was saved: lights and materials to what 32-bit numbers hold.
fn assert_same(read: &Scene, saved: &Scene) {
    assert_eq!(read.objects.len(), saved.objects.len());
    for (a, b) in read.objects.iter().zip(&saved.objects) {
        assert_eq!(a.name, b.name);
        for (a, b) in a
            .mesh_in_scene()
            .positions
            .iter()
            .zip(&b.mesh_in_scene().positions)
        {
            near(*a, *b, 1e-9, "corner");
        }
    }
    for (a, b) in read.materials.iter().zip(&saved.materials) {
        near(
            [a.roughness, a.ior],
            [b.roughness, b.ior],
            1e-6,
            "roughness, index",
        );
        near(a.base_colour, b.base_colour, 1e-6, "tint");
        assert_eq!((a.surface, &a.waves), (b.surface, &b.waves));
    }
    assert_eq!(read.lights.len(), saved.lights.len());
    for (a, b) in read.lights.iter().zip(&saved.lights) {
        near(a.kind.strength() / b.kind.strength(), 1.0, 1e-6, "strength");
        assert_eq!((a.size, &a.spectrum), (b.size, &b.spectrum));
        let places = a.kind.position().zip(b.kind.position());
        assert!(places.is_none_or(|(a, b)| a.distance(b) < 1e-9));
    }
}

/// Saves a scene to a folder of its own and reads it back, with the text of the file.
fn saved(loaded: &Scene, scene: &Scene) -> (Scene, String) {
    let folder = folder();
    let target = folder.path().join("saved.glb");
    save(&target, loaded, scene, &LoadOptions::default()).expect("it is saved");
    assert_eq!(fs::read_dir(folder.path()).expect("it is there").count(), 1);
    let read = read(&target);
    assert_same(&read, scene);
    (read, scene_file::text_of(&target))
}

/// What the program does not know, as it is written again.
const UNKNOWN: [&str; 7] = [
    r#""VENDOR_invented_thing":{"deep":[1.5,1.0,{"x":"café"}],"big":1.2345678901234568e+22}"#,
    r#""generator":"Hand & Co""#,
    r#""VENDOR_invented_thing":{"of":"lamp"}"#,
    r#""extras":{"note":"kept"}"#,
    r#""VENDOR":{"a":1.1}"#,
    r#""name":"bulb""#,
    r#""rotation":[0.0,0.3826834323650898,0.0,0.9238795325112867]"#,
];

#[test]
fn edits_are_read_back_and_the_unknown_stays() {
    let folder = folder();
    let target = folder.path().join("same.glb");
    let source = scene_file::glb(folder.path(), "a", "300");
    let loaded = read(&source);
    save(&target, &loaded, &loaded, &LoadOptions::default()).expect("it is saved");
    let [a, b] = [&source, &target].map(|path| fs::read(path).expect("it is there"));
    assert_eq!(a, b, "without an edit the file stays the same");
    for source in [source, scene_file::gltf(folder.path(), "b", "300")] {
        let loaded = read(&source);
        let (_, text) = saved(&loaded, &edited(&loaded, &edits()));
        for unknown in UNKNOWN {
            assert!(text.contains(unknown), "{unknown} in {text}");
        }
        let value: Value = serde_json::from_str(text.trim_end()).expect("it is JSON");
        assert_eq!(value["nodes"][1]["name"], "frame");
        assert_eq!(value["nodes"][1].as_object().map(|node| node.len()), Some(4));
    }
}

/// A `.gltf` whose text differs in this from that of [`scene_file::gltf`].
fn changed(folder: &Path, changes: &[(&str, &str)]) -> Scene {
    scene_file::gltf(folder, "a", "300");
    let mut text = scene_file::json_text("300", Some("a.bin"));
    for (from, to) in changes {
        assert!(text.contains(from), "{from} in {text}");
        text = text.replace(from, to);
    }
    let source = folder.join("changed.gltf");
    fs::write(&source, text).expect("it is written");
    read(&source)
}

#[test]
fn glass_spectra_and_directions_are_saved() {
    let folder = folder();
    let spot = (
        r#""type":"point""#,
        r#""type":"spot","spot":{"outerConeAngle":0.5}"#,
    );
    let plain = (r#""metallicFactor":1.0"#, r#""metallicFactor":0.0"#);
    let loaded = changed(folder.path(), &[spot, plain]);
    let lamp = Arc::new(illuminant("A").expect("it is known"));
    let direction = dvec3(0.2, -1.0, 0.1);
    for glass in [
        Glass::parse("N-BK7").expect("it is known"),
        Glass::with_abbe_number(1.7, 30.0),
    ] {
        let substance = MaterialEdit::Substance {
            ior: glass.dispersion.index(D_LINE),
            glass: Some(Arc::new(glass.clone())),
            base_colour: loaded.materials[1].base_colour,
            metal: None,
        };
        let colour = lamp.xyz().to_linear_srgb();
        let edits = [
            Edit::Material(1, substance),
            Edit::Light(0, LightEdit::Colour(colour, Some(Arc::clone(&lamp)))),
            Edit::Light(0, LightEdit::Direction(direction)),
        ];
        let (read, _) = saved(&loaded, &edited(&loaded, &edits));
        let found = read.materials[1].glass.as_ref().expect("it is of glass");
        for nm in [450.0, 650.0].map(Nanometres) {
            let off = found.dispersion.index(nm) - glass.dispersion.index(nm);
            assert!(off.abs() < 1e-6, "{off} at {nm:?}");
        }
        let LightKind::Spot { direction: found, .. } = read.lights[0].kind else {
            panic!("{:?}", read.lights[0])
        };
        near(found, direction.normalize(), 1e-9, "direction");
    }
}

#[test]
fn a_shared_lamp_gets_an_entry_of_its_own() {
    let folder = folder();
    let twin = r#""of":"lamp"}}},{"name":"twin","translation":[0,2,0],"extensions":{"KHR_lights_punctual":{"light":0}}}"#;
    let nodes = (r#""nodes":[0,1,3]}"#, r#""nodes":[0,1,3,4]}"#);
    let loaded = changed(folder.path(), &[nodes, (r#""of":"lamp"}}}"#, twin)]);
    assert_eq!(loaded.lights.len(), 2);
    saved(&loaded, &edited(&loaded, &[intensity(1, 9.0)]));
}

#[test]
fn what_no_file_can_hold_is_refused() {
    let folder = folder();
    let source = scene_file::glb(folder.path(), "a", "300");
    let loaded = read(&source);
    let mut squeezed = loaded.clone();
    let mesh = squeezed.objects[1].mesh_in_scene_mut();
    mesh.positions.iter_mut().for_each(|corner| corner.y *= 0.5);
    let ring = built_in("ring");
    let target = folder.path().join("saved.glb");
    let refusal = |loaded: &Scene, scene: &Scene| {
        let refused = save(&target, loaded, scene, &LoadOptions::default()).expect_err("it is impossible");
        assert!(!target.exists());
        refused.to_string()
    };
    says(refusal(&loaded, &squeezed), "object `mirror`");
    says(refusal(&ring, &ring), "built in");
    // Another program took the mirror away in between.
    fs::copy(scene_file::no_scene(folder.path()), &source).expect("it is written");
    refusal(&loaded, &loaded);
}
