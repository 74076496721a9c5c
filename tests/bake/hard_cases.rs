//! Scenes that estimators find hard, against brute force on the same meshes.

#[path = "stored_references.rs"]
pub mod stored_references;

use nephroid::illumination::IlluminationMap;
use nephroid::scene::Scene;
use nephroid::scene::builtin::parts;
use nephroid::session::BakeResult;
use nephroid::settings::BakeSettings;
use nephroid::study::agreement::{Agreement, TexelPair, caustic_luminance, pair_maps};

use crate::brute_force::brute;
use crate::hard_scenes::{self, Shading, TinyBall};
use crate::tools::{bake, energy_fault, settings};
use stored_references::{SIDE, StoredReference, stored};

/// Largest relative RMSE of a bake, over all maps and by area, without the reference's noise.
pub const LARGEST_ERROR: f64 = 0.02;

/// Largest noise of a reference.
const LARGEST_NOISE: f64 = 0.007;

/// A scene, and the rays that bring the noise of its reference below [`LARGEST_NOISE`].
pub struct Case {
    pub scene: Scene,
    rays: f64,
}

pub fn cases() -> Vec<Case> {
    let case = |rays, scene| Case { scene, rays };
    let mut cases = Vec::new();
    for segments in [64, 256, 1024] {
        for shading in [Shading::Smooth, Shading::Flat] {
            cases.push(case(8e6, hard_scenes::ring(segments, shading)));
        }
    }
    cases.extend([
        case(8e6, hard_scenes::ring_with_blocker()),
        case(28e6, hard_scenes::ball_with_blocker()),
        case(120e6, hard_scenes::torus(parts::mirror())),
        case(6e6, hard_scenes::torus(parts::dielectric("glass", 1.5))),
        case(30e6, hard_scenes::grazing_pool()),
        case(30e6, hard_scenes::mirror_bowl()),
        case(5e6, hard_scenes::glass_bowl()),
        case(5e6, hard_scenes::cut_glass()),
        case(4e6, hard_scenes::tiny_ball(TinyBall::Ball)),
        case(2e6, hard_scenes::tiny_ball(TinyBall::Mirror)),
        case(5e6, hard_scenes::balls_in_series()),
        case(6e6, hard_scenes::ball_in_a_room()),
        case(4e6, hard_scenes::with_tilted_floor(hard_scenes::ball())),
        case(6e6, hard_scenes::with_cut_floor(hard_scenes::ball())),
        case(20e6, hard_scenes::with_tilted_floor(hard_scenes::grazing_pool())),
        case(50e6, hard_scenes::with_cut_floor(hard_scenes::grazing_pool())),
    ]);
    cases
}

/// The estimator and density that the cases are held to.
pub fn estimator_settings() -> BakeSettings {
    BakeSettings {
        map_resolution: settings(1.0, SIDE).map_resolution,
        ..BakeSettings::default()
    }
}

/// How far a bake is from its reference.
#[derive(Clone, Copy, Debug)]
pub struct Distance {
    /// Without the reference's noise, in quadrature.
    pub relative_rmse: f64,
    pub noise: f64,
    pub agreement: Agreement,
}

impl Distance {
    fn of(maps: &[IlluminationMap], reference: &StoredReference) -> Self {
        let pairs = pair_maps(maps, &reference.maps).expect("maps of one size");
        Self::of_pairs(&pairs, reference.noise)
    }

    pub fn of_pairs(pairs: &[TexelPair], noise: f64) -> Self {
        let agreement = Agreement::of(pairs).expect("a reference with light");
        Self {
            relative_rmse: (agreement.relative_rmse.powi(2) - noise * noise).max(0.0).sqrt(),
            noise,
            agreement,
        }
    }
}

/// The same with four times the rays, for light that converges or divides strongly.
fn dense() -> BakeSettings {
    BakeSettings {
        density_per_sr: 4.0 * estimator_settings().density_per_sr,
        ..estimator_settings()
    }
}

/// Bakes a scene and holds it to its reference.
#[track_caller]
pub fn check(scene: &Scene) {
    check_at(scene, &estimator_settings(), LARGEST_ERROR);
}

#[track_caller]
fn check_at(scene: &Scene, settings: &BakeSettings, largest_error: f64) {
    let reference = stored(scene);
    let result = bake(scene.clone(), settings);
    assert_eq!(energy_fault(&result), None, "{}", scene.name);
    let distance = Distance::of(&result.maps, &reference);
    assert!(distance.noise <= LARGEST_NOISE, "{}: {distance:?}", scene.name);
    assert!(
        distance.relative_rmse <= largest_error,
        "{}: {:.2} % from brute force with {} rays: {distance:?}",
        scene.name,
        100.0 * distance.relative_rmse,
        result.counts.rays
    );
}

/// Texels that are brighter or darker than everything within one texel of them is in the reference, by more than 5 %
/// and a fiftieth of the mean: light or shadow that lies farther from its place than a texel.
fn displaced_texels(image: &[f64], reference: &[f64]) -> usize {
    let mean = reference.iter().sum::<f64>() / reference.len() as f64;
    let displaced = |texel: usize| {
        let (column, row) = (texel % SIDE, texel / SIDE);
        let near = (row.saturating_sub(1)..(row + 2).min(SIDE)).flat_map(|near_row| {
            (column.saturating_sub(1)..(column + 2).min(SIDE))
                .map(move |near_column| near_row * SIDE + near_column)
        });
        let (low, high) = near.fold((f64::INFINITY, 0.0_f64), |(low, high), texel| {
            (low.min(reference[texel]), high.max(reference[texel]))
        });
        let slack = 0.02 * mean;
        image[texel] < 0.95 * low - slack || image[texel] > 1.05 * high + slack
    };
    (0..image.len()).filter(|&texel| displaced(texel)).count()
}

#[track_caller]
pub fn check_shadow_edges(scene: &Scene) {
    let reference = stored(scene);
    let result = bake(scene.clone(), &estimator_settings());
    let of_floor = |maps: &[IlluminationMap]| {
        let floor = |map: &&IlluminationMap| scene.objects[map.chart.object()].name == "floor";
        caustic_luminance(maps.iter().find(floor).expect("a lit floor"))
    };
    let displaced = displaced_texels(&of_floor(&result.maps), &of_floor(&reference.maps));
    assert_eq!(displaced, 0, "{}: texels off by more than one", scene.name);
}

#[test]
fn a_shadow_that_is_two_texels_off_is_noticed() {
    let reference = stored(&hard_scenes::ring_with_blocker());
    let image = caustic_luminance(&reference.maps[0]);
    assert_eq!(displaced_texels(&image, &image), 0);
    let mut moved = image.clone();
    moved.rotate_right(2);
    assert!(displaced_texels(&moved, &image) > 20);
}

#[test]
fn smooth_rings_of_any_number_of_segments() {
    for segments in [64, 256, 1024] {
        check(&hard_scenes::ring(segments, Shading::Smooth));
    }
}

#[test]
fn a_blocker_between_light_and_ring() {
    check(&hard_scenes::ring_with_blocker());
    check_shadow_edges(&hard_scenes::ring_with_blocker());
}

#[test]
fn a_mirror_bowl_around_its_lamp() {
    check(&hard_scenes::mirror_bowl());
}

#[test]
fn flat_rings_of_any_number_of_segments() {
    for segments in [64, 256, 1024] {
        check(&hard_scenes::ring(segments, Shading::Flat));
    }
}

#[test]
fn glass_that_hides_a_part_of_itself() {
    check(&hard_scenes::torus(parts::dielectric("glass", 1.5)));
    check(&hard_scenes::glass_bowl());
}

#[test]
fn cut_glass_of_some_hundred_facets() {
    check_at(&hard_scenes::cut_glass(), &dense(), LARGEST_ERROR);
}

#[test]
fn two_balls_in_series() {
    check_at(&hard_scenes::balls_in_series(), &dense(), LARGEST_ERROR);
}

#[test]
fn blocked_cut_and_tilted_receivers_of_a_focus() {
    for scene in [
        hard_scenes::ball_with_blocker(),
        hard_scenes::ball_in_a_room(),
        hard_scenes::with_tilted_floor(hard_scenes::ball()),
        hard_scenes::with_cut_floor(hard_scenes::ball()),
    ] {
        check_at(&scene, &dense(), LARGEST_ERROR);
    }
}

#[test]
fn a_ball_a_hundredth_of_a_cell_wide() {
    for part in [TinyBall::Ball, TinyBall::Mirror] {
        let scene = hard_scenes::tiny_ball(part);
        let density_per_sr = if matches!(part, TinyBall::Ball) { 1e3 } else { 1e5 };
        let settings = BakeSettings {
            density_per_sr,
            ..estimator_settings()
        };
        check_at(&scene, &settings, LARGEST_ERROR);
    }
}

/// Smooth mirrors and waves that hide parts of themselves from the light: their patches do not follow every kink of
/// the mesh, and smear where a sheet ends before another of the same surface. 2 % is the aim; this holds what is
/// reached, and that every watt is booked.
#[test]
fn surfaces_that_hide_parts_of_themselves_are_not_worse_than_known() {
    check_at(&hard_scenes::torus(parts::mirror()), &dense(), 0.14);
    check_at(&hard_scenes::grazing_pool(), &dense(), 0.09);
}

#[test]
fn splats_lose_no_watt_on_hard_scenes() {
    let both = hard_scenes::tiny_ball(TinyBall::Both);
    for scene in cases().into_iter().map(|case| case.scene).chain([both]) {
        let result = bake(scene.clone(), &settings(2e3, SIDE));
        assert_eq!(energy_fault(&result), None, "{}", scene.name);
        let deposited = result.ledgers[0].energy_w.deposited;
        assert!(deposited > 0.0, "{}: nothing arrived", scene.name);
    }
}

/// Few rays of today's tracer see the same light as the many that the references are made of.
#[test]
fn stored_references_are_of_these_scenes() {
    for Case { scene, .. } in cases() {
        let reference = stored(&scene);
        assert!(reference.noise <= LARGEST_NOISE, "{}", scene.name);
        let few = brute(&scene, &settings(1.0, SIDE), 60_000);
        let pairs = pair_maps(&few.maps, &reference.maps).expect("maps of one size");
        let agreement = Agreement::of(&pairs).expect("light");
        let noise = nephroid::study::brute_force::relative_noise(&few.maps).expect("light");
        let of_noise = agreement.relative_rmse / noise;
        assert!(
            (0.6..1.5).contains(&of_noise),
            "{}: {agreement:?}, noise {noise}",
            scene.name
        );
        assert!(
            (agreement.flux_ratio - 1.0).abs() < 0.02,
            "{}: {agreement:?}",
            scene.name
        );
    }
}

/// Makes the references that are missing, outdated or too noisy, in some fifteen minutes of CPU time:
/// `cargo bench --bench references -- write`.
#[allow(dead_code, reason = "called by tests/bench/references.rs")]
pub fn write_references() {
    for Case { scene, rays } in cases() {
        let fits = stored_references::stored_noise(&scene).is_some_and(|noise| noise <= LARGEST_NOISE);
        if !fits {
            stored_references::store(&scene, rays as u64);
        }
    }
}

/// Prints how far bakes of all scenes are from brute force, and writes pictures where `PICTURES` names a folder:
/// `DENSITY=1e5 cargo bench --bench references`.
#[allow(dead_code, reason = "called by tests/bench/references.rs")]
#[allow(clippy::print_stdout, reason = "it is a report")]
pub fn print_distances() {
    let variable = |name: &str| std::env::var(name).ok();
    let only = variable("SCENE").unwrap_or_default();
    for Case { scene, .. } in cases().into_iter().filter(|case| case.scene.name.contains(&only)) {
        let mut settings = match variable("ESTIMATOR").as_deref() {
            Some("splat") => BakeSettings {
                map_resolution: estimator_settings().map_resolution,
                ..BakeSettings::splat()
            },
            _ => estimator_settings(),
        };
        let number = |name: &str| variable(name).and_then(|text| text.parse().ok());
        settings.density_per_sr = number("DENSITY").unwrap_or(settings.density_per_sr);
        settings.max_error = number("MAX_ERROR").or(settings.max_error);
        if stored_references::stored_noise(&scene).is_none() {
            println!("{:32} has no reference", scene.name);
            continue;
        }
        let reference = stored(&scene);
        let result = bake(scene.clone(), &settings);
        if let Some(fault) = energy_fault(&result) {
            println!("{:32} {fault}", scene.name);
        }
        let distance = Distance::of(&result.maps, &reference);
        println!(
            "{:32} rmse {:6.2} % (noise {:4.2} %) ard {:5.2} % peak {:.3} flux {:.5} | {} rays, {} queries, \
             {:.2} s CPU",
            scene.name,
            100.0 * distance.relative_rmse,
            100.0 * distance.noise,
            100.0 * distance.agreement.average_relative_difference,
            distance.agreement.peak_ratio,
            distance.agreement.flux_ratio,
            result.counts.rays,
            result.counts.receiver_queries,
            result.cpu_s.plan + result.cpu_s.trace + result.cpu_s.deposit,
        );
        let energy = result.ledgers[0].energy_w;
        println!(
            "    truncated {:.3e} of {:.3e} W: {:?}",
            energy.truncated.total(),
            energy.emitted,
            energy.truncated
        );
        print_maps(&scene, &result, &reference);
        if let Some(folder) = variable("PICTURES") {
            write_pictures(std::path::Path::new(&folder), &scene, &result, &reference);
        }
    }
}

#[allow(clippy::print_stdout, reason = "it is a report")]
fn print_maps(scene: &Scene, result: &BakeResult, reference: &StoredReference) {
    for map in &reference.maps {
        let own: Vec<_> = result
            .maps
            .iter()
            .filter(|other| other.chart.receiver == map.chart.receiver)
            .cloned()
            .collect();
        let pairs = pair_maps(&own, std::slice::from_ref(map)).expect("maps of one size");
        let agreement = Agreement::of(&pairs).expect("light");
        let off = |texel: &usize| (pairs[*texel].image - pairs[*texel].reference).abs();
        let worst = (0..pairs.len())
            .max_by(|a, b| off(a).total_cmp(&off(b)))
            .unwrap_or(0);
        println!(
            "    {:12} rmse with noise {:6.2} % of its own mean; worst texel {worst}: {:.4} instead of {:.4}",
            scene.objects[map.chart.object()].name,
            100.0 * agreement.relative_rmse,
            pairs[worst].image,
            pairs[worst].reference,
        );
    }
}

/// For each map of the reference, side by side: the bake, the reference (logarithmic, black at a hundredth of the mean,
/// white at a hundred times it), and their difference (red brighter, blue darker, full at a fifth of the mean).
fn write_pictures(folder: &std::path::Path, scene: &Scene, result: &BakeResult, reference: &StoredReference) {
    const SCALE: usize = 6;
    for map in &reference.maps {
        let truth = caustic_luminance(map);
        let mean = truth.iter().sum::<f64>() / truth.len() as f64;
        let baked = result
            .maps
            .iter()
            .find(|other| other.chart.receiver == map.chart.receiver)
            .map_or_else(|| vec![0.0; truth.len()], caustic_luminance);
        let grey = |e: f64| {
            let level = (255.0 * (((e / mean).max(1e-9).log10() + 2.0) / 4.0).clamp(0.0, 1.0)) as u8;
            [level, level, level, 255]
        };
        let difference = |image: f64, truth: f64| {
            let share = (5.0 * (image - truth) / mean).clamp(-1.0, 1.0);
            let fade = (255.0 * (1.0 - share.abs())) as u8;
            if share > 0.0 {
                [255, fade, fade, 255]
            } else {
                [fade, fade, 255, 255]
            }
        };
        let mut rgba = Vec::new();
        for row in 0..SIDE * SCALE {
            for column in 0..3 * SIDE * SCALE {
                let texel = row / SCALE * SIDE + column / SCALE % SIDE;
                rgba.extend(match column / (SIDE * SCALE) {
                    0 => grey(baked[texel]),
                    1 => grey(truth[texel]),
                    _ => difference(baked[texel], truth[texel]),
                });
            }
        }
        let size = ((3 * SIDE * SCALE) as u32, (SIDE * SCALE) as u32);
        let png = nephroid::export::png::encode(size.0, size.1, rgba, "picture").expect("a picture");
        let name = format!("{}_{}.png", scene.name, scene.objects[map.chart.object()].name);
        std::fs::write(folder.join(name), png).expect("a writable folder");
    }
}
