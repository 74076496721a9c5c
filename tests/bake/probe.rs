//! The light paths of single texels: each obeys the laws of reflection and refraction, and together they bring what was
//! baked.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use nephroid::illumination::IlluminationMap;
use nephroid::light_pass::explain::{Explanation, LightPath, Limits, Target, explain};
use nephroid::optics::LinearSrgb;
use nephroid::progress::Control;
use nephroid::scene::{LightKind, Scene};
use nephroid::settings::LayerKind;
use nephroid::transport::{Event, HitPlace, Tracer};

use crate::support;
use crate::tools::{at, bake, builtin_scene, caustic, map_of};

const LIMITS: Limits = Limits {
    max_depth: 16,
    branch_threshold: 1e-5,
    most_rays: 4_000_000,
};

/// The middle of a texel of a map without tiles.
fn target(tracer: &Tracer, map: &IlluminationMap, texel: usize) -> Target {
    let chart = &map.chart;
    let uv = DVec2::new(
        ((texel % chart.width) as f64 + 0.5) / chart.width as f64,
        ((texel / chart.width) as f64 + 0.5) / chart.height as f64,
    );
    let place = chart
        .corner_uvs
        .iter()
        .enumerate()
        .find_map(|(triangle, [a, b, c])| {
            let whole = (*b - *a).perp_dot(*c - *a);
            let weights = [
                (*c - *b).perp_dot(uv - *b) / whole,
                (*a - *c).perp_dot(uv - *c) / whole,
                (*b - *a).perp_dot(uv - *a) / whole,
            ];
            weights
                .iter()
                .all(|weight| *weight >= -1e-9)
                .then_some((triangle, weights))
        });
    let (triangle, barycentric) = place.expect("the map is full");
    let hit = tracer.surface_at(&HitPlace {
        object: chart.object() as u32,
        triangle: triangle as u32,
        barycentric,
        distance_m: 1.0,
    });
    let target = Target::new(tracer, chart, &hit, -hit.geometric_normal).expect("it has a texel");
    assert_eq!(target.texel, texel);
    target
}

/// What a path breaks, if anything.
fn fault(scene: &Scene, target: &Target, path: &LightPath) -> Option<String> {
    let says = |what: &str, off: f64| (off.is_nan() || off > 1e-6).then(|| format!("{what}: off by {off:e}"));
    let mut from = path.start;
    if let LightKind::Point { position, .. } = scene.lights[path.light].kind
        && position != path.start
    {
        return Some("it does not begin at the lamp".into());
    }
    for vertex in &path.vertices {
        let (way_in, way_out, normal) = (vertex.incident, vertex.outgoing, vertex.normal);
        let along = |d: DVec3| d - normal * normal.dot(d);
        let law = match vertex.event {
            Event::Reflection | Event::TotalInternalReflection => {
                way_out.distance(way_in - 2.0 * normal * normal.dot(way_in))
            }
            Event::Refraction => (along(way_in) * vertex.ior_ratio).distance(along(way_out)),
            Event::ThinTransmission => way_in.distance(way_out),
        };
        let ior = scene.material_of(vertex.object).ior;
        let ratio = match vertex.event {
            Event::Refraction => (vertex.ior_ratio - ior)
                .abs()
                .min((vertex.ior_ratio - 1.0 / ior).abs()),
            _ => (vertex.ior_ratio - 1.0).abs(),
        };
        let goes_on = way_out.dot(normal) < 0.0;
        let found = says("its law", law)
            .or_else(|| {
                says(
                    "lengths",
                    (way_out.length() - 1.0).abs() + (normal.length() - 1.0).abs(),
                )
            })
            .or_else(|| says("its index", ratio))
            .or_else(|| {
                says(
                    "the way here",
                    ((vertex.point - from).normalize() - way_in).length(),
                )
            })
            .or_else(|| (normal.dot(way_in) >= 0.0).then(|| "the normal's side".into()))
            .or_else(|| {
                let passes = matches!(vertex.event, Event::Refraction | Event::ThinTransmission);
                (passes != goes_on).then(|| "the wrong side".into())
            });
        if found.is_some() {
            return found;
        }
        from = vertex.point;
    }
    let last = path.vertices.last()?;
    let texel_m = target.area_m2.sqrt();
    says(
        "the way to the end",
        ((path.end - from).normalize() - last.outgoing).length(),
    )
    .or_else(|| (path.end.distance(target.point) > texel_m).then(|| "it ends beyond the texel".into()))
}

/// The normal of the surface that a mesh stands for at a point of it.
type Shape = fn(DVec3) -> Option<DVec3>;

fn check(name: &str, density_per_sr: f64, shape: Shape) -> Vec<(f64, Explanation)> {
    let scene = Arc::new(builtin_scene(name));
    let settings = nephroid::settings::BakeSettings {
        max_error: Some(0.002),
        layers: vec![LayerKind::Caustic, LayerKind::Direct],
        ..at(density_per_sr, 64)
    };
    let result = bake((*scene).clone(), &settings);
    let map = map_of(&result, &scene, "floor");
    let tracer = Tracer::new(Arc::clone(&scene));
    let light = caustic(map);
    let mut order: Vec<usize> = (0..light.len()).collect();
    order.sort_by(|a, b| light[*a].total_cmp(&light[*b]));
    let mean = light.iter().sum::<f64>() / light.len() as f64;
    let share = |share: f64| order[(share * (order.len() - 1) as f64) as usize];
    let mut found = Vec::new();
    for texel in [
        share(1.0),
        share(0.997),
        share(0.9),
        share(0.6),
        share(0.3),
        share(0.0),
    ] {
        let target = target(&tracer, map, texel);
        let told = explain(
            &tracer,
            &target,
            LIMITS,
            light[texel].max(1e-3 * mean),
            &Control::default(),
        );
        assert!(told.is_complete, "{name} {texel}");
        for path in &told.paths {
            assert_eq!(fault(&scene, &target, path), None, "{name} {texel}: {path:?}");
            for vertex in &path.vertices {
                if let Some(normal) = shape(vertex.point) {
                    let off = 1.0 - normal.dot(vertex.normal).abs();
                    assert!(off < 1e-4, "{name}: {vertex:?} is not on its surface, by {off}");
                }
            }
        }
        let error = f64::from(map.error.as_ref().expect("it was estimated")[texel]);
        let sum = told.caustic().luminance();
        println!(
            "{name} {texel}: {sum:.5} of {:.5} ± {error:.5} W/m², {} paths, {} rays",
            light[texel],
            told.paths.len(),
            told.rays
        );
        // The map's error is that of its luminance over all texels alike: in single ones it says too little, most of all
        // where hardly any light comes, and the darkest of all is chosen for being too dark. A hundredth of the mean
        // stands for that; the solver below needs none of it.
        assert!(
            (sum - light[texel]).abs() <= 3.0 * error + 2e-3 * light[texel] + 1e-2 * mean,
            "{name} {texel}: {sum} of {} ± {error} W/m²",
            light[texel]
        );
        let direct = map.layer(LayerKind::Direct).map_or(0.0, |layer| {
            LinearSrgb::from(layer.irradiance[texel].map(f64::from)).luminance()
        });
        let sum = told.direct().luminance();
        assert!(
            (sum - direct).abs() <= 1e-2 * direct + 1e-6,
            "{name} {texel}: direct {sum} of {direct}"
        );
        found.push((light[texel], told));
    }
    found
}

#[test]
fn paths_over_a_mirror_ring() {
    let found = check("ring", 2e4, |point| {
        let axis = DVec3::new(point.x, 0.0, point.z);
        axis.try_normalize()
    });
    let (brightest, told) = &found[0];
    assert!(*brightest > 0.0 && !told.paths.is_empty());
}

#[test]
fn paths_through_a_glass_ball() {
    let scene = builtin_scene("ball");
    let ball = scene
        .objects
        .iter()
        .find(|object| object.name != "floor")
        .expect("a ball");
    let (low, high) = ball.mesh.bounds().expect("it has a size");
    assert!(
        (low.x + high.x).abs() < 1e-9 && (low.z + high.z).abs() < 1e-9,
        "it is on the axis"
    );
    let found = check("ball", 2e4, |_| None);
    let (_, told) = &found[0];
    assert!(
        told.paths[0].vertices.len() == 2,
        "in and out: {:?}",
        told.paths[0]
    );
    let events: Vec<Event> = told.paths[0].vertices.iter().map(|vertex| vertex.event).collect();
    assert_eq!(events, [Event::Refraction; 2]);
    let centre = (low + high) * 0.5;
    for path in found.iter().flat_map(|(_, told)| &told.paths) {
        for vertex in &path.vertices {
            let radial = (vertex.point - centre).normalize();
            // Light that grazes a facet is turned at the facet itself, half of one away from the ball's own normal.
            assert!(1.0 - radial.dot(vertex.normal).abs() < 2e-5, "{vertex:?}");
        }
    }
}

#[test]
fn paths_through_the_waves_of_a_pool() {
    // Fine enough for its brightest line, which coarser bakes know less well than they say.
    let found = check("pool", 4e5, |_| None);
    let (_, told) = &found[0];
    assert_eq!(told.paths[0].vertices.len(), 1, "once through the water");
}

#[test]
fn a_plane_mirror_has_one_path_and_its_shadow_none() {
    let found = check("mirror", 2e4, |_| None);
    let (_, told) = &found[0];
    let over_the_mirror = told.paths.iter().filter(|path| !path.vertices.is_empty());
    assert_eq!(over_the_mirror.count(), 1);
    let (dark, told) = found.last().expect("the darkest");
    assert_eq!(*dark, 0.0, "no light comes there from the mirror");
    assert_eq!(told.caustic().luminance(), 0.0);
    assert!(told.paths.iter().all(|path| path.vertices.is_empty()));
}

/// Against the maps of the independent solver, which knows neither meshes nor this program.
#[test]
fn shares_add_up_to_the_independent_solvers_texels() {
    for (name, file, tolerance) in [("ring", "S1", 0.02), ("ball", "S2", 0.03), ("pool", "S3", 0.04)] {
        let scene = Arc::new(builtin_scene(name));
        let result = bake((*scene).clone(), &at(1e3, 256));
        let map = map_of(&result, &scene, "floor");
        let expected = support::reference_map(file);
        let tracer = Tracer::new(Arc::clone(&scene));
        let mut order: Vec<usize> = (0..expected.len()).collect();
        order.sort_by(|a, b| expected[*a].total_cmp(&expected[*b]));
        // Not the very brightest: those are the meshes' own.
        for share in [0.99, 0.95, 0.8, 0.6] {
            let texel = order[(share * order.len() as f64) as usize];
            let target = target(&tracer, map, texel);
            let told = explain(&tracer, &target, LIMITS, expected[texel], &Control::default());
            let sum: f64 = told.caustic().luminance();
            println!("{name} {texel}: {sum:.5}, solver {:.5}", expected[texel]);
            assert!(
                (sum - expected[texel]).abs() < tolerance * expected[texel],
                "{name} {texel}: {sum}, not {}",
                expected[texel]
            );
        }
    }
}
