//! Bad input gets one sentence: what, where and what to do.

use nephroid::error::{ErrorKind, Result};

use crate::prelude::*;
use support::glb::{load_bytes, load_path};

#[track_caller]
fn refusal(source: &str) -> String {
    let error = Scene::load(source, &LoadOptions::default()).expect_err("has to be refused");
    assert_eq!(error.kind, ErrorKind::Failure);
    says(&error, source);
    error.to_string()
}

#[test]
fn sources_that_are_no_scene() {
    let folder = folder();
    says(
        refusal("builtin:cup"),
        "no such built-in scene; choose one of gallery, showroom",
    );
    says(refusal("nowhere.glb"), "there is no such file");
    says(refusal(folder.path().to_str().expect("UTF-8")), "is a folder");
    let path = folder.path().join("letter.glb");
    for (text, words) in rows(
        r#"
        Dear scene, => this is not a glTF file
        => this is not a glTF file
        { "asset": => is broken
        [1, 2] => not an object
        {} => states no version
        {"asset": {"version": "1.0"}} => not of glTF version 2.0
        {"asset": {"version": "2.0", "minVersion": "2.1"}} => not of glTF version 2.0
        {"asset": {"version": "2.0"}, "meshes": 7} => does not follow glTF 2.0
        glTF => ends within its header
        "#,
    ) {
        std::fs::write(&path, text).expect("can be written");
        says(refusal(path.to_str().expect("UTF-8")), words);
    }
}

#[test]
fn required_extensions_are_refused_or_left_out() {
    let requiring = |name: &str| {
        let mut file = Glb::triangle();
        file.json["extensionsUsed"] = json!([name]);
        file.json["extensionsRequired"] = json!([name]);
        file
    };
    for (name, remedy) in [
        ("EXT_texture_avif", "export it with PNG or JPEG images"),
        ("ACME_unheard_of", "export it without this extension"),
    ] {
        let words = format!("requires {name}, which is not supported; {remedy}");
        requiring(name).assert_refused(&words);
    }
    for name in [
        "EXT_mesh_gpu_instancing",
        "EXT_meshopt_compression",
        "KHR_draco_mesh_compression",
        "KHR_materials_variants",
        "KHR_mesh_quantization",
        "KHR_meshopt_compression",
        "KHR_texture_basisu",
        "KHR_materials_volume",
        "KHR_materials_specular",
        "KHR_texture_transform",
        "EXT_texture_webp",
    ] {
        warns_not(&requiring(name).scene());
    }
    let pointer = requiring("KHR_animation_pointer").scene();
    warns(&pointer, "KHR_animation_pointer is not supported");
    // Materials say it where they have it.
    let extensions = json!({ "KHR_materials_iridescence": { "iridescenceFactor": 1.0 } });
    let iridescent = requiring("KHR_materials_iridescence");
    let iridescent = iridescent.with_material(json!({ "extensions": extensions }));
    warns(
        &iridescent.scene(),
        "material0 | KHR_materials_iridescence was ignored",
    );
}

/// Once per extension, whatever else a material has, and not where the extension does nothing.
#[test]
fn what_materials_miss_is_said_once_an_extension() {
    let mut file = Glb::triangle();
    file.json["extensionsUsed"] = json!(["KHR_materials_sheen", "KHR_materials_anisotropy"]);
    let sheen = json!({ "sheenColorFactor": [0.0, 0.5, 0.0] });
    for (name, extensions) in [
        ("velvet", json!({ "KHR_materials_sheen": sheen })),
        (
            "off",
            json!({ "KHR_materials_sheen": {}, "KHR_materials_anisotropy": { "anisotropyStrength": 0.0 } }),
        ),
        (
            "silk",
            json!({ "KHR_materials_sheen": sheen, "KHR_materials_anisotropy": { "anisotropyStrength": 0.5 } }),
        ),
        // Matte: there are no reflections to be dimmed.
        (
            "dull",
            json!({ "KHR_materials_specular": { "specularFactor": 0.5 } }),
        ),
    ] {
        file.push("materials", json!({ "name": name, "extensions": extensions }));
    }
    let told = file.scene().warnings;
    let told: Vec<String> = told.iter().map(ToString::to_string).collect();
    assert_eq!(
        told,
        [
            "material `velvet`, material `silk`: its KHR_materials_sheen was ignored; \
             expect cloth that does not shine at grazing angles",
            "material `silk`: its KHR_materials_anisotropy was ignored; \
             expect round highlights instead of stretched ones",
        ]
    );
}

fn with_uri(uri: &str, beside: &[(&str, &[u8])]) -> Result<Scene> {
    let mut file = Glb::triangle();
    file.json["buffers"] = json!([{ "byteLength": 36, "uri": uri }]);
    let folder = folder();
    let scene_folder = folder.path().join("scene");
    std::fs::create_dir(&scene_folder).expect("folder can be made");
    for (name, bytes) in beside {
        std::fs::write(scene_folder.join(name), bytes).expect("can be written");
    }
    let path = scene_folder.join("scene.gltf");
    std::fs::write(&path, file.json.to_string()).expect("can be written");
    load_path(&path, &LoadOptions::default())
}

#[test]
fn buffers_come_from_the_scenes_folder_alone() {
    let data = Glb::triangle().binary;
    let beside: &[(&str, &[u8])] = &[("a b.bin", &data), ("short.bin", &data[..20])];
    for uri in ["a%20b.bin", "a b.bin", "./a b.bin"] {
        let scene = with_uri(uri, beside).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(scene.triangle_count(), 1, "{uri}");
    }
    for (uri, words) in rows(
        r"
        ../scene/a b.bin => not a relative path within the scene's folder
        %2e%2e/scene/a b.bin => not a relative path within the scene's folder
        /etc/passwd => not a relative path within the scene's folder
        ..\a b.bin => not a relative path within the scene's folder
        http://example.com/a.bin => does not name a local file
        file:///etc/passwd => does not name a local file
        a%2 => its URI is not valid
        => its URI is not valid
        missing.bin => there is no such file
        short.bin => holds 20 bytes where the file states 36
        data:application/octet-stream;base64,AA*A => not valid base64
        data:application/octet-stream;base64,AAAA => holds 3 bytes where the file states 36
        data:nothing => has no data
        ",
    ) {
        says(with_uri(uri, beside).expect_err(uri), words);
    }
    let small = options(|options| options.memory_limit_bytes = 100);
    let refused = load_bytes(&Glb::triangle().bytes(), &small);
    says(refused.expect_err("it is larger"), "is larger than");
}

#[test]
fn data_uris_are_decoded() {
    // (0 0 0), (1 0 0), (0 1 0) as little-endian floats; the two ways of coding them.
    let base64 = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA";
    let percent = "%00".repeat(12) + "%00%00%80?" + &"%00".repeat(12) + "%00%00%80%3F" + &"%00".repeat(4);
    for uri in [
        format!("data:application/octet-stream;base64,{base64}"),
        format!("DATA:application/gltf-buffer;BASE64,{base64}"),
        format!("data:,{percent}"),
    ] {
        let scene = with_uri(&uri, &[]).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(scene.objects[0].mesh_in_scene().area_m2(), 0.5);
    }
}
