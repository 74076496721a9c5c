//! Materials, images, lights and cameras from files.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use glam::DVec3;
use nephroid::optics::LinearSrgb;
use nephroid::scene::texture::Wrap;
use nephroid::scene::{AlphaMask, LightKind, LoadOptions, Material, Scene, SurfaceKind, Texture};
use serde_json::{Value, json};

use support::assert_close;
use support::glb::{Glb, assert_warned};

fn material(json: Value) -> (Material, Scene) {
    let scene = Glb::triangle().with_material(json).scene();
    (scene.materials[scene.objects[0].material].clone(), scene)
}

fn factors(metallic: f64, roughness: f64) -> Value {
    json!({ "metallicFactor": metallic, "roughnessFactor": roughness })
}

#[test]
fn surfaces_are_classified_by_metal_transmission_volume_and_roughness() {
    let clear = json!({ "KHR_materials_transmission": { "transmissionFactor": 1.0 } });
    let solid = json!({
        "KHR_materials_transmission": { "transmissionFactor": 1.0 },
        "KHR_materials_volume": { "thicknessFactor": 0.1 },
    });
    let flat = json!({
        "KHR_materials_transmission": { "transmissionFactor": 1.0 },
        "KHR_materials_volume": { "thicknessFactor": 0.0 },
    });
    let none = json!({});
    let unlit = json!({ "KHR_materials_unlit": {} });
    for (metallic, roughness, extensions, expected, warned) in [
        (1.0, 0.0, &none, SurfaceKind::Mirror, None),
        (0.5, 0.3, &none, SurfaceKind::Mirror, None),
        (1.0, 0.6, &none, SurfaceKind::Mirror, None),
        (
            1.0,
            0.61,
            &none,
            SurfaceKind::Diffuse,
            Some("is a metal of roughness 0.61"),
        ),
        (1.0, 1.0, &none, SurfaceKind::Diffuse, None),
        (0.0, 1.0, &none, SurfaceKind::Diffuse, None),
        (0.0, 0.1, &none, SurfaceKind::Mixed, None),
        (0.0, 0.0, &unlit, SurfaceKind::Diffuse, None),
        (0.0, 0.0, &solid, SurfaceKind::Dielectric, None),
        (0.0, 0.0, &clear, SurfaceKind::ThinWall, Some("thin pane")),
        (0.0, 0.0, &flat, SurfaceKind::ThinWall, Some("thin pane")),
        (0.0, 0.31, &none, SurfaceKind::Diffuse, None),
        (0.0, 0.6, &solid, SurfaceKind::Dielectric, None),
        (
            0.0,
            0.7,
            &solid,
            SurfaceKind::Diffuse,
            Some("transmits light at a roughness of 0.70"),
        ),
    ] {
        let json = json!({ "name": "m", "pbrMetallicRoughness": factors(metallic, roughness), "extensions": extensions });
        let (read, scene) = material(json.clone());
        assert_eq!(read.surface, expected, "{json}");
        assert_eq!(
            read.volume.is_some(),
            expected == SurfaceKind::Dielectric,
            "{json}"
        );
        match warned {
            Some(words) => assert_warned(&scene, &["material `m`", words]),
            None => assert!(scene.warnings.is_empty(), "{json}: {:?}", scene.warnings),
        }
    }
}

#[test]
fn a_mesh_without_material_is_matte_as_gltf_has_it() {
    let scene = Glb::triangle().scene();
    let read = &scene.materials[scene.objects[0].material];
    assert_eq!(
        (read.surface, read.base_colour),
        (SurfaceKind::Diffuse, LinearSrgb::WHITE)
    );
    let scene = Glb::triangle().with_material(json!({})).scene();
    assert_eq!(scene.materials[0].surface, SurfaceKind::Diffuse);
    assert!(scene.warnings.is_empty());
}

#[test]
fn volumes_indices_and_emission_have_their_units() {
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
    for (ior, words) in [
        (0.0, "full reflection"),
        (0.5, "index of 0.5"),
        (-1.0, "index of -1"),
    ] {
        let (read, scene) = material(json!({ "extensions": { "KHR_materials_ior": { "ior": ior } } }));
        assert_eq!(read.ior, 1.5);
        assert_warned(&scene, &[words, "was read as 1.5"]);
    }
}

#[test]
fn values_out_of_range_are_brought_back_and_named() {
    let (read, scene) = material(json!({
        "name": "m",
        "pbrMetallicRoughness": { "baseColorFactor": [2.0, -1.0, 0.5, 1.0], "roughnessFactor": 7.0 },
        "alphaMode": "BLEND",
    }));
    assert_eq!(read.base_colour.to_array(), [1.0, 0.0, 0.5]);
    assert_eq!(read.roughness, 1.0);
    assert_warned(&scene, &["material `m`", "base colour of 2 was read as 1"]);
    assert_warned(&scene, &["material `m`", "roughness factor of 7"]);
    assert_warned(&scene, &["material `m`", "alpha mode BLEND was read as opaque"]);
}

#[test]
fn solid_glass_turns_closed_thin_walls_into_solids() {
    let glass = json!({
        "name": "glass",
        "pbrMetallicRoughness": factors(0.0, 0.0),
        "extensions": { "KHR_materials_transmission": { "transmissionFactor": 1.0 } },
    });
    let options = LoadOptions {
        solid_glass: true,
        ..LoadOptions::default()
    };
    let kind = |scene: &Scene| scene.material_of(0).surface;
    let closed = Glb::tetrahedron().with_material(glass.clone());
    assert_eq!(kind(&closed.scene()), SurfaceKind::ThinWall);
    let solid = closed.load_with(&options).expect("loads");
    assert_eq!(kind(&solid), SurfaceKind::Dielectric);
    assert!(solid.material_of(0).volume.is_some());
    let open = Glb::triangle()
        .with_material(glass)
        .load_with(&options)
        .expect("loads");
    assert_eq!(kind(&open), SurfaceKind::ThinWall);
    assert_warned(&open, &["node `tri`", "is not closed"]);
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

/// A textured triangle whose image holds these bytes.
fn textured(image: &[u8], texture_info: Value) -> Glb {
    let mut file = Glb::triangle();
    let view = file.push_view(image);
    file.push(
        "images",
        json!({ "name": "picture", "bufferView": view, "mimeType": "image/png" }),
    );
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
    let moved = reference.transform(glam::DVec2::new(0.25, 0.1));
    assert!(
        (moved - glam::DVec2::new(0.5 + 0.1, -0.5)).length() < 1e-6,
        "{moved}"
    );
}

#[test]
fn a_bad_image_costs_one_texture_and_not_the_scene() {
    let mut cut = png(&[[9, 9, 9, 255]; 64], 8);
    cut.truncate(cut.len() / 2);
    for bytes in [&b"not an image"[..], &cut] {
        let scene = textured(bytes, json!({ "index": 0 })).scene();
        assert_eq!(scene.textures[0].rgba, [[188, 188, 188, 255]]);
        assert_warned(&scene, &["image `picture`", "replaced by grey"]);
    }
    let mut missing = textured(b"", json!({ "index": 0 }));
    missing.json["images"][0] = json!({ "uri": "nowhere.png" });
    assert_warned(&missing.scene(), &["image `image0`", "there is no such file"]);
}

fn light(json: Value) -> Scene {
    Glb::triangle().with_light("lamp", json).scene()
}

#[test]
fn lights_have_radiant_units_and_point_along_minus_z() {
    let point =
        light(json!({ "type": "point", "intensity": 683.0, "color": [1.0, 0.5, 0.25], "range": 3.0 }));
    let LightKind::Point { intensity, position } = point.lights[0].kind else {
        panic!("is a point light");
    };
    assert_eq!((intensity.0, position), (1.0, DVec3::ZERO));
    assert_eq!(point.lights[0].colour.to_array(), [1.0, 0.5, 0.25]);
    assert_warned(&point, &["light `lamp`", "range was ignored"]);

    let mut file = Glb::triangle().with_light("sun", json!({ "type": "directional", "intensity": 1366.0 }));
    // A quarter turn about x looks down; the node's scale means nothing to a light.
    let half = std::f64::consts::FRAC_1_SQRT_2;
    file.json["nodes"][1]["rotation"] = json!([-half, 0.0, 0.0, half]);
    file.json["nodes"][1]["scale"] = json!([3.0, 3.0, 3.0]);
    let scene = file.scene();
    let LightKind::Sun {
        direction,
        normal_irradiance,
    } = scene.lights[0].kind
    else {
        panic!("is a sun");
    };
    assert_close(normal_irradiance.0, 2.0, 1e-12, "lux / 683");
    assert!((direction - DVec3::NEG_Y).length() < 1e-12, "{direction}");
}

#[test]
fn bad_lights_are_repaired_or_left_out_by_name() {
    let cone = |inner: f64, outer: f64| {
        let spot = json!({ "innerConeAngle": inner, "outerConeAngle": outer });
        let scene = light(json!({ "type": "spot", "spot": spot }));
        match scene.lights[0].kind {
            LightKind::Spot {
                inner_cone_rad,
                outer_cone_rad,
                ..
            } => (inner_cone_rad, outer_cone_rad, scene),
            _ => panic!("is a spot"),
        }
    };
    assert_eq!(cone(0.2, 0.7).0, 0.2);
    assert!(cone(0.2, 0.7).2.warnings.is_empty());
    assert_eq!(cone(0.0, FRAC_PI_2).1, FRAC_PI_2);
    for (inner, outer) in [(0.5, 0.5), (-0.1, 0.5), (0.1, -1.0), (0.1, 3.0), (2.0, 1.0)] {
        let (read_inner, read_outer, scene) = cone(inner, outer);
        assert!(
            0.0 <= read_inner && read_inner < read_outer && read_outer <= FRAC_PI_2,
            "{inner} {outer}"
        );
        assert_warned(&scene, &["light `lamp`", "cone angle of"]);
    }
    assert_eq!(cone(0.1, -1.0).1, FRAC_PI_4);
    for (json, words) in [
        (json!({ "type": "point", "intensity": -1.0 }), "intensity of -1"),
        (json!({ "type": "point", "intensity": 1e39 }), "intensity of inf"),
        (json!({ "type": "point", "intensity": 0.0 }), "has no power"),
        (
            json!({ "type": "point", "color": [0.0, 0.0, 0.0] }),
            "has no power",
        ),
        (
            json!({ "type": "point", "color": [1.0, -1.0, 0.0] }),
            "a colour that is negative",
        ),
        (json!({ "type": "torch" }), "of an unknown kind"),
    ] {
        let scene = light(json);
        assert!(scene.lights.is_empty());
        assert_warned(&scene, &["light `lamp`", words, "left out"]);
    }
}

#[test]
fn a_default_sun_comes_only_to_a_dark_scene() {
    let options = LoadOptions {
        default_light: true,
        ..LoadOptions::default()
    };
    let dark = Glb::triangle();
    assert!(dark.scene().lights.is_empty());
    let lit = dark.load_with(&options).expect("loads");
    assert_eq!(lit.lights.len(), 1);
    assert_eq!(lit.lights[0].name, "default sun");
    assert_warned(&lit, &["has no light", "`default sun`"]);
    let own = dark.with_light("lamp", json!({ "type": "point" }));
    let own = own.load_with(&options).expect("loads");
    assert_eq!((own.lights.len(), own.lights[0].name.as_str()), (1, "lamp"));
    assert!(own.warnings.is_empty());
}

#[test]
fn cameras_look_along_minus_z_and_bad_ones_are_left_out() {
    let mut file = Glb::triangle();
    let good = json!({ "type": "perspective", "perspective": { "yfov": 0.9, "znear": 0.01 } });
    let wide = json!({ "type": "perspective", "perspective": { "yfov": 4.0, "znear": 0.01 } });
    let flat = json!({ "type": "orthographic",
        "orthographic": { "xmag": 1.0, "ymag": 1.0, "zfar": 9.0, "znear": 0.1 } });
    for camera in [good, wide, flat] {
        let camera = file.push("cameras", camera);
        file.push_root(json!({ "camera": camera, "translation": [0.0, 1.0, 2.0], "scale": [2.0, 3.0, 4.0] }));
    }
    let scene = file.scene();
    assert_eq!(scene.cameras.len(), 1);
    let camera = &scene.cameras[0];
    assert_eq!(camera.name, "camera0");
    assert_eq!((camera.forward, camera.up), (DVec3::NEG_Z, DVec3::Y));
    assert_eq!(
        (camera.position, camera.vertical_fov_rad, camera.near_m),
        (DVec3::new(0.0, 1.0, 2.0), 0.9, 0.01)
    );
    assert_warned(&scene, &["angle of view of 4 rad"]);
    assert_warned(&scene, &["is orthographic"]);
}

#[test]
fn waves_are_read_from_extras_and_what_cannot_be_is_named() {
    let with = |waves: Value| {
        let json = json!({
            "name": "water",
            "pbrMetallicRoughness": factors(0.0, 0.0),
            "extras": { "nephroid_waves": waves, "else": [1, { "deep": null }] },
        });
        material(json)
    };
    let (water, scene) = with(json!([
        { "amplitude_m": 0.02, "wavelength_m": 0.5, "direction": [3.0, 4.0], "phase_rad": 1.0 },
        { "amplitude_m": 0.01, "wavelength_m": 0.3, "direction": [0, 2, 0] },
    ]));
    let waves = water.waves.expect("both can be");
    let [first, second] = waves.list() else {
        panic!("{waves:?}")
    };
    assert!(first.direction.distance(DVec3::new(0.6, 0.0, 0.8)) < 1e-12);
    assert_eq!(
        (first.amplitude_m, first.wavelength_m, first.phase_rad),
        (0.02, 0.5, 1.0)
    );
    assert_eq!((second.direction, second.phase_rad), (DVec3::Y, 0.0));
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);

    let wave = |amplitude_m: Value, direction: Value| json!([{ "amplitude_m": amplitude_m, "wavelength_m": 0.5, "direction": direction }]);
    for (waves, why) in [
        (json!(7), "cannot be read"),
        (json!([]), "0 waves"),
        (wave(json!(0.02), json!([0.0, 0.0])), "direction"),
        (wave(json!(0.02), json!([1.0])), "direction"),
        (wave(json!(0.2), json!([1.0, 0.0])), "steeper"),
        (wave(json!(-0.02), json!([1.0, 0.0])), "not in its range"),
        (wave(json!("high"), json!([1.0, 0.0])), "cannot be read"),
        (json!([{ "amplitude_m": 0.1, "length": 3 }]), "cannot be read"),
    ] {
        let (water, scene) = with(waves);
        assert!(water.waves.is_none());
        assert_warned(&scene, &[why]);
    }
}

#[test]
fn waves_stay_where_they_are_in_a_scene_that_is_moved_to_its_own_origin() {
    let json = json!({
        "pbrMetallicRoughness": factors(0.0, 0.0),
        "extras": { "nephroid_waves": [{ "amplitude_m": 0.02, "wavelength_m": 0.5, "direction": [1, 1, 0] }] },
    });
    let near = Glb::triangle().with_material(json.clone()).scene();
    let mut far = Glb::triangle().with_material(json);
    far.json["nodes"][0]["translation"] = json!([1000.0, 0.0, 0.0]);
    let far = far.scene();
    let waves = |scene: &Scene| scene.materials[scene.objects[0].material].waves.clone();
    let (near, moved) = (waves(&near).expect("waves"), waves(&far).expect("waves"));
    for place in 0..20 {
        let world = DVec3::new(1000.0 + 0.1 * f64::from(place), 0.3, 0.1);
        let (a, b) = (near.height_m(world), moved.height_m(world - far.origin_world));
        assert!((a - b).abs() < 1e-12, "{a} {b}");
    }
    assert!(far.origin_world.x > 900.0);
}

/// A polished triangle with a normal texture.
fn embossed(image: &[u8], normals: Value, more: Value) -> Glb {
    let mut file = textured(image, json!({ "index": 0 }));
    let material = json!({
        "name": "m",
        "pbrMetallicRoughness": more,
        "normalTexture": normals,
    });
    let index = file.push("materials", material);
    file.json["meshes"][0]["primitives"][0]["material"] = json!(index);
    file
}

#[test]
fn normal_textures_of_what_is_specular_are_read_and_others_named() {
    let relief = [
        [128, 128, 255, 255],
        [200, 128, 220, 255],
        [128, 90, 240, 255],
        [60, 128, 220, 255],
    ];
    let image = png(&relief, 2);
    let polish = factors(0.0, 0.0);
    let transform = json!({ "offset": [0.5, 0.0], "scale": [2.0, 3.0] });
    let normals = json!({
        "index": 0, "scale": 0.5, "extensions": { "KHR_texture_transform": transform },
    });
    let scene = embossed(&image, normals, polish.clone()).scene();
    let material = &scene.materials[scene.objects[0].material];
    let map = material.bending_map().expect("it has one");
    assert_eq!(map.scale, 0.5);
    assert!((map.image.transform(glam::DVec2::new(0.25, 0.1)) - glam::DVec2::new(1.0, 0.3)).length() < 1e-6);
    // At the middle of the second texel: the slope against its normal, at half its tilt.
    let slope = map.slope(&scene.textures[map.image.texture], glam::DVec2::new(0.75, 0.25));
    let [x, y, z] = [200.0, 128.0, 220.0].map(|code| code / 127.5 - 1.0);
    let expected = glam::DVec2::new(-0.5 * x / z, -0.5 * y / z);
    assert!((slope.value - expected).length() < 1e-12, "{slope:?}");

    let left_out = |normals: Value, more: Value, image: &[u8], why: &str| {
        let scene = embossed(image, normals, more).scene();
        assert!(scene.materials[scene.objects[0].material].normal_map.is_none());
        assert_warned(&scene, &["material `m`", why]);
    };
    let plain = json!({ "index": 0 });
    left_out(
        plain.clone(),
        factors(0.0, 1.0),
        &image,
        "normal texture, as it is matte,",
    );
    left_out(plain.clone(), polish.clone(), b"no image", "the same everywhere");
    left_out(
        json!({ "index": 0, "texCoord": 3 }),
        polish.clone(),
        &image,
        "TEXCOORD_3",
    );
    let mut coloured = polish;
    coloured["baseColorTexture"] = json!({ "index": 0, "texCoord": 1 });
    left_out(plain, coloured, &image, "other coordinates");
}

#[test]
fn a_lacquer_is_polish_over_what_is_matte_and_adds_to_metal() {
    let lacquered = |metallic: f64, roughness: f64, coat: Value| {
        let mut json = json!({ "name": "m", "pbrMetallicRoughness": factors(metallic, roughness) });
        json["pbrMetallicRoughness"]["baseColorFactor"] = json!([0.5, 0.25, 0.0, 1.0]);
        json["extensions"] = json!({ "KHR_materials_clearcoat": coat });
        material(json)
    };
    let coat = json!({ "clearcoatFactor": 0.75, "clearcoatRoughnessFactor": 0.125 });
    for metallic in [0.0, 1.0] {
        let (matte, scene) = lacquered(metallic, 1.0, coat.clone());
        assert_eq!(matte.surface, SurfaceKind::Mixed);
        assert_eq!((matte.polish, matte.roughness, matte.ior), (0.75, 0.125, 1.5));
        assert_eq!(matte.base_colour.to_array(), [0.5, 0.25, 0.0]);
        assert_eq!(matte.classified(), SurfaceKind::Mixed, "edits keep it");
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    }
    // 1 - R = (1 - 0.75·0.04)(1 - metal).
    let (metal, _) = lacquered(1.0, 0.0, coat.clone());
    assert_eq!(metal.surface, SurfaceKind::Mirror);
    for (found, bare) in metal.base_colour.to_array().into_iter().zip([0.5, 0.25, 0.0]) {
        assert!((found - (1.0 - 0.97 * (1.0 - bare))).abs() < 1e-12, "{found}");
    }
    let (polished, _) = lacquered(0.0, 0.0, coat.clone());
    assert_eq!((polished.surface, polished.polish), (SurfaceKind::Mixed, 1.0));
    let dulled = |extensions: Value| {
        material(json!({ "pbrMetallicRoughness": factors(0.0, 0.0), "extensions": extensions })).0
    };
    let dull = json!({ "specularFactor": 0.5 });
    assert_eq!(dulled(json!({ "KHR_materials_specular": dull })).polish, 0.5);
    let both = json!({ "KHR_materials_specular": dull, "KHR_materials_clearcoat": coat });
    assert_eq!(dulled(both).polish, 0.875, "dull where no lacquer covers it");
    for (coat, why) in [
        (json!({ "clearcoatFactor": 2.0 }), "clearcoat factor of 2"),
        (
            json!({ "clearcoatFactor": 1.0, "clearcoatRoughnessFactor": 0.9 }),
            "hardly shines",
        ),
        (json!({ "clearcoatFactor": "all" }), "cannot be read"),
        (
            json!({ "clearcoatFactor": 1.0, "clearcoatTexture": { "index": 0 } }),
            "by its factors alone",
        ),
    ] {
        let (_, scene) = lacquered(0.0, 1.0, coat);
        assert_warned(&scene, &["material `m`", why]);
    }
    let (bare, _) = lacquered(0.0, 1.0, json!({}));
    assert_eq!(bare.surface, SurfaceKind::Diffuse);
}

/// glTF 2.0, 3.9.4: a surface is there where alpha is greater than or equal to the cutoff.
#[test]
fn a_mask_keeps_what_reaches_its_cutoff() {
    for (cutoff, factor, there) in [
        (0.5, 0.5, true),
        (0.5, 0.4375, false),
        (0.5, 1.0, true),
        (0.0, 0.0, true),
    ] {
        let mask = AlphaMask { cutoff, factor };
        assert_eq!(mask.is_there(None), there, "{mask:?}");
    }
    let half = Texture {
        name: "half".into(),
        width: 1,
        height: 1,
        rgba: vec![[255, 255, 255, 51]],
        wrap: [Wrap::Repeat; 2],
    };
    let with = |cutoff: f64, factor: f64| {
        AlphaMask { cutoff, factor }.is_there(Some((&half, glam::DVec2::splat(0.5))))
    };
    // Alpha is 0.2 of the factor.
    assert!(with(0.19, 1.0) && !with(0.21, 1.0));
    assert!(with(0.09, 0.5) && !with(0.11, 0.5));
}
