//! Many lamps, few of which matter: rays go where the error is.

use glam::DVec3;
use nephroid::illumination::compare::relative_rmse;
use nephroid::optics::LinearSrgb;
use nephroid::scene::Scene;
use nephroid::scene::builtin::{parts, shapes};
use nephroid::settings::BakeSettings;
use nephroid::study::agreement::caustic_luminance;
use nephroid::units::Flux;

use crate::tools::{at, bake, bits, builtin_scene, map_of};

fn towards(target: f64) -> BakeSettings {
    BakeSettings {
        max_error: Some(target),
        density_per_sr: BakeSettings::starting_density_per_sr(target),
        ..at(1.0, 64)
    }
}

/// The ring with 49 lamps more, each at a place and of a power [W].
fn with_lamps(place: impl Fn(u32) -> DVec3, power_w: f64) -> Scene {
    let mut scene = builtin_scene("ring");
    for lamp in 0..49 {
        let light = parts::point_light(&format!("lamp {lamp}"), place(lamp), Flux(power_w));
        scene.lights.push(light);
    }
    scene
}

#[test]
fn forty_nine_lamps_that_see_no_caster_cost_nothing() {
    let alone = builtin_scene("ring");
    // In a closed box.
    let place = |lamp| {
        DVec3::new(
            f64::from(lamp % 7) * 0.1 - 0.3,
            -0.5,
            f64::from(lamp / 7) * 0.1 - 0.3,
        )
    };
    let mut scene = with_lamps(place, 100.0);
    let cellar = shapes::cuboid(DVec3::new(-0.4, -0.6, -0.4), DVec3::new(0.4, -0.4, 0.4));
    parts::add(
        &mut scene,
        "cellar",
        cellar,
        parts::matte("cellar", LinearSrgb::WHITE),
    );
    let (one, fifty) = (
        bake(alone.clone(), &towards(0.02)),
        bake(scene.clone(), &towards(0.02)),
    );
    assert_eq!(one.counts.rays, fifty.counts.rays);
    assert_eq!(
        bits(map_of(&one, &alone, "floor")),
        bits(map_of(&fifty, &scene, "floor"))
    );
}

#[test]
fn dim_lamps_do_not_take_the_rays_of_the_bright_one() {
    let place = |lamp: u32| {
        let angle = f64::from(lamp) * 2.4;
        DVec3::new(0.6 * angle.cos(), 1.0 + 0.01 * f64::from(lamp), 0.6 * angle.sin())
    };
    let target = 0.02;
    let scene = with_lamps(place, 0.02);
    let one = bake(builtin_scene("ring"), &towards(target));
    let fifty = bake(scene.clone(), &towards(target));
    let ratio = fifty.counts.rays as f64 / one.counts.rays as f64;
    println!(
        "fifty lamps: {} rays, {ratio:.2} times those of one",
        fifty.counts.rays
    );
    // Each as careful as the first would be fifty times as many.
    assert!(ratio < 15.0, "{ratio}");
    let finer = bake(scene.clone(), &towards(0.003));
    let of = |result| caustic_luminance(map_of(result, &scene, "floor"));
    let off = relative_rmse(&of(&fifty), &of(&finer)).expect("light");
    println!("off by {off:.4}, estimated {:?}", fifty.estimated_relative_rmse);
    assert!(off < 1.5 * target, "{off}");
}
