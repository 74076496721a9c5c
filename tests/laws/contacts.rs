//! Surfaces that meet, and bodies of several parts, as files bring them.

use nephroid::illumination::Side;
use nephroid::optics::fresnel::dielectric_reflectance;
use nephroid::scene::contacts;

use support::laws::law::*;
use support::laws::scenes::*;
use support::laws::{Baked, Table};
use support::meshes::inside_out;
use support::prelude::*;
use support::tools::{set, to};

/// Gaps of a rounding error to single precision, one way and the other.
const GAPS_M: [f64; 3] = [0.0, 6e-8, -6e-8];

pub fn fill(t: &mut Table) {
    let bright_branches = || set(to(0.01, 16), |s| s.branch_threshold = Some(1e-4));
    for gap_m in GAPS_M {
        t.case("touching-glass")
            .bake_with(apart(slabs(&[[0.3, 0.7]], 1.5)), bright_branches())
            .bake_with(
                apart(slabs(&[[0.3, 0.5], [0.5 + gap_m, 0.7]], 1.5)),
                bright_branches(),
            )
            .as_first("map as of one slab", 1e-6, 1.0);
        t.case("liquid-in-its-glass")
            .bake_with(apart(slabs(&[[0.5, 0.7], [0.3, 0.501]], 1.33)), bright_branches())
            .bake_with(
                apart(slabs(&[[0.5, 0.7], [0.3, 0.5 + gap_m]], 1.33)),
                bright_branches(),
            )
            .as_first("map as where they overlap", 1e-2, 1.0);
        // Glass that rests on something has no surface below.
        t.case("glass-on-the-floor")
            .bake_with(
                apart(floor(0.5).sun(DVec3::NEG_Y).glass(1.5, slab(gap_m, 0.2))),
                thoroughly(to(0.01, 16)),
            )
            .e("1 − R", 1e-6, |_| 1.0 - dielectric_reflectance(1.0, 1.5));
        let rug = shapes::floor([-0.2, 0.2], [-0.2, 0.2], gap_m);
        t.case("rug-on-the-floor")
            .bake(before(upright()), 0.01, 32)
            .bake(apart(before(upright()).diffuse("rug", rug)), 0.01, 32)
            .watts_as_first("watts as without it", 1e-3)
            .measure("the rug holds what falls on its place", 1e-2, on_the_rug);
        let back = inside_out(shapes::floor([-0.5, 0.5], [-0.5, 0.5], gap_m));
        t.case("floor-of-two-nodes-back-to-back")
            .bake(before(upright()), 0.01, 32)
            .bake(apart(before(upright()).diffuse("back", back)), 0.01, 32)
            .watts_as_first("watts as of a single floor", 1e-3);
    }
    t.case("floor-doubled-back-to-back")
        .bake(before(upright()), 0.01, 32)
        .bake(before(upright()).reshaped(0, back_to_back), 0.01, 32)
        .watts_as_first("watts as of a single floor", 1e-3)
        .must("only the side that is met is lit", |bake| {
            let mut maps = bake.result.maps.iter();
            maps.all(|map| map.chart.receiver.side() == Side::Front)
        });
}

fn apart(mut scene: Scene) -> Scene {
    let warnings = contacts::set_apart(&mut scene, None);
    scene.warnings.extend(warnings);
    scene
}

fn back_to_back(mesh: &mut Mesh) {
    let back = inside_out(mesh.clone());
    shapes::append(mesh, &back);
}

/// How far the rug's mean E is off that of the lamp.
fn on_the_rug(bake: &Baked) -> f64 {
    let Some(map) = map_of(bake, "rug") else {
        return f64::INFINITY;
    };
    let held_w = map.flux_w(LayerKind::Caustic).luminance();
    let middles = (0..64).flat_map(|x| (0..64).map(move |z| [x, z]));
    let mean = middles.map(|place| {
        let [x, z] = place.map(|index| (f64::from(index) + 0.5) / 64.0 * 0.4 - 0.2);
        from_lamp(dvec3(x, 0.0, z), MIRRORED_LAMP) / 4096.0
    });
    off(held_w, mean.sum::<f64>() * 0.16)
}
