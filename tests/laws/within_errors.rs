//! Laws whose two sides are traced by different rays: they hold within what both bakes estimate of their errors.

use std::cell::RefCell;

use glam::{DQuat, DVec3};
use nephroid::scene::Scene;

use crate::changes::{mirrored, moved, scaled, thinned};
use crate::maps::distance;
use crate::trial::{baked, hold};

type Change = fn(&Scene) -> (Scene, f64);

const CHANGES: [(&str, Change); 3] = [
    ("a rigid motion changes nothing", |scene| {
        let turn = DQuat::from_rotation_y(0.7) * DQuat::from_rotation_x(-1.1) * DQuat::from_rotation_z(2.3);
        (moved(scene.clone(), turn, DVec3::new(3.1, -2.7, 1.9)), 1.0)
    }),
    ("a mirror image is a mirror image", |scene| {
        (mirrored(scene.clone()), 1.0)
    }),
    ("scale thins light out", |scene| {
        (scaled(scene.clone(), 3.7), thinned(scene, 3.7))
    }),
];

#[test]
fn laws_within_the_summed_estimated_errors() {
    let ratios = RefCell::new([const { Vec::new() }; 3]);
    hold(|recipe| {
        let settings = recipe.settings();
        let scene = recipe.scene();
        let bake = baked(scene.clone(), &settings);
        for (index, (_, change)) in CHANGES.into_iter().enumerate() {
            let (changed, factor) = change(&scene);
            let other = baked(changed, &settings);
            let Some(distance) = distance(&bake, &other, factor) else {
                return Ok(false);
            };
            ratios.borrow_mut()[index].push((distance.relative_rmse / distance.estimated, distance));
        }
        Ok(true)
    });
    for (index, mut ratios) in ratios.into_inner().into_iter().enumerate() {
        ratios.sort_by(|a, b| f64::total_cmp(&a.0, &b.0));
        println!("{}: {ratios:.2?}", CHANGES[index].0);
    }
}
