//! Glass, metals and spectra of lamps, as files state them.

use std::path::Path;
use std::sync::Arc;

use glam::DVec3;
use nephroid::effect::{Effect, EffectSwitch, EffectSwitches};
use nephroid::optics::glass::{Dispersion, catalogue};
use nephroid::optics::spectrum::{Spectrum, illuminant};
use nephroid::optics::wavelength::{C_LINE, D_LINE, F_LINE};
use nephroid::optics::{LinearSrgb, Metal, Nanometres};
use nephroid::plan::EffectLine;
use nephroid::scene::builtin::{self, parts, shapes};
use nephroid::scene::{Edit, Light, LightKind, LoadOptions, Material, Scene, SurfaceKind};
use nephroid::session::BakeSession;
use nephroid::settings::BakeSettings;
use serde_json::{Value, json};

use support::glb::{Glb, assert_warned, load_path};
use support::{assert_close, shared_or_skip};

/// A solid of clear glass, with more extensions and extras.
fn solid(extensions: Value, extras: Value) -> Glb {
    let mut all = json!({
        "KHR_materials_transmission": { "transmissionFactor": 1.0 },
        "KHR_materials_volume": { "thicknessFactor": 0.1 },
    });
    for (name, extension) in extensions.as_object().expect("extensions are an object") {
        all[name] = extension.clone();
    }
    let factors = json!({ "metallicFactor": 0.0, "roughnessFactor": 0.0 });
    Glb::tetrahedron().with_material(json!({
        "name": "glass", "pbrMetallicRoughness": factors, "extensions": all, "extras": extras,
    }))
}

fn material(scene: &Scene) -> &Material {
    scene.material_of(0)
}

#[test]
fn dispersion_is_20_by_the_abbe_number() {
    let extensions = json!({
        "KHR_materials_ior": { "ior": 1.635 },
        "KHR_materials_dispersion": { "dispersion": 20.0 / 57.7 },
    });
    let scene = solid(extensions, Value::Null).scene();
    let glass = material(&scene);
    assert!(glass.is_dispersive() && scene.warnings.is_empty());
    assert_eq!(glass.ior, 1.635);
    assert_close(glass.index_at(D_LINE), 1.635, 1e-12, "index at the d line");
    let spread = glass.index_at(F_LINE) - glass.index_at(C_LINE);
    assert_close(0.635 / spread, 57.7, 1e-9, "Abbe number");
}

#[test]
fn without_dispersion_the_index_is_the_same_everywhere() {
    for stated in [json!({}), json!({ "dispersion": 0.0 })] {
        let scene = solid(json!({ "KHR_materials_dispersion": stated }), Value::Null).scene();
        assert!(!material(&scene).is_dispersive() && material(&scene).glass.is_none());
        assert_eq!(material(&scene).index_at(Nanometres(400.0)), 1.5);
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    }
    // However little is some.
    let little = json!({ "KHR_materials_dispersion": { "dispersion": 1e-6 } });
    assert!(material(&solid(little, Value::Null).scene()).is_dispersive());
}

#[test]
fn a_dispersion_that_cannot_be_is_named_and_left_out() {
    for stated in [json!(-0.1), json!("much"), json!([1.0])] {
        let extension = json!({ "KHR_materials_dispersion": { "dispersion": stated } });
        let scene = solid(extension, Value::Null).scene();
        assert_warned(
            &scene,
            &[
                "material `glass`",
                "dispersion cannot be",
                "read as 0",
                "Abbe number",
            ],
        );
        assert!(!material(&scene).is_dispersive());
    }
}

#[test]
fn dispersion_needs_a_solid_that_lets_light_through() {
    let extension = json!({ "KHR_materials_dispersion": { "dispersion": 1.0 } });
    let factors = json!({ "metallicFactor": 0.0, "roughnessFactor": 0.0 });
    let polished = Glb::tetrahedron().with_material(
        json!({ "name": "lacquer", "pbrMetallicRoughness": factors, "extensions": extension }),
    );
    let scene = polished.scene();
    assert_eq!(material(&scene).surface, SurfaceKind::Mixed);
    assert!(!material(&scene).is_dispersive());
    assert_warned(&scene, &["material `lacquer`", "lets no light through"]);

    let mut pane = extension;
    pane["KHR_materials_transmission"] = json!({ "transmissionFactor": 1.0 });
    let pane =
        Glb::tetrahedron().with_material(json!({ "pbrMetallicRoughness": factors, "extensions": pane }));
    assert!(
        !material(&pane.scene()).is_dispersive(),
        "a pane does not refract"
    );
    let options = LoadOptions {
        solid_glass: true,
        ..LoadOptions::default()
    };
    let filled = pane.load_with(&options).expect("a sound file");
    assert!(material(&filled).is_dispersive(), "the same as a solid");
}

#[test]
fn a_glass_in_extras_takes_the_place_of_index_and_dispersion() {
    let extensions = || {
        json!({
            "KHR_materials_ior": { "ior": 2.0 },
            "KHR_materials_dispersion": { "dispersion": 5.0 },
        })
    };
    for (name, n_d, v_d) in [
        // SCHOTT's data sheet of N-BK7; the number says it to three digits; Cauchy's constants by hand.
        ("N-BK7", 1.51680, 64.17),
        ("523588", 1.523, 58.8),
        ("abbe:1.6,40", 1.6, 40.0),
        ("cauchy:1.5,0.004", 1.5 + 0.004 / (0.58756 * 0.58756), f64::NAN),
    ] {
        let scene = solid(extensions(), json!({ "glass": name })).scene();
        let glass = material(&scene);
        assert_close(glass.ior, n_d, 4e-6, name);
        assert_eq!(glass.ior, glass.index_at(D_LINE), "{name}");
        assert!(glass.is_dispersive() && scene.warnings.is_empty(), "{name}");
        if v_d.is_finite() {
            let spread = glass.index_at(F_LINE) - glass.index_at(C_LINE);
            assert_close((glass.ior - 1.0) / spread, v_d, 2e-4, name);
        }
    }
}

#[test]
fn a_glass_beyond_its_range_is_named_as_far_as_the_lamps_go() {
    let glass = || solid(json!({}), json!({ "glass": "N-SF11" }));
    let white = glass().with_light("lamp", json!({ "type": "point" })).scene();
    assert_warned(&white, &["material `glass`", "N-SF11", "370", "360"]);
    let sodium = json!({ "type": "point", "extras": { "spectrum": "line:589" } });
    let yellow = glass().with_light("lamp", sodium).scene();
    assert!(yellow.warnings.is_empty(), "{:?}", yellow.warnings);
}

#[test]
fn a_metal_in_extras_is_a_mirror_of_its_colour() {
    let metal = |name: &str| {
        let factors = json!({ "metallicFactor": 0.0, "roughnessFactor": 0.1 });
        let extras = json!({ "metal": name });
        let file =
            Glb::triangle().with_material(json!({ "pbrMetallicRoughness": factors, "extras": extras }));
        file.scene()
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
    assert_warned(
        &metal("gold"),
        &["Gold lies outside of sRGB", "multiplied by 0.9"],
    );
    assert!(metal("silver").warnings.is_empty());
    // glTF's roughness is 1 where a file is silent.
    let scene = Glb::triangle()
        .with_material(json!({ "extras": { "metal": "silver" } }))
        .scene();
    assert_warned(&scene, &["metal of roughness 1.00, treated as matte"]);
}

#[test]
fn what_is_no_glass_or_metal_is_refused_in_one_sentence() {
    for (extras, parts) in [
        (json!({ "glass": "N-BK8" }), ["N-BK8", "N-BK7"]),
        (json!({ "glass": "52358" }), ["52358", "six digits"]),
        (json!({ "glass": "cauchy:1.5" }), ["cauchy", "A, B"]),
        (json!({ "glass": 1.5 }), ["`glass` is no text", "quotation marks"]),
        (json!({ "metal": "tin" }), ["tin", "choose one"]),
        (
            json!({ "metal": null }),
            ["`metal` is no text", "quotation marks"],
        ),
        (json!({ "metal": "gold", "glass": "BK7" }), ["both", "name one"]),
    ] {
        let refusal = solid(json!({}), extras).refusal();
        assert!(refusal.contains("material `glass`: "), "{refusal}");
        for part in parts {
            assert!(refusal.contains(part), "`{part}` in {refusal}");
        }
    }
}

/// A point lamp of 100 cd whose light and node have extras.
fn lamp(of_light: Value, of_node: Value) -> Glb {
    let light = json!({ "type": "point", "intensity": 100.0, "extras": of_light });
    let mut file = Glb::triangle().with_light("lamp", light);
    let node = file.json["nodes"].as_array().expect("nodes").len() - 1;
    file.json["nodes"][node]["extras"] = of_node;
    file
}

fn spectrum_of(light: &Light) -> &Spectrum {
    light.spectrum.as_deref().expect("has a spectrum")
}

#[test]
fn a_lamp_takes_the_spectrum_of_its_node_or_else_of_its_light() {
    let a = || json!({ "spectrum": "A" });
    let d65 = || json!({ "spectrum": "d65" });
    for (file, name) in [
        (lamp(a(), Value::Null), "A"),
        (lamp(Value::Null, d65()), "D65"),
        (lamp(a(), d65()), "D65"),
        (
            lamp(json!({ "spectrum": "blackbody:2856" }), Value::Null),
            "blackbody:2856",
        ),
        (lamp(json!({ "spectrum": "FL11" }), Value::Null), "FL11"),
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
    assert!(
        colour(d65())
            .to_array()
            .iter()
            .all(|channel| (channel - 1.0).abs() < 1e-3)
    );
}

#[test]
fn flat_lamps_have_spectra_too() {
    let mut file = Glb::triangle();
    file.json["extensions"]["EXT_lights_area"]["lights"] = json!([
        { "type": "rect", "size": 1.0, "intensity": 683.0, "extras": { "spectrum": "FL2" } },
    ]);
    file.push_root(json!({ "name": "tube", "extensions": { "EXT_lights_area": { "light": 0 } } }));
    let scene = file.scene();
    assert_eq!(spectrum_of(&scene.lights[0]), &illuminant("FL2").expect("a lamp"));
    assert_close(scene.lights[0].strength().luminance(), 1.0, 1e-9, "radiance");
}

/// A triangle that glows with 683 cd/m² per channel of its emissive factor, and a spectrum.
fn glowing(spectrum: Value, factor: [f64; 3]) -> Glb {
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
    let scene = glowing(json!("FL2"), [0.5; 3]).scene();
    let light = &scene.lights[0];
    let named = illuminant("FL2").expect("a lamp");
    assert!(matches!(light.kind, LightKind::Surface { .. }));
    assert_eq!(spectrum_of(light), &named);
    // As bright as stated, in the colour of the spectrum.
    assert_close(light.strength().luminance(), 0.5, 1e-9, "radiance");
    let off = light.colour - named.xyz().to_linear_srgb();
    assert!(off.map(f64::abs).max_channel() < 1e-9, "{:?}", light.colour);
    let seen = scene.emitted_radiance(0) - scene.material_of(0).emitted_radiance;
    assert!(
        seen.map(f64::abs).max_channel() < 1e-9,
        "what is seen is what lights"
    );
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
}

#[test]
fn a_glow_says_what_its_spectrum_takes_the_place_of() {
    let coloured = glowing(json!("E"), [0.5, 0.25, 0.1]).scene();
    assert_warned(
        &coloured,
        &["material `glow`", "colour of its light was left out"],
    );
    let expected = LinearSrgb::new(0.5, 0.25, 0.1).luminance();
    assert_close(
        coloured.lights[0].strength().luminance(),
        expected,
        1e-6,
        "radiance",
    );
    let dark = glowing(json!("E"), [0.0; 3]).scene();
    assert!(dark.lights.is_empty());
    assert_warned(&dark, &["material `glow`", "sends no light"]);
    let refusal = glowing(json!("D66"), [1.0; 3]).refusal();
    assert!(
        refusal.contains("material `glow`") && refusal.contains("D65"),
        "{refusal}"
    );
}

#[test]
fn a_colour_beside_a_spectrum_is_left_out_by_name() {
    let mut file = lamp(json!({ "spectrum": "E" }), Value::Null);
    file.json["extensions"]["KHR_lights_punctual"]["lights"][0]["color"] = json!([1.0, 0.0, 0.0]);
    let scene = file.scene();
    assert_warned(&scene, &["light `lamp`", "colour was left out", "spectrum"]);
    assert_close(scene.lights[0].colour.luminance(), 1.0, 1e-9, "luminance");
}

/// A file with a lamp of a stated spectrum, in a folder with others beside it.
fn beside(stated: &str, files: &[(&str, &str)]) -> nephroid::error::Result<Scene> {
    let folder = tempfile::tempdir().expect("temporary folder");
    let own = folder.path().join("scene");
    std::fs::create_dir(&own).expect("folder can be made");
    for (name, text) in files {
        std::fs::write(own.join(name), text).expect("file can be written");
    }
    let path = own.join("lamp.glb");
    let file = lamp(json!({ "spectrum": stated }), Value::Null);
    std::fs::write(&path, file.bytes()).expect("file can be written");
    load_path(&path, &LoadOptions::default())
}

#[test]
fn a_lamp_may_be_measured_in_a_table_beside_the_scene() {
    let table = "nm,W\n500,1\n600,3\n";
    let scene = beside("my lamp.CSV", &[("my lamp.CSV", table)]).expect("a sound lamp");
    let spectrum = spectrum_of(&scene.lights[0]);
    assert_eq!(spectrum.wavelengths_nm(), [500.0, 600.0]);
    assert_eq!(spectrum.name(), Some("my lamp.CSV"));
    let [first, last] = [500.0, 600.0].map(|nm| spectrum.at(Nanometres(nm)));
    assert_close(last / first, 3.0, 1e-12, "shape");
    assert_close(spectrum.luminous_flux_lm(), 683.0, 1e-12, "one watt");
}

#[test]
fn what_is_no_spectrum_is_refused_in_one_sentence() {
    for (stated, table, parts) in [
        ("D66", "", ["light `lamp`: ", "D65"]),
        ("blackbody:hot", "", ["light `lamp`: ", "500 to 25000 K"]),
        (
            "lamp.csv",
            "nm,W\n500,1\n400,1\n",
            ["`lamp.csv`: line 3", "sort the rows"],
        ),
        ("lamp.csv", "nm,W\n900,1\n950,1\n", ["`lamp.csv`: ", "360 to 830"]),
        ("../lamp.csv", "", ["light `lamp`: ", "scene's folder"]),
        ("/etc/lamp.csv", "", ["light `lamp`: ", "scene's folder"]),
        ("https://example.org/lamp.csv", "", ["light `lamp`: ", "scheme"]),
        ("none.csv", "", ["none.csv", ""]),
    ] {
        let refusal = beside(stated, &[("lamp.csv", table)])
            .expect_err("has to be refused")
            .to_string();
        for part in parts {
            assert!(refusal.contains(part), "`{part}` in {refusal}");
        }
    }
    let refusal = lamp(json!({ "spectrum": 6500 }), Value::Null).refusal();
    assert!(
        refusal.contains("light `lamp`: its `spectrum` is no text"),
        "{refusal}"
    );
}

#[test]
fn the_collection_of_dispersive_balls_is_read() {
    let Some(path) = shared_or_skip("scenes/DispersionTest.glb") else {
        return;
    };
    let scene = load_path(Path::new(&path), &LoadOptions::default()).expect("a sound file");
    // Its materials are named by index and by column: 0, 0.5, 1, 2, 5.
    let columns = [("D1", 0.0), ("D2", 0.5), ("D3", 1.0), ("D4", 2.0), ("D5", 5.0)];
    let mut read = 0;
    for material in &scene.materials {
        let Some((_, dispersion)) = columns.iter().find(|(column, _)| material.name.ends_with(column)) else {
            continue;
        };
        read += 1;
        // A body of n = 1 is not there at any wavelength.
        let disperses = *dispersion > 0.0 && material.ior > 1.0;
        assert_eq!(material.is_dispersive(), disperses, "{}", material.name);
        let stated = material.glass.as_ref().map(|glass| glass.dispersion);
        let expected = (*dispersion > 0.0).then(|| Dispersion::from_gltf(material.ior, *dispersion));
        assert_eq!(stated, expected, "{}", material.name);
    }
    assert_eq!(read, 25, "five indices by five dispersions");
}

#[test]
fn every_glass_of_the_catalogue_can_be_in_a_file() {
    for glass in catalogue::all() {
        let scene = solid(json!({}), json!({ "glass": glass.name })).scene();
        assert_close(material(&scene).ior, glass.dispersion.n_d(), 1e-15, &glass.name);
        assert_eq!(material(&scene).base_colour, LinearSrgb::WHITE);
    }
}

#[test]
fn an_edited_index_keeps_the_abbe_number_and_is_taken_back_exactly() {
    let scene = solid(json!({}), json!({ "glass": "F2" })).scene();
    let (there, back) = undone(
        &scene,
        &Edit::MaterialIor {
            material: 0,
            ior: 1.9,
        },
    );
    let v_d = |scene: &Scene| {
        material(scene)
            .glass
            .as_ref()
            .map(|glass| glass.dispersion.abbe_number())
    };
    assert_eq!(material(&there).ior, 1.9);
    assert_close(
        v_d(&there).expect("a glass"),
        v_d(&scene).expect("a glass"),
        1e-9,
        "Abbe number",
    );
    assert_eq!(material(&back).glass, material(&scene).glass);
    assert_eq!(material(&back).ior, material(&scene).ior);
    // By way of 1, where nothing disperses, the number is still known.
    let (without, _) = undone(
        &there,
        &Edit::MaterialIor {
            material: 0,
            ior: 1.0,
        },
    );
    let (again, _) = undone(
        &without,
        &Edit::MaterialIor {
            material: 0,
            ior: 1.9,
        },
    );
    assert!(!material(&without).is_dispersive() && v_d(&again).is_some_and(|v_d| (v_d - 36.4).abs() < 0.1));
}

#[test]
fn an_edited_colour_takes_the_place_of_a_table_and_is_taken_back_exactly() {
    let factors = json!({ "roughnessFactor": 0.0 });
    let gold = json!({ "pbrMetallicRoughness": factors, "extras": { "metal": "gold" } });
    let spectrum = json!({ "type": "point", "extras": { "spectrum": "FL11" } });
    let scene = Glb::triangle()
        .with_material(gold)
        .with_light("lamp", spectrum)
        .scene();
    let base_colour = LinearSrgb::new(0.1, 0.2, 0.3);
    let (there, back) = undone(
        &scene,
        &Edit::MaterialTint {
            material: 0,
            base_colour,
        },
    );
    assert_eq!(
        (material(&there).base_colour, material(&there).metal),
        (base_colour, None)
    );
    assert_eq!(material(&back).metal, material(&scene).metal);
    assert_eq!(material(&back).base_colour, material(&scene).base_colour);
    let edit = Edit::LightColour {
        light: 0,
        colour: base_colour,
    };
    let (there, back) = undone(&scene, &edit);
    assert_eq!(
        (there.lights[0].colour, &there.lights[0].spectrum),
        (base_colour, &None)
    );
    assert_eq!(back.lights, scene.lights);
}

/// The edited scene, and that with the edit taken back.
fn undone(scene: &Scene, edit: &Edit) -> (Scene, Scene) {
    let (there, inverse) = edit.apply(scene).expect("it is in range");
    let (back, _) = inverse.apply(&there).expect("what was, is in range");
    (there, back)
}

fn dispersion_of(scene: Scene, settings: &BakeSettings) -> EffectLine {
    let mut session = BakeSession::new(Arc::new(scene)).expect("a session");
    let plan = session.plan(settings).expect("a plan");
    let line = plan
        .effects
        .into_iter()
        .find(|line| line.effect == Effect::Dispersion);
    line.expect("dispersion is planned")
}

fn built_in(name: &str) -> Scene {
    builtin::build(name).expect("is built in")
}

fn switched(switch: EffectSwitch) -> BakeSettings {
    BakeSettings {
        effects: EffectSwitches::default().with(Effect::Dispersion, switch),
        ..BakeSettings::default()
    }
}

#[test]
fn dispersion_is_called_for_by_a_lit_solid_that_disperses() {
    for (name, object, light) in [("prism", "prism", "light"), ("bowl", "bowl", "lamp")] {
        let line = dispersion_of(built_in(name), &BakeSettings::default());
        assert!(line.on, "{line:?}");
        for part in [format!("`{object}`"), format!("`{light}`"), "Abbe number".into()] {
            assert!(line.reason.contains(&part), "{line:?}");
        }
    }
    for name in ["ball", "mirror", "pool"] {
        let line = dispersion_of(built_in(name), &BakeSettings::default());
        assert!(
            !line.on && line.reason.contains("no lit solid bends"),
            "{name}: {line:?}"
        );
    }
    // What no light reaches calls for nothing.
    let mut sealed = built_in("bowl");
    let safe = shapes::cuboid(DVec3::new(-0.2, -0.1, -0.2), DVec3::new(0.2, 0.2, 0.2));
    parts::add(
        &mut sealed,
        "safe",
        safe,
        parts::matte("steel", LinearSrgb::grey(0.5)),
    );
    let line = dispersion_of(sealed, &BakeSettings::default());
    assert!(!line.on, "{line:?}");
    // The same for a pane of the same glass: it does not bend light.
    let mut pane = built_in("prism");
    let material = pane.objects[1].material;
    pane.materials[material].volume = None;
    pane.materials[material].surface = SurfaceKind::ThinWall;
    assert!(!dispersion_of(pane, &BakeSettings::default()).on);
}

#[test]
fn dispersion_is_switched_like_any_effect() {
    let off = dispersion_of(built_in("prism"), &switched(EffectSwitch::Off));
    assert_eq!((off.on, off.switch), (false, EffectSwitch::Off));
    assert!(off.reason.contains("switched off by the user"));
    let forced = dispersion_of(built_in("ball"), &switched(EffectSwitch::On));
    assert!(
        forced.on && forced.reason.contains("nothing calls for it"),
        "{forced:?}"
    );
    let mut settings = switched(EffectSwitch::On);
    settings.effects.set(Effect::LightPass, EffectSwitch::Off);
    assert!(!dispersion_of(built_in("prism"), &settings).on);
}
