//! The real program in a real window: light arrives, one edit bakes again, and it closes.

use image::RgbImage;

use super::*;
use support::desktop::{SIZE, Screen, Viewer, difference, pixel_of};
use support::or_skip;

/// Luminance of display values [0, 1], of a square of 5 pixels around a point of the floor.
fn brightness(shot: &RgbImage, floor: DVec3) -> f64 {
    let (x, y) = pixel_of("ring", floor);
    let square = (0..25).map(|index| {
        let pixel = shot.get_pixel((x + index % 5 - 2) as u32, (y + index / 5 - 2) as u32);
        let [r, g, b] = pixel.0.map(|channel| f64::from(channel) / 255.0);
        0.2126 * r + 0.7152 * g + 0.0722 * b
    });
    square.sum::<f64>() / 25.0
}

#[test]
fn light_arrives_and_sigma_bakes_again() {
    let screen = or_skip!(Screen::start());
    // With the estimator whose sigma changes the picture most; coarse enough to be baked in a second.
    let coarse = "--estimator splat --density 10000 --map-resolution 128 --layers caustic";
    let mut viewer = Viewer::open(&screen, &format!("builtin:ring {coarse}"));
    let (done, _) = viewer.wait_for_bake();
    assert!(
        done["rays"].as_u64() > Some(1000) && done["splats"].as_u64() > Some(1000),
        "{done}"
    );
    let baked = viewer.screenshot();
    assert_eq!(baked.dimensions(), SIZE);
    // A mirror of radius 1 m images the lamp's axis, 1.7 m before it, at 1/(2 − 1/1.7) = 0.708 m.
    let cusp = brightness(&baked, dvec3(1.0 - 0.708, 0.0, 0.0));
    let beside = brightness(&baked, dvec3(-0.4, 0.0, 0.0));
    assert!(cusp > 0.5 && cusp > 5.0 * beside, "cusp {cusp}, beside {beside}");

    let slider = viewer.on_slider("Sigma [radii²]", [0.5, 0.62, 0.75]);
    viewer.pull(&slider);
    viewer.wait_for("settings", |_| true);
    viewer.let_go();
    let sigma = |event: &Value| event["settings"]["sigma"]["constant"].as_f64().unwrap_or(0.0);
    let done = viewer.wait_for("done", |event| sigma(event) > 3.0);
    assert!((3.0..40.0).contains(&sigma(&done)), "{done}");
    viewer.screenshot_that("is blurred", |shot| difference(&baked, shot) > 0.005);
    viewer.close();
}
