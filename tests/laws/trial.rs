//! Tries a law on random scenes; a scene that breaks it is made as simple as it can be.

use std::cell::Cell;
use std::time::{Duration, Instant};

use nephroid::scene::Scene;
use nephroid::settings::BakeSettings;
use proptest::test_runner::{Config, RngSeed, TestCaseError, TestRunner};

use crate::maps::Baked;
use crate::recipe::{Recipe, recipe};
use crate::tools;

/// Scenes for each law, unless `NEPHROID_RANDOM_SCENES` says another number.
const SCENES: u32 = 200;

/// Steps that a scene which breaks a law may be simplified by.
const SIMPLER: u32 = 200;

/// How many scenes each law is tried on.
pub fn scenes() -> u32 {
    let asked = std::env::var("NEPHROID_RANDOM_SCENES").ok();
    asked.map_or(SCENES, |count| {
        count
            .parse()
            .expect("NEPHROID_RANDOM_SCENES is a number of scenes")
    })
}

/// Tries a law on every scene. It gives whether it had anything to say about a scene, or what is wrong; at least half
/// of the scenes have to tell something.
///
/// # Panics
/// Where the law is broken, with the simplest scene that breaks it.
#[track_caller]
pub fn hold(law: impl Fn(&Recipe) -> Result<bool, String>) {
    let (told, slowest) = (Cell::new(0), Cell::new(Duration::ZERO));
    let mut runner = TestRunner::new(Config {
        cases: scenes(),
        rng_seed: RngSeed::Fixed(0x6e65_7068),
        failure_persistence: None,
        max_shrink_iters: SIMPLER,
        ..Config::default()
    });
    let outcome = runner.run(&recipe(), |recipe| {
        let start = Instant::now();
        let tells = law(&recipe);
        slowest.set(slowest.get().max(start.elapsed()));
        if std::env::var_os("NEPHROID_TELL").is_some() {
            eprintln!("{:?} {tells:?} {recipe:?}", start.elapsed());
        }
        let tells = tells.map_err(TestCaseError::fail)?;
        told.set(told.get() + u32::from(tells));
        Ok(())
    });
    outcome.unwrap_or_else(|broken| panic!("{broken}"));
    println!(
        "{} of {} scenes had something to tell; the slowest took {:.1?}",
        told.get(),
        scenes(),
        slowest.get()
    );
    assert!(
        2 * told.get() >= scenes(),
        "only {} of {} scenes",
        told.get(),
        scenes()
    );
}

/// Bakes a scene.
pub fn baked(scene: Scene, settings: &BakeSettings) -> Baked {
    let result = tools::bake(scene.clone(), settings);
    Baked { scene, result }
}
