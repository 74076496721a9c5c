//! What files can say that cannot be, or lies where single precision ends.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use glam::Vec3;

use support::laws::Table;
use support::laws::law::no;
use support::laws::scenes::MIRRORED_LAMP;
use support::prelude::*;

const FLOOR: [[f32; 3]; 4] = [
    [-0.5, 0.0, -0.5],
    [-0.5, 0.0, 0.5],
    [0.5, 0.0, 0.5],
    [0.5, 0.0, -0.5],
];
const MIRROR: [[f32; 3]; 4] = [
    [0.6, 0.0, -1.0],
    [0.6, 0.0, 1.0],
    [0.6, 1.5, 1.0],
    [0.6, 1.5, -1.0],
];
const UP: [f32; 3] = [0.0, 1.0, 0.0];
const LEFT: [f32; 3] = [-1.0, 0.0, 0.0];

pub fn fill(t: &mut Table) {
    // Normals are made where they are missing or cannot be; opposite ones are a mirror's all the same.
    let x = |x: f32| [x, 0.0, 0.0];
    let bad = [
        x(0.0),
        x(f32::NAN),
        x(f32::INFINITY),
        x(1.0),
        x(-1e-30),
        x(-1e30),
        [f32::NAN; 3],
    ];
    for normal in bad.map(Some).into_iter().chain([None]) {
        let mut file = upright();
        let normals = normal.map(|normal| file.push_floats(&[normal; 4].concat(), 3));
        let attributes = file.json["meshes"][1]["primitives"][0]["attributes"]
            .as_object_mut()
            .expect("a list");
        attributes.remove("NORMAL");
        attributes.extend(normals.map(|normals| ("NORMAL".into(), json!(normals))));
        t.case("normals-missing-zero-or-opposite")
            .bake(file.scene(), 0.01, 32)
            .e_of_lamp("that of the mirrored lamp", 5e-3, MIRRORED_LAMP);
    }
    // A smaller mirror below a node that makes it larger, unevenly, or turns it inside out.
    for scale in [[2.0, 4.0, 0.5], [2.0, 4.0, -0.5], [-2.0, -4.0, -0.5_f64]] {
        let mut file = upright();
        let corners = MIRROR.map(|p| std::array::from_fn(|axis| (f64::from(p[axis]) / scale[axis]) as f32));
        let mesh = rectangle(&mut file, corners, x(-scale[0].signum() as f32), 1);
        file.json["nodes"][1] = json!({ "name": "mirror", "mesh": mesh, "scale": scale });
        t.case("uneven-and-negative-scale")
            .bake(upright().scene(), 0.01, 32)
            .bake(file.scene(), 0.01, 32)
            .as_first("map as of the mirror in its true size", 1e-6, 1.0);
    }
    t.case("attenuation-of-a-nanometre")
        .bake(black_block().scene(), 0.01, 32)
        .ledger("most of it is absorbed", 0.0, |energy| {
            no(energy.absorbed > 0.5 * energy.emitted)
        })
        .share("not absorbed", 0.3, |energy| {
            energy.deposited + energy.escaped + energy.truncated.total()
        });
    for outer in [FRAC_PI_2, 1.6, 7.0] {
        t.case("spot-of-half-the-sky")
            .bake(with_spot(0.0, outer).scene(), 0.01, 32)
            .measure("half-angle, rad", FRAC_PI_2, |bake| {
                match bake.scene.lights[0].kind {
                    LightKind::Spot { outer_cone_rad, .. } => outer_cone_rad,
                    _ => f64::INFINITY,
                }
            })
            .arrives_of_sent(1.0);
    }
    // Light does not end at a distance.
    for range in [0.0, 1e-30] {
        let mut file = upright();
        file.json["extensions"]["KHR_lights_punctual"]["lights"][0]["range"] = json!(range);
        t.case("light-range-0")
            .bake(upright().scene(), 0.01, 32)
            .bake(file.scene(), 0.01, 32)
            .warned("range")
            .bits_as_first("map as without it, bit for bit");
    }
    // Transforms are composed in double precision; 1e9 m have their roundings at 1e-7 m.
    for distance in [1e4, 1e6, 1e9] {
        let mut file = upright();
        let children = file.json["scenes"][0]["nodes"].take();
        file.json["scenes"][0]["nodes"] = json!([]);
        file.push_root(json!({ "translation": [distance, -distance, distance], "children": children }));
        t.case("moved-a-million-metres")
            .bake(upright().scene(), 0.01, 32)
            .bake(file.scene(), 0.01, 32)
            .as_first("map as at the origin", 1e-5, 1.0);
    }
    t.case("vertices-a-million-metres-away")
        .bake(upright().scene(), 0.01, 32)
        .bake(far_vertices().scene(), 0.01, 32)
        .warned("by up to 3.1e-2 m")
        .watts_as_first("watts as near by, as far as 0.03 m allow", 0.2);
}

/// A floor of 1 × 1 m at the origin (material 0), an upright mirror at x = 0.6 m (material 1), and a point light of
/// 683 cd, 1 W/sr, between them: nodes 0 to 2.
fn upright() -> Glb {
    let surface = |name: &str, metallic: f64, roughness: f64| {
        json!({ "name": name, "doubleSided": true,
            "pbrMetallicRoughness": { "metallicFactor": metallic, "roughnessFactor": roughness } })
    };
    let mut file = Glb::empty();
    file.json["extensionsUsed"] = json!([
        "KHR_lights_punctual",
        "KHR_materials_ior",
        "KHR_materials_transmission",
        "KHR_materials_volume"
    ]);
    file.push("materials", surface("matte", 0.0, 1.0));
    file.push("materials", surface("silver", 1.0, 0.0));
    for (name, corners, normal, material) in [("floor", FLOOR, UP, 0), ("mirror", MIRROR, LEFT, 1)] {
        let mesh = rectangle(&mut file, corners, normal, material);
        file.push_root(json!({ "name": name, "mesh": mesh }));
    }
    let mut file = file.with_light("lamp", json!({ "type": "point", "intensity": 683.0 }));
    file.json["nodes"][2]["translation"] = json!([-0.1, 1.0, 0.05]);
    file
}

/// Adds a mesh of two triangles.
fn rectangle(file: &mut Glb, corners: [[f32; 3]; 4], normal: [f32; 3], material: usize) -> usize {
    let positions = file.push_floats(&corners.concat(), 3);
    let normals = file.push_floats(&[normal; 4].concat(), 3);
    let indices = file.push_indices(&[0, 1, 2, 0, 2, 3]);
    file.push_mesh(
        json!({ "attributes": { "POSITION": positions, "NORMAL": normals },
        "indices": indices, "material": material }),
    )
}

/// The mirror's place taken by a pane or block of glass with that extension of its material.
fn with_glass(mut extensions: Value, thickness: f64) -> Glb {
    let mut file = upright();
    extensions["KHR_materials_transmission"] = json!({ "transmissionFactor": 1.0 });
    extensions["KHR_materials_volume"]["thicknessFactor"] = json!(thickness);
    file.json["materials"][1] = json!({ "name": "glass", "doubleSided": true, "extensions": extensions,
        "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 0.0 } });
    file
}

/// A closed block of glass that lets nothing through within a nanometre, with a channel of 0.
fn black_block() -> Glb {
    let volume = json!({ "attenuationDistance": 1e-9, "attenuationColor": [0.5, 0.0, 0.9] });
    let mut file = with_glass(json!({ "KHR_materials_volume": volume }), 0.1);
    let back = [MIRROR[0], MIRROR[3], MIRROR[2], MIRROR[1]].map(|[_, y, z]| [0.8, y, z]);
    let mesh = rectangle(&mut file, back, [1.0, 0.0, 0.0], 1);
    file.push_root(json!({ "name": "back", "mesh": mesh }));
    for (index, from) in MIRROR.into_iter().enumerate() {
        let to = MIRROR[(index + 1) % MIRROR.len()];
        let behind = |[_, y, z]: [f32; 3]| [0.8, y, z];
        let along = Vec3::from(from) - Vec3::from(to);
        let normal = along.cross(Vec3::X).normalize().to_array();
        let mesh = rectangle(&mut file, [to, from, behind(from), behind(to)], normal, 1);
        file.push_root(json!({ "name": "side", "mesh": mesh }));
    }
    file
}

/// A spot that shines along +x on the mirror.
fn with_spot(inner: f64, outer: f64) -> Glb {
    let mut file = upright();
    file.json["extensions"]["KHR_lights_punctual"]["lights"] = json!([{ "type": "spot", "intensity": 683.0,
        "spot": { "innerConeAngle": inner, "outerConeAngle": outer } }]);
    file.json["nodes"][2]["rotation"] = json!([0.0, -FRAC_PI_4.sin(), 0.0, FRAC_PI_4.cos()]);
    file
}

/// Vertices that a file states in single precision far from its origin.
fn far_vertices() -> Glb {
    let mut file = upright();
    for (node, (corners, normal)) in [(FLOOR, UP), (MIRROR, LEFT)].into_iter().enumerate() {
        let mesh = rectangle(&mut file, corners.map(|[x, y, z]| [x + 1e6, y, z]), normal, node);
        file.json["nodes"][node]["mesh"] = json!(mesh);
    }
    file.json["nodes"][2]["translation"] = json!([1e6 - 0.1, 1.0, 0.05]);
    file
}
