//! How well pictures are made, by how long those before took.

use std::time::{Duration, Instant};

use nephroid::eye_pass::renderer::{EyeQuality, GpuMs};
use nephroid::viewer::pace::Pace;

fn ms(opaque: f64, specular: f64) -> GpuMs {
    GpuMs {
        opaque,
        specular,
        tone_mapping: 0.5,
    }
}

/// A device on which chains take so long for one traced pixel per pixel, used until nothing changes.
fn settled(mut pace: Pace, opaque: f64, specular: f64) -> Pace {
    for _ in 0..8 {
        let quality = pace.walking();
        let pixels = quality.traced_scale * quality.traced_scale;
        pace.learn(ms(opaque, specular * pixels), quality);
    }
    pace
}

#[test]
fn late_frames_are_traced_more_coarsely_and_early_ones_more_finely() {
    assert_eq!(Pace::default().walking().traced_scale, 1.0);
    for (specular, walking, resting) in [
        (2.0, 2.0, 1.0),
        (20.0, 1.0, 1.0),
        (100.0, 0.5, 1.0),
        (300.0, 0.25, 0.5),
        (1e5, 0.25, 0.25),
    ] {
        let pace = settled(Pace::default(), 1.0, specular);
        let found = (pace.walking().traced_scale, pace.resting().traced_scale);
        assert_eq!(found, (walking, resting), "{specular} ms");
        assert_eq!(
            pace.walking(),
            settled(pace.clone(), 1.0, specular).walking(),
            "it settles"
        );
    }
}

#[test]
fn a_view_that_calms_down_becomes_fine_again() {
    let slow = settled(Pace::default(), 1.0, 400.0);
    assert_eq!(slow.walking().traced_scale, 0.25);
    assert_eq!(settled(slow, 1.0, 3.0).walking().traced_scale, 2.0);
}

#[test]
fn what_is_not_traced_and_pictures_at_rest_teach_nothing() {
    let mut pace = settled(Pace::default(), 1.0, 100.0);
    let before = (pace.walking(), pace.resting());
    pace.learn(ms(500.0, 0.0), pace.walking());
    pace.learn(ms(1.0, 900.0), EyeQuality::STILL);
    assert_eq!((pace.walking(), pace.resting()), before);
}

#[test]
fn a_view_at_rest_is_refined_for_a_while_and_a_little_in_any_case() {
    let (mut pace, start) = (Pace::default(), Instant::now());
    assert!(pace.refines(0, start) && pace.refines(63, start));
    assert!(!pace.refines(64, start));
    let later = start + Duration::from_secs(60);
    assert!(pace.refines(3, later));
    assert!(!pace.refines(4, later));
    pace.moves();
    assert!(pace.refines(4, later), "another view starts anew");
}

#[test]
fn hands_do_not_wait_for_a_picture() {
    let (mut pace, start) = (Pace::default(), Instant::now());
    assert_eq!(pace.pause(start), Duration::ZERO);
    pace.touch(start);
    let early = start + Duration::from_millis(100);
    assert!(pace.pause(early) > Duration::ZERO);
    assert_eq!(pace.pause(early + pace.pause(early)), Duration::ZERO);
}
