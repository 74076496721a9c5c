//! The plot of error against time, and the target on it.

use nephroid::session::CostPoint;
use nephroid::session::forecast::forecast;
use nephroid::viewer::panel::accuracy::course::{Curve, Frame};

use super::*;

fn towards(target: f64) -> BakeSettings {
    with(BakeSettings::default(), |it| it.max_error = Some(target))
}

/// The part open, after three levels: half the error for three times the time.
fn panel(settings: BakeSettings) -> Headless {
    let mut panel = Headless::new(settings);
    panel.tell_level(|last| {
        last.is_final = false;
        let point = |level: i32| CostPoint {
            rays: 1000 << level,
            cpu_s: 0.2 * 3_f64.powi(level),
            wall_s: 0.1 * 3_f64.powi(level),
            bytes: 0,
            error: 0.2 * 0.5_f64.powi(level),
            is_coarse: false,
            is_by_photons: false,
        };
        last.result.course = (0..3).map(point).collect();
    });
    panel.open_part("Error against time");
    panel
}

fn plot(panel: &Headless) -> Rect {
    let plot = panel.find(Role::Image, |name| name.starts_with("Error against time: "));
    plot.expect("there is a plot").rect()
}

#[test]
fn target_stands_where_the_forecast_has_it() {
    let panel = panel(towards(0.01));
    let last = panel.model.last.as_deref().expect("a level");
    let curve = Curve::new(panel.settings(), last).expect("errors are known");
    let expected = forecast(&last.result.course, 0.01, Estimator::Wavefront);
    assert!(expected.is_some() && curve.target == expected);
    assert_eq!(curve.past.len(), 3);
    assert_eq!(curve.presets.len(), 3, "draft, preview and final are marked");
    // Draft was met on the way.
    assert!(curve.presets[0].1.factor == 1.0 && curve.presets[2].1.factor > 1.0);
    let is_slower_when_better = curve.future.is_sorted_by(|a, b| a.wall_s <= b.wall_s);
    assert!(is_slower_when_better, "{:?}", curve.future);

    let rect = Rect::from_min_max(pos2(10.0, 20.0), pos2(330.0, 140.0));
    let frame = Frame::around(&curve, rect);
    for point in &curve.past {
        let place = frame.place(point.wall_s, point.error);
        assert!(rect.contains(place), "{place}");
        let (seconds, error) = frame.at(place);
        near(seconds / point.wall_s, 1.0, 1e-4, "time");
        near(error / point.error, 1.0, 1e-4, "error");
    }
    let at = frame.place(1.0, 0.1);
    assert!(at.y < frame.place(1.0, 0.01).y, "errors go up");
    assert!(at.x < frame.place(2.0, 0.1).x, "time goes right");

    panel.assert_says(&["5.0 % after 0.90 s; to 1 %: about"]);
    let rect = plot(&panel);
    assert!(Headless::is_inside(rect) && rect.width() > 250.0 && rect.height() > 80.0);
    let mut unknown = last.clone();
    unknown.result.course.clear();
    assert_eq!(Curve::new(panel.settings(), &unknown), None);
}

#[test]
fn drag_along_the_curve_sets_the_target() {
    let mut panel = panel(towards(0.05));
    let rect = plot(&panel);
    let lower = rect.center_bottom() - vec2(0.0, 0.2 * rect.height());
    panel.drag_at(rect.center(), lower);
    let target = panel.settings().max_error.expect("still an error");
    assert!((0.0015..0.02).contains(&target), "{target}");
    let percent = (target * 1e6).round() / 1e4;
    panel.assert_says(&[&format!("to {percent} %")]);
}

#[test]
fn a_time_stays_a_time() {
    let mut panel = panel(with(towards(LEAST_MAX_ERROR), |it| it.max_time_s = Some(1.0)));
    let rect = plot(&panel);
    panel.click_at(rect.right_center() - vec2(0.1 * rect.width(), 0.0));
    let limit_s = panel.settings().max_time_s.expect("still a time");
    assert!(limit_s > 1.0, "{limit_s}");
}
