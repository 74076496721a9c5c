//! How well pictures are made by how long those before took, the graph of device times, and the plot of error against
//! time.

use nephroid::bake::CostPoint;
use nephroid::bake::forecast::forecast;
use nephroid::eye_pass::renderer::TimedFrame;
use nephroid::viewer::pace::{Pace, PictureQuality};
use nephroid::viewer::panel::accuracy::course::{Curve, Frame};
use nephroid::viewer::timing::FrameTimes;

use super::*;

fn ms(opaque: f64, specular: f64) -> GpuMs {
    let tone_mapping = 0.5;
    GpuMs {
        opaque,
        specular,
        tone_mapping,
    }
}

/// Width of the window [pixels].
const WIDTH: u32 = 1000;

/// A device on which surfaces, and chains for one traced pixel per pixel, take so long in all of the window, used until
/// nothing changes.
fn settled_at(mut pace: Pace, opaque: f64, specular: f64) -> Pace {
    for _ in 0..8 {
        let PictureQuality { scale, eye } = pace.walking();
        let pixels = scale * scale;
        let frame = TimedFrame {
            ms: ms(
                opaque * pixels,
                specular * pixels * eye.traced_scale * eye.traced_scale,
            ),
            quality: eye,
            width: (f64::from(WIDTH) * scale) as u32,
        };
        pace.learn(&frame, WIDTH);
    }
    pace
}

fn settled(pace: Pace, specular: f64) -> Pace {
    settled_at(pace, 1.0, specular)
}

fn traced_scale(quality: PictureQuality) -> f64 {
    assert_eq!(quality.scale, 1.0, "the picture is sharp");
    quality.eye.traced_scale
}

#[test]
fn traced_scale_follows_the_frame_time() {
    assert_eq!(traced_scale(Pace::default().walking()), 1.0);
    let slow = settled(Pace::default(), 400.0);
    for (specular, walking, resting) in [
        (2.0, 2.0, 1.0),
        (20.0, 1.0, 1.0),
        (100.0, 0.5, 1.0),
        (300.0, 0.25, 0.5),
    ] {
        let pace = settled(Pace::default(), specular);
        let found = (traced_scale(pace.walking()), traced_scale(pace.resting()));
        assert_eq!(found, (walking, resting), "{specular} ms");
        // It settles.
        assert_eq!(settled(pace.clone(), specular).walking(), pace.walking());
    }
    assert_eq!(traced_scale(slow.walking()), 0.25);
    // A calm view is fine again.
    assert_eq!(traced_scale(settled(slow, 3.0).walking()), 2.0);
}

/// Where surfaces alone are late, pictures have fewer pixels than the window: a quarter along a side while the camera
/// moves, half while a bake shares the cores, all at rest.
#[test]
fn pictures_of_slow_devices_are_coarser() {
    for specular in [0.0, 3000.0] {
        let pace = settled_at(Pace::of_software(), 500.0, specular);
        let scales = [pace.walking(), pace.waiting(), pace.resting()].map(|quality| quality.scale);
        assert_eq!(scales, [0.25, 0.5, 1.0], "{specular} ms");
    }
    // Software that keeps pace is as sharp as any device, and a device that does not is as coarse.
    assert_eq!(
        settled_at(Pace::of_software(), 1.0, 2.0).walking(),
        settled(Pace::default(), 2.0).walking()
    );
    assert_eq!(settled_at(Pace::default(), 500.0, 100.0).walking().scale, 0.25);
    // Frames that are read back tell nothing.
    let mut pace = Pace::default();
    let read_back = TimedFrame {
        ms: GpuMs {
            opaque: 1e4,
            ..GpuMs::default()
        },
        quality: pace.walking().eye,
        width: WIDTH / 8,
    };
    pace.learn(&read_back, WIDTH);
    assert_eq!(pace.walking(), Pace::default().walking());
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

fn of<const N: usize>(pictures: [[f64; 3]; N]) -> FrameTimes {
    let mut times = FrameTimes::default();
    for [opaque, specular, tone_mapping] in pictures {
        times.push(GpuMs {
            opaque,
            specular,
            tone_mapping,
        });
    }
    times
}

fn with_times(times: Option<FrameTimes>) -> Headless {
    let mut panel = Headless::new(BakeSettings::default());
    panel.tell(|model| model.picture.frame_times = times);
    panel.open_part("Frame time");
    panel
}

#[test]
fn newest_time_is_told_in_numbers() {
    let mut panel = with_times(Some(of([[9.0, 9.0, 9.0], [1.25, 3.5, 0.25]])));
    let passes = ["opaque 1.25", "specular 3.50", "tone mapping 0.25"];
    panel.assert_says(&passes);
    panel.assert_says(&["Frame time (5.00 ms)"]);
    let graph = "Device times of 2 pictures, at most 27.00 ms";
    panel.hover(Role::Image, graph);
    panel.assert_says(&["the newest at the right"]);
    let rect = panel.named(Role::Image, graph).rect();
    assert!(Headless::is_inside(rect) && rect.width() > 250.0 && rect.height() > 40.0);
    // The section stays open though its title is another.
    panel.tell(|model| model.picture.frame_times = Some(of([[0.5, 0.0, 0.25]])));
    panel.assert_says(&["Frame time (0.75 ms)", "specular 0.00"]);
}

#[test]
fn untimed_devices_are_not_shown_as_fast() {
    with_times(None).assert_says(&["does not tell how long it takes"]);
    let panel = with_times(Some(FrameTimes::default()));
    panel.assert_says(&["Known with the first picture."]);
    assert!(!panel.says("0.00 ms"));
}

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
    let expected = forecast(&last.result.course, 0.01, Estimator::Auto);
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
    let mut panel = panel(with(towards(MIN_MAX_ERROR), |it| it.max_time_s = Some(1.0)));
    let rect = plot(&panel);
    panel.click_at(rect.right_center() - vec2(0.1 * rect.width(), 0.0));
    let limit_s = panel.settings().max_time_s.expect("still a time");
    assert!(limit_s > 1.0, "{limit_s}");
}
