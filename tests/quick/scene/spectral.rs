//! Glass, metals and spectra of lamps, as files state them.

use nephroid::bake::Baker;
use nephroid::effect::{Effect, EffectSwitch, EffectSwitches};
use nephroid::error::Result;
use nephroid::optics::Metal;
use nephroid::optics::glass::catalogue;
use nephroid::optics::spectrum::{Spectrum, illuminant};
use nephroid::optics::wavelength::{C_LINE, D_LINE, F_LINE};
use nephroid::plan::EffectLine;

use crate::prelude::*;
use support::glb::load_path;

const SMOOTH: &str = r#"{"metallicFactor": 0, "roughnessFactor": 0}"#;

fn solid(extensions: Value, extras: Value) -> Glb {
    let mut all = json!({
        "KHR_materials_transmission": { "transmissionFactor": 1.0 },
        "KHR_materials_volume": { "thicknessFactor": 0.1 },
    });
    for (name, extension) in extensions.as_object().into_iter().flatten() {
        all[name] = extension.clone();
    }
    Glb::tetrahedron().with_material(json!({
        "name": "glass", "pbrMetallicRoughness": parsed(SMOOTH), "extensions": all, "extras": extras,
    }))
}

fn dispersion(stated: impl Into<Value>) -> Value {
    json!({ "KHR_materials_dispersion": { "dispersion": stated.into() } })
}

fn material(scene: &Scene) -> &Material {
    scene.material_of(0)
}

fn v_d(glass: &Material) -> f64 {
    (glass.ior - 1.0) / (glass.index_at(F_LINE) - glass.index_at(C_LINE))
}

#[test]
fn dispersion_is_20_by_the_abbe_number() {
    let mut extensions = dispersion(20.0 / 57.7);
    extensions["KHR_materials_ior"] = json!({ "ior": 1.635 });
    let scene = solid(extensions, Value::Null).scene();
    let glass = material(&scene);
    assert!(glass.is_dispersive() && glass.ior == 1.635);
    warns_not(&scene);
    assert_close(glass.index_at(D_LINE), 1.635, 1e-12, "index at the d line");
    assert_close(v_d(glass), 57.7, 1e-9, "Abbe number");
    for stated in [json!({ "KHR_materials_dispersion": {} }), dispersion(0.0)] {
        let scene = solid(stated, Value::Null).scene();
        assert!(!material(&scene).is_dispersive() && material(&scene).glass.is_none());
        assert_eq!(material(&scene).index_at(Nanometres(400.0)), 1.5);
        warns_not(&scene);
    }
    let little = solid(dispersion(1e-6), Value::Null).scene();
    assert!(material(&little).is_dispersive(), "however little is some");
    for stated in [json!(-0.1), json!("much"), json!([1.0])] {
        let scene = solid(dispersion(stated), Value::Null).scene();
        warns(
            &scene,
            "material `glass` | dispersion cannot be | read as 0 | Abbe number",
        );
        assert!(!material(&scene).is_dispersive());
    }
}

#[test]
fn dispersion_needs_a_clear_solid() {
    let of = |extensions: Value| {
        let json =
            json!({ "name": "lacquer", "pbrMetallicRoughness": parsed(SMOOTH), "extensions": extensions });
        Glb::tetrahedron().with_material(json)
    };
    let coated = of(dispersion(1.0)).scene();
    assert_eq!(material(&coated).surface, SurfaceKind::Coated);
    assert!(!material(&coated).is_dispersive());
    warns(&coated, "material `lacquer` | transmits no light");
    let mut pane = dispersion(1.0);
    pane["KHR_materials_transmission"] = json!({ "transmissionFactor": 1.0 });
    let pane = of(pane);
    // A pane does not refract.
    let thin = pane.load_with(&options(|options| options.solid_glass = false));
    assert!(!material(&thin.expect("a sound file")).is_dispersive());
    // The same as a solid.
    assert!(material(&pane.scene()).is_dispersive());
}

#[test]
fn glass_in_extras_replaces_index_and_dispersion() {
    let mut extensions = dispersion(5.0);
    extensions["KHR_materials_ior"] = json!({ "ior": 2.0 });
    for (name, n_d, abbe) in [
        // SCHOTT's data sheet of N-BK7; the number says it to three digits; Cauchy's constants by hand.
        ("N-BK7", 1.51680, 64.17),
        ("523588", 1.523, 58.8),
        ("abbe:1.6,40", 1.6, 40.0),
        ("cauchy:1.5,0.004", 1.5 + 0.004 / (0.58756 * 0.58756), f64::NAN),
    ] {
        let scene = solid(extensions.clone(), json!({ "glass": name })).scene();
        let glass = material(&scene);
        assert_close(glass.ior, n_d, 4e-6, name);
        assert_eq!(glass.ior, glass.index_at(D_LINE), "{name}");
        assert!(glass.is_dispersive(), "{name}");
        warns_not(&scene);
        if abbe.is_finite() {
            assert_close(v_d(glass), abbe, 2e-4, name);
        }
    }
    for glass in catalogue::all() {
        let scene = solid(json!({}), json!({ "glass": glass.name })).scene();
        assert_close(material(&scene).ior, glass.dispersion.n_d(), 1e-15, &glass.name);
        assert_eq!(material(&scene).base_colour, LinearSrgb::WHITE);
    }
}

#[test]
fn glass_beyond_its_range_is_named_as_far_as_lamps_go() {
    let glass = || solid(json!({}), json!({ "glass": "N-SF11" }));
    let white = glass().with_light("lamp", json!({ "type": "point" })).scene();
    warns(&white, "material `glass` | N-SF11 | 370 | 360");
    let sodium = json!({ "type": "point", "extras": { "spectrum": "line:589" } });
    warns_not(&glass().with_light("lamp", sodium).scene());
}

#[test]
fn metal_in_extras_is_a_mirror_of_its_colour() {
    let metal = |name: &str| {
        let factors = json!({ "metallicFactor": 0.0, "roughnessFactor": 0.1 });
        let json = json!({ "pbrMetallicRoughness": factors, "extras": { "metal": name } });
        Glb::triangle().with_material(json).scene()
    };
    for name in ["gold", "silver", "copper", "aluminium"] {
        let scene = metal(name);
        let read = material(&scene);
        let table = Metal::by_name(name).expect("a metal");
        assert_eq!((read.surface, read.metal), (SurfaceKind::Mirror, Some(table)));
        let colour = table.reflectance_srgb(1.0);
        let dimmed = colour.max_channel().max(1.0);
        for (channel, of_table) in read.base_colour.to_array().into_iter().zip(colour.to_array()) {
            assert!((0.0..=1.0).contains(&channel), "{name}: {channel}");
            assert_close(channel, of_table / dimmed, 1e-12, name);
        }
    }
    warns(&metal("gold"), "Gold lies outside of sRGB | multiplied by 0.9");
    warns_not(&metal("silver"));
    // glTF's roughness is 1 where a file is silent.
    let silver = json!({ "extras": { "metal": "silver" } });
    let scene = Glb::triangle().with_material(silver).scene();
    warns(&scene, "metal rougher than 0.6 and was read as matte");
}

#[test]
fn unknown_glass_and_metal_are_refused() {
    for (extras, parts) in rows(
        r#"
        {"glass": "N-BK8"} => N-BK8 | N-BK7
        {"glass": "52358"} => 52358 | six digits
        {"glass": "cauchy:1.5"} => cauchy | A, B
        {"glass": 1.5} => `glass` is not text | quotation marks
        {"metal": "tin"} => tin | choose one
        {"metal": null} => `metal` is not text | quotation marks
        {"metal": "gold", "glass": "BK7"} => both | name one
        "#,
    ) {
        let refusal = solid(json!({}), parsed(extras)).refusal();
        says(&refusal, "material `glass`: ");
        says(&refusal, parts);
    }
}

/// A point lamp of 100 cd whose light and node have extras.
fn lamp(of_light: Value, of_node: Value) -> Glb {
    let light = json!({ "type": "point", "intensity": 100.0, "extras": of_light });
    let mut file = Glb::triangle().with_light("lamp", light);
    file.json["nodes"][1]["extras"] = of_node;
    file
}

fn spectrum_of(light: &Light) -> &Spectrum {
    light.spectrum.as_deref().expect("has a spectrum")
}

#[test]
fn lamps_take_the_spectrum_of_node_or_light() {
    let spectrum = |name: &str| json!({ "spectrum": name });
    let a = || spectrum("A");
    for (file, name) in [
        (lamp(a(), Value::Null), "A"),
        (lamp(Value::Null, spectrum("d65")), "D65"),
        (lamp(a(), spectrum("d65")), "D65"),
        (lamp(spectrum("blackbody:2856"), Value::Null), "blackbody:2856"),
        (lamp(spectrum("FL11"), Value::Null), "FL11"),
    ] {
        let scene = file.scene();
        let light = &scene.lights[0];
        let named = illuminant(name).expect("a lamp");
        assert_eq!(spectrum_of(light), &named, "{name}");
        assert_eq!(spectrum_of(light).name(), Some(name));
        assert_close(spectrum_of(light).luminous_flux_lm(), 683.0, 1e-12, "one watt");
        // Candela stay luminous, and the colour is that of the spectrum.
        assert_close(light.strength().luminance(), 100.0 / 683.0, 1e-9, name);
        assert_eq!(light.colour, named.xyz().to_linear_srgb(), "{name}");
    }
    assert_eq!(lamp(Value::Null, Value::Null).scene().lights[0].spectrum, None);
    // Incandescent light is redder than daylight, daylight white to the digits of its table.
    let colour = |extras| lamp(extras, Value::Null).scene().lights[0].colour;
    assert!(colour(a()).r > 1.5 && colour(a()).b < 0.5, "{:?}", colour(a()));
    near(colour(spectrum("d65")), LinearSrgb::WHITE, 1e-3, "daylight");

    let mut file = lamp(spectrum("E"), Value::Null);
    file.json["extensions"]["KHR_lights_punctual"]["lights"][0]["color"] = json!([1.0, 0.0, 0.0]);
    let scene = file.scene();
    warns(&scene, "light `lamp` | colour was left out | spectrum");
    assert_close(scene.lights[0].colour.luminance(), 1.0, 1e-9, "luminance");

    let mut file = Glb::triangle();
    let tube = r#"[{"type": "rect", "size": 1.0, "intensity": 683.0, "extras": {"spectrum": "FL2"}}]"#;
    file.json["extensions"]["EXT_lights_area"]["lights"] = parsed(tube);
    file.push_root(json!({ "name": "tube", "extensions": { "EXT_lights_area": { "light": 0 } } }));
    let flat = &file.scene().lights[0];
    assert_eq!(spectrum_of(flat), &illuminant("FL2").expect("a lamp"));
    assert_close(flat.strength().luminance(), 1.0, 1e-9, "radiance");
}

/// A triangle that glows with 683 cd/m² per channel of its emissive factor, and a spectrum.
fn glowing(spectrum: &str, factor: [f64; 3]) -> Glb {
    Glb::triangle().with_material(json!({
        "name": "glow",
        "pbrMetallicRoughness": { "metallicFactor": 0.0 },
        "emissiveFactor": factor,
        "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 683.0 } },
        "extras": { "spectrum": spectrum },
    }))
}

#[test]
fn what_glows_has_a_spectrum_too() {
    let scene = glowing("FL2", [0.5; 3]).scene();
    let light = &scene.lights[0];
    let named = illuminant("FL2").expect("a lamp");
    assert!(matches!(light.kind, LightKind::Surface { .. }));
    assert_eq!(spectrum_of(light), &named);
    // As bright as stated, in the colour of the spectrum; what is seen is what lights.
    assert_close(light.strength().luminance(), 0.5, 1e-9, "radiance");
    near(light.colour, named.xyz().to_linear_srgb(), 1e-9, "colour");
    near(
        scene.emitted_radiance(0),
        scene.material_of(0).emitted_radiance,
        1e-9,
        "seen",
    );
    warns_not(&scene);

    let coloured = glowing("E", [0.5, 0.25, 0.1]).scene();
    warns(&coloured, "material `glow` | colour of its light was left out");
    let expected = rgb(0.5, 0.25, 0.1).luminance();
    assert_close(
        coloured.lights[0].strength().luminance(),
        expected,
        1e-6,
        "radiance",
    );
    let dark = glowing("E", [0.0; 3]).scene();
    assert!(dark.lights.is_empty());
    warns(&dark, "material `glow` | sends no light");
    says(glowing("D66", [1.0; 3]).refusal(), "material `glow` | D65");
}

/// A file with a lamp of a stated spectrum, in a folder with a table beside it.
fn beside(stated: &str, table: &str, text: &str) -> Result<Scene> {
    let folder = folder();
    let own = folder.path().join("scene");
    std::fs::create_dir(&own).expect("folder can be made");
    std::fs::write(own.join(table), text).expect("file can be written");
    let path = own.join("lamp.glb");
    let file = lamp(json!({ "spectrum": stated }), Value::Null);
    std::fs::write(&path, file.bytes()).expect("file can be written");
    load_path(&path, &LoadOptions::default())
}

#[test]
fn lamps_may_be_measured_in_a_table() {
    let scene = beside("my lamp.CSV", "my lamp.CSV", "nm,W\n500,1\n600,3\n").expect("a sound lamp");
    let spectrum = spectrum_of(&scene.lights[0]);
    assert_eq!(spectrum.wavelengths_nm(), [500.0, 600.0]);
    assert_eq!(spectrum.name(), Some("my lamp.CSV"));
    let [first, last] = [500.0, 600.0].map(|nm| spectrum.at(Nanometres(nm)));
    assert_close(last / first, 3.0, 1e-12, "shape");
    assert_close(spectrum.luminous_flux_lm(), 683.0, 1e-12, "one watt");
    for (stated, table, parts) in [
        ("D66", "", "light `lamp`: | D65"),
        ("blackbody:hot", "", "light `lamp`: | 500 to 25000 K"),
        (
            "lamp.csv",
            "nm,W\n500,1\n400,1\n",
            "`lamp.csv`: line 3 | sort the rows",
        ),
        ("lamp.csv", "nm,W\n900,1\n950,1\n", "`lamp.csv`: | 360 to 830"),
        ("../lamp.csv", "", "light `lamp`: | scene's folder"),
        ("/etc/lamp.csv", "", "light `lamp`: | scene's folder"),
        (
            "https://example.org/lamp.csv",
            "",
            "light `lamp`: | does not name a local file",
        ),
        ("none.csv", "", "none.csv"),
    ] {
        says(beside(stated, "lamp.csv", table).expect_err("no spectrum"), parts);
    }
    let refusal = lamp(json!({ "spectrum": 6500 }), Value::Null).refusal();
    says(refusal, "light `lamp`: its `spectrum` is not text");
}

fn undone(scene: &Scene, edit: &Edit) -> (Scene, Scene) {
    let there = edit.apply(scene).expect("it is in range");
    let back = EditState::of(scene).set(&there);
    (there, back)
}

#[test]
fn edited_indices_keep_the_abbe_number() {
    let scene = solid(json!({}), json!({ "glass": "F2" })).scene();
    let ior = |scene: &Scene, ior| undone(scene, &Edit::Material(0, MaterialEdit::Ior(ior)));
    let (there, back) = ior(&scene, 1.9);
    let v_d = |scene: &Scene| {
        let glass = material(scene).glass.as_ref().expect("a glass");
        glass.dispersion.abbe_number()
    };
    assert_eq!(material(&there).ior, 1.9);
    assert_close(v_d(&there), v_d(&scene), 1e-9, "Abbe number");
    assert_eq!(material(&back).glass, material(&scene).glass);
    assert_eq!(material(&back).ior, material(&scene).ior);
    // By way of 1, where nothing disperses, the number is still known.
    let (without, _) = ior(&there, 1.0);
    let (again, _) = ior(&without, 1.9);
    assert!(!material(&without).is_dispersive());
    near(v_d(&again), 36.4, 0.1, "Abbe number");
}

#[test]
fn edited_colours_take_the_place_of_tables() {
    let gold = r#"{"pbrMetallicRoughness": {"roughnessFactor": 0.0}, "extras": {"metal": "gold"}}"#;
    let lamp = json!({ "type": "point", "extras": { "spectrum": "FL11" } });
    let scene = Glb::triangle()
        .with_material(parsed(gold))
        .with_light("lamp", lamp)
        .scene();
    let colour = rgb(0.1, 0.2, 0.3);
    let tint = Edit::Material(0, MaterialEdit::BaseColour(colour));
    let (there, back) = undone(&scene, &tint);
    assert_eq!(
        (material(&there).base_colour, material(&there).metal),
        (colour, None)
    );
    assert_eq!(material(&back).metal, material(&scene).metal);
    assert_eq!(material(&back).base_colour, material(&scene).base_colour);
    let (there, back) = undone(&scene, &Edit::Light(0, LightEdit::Colour(colour, None)));
    assert_eq!(
        (there.lights[0].colour, &there.lights[0].spectrum),
        (colour, &None)
    );
    assert_eq!(back.lights, scene.lights);
}

fn planned(scene: Scene, switches: EffectSwitches) -> EffectLine {
    let mut session = Baker::new(Arc::new(scene)).expect("a session");
    let settings = with(BakeSettings::default(), |it| it.effects = switches);
    let mut lines = session.plan(&settings).expect("a plan").effects.into_iter();
    lines
        .find(|line| line.effect == Effect::Dispersion)
        .expect("dispersion is planned")
}

#[test]
fn dispersion_needs_a_lit_dispersive_solid() {
    let automatic = |scene| planned(scene, EffectSwitches::default());
    for (name, parts) in rows(
        "prism => `prism` | `light` | Abbe number
         bowl => `bowl` | `lamp` | Abbe number
         ball => no lit solid bends
         mirror => no lit solid bends
         pool => no lit solid bends",
    ) {
        let line = automatic(built_in(name));
        assert_eq!(line.on, ["prism", "bowl"].contains(&name), "{name}");
        says(line.reason, parts);
    }
    // What no light reaches calls for nothing.
    let mut sealed = built_in("bowl");
    let safe = shapes::cuboid(dvec3(-0.2, -0.1, -0.2), dvec3(0.2, 0.2, 0.2));
    parts::add(
        &mut sealed,
        "safe",
        safe,
        parts::matte("steel", LinearSrgb::grey(0.5)),
    );
    assert!(!automatic(sealed).on);
    // The same for a pane of the same glass: it does not bend light.
    let mut pane = built_in("prism");
    let material = pane.objects[1].material;
    (pane.materials[material].volume, pane.materials[material].surface) = (None, SurfaceKind::ThinWall);
    assert!(!automatic(pane).on);

    let switched = |switch| EffectSwitches::default().with(Effect::Dispersion, switch);
    let off = planned(built_in("prism"), switched(EffectSwitch::Off));
    assert_eq!((off.on, off.switch), (false, EffectSwitch::Off));
    says(off.reason, "switched off by the user");
    let forced = planned(built_in("ball"), switched(EffectSwitch::On));
    assert!(forced.on);
    says(forced.reason, "nothing calls for it");
    let without_light = switched(EffectSwitch::On).with(Effect::LightPass, EffectSwitch::Off);
    assert!(!planned(built_in("prism"), without_light).on);
}
