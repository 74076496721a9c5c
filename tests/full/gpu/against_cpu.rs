//! The device's pictures against the CPU's: channel by channel where both do the same, by laws of chains, and where
//! rounding turns chains at outlines.

use nephroid::eye_pass::reference::ReferenceSettings;
use nephroid::illumination::Chart;
use nephroid::illumination::lookup::in_chart;
use nephroid::illumination::tiles::{self, COARSEST, TileLayout};
use nephroid::scene::{AlphaMask, Environment, NormalMap, Variation};

use crate::gpu::rig::{AS_CPU, Rig, or_skip};
use support::chain_laws;
use support::floors::{
    diffuse, floor, floor_map, floor_scene, four_colours, from_above, image, lambert, texture_reference,
};
use support::meshes::quad;
use support::prelude::*;
use support::scenes::{
    bits, lamps_of_all_kinds, let_glow, light, limited, map_of, middles, seen, under_sky, view,
};

/// Rounding of one half float; the map and the picture are one each.
const HALF: f64 = 1.0 / 2048.0;

/// A picture, and how far channels may be off: by a share of themselves or of so much of the brightest one, on no more
/// than a share of the pixels.
struct Case {
    name: &'static str,
    scene: Scene,
    maps: Vec<IlluminationMap>,
    view: View,
    tolerance: f64,
    of_peak: f64,
    few: f64,
}

fn case(name: &'static str, scene: Scene, maps: Vec<IlluminationMap>, size: u32) -> Case {
    Case {
        name,
        scene,
        maps,
        view: from_above(size),
        tolerance: 2.0 * HALF,
        of_peak: 0.0,
        few: 0.0,
    }
}

/// A white floor with this map; samplers weigh in steps of 1/256 of the difference of neighbours.
fn sampled(name: &'static str, map: IlluminationMap, size: u32) -> Case {
    Case {
        tolerance: 1.57e-3,
        of_peak: 1.0,
        ..case(name, floor_scene(diffuse(LinearSrgb::WHITE)), vec![map], size)
    }
}

fn on_cpu(case: &Case, samples_per_side: u32) -> Picture {
    let settings = ReferenceSettings {
        samples_per_side,
        ..limited(|limits| (limits.branching_depth, limits.every_facet) = (AS_CPU.branching_depth, true))
    };
    let tracer = Tracer::new(Arc::new(case.scene.clone()));
    seen(&tracer, &case.maps, &case.view, &settings).0
}

/// Share of the pixels that are off.
fn off(case: &Case, found: &Picture, expected: &Picture) -> f64 {
    let peak = expected.radiance.iter().flatten().fold(0.0_f32, |a, b| a.max(*b));
    let is_off = |(a, b): (&f32, &f32)| {
        f64::from((a - b).abs()) > case.tolerance * f64::from(b.max(case.of_peak as f32 * peak))
    };
    let pixels = found.radiance.iter().zip(&expected.radiance);
    let off = pixels.filter(|(a, b)| a.iter().zip(*b).any(is_off)).count();
    off as f64 / found.radiance.len() as f64
}

const ALBEDO: LinearSrgb = rgb(0.8, 0.5, 0.25);

fn even(irradiance: [f32; 3]) -> Vec<IlluminationMap> {
    vec![floor_map(0, 1, 1, vec![irradiance])]
}

/// A lit floor below a sheet at a height.
fn under(name: &'static str, surface: SurfaceKind, base_colour: LinearSrgb, height_m: f64) -> Case {
    let mut scene = floor_scene(diffuse(ALBEDO));
    scene.materials.push(Material {
        surface,
        base_colour,
        metallic: if surface == SurfaceKind::Mirror { 1.0 } else { 0.0 },
        roughness: 0.0,
        ..Default::default()
    });
    scene.objects.push(floor("sheet", 1, height_m));
    let mut case = case(name, scene, even([3.0, 2.0, 1.0]), 65);
    case.view.background = rgb(0.5, 0.25, 2.0);
    case.tolerance = 4.0 * HALF;
    case
}

/// Texels of which none repeats, other ones in every channel.
fn noise(count: usize) -> Vec<[f32; 3]> {
    let value = |step: usize| ((step % 1009) as f32 / 1009.0).powi(2);
    let texel = |index: usize| [7919, 6271, 4799].map(|step| value(index * step));
    (0..count).map(texel).collect()
}

/// Surfaces whose light ends at the first one, or at known ones after it.
fn floors() -> Vec<Case> {
    use SurfaceKind::{Dielectric, Mirror, ThinWall};
    let white = LinearSrgb::WHITE;
    // A width whose rows are no multiple of the copy's alignment.
    let mut empty = case("nothing", Scene::default(), vec![], 1);
    (empty.view.width, empty.view.height) = (7, 3);
    empty.view.background = rgb(0.25, 3.0, 1e5);

    empty.tolerance = HALF;

    let floor_of_albedo = || floor_scene(diffuse(ALBEDO));
    let lit = case("lit floor", floor_of_albedo(), even([3.0, 1.0, 0.125]), 16);

    let mut two_layers = floor_map(0, 3, 5, noise(15));
    let mut layer = two_layers.layers[0].clone();
    layer.kind = LayerKind::Direct;
    layer.irradiance.reverse();
    two_layers.layers.push(layer);
    let layers = sampled("layers", two_layers, 32);
    // Three tiles across and down, the last ones of a single texel; several pixels for each texel.
    let tiles = floor_map(0, 129, 129, noise(129 * 129));
    let borders = sampled("borders of tiles", tiles, 500);

    let mut painted = floor_scene(Material {
        base_colour_texture: Some(texture_reference()),
        ..diffuse(ALBEDO)
    });
    painted.textures.push(four_colours().into());
    let image = case("image", painted, even([3.0, 2.0, 1.0]), 8);

    // An unlit floor half below one that glows.
    let mut glow = floor_scene(diffuse(white));
    let glowing = Material {
        emitted_radiance: rgb(2.0, 0.0, 7.0),
        ..diffuse(white)
    };
    let lamp = shapes::floor([0.0, 0.5], [0.0, 1.0], 0.1);
    parts::add(&mut glow, "lamp", lamp, glowing);
    let mut emission = case("emission", glow, vec![], 8);
    emission.tolerance = HALF;

    let hidden = [[0.0, 1e-4], [1e-4, 0.0]].map(|heights| {
        let mut scene = floor_scene(diffuse(white));
        scene.objects = heights.map(|height| floor("floor", 0, height)).to_vec();
        let dim = |object: usize| if heights[object] > 0.0 { 1.0 } else { 0.25 };
        let map = |object| floor_map(object, 1, 1, vec![[3.0, 2.0, 1.0].map(|e| e * dim(object))]);
        case("one floor hides another", scene, vec![map(0), map(1)], 8)
    });

    let metal = rgb(0.75, 0.5, 0.9);
    let pane = under("pane", ThinWall, ALBEDO, 0.5);
    let glass = under("sheet of glass", Dielectric, white, 0.5);
    let mut sky = under("mirror under the background", Mirror, metal, 0.5);
    sky.tolerance = 2.0 * HALF;
    let nearly_white = rgb(1.0, 1.0, 1.0 - 1e-7);
    let mut tinted = under("nearly white", Dielectric, nearly_white, 0.5);
    tinted.view.camera.vertical_fov_rad = 2.5;

    // Up to a mirror: its image of the floor, 3 m away and 1 m wide, is the whole picture.
    let mut image_of = under("mirror over a bright quarter", Mirror, metal, 2.0);
    let quarter = vec![[0.0; 3], [0.0; 3], [0.0; 3], [4.0, 2.0, 1.0]];
    image_of.maps = vec![floor_map(0, 2, 2, quarter)];
    let camera = &mut image_of.view.camera;
    (camera.forward, camera.up) = (DVec3::Y, DVec3::Z);
    camera.vertical_fov_rad = 2.0 * (0.5_f64 / 3.0).atan();
    (image_of.tolerance, image_of.of_peak) = (0.013, 1.0);
    let mut cases = vec![
        empty, lit, layers, borders, image, emission, pane, glass, sky, tinted, image_of,
    ];
    cases.extend(hidden);
    cases
}

/// Sheets with holes over a lit floor or a mirror that shows their undersides: by a texture, everywhere, nowhere.
fn masks() -> Vec<Case> {
    let mut holes = four_colours();
    holes.rgba[1][3] = 0;
    holes.rgba[2][3] = 120;
    let mut cases = Vec::new();
    for (below, surface, factor) in [
        (SurfaceKind::Diffuse, SurfaceKind::Diffuse, 0.9),
        (SurfaceKind::Diffuse, SurfaceKind::Mirror, 1.0),
        (SurfaceKind::Mirror, SurfaceKind::Diffuse, 1.0),
        (SurfaceKind::Mirror, SurfaceKind::Diffuse, 0.4),
    ] {
        let mut case = under("sheet with holes", surface, LinearSrgb::WHITE, 0.5);
        (case.scene.materials[0].surface, case.scene.materials[0].roughness) = (below, 0.0);
        case.scene.textures.push(holes.clone().into());
        let sheet = &mut case.scene.materials[1];
        (sheet.base_colour_texture, sheet.double_sided) = (Some(texture_reference()), true);
        sheet.alpha_mask = Some(AlphaMask { cutoff: 0.5, factor });
        sheet.emitted_radiance = rgb(0.1, 0.4, 0.2);
        if below == SurfaceKind::Mirror {
            case.maps.clear();
        }
        // From one side, so that undersides are seen in the mirror.
        case.view = view(dvec3(0.2, 1.3, 1.6), dvec3(0.5, 0.2, 0.5), 1.0, [120, 80]);
        case.view.background = rgb(0.5, 0.25, 2.0);
        (case.of_peak, case.few) = (0.01, 0.004);
        cases.push(case);
    }
    cases
}

/// Sheets that are metal, clear, coated or not there from place to place, over a lit floor, and lit themselves.
fn mixtures() -> Vec<Case> {
    let mut image = four_colours();
    image.rgba[1][3] = 120;
    let of = |(transmission, coverage): (f64, Option<f64>)| {
        let mut case = under("mixture", SurfaceKind::Varied, rgb(0.9, 0.6, 0.3), 0.5);
        case.scene.textures.push(image.clone().into());
        let sheet = &mut case.scene.materials[1];
        (sheet.metallic, sheet.roughness) = (1.0, 0.25);
        (sheet.transmission, sheet.coverage) = (transmission, coverage);
        sheet.base_colour_texture = coverage.map(|_| texture_reference());
        sheet.variation = Some(Variation {
            image: texture_reference(),
            surface: SurfaceKind::Varied,
        });
        case.maps.push(floor_map(1, 1, 1, vec![[2.0, 1.0, 4.0]]));
        // Each of 64 rays of a pixel may turn at an outline.
        (case.of_peak, case.few) = (0.01, 0.02);
        case
    };
    [(0.8, None), (0.0, Some(0.7))].into_iter().map(of).collect()
}

/// A bumpy floor under lamps and a sky, bare, coated and below a pane: lit, half in shadow, and with light to spare.
fn reliefs() -> Vec<Case> {
    let codes = [
        [128, 128, 255, 255],
        [200, 90, 220, 255],
        [60, 140, 200, 255],
        [120, 210, 160, 255],
    ];
    let image = image(2, codes.to_vec(), Wrap::MirroredRepeat);
    let sky = Environment::new(
        2,
        2,
        vec![[1.0, 2.0, 4.0], [2.0, 2.0, 2.0], [0.1, 0.2, 0.0], [0.0; 3]],
    );
    let lamps = [
        LightKind::Environment { scale: 0.5 },
        LightKind::Point {
            // Out of view: seen through the pane it would be far brighter than the relief.
            position: dvec3(1.3, 0.4, 0.6),
            intensity: RadiantIntensity(1.0),
        },
        LightKind::Sun {
            direction: dvec3(0.8, -0.6, 0.0),
            normal_irradiance: Irradiance(3.0),
        },
    ];
    let of = |(surface, share): (SurfaceKind, f32)| {
        let mut case = under("relief", SurfaceKind::ThinWall, ALBEDO, 0.5);
        if surface == SurfaceKind::Coated {
            case.scene.objects.pop();
        }
        let scene = &mut case.scene;
        scene.textures.push(image.clone().into());
        scene.environment = sky.clone().map(Arc::new);
        scene.lights = lamps.map(light).to_vec();
        let normals = NormalMap::new(texture_reference(), 0.7, &image);
        (scene.materials[0].surface, scene.materials[0].normal_map) = (surface, normals);
        // Images of the lamps in a smooth coat would be far brighter than the relief.
        scene.materials[0].roughness = 0.3;
        case.maps = even([6.0, 5.0, 7.0].map(|e| e * share));
        (case.tolerance, case.of_peak, case.few) = (0.004, 0.05, 0.01);
        case
    };
    let shares = [0.1, 0.6, 2.0];
    let kinds = [SurfaceKind::Diffuse, SurfaceKind::Coated];
    kinds
        .into_iter()
        .flat_map(|kind| shares.map(|share| of((kind, share))))
        .collect()
}

/// Lamps of all kinds in a smooth or a rough coloured mirror, a mirror ball and a glass ball; the balls' outlines differ.
fn highlights() -> Vec<Case> {
    let of = |roughness: f64| {
        let mut mirror = parts::mirror();
        (mirror.base_colour, mirror.roughness) = (ALBEDO, roughness);
        let mut scene = floor_scene(mirror);
        let ball = |x: f64| shapes::sphere(dvec3(x, 0.12, 0.6), 0.1, 4);
        parts::add(&mut scene, "mirror", ball(0.3), parts::mirror());
        parts::add(&mut scene, "glass", ball(0.75), parts::dielectric("glass", 1.5));
        for (lamp, x) in [0.2, 0.4, 0.6, 0.8].into_iter().enumerate() {
            scene
                .lights
                .push(lamps_of_all_kinds(dvec3(x, 0.7, -0.3)).swap_remove(lamp));
        }
        let mut case = case("highlights", scene, vec![], 1);
        let (eye, target) = (dvec3(0.5, 0.6, 1.7), dvec3(0.5, 0.0, 0.5));
        case.view = view(eye, target, 0.6, [120, 80]);
        case.view.background = rgb(0.2, 0.1, 0.4);
        (case.tolerance, case.of_peak, case.few) = (0.01, 0.003, 0.02);
        case
    };
    let mut cases: Vec<Case> = [0.0, 0.2, 0.5].map(of).into();

    // The lamps themselves: two in front of the floor, one behind a ball, and the sun beyond all.
    let mut case = of(0.0);
    case.view = View {
        background: case.view.background,
        ..view(dvec3(0.5, 0.2, 1.7), dvec3(0.5, 0.45, 0.0), 0.9, [120, 80])
    };
    cases.push(case);

    // A glossy floor below a glowing sheet, and below a glowing ball.
    for (name, shape) in [
        (
            "sheet",
            quad(dvec3(0.4, 0.7, -0.4), DVec3::X * 0.2, DVec3::Z * 0.15),
        ),
        ("bulb", shapes::sphere(dvec3(0.5, 0.7, -0.3), 0.05, 3)),
    ] {
        let mut case = of(0.5);
        let glowing = with(Material::default(), |it| {
            it.emitted_radiance = LinearSrgb::grey(90.0)
        });
        let scene = &mut case.scene;
        scene.lights.clear();
        let coat = with(diffuse(ALBEDO), |it| it.roughness = 0.5);
        scene.materials[0] = coat;
        parts::add(scene, name, shape, glowing);
        let_glow(scene, 3, None);
        case.maps = even([3.0, 2.0, 1.0]);
        cases.push(case);
    }

    // A rough mirror under a sky with a sun in it.
    let mut pixels = vec![[0.5, 0.7, 1.0]; 64 * 32];
    pixels[12 * 64 + 5] = [2e4; 3];
    let mut case = of(0.5);
    case.scene = under_sky(case.scene, Environment::new(64, 32, pixels), 1.5);
    cases.push(case);
    cases
}

/// A mirror ball and a glass ball over a dark floor, the sky ahead, and back over the seam of its image with the pole in
/// view; channels that end at the balls' outlines, or go on over many surfaces, may differ.
fn skies() -> Vec<Case> {
    let gradient = |width: usize, height: usize| {
        let at = |index: usize, size: usize| index as f32 / size as f32;
        let pixel = |index: usize| {
            let (x, y) = (at(index % width, width), at(index / width, height));
            [0.2 + x, 1.2 - x, 2.0 * (1.0 - y) + 0.1]
        };
        let pixels = (0..width * height).map(pixel).collect();
        Environment::new(width, height, pixels)
    };
    let mut cases = Vec::new();
    for (width, height) in [(64, 32), (1, 1), (7, 3)] {
        let mut scene = floor_scene(diffuse(LinearSrgb::grey(0.1)));
        let ball = |x: f64| shapes::sphere(dvec3(x, 0.3, 0.5), 0.2, 4);
        parts::add(&mut scene, "mirror", ball(0.3), parts::mirror());
        parts::add(&mut scene, "glass", ball(0.75), parts::dielectric("glass", 1.5));
        let mut scene = under_sky(scene, gradient(width, height), 1.5);
        scene.lights[0].colour = rgb(1.0, 0.5, 2.0);
        for target in [[0.5, 0.3, 0.5], [0.4, 2.5, 1.9], [1.5, 0.2, 2.0]] {
            let eye = dvec3(0.5, 0.6, 1.7);
            cases.push(Case {
                view: view(eye, target.into(), 1.0, [120, 80]),
                tolerance: 0.01,
                of_peak: 0.2,
                few: 0.01,
                ..case("sky", scene.clone(), vec![], 1)
            });
        }
    }
    cases
}

#[test]
fn device_shows_what_the_cpu_shows() {
    let mut faults = Vec::new();
    for case in floors()
        .iter()
        .chain(&masks())
        .chain(&mixtures())
        .chain(&reliefs())
        .chain(&highlights())
        .chain(&skies())
    {
        let mut rig = or_skip!(Rig::at(AS_CPU, &case.scene, &case.maps));
        // Means of several places too, where the picture is small.
        let sides: &[u32] = if case.view.width < 100 { &[1, 3] } else { &[1] };
        for side in sides {
            let (found, expected) = (rig.sampled(&case.view, *side), on_cpu(case, *side));
            // The comparison sees colours that have changed places.
            let mut turned = found.clone();
            turned.radiance.iter_mut().for_each(|pixel| pixel.rotate_left(1));
            let [share, turned] = [&found, &turned].map(|picture| off(case, picture, &expected));
            if share > case.few || turned < 0.05 {
                faults.push(format!("{}, {side}: {share}, turned {turned}", case.name));
            }
        }
    }
    assert!(faults.is_empty(), "{faults:#?}");
}

#[test]
fn relief_is_seen_on_diffuse_surfaces() {
    for mut case in reliefs() {
        let bumpy = on_cpu(&case, 1);
        case.scene.materials[0].normal_map = None;
        let share = off(&case, &on_cpu(&case, 1), &bumpy);
        assert!(share > 0.5, "{share}");
    }
}

/// The sky is not traced, and what the lamp adds is too little to be seen.
#[test]
fn relief_stays_while_lights_are_traced() {
    let mut case = reliefs().swap_remove(0);
    case.scene.objects.pop();
    case.scene.lights = vec![
        light(LightKind::Environment { scale: 0.5 }),
        light(LightKind::Point {
            position: dvec3(0.3, 0.4, 0.6),
            intensity: RadiantIntensity(1e-9),
        }),
    ];
    let mut rig = or_skip!(Rig::at(AS_CPU, &case.scene, &case.maps));
    let baked = rig.picture(&case.view);
    rig.renderer.set_traces_lights(true);
    let share = off(&case, &baked, &rig.picture(&case.view));
    assert!(share < case.few, "{share}");
}

#[test]
fn chains_keep_to_their_laws() {
    for law in chain_laws::all() {
        let mut rig = or_skip!(Rig::new(&law.scene, &[]));
        law.assert_kept(&rig.picture(&law.view), 2.0 * HALF + law.left_out);
    }
}

#[test]
fn peaks_and_what_is_dim_beside_them_survive() {
    let scene = floor_scene(diffuse(LinearSrgb::WHITE));
    let maps = [floor_map(0, 2, 1, vec![[1e6, 2e6, 3e6], [0.5, 0.25, 1.0]])];
    let mut rig = or_skip!(Rig::new(&scene, &maps));
    let picture = rig.picture(&from_above(8));
    // Outermost pixels lie beyond the texel centres, where nothing is interpolated.
    for (pixel, expected) in [(0, [1e6, 2e6, 3e6]), (7, [0.5, 0.25, 1.0])] {
        for (found, e) in picture.radiance[pixel].into_iter().zip(expected) {
            assert!((f64::from(found) / lambert(1.0, e) - 1.0).abs() <= 2.0 * HALF);
        }
    }
}

#[test]
fn sun_in_a_sky_leaves_surfaces_their_digits() {
    let mut pixels = vec![[0.5_f32; 3]; 32 * 16];
    pixels[3 * 32 + 17] = [1e9; 3];
    let mut scene = under_sky(skies().remove(0).scene, Environment::new(32, 16, pixels), 1.0);
    scene.materials[0].emitted_radiance = LinearSrgb::grey(0.25);
    let mut rig = or_skip!(Rig::new(&scene, &[]));
    let view = view(dvec3(0.5, 0.6, 1.7), dvec3(0.5, 0.0, 0.9), 1.0, [120, 80]);
    let found = rig.picture(&view);
    let floor = found.radiance[40 * 120 + 60];
    assert!((floor[0] / 0.25 - 1.0).abs() < 1e-3, "{floor:?}");
    assert!(found.radiance.iter().flatten().all(|channel| channel.is_finite()));
}

const SIDE: usize = 512;

/// Fine around one tile, coarser from tile to tile.
fn tiled() -> IlluminationMap {
    let (columns, rows) = tiles::tile_counts(SIDE, SIDE);
    let mut levels = vec![COARSEST; columns * rows];
    levels[2 * columns + 2] = 0;
    tiles::balance(&mut levels, columns);
    let layout = TileLayout::new((SIDE, SIDE), &levels, &levels);
    let (mut values, mut texel_areas_m2) = (Vec::new(), Vec::new());
    for tile in layout.tiles() {
        let side = f64::from(1_u32 << tile.level);
        let origin = dvec2(tile.origin.0 as f64, tile.origin.1 as f64);
        for index in 0..tile.texels.len() {
            let texel = dvec2((index % tile.size.0) as f64, (index / tile.size.0) as f64);
            let uv = (origin + (texel + 0.5) * side) / SIDE as f64;
            let value = (1.0 + 0.5 * (4.0 * uv.x).cos() * (3.0 * uv.y).sin()) as f32;
            values.push([value, 0.5 * value, 2.0 * value]);
            texel_areas_m2.push(side * side / (SIDE * SIDE) as f64);
        }
    }
    let chart = Chart {
        texel_areas_m2,
        layout: Some(Arc::new(layout)),
        ..Chart::clone(&floor_map(0, SIDE, SIDE, Vec::new()).chart)
    };
    map_of(chart, values)
}

#[test]
fn maps_in_tiles_look_the_same_in_less_memory() {
    let (map, scene) = (tiled(), floor_scene(diffuse(LinearSrgb::WHITE)));
    let mut rig = or_skip!(Rig::at(AS_CPU, &scene, std::slice::from_ref(&map)));
    let picture = rig.picture(&from_above(2 * SIDE as u32));
    let values = &map.layers[0].irradiance;
    let (mut worst, mut sum) = (0.0_f64, 0.0);
    for (found, uv) in picture.radiance.iter().zip(middles(2 * SIDE)) {
        let expected = in_chart(&map.chart, values, uv).to_array();
        for (found, expected) in found.iter().zip(expected) {
            let off = (f64::from(*found) / lambert(1.0, expected) - 1.0).abs();
            worst = worst.max(off);
            sum += off;
        }
    }
    let mean = sum / (3 * picture.radiance.len()) as f64;
    // Beside coarser tiles the CPU looks at their texels as they are, the device between them.
    assert!(worst < 0.08 && mean < 2e-3, "worst {worst}, mean {mean}");

    let tiled_bytes = rig.renderer.counts().map_bytes;
    rig.set_maps(&[map.dense().into_owned()]);
    let dense_bytes = rig.renderer.counts().map_bytes;
    assert!(tiled_bytes > 0 && 4 * tiled_bytes < dense_bytes, "{tiled_bytes}");
}

#[test]
fn scene_without_a_sky_has_none_on_the_device() {
    use nephroid::eye_pass::renderer::MapStyle;
    let mut case = skies().swap_remove(0);
    case.view.background = LinearSrgb::grey(9.0);
    let mut rig = or_skip!(Rig::new(&case.scene, &[]));
    rig.picture(&case.view);
    assert_eq!(rig.renderer.counts().sky_bytes, 64 * 32 * 16);
    // Colours of maps are shown before a plain background.
    rig.renderer.set_map_style(MapStyle::AsItIs);
    assert_eq!(rig.picture(&case.view).radiance[0], [9.0; 3]);
    rig.renderer.set_map_style(MapStyle::Lit);
    case.scene.environment = None;
    case.scene.lights.clear();
    rig.set_scene(&case.scene);
    let plain = rig.picture(&case.view);
    assert_eq!(
        (rig.renderer.counts().sky_bytes, plain.radiance[0]),
        (0, [9.0; 3])
    );
    assert!(bits(&plain) == bits(&rig.fresh(&case.view)));
}
