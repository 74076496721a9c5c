//! The plot of error against time, and the target on it.

use std::sync::Arc;

use egui::accesskit::Role;
use egui::{Rect, pos2};
use nephroid::session::CostPoint;
use nephroid::session::forecast::forecast;
use nephroid::settings::{BakeSettings, Estimator};
use nephroid::viewer::panel::WIDTH;
use nephroid::viewer::panel::accuracy::course::{Curve, Frame};
use nephroid::viewer::worker::BakedLevel;

use super::headless::{Headless, finished};

fn towards(target: f64) -> BakeSettings {
    BakeSettings {
        max_error: Some(target),
        ..BakeSettings::default()
    }
}

/// Three levels: half the error for three times the time.
fn levels(settings: &BakeSettings) -> BakedLevel {
    let panel = Headless::new(settings.clone(), (100.0, 100.0));
    let mut last = finished(&Arc::clone(&panel.scene), settings);
    let point = |level: i32| CostPoint {
        rays: 1000 << level,
        cpu_s: 0.2 * 3_f64.powi(level),
        wall_s: 0.1 * 3_f64.powi(level),
        bytes: 0,
        relative_rmse: 0.2 * 0.5_f64.powi(level),
        is_coarse: false,
    };
    last.is_final = false;
    last.result.course = (0..3).map(point).collect();
    last
}

/// The part open.
fn panel(settings: BakeSettings) -> Headless {
    let mut panel = Headless::new(settings.clone(), (1280.0, 1400.0));
    panel.last = Some(levels(&settings));
    panel.settle();
    let begins = |text: Option<&str>| text.is_some_and(|text| text.starts_with("Error against time"));
    let header = panel.nodes().find(|node| {
        node.role() == Role::DisclosureTriangle && (begins(node.label()) || begins(node.value()))
    });
    let centre = Headless::rect_of(header.expect("there is a part")).center();
    panel.click(centre);
    panel
}

fn plot(panel: &Headless) -> Rect {
    let begins = |text: Option<&str>| text.is_some_and(|text| text.starts_with("Error against time: "));
    let image = panel
        .nodes()
        .find(|node| node.role() == Role::Image && (begins(node.label()) || begins(node.value())));
    Headless::rect_of(image.expect("there is a plot"))
}

#[test]
fn the_target_stands_where_the_forecast_has_it() {
    let settings = towards(0.01);
    let last = levels(&settings);
    let curve = Curve::new(&settings, &last).expect("errors are known");
    let expected = forecast(&last.result.course, 0.01, Estimator::Wavefront).expect("known");
    assert_eq!(curve.target, Some(expected));
    assert_eq!(curve.past.len(), 3);
    assert_eq!(curve.presets.len(), 3, "draft, preview and final are marked");
    // Draft was met on the way.
    assert_eq!(curve.presets[0].1.factor, 1.0);
    assert!(curve.presets[2].1.factor > 1.0);
    let falls = curve
        .future
        .windows(2)
        .all(|pair| pair[1].wall_s >= pair[0].wall_s);
    assert!(falls, "better takes longer: {:?}", curve.future);
}

#[test]
fn places_and_values_are_each_others_inverse() {
    let settings = towards(0.01);
    let curve = Curve::new(&settings, &levels(&settings)).expect("errors are known");
    let rect = Rect::from_min_max(pos2(10.0, 20.0), pos2(330.0, 140.0));
    let frame = Frame::around(&curve, rect);
    for point in &curve.past {
        let place = frame.place(point.wall_s, point.relative_rmse);
        assert!(rect.contains(place), "{place}");
        let (seconds, error) = frame.at(place);
        assert!((seconds / point.wall_s - 1.0).abs() < 1e-4, "{seconds}");
        assert!((error / point.relative_rmse - 1.0).abs() < 1e-4, "{error}");
    }
    let worse = frame.place(1.0, 0.1).y;
    assert!(worse < frame.place(1.0, 0.01).y, "errors go up");
    assert!(
        frame.place(1.0, 0.1).x < frame.place(2.0, 0.1).x,
        "time goes right"
    );
}

#[test]
fn what_was_reached_and_what_is_expected_is_told() {
    let panel = panel(towards(0.01));
    assert!(
        panel.says("5.0 % after 0.90 s; to 1 %: about"),
        "{:#?}",
        panel.texts()
    );
    let rect = plot(&panel);
    assert!(
        rect.right() <= WIDTH && rect.width() > 250.0 && rect.height() > 80.0,
        "{rect}"
    );
}

#[test]
fn a_drag_along_the_curve_sets_the_target() {
    let mut panel = panel(towards(0.05));
    let rect = plot(&panel);
    let (high, low) = (
        rect.center(),
        pos2(rect.center().x, rect.bottom() - 0.2 * rect.height()),
    );
    panel.drag(high, low);
    let target = panel.panel.settings.max_error.expect("still an error");
    assert!((0.0015..0.02).contains(&target), "{target}");
    let percent = target * 100.0;
    let told = format!("to {} %", (percent * 1e4).round() / 1e4);
    assert!(panel.says(&told), "{told} in {:#?}", panel.texts());
}

#[test]
fn a_time_stays_a_time() {
    let mut panel = panel(BakeSettings {
        max_error: Some(nephroid::settings::LEAST_MAX_ERROR),
        max_time_s: Some(1.0),
        ..BakeSettings::default()
    });
    let rect = plot(&panel);
    panel.click(pos2(rect.right() - 0.1 * rect.width(), rect.center().y));
    let limit_s = panel.panel.settings.max_time_s.expect("still a time");
    assert!(limit_s > 1.0, "{limit_s}");
}

#[test]
fn without_errors_there_is_no_plot() {
    let settings = towards(0.01);
    let mut last = levels(&settings);
    last.result.course.clear();
    assert_eq!(Curve::new(&settings, &last), None);
}
