//! When the eye's specular chains are followed, and what is left without them.

use std::f64::consts::PI;

use glam::DVec3;
use nephroid::effect::{Effect, EffectSwitch};
use nephroid::eye_pass::reference::{ChainLimits, EyeRays, ReferenceSettings, first_hits, render_counted};
use nephroid::eye_pass::{Picture, ToneMap, View};
use nephroid::illumination::{IlluminationMap, Layer};
use nephroid::optics::LinearSrgb;
use nephroid::optics::fresnel::dielectric_reflectance;
use nephroid::plan;
use nephroid::progress::Control;
use nephroid::scene::{Camera, Material, SurfaceKind, builtin};
use nephroid::settings::LayerKind;
use nephroid::transport::Tracer;
use proptest::prelude::*;

use crate::meshes::{floor, quad, sphere};
use crate::scenes::{chart, diffuse, surface, tracer};

/// Irradiance on the floor [W/m²].
const E: f64 = 50.0;
/// Radiance of the background [W/(m² sr)].
const SKY: f64 = 3.0;

fn view(position: DVec3, target: DVec3, fov_rad: f64) -> View {
    View {
        camera: Camera::look_at("eye", position, target, fov_rad),
        width: 24,
        height: 16,
        exposure_stops: 0.0,
        tone_map: ToneMap::None,
        background: LinearSrgb::grey(SKY),
    }
}

fn lit(tracer: &Tracer, object: usize) -> IlluminationMap {
    IlluminationMap {
        chart: chart(tracer, object, 2, 2).into(),
        layers: vec![Layer {
            kind: LayerKind::Direct,
            irradiance: vec![[E as f32; 3]; 4],
        }],
        error: None,
        estimated_relative_rmse: None,
    }
}

fn seen(tracer: &Tracer, maps: &[IlluminationMap], view: &View, switch: EffectSwitch) -> (Picture, EyeRays) {
    let settings = ReferenceSettings {
        limits: ChainLimits {
            switch,
            ..ChainLimits::default()
        },
        ..ReferenceSettings::default()
    };
    render_counted(tracer, maps, view, &settings, &(), &Control::default()).expect("nobody cancels")
}

/// A lit floor with one more object above it.
fn under(other: Material) -> (Tracer, Vec<IlluminationMap>) {
    let ball = sphere(DVec3::new(0.0, 1.0, 0.0), 0.5, 24, 12);
    let tracer = tracer(vec![(floor(100.0, 0.0), diffuse(0.6)), (ball, other)], vec![]);
    let maps = vec![lit(&tracer, 0)];
    (tracer, maps)
}

#[test]
fn chains_cost_no_ray_where_nothing_specular_is_in_view() {
    let (tracer, maps) = under(surface(SurfaceKind::Dielectric, 1.5));
    let eye = DVec3::new(0.0, 1.5, 3.0);
    let (ahead, away) = (
        view(eye, DVec3::Y, 0.6),
        view(eye, DVec3::new(0.0, 1.0, 9.0), 0.6),
    );
    for switch in [EffectSwitch::Auto, EffectSwitch::On, EffectSwitch::Off] {
        let rays = seen(&tracer, &maps, &away, switch).1;
        assert_eq!((rays.camera_rays, rays.chain_rays), (24 * 16, 0), "{switch:?}");
    }
    let rays = seen(&tracer, &maps, &ahead, EffectSwitch::Auto).1;
    assert_eq!(rays.camera_rays, 24 * 16);
    let hits = first_hits(&tracer, &ahead);
    let on_glass = hits.iter().filter(|hit| **hit == Some(1)).count() as u64;
    assert!(rays.chain_rays >= 2 * on_glass && on_glass > 20, "{rays:?}");
    let (on, off) = (
        seen(&tracer, &maps, &ahead, EffectSwitch::On),
        seen(&tracer, &maps, &ahead, EffectSwitch::Off),
    );
    assert_eq!(on, seen(&tracer, &maps, &ahead, EffectSwitch::Auto));
    assert_eq!(off.1.chain_rays, 0);
}

#[test]
fn without_chains_clear_bodies_are_left_out() {
    for kind in [SurfaceKind::Dielectric, SurfaceKind::ThinWall] {
        let (glazed, maps) = under(surface(kind, 1.5));
        let bare = tracer(vec![(floor(100.0, 0.0), diffuse(0.6))], vec![]);
        let bare_maps = [lit(&bare, 0)];
        // From outside, and from within the ball.
        for eye in [DVec3::new(0.0, 1.5, 3.0), DVec3::new(0.1, 1.0, 0.0)] {
            let view = view(eye, DVec3::new(0.0, 0.9, -0.1), 0.9);
            let found = seen(&glazed, &maps, &view, EffectSwitch::Off).0;
            let expected = seen(&bare, &bare_maps, &view, EffectSwitch::Auto).0;
            assert_eq!(found, expected, "{kind:?} from {eye}");
            assert_ne!(found, seen(&glazed, &maps, &view, EffectSwitch::Auto).0);
        }
    }
}

#[test]
fn without_chains_mirrors_show_what_they_emit() {
    let emitted = LinearSrgb::new(0.5, 0.25, 0.125);
    let (tracer, maps) = under(Material {
        emitted_radiance: emitted,
        ..surface(SurfaceKind::Mirror, 1.5)
    });
    let view = view(DVec3::new(0.0, 1.0, 3.0), DVec3::Y, 0.1);
    let (picture, rays) = seen(&tracer, &maps, &view, EffectSwitch::Off);
    assert_eq!(rays.chain_rays, 0);
    for pixel in picture.radiance {
        assert_eq!(pixel.map(f64::from), emitted.to_array());
    }
}

#[test]
fn without_chains_polish_shows_its_diffuse_part() {
    let polish = surface(SurfaceKind::Mixed, 1.5);
    let wall = quad(DVec3::new(-1.0, -1.0, 0.0), DVec3::Y * 2.0, DVec3::X * 2.0);
    let tracer = tracer(vec![(wall, polish)], vec![]);
    let maps = [lit(&tracer, 0)];
    let view = view(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 0.01);
    let (picture, _) = seen(&tracer, &maps, &view, EffectSwitch::Off);
    let expected = (1.0 - dielectric_reflectance(1.0, 1.5)) * E / PI;
    for pixel in &picture.radiance {
        assert!((f64::from(pixel[0]) / expected - 1.0).abs() < 1e-4, "{pixel:?}");
    }
    let (with, _) = seen(&tracer, &maps, &view, EffectSwitch::Auto);
    let reflected = f64::from(with.radiance[0][0] - picture.radiance[0][0]);
    assert!((reflected / (dielectric_reflectance(1.0, 1.5) * SKY) - 1.0).abs() < 1e-3);
}

#[test]
fn the_plan_names_what_is_in_view() {
    let (tracer, _) = under(surface(SurfaceKind::Dielectric, 1.5));
    let scene = tracer.scene();
    let eye = DVec3::new(0.0, 1.5, 3.0);
    let (ahead, away) = (
        view(eye, DVec3::Y, 0.6).camera,
        view(eye, DVec3::new(0.0, 1.0, 9.0), 0.6).camera,
    );
    let line = |camera, switch| plan::chains(scene, camera, switch);
    let cases = [
        (
            Some((&ahead, 1.5)),
            EffectSwitch::Auto,
            true,
            "`object 1` is in view of `eye`",
        ),
        (
            Some((&ahead, 1.5)),
            EffectSwitch::Off,
            false,
            "switched off by the user",
        ),
        (
            Some((&away, 1.5)),
            EffectSwitch::Auto,
            false,
            "nothing specular is in view",
        ),
        (
            Some((&away, 1.5)),
            EffectSwitch::On,
            true,
            "switched on by the user",
        ),
        (None, EffectSwitch::Auto, true, "`object 1` is specular"),
    ];
    for (camera, switch, on, reason) in cases {
        let found = line(camera, switch);
        assert_eq!((found.on, found.reason.as_str()), (on, reason));
        assert_eq!((found.effect, found.switch), (Effect::Chains, switch));
    }
    let matte = crate::scenes::scene(vec![(floor(1.0, 0.0), diffuse(0.5))], vec![]);
    let found = plan::chains(&matte, None, EffectSwitch::Auto);
    assert_eq!(
        (found.on, found.reason.as_str()),
        (false, "nothing in the scene is specular")
    );
}

proptest! {
    #![proptest_config(crate::law())]

    /// What a ray of the picture hits is never taken to be out of view.
    #[test]
    fn frustums_leave_out_nothing_that_is_seen(
        eye in prop::array::uniform3(-6.0..6.0),
        target in prop::array::uniform3(-2.0..2.0),
        fov_rad in 0.05..2.8,
        aspect in 0.3..3.0,
        (x, y) in (-1.0..1.0, -1.0..1.0),
        distance_m in 0.02..20.0,
        size_m in 1e-3..2.0,
    ) {
        let camera = Camera::look_at("eye", eye.into(), target.into(), fov_rad);
        let direction = camera.direction(x, y, aspect);
        let place = camera.position + direction * ((distance_m + camera.near_m) / direction.dot(camera.forward));
        let frustum = camera.frustum(aspect);
        // A box with the place in a corner, and one around it.
        prop_assert!(frustum.may_see((place, place + size_m)));
        prop_assert!(frustum.may_see((place - size_m, place)));
        prop_assert!(frustum.may_see((place - size_m, place + size_m)));
        // Behind the eye, and well beside the picture.
        let behind = camera.position - direction * (distance_m + 0.5);
        prop_assert!(!frustum.may_see((behind, behind)));
        let beside = camera.direction(x.signum() * (x.abs() + 1.01), y, aspect);
        let beside = camera.position + beside * (distance_m + 1.0);
        prop_assert!(!frustum.may_see((beside, beside)));
    }
}

#[test]
fn boxes_around_the_eye_are_in_view() {
    let camera = Camera::look_at("eye", DVec3::ZERO, DVec3::NEG_Z, 0.5);
    assert!(camera.frustum(1.0).may_see((-DVec3::ONE, DVec3::ONE)));
}

#[test]
fn built_in_scenes_call_for_chains_from_their_own_cameras() {
    for name in builtin::NAMES {
        let scene = builtin::build(name).expect("listed");
        let line = plan::chains(&scene, Some((&scene.cameras[0], 1.5)), EffectSwitch::Auto);
        assert!(line.on, "{name}: {}", line.reason);
    }
}
