//! Materials, images, lights and cameras from files.

use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, FRAC_PI_4};

use nephroid::scene::AlphaMask;

use crate::prelude::*;
use support::floors::image;

fn material(json: Value) -> (Material, Scene) {
    let by_file = options(|options| options.solid_glass = false);
    let scene = Glb::tetrahedron()
        .with_material(json)
        .load_with(&by_file)
        .expect("loads");
    (scene.material_of(0).clone(), scene)
}

fn factors(metallic: f64, roughness: f64) -> Value {
    json!({ "metallicFactor": metallic, "roughnessFactor": roughness })
}

#[test]
fn surfaces_are_classified() {
    let clear = json!({ "KHR_materials_transmission": { "transmissionFactor": 1.0 } });
    let with_thickness = |thickness: f64| {
        let mut solid = clear.clone();
        solid["KHR_materials_volume"] = json!({ "thicknessFactor": thickness });
        solid
    };
    let [solid, flat, broken] = [0.1, 0.0, -1.0].map(with_thickness);
    let (none, unlit) = (json!({}), json!({ "KHR_materials_unlit": {} }));
    use SurfaceKind::{Coated, Dielectric, Diffuse, Mirror, ThinWall};
    for (metallic, roughness, extensions, expected, warned) in [
        (1.0, 0.0, &none, Mirror, ""),
        (0.5, 0.3, &none, Mirror, ""),
        (1.0, 0.6, &none, Mirror, ""),
        (1.0, 0.61, &none, Diffuse, "is a metal rougher than 0.6"),
        (1.0, 1.0, &none, Diffuse, ""),
        (0.0, 1.0, &none, Diffuse, ""),
        (0.0, 0.1, &none, Coated, ""),
        (0.0, 0.0, &unlit, Diffuse, ""),
        (0.0, 0.0, &solid, Dielectric, ""),
        (0.0, 0.0, &clear, ThinWall, "thin pane"),
        (0.0, 0.0, &flat, ThinWall, "thin pane"),
        (0.0, 0.0, &broken, ThinWall, "thickness of -1 was read as 0"),
        (0.0, 0.31, &none, Diffuse, ""),
        (0.0, 0.6, &solid, Dielectric, ""),
        (0.0, 1.0, &solid, Dielectric, ""),
    ] {
        let factors = factors(metallic, roughness);
        let json = json!({ "name": "m", "pbrMetallicRoughness": factors, "extensions": extensions });
        let (read, scene) = material(json.clone());
        assert_eq!(read.surface, expected, "{json}");
        assert_eq!(read.volume.is_some(), expected == Dielectric, "{json}");
        match warned {
            "" => warns_not(&scene),
            words => warns(&scene, &format!("material `m` | {words}")),
        }
    }
    // As glTF has it.
    for scene in [
        Glb::triangle().scene(),
        Glb::triangle().with_material(json!({})).scene(),
    ] {
        let read = scene.material_of(0);
        assert_eq!((read.surface, read.base_colour), (Diffuse, LinearSrgb::WHITE));
        warns_not(&scene);
    }
}

#[test]
fn volumes_indices_and_emission_have_units() {
    let (read, _) = material(json!({
        "emissiveFactor": [1.0, 0.5, 0.0],
        "pbrMetallicRoughness": factors(0.0, 0.0),
        "extensions": {
            "KHR_materials_transmission": { "transmissionFactor": 1.0 },
            "KHR_materials_ior": { "ior": 1.33 },
            "KHR_materials_emissive_strength": { "emissiveStrength": 683.0 },
            "KHR_materials_volume": {
                "thicknessFactor": 1.0, "attenuationDistance": 0.007, "attenuationColor": [0.9, 0.5, 0.0],
            },
        },
    }));
    assert_eq!(read.ior, 1.33);
    assert_eq!(read.emitted_radiance.to_array(), [1.0, 0.5, 0.0]);
    let volume = read.volume.expect("has a volume");
    assert_eq!(volume.attenuation_distance_m, 0.007);
    assert_eq!(volume.attenuation_colour.to_array(), [0.9, 0.5, 1e-6]);
}

#[test]
fn values_out_of_range_are_brought_back() {
    for (ior, words) in [
        (0.0, "full reflection"),
        (0.5, "index of 0.5"),
        (-1.0, "index of -1"),
    ] {
        let (read, scene) = material(json!({ "extensions": { "KHR_materials_ior": { "ior": ior } } }));
        assert_eq!(read.ior, 1.5);
        warns(&scene, &format!("{words} | was read as 1.5"));
    }
    for distance in [0.0, -1.0] {
        let volume = json!({ "thicknessFactor": 0.1, "attenuationDistance": distance });
        let (_, scene) = material(json!({ "extensions": { "KHR_materials_volume": volume } }));
        warns(&scene, "attenuation distance | was read as infinite");
    }
    let (read, scene) = material(json!({
        "name": "m",
        "pbrMetallicRoughness": { "baseColorFactor": [2.0, -1.0, 0.5, 1.0], "roughnessFactor": 7.0 },
    }));
    assert_eq!(read.base_colour.to_array(), [1.0, 0.0, 0.5]);
    assert_eq!(read.roughness, 1.0);
    warns(&scene, "material `m` | base colour of 2 was read as 1");
    warns(&scene, "material `m` | roughness factor of 7");
}

#[test]
fn closed_meshes_of_glass_are_solid_unless_asked_otherwise() {
    let glass = json!({
        "name": "glass",
        "pbrMetallicRoughness": factors(0.0, 0.0),
        "extensions": { "KHR_materials_transmission": { "transmissionFactor": 1.0 } },
    });
    let thin = options(|options| options.solid_glass = false);
    let closed = Glb::tetrahedron().with_material(glass.clone());
    for (file, options, expected) in [
        (&closed, &LoadOptions::default(), SurfaceKind::Dielectric),
        (&closed, &thin, SurfaceKind::ThinWall),
        (
            &Glb::triangle().with_material(glass),
            &LoadOptions::default(),
            SurfaceKind::ThinWall,
        ),
    ] {
        let scene = file.load_with(options).expect("loads");
        let read = scene.material_of(0);
        let is_solid = expected == SurfaceKind::Dielectric;
        assert_eq!((read.surface, read.name.as_str()), (expected, "glass"));
        assert_eq!(
            (read.volume.is_some(), read.is_solid_by_shape),
            (is_solid, is_solid)
        );
        if is_solid {
            warns_not(&scene);
        } else {
            warns(&scene, "material `glass` | thin pane");
        }
    }
    // One material on both: the first mesh has it, the other a twin.
    let mut both = closed;
    let opened = both.json["meshes"][0].clone();
    let mesh = both.push("meshes", opened);
    let three = both.push_indices(&[0, 1, 2]);
    both.json["meshes"][mesh]["primitives"][0]["indices"] = json!(three);
    both.push_root(json!({ "mesh": mesh }));
    let scene = both.scene();
    let kinds = [0, 1].map(|object| scene.material_of(object).surface);
    assert_eq!(kinds, [SurfaceKind::Dielectric, SurfaceKind::ThinWall]);
    assert_eq!(scene.material_of(1).name, "glass (thin)");
}

fn png(pixels: &[[u8; 4]], width: u32) -> Vec<u8> {
    let raw = pixels.concat();
    let image = image::RgbaImage::from_raw(width, pixels.len() as u32 / width, raw).expect("sizes fit");
    let mut bytes = std::io::Cursor::new(Vec::new());
    image
        .write_to(&mut bytes, image::ImageFormat::Png)
        .expect("encodes");
    bytes.into_inner()
}

fn textured(image: &[u8], texture_info: Value) -> Glb {
    let mut file = Glb::triangle();
    let view = file.push_view(image);
    let picture = json!({ "name": "picture", "bufferView": view, "mimeType": "image/png" });
    file.push("images", picture);
    file.push("textures", json!({ "source": 0, "sampler": 0 }));
    file.push("samplers", json!({ "wrapS": 33071 }));
    let uvs = file.push_floats(&[0.0; 6], 2);
    file.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(uvs);
    file.with_material(json!({ "pbrMetallicRoughness": { "baseColorTexture": texture_info } }))
}

#[test]
fn textures_are_decoded_and_placed() {
    let pixels = [[255, 0, 0, 255], [0, 255, 0, 255]];
    let transform = json!({ "offset": [0.5, 0.0], "scale": [2.0, 1.0], "rotation": FRAC_PI_2 });
    let info = json!({ "index": 0, "extensions": { "KHR_texture_transform": transform } });
    let scene = textured(&png(&pixels, 2), info).scene();
    let texture = &scene.textures[0];
    assert_eq!(
        (texture.width, texture.height, &texture.rgba[..]),
        (2, 1, &pixels[..])
    );
    let reference = scene.materials[0]
        .base_colour_texture
        .as_ref()
        .expect("has a texture");
    // KHR_texture_transform: offset · rotation · scale, with (u, v) turned by the rotation as (c s; -s c).
    near(
        reference.transform(dvec2(0.25, 0.1)),
        dvec2(0.5 + 0.1, -0.5),
        1e-6,
        "transform",
    );

    // A bad image costs one texture and not the scene.
    let mut cut = png(&[[9, 9, 9, 255]; 64], 8);
    cut.truncate(cut.len() / 2);
    for bytes in [&b"not an image"[..], &cut] {
        let scene = textured(bytes, json!({ "index": 0 })).scene();
        assert_eq!(scene.textures[0].rgba, [[188, 188, 188, 255]]);
        warns(&scene, "image `picture` | replaced by grey");
    }
    let mut missing = textured(b"", json!({ "index": 0 }));
    missing.json["images"][0] = json!({ "uri": "nowhere.png" });
    warns(&missing.scene(), "image `image0` | there is no such file");
}

fn light(json: Value) -> Scene {
    Glb::triangle().with_light("lamp", json).scene()
}

#[test]
fn lights_have_units_and_point_along_minus_z() {
    let point = r#"{"type": "point", "intensity": 683.0, "color": [1.0, 0.5, 0.25], "range": 3.0}"#;
    let point = light(parsed(point));
    let LightKind::Point { intensity, position } = point.lights[0].kind else {
        panic!("is a point light");
    };
    assert_eq!((intensity.0, position), (1.0, DVec3::ZERO));
    assert_eq!(point.lights[0].colour.to_array(), [1.0, 0.5, 0.25]);
    warns(&point, "light `lamp` | range was ignored");

    let mut file = Glb::triangle().with_light("sun", json!({ "type": "directional", "intensity": 1366.0 }));
    // A quarter turn about x looks down; the node's scale means nothing to a light.
    file.json["nodes"][1]["rotation"] = json!([-FRAC_1_SQRT_2, 0.0, 0.0, FRAC_1_SQRT_2]);
    file.json["nodes"][1]["scale"] = json!([3.0, 3.0, 3.0]);
    let LightKind::Sun {
        direction,
        normal_irradiance,
    } = file.scene().lights[0].kind
    else {
        panic!("is a sun");
    };
    assert_close(normal_irradiance.0, 2.0, 1e-12, "lux / 683");
    near(direction, DVec3::NEG_Y, 1e-12, "direction");
}

#[test]
fn bad_lights_are_repaired_or_left_out() {
    let cone = |inner: f64, outer: f64| {
        let spot = json!({ "innerConeAngle": inner, "outerConeAngle": outer });
        let scene = light(json!({ "type": "spot", "spot": spot }));
        let LightKind::Spot {
            inner_cone_rad,
            outer_cone_rad,
            ..
        } = scene.lights[0].kind
        else {
            panic!("is a spot");
        };
        (inner_cone_rad, outer_cone_rad, scene)
    };
    let (inner, _, scene) = cone(0.2, 0.7);
    assert_eq!(inner, 0.2);
    warns_not(&scene);
    assert_eq!(cone(0.0, FRAC_PI_2).1, FRAC_PI_2);
    for (inner, outer) in [(0.5, 0.5), (-0.1, 0.5), (0.1, -1.0), (0.1, 3.0), (2.0, 1.0)] {
        let (read_inner, read_outer, scene) = cone(inner, outer);
        let is_cone = 0.0 <= read_inner && read_inner < read_outer && read_outer <= FRAC_PI_2;
        assert!(is_cone, "{inner} {outer}");
        warns(&scene, "light `lamp` | cone angle of");
    }
    assert_eq!(cone(0.1, -1.0).1, FRAC_PI_4);
    for (json, words) in rows(
        r#"
        {"type": "point", "intensity": -1.0} => intensity of -1
        {"type": "point", "intensity": 1e39} => intensity of inf
        {"type": "point", "intensity": 0.0} => has no power
        {"type": "point", "color": [0.0, 0.0, 0.0]} => has no power
        {"type": "point", "color": [1.0, -1.0, 0.0]} => a colour that is negative
        {"type": "torch"} => of an unknown kind
        "#,
    ) {
        let scene = light(parsed(json));
        assert!(scene.lights.is_empty());
        warns(&scene, &format!("light `lamp` | {words} | left out"));
    }
}

#[test]
fn default_light_comes_only_to_a_dark_scene() {
    let with_sun = options(|options| options.default_light = true);
    let dark = Glb::triangle();
    assert!(dark.scene().lights.is_empty());
    let lit = dark.load_with(&with_sun).expect("loads");
    let names: Vec<&str> = lit.lights.iter().map(|light| light.name.as_str()).collect();
    assert_eq!(names, ["default sun", "default sky"]);
    warns(
        &lit,
        "has no light | `default sun` | `default sky` | --environment",
    );
    let own = dark.with_light("lamp", json!({ "type": "point" }));
    let own = own.load_with(&with_sun).expect("loads");
    assert_eq!((own.lights.len(), own.lights[0].name.as_str()), (1, "lamp"));
    warns_not(&own);
}

#[test]
fn cameras_look_along_minus_z() {
    let mut file = Glb::triangle();
    for (camera, _) in rows(
        r#"
        {"type": "perspective", "perspective": {"yfov": 0.9, "znear": 0.01}}
        {"type": "perspective", "perspective": {"yfov": 4.0, "znear": 0.01}}
        {"type": "orthographic", "orthographic": {"xmag": 1.0, "ymag": 1.0, "zfar": 9.0, "znear": 0.1}}
        "#,
    ) {
        let camera = file.push("cameras", parsed(camera));
        file.push_root(json!({ "camera": camera, "translation": [0.0, 1.0, 2.0], "scale": [2.0, 3.0, 4.0] }));
    }
    let scene = file.scene();
    let [camera, parallel] = &scene.cameras[..] else {
        panic!("the bad one is left out")
    };
    assert_eq!(camera.name, "camera0");
    assert_eq!((camera.forward, camera.up), (DVec3::NEG_Z, DVec3::Y));
    assert_eq!(camera.position, dvec3(0.0, 1.0, 2.0));
    assert_eq!((camera.vertical_fov_rad, camera.near_m), (0.9, 0.01));
    warns(&scene, "angle of view of 4 rad");
    warns(&scene, "is orthographic");
    // Its near plane, 2 m high, stands at z = 1.9.
    assert_eq!(parallel.forward, DVec3::NEG_Z);
    assert!((parallel.position.z - parallel.near_m - 1.9).abs() < 1e-6);
    let height_m = 2.0 * parallel.near_m * (0.5 * parallel.vertical_fov_rad).tan();
    assert!((height_m - 2.0).abs() < 0.01, "{height_m}");
    // A degree of a circle around it.
    assert!((parallel.vertical_fov_rad.to_degrees() - 1.0).abs() < 1e-9);
}

fn rippled(waves: Value) -> Value {
    json!({
        "pbrMetallicRoughness": factors(0.0, 0.0),
        "extras": { "nephroid_waves": waves, "else": [1, { "deep": null }] },
    })
}

#[test]
fn waves_are_read_from_extras() {
    let (water, scene) = material(rippled(json!([
        { "amplitude_m": 0.02, "wavelength_m": 0.5, "direction": [3.0, 4.0], "phase_rad": 1.0 },
        { "amplitude_m": 0.01, "wavelength_m": 0.3, "direction": [0, 2, 0] },
    ])));
    let waves = water.waves.expect("both can be");
    let [first, second] = waves.list() else {
        panic!("{waves:?}")
    };
    near(first.direction, dvec3(0.6, 0.0, 0.8), 1e-12, "direction");
    assert_eq!(
        (first.amplitude_m, first.wavelength_m, first.phase_rad),
        (0.02, 0.5, 1.0)
    );
    assert_eq!((second.direction, second.phase_rad), (DVec3::Y, 0.0));
    warns_not(&scene);
    for (waves, why) in rows(
        r#"
        7 => cannot be read
        [] => 0 waves
        [{"amplitude_m": 0.02, "wavelength_m": 0.5, "direction": [0.0, 0.0]}] => direction
        [{"amplitude_m": 0.02, "wavelength_m": 0.5, "direction": [1.0]}] => direction
        [{"amplitude_m": 0.2, "wavelength_m": 0.5, "direction": [1.0, 0.0]}] => steeper
        [{"amplitude_m": -0.02, "wavelength_m": 0.5, "direction": [1.0, 0.0]}] => not in its range
        [{"amplitude_m": "high", "wavelength_m": 0.5, "direction": [1.0, 0.0]}] => cannot be read
        [{"amplitude_m": 0.1, "length": 3}] => cannot be read
        "#,
    ) {
        let (water, scene) = material(rippled(parsed(waves)));
        assert!(water.waves.is_none());
        warns(&scene, why);
    }
}

#[test]
fn waves_stay_where_they_are_in_a_rebased_scene() {
    let wave = r#"[{"amplitude_m": 0.02, "wavelength_m": 0.5, "direction": [1, 1, 0]}]"#;
    let mut file = Glb::triangle().with_material(rippled(parsed(wave)));
    let near_by = file.scene();
    file.json["nodes"][0]["translation"] = json!([1000.0, 0.0, 0.0]);
    let far = file.scene();
    let [there, moved] = [&near_by, &far].map(|scene| scene.material_of(0).waves.clone().expect("waves"));
    for place in 0..20 {
        let world = dvec3(1000.0 + 0.1 * f64::from(place), 0.3, 0.1);
        near(
            there.height_m(world),
            moved.height_m(world - far.origin_world),
            1e-12,
            world,
        );
    }
    assert!(far.origin_world.x > 900.0);
}

fn embossed(image: &[u8], normals: Value, factors: Value) -> Scene {
    let mut file = textured(image, json!({ "index": 0 }));
    let material = json!({ "name": "m", "pbrMetallicRoughness": factors, "normalTexture": normals });
    let index = file.push("materials", material);
    file.json["meshes"][0]["primitives"][0]["material"] = json!(index);
    file.scene()
}

#[test]
fn normal_textures_of_what_is_specular_are_read() {
    let relief = [
        [128, 128, 255, 255],
        [200, 128, 220, 255],
        [128, 90, 240, 255],
        [60, 128, 220, 255],
    ];
    let image = png(&relief, 2);
    let coat = factors(0.0, 0.0);
    let transform = json!({ "offset": [0.5, 0.0], "scale": [2.0, 3.0] });
    let normals = json!({
        "index": 0, "scale": 0.5, "extensions": { "KHR_texture_transform": transform },
    });
    let scene = embossed(&image, normals, coat.clone());
    let map = scene.material_of(0).bending_map().expect("it has one");
    assert_eq!(map.scale, 0.5);
    near(
        map.image.transform(dvec2(0.25, 0.1)),
        dvec2(1.0, 0.3),
        1e-6,
        "transform",
    );
    // At the middle of the second texel: the slope against its normal, at half its tilt.
    let slope = map.slope(&scene.textures[map.image.texture], dvec2(0.75, 0.25));
    let [x, y, z] = [200.0, 128.0, 220.0].map(|code| code / 127.5 - 1.0);
    near(slope, dvec2(-0.5 * x / z, -0.5 * y / z), 1e-12, "slope");

    let (plain, fourth) = (json!({ "index": 0 }), json!({ "index": 0, "texCoord": 3 }));
    for (normals, factors, image, why) in [
        (
            &plain,
            coat.clone(),
            &b"no image"[..],
            "image `picture` | replaced by grey",
        ),
        (&fourth, coat.clone(), &image, "material `m` | TEXCOORD_3"),
    ] {
        let scene = embossed(image, normals.clone(), factors);
        assert!(scene.material_of(0).normal_map.is_none());
        warns(&scene, why);
    }
    // That of a diffuse surface shades it and bends nothing.
    let diffuse = embossed(&image, plain.clone(), factors(0.0, 1.0));
    let material = diffuse.material_of(0);
    assert!(material.relief().is_some() && material.bending_map().is_none());
    assert!(
        diffuse
            .warnings
            .iter()
            .all(|warning| !warning.what.contains("normal texture"))
    );
    // A flat one bends nothing, and there is nothing to say of it.
    let scene = embossed(&png(&[[128, 128, 255, 255]; 4], 2), plain.clone(), coat.clone());
    assert!(scene.material_of(0).normal_map.is_none());
    warns_not(&scene);
    // Each image has coordinates of its own.
    let mut coloured = coat;
    coloured["baseColorTexture"] = json!({ "index": 0, "texCoord": 1 });
    let scene = embossed(&image, plain, coloured);
    let sets = scene
        .material_of(0)
        .images()
        .map(|image| image.map(|image| image.uv_set));
    assert_eq!(sets, [Some(1), None, None, Some(0)]);
}

#[test]
fn lacquer_is_coat_over_matte_and_adds_to_metal() {
    let lacquered = |metallic: f64, roughness: f64, coat: Value| {
        let mut json = json!({ "name": "m", "pbrMetallicRoughness": factors(metallic, roughness) });
        json["pbrMetallicRoughness"]["baseColorFactor"] = json!([0.5, 0.25, 0.0, 1.0]);
        json["extensions"] = json!({ "KHR_materials_clearcoat": coat });
        material(json)
    };
    let coat = json!({ "clearcoatFactor": 0.75, "clearcoatRoughnessFactor": 0.125 });
    for metallic in [0.0, 1.0] {
        let (matte, scene) = lacquered(metallic, 1.0, coat.clone());
        assert_eq!(matte.surface, SurfaceKind::Coated);
        assert_eq!((matte.coat, matte.roughness, matte.ior), (0.75, 0.125, 1.5));
        assert_eq!(matte.base_colour.to_array(), [0.5, 0.25, 0.0]);
        assert_eq!(matte.classified(), SurfaceKind::Coated, "edits keep it");
        warns_not(&scene);
    }
    // 1 - R = (1 - 0.75·0.04)(1 - metal).
    let (metal, _) = lacquered(1.0, 0.0, coat.clone());
    assert_eq!(metal.surface, SurfaceKind::Mirror);
    let expected = [0.5, 0.25, 0.0].map(|bare| 1.0 - 0.97 * (1.0 - bare));
    near(metal.base_colour.to_array(), expected, 1e-12, "lacquered metal");
    let (coated, _) = lacquered(0.0, 0.0, coat.clone());
    assert_eq!((coated.surface, coated.coat), (SurfaceKind::Coated, 1.0));
    let dulled = |extensions: Value| {
        material(json!({ "pbrMetallicRoughness": factors(0.0, 0.0), "extensions": extensions })).0
    };
    let dull = json!({ "specularFactor": 0.5 });
    assert_eq!(dulled(json!({ "KHR_materials_specular": dull })).coat, 0.5);
    let both = json!({ "KHR_materials_specular": dull, "KHR_materials_clearcoat": coat });
    assert_eq!(dulled(both).coat, 0.875, "dull where no lacquer covers it");
    for (coat, why) in rows(
        r#"
        {"clearcoatFactor": 2.0} => clearcoat factor of 2
        {"clearcoatFactor": 1.0, "clearcoatRoughnessFactor": 0.9} => hardly shines
        {"clearcoatFactor": "all"} => cannot be read
        {"clearcoatFactor": 1.0, "clearcoatTexture": {"index": 0}} => read as their means
        {"clearcoatFactor": 1.0, "clearcoatNormalTexture": {"index": 0}} => normal texture was ignored
        "#,
    ) {
        let (_, scene) = lacquered(0.0, 1.0, parsed(coat));
        warns(&scene, &format!("material `m` | {why}"));
    }
    // The means of images of a half and a whole.
    let image = json!({ "index": 0 });
    let pixels = [[255, 0, 255, 255], [0, 51, 255, 0]];
    let coat = json!({ "clearcoatFactor": 1.0, "clearcoatTexture": image,
        "clearcoatRoughnessFactor": 1.0, "clearcoatRoughnessTexture": image });
    let dull =
        json!({ "specularFactor": 0.5, "specularTexture": image, "specularColorFactor": [1.0, 0.0, 0.0] });
    for (roughness, extension, stated, expected) in [
        (1.0, "KHR_materials_clearcoat", coat, (0.5, 0.1)),
        (
            0.0,
            "KHR_materials_specular",
            dull,
            (0.25 * LinearSrgb::new(1.0, 0.0, 0.0).luminance(), 0.0),
        ),
    ] {
        let mut json = json!({ "name": "m", "pbrMetallicRoughness": factors(0.0, roughness) });
        json["extensions"] = json!({ extension: stated });
        let (read, scene) = with_image(pixels, json);
        near(read.coat, expected.0, 1e-6, extension);
        near(read.roughness, expected.1, 1e-6, extension);
        warns(&scene, "material `m` | as their means");
    }
    let (bare, _) = lacquered(0.0, 1.0, json!({}));
    assert_eq!(bare.surface, SurfaceKind::Diffuse);
}

/// A material with an image of two texels as one of its textures, and what is told of it.
fn with_image(pixels: [[u8; 4]; 2], stated: Value) -> (Material, Scene) {
    let mut file = textured(&png(&pixels, 2), json!({ "index": 0 }));
    let index = file.push("materials", stated);
    file.json["meshes"][0]["primitives"][0]["material"] = json!(index);
    let scene = file.scene();
    (scene.material_of(0).clone(), scene)
}

#[test]
fn textures_of_factors_make_surfaces_vary() {
    use SurfaceKind::{Coated, Diffuse, Mirror, Varied};
    let stated = |factors: Value, transmission: Value| {
        let extensions = json!({ "KHR_materials_transmission": transmission });
        json!({ "name": "m", "pbrMetallicRoughness": factors, "extensions": extensions })
    };
    let image = json!({ "index": 0 });
    let metallic_roughness = json!({ "metallicRoughnessTexture": image });
    let clear = json!({ "metallicFactor": 0.0, "roughnessFactor": 0.1 });
    let by_image = json!({ "transmissionFactor": 1.0, "transmissionTexture": image });
    for (first, second, factors, transmission, surface, has_image) in [
        // Red is transmission; green is roughness and blue metallic.
        (
            [0, 0, 255],
            [0, 255, 0],
            &metallic_roughness,
            json!({}),
            Varied,
            true,
        ),
        (
            [0, 9, 255],
            [0, 99, 250],
            &metallic_roughness,
            json!({}),
            Mirror,
            true,
        ),
        (
            [0, 9, 0],
            [0, 50, 0],
            &metallic_roughness,
            json!({}),
            Coated,
            true,
        ),
        (
            [0, 200, 0],
            [0, 255, 0],
            &metallic_roughness,
            json!({}),
            Diffuse,
            false,
        ),
        (
            [0, 9, 255],
            [9, 10, 255],
            &metallic_roughness,
            json!({}),
            Mirror,
            false,
        ),
        ([0, 0, 0], [255, 0, 0], &clear, by_image.clone(), Varied, true),
        // Nearly even: the mean of 0.89 is clear in part.
        ([200, 0, 0], [255, 9, 9], &clear, by_image, Varied, false),
    ] {
        let opaque = |[r, g, b]: [u8; 3]| [r, g, b, 255];
        let json = stated(factors.clone(), transmission);
        let (read, scene) = with_image([opaque(first), opaque(second)], json.clone());
        assert_eq!(
            (read.surface, read.variation.is_some()),
            (surface, has_image),
            "{json}"
        );
        assert_eq!(read.classified(), surface, "edits keep it");
        assert!(
            !scene.warnings.iter().any(|warning| warning.what.contains("mean")),
            "{json}"
        );
        // Its image gives the factors back.
        if let Some(variation) = &read.variation {
            let texel = scene.textures[variation.image.texture].sample(dvec2(0.25, 0.5));
            let [r, g, b] = first.map(|code| f64::from(code) / 255.0);
            let expected = if has_image && factors == &metallic_roughness {
                [1.0, g, b]
            } else {
                [r, 1.0, 1.0]
            };
            near(texel.to_array(), expected, 0.005, json);
        }
    }
    let other = json!({ "index": 0, "texCoord": 1 });
    let factors = json!({ "metallicRoughnessTexture": other, "baseColorTexture": image });
    let by_image = json!({ "transmissionFactor": 1.0, "transmissionTexture": image });
    for (transmission, is_image) in [(json!({}), true), (by_image, false)] {
        let pixels = [[0, 0, 255, 255], [0, 255, 0, 255]];
        let (read, scene) = with_image(pixels, stated(factors.clone(), transmission));
        assert_eq!(read.variation.is_some(), is_image);
        if !is_image {
            warns(&scene, "material `m` | follow different coordinates");
        }
    }
}

#[test]
fn what_alpha_blends_is_there_in_part() {
    let clear = json!({ "KHR_materials_transmission": { "transmissionFactor": 1.0 } });
    let stated = |alpha: f64, extensions: &Value| {
        json!({ "name": "m", "alphaMode": "BLEND", "extensions": extensions,
            "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 }, "baseColorFactor": [0.5, 0.5, 0.5, alpha],
                "metallicFactor": 0.0 } })
    };
    let none = json!({});
    for (alphas, factor, coverage, is_cut) in [
        ([255, 255], 1.0, None, false),
        ([255, 0], 1.0, None, true),
        ([255, 99], 1.0, Some(1.0), false),
        ([255, 255], 0.25, Some(0.25), false),
    ] {
        let (read, scene) = with_image(alphas.map(|alpha| [255, 255, 255, alpha]), stated(factor, &none));
        assert_eq!(
            (read.coverage, read.alpha_mask.is_some()),
            (coverage, is_cut),
            "{alphas:?}"
        );
        assert_eq!(read.surface == SurfaceKind::Varied, coverage.is_some());
        warns_not(&scene);
    }
    let (glass, scene) = with_image([[255; 4]; 2], stated(0.25, &clear));
    assert_eq!((glass.surface, glass.coverage), (SurfaceKind::ThinWall, None));
    near(glass.base_colour.g, 0.875, 1e-12, "a lighter tint");
    warns(&scene, "material `m` | lighter tint");
}

/// glTF 2.0, 3.9.4: a surface is there where alpha is greater than or equal to the cutoff.
#[test]
fn masks_keep_what_reaches_their_cutoff() {
    let dim = image(1, vec![[255, 255, 255, 51]], Wrap::Repeat);
    let dim = Some((&dim, DVec2::splat(0.5)));
    for (cutoff, factor, image, there) in [
        (0.5, 0.5, None, true),
        (0.5, 0.4375, None, false),
        (0.5, 1.0, None, true),
        (0.0, 0.0, None, true),
        (0.19, 1.0, dim, true),
        (0.21, 1.0, dim, false),
        (0.09, 0.5, dim, true),
        (0.11, 0.5, dim, false),
    ] {
        let mask = AlphaMask { cutoff, factor };
        assert_eq!(mask.is_there(image), there, "{mask:?}");
    }
}
