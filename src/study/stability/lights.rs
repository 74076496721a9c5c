//! Lamps that are hardly any, blinding ones, and lamps where no lamp should be.

use std::sync::Arc;

use glam::DVec3;

use super::bench::values;
use super::laws::{apart, deposited_w, luminance, map_of, maps_apart};
use super::scenes::{at, glass_ball, upright_mirror};
use super::{Bench, Case, Group};
use crate::error::Result;
use crate::eye_pass::reference::{ReferenceSettings, render};
use crate::eye_pass::{ToneMap, View};
use crate::optics::wavelength::VISIBLE;
use crate::optics::{Glass, LinearSrgb, Nanometres};
use crate::scene::builtin::{parts, shapes};
use crate::scene::{Environment, Light, LightKind, LightSize, Scene, Volume};
use crate::settings::{BakeSettings, LayerKind};
use crate::transport::Tracer;
use crate::units::{Radiance, RadiantIntensity};

/// Cases of lamps and colours.
pub const CASES: &[Case] = &[
    Case::quick("candela-of-any-size", Group::Materials, any_power),
    Case::quick(
        "light-beyond-single-precision",
        Group::Materials,
        beyond_single_precision,
    ),
    Case::quick("a-colour-channel-of-0", Group::Materials, channel_zero),
    Case::quick("wavelength-at-a-resonance", Group::Materials, resonance),
    Case::quick(
        "glowing-triangle-without-area",
        Group::Materials,
        glow_without_area,
    ),
    Case::quick("glow-on-its-receiver", Group::Materials, glow_on_receiver),
    Case::quick("furnace", Group::Laws, furnace),
    Case::quick("lamp-at-the-eye", Group::Optics, lamp_at_the_eye),
];

const SETTINGS: fn() -> BakeSettings = || at(1e3, 32);

fn with_intensity(mut scene: Scene, intensity: f64) -> Scene {
    for light in &mut scene.lights {
        if let LightKind::Point { intensity: known, .. } = &mut light.kind {
            *known = RadiantIntensity(intensity);
        }
    }
    scene
}

/// Powers from the smallest that single precision knows to the largest: the map is a scale of itself.
fn any_power(bench: &mut Bench) -> Result<()> {
    let one = bench.bake(&glass_ball(3), &SETTINGS())?;
    for power in [-100, -20, 20, 100] {
        let factor = 2.0_f64.powi(power);
        let result = bench.bake(&with_intensity(glass_ball(3), factor), &SETTINGS())?;
        let off = maps_apart(&result.maps, &one.maps, factor);
        bench.law("powers of two scale the map exactly", off, 1e-15);
    }
    for factor in [1e-30, 1e30] {
        let result = bench.bake(&with_intensity(glass_ball(3), factor), &SETTINGS())?;
        bench.law(
            "1e-30 and 1e30 W/sr scale the map",
            maps_apart(&result.maps, &one.maps, factor),
            1e-6,
        );
    }
    // Below what single precision holds, maps are dark.
    for factor in [1e-310, f64::MIN_POSITIVE] {
        let result = bench.bake(&with_intensity(glass_ball(3), factor), &SETTINGS())?;
        let brightest = luminance(map_of(&result, &glass_ball(3), "floor"), LayerKind::Caustic)
            .into_iter()
            .fold(0.0, f64::max);
        bench.law("denormal powers give dark maps, W/m²", brightest, 1e-37);
    }
    Ok(())
}

/// Lamps of which single precision cannot hold the light: maps are as bright as maps can be, and say so.
fn beyond_single_precision(bench: &mut Bench) -> Result<()> {
    for factor in [1e38, 1e45, 1e100] {
        let result = bench.bake_beyond_range(&with_intensity(glass_ball(3), factor), &SETTINGS())?;
        let mut values = result.maps.iter().flat_map(values);
        bench.must("every value is finite", values.all(|e| e.is_finite() && e >= 0.0));
        let is_named = result.warnings.iter().any(|warning| warning.location == "maps");
        bench.must("a warning counts the texels", is_named);
    }
    Ok(())
}

/// Lamps, tints and glass of which a colour is missing.
fn channel_zero(bench: &mut Bench) -> Result<()> {
    let red = LinearSrgb::new(1.0, 0.0, 0.0);
    let mut lit = glass_ball(3);
    lit.lights[0].colour = red;
    let mut tinted = glass_ball(3);
    tinted.materials[1].base_colour = red;
    let mut filled = glass_ball(3);
    filled.materials[1].volume = Some(Volume {
        attenuation_distance_m: 1e-3,
        attenuation_colour: LinearSrgb::new(1.0, 1e-30, 1e-30),
    });
    for scene in [lit, tinted, filled] {
        let result = bench.bake(&scene, &SETTINGS())?;
        let flux = result.maps.iter().map(|map| map.flux_w(LayerKind::Caustic));
        let sum = flux.fold(LinearSrgb::BLACK, |sum, flux| sum + flux);
        bench.must("the channel that is there arrives", sum.r > 0.0);
    }
    let mut lit = glass_ball(3);
    lit.lights[0].colour = red;
    let result = bench.bake(&lit, &SETTINGS())?;
    let others = result.maps.iter().map(|map| map.flux_w(LayerKind::Caustic));
    let others: f64 = others.map(|flux| flux.g.abs() + flux.b.abs()).sum();
    bench.law("nothing of the others, W", others, 0.0);
    Ok(())
}

/// A glass that resonates with visible light is refused; one that does just beyond is finite within.
fn resonance(bench: &mut Bench) -> Result<()> {
    for um in [0.4, 0.55, 0.7] {
        let text = format!("sellmeier:1.0,0,0,{},0.01,100", um * um);
        bench.must(
            "a resonance in visible light is refused",
            Glass::parse(&text).is_err(),
        );
    }
    // Just beyond what is visible, on both sides.
    let (first, last) = (VISIBLE.start().0, VISIBLE.end().0);
    for um in [1e-3 * (first - 1e-6), 1e-3 * (last + 1e-6)] {
        if let Ok(glass) = Glass::parse(&format!("sellmeier:0.5,1.0,0,{},0.01,100", um * um)) {
            let index = |step: u32| first + (last - first) * f64::from(step) / 100.0;
            let indices = (0..=100).map(|step| glass.dispersion.index(Nanometres(index(step))));
            bench.must("else indices are finite", indices.into_iter().all(f64::is_finite));
        }
    }
    Ok(())
}

fn surface_light(scene: &mut Scene, object: usize) {
    scene.lights.push(Light {
        name: "glow".into(),
        colour: LinearSrgb::WHITE,
        spectrum: None,
        kind: LightKind::Surface {
            object,
            radiance: Radiance(1.0),
        },
        size: LightSize::None,
    });
}

fn soft(side: usize) -> BakeSettings {
    BakeSettings {
        wavefronts: Some(8),
        layers: vec![LayerKind::Caustic, LayerKind::Direct],
        ..at(300.0, side)
    }
}

/// A glowing triangle without area gives nothing, alone or beside one that has an area.
fn glow_without_area(bench: &mut Bench) -> Result<()> {
    let mut scene = upright_mirror();
    scene.lights.clear();
    let nowhere = shapes::facet([DVec3::Y, DVec3::Y + DVec3::X * 0.1, DVec3::Y + DVec3::X * 0.2]);
    let mut mesh = nowhere;
    mesh.normals.fill(DVec3::NEG_Y);
    parts::add(
        &mut scene,
        "glow",
        mesh.clone(),
        parts::matte("glow", LinearSrgb::BLACK),
    );
    surface_light(&mut scene, 2);
    let result = bench.bake(&scene, &soft(16))?;
    bench.law("alone it gives nothing, W", deposited_w(&result), 0.0);
    let panel = shapes::floor([-0.1, 0.1], [-0.1, 0.1], 1.0);
    let mut alone = upright_mirror();
    alone.lights.clear();
    parts::add(
        &mut alone,
        "glow",
        panel.clone(),
        parts::matte("glow", LinearSrgb::BLACK),
    );
    surface_light(&mut alone, 2);
    shapes::append(&mut mesh, &panel);
    scene.objects[2].mesh = Arc::new(mesh);
    let (a, b) = (bench.bake(&alone, &soft(16))?, bench.bake(&scene, &soft(16))?);
    bench.law("beside a panel it changes nothing", apart(&b, &a), 1e-6);
    Ok(())
}

/// What glows lies on what it lights.
fn glow_on_receiver(bench: &mut Bench) -> Result<()> {
    let mut scene = upright_mirror();
    scene.lights.clear();
    let sheet = shapes::floor([-0.2, 0.2], [-0.2, 0.2], 0.0);
    parts::add(&mut scene, "glow", sheet, parts::matte("glow", LinearSrgb::BLACK));
    surface_light(&mut scene, 2);
    let result = bench.bake(&scene, &soft(16))?;
    // A surface sees at most half a sky of radiance 1.
    let brightest = result
        .maps
        .iter()
        .flat_map(|map| luminance(Some(map), LayerKind::Direct))
        .fold(0.0, f64::max);
    bench.law(
        "E is at most that of a whole sky, π",
        brightest,
        std::f64::consts::PI * (1.0 + 1e-6),
    );
    Ok(())
}

/// Under an even sky of radiance 1, clear glass and perfect mirrors change nothing for a surface that they do not
/// mirror: E is π.
fn furnace(bench: &mut Bench) -> Result<()> {
    let sky = Environment::new(4, 2, vec![[1.0; 3]; 8]);
    // What a mirror spreads takes dense rays to find so small a floor; what glass gathers takes many places of the sky.
    let tried = [
        (parts::mirror(), 5e3, 16),
        (parts::dielectric("glass", 1.5), 300.0, 64),
    ];
    for (material, density_per_sr, wavefronts) in tried {
        let mut scene = Scene::default();
        let floor = shapes::floor([-0.02, 0.02], [-0.02, 0.02], 0.0);
        parts::add(
            &mut scene,
            "floor",
            floor,
            parts::matte("floor", LinearSrgb::BLACK),
        );
        parts::add(&mut scene, "ball", shapes::sphere(DVec3::Y, 0.4, 2), material);
        scene.environment = sky.clone().map(Arc::new);
        scene.lights.push(Light {
            name: "sky".into(),
            colour: LinearSrgb::WHITE,
            spectrum: None,
            kind: LightKind::Environment { scale: 1.0 },
            size: LightSize::None,
        });
        let settings = BakeSettings {
            wavefronts: Some(wavefronts),
            layers: vec![LayerKind::Caustic, LayerKind::Direct],
            branch_threshold: Some(1e-6),
            ..at(density_per_sr, 1)
        };
        let result = bench.bake(&scene, &settings)?;
        let e: f64 = result
            .maps
            .iter()
            .filter(|map| map.chart.receiver.side() == crate::illumination::Side::Front)
            .map(|map| {
                luminance(Some(map), LayerKind::Caustic)[0] + luminance(Some(map), LayerKind::Direct)[0]
            })
            .sum();
        bench.law(
            "E is π under an even sky",
            (e / std::f64::consts::PI - 1.0).abs(),
            0.05,
        );
    }
    Ok(())
}

/// The eye in the lamp, on glass, and on the floor: every pixel is finite.
fn lamp_at_the_eye(bench: &mut Bench) -> Result<()> {
    let mut scene = glass_ball(3);
    for eye in [
        DVec3::new(0.1, 2.0, 0.05),
        DVec3::new(0.0, 0.8, 0.0),
        DVec3::new(0.0, 0.5, 0.0),
        DVec3::new(0.2, 0.0, 0.2),
    ] {
        scene.cameras[0] = crate::scene::Camera::look_at("camera", eye, DVec3::new(0.1, -1.0, 0.05), 0.9);
        let result = bench.bake(&scene, &SETTINGS())?;
        let tracer = Tracer::new(Arc::new(scene.clone()));
        let view = View {
            camera: scene.cameras[0].clone(),
            width: 24,
            height: 16,
            exposure_stops: 0.0,
            tone_map: ToneMap::default(),
            background: LinearSrgb::BLACK,
        };
        let picture = render(
            &tracer,
            &result.maps,
            &view,
            &ReferenceSettings::default(),
            &(),
            &Default::default(),
        );
        let is_finite =
            picture.is_ok_and(|picture| picture.radiance.iter().flatten().all(|value| value.is_finite()));
        bench.must("every pixel is finite", is_finite);
    }
    Ok(())
}
