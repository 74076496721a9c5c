//! Lamps that are hardly any, blinding ones, and lamps where no lamp should be.

use nephroid::illumination::Side;
use nephroid::scene::{Environment, PanelShape};
use nephroid::settings::ItemBufferKind;

use support::laws::law::*;
use support::laws::scenes::*;
use support::laws::{Baked, Table, values};
use support::prelude::*;
use support::tools::{photons, set, settings, to};

pub fn fill(t: &mut Table) {
    // Powers from the smallest that single precision knows to the largest: the map is a scale of itself.
    let any = t.case("candela-of-any-size").bake(glass_ball(3), 0.01, 32);
    for factor in [-100, -20, 20, 100].map(|power| 2.0_f64.powi(power)) {
        any.bake(of_intensity(factor), 0.01, 32).as_first(
            "powers of two scale the map exactly",
            1e-15,
            factor,
        );
    }
    for factor in [1e-30, 1e30] {
        any.bake(of_intensity(factor), 0.01, 32)
            .as_first("1e-30 and 1e30 W/sr scale the map", 1e-6, factor);
    }
    for watts in [1e-310, f64::MIN_POSITIVE] {
        any.bake(of_intensity(watts), 0.01, 32).measure(
            "brightest texel of denormal powers, W/m²",
            1e-37,
            |bake| brightest(bake, LayerKind::Caustic),
        );
    }
    for watts in [1e38, 1e45, 1e100] {
        t.case("light-beyond-single-precision")
            .without_books()
            .bake(of_intensity(watts), 0.01, 32)
            .must("every value is finite", |bake| {
                bake.result
                    .maps
                    .iter()
                    .flat_map(values)
                    .all(|e| e.is_finite() && e >= 0.0)
            })
            .must("a warning counts the texels", |bake| {
                bake.result
                    .warnings
                    .iter()
                    .any(|warning| warning.location == "maps")
            });
    }
    let red = rgb(1.0, 0.0, 0.0);
    let [mut lit, mut coloured, mut filled] = [0; 3].map(|_| glass_ball(3));
    lit.lights[0].colour = red;
    coloured.materials[1].base_colour = red;
    let glass = &mut filled.materials[1];
    *glass = tinted(glass.clone(), 1e-3, rgb(1.0, 1e-30, 1e-30));
    for scene in [&lit, &coloured, &filled] {
        t.case("a-colour-channel-of-0")
            .bake(scene.clone(), 0.01, 32)
            .must("the channel that is there arrives", |bake| flux_w(bake).r > 0.0);
    }
    t.case("red-lamp")
        .bake(lit, 0.01, 32)
        .measure("green and blue arrive, W", 0.0, |bake| {
            flux_w(bake).g + flux_w(bake).b
        });
    let mut nowhere = shapes::facet([DVec3::Y, dvec3(0.1, 1.0, 0.0), dvec3(0.2, 1.0, 0.0)]);
    nowhere.normals.fill(DVec3::NEG_Y);
    let panel = shapes::floor([-0.1, 0.1], [-0.1, 0.1], 1.0);
    t.case("glowing-triangle-without-area")
        .bake_with(glowing(nowhere.clone()), soft())
        .arrives(0.0);
    shapes::append(&mut nowhere, &panel);
    t.case("glowing-triangle-beside-a-panel")
        .bake_with(glowing(panel), soft())
        .bake_with(glowing(nowhere), soft())
        .as_first("map as without it", 1e-6, 1.0);
    // A surface sees at most half a sky of radiance 1.
    t.case("glow-on-its-receiver")
        .bake_with(glowing(shapes::floor([-0.2, 0.2], [-0.2, 0.2], 0.0)), soft())
        .measure("brightest texel, W/m²", PI * (1.0 + 1e-6), |bake| {
            brightest(bake, LayerKind::Direct)
        });
    // Under an even sky of radiance 1, clear glass and perfect mirrors change nothing.
    for material in [parts::mirror(), parts::dielectric("glass", 1.5)] {
        let settings = BakeSettings {
            layers: vec![LayerKind::Caustic, LayerKind::Direct],
            ..photons(1e6, 1)
        };
        t.case(format!("furnace-with-{}", material.name))
            .bake_with(
                under_sky(
                    floor(0.02).with("ball", shapes::sphere(DVec3::Y, 0.4, 2), material),
                    (4, 2),
                    1.0,
                    1.0,
                ),
                settings,
            )
            .measure("E is π under an even sky", 0.05, |bake| off(front_e(bake), PI));
    }
    sent_to_a_mirror(t);
    direct(t);
}

fn of_intensity(watts: f64) -> Scene {
    let mut scene = glass_ball(3);
    scene.lights = Vec::new();
    scene.lit(light(LightKind::Point {
        position: dvec3(0.1, 2.0, 0.05),
        intensity: RadiantIntensity(watts),
    }))
}

fn brightest(bake: &Baked, kind: LayerKind) -> f64 {
    let maps = bake.result.maps.iter();
    maps.flat_map(|map| luminance(map, kind)).fold(0.0, f64::max)
}

fn flux_w(bake: &Baked) -> LinearSrgb {
    let maps = bake.result.maps.iter().map(|map| map.flux_w(LayerKind::Caustic));
    maps.fold(LinearSrgb::BLACK, |sum, flux| sum + flux)
}

/// An upright mirror beside a floor, lit by a mesh that glows.
fn glowing(mesh: Mesh) -> Scene {
    let glow = LightKind::Surface {
        object: 2,
        radiance: Radiance(1.0),
    };
    let black = parts::matte("glow", LinearSrgb::BLACK);
    floor(0.5)
        .mirror(upright())
        .with("glow", mesh, black)
        .lit(light(glow))
}

fn soft() -> BakeSettings {
    BakeSettings {
        layers: vec![LayerKind::Caustic, LayerKind::Direct],
        ..photons(3e4, 16)
    }
}

/// Under an even sky.
fn under_sky(mut scene: Scene, (width, height): (usize, usize), radiance: f32, scale: f64) -> Scene {
    let pixels = vec![[radiance; 3]; width * height];
    scene.environment = Environment::new(width, height, pixels).map(Arc::new);
    scene.lit(light(LightKind::Environment { scale }))
}

/// Caustic and direct E of the one texel of the floor's front.
fn front_e(bake: &Baked) -> f64 {
    let fronts = bake
        .result
        .maps
        .iter()
        .filter(|map| map.chart.receiver.side() == Side::Front);
    fronts
        .map(|map| luminance(map, LayerKind::Caustic)[0] + luminance(map, LayerKind::Direct)[0])
        .sum()
}

/// What lamps send into the solid angle of a mirror, by both estimators and item buffers.
fn sent_to_a_mirror(t: &mut Table) {
    let place = dvec3(0.1, 0.8, -0.2);
    let (inner, outer) = (0.12_f64, 0.3_f64);
    // The whole of its cone, whose edge falls off as the square of a ramp in the cosine.
    let cone_sr = TAU * (1.0 - inner.cos() + (inner.cos() - outer.cos()) / 3.0);
    let slanting = dvec3(1.0, -1.0, 0.2).normalize();
    let point = LightKind::Point {
        position: place,
        intensity: RadiantIntensity(3.0),
    };
    let spot = spot(place, dvec3(0.1, -1.0, 0.1), 3.0, [inner, outer]).kind;
    let sun = LightKind::Sun {
        direction: slanting,
        normal_irradiance: Irradiance(3.0),
    };
    let mirror = shapes::floor([-0.6, 0.6], [-0.5, 0.5], 0.0);
    let seen_sr = solid_angle_sr(&mirror, place);
    let wall = shapes::rectangle(dvec3(3.0, 2.0, 0.0), DVec3::Z * 2.0, DVec3::Y * 2.0);
    let over = Scene::default().mirror(mirror).diffuse("wall", wall);
    for (name, kind, share) in [
        ("point", point, seen_sr),
        ("spot", spot, cone_sr),
        ("sun", sun, 1.2 * -slanting.y),
    ] {
        for item_buffer in [ItemBufferKind::Equal, ItemBufferKind::Cube] {
            for settings in [to(0.01, 16), settings(6.4e5, 16)] {
                t.case(format!("{name}-above-a-mirror"))
                    .bake_with(
                        over.clone().lit(light(kind)),
                        set(settings, |s| s.item_buffer = item_buffer),
                    )
                    .sent(3.0 * share, 3e-3);
            }
        }
    }
    // A sun's rays start before everything that may stop them: half a metre up, a shadow lies half a metre farther.
    let plate = shapes::floor([-2.0, -0.5], [-1.0, 1.0], 0.5);
    let shaded = over.diffuse("plate", plate).sun(dvec3(1.0, -1.0, 0.0));
    t.case("plate-before-a-mirror")
        .bake(shaded.clone(), 0.01, 16)
        .sent(0.6 * 0.5_f64.sqrt(), 5e-3)
        .splat(shaded, 2.56e6, 16)
        .sent(0.6 * 0.5_f64.sqrt(), 5e-3);
}

/// Direct light of lamps with extent that are hardly any, on a floor below a ball of glass.
fn direct(t: &mut Table) {
    let below = || floor(0.6).glass(1.5, shapes::sphere(dvec3(0.0, 0.4, 0.0), 0.2, 2));
    let layer = || BakeSettings {
        max_error: None,
        layers: vec![LayerKind::Direct],
        ..to(0.02, 16)
    };
    let sky = |pixels, radiance, scale| under_sky(below(), pixels, radiance, scale);
    let panel = |half_m: f64, radiance: f64| {
        let sides = [DVec3::X * half_m, DVec3::Z * half_m];
        below().lit(panel(DVec3::Y, sides, PanelShape::Rectangle, radiance))
    };
    let glowing = |object: usize| {
        below().lit(light(LightKind::Surface {
            object,
            radiance: Radiance(1.0),
        }))
    };
    let sheet = shapes::floor([-0.3, 0.3], [-0.3, 0.3], 0.0);
    let missing_sky = below().lit(light(LightKind::Environment { scale: 1.0 }));
    for (name, scene, most) in [
        ("black-sky", sky((2, 1), 0.0, 1.0), 0.0),
        // An environment that was not read lights nothing, nor does an object that does not exist.
        ("missing-sky", missing_sky, 0.0),
        ("missing-object-that-glows", glowing(7), 0.0),
        ("panel-without-area", panel(0.0, 1.0), 0.0),
        ("panel-whose-area-is-hardly-a-number", panel(1e-150, 1.0), 1e-30),
        ("floor-that-glows", glowing(0), 0.0),
        (
            "glowing-sheet-on-the-floor",
            glowing(2).diffuse("sheet", sheet),
            TAU,
        ),
    ] {
        t.case(name)
            .bake_with(scene, layer())
            .measure("E of the floor, W/m²", most, on_the_floor);
    }
    t.case("even-sky")
        .bake_with(sky((1, 1), 2.0, 1.0), layer())
        .bake_with(sky((1, 1), 2e30, 1.0), layer())
        .compare("1e30 times the radiance", 1e-3, |bake, first| {
            off(on_the_floor(bake), 1e30 * on_the_floor(first))
        })
        .bake_with(sky((1, 1), 2.0, 1e-20), layer())
        .compare("1e-20 times the scale", 1e-3, |bake, first| {
            off(on_the_floor(bake), 1e-20 * on_the_floor(first))
        });
    t.case("blinding-panel")
        .bake_with(panel(0.5, 1.0), layer())
        .must("the floor is lit", |bake| on_the_floor(bake) > 0.1)
        .bake_with(panel(0.5, 1e30), layer())
        .compare("1e30 times the radiance", 1e-3, |bake, first| {
            off(on_the_floor(bake), 1e30 * on_the_floor(first))
        });
}

/// Largest direct E of the floor [W/m²].
fn on_the_floor(bake: &Baked) -> f64 {
    floor_map(bake).map_or(0.0, |map| {
        luminance(map, LayerKind::Direct).into_iter().fold(0.0, f64::max)
    })
}
