//! From events to frames: what is reported is never shorter than what a person waited.

use nephroid::viewer::timing::{Latencies, Percentiles};

use super::*;

const MS: Duration = Duration::from_millis(1);

#[test]
fn percentiles_are_of_the_waits_by_nearest_rank() {
    let waits = (1..=200).rev().map(|index| index * MS);
    let told = Percentiles::of(waits).expect("there are some");
    let found = [told.p50_ms, told.p95_ms, told.p99_ms, told.max_ms].map(f64::round);
    assert_eq!((found, told.count), ([100.0, 190.0, 198.0, 200.0], 200));
    let one = Percentiles::of([7 * MS]).expect("one is enough");
    assert_eq!([one.p50_ms, one.max_ms].map(f64::round), [7.0, 7.0]);
    assert_eq!(Percentiles::of([]), None);
}

/// What comes while a frame is made is met after it: it has waited since some moment of the frame, at worst its first.
#[test]
fn events_of_a_busy_window_count_from_when_they_can_have_come() {
    let start = Instant::now();
    let at = |ms: u32| start + ms * MS;
    let mut latencies = Latencies::default();
    latencies.begin_turn(at(0));
    latencies.end_turn(at(1));
    // It waited: the event has just come.
    latencies.begin_turn(at(50));
    latencies.meet(at(50), false);
    latencies.show(at(90));
    latencies.end_turn(at(90));
    assert_eq!(latencies.otherwise().map(|told| told.max_ms.round()), Some(40.0));
    assert_eq!(latencies.while_baking(), None);

    // There at once: it may have come right after the last turn began.
    latencies.begin_turn(at(90));
    latencies.meet(at(91), true);
    latencies.end_turn(at(92));
    latencies.begin_turn(at(95));
    latencies.show(at(100));
    assert_eq!(
        latencies.while_baking().map(|told| told.max_ms.round()),
        Some(50.0)
    );
    // Shown once, counted once.
    latencies.show(at(200));
    assert_eq!(latencies.while_baking().map(|told| told.count), Some(1));
}

#[test]
fn only_the_last_waits_are_remembered() {
    let mut latencies = Latencies::default();
    let now = Instant::now();
    for index in 0..10_100_u32 {
        latencies.begin_turn(now);
        latencies.meet(now, true);
        latencies.show(now + if index < 100 { 500 * MS } else { MS });
    }
    let told = latencies.while_baking().expect("many");
    assert_eq!((told.count, told.max_ms.round()), (10_000, 1.0));
}
