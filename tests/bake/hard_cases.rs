//! Scenes that estimators find hard.

use nephroid::scene::Scene;
use nephroid::scene::builtin::parts;

use crate::hard_scenes::{self, Shading, TinyBall};
use crate::tools::{bake, energy_fault, settings};

fn all() -> Vec<Scene> {
    let mut scenes = Vec::new();
    for segments in [64, 256, 1024] {
        for shading in [Shading::Smooth, Shading::Flat] {
            scenes.push(hard_scenes::ring(segments, shading));
        }
    }
    scenes.extend([
        hard_scenes::ring_with_blocker(),
        hard_scenes::ball_with_blocker(),
        hard_scenes::torus(parts::mirror()),
        hard_scenes::torus(parts::dielectric("glass", 1.5)),
        hard_scenes::grazing_pool(),
        hard_scenes::mirror_bowl(),
        hard_scenes::glass_bowl(),
        hard_scenes::cut_glass(),
        hard_scenes::tiny_ball(TinyBall::Both),
        hard_scenes::balls_in_series(),
        hard_scenes::ball_in_a_room(),
        hard_scenes::with_tilted_floor(hard_scenes::ball()),
        hard_scenes::with_cut_floor(hard_scenes::ball()),
        hard_scenes::with_tilted_floor(hard_scenes::grazing_pool()),
        hard_scenes::with_cut_floor(hard_scenes::grazing_pool()),
    ]);
    scenes
}

#[test]
fn splats_lose_no_watt_on_hard_scenes() {
    for scene in all() {
        let result = bake(scene.clone(), &settings(2e3, 64));
        assert_eq!(energy_fault(&result), None, "{}", scene.name);
        let deposited = result.ledgers[0].energy_w.deposited;
        assert!(deposited > 0.0, "{}: nothing arrived", scene.name);
    }
}
