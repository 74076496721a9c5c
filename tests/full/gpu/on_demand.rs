//! Pipelines, and what chains are traced through, exist only once a view has called for them.

use std::collections::BTreeSet;

use nephroid::effect::EffectSwitch;
use nephroid::eye_pass::renderer::Renderer;

use crate::gpu::rig::{Rig, or_skip};
use support::floors::{diffuse, floor_map, floor_scene};
use support::prelude::*;
use support::scenes::{bits, limited, seen, view};

/// A lit floor; what is specular lies far out along +x, a matte box along −x.
fn hall() -> (Scene, Vec<IlluminationMap>) {
    let mut scene = floor_scene(diffuse(rgb(0.8, 0.5, 0.2)));
    let coat = Material {
        surface: SurfaceKind::Coated,
        roughness: 0.0,
        base_colour: LinearSrgb::grey(0.5),
        emitted_radiance: rgb(0.1, 0.2, 0.3),
        ..Default::default()
    };
    let glass = parts::dielectric("glass", 1.5);
    let tinted = Material {
        base_colour: rgb(0.9, 0.5, 0.2),
        ..glass.clone()
    };
    let white = parts::matte("box", LinearSrgb::WHITE);
    for (name, place, material) in [
        ("box", [-4.0, 0.3, 0.5], white),
        ("mirror", [4.0, 0.3, 0.0], parts::mirror()),
        ("glass", [4.0, 0.3, 0.5], glass),
        ("tinted", [4.0, 0.3, 1.0], tinted),
        ("coat", [4.0, 0.8, 0.5], coat),
    ] {
        let ball = shapes::sphere(place.into(), 0.2, 3);
        parts::add(&mut scene, name, ball, material);
    }
    (scene, vec![floor_map(0, 2, 2, vec![[1.0, 2.0, 3.0]; 4])])
}

fn rig() -> Option<Rig<'static>> {
    let (scene, maps) = hall();
    Rig::new(&scene, &maps)
}

/// From the floor's middle along x.
fn towards(x: f64) -> View {
    let eye = dvec3(0.5, 0.4, 0.5);
    View {
        background: rgb(0.5, 0.6, 0.7),
        ..view(eye, dvec3(x, 0.3, 0.5), 1.6, [48, 32])
    }
}

fn to_specular() -> View {
    towards(4.0)
}

fn to_matte() -> View {
    towards(-4.0)
}

/// Pipelines, those of specular surfaces, and bytes that chains are traced through.
fn made(renderer: &Renderer) -> (u64, u64, u64) {
    let counts = renderer.counts();
    (counts.pipelines, counts.specular_pipelines, counts.chain_bytes)
}

/// Objects that were drawn, and the specular ones among them.
fn drawn(renderer: &Renderer) -> (u64, u64) {
    let counts = renderer.counts();
    (counts.drawn_objects, counts.drawn_specular)
}

#[test]
fn specular_pipelines_wait_for_such_a_view() {
    let mut rig = or_skip!(rig());
    assert_eq!(made(&rig.renderer), (0, 0, 0), "nothing was looked at yet");
    rig.picture(&to_matte());
    assert_eq!((made(&rig.renderer), drawn(&rig.renderer)), ((1, 0, 0), (2, 0)));
    assert_eq!(rig.renderer.counts().map_bytes, 65 * 65 * 8, "a tile");

    rig.picture(&to_specular());
    // Depth, chains, and the picture of them: all kinds of surfaces share these.
    let (pipelines, specular, bytes) = made(&rig.renderer);
    assert_eq!((pipelines, specular, drawn(&rig.renderer)), (4, 3, (5, 4)));
    assert!(bytes >= 48 * rig.scene.triangle_count() as u64);
    assert_eq!(rig.renderer.counts().traced_pixels, 48 * 32);

    rig.picture(&to_matte());
    assert_eq!(
        (made(&rig.renderer), drawn(&rig.renderer)),
        ((4, 3, bytes), (2, 0)),
        "kept"
    );
}

#[test]
fn switched_off_everything_is_given_up() {
    let (Some(mut rig), view) = (rig(), to_specular()) else {
        return;
    };
    let before = rig.picture(&view);
    let specular = |rig: &Rig| {
        (
            rig.renderer.counts().specular_pipelines,
            rig.renderer.counts().chain_bytes,
        )
    };
    rig.set_chains(EffectSwitch::Off);
    assert_eq!(specular(&rig), (0, 0));
    let off = rig.picture(&view);
    assert_eq!((specular(&rig), drawn(&rig.renderer).1), ((0, 0), 0));
    assert!(bits(&off) != bits(&before));

    // What is left is the surfaces' own light: the CPU's eye pass without chains is exact here, edges aside.
    let settings = limited(|limits| limits.switch = EffectSwitch::Off);
    let tracer = Tracer::new(Arc::new(rig.scene.clone()));
    let expected = seen(&tracer, &rig.maps, &view, &settings).0;
    let differs = |(a, b): &(&[f32; 3], &[f32; 3])| a.iter().zip(*b).any(|(a, b)| (a - b).abs() > 2e-3);
    let wrong = off
        .radiance
        .iter()
        .zip(&expected.radiance)
        .filter(differs)
        .count();
    assert!(wrong <= 5, "{wrong} pixels differ");
    let distinct: BTreeSet<_> = off.radiance.iter().map(|rgb| rgb.map(f32::to_bits)).collect();
    assert!(distinct.len() > 3, "floor, background, mirror and coat");

    rig.set_chains(EffectSwitch::Auto);
    assert_eq!(specular(&rig), (0, 0), "nothing was looked at since");
    assert!(bits(&rig.picture(&view)) == bits(&before));
}

#[test]
fn new_maps_reach_mirrors_out_of_view() {
    let mut rig = or_skip!(rig());
    rig.picture(&to_specular());
    rig.set_maps(&[floor_map(0, 2, 2, vec![[9.0, 2.0, 3.0]; 4])]);
    rig.picture(&to_matte());
    assert!(bits(&rig.picture(&to_specular())) == bits(&rig.fresh(&to_specular())));
    // Maps that come and go take no further pipelines.
    for maps in [vec![], hall().1, vec![], hall().1] {
        rig.set_maps(&maps);
        rig.picture(&to_specular());
        assert_eq!(rig.renderer.counts().specular_pipelines, 3, "{} maps", maps.len());
    }
}
