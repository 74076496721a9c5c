//! Charts that the program makes itself.

use nephroid::settings::LayerKind::{Direct, Indirect};

use support::laws::Table;
use support::laws::law::*;
use support::laws::scenes::*;
use support::prelude::*;
use support::tools::{set, settings};

pub fn fill(t: &mut Table) {
    for side in [64, 128, 256, 512] {
        t.case("room-of-boxes-without-coordinates")
            .bake_with(
                room_of_boxes(),
                set(settings(1e3, side), |s| s.layers = vec![Direct, Indirect]),
            )
            .without_books()
            .measure("lit texels without indirect light", 0.0, |bake| {
                bake.result.maps.iter().map(without_indirect).fold(0.0, f64::max)
            });
    }
}

/// A cube of 2 m within six boxes, with a lamp in its middle.
fn room_of_boxes() -> Scene {
    let wall = |scene: Scene, (axis, sign): (usize, f64)| {
        let mut half = DVec3::splat(1.0);
        // Each pair of walls reaches over the edges of those after it.
        (0..axis).for_each(|before| half[before] = 1.0);
        (axis + 1..3).for_each(|after| half[after] = 1.1);
        let mut middle = DVec3::ZERO;
        (half[axis], middle[axis]) = (0.05, 1.05 * sign);
        let mut mesh = shapes::cuboid(middle - half, middle + half);
        (mesh.uv0, mesh.uv1) = (None, None);
        scene.diffuse(&format!("wall {axis} {sign}"), mesh)
    };
    let walls = (0..3).flat_map(|axis| [(axis, -1.0), (axis, 1.0)]);
    walls.fold(Scene::default(), wall).lamp(DVec3::ZERO)
}

fn without_indirect(map: &IlluminationMap) -> f64 {
    let [direct, indirect] = [Direct, Indirect].map(|kind| luminance(map, kind));
    let lit = direct.iter().zip(&indirect).filter(|(direct, _)| **direct > 0.0);
    let (all, dark) = lit.fold((0.0, 0.0), |(all, dark), (_, indirect)| {
        (all + 1.0, dark + no(*indirect > 0.0))
    });
    dark / f64::max(all, 1.0)
}
