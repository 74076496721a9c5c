//! How well pictures are made, by how long those before took.

use nephroid::eye_pass::renderer::EyeQuality;
use nephroid::viewer::pace::Pace;

use super::*;

fn ms(opaque: f64, specular: f64) -> GpuMs {
    let tone_mapping = 0.5;
    GpuMs {
        opaque,
        specular,
        tone_mapping,
    }
}

/// A device on which chains take so long for one traced pixel per pixel, used until nothing changes.
fn settled(mut pace: Pace, specular: f64) -> Pace {
    for _ in 0..8 {
        let quality = pace.walking();
        let pixels = quality.traced_scale * quality.traced_scale;
        pace.learn(ms(1.0, specular * pixels), quality);
    }
    pace
}

#[test]
fn traced_scale_follows_the_frame_time() {
    assert_eq!(Pace::default().walking().traced_scale, 1.0);
    let slow = settled(Pace::default(), 400.0);
    for (specular, walking, resting) in [
        (2.0, 2.0, 1.0),
        (20.0, 1.0, 1.0),
        (100.0, 0.5, 1.0),
        (300.0, 0.25, 0.5),
        (1e5, 0.25, 0.25),
    ] {
        let pace = settled(Pace::default(), specular);
        let found = (pace.walking().traced_scale, pace.resting().traced_scale);
        assert_eq!(found, (walking, resting), "{specular} ms");
        // It settles.
        assert_eq!(settled(pace.clone(), specular).walking(), pace.walking());
    }
    assert_eq!(slow.walking().traced_scale, 0.25);
    // A calm view is fine again.
    assert_eq!(settled(slow, 3.0).walking().traced_scale, 2.0);
}

#[test]
fn untraced_and_resting_pictures_teach_nothing() {
    let mut pace = settled(Pace::default(), 100.0);
    let before = (pace.walking(), pace.resting());
    pace.learn(ms(500.0, 0.0), pace.walking());
    pace.learn(ms(1.0, 900.0), EyeQuality::STILL);
    assert_eq!((pace.walking(), pace.resting()), before);
}

#[test]
fn resting_views_are_refined_for_a_while() {
    let (mut pace, start) = (Pace::default(), Instant::now());
    let later = start + Duration::from_secs(60);
    for (picture, now, is_refined) in [
        (0, start, true),
        (63, start, true),
        (64, start, false),
        // A little in any case.
        (3, later, true),
        (4, later, false),
    ] {
        assert_eq!(pace.refines(picture, now), is_refined, "{picture}");
    }
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
