//! The device's chains from within glass and water and between mirrors.

use std::io::Write as _;

use nephroid::eye_pass::Picture;
use nephroid::eye_pass::reference;
use nephroid::eye_pass::renderer::render_offscreen;
use nephroid::transport::Tracer;

use crate::chain_laws::{self, FLOOR, Law, WATER, direction};
use crate::device::gpu;

/// Rounding of half floats, and as much again for single precision.
const ROUNDING: f64 = 1.0 / 1024.0;

#[test]
fn the_devices_chains_keep_to_their_laws() {
    let Some(gpu) = gpu() else { return };
    for law in chain_laws::all() {
        let picture = render_offscreen(&gpu, &law.scene, &[], &law.view).expect("it renders");
        assert_eq!(gpu.take_error(), None, "{}", law.name);
        law.assert_kept(&picture, ROUNDING + law.left_out);
    }
}

/// Half the angle of Snell's window by its area: in a picture straight up it is a disc.
fn window_half_angle(law: &Law, picture: &Picture) -> f64 {
    let is_inside = |radiance: &&[f32; 3]| (f64::from(radiance[0]) / FLOOR - 1.0).abs() > 2.0 * ROUNDING;
    let inside = picture.radiance.iter().filter(is_inside).count() as f64;
    let half_height = (0.5 * law.view.camera.vertical_fov_rad).tan();
    let pixel = 2.0 * half_height / f64::from(law.view.height);
    ((inside / std::f64::consts::PI).sqrt() * pixel).atan()
}

#[test]
fn snells_window_is_as_wide_as_the_critical_angle_and_beyond_it_is_the_floor() {
    let Some(gpu) = gpu() else { return };
    let critical = (1.0 / WATER).asin();
    for law in [
        chain_laws::under_a_sheet_of_water(),
        chain_laws::within_a_body_of_water(),
    ] {
        let on_gpu = render_offscreen(&gpu, &law.scene, &[], &law.view).expect("it renders");
        let tracer = Tracer::new(law.scene.clone().into());
        let on_cpu = reference::render(
            &tracer,
            &[],
            &law.view,
            &Default::default(),
            &(),
            &Default::default(),
        );
        // Of a pixel at the window's border.
        let half_height = (0.5 * law.view.camera.vertical_fov_rad).tan();
        let pixel_rad = 2.0 * half_height / f64::from(law.view.height) * critical.cos().powi(2);
        for (picture, by) in [(on_gpu, "device"), (on_cpu.expect("nobody cancels"), "processor")] {
            let found = window_half_angle(&law, &picture);
            let _ = writeln!(
                std::io::stdout(),
                "{}: half the window is {:.3} degrees on the {by}, {:.3} by Snell's law, a pixel is {:.3}",
                law.name,
                found.to_degrees(),
                critical.to_degrees(),
                pixel_rad.to_degrees(),
            );
            assert!((found - critical).abs() < pixel_rad, "{found} on the {by}");
            let beyond = |pixel: &usize| direction(&law.view, *pixel).y.acos() > critical + pixel_rad;
            let beyond: Vec<usize> = (0..picture.radiance.len()).filter(beyond).collect();
            assert!(beyond.len() > 10_000);
            for pixel in beyond {
                let radiance = f64::from(picture.radiance[pixel][1]);
                assert!(
                    (radiance - FLOOR).abs() <= ROUNDING * FLOOR,
                    "{radiance} on the {by}"
                );
            }
        }
    }
}
