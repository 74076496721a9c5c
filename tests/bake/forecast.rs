//! What a target was expected to take, by counts: clocks tell nothing on a busy machine.

use nephroid::session::forecast::{forecast, stood_at};
use nephroid::settings::{BakeSettings, Estimator};

use crate::tools::{at, bake, builtin_scene};

/// Every scene with an analytic reference.
const SCENES: [&str; 7] = ["ring", "ball", "pool", "mirror", "slab", "paraboloid", "nephroid"];

/// Side of all maps [texels].
const SIDE: usize = 256;

#[test]
fn rays_to_one_per_cent_are_known_by_five_within_a_factor_of_two() {
    let target = 0.01;
    for name in SCENES {
        let settings = BakeSettings {
            max_error: Some(target),
            ..at(BakeSettings::starting_density_per_sr(target), SIDE)
        };
        let course = bake(builtin_scene(name), &settings).course;
        let made = stood_at(&course, 0.05).expect("more than one level");
        let expected = forecast(&course[..=made], target, Estimator::Wavefront).expect("known");
        let actual = course.last().expect("it has one").rays;
        let ratio = expected.rays as f64 / actual as f64;
        println!(
            "{name:<11} at {:5.2} %, {:>6} rays: {:>6} expected, {actual:>6} taken, ratio {ratio:.2}",
            100.0 * course[made].relative_rmse,
            course[made].rays,
            expected.rays
        );
        assert!(expected.factor > 1.0, "{name}: it is a guess");
        assert!((0.5..2.0).contains(&ratio), "{name}: {ratio}");
    }
}
