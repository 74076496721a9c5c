//! The references: whole, and of the scenes that are built in.

use crate::prelude::*;
use support::glb::load_path;
use support::{project_file, reference_map, shared_or_skip};

/// The maps' headers and means are those that `assets/SOURCES.md` states, to six decimals.
#[test]
fn references_are_whole() {
    for (file, mean) in [
        ("S1", 1.748_115),
        ("S2", 0.757_516),
        ("S3", 0.942_750),
        ("S5", 0.321_665),
        ("S6", 1.622_741),
        ("S7", 0.502_656),
        ("S8", 0.241_662),
    ] {
        let values = reference_map(file);
        assert_eq!(values.len(), 256 * 256);
        near(values.iter().sum::<f64>() / 65_536.0, mean, 5.1e-7, file);
    }
    project_file("assets/reference/S2_profile.csv");
}

/// The corners of a mesh, triangle by triangle, in an order that says nothing of the file's.
fn corners(mesh: &Mesh) -> Vec<[i64; 3]> {
    // The file states 32-bit numbers: to 1 µm.
    let round = |point: DVec3| point.to_array().map(|x| (x * 1e6).round() as i64);
    let all = (0..mesh.triangles.len()).flat_map(|triangle| mesh.corners(triangle));
    let mut all: Vec<_> = all.map(round).collect();
    all.sort_unstable();
    all.dedup();
    all
}

#[test]
fn prism_is_that_of_its_file() {
    let Some(path) = shared_or_skip("oracle/S4.glb") else {
        return;
    };
    let scene = load_path(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    let ours = built_in("prism");
    warns_not(&scene);
    let sun = |scene: &Scene| match scene.lights[0].kind {
        LightKind::Sun {
            direction,
            normal_irradiance,
        } => (direction, normal_irradiance.0),
        kind => panic!("{kind:?}"),
    };
    // The file states 32-bit numbers.
    near(sun(&scene).0, sun(&ours).0, 1e-6, "direction");
    assert_close(sun(&scene).1, sun(&ours).1, 1e-6, "irradiance");
    assert_eq!(scene.objects.len(), ours.objects.len());
    for (index, (theirs, own)) in scene.objects.iter().zip(&ours.objects).enumerate() {
        assert_eq!(corners(&theirs.mesh), corners(&own.mesh), "{}", own.name);
        assert_close(theirs.mesh.area_m2(), own.mesh.area_m2(), 1e-4, &own.name);
        let (theirs, own) = (scene.material_of(index), ours.material_of(index));
        assert_eq!(theirs.surface, own.surface);
        assert_eq!(theirs.base_colour, own.base_colour);
        for nm in [400.0, 486.13, 587.56, 656.27, 700.0] {
            let [a, b] = [theirs, own].map(|material| material.index_at(Nanometres(nm)));
            assert_close(a, b, 1e-12, "refractive index");
        }
    }
    let [wall, own] = [&scene, &ours].map(|scene| &scene.objects[0].mesh);
    let [uvs, own_uvs] = [wall, own].map(|mesh| mesh.uv0.as_ref().expect("it has TEXCOORD_0"));
    assert_eq!(wall.positions.len(), 4);
    for (position, uv) in wall.positions.iter().zip(uvs) {
        let mut corners = own.positions.iter();
        let same = corners.position(|own| own.distance(*position) < 1e-6);
        assert_eq!(own_uvs[same.expect("the same corner")], *uv);
    }
}
