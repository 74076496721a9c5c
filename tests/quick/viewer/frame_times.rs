//! The graph of what pictures took on the graphics device.

use nephroid::viewer::panel::frame_graph::columns;
use nephroid::viewer::timing::{FrameTimes, PICTURES};

use super::*;

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

fn panel(times: Option<FrameTimes>) -> Headless {
    let mut panel = Headless::new(BakeSettings::default());
    panel.tell(|model| model.picture.frame_times = times);
    panel.open_part("Frame time");
    panel
}

#[test]
fn oldest_pictures_are_forgotten() {
    let mut ramp = [[0.0; 3]; PICTURES + 30];
    for (index, picture) in ramp.iter_mut().enumerate() {
        picture[0] = index as f64;
    }
    let times = of(ramp);
    assert_eq!(times.iter().len(), PICTURES);
    let ends = [times.iter().next(), times.newest()].map(|ms| ms.map(|ms| ms.opaque));
    assert_eq!(ends, [Some(30.0), Some(149.0)]);
    assert_eq!(of([[1.0, 2.0, 3.0], [4.0, 0.0, 0.5]]).longest_ms(), 6.0);
    assert_eq!(FrameTimes::default().longest_ms(), 0.0);
}

#[test]
fn passes_are_stacked_newest_at_the_right() {
    let rect = Rect::from_min_max(pos2(10.0, 100.0), pos2(10.0 + PICTURES as f32, 180.0));
    let columns = columns(&of([[2.0, 4.0, 1.0], [1.0, 0.0, 30.0]]), 8.0, rect);
    // Eight milliseconds are eighty points; what is beyond the scale ends at the top.
    let expected = [
        (128.0, [(160.0, 180.0), (120.0, 160.0), (110.0, 120.0)]),
        (129.0, [(170.0, 180.0), (170.0, 170.0), (100.0, 170.0)]),
    ];
    let expected = expected.map(|(left, bars)| {
        bars.map(|(top, bottom)| Rect::from_min_max(pos2(left, top), pos2(left + 1.0, bottom)))
    });
    assert_eq!(columns, expected);
    assert_eq!(columns[1][0].right(), rect.right());
}

#[test]
fn newest_time_is_told_in_numbers() {
    let mut panel = panel(Some(of([[9.0, 9.0, 9.0], [1.25, 3.5, 0.25]])));
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
    panel(None).assert_says(&["does not tell how long it takes"]);
    let panel = panel(Some(FrameTimes::default()));
    panel.assert_says(&["Known with the first picture."]);
    assert!(!panel.says("0.00 ms"));
}
