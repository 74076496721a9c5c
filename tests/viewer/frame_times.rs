//! The graph of what pictures took on the graphics device.

use egui::accesskit::Role;
use egui::{Rect, pos2};
use nephroid::eye_pass::renderer::GpuMs;
use nephroid::settings::BakeSettings;
use nephroid::viewer::frame_times::{FrameTimes, PICTURES};
use nephroid::viewer::panel::WIDTH;
use nephroid::viewer::panel::frame_graph::{columns, scale_ms};

use super::headless::Headless;

fn ms(opaque: f64, specular: f64, tone_mapping: f64) -> GpuMs {
    GpuMs {
        opaque,
        specular,
        tone_mapping,
    }
}

fn of(pictures: impl IntoIterator<Item = GpuMs>) -> FrameTimes {
    let mut times = FrameTimes::default();
    pictures.into_iter().for_each(|ms| times.push(ms));
    times
}

/// The section open.
fn panel(times: Option<FrameTimes>) -> Headless {
    let mut panel = Headless::new(BakeSettings::default(), (1280.0, 1400.0));
    panel.frame_times = times;
    panel.settle();
    let begins = |text: Option<&str>| text.is_some_and(|text| text.starts_with("Frame time"));
    let header = panel.nodes().find(|node| {
        node.role() == Role::DisclosureTriangle && (begins(node.label()) || begins(node.value()))
    });
    let centre = Headless::rect_of(header.expect("there is a section")).center();
    panel.click(centre);
    panel
}

#[test]
fn the_oldest_pictures_are_forgotten() {
    let times = of((0..PICTURES + 30).map(|index| ms(index as f64, 0.0, 0.0)));
    assert_eq!(times.iter().len(), PICTURES);
    assert_eq!(times.iter().next(), Some(&ms(30.0, 0.0, 0.0)));
    assert_eq!(times.newest(), Some(&ms(149.0, 0.0, 0.0)));
    assert_eq!(of([ms(1.0, 2.0, 3.0), ms(4.0, 0.0, 0.5)]).longest_ms(), 6.0);
    assert_eq!(FrameTimes::default().longest_ms(), 0.0);
}

#[test]
fn the_scale_holds_the_longest_picture_and_not_much_more() {
    for (longest, scale) in [
        (0.0, 0.1),
        (0.1, 0.1),
        (0.11, 0.2),
        (3.0, 5.0),
        (16.7, 20.0),
        (51.0, 100.0),
    ] {
        assert!(
            (scale_ms(longest) / scale - 1.0).abs() < 1e-12,
            "{longest}: {}",
            scale_ms(longest)
        );
    }
    assert_eq!(scale_ms(1e9), 1e5);
}

#[test]
fn passes_are_stacked_and_the_newest_picture_is_at_the_right() {
    let rect = Rect::from_min_max(pos2(10.0, 100.0), pos2(10.0 + PICTURES as f32, 180.0));
    let columns = columns(&of([ms(2.0, 4.0, 1.0), ms(1.0, 0.0, 30.0)]), 8.0, rect);
    let [older, newest] = &columns[..] else {
        panic!("{columns:?}")
    };
    // Eight milliseconds are eighty points.
    let bar =
        |left: f32, top: f32, bottom: f32| Rect::from_min_max(pos2(left, top), pos2(left + 1.0, bottom));
    assert_eq!(
        *older,
        [
            bar(128.0, 160.0, 180.0),
            bar(128.0, 120.0, 160.0),
            bar(128.0, 110.0, 120.0)
        ]
    );
    let cut = [
        bar(129.0, 170.0, 180.0),
        bar(129.0, 170.0, 170.0),
        bar(129.0, 100.0, 170.0),
    ];
    assert_eq!(*newest, cut, "what is beyond the scale ends at the top");
    assert_eq!(newest[0].right(), rect.right());
}

#[test]
fn the_newest_time_is_told_in_numbers() {
    let mut panel = panel(Some(of([ms(9.0, 9.0, 9.0), ms(1.25, 3.5, 0.25)])));
    for text in [
        "Frame time (5.00 ms)",
        "opaque 1.25",
        "specular 3.50",
        "tone mapping 0.25",
    ] {
        assert!(panel.says(text), "{text} in {:#?}", panel.texts());
    }
    let graph = panel.named(Role::Image, "Device times of 2 pictures, at most 27.00 ms");
    let rect = Headless::rect_of(graph);
    assert!(
        rect.right() <= WIDTH && rect.width() > 250.0 && rect.height() > 40.0,
        "{rect}"
    );
    // The next picture: the section stays open though its title is another.
    if let Some(times) = &mut panel.frame_times {
        times.push(ms(0.5, 0.0, 0.25));
    }
    panel.settle();
    assert!(
        panel.says("Frame time (0.75 ms)") && panel.says("specular 0.00"),
        "{:#?}",
        panel.texts()
    );
    panel.hover(rect.center());
    assert!(panel.says("the newest at the right"), "{:#?}", panel.texts());
}

#[test]
fn a_device_that_cannot_tell_is_not_shown_as_fast() {
    assert!(panel(None).says("does not tell how long it takes"));
    let panel = panel(Some(FrameTimes::default()));
    assert!(panel.says("Known with the first picture.") && !panel.says("0.00 ms"));
}
