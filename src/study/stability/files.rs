//! What files can say that cannot be, or lies where single precision ends.

use glam::DVec3;
use serde_json::{Value, json};

use super::file::File;
use super::laws::{apart, deposited_w, emitted_w, luminance, map_of, off, same_bits};
use super::scenes::{at, upright_theory};
use super::{Bench, Case, Group};
use crate::error::Result;
use crate::scene::{LightKind, Scene};
use crate::settings::{BakeSettings, LayerKind};

/// Cases that begin with a file.
pub const CASES: &[Case] = &[
    Case::quick("vertices-that-are-no-numbers", Group::Geometry, no_numbers),
    Case::quick("normals-missing-zero-or-opposite", Group::Geometry, bad_normals),
    Case::quick("uneven-and-negative-scale", Group::Geometry, uneven_scale),
    Case::quick("ior-0", Group::Materials, ior_zero),
    Case::quick(
        "attenuation-distance-0",
        Group::Materials,
        no_attenuation_distance,
    ),
    Case::quick("attenuation-of-a-nanometre", Group::Materials, black_glass),
    Case::quick("spot-of-one-angle", Group::Materials, hard_spot),
    Case::quick("spot-of-half-the-sky", Group::Materials, widest_spot),
    Case::quick("light-range-0", Group::Materials, range_zero),
    Case::quick("light-of-no-power", Group::Numbers, no_power),
    Case::quick("moved-a-million-metres", Group::Numbers, moved_far),
    Case::quick("vertices-a-million-metres-away", Group::Numbers, far_vertices),
];

const SETTINGS: fn() -> BakeSettings = || at(1e3, 32);

fn warned(scene: &Scene, word: &str) -> bool {
    scene.warnings.iter().any(|warning| warning.what.contains(word))
}

/// Positions that are infinite or not a number are refused, with the vertex.
fn no_numbers(bench: &mut Bench) -> Result<()> {
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX] {
        let mut file = File::upright_mirror();
        let corners = [
            [0.6, 0.0, -1.0],
            [0.6, 0.0, 1.0],
            [bad, 1.5, 1.0],
            [0.6, 1.5, -1.0],
        ];
        let mesh = file.add_rectangle(corners, [-1.0, 0.0, 0.0], 1);
        file.json["nodes"][1]["mesh"] = json!(mesh);
        let refused = file.load().is_err_and(|error| error.what.contains("vertex 2"));
        bench.must("refused by name", refused);
    }
    Ok(())
}

/// Normals are made where they are missing or cannot be; opposite ones are a mirror's all the same.
fn bad_normals(bench: &mut Bench) -> Result<()> {
    let bad = [
        [0.0; 3],
        [f32::NAN; 3],
        [f32::INFINITY, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [-1e-30, 0.0, 0.0],
        [-1e30, 0.0, 0.0],
    ];
    for normal in bad.map(Some).into_iter().chain([None]) {
        let mut file = File::upright_mirror();
        let attributes = &mut file.json["meshes"][1]["primitives"][0]["attributes"];
        let old = attributes["NORMAL"].take();
        if let Some(fields) = attributes.as_object_mut() {
            fields.remove("NORMAL");
        }
        if let Some(normal) = normal {
            let normals = file.add_vectors(&[normal; 4]);
            file.json["meshes"][1]["primitives"][0]["attributes"]["NORMAL"] = json!(normals);
        }
        drop(old);
        let scene = file.load()?;
        let result = bench.bake(&scene, &SETTINGS())?;
        bench.law(
            "E is that of the mirrored lamp",
            file_theory(&result, &scene),
            5e-3,
        );
    }
    Ok(())
}

/// Of the floor of a file, which has no texture coordinates of its own: by the map's chart.
fn file_theory(result: &crate::session::BakeResult, scene: &Scene) -> f64 {
    let Some(map) = map_of(result, scene, "floor") else {
        return f64::INFINITY;
    };
    let chart = &map.chart;
    let values = luminance(Some(map), LayerKind::Caustic);
    let mesh = &scene.objects[chart.object()].mesh;
    let (mut squares, mut sum) = (0.0, 0.0);
    for (texel, e) in values.iter().enumerate() {
        let uv = glam::DVec2::new(
            ((texel % chart.width) as f64 + 0.5) / chart.width as f64,
            ((texel / chart.width) as f64 + 0.5) / chart.height as f64,
        );
        let Some(point) = point_at(chart, mesh, uv) else {
            continue;
        };
        let expected = upright_theory(point + scene.origin_world);
        squares += (e - expected).powi(2);
        sum += expected;
    }
    (squares / values.len() as f64).sqrt() / (sum / values.len() as f64)
}

/// Where map coordinates lie on a flat surface.
fn point_at(chart: &crate::illumination::Chart, mesh: &crate::scene::Mesh, uv: glam::DVec2) -> Option<DVec3> {
    let [a, b, c] = *chart.corner_uvs.first()?;
    let [pa, pb, pc] = mesh.corners(0);
    let from = glam::DMat2::from_cols(b - a, c - a);
    let weights = from.inverse() * (uv - a);
    Some(pa + (pb - pa) * weights.x + (pc - pa) * weights.y)
}

/// A mirror of half the size below a node that doubles it, unevenly, or turns it inside out.
fn uneven_scale(bench: &mut Bench) -> Result<()> {
    let plain = bench_file(bench, &File::upright_mirror())?;
    for scale in [[2.0, 4.0, 0.5], [2.0, 4.0, -0.5], [-2.0, -4.0, -0.5]] {
        let mut file = File::upright_mirror();
        let at =
            |x: f64, y: f64, z: f64| [x / scale[0], y / scale[1], z / scale[2]].map(|value| value as f32);
        let corners = [
            at(0.6, 0.0, -1.0),
            at(0.6, 0.0, 1.0),
            at(0.6, 1.5, 1.0),
            at(0.6, 1.5, -1.0),
        ];
        let mesh = file.add_rectangle(corners, [(-scale[0]).signum() as f32, 0.0, 0.0], 1);
        file.json["nodes"][1] = json!({ "name": "mirror", "mesh": mesh, "scale": scale });
        let scaled = bench_file(bench, &file)?;
        bench.law(
            "map as of the mirror in its true size",
            apart(&scaled, &plain),
            1e-6,
        );
    }
    Ok(())
}

fn bench_file(bench: &mut Bench, file: &File) -> Result<crate::session::BakeResult> {
    let scene = file.load()?;
    bench.bake(&scene, &SETTINGS())
}

/// The mirror's place taken by a pane or block of glass with that extension of its material.
fn with_glass(extensions: Value, thickness: f64) -> File {
    let mut file = File::upright_mirror();
    let mut extensions = extensions;
    extensions["KHR_materials_transmission"] = json!({ "transmissionFactor": 1.0 });
    extensions["KHR_materials_volume"]["thicknessFactor"] = json!(thickness);
    file.json["materials"][1] = json!({ "name": "glass", "doubleSided": true, "extensions": extensions,
        "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 0.0 } });
    file
}

/// glTF's index 0 stands for full reflection: it is read as 1.5 and named.
fn ior_zero(bench: &mut Bench) -> Result<()> {
    for ior in [0.0, 0.5, -1.0] {
        let file = with_glass(json!({ "KHR_materials_ior": { "ior": ior } }), 0.0);
        let scene = file.load()?;
        bench.must("named in a warning", warned(&scene, "refractive index"));
        let indices = scene.materials.iter().map(|material| material.ior);
        bench.must(
            "indices are at least 1",
            indices.into_iter().all(|ior| ior >= 1.0),
        );
        let result = bench.bake(&scene, &SETTINGS())?;
        bench.law(
            "no more arrives than was sent",
            deposited_w(&result) / emitted_w(&result),
            1.0,
        );
    }
    Ok(())
}

fn no_attenuation_distance(bench: &mut Bench) -> Result<()> {
    for distance in [0.0, -1.0] {
        let volume = json!({ "KHR_materials_volume": { "attenuationDistance": distance,
            "attenuationColor": [0.5, 0.0, 1.0] } });
        let scene = with_glass(volume, 0.1).load()?;
        bench.must("named in a warning", warned(&scene, "attenuation distance"));
        let result = bench.bake(&scene, &SETTINGS())?;
        bench.law(
            "no more arrives than was sent",
            deposited_w(&result) / emitted_w(&result),
            1.0,
        );
    }
    Ok(())
}

/// Glass that lets nothing through within a nanometre, with a channel of 0: what enters is absorbed.
fn black_glass(bench: &mut Bench) -> Result<()> {
    let volume = json!({ "KHR_materials_volume": { "attenuationDistance": 1e-9, "attenuationColor": [0.5, 0.0, 0.9] } });
    let mut file = with_glass(volume, 0.1);
    // A block instead of a pane: a back face behind the front.
    let back = [
        [0.8, 0.0, -1.0],
        [0.8, 1.5, -1.0],
        [0.8, 1.5, 1.0],
        [0.8, 0.0, 1.0],
    ];
    let mesh = file.add_rectangle(back, [1.0, 0.0, 0.0], 1);
    let node = file.push("nodes", json!({ "name": "back", "mesh": mesh }));
    file.push_root(node);
    let result = bench_file(bench, &file)?;
    let energy = result.ledgers[0].energy_w;
    bench.must("most of it is absorbed", energy.absorbed > 0.5 * energy.emitted);
    let reflected = energy.deposited + energy.escaped + energy.truncated.total();
    bench.law(
        "none but what the front reflects goes on",
        reflected / energy.emitted,
        0.3,
    );
    Ok(())
}

/// A spot over the mirror that lights it all.
fn with_spot(inner: f64, outer: f64) -> File {
    let mut file = File::upright_mirror();
    file.json["extensions"]["KHR_lights_punctual"]["lights"] = json!([{ "type": "spot", "intensity": 683.0,
        "spot": { "innerConeAngle": inner, "outerConeAngle": outer } }]);
    // Along +x: a quarter turn about y.
    let half = std::f64::consts::FRAC_PI_4;
    file.json["nodes"][2]["rotation"] = json!([0.0, -half.sin(), 0.0, half.cos()]);
    file
}

/// Inner and outer angle the same: an edge as hard as can be.
fn hard_spot(bench: &mut Bench) -> Result<()> {
    for angle in [0.2, 0.5] {
        let scene = with_spot(angle, angle).load()?;
        bench.must("named in a warning", warned(&scene, "inner cone angle"));
        let result = bench.bake(&scene, &at(4e3, 32))?;
        let expected = std::f64::consts::TAU * (1.0 - f64::cos(angle));
        bench.law("it sends I 2π(1 − cos)", off(emitted_w(&result), expected), 2e-3);
    }
    Ok(())
}

/// An outer angle of 90 degrees, and beyond.
fn widest_spot(bench: &mut Bench) -> Result<()> {
    for outer in [std::f64::consts::FRAC_PI_2, 1.6, 7.0] {
        let scene = with_spot(0.0, outer).load()?;
        let angle = match scene.lights[0].kind {
            LightKind::Spot { outer_cone_rad, .. } => outer_cone_rad,
            _ => f64::INFINITY,
        };
        bench.law("read as at most π/2", angle, std::f64::consts::FRAC_PI_2);
        let result = bench.bake(&scene, &SETTINGS())?;
        bench.law(
            "no more arrives than was sent",
            deposited_w(&result) / emitted_w(&result),
            1.0,
        );
    }
    Ok(())
}

/// Light does not end at a distance: a range is named and changes nothing.
fn range_zero(bench: &mut Bench) -> Result<()> {
    let plain = bench_file(bench, &File::upright_mirror())?;
    for range in [0.0, 1e-30] {
        let mut file = File::upright_mirror();
        file.json["extensions"]["KHR_lights_punctual"]["lights"][0]["range"] = json!(range);
        let scene = file.load()?;
        let ranged = bench.bake(&scene, &SETTINGS())?;
        bench.must("named in a warning", warned(&scene, "range"));
        bench.must("map as without it, bit for bit", same_bits(&plain, &ranged));
    }
    Ok(())
}

/// Lights that send nothing, less than nothing, or without end.
fn no_power(bench: &mut Bench) -> Result<()> {
    for intensity in [json!(0.0), json!(-1.0), json!(1e39), json!(1e-60)] {
        let mut file = File::upright_mirror();
        let light = &mut file.json["extensions"]["KHR_lights_punctual"]["lights"][0];
        light["intensity"] = intensity;
        match file.load() {
            Err(error) => bench.must("left out or refused by name", error.to_string().contains("light")),
            Ok(scene) => {
                let left_out = scene.lights.is_empty() && warned(&scene, "left out");
                bench.must("left out or refused by name", left_out);
            }
        }
    }
    Ok(())
}

/// A parent node that puts everything a million metres away: transforms are composed in double precision.
fn moved_far(bench: &mut Bench) -> Result<()> {
    let near = bench_file(bench, &File::upright_mirror())?;
    for distance in [1e4, 1e6, 1e9] {
        let far = File::upright_mirror().below(json!({ "translation": [distance, -distance, distance] }));
        let far = bench_file(bench, &far)?;
        // 1e9 m have their roundings at 1e-7 m.
        bench.law("map as at the origin", apart(&far, &near), 1e-5);
    }
    Ok(())
}

/// Vertices that a file states in single precision far from its origin: a warning says how coarse they are.
fn far_vertices(bench: &mut Bench) -> Result<()> {
    let mut file = File::upright_mirror();
    let far = |corners: [[f32; 3]; 4]| corners.map(|[x, y, z]| [x + 1e6, y, z]);
    let (low, high) = (-0.5, 0.5);
    let floor = [
        [low, 0.0, low],
        [low, 0.0, high],
        [high, 0.0, high],
        [high, 0.0, low],
    ];
    let mesh = file.add_rectangle(far(floor), [0.0, 1.0, 0.0], 0);
    file.json["nodes"][0]["mesh"] = json!(mesh);
    let mirror = [
        [0.6, 0.0, -1.0],
        [0.6, 0.0, 1.0],
        [0.6, 1.5, 1.0],
        [0.6, 1.5, -1.0],
    ];
    let mesh = file.add_rectangle(far(mirror), [-1.0, 0.0, 0.0], 1);
    file.json["nodes"][1]["mesh"] = json!(mesh);
    file.json["nodes"][2]["translation"] = json!([1e6 - 0.1, 1.0, 0.05]);
    let scene = file.load()?;
    bench.must(
        "a warning states the rounding",
        warned(&scene, "by up to 3.1e-2 m"),
    );
    let result = bench.bake(&scene, &SETTINGS())?;
    let near = bench_file(bench, &File::upright_mirror())?;
    let watts = off(deposited_w(&result), deposited_w(&near));
    bench.law("watts as near by, as far as 0.03 m allow", watts, 0.2);
    Ok(())
}
