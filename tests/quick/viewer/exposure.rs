//! The exposure that is chosen: at once where there was none, then steady, and nobody else's is touched.

use std::time::Duration;

use nephroid::viewer::exposure::AutoExposure;

const FRAME: Duration = Duration::from_millis(50);

/// Shows so many frames from an exposure on.
fn frames(exposure: &mut AutoExposure, count: usize, from: f64) -> Vec<f64> {
    let mut shown = from;
    let frames = (0..count).map(|_| {
        shown = exposure.next(shown, FRAME);
        shown
    });
    frames.collect()
}

#[test]
fn better_maps_move_it_smoothly_and_by_half_a_stop_at_most() {
    let mut exposure = AutoExposure::new(true);
    assert!(exposure.wants(false, 0.0));
    assert_eq!(exposure.take(3.0, 0.0), 3.0);
    assert!(!exposure.wants(false, 3.0) && exposure.wants(true, 3.0));
    // Next to nothing is nothing.
    exposure.take(3.05, 3.0);
    assert!(!exposure.is_moving(3.0));
    for (suits, goal) in [(3.3, 3.3), (4.5, 3.5), (1.5, 2.5), (-1.0, -1.0)] {
        let from = exposure.goal();
        exposure.take(suits, from);
        let shown = frames(&mut exposure, 60, from);
        assert_eq!(shown.last(), Some(&goal), "{suits}");
        assert!(!exposure.is_moving(goal));
        let mut last = from;
        for stops in shown {
            assert!((goal - stops).abs() <= (goal - last).abs(), "{suits}");
            assert!((stops - last).abs() <= 0.25 * (goal - from).abs(), "{suits}");
            last = stops;
        }
    }
}

#[test]
fn somebody_elses_is_left_alone_until_it_is_asked() {
    let mut exposure = AutoExposure::new(false);
    assert!(!exposure.wants(true, 1.0));
    assert_eq!(exposure.next(1.0, FRAME), 1.0);
    exposure.ask();
    assert!(exposure.wants(false, 1.0));
    exposure.take(2.0, 1.0);
    exposure.take(2.4, 2.0);
    assert!(exposure.is_moving(2.0));
    // By hand, in the middle of its way.
    assert!(!exposure.is_moving(7.0) && !exposure.wants(true, 7.0));
    assert_eq!(exposure.next(7.0, FRAME), 7.0);
}
