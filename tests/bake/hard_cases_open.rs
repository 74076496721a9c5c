//! Scenes that estimators find hard, against brute force on the same meshes: those that the estimator has yet to meet.

use nephroid::scene::builtin::parts;
use nephroid::settings::BakeSettings;
use nephroid::study::agreement::{TexelPair, caustic_luminance};

use crate::hard_cases::{
    Case, Distance, LARGEST_ERROR, cases, check, check_shadow_edges, estimator_settings,
};
use crate::hard_scenes::{self, Shading, TinyBall};
use crate::stored_references::{SIDE, stored};
use crate::tools::{bake, energy_fault};

/// Light rays per steradian at which the tiny ball is a hundredth of a cell wide.
const TINY_BALL_DENSITY: f64 = 1e3;

#[test]
fn flat_rings_of_any_number_of_segments() {
    for segments in [64, 256, 1024] {
        check(&hard_scenes::ring(segments, Shading::Flat));
    }
}

#[test]
fn a_blocker_between_ball_and_floor() {
    check(&hard_scenes::ball_with_blocker());
    check_shadow_edges(&hard_scenes::ball_with_blocker());
}

#[test]
fn a_mirror_torus_that_hides_a_part_of_itself() {
    check(&hard_scenes::torus(parts::mirror()));
}

#[test]
fn a_glass_torus_that_hides_a_part_of_itself() {
    check(&hard_scenes::torus(parts::dielectric("glass", 1.5)));
}

#[test]
fn waves_under_a_grazing_sun() {
    check(&hard_scenes::grazing_pool());
}

#[test]
fn a_glass_bowl() {
    check(&hard_scenes::glass_bowl());
}

#[test]
fn cut_glass_of_some_hundred_facets() {
    check(&hard_scenes::cut_glass());
}

#[test]
fn a_ball_a_hundredth_of_a_cell_wide() {
    let scene = hard_scenes::tiny_ball(TinyBall::Both);
    let [ball, mirror] = [TinyBall::Ball, TinyBall::Mirror].map(|part| stored(&hard_scenes::tiny_ball(part)));
    let settings = BakeSettings {
        density_per_sr: TINY_BALL_DENSITY,
        ..estimator_settings()
    };
    let result = bake(scene, &settings);
    assert_eq!(energy_fault(&result), None);
    let image = caustic_luminance(&result.maps[0]);
    let [ball_e, mirror_e] = [&ball, &mirror].map(|reference| caustic_luminance(&reference.maps[0]));
    let pairs = |wanted: &dyn Fn(usize) -> bool| -> Vec<TexelPair> {
        (0..image.len())
            .filter(|&texel| wanted(texel))
            .map(|texel| TexelPair {
                image: image[texel],
                reference: ball_e[texel] + mirror_e[texel],
                area_m2: 1.0,
            })
            .collect()
    };
    let whole = Distance::of_pairs(&pairs(&|_| true), mirror.noise);
    assert!(whole.relative_rmse <= LARGEST_ERROR, "{whole:?}");
    // The mirror is brighter by a million: the ball's light has to be looked for where the mirror sends none.
    let lit_by_mirror = |column: usize, row: usize| mirror_e[row * SIDE + column] > 0.0;
    let near_mirror = |texel: usize| {
        let (column, row) = (texel % SIDE, texel / SIDE);
        (row.saturating_sub(1)..(row + 2).min(SIDE)).any(|near_row| {
            (column.saturating_sub(1)..(column + 2).min(SIDE))
                .any(|near_column| lit_by_mirror(near_column, near_row))
        })
    };
    let alone = Distance::of_pairs(&pairs(&|texel| !near_mirror(texel)), ball.noise);
    assert!(
        (alone.agreement.flux_ratio - 1.0).abs() <= LARGEST_ERROR,
        "the ball's light: {alone:?}"
    );
    assert!(
        alone.relative_rmse <= LARGEST_ERROR,
        "the ball's light: {alone:?}"
    );
}

#[test]
fn two_balls_in_series() {
    check(&hard_scenes::balls_in_series());
}

#[test]
fn several_receivers_under_one_ball() {
    check(&hard_scenes::ball_in_a_room());
}

#[test]
fn tilted_floors() {
    check(&hard_scenes::with_tilted_floor(hard_scenes::ball()));
    check(&hard_scenes::with_tilted_floor(hard_scenes::grazing_pool()));
}

#[test]
fn floors_cut_in_two() {
    check(&hard_scenes::with_cut_floor(hard_scenes::ball()));
    check(&hard_scenes::with_cut_floor(hard_scenes::grazing_pool()));
}

#[test]
fn the_estimator_loses_no_watt_on_hard_scenes() {
    for Case { scene, .. } in cases() {
        let result = bake(scene.clone(), &estimator_settings());
        assert_eq!(energy_fault(&result), None, "{}", scene.name);
        let deposited = result.ledgers[0].energy_w.deposited;
        assert!(deposited > 0.0, "{}: nothing arrived", scene.name);
    }
}
