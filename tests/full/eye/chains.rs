//! When the eye's specular chains are followed, and what is left without them.

use nephroid::effect::{Effect, EffectSwitch};
use nephroid::eye_pass::reference::EyeRays;
use nephroid::optics::fresnel::dielectric_reflectance;
use nephroid::plan;

use support::meshes::{floor, quad, sphere};
use support::prelude::*;
use support::scenes::{chart, diffuse, limited, map_of, seen, surface, tracer, view};

/// Irradiance on the first object [W/m²].
const E: [f32; 3] = [50.0, 40.0, 20.0];
/// Radiance of the background [W/(m² sr)].
const SKY: LinearSrgb = rgb(3.0, 2.0, 1.0);

fn looking(eye: [f64; 3], target: [f64; 3], fov_rad: f64) -> View {
    View {
        background: SKY,
        ..view(eye.into(), target.into(), fov_rad, [24, 16])
    }
}

/// Towards the object, and the other way.
fn ahead_and_away() -> [View; 2] {
    [[0.0, 1.0, 0.0], [0.0, 1.0, 9.0]].map(|target| looking([0.0, 1.5, 3.0], target, 0.6))
}

/// Objects of which the first one is evenly lit.
struct Lit(Tracer, Vec<IlluminationMap>);

impl Lit {
    fn new(tracer: Tracer) -> Self {
        let map = map_of(chart(&tracer, 0, 2, 2), vec![E; 4]);
        Self(tracer, vec![map])
    }

    /// A lit floor with a ball above it.
    fn under(ball: Material) -> Self {
        let mesh = sphere(DVec3::Y, 0.5, 24, 12);
        let floor = (floor(100.0, 0.0), diffuse(0.6));
        Self::new(tracer(vec![floor, (mesh, ball)], vec![]))
    }

    fn seen(&self, view: &View, switch: EffectSwitch) -> (Picture, EyeRays) {
        seen(&self.0, &self.1, view, &limited(|limits| limits.switch = switch))
    }
}

#[test]
fn without_chains_clear_bodies_are_left_out() {
    let bare = Lit::new(tracer(vec![(floor(100.0, 0.0), diffuse(0.6))], vec![]));
    for kind in [SurfaceKind::Dielectric, SurfaceKind::ThinWall] {
        let glazed = Lit::under(surface(kind, 1.5));
        // From outside, and from within the ball.
        for eye in [[0.0, 1.5, 3.0], [0.1, 1.0, 0.0]] {
            let view = looking(eye, [0.0, 0.9, -0.1], 0.9);
            let found = glazed.seen(&view, EffectSwitch::Off).0;
            assert_eq!(found, bare.seen(&view, EffectSwitch::Auto).0, "{kind:?}");
            assert_ne!(found, glazed.seen(&view, EffectSwitch::Auto).0);
        }
    }
}

#[test]
fn without_chains_a_coat_shows_its_diffuse_part() {
    let wall = quad(dvec3(-1.0, -1.0, 0.0), DVec3::Y * 2.0, DVec3::X * 2.0);
    let coat = surface(SurfaceKind::Coated, 1.5);
    let lit = Lit::new(tracer(vec![(wall, coat)], vec![]));
    let view = looking([0.0, 0.0, 3.0], [0.0; 3], 0.01);
    let [with, without] = [EffectSwitch::Auto, EffectSwitch::Off].map(|switch| lit.seen(&view, switch).0);
    let r = dielectric_reflectance(1.0, 1.5);
    for (with, without) in with.radiance.iter().zip(&without.radiance) {
        for channel in 0..3 {
            let (with, without) = (f64::from(with[channel]), f64::from(without[channel]));
            let diffuse = (1.0 - r) * f64::from(E[channel]) / PI;
            assert!((without / diffuse - 1.0).abs() < 1e-4, "{without}");
            let reflected = (with - without) / (r * SKY.to_array()[channel]);
            assert!((reflected - 1.0).abs() < 1e-3, "{reflected}");
        }
    }
}

#[test]
fn the_plan_names_what_is_in_view() {
    use EffectSwitch::{Auto, Off, On};
    let lit = Lit::under(surface(SurfaceKind::Dielectric, 1.5));
    let [ahead, away] = ahead_and_away().map(|view| Some(view.camera));
    let in_view = "`object 1` is in view of `eye`";
    for (camera, switch, on, reason) in [
        (&ahead, Auto, true, in_view),
        (&ahead, Off, false, "switched off by the user"),
        (&away, Auto, false, "nothing specular is in view"),
        (&away, On, true, "switched on by the user"),
        (&None, Auto, true, "`object 1` is specular"),
    ] {
        let camera = camera.as_ref().map(|camera| (camera, 1.5));
        let line = plan::chains(lit.0.scene(), camera, switch);
        assert_eq!((line.on, line.reason.as_str()), (on, reason));
        assert_eq!((line.effect, line.switch), (Effect::Chains, switch));
    }
    let matte = support::scenes::scene(vec![(floor(1.0, 0.0), diffuse(0.5))], vec![]);
    let line = plan::chains(&matte, None, Auto);
    assert_eq!(
        (line.on, line.reason.as_str()),
        (false, "nothing in the scene is specular")
    );
    for name in builtin::NAMES {
        let scene = builtin::build(name).expect("listed");
        let line = plan::chains(&scene, Some((&scene.cameras[0], 1.5)), Auto);
        assert!(line.on, "{name}: {}", line.reason);
    }
}

proptest! {
    #![proptest_config(support::law(2048))]

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
        let along = (distance_m + camera.near_m) / direction.dot(camera.forward);
        let place = camera.position + direction * along;
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
        // Around the eye.
        let [low, high] = [-1.0, 1.0].map(|off| camera.position + off);
        prop_assert!(frustum.may_see((low, high)));
    }
}
