//! Waiting for a change to come to rest.

use nephroid::viewer::debounce::Debounce;

use super::*;

#[test]
fn many_changes_are_acted_upon_once_after_the_last() {
    let start = Instant::now();
    let mut debounce = Debounce::default();
    assert!(debounce.due().is_none() && !debounce.is_due(start));
    let step = QUIET / 3;
    let mut now = start;
    for _ in 0..100 {
        now += step;
        debounce.change(now);
        assert!(!debounce.is_due(now) && !debounce.is_due(now + step));
    }
    assert_eq!(debounce.due(), Some(now + QUIET));
    assert!(!debounce.is_due(now + QUIET - Duration::from_millis(1)));
    assert!(debounce.is_due(now + QUIET));
    assert!(!debounce.is_due(now + QUIET + QUIET), "once");
    debounce.change(now);
    debounce.clear();
    assert!(!debounce.is_due(now + QUIET));
}
