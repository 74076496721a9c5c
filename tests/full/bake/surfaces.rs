//! Receivers of every shape: bent ones, ones cut into charts, both sides of sheets, masks; and waves that only bend
//! normals, against the same waves as a shape.

use nephroid::effect::{Effect, EffectSwitch, EffectSwitches};
use nephroid::illumination::lookup::bilinear;
use nephroid::illumination::parametrisation::coverage::{for_each_texel_in_row, rows};
use nephroid::illumination::{Chart, Side, UvSet};
use nephroid::scene::builtin::pool::{AMPLITUDE_M, bumped, displaced, meshed};
use nephroid::scene::{Adjacency, AlphaMask};

use crate::bake::common::{
    CAUSTIC_AND_DIRECT, all_bits, estimate, floor, rmse, run, session, sized, with_layers,
};
use support::effect_scenes::{by_image, by_waves};
use support::floors::{image, texture_reference};
use support::meshes::inside_out;
use support::prelude::*;
use support::scenes::wave;
use support::tools::{bake, builtin_scene, caustic, energy_fault, map_of, set, settings, to};

/// 1 W/sr.
const POWER: Flux = Flux(4.0 * PI);

const LAMP: DVec3 = dvec3(-0.3, 1.4, -0.2);

/// Half a side of the mirror, which lies in y = 0 [m].
const MIRROR_M: f64 = 2.5;

/// A lamp above a mirror, and something that takes the light from below.
fn scene_with(receiver: Mesh) -> Scene {
    let mut scene = Scene::default();
    let extent = [-MIRROR_M, MIRROR_M];
    let white = Material {
        base_colour: LinearSrgb::WHITE,
        ..parts::mirror()
    };
    parts::add(&mut scene, "mirror", shapes::floor(extent, extent, 0.0), white);
    let grey = parts::matte("grey", LinearSrgb::grey(0.5));
    parts::add(&mut scene, "receiver", receiver, grey);
    scene.lights.push(parts::point_light("lamp", LAMP, POWER));
    scene.name = "virtual_lamp".into();
    scene
}

/// E [W/m²] of the lamp's image in the mirror at a point of a facet.
fn virtual_irradiance(tracer: &Tracer, point: DVec3, normal: DVec3) -> f64 {
    let image = LAMP * dvec3(1.0, -1.0, 1.0);
    let way = point - image;
    let cosine = -way.normalize().dot(normal);
    let on_mirror = image + way * (image.y / (image.y - point.y));
    if cosine <= 0.0 || on_mirror.x.abs().max(on_mirror.z.abs()) > MIRROR_M {
        return 0.0;
    }
    let is_free = |from: DVec3, to: DVec3| {
        let direction = (to - from).normalize();
        let distance_m = from.distance(to) - 1e-6;
        let origin = from + direction * 1e-7;
        !tracer.is_blocked(&Ray { origin, direction }, distance_m)
    };
    if is_free(LAMP, on_mirror) && is_free(on_mirror + DVec3::Y * 1e-7, point) {
        cosine / way.length_squared()
    } else {
        0.0
    }
}

/// Samples across and down a texel.
const SAMPLES: usize = 4;

/// Means over the texels of a chart of what a function says of points and unit normals of facets.
fn texel_means(chart: &Chart, mesh: &Mesh, value: impl Fn(DVec3, DVec3) -> f64) -> Vec<f64> {
    let (width, height) = (chart.width, chart.height);
    let size = dvec2(width as f64, height as f64);
    let mut sums = vec![(0.0, 0.0); width * height];
    for (triangle, uvs) in chart.corner_uvs.iter().enumerate() {
        let [a, b, c] = uvs.map(|uv| uv * size);
        let twice = (b - a).perp_dot(c - a);
        let corners = mesh.corners(triangle);
        let normal = mesh.face_normal(triangle) * chart.receiver.side().sign();
        let area_m2 = 0.5 * (corners[1] - corners[0]).cross(corners[2] - corners[0]).length();
        let weight = area_m2 / twice.abs();
        let mut add = |texel: usize, place: DVec2| {
            let second = (place - a).perp_dot(c - a) / twice;
            let third = (b - a).perp_dot(place - a) / twice;
            let point = corners[0] * (1.0 - second - third) + corners[1] * second + corners[2] * third;
            sums[texel].0 += weight * value(point, normal);
            sums[texel].1 += weight;
        };
        for row in rows([a, b, c], height) {
            for_each_texel_in_row([a, b, c], row, width, |column, part| {
                let corner = dvec2(column as f64, row as f64);
                let texel = row * width + column;
                let mut found = false;
                for index in 0..SAMPLES * SAMPLES {
                    let step = dvec2((index % SAMPLES) as f64, (index / SAMPLES) as f64) + 0.5;
                    let place = corner + step / SAMPLES as f64 + dvec2(0.6e-6, 1.1e-6);
                    if part.contains(place) {
                        add(texel, place);
                        found = true;
                    }
                }
                if !found {
                    // A sliver; its middle stands for it, by its share of a sample.
                    add(texel, part.centroid());
                }
            });
        }
    }
    sums.iter()
        .map(|(sum, weight)| if *weight > 0.0 { sum / weight } else { 0.0 })
        .collect()
}

/// Root mean square of the difference over the mean, by area.
fn relative_rmse(map: &IlluminationMap, expected: &[f64]) -> f64 {
    let (mut squares, mut sum, mut area_m2) = (0.0, 0.0, 0.0);
    for (texel, (value, truth)) in caustic(map).iter().zip(expected).enumerate() {
        let texel_m2 = map.chart.texel_area_m2(texel);
        squares += (value - truth).powi(2) * texel_m2;
        sum += truth * texel_m2;
        area_m2 += texel_m2;
    }
    (squares * area_m2).sqrt() / sum
}

/// Steps of the map across its seams where the surface is lit: over the local value, and that value.
fn seam_steps(map: &IlluminationMap, mesh: &Mesh, is_lit: impl Fn(DVec3, DVec3) -> bool) -> Vec<(f64, f64)> {
    let values = &map.layer(LayerKind::Caustic).expect("a caustic layer").irradiance;
    let look = |uv: DVec2| bilinear(values, map.width(), map.height(), uv).luminance();
    let adjacency = Adjacency::of(mesh);
    let uvs = &map.chart.corner_uvs;
    let mut steps = Vec::new();
    for (triangle, edge) in
        (0..mesh.triangles.len()).flat_map(|triangle| [0, 1, 2].map(|edge| (triangle, edge)))
    {
        let beyond = adjacency.beyond(triangle, edge);
        let Some((beyond, back)) = beyond.filter(|(other, _)| *other > triangle) else {
            continue;
        };
        let [here, next] = [edge, (edge + 1) % 3];
        let ends = [(here, (back + 1) % 3), (next, back)];
        let ends = ends.map(|(here, there)| (uvs[triangle][here], uvs[beyond][there]));
        let is_seam = ends.iter().any(|(here, there)| here.distance(*there) >= 1e-9);
        let corners = mesh.corners(triangle);
        let normals = [triangle, beyond].map(|triangle| mesh.face_normal(triangle));
        let is_smooth = normals[0].dot(normals[1]) >= 0.99;
        if !is_seam || !is_smooth || !is_lit(corners[here].lerp(corners[next], 0.5), normals[0]) {
            continue;
        }
        for share in [0.25, 0.5, 0.75] {
            let [a, b] = [
                look(ends[0].0.lerp(ends[1].0, share)),
                look(ends[0].1.lerp(ends[1].1, share)),
            ];
            steps.push(((a - b).abs() / (0.5 * (a + b)), 0.5 * (a + b)));
        }
    }
    steps
}

/// A sheet with coordinates that stretch: the poles of a ball take whole rows.
fn stretched(columns: u32, rows: u32, surface: impl Fn(f64, f64) -> (DVec3, DVec3)) -> Mesh {
    let mut mesh = shapes::sheet(columns, rows, surface);
    let stretch = |index: u32| {
        let (u, v) = (
            f64::from(index % (columns + 1)) / f64::from(columns),
            f64::from(index / (columns + 1)) / f64::from(rows),
        );
        dvec2(u + 0.04 * (TAU * u).sin(), 0.7 * v + 0.3 * v * v)
    };
    let uvs = (0..(columns + 1) * (rows + 1)).map(stretch).collect();
    mesh.uv0 = Some(uvs);
    mesh
}

const MIDDLE: DVec3 = dvec3(0.35, 0.8, 0.25);

fn ball() -> Mesh {
    stretched(192, 96, |u, v| {
        let (sine, cosine) = (PI * v).sin_cos();
        let around = DVec2::from_angle(TAU * u);
        let normal = dvec3(around.x * sine, cosine, around.y * sine);
        (MIDDLE + normal * 0.3, normal)
    })
}

fn cylinder() -> Mesh {
    let (axis, x) = (
        dvec3(1.0, 0.4, 0.2).normalize(),
        dvec3(-0.4, 1.0, 0.0).normalize(),
    );
    let y = axis.cross(x).normalize();
    let x = y.cross(axis);
    // The seam lies below, in the light.
    let (x, y) = (-x, -y);
    stretched(192, 48, |u, v| {
        let around = DVec2::from_angle(TAU * u);
        let normal = x * around.x + y * around.y;
        (MIDDLE + normal * 0.2 + axis * (0.7 * (v - 0.5)), normal)
    })
}

fn torus() -> Mesh {
    stretched(192, 96, |u, v| {
        let around = DVec2::from_angle(TAU * u);
        let across = DVec2::from_angle(TAU * v);
        let out = dvec3(around.x, 0.3 * around.x, around.y).normalize();
        let up = out.cross(dvec3(-around.y, -0.3 * around.y, around.x)).normalize();
        let normal = out * across.x + up * across.y;
        (MIDDLE + out * 0.3 + normal * 0.12, normal)
    })
}

/// With coordinates of its own, and unwrapped.
fn check_bent(name: &str, mesh: Mesh) {
    let bare = Mesh {
        uv0: None,
        ..mesh.clone()
    };
    for (mesh, set, side) in [(mesh, UvSet::TexCoord0, 192), (bare, UvSet::Generated, 384)] {
        let scene = scene_with(mesh.clone());
        let result = bake(scene.clone(), &to(0.005, side));
        assert_eq!(energy_fault(&result), None, "{name}, {set:?}");
        let map = map_of(&result, &scene, "receiver");
        assert_eq!(map.chart.uv_set, set);
        let tracer = Tracer::new(Arc::new(scene));
        let expected = texel_means(&map.chart, &mesh, |p, n| virtual_irradiance(&tracer, p, n));
        let off = relative_rmse(map, &expected);
        assert!(off <= 0.02, "{name}, {set:?}: off {off}");
        let brightest = expected.iter().fold(0.0_f64, |most, e| most.max(*e));
        let is_lit = |point, normal| virtual_irradiance(&tracer, point, normal) > 0.0;
        let steps = seam_steps(map, &mesh, is_lit).into_iter();
        let bright = steps.filter(|(_, e)| *e > 0.5 * brightest);
        let mut bright: Vec<f64> = bright.map(|(step, _)| step).collect();
        bright.sort_by(f64::total_cmp);
        assert!(bright.len() > 30, "{name}, {set:?}: {} steps", bright.len());
        let [half, most] = [0.5, 0.9].map(|share| bright[(share * (bright.len() as f64 - 1.0)) as usize]);
        let noise = estimate(&result);
        assert!(
            half < 0.005 && most < 0.015 + 3.0 * noise,
            "{name}, {set:?}: {half} {most}, noise {noise}"
        );
    }
}

#[test]
fn bent_receivers_take_a_virtual_lamps_light() {
    for (name, mesh) in [("ball", ball()), ("cylinder", cylinder()), ("torus", torus())] {
        check_bent(name, mesh);
    }
}

/// Pieces across and down the floor, texels of each along a side, and of the cell of the map that it lies in.
const PIECES: [usize; 2] = [7, 5];
const PIECE_TEXELS: usize = 24;
const CELL_TEXELS: usize = 26;

/// Where texel (column, row) of a piece lies in its cell: every piece is turned or mirrored another way.
fn turned(piece: usize, place: DVec2) -> DVec2 {
    let DVec2 { x, y } = place;
    let (x, y) = if piece / 4 % 2 == 1 { (1.0 - x, y) } else { (x, y) };
    match piece % 4 {
        0 => dvec2(x, y),
        1 => dvec2(y, 1.0 - x),
        2 => dvec2(1.0 - x, 1.0 - y),
        _ => dvec2(1.0 - y, x),
    }
}

/// Map coordinates of a place of a piece.
fn cut_uv(piece: usize, place: DVec2) -> DVec2 {
    // Neighbours on the floor are none in the map.
    let cell = piece * 17 % (PIECES[0] * PIECES[1]);
    let corner = dvec2((cell % PIECES[0]) as f64, (cell / PIECES[0]) as f64) * CELL_TEXELS as f64;
    let texel = corner + 1.0 + turned(piece, place) * PIECE_TEXELS as f64;
    texel / (dvec2(PIECES[0] as f64, PIECES[1] as f64) * CELL_TEXELS as f64)
}

/// The scene with its floor in pieces that lie pell-mell in the map.
fn with_floor_in_pieces(mut scene: Scene) -> Scene {
    let mut objects = scene.objects.iter_mut();
    let floor = objects.find(|object| object.name == "floor").expect("a floor");
    let (low, high) = floor.mesh_in_scene().bounds().expect("corners");
    let (mut mesh, mut uvs) = (Mesh::default(), Vec::new());
    for piece in 0..PIECES[0] * PIECES[1] {
        let corner = dvec2((piece % PIECES[0]) as f64, (piece / PIECES[0]) as f64);
        let first = mesh.positions.len() as u32;
        for place in [DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y] {
            let share = (corner + place) / dvec2(PIECES[0] as f64, PIECES[1] as f64);
            let at = low + (high - low) * dvec3(share.x, 0.0, share.y);
            mesh.positions.push(at);
            mesh.normals.push(DVec3::Y);
            uvs.push(cut_uv(piece, place));
        }
        mesh.triangles.push([first, first + 3, first + 2]);
        mesh.triangles.push([first, first + 2, first + 1]);
    }
    mesh.uv0 = Some(uvs);
    *floor.mesh_in_scene_mut() = mesh;
    scene
}

#[test]
fn a_floor_in_pieces_is_as_a_whole_one() {
    let size = PIECES.map(|count| count * PIECE_TEXELS);
    let [whole_size, cut_size] = [size, PIECES.map(|count| count * CELL_TEXELS)].map(|[x, y]| (x, y));
    for name in ["ring", "pool"] {
        let scene = builtin_scene(name);
        let whole = bake(scene.clone(), &sized(to(0.01, 1), whole_size));
        let in_pieces = with_floor_in_pieces(scene.clone());
        let cut = bake(in_pieces.clone(), &sized(to(0.01, 1), cut_size));
        assert_eq!(energy_fault(&cut), None, "{name}");
        let map = map_of(&cut, &in_pieces, "floor");
        assert_eq!(map.chart.uv_set, UvSet::TexCoord0, "{name}");
        let noise = estimate(&whole).hypot(estimate(&cut));
        let (whole, cut) = (floor(&whole, &scene), caustic(map));
        // The whole floor's map has u towards +x and v towards +z.
        let in_cut = |texel: usize| {
            let place =
                [texel % size[0], texel / size[0]].map(|index| (index as f64 + 0.5) / PIECE_TEXELS as f64);
            let uv = cut_uv(
                place[1] as usize * PIECES[0] + place[0] as usize,
                DVec2::from(place).fract(),
            );
            let (column, row) = (uv.x * map.width() as f64, uv.y * map.height() as f64);
            cut[row as usize * map.width() + column as usize]
        };
        let pieced: Vec<f64> = (0..whole.len()).map(in_cut).collect();
        let off = rmse(&pieced, &whole);
        assert!(off <= 0.005 + noise, "{name}: {off}, noise {noise}");
    }
}

/// A sheet below the ceiling that takes the mirror's light: whole, its half of x > 0 alone, or that half by a mask.
enum Sheet {
    Half,
    Masked,
    CutOutEverywhere,
    None,
}

fn scene_under_a(sheet: Sheet) -> Scene {
    let mut scene = scene_with(inside_out(shapes::floor([-1.0, 1.0], [-1.0, 1.0], 1.9)));
    let z = [-0.4, 0.5];
    let (mesh, cutoff) = match sheet {
        Sheet::None => return scene,
        Sheet::Half => (shapes::floor([0.0, 0.6], z, 0.9), None),
        Sheet::Masked => (shapes::floor([-0.6, 0.6], z, 0.9), Some(0.5)),
        Sheet::CutOutEverywhere => (shapes::floor([-0.6, 0.6], z, 0.9), Some(1.5)),
    };
    // The left of the image is clear, the right is not: between, alpha is a half in the middle of the sheet.
    let halves = image(2, vec![[255, 255, 255, 0], [255; 4]], Wrap::ClampToEdge);
    scene.textures.push(Arc::new(halves));
    let material = Material {
        base_colour_texture: Some(texture_reference()),
        alpha_mask: cutoff.map(|cutoff| AlphaMask { cutoff, factor: 1.0 }),
        ..parts::matte("sheet", LinearSrgb::grey(0.5))
    };
    parts::add(&mut scene, "sheet", mesh, material);
    scene
}

/// Watts that a layer brings to the named object's side.
fn flux_w(result: &Bake, scene: &Scene, side: Side, kind: LayerKind) -> f64 {
    let is_sheet = |map: &&IlluminationMap| {
        map.chart.receiver.side() == side && scene.objects[map.chart.object()].name == "sheet"
    };
    let maps = result.maps.iter().filter(is_sheet);
    maps.map(|map| map.flux_w(kind).luminance()).sum()
}

#[test]
fn a_mask_lets_light_through_where_it_cuts() {
    let ceiling = |sheet| {
        let scene = scene_under_a(sheet);
        let result = bake(scene.clone(), &with_layers(&CAUSTIC_AND_DIRECT, to(0.02, 96)));
        assert_eq!(energy_fault(&result), None);
        let sides = [Side::Front, Side::Back];
        let sheet_w: f64 = sides
            .map(|side| flux_w(&result, &scene, side, LayerKind::Caustic))
            .iter()
            .sum();
        let noise = estimate(&result);
        (map_of(&result, &scene, "receiver").clone(), sheet_w, noise)
    };
    let [
        (half, half_w, noise),
        (masked, masked_w, masked_noise),
        (nothing, ..),
        (invisible, stopped_w, _),
    ] = [Sheet::Half, Sheet::Masked, Sheet::None, Sheet::CutOutEverywhere].map(ceiling);
    let off = relative_rmse(&masked, &caustic(&half));
    let most = 0.01 + noise.hypot(masked_noise);
    assert!(off < most, "{off} from cut geometry");
    assert!((masked_w / half_w - 1.0).abs() < 0.005, "{masked_w} for {half_w}");
    let shadow = relative_rmse(&half, &caustic(&nothing));
    assert!(shadow > 0.1, "the sheet casts a shadow");
    // What is nowhere still makes light be followed ray by ray where its box stands.
    let off = relative_rmse(&invisible, &caustic(&nothing));
    assert!(off < most, "{off}");
    assert_eq!(stopped_w, 0.0);
}

/// From above straight, from below by the mirror.
#[test]
fn sides_of_a_sheet_hold_their_own_light() {
    let mut scene = scene_under_a(Sheet::Half);
    for material in &mut scene.materials {
        material.double_sided = true;
    }
    let result = bake(scene.clone(), &with_layers(&CAUSTIC_AND_DIRECT, to(0.02, 64)));
    let [above, below] = [Side::Front, Side::Back]
        .map(|side| [LayerKind::Direct, LayerKind::Caustic].map(|kind| flux_w(&result, &scene, side, kind)));
    assert!(above[0] > 0.05 && above[1] == 0.0, "{above:?}");
    assert!(below[0] == 0.0 && below[1] > 0.01, "{below:?}");
}

fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let (mean_a, mean_b) = (mean(a), mean(b));
    let sum = |f: &dyn Fn(f64, f64) -> f64| -> f64 {
        a.iter().zip(b).map(|(a, b)| f(a - mean_a, b - mean_b)).sum()
    };
    sum(&|a, b| a * b) / (sum(&|a, _| a * a) * sum(&|_, b| b * b)).sqrt()
}

fn flux_ratio(a: &[f64], b: &[f64]) -> f64 {
    a.iter().sum::<f64>() / b.iter().sum::<f64>()
}

fn floor_of(scene: Scene, settings: &BakeSettings) -> Vec<f64> {
    let result = bake(scene.clone(), settings);
    assert_eq!(energy_fault(&result), None);
    floor(&result, &scene)
}

/// A displaced wave of height h sends light on from h higher: its place on the floor moves by h·(tan θi − tan θt), first
/// order in the amplitude under a slanting sun, and by h times the slope's own deflection under one overhead, second
/// order. So the maps' difference must halve, and quarter, with the amplitude.
#[test]
fn bumps_differ_from_a_shape_by_its_height() {
    let suns = [(dvec3(0.3, -1.0, 0.2), 2.0, 4e5), (DVec3::NEG_Y, 4.0, 4e6)];
    for (towards, law, density_per_sr) in suns {
        let under_sun = |mut scene: Scene| {
            if let LightKind::Sun { direction, .. } = &mut scene.lights[0].kind {
                *direction = towards.normalize();
            }
            // By rays that are the same for both.
            floor_of(scene, &settings(density_per_sr, 64))
        };
        let found = [0.5, 0.25, 0.125].map(|part| {
            let amplitude_m = AMPLITUDE_M * part;
            let (bumps, shape) = (under_sun(bumped(amplitude_m)), under_sun(displaced(amplitude_m)));
            assert!((flux_ratio(&bumps, &shape) - 1.0).abs() < 2e-3);
            (rmse(&bumps, &shape), correlation(&bumps, &shape))
        });
        assert!(found[0].1 > 0.9 && found[2].1 > 0.98, "{found:?}");
        // What folds add to the difference goes with the folds.
        for pair in found.windows(2) {
            assert!(pair[0].0 / pair[1].0 > 0.9 * law, "not {law}: {found:?}");
        }
        assert!(found[1].0 / found[2].0 < 1.25 * law, "not {law}: {found:?}");
    }
}

/// Under a crest that bends the sun's rays by H·(1 − 1/n)·A·k² = 1, they meet in a line: light runs as the crest does.
#[test]
fn focal_lines_run_with_the_crests() {
    const SIDE: usize = 256;
    let mut scene = bumped(AMPLITUDE_M);
    if let LightKind::Sun { direction, .. } = &mut scene.lights[0].kind {
        *direction = DVec3::NEG_Y;
    }
    let (wavelength_m, period_s) = (0.8, 0.72);
    let wave_number: f64 = TAU / wavelength_m;
    let water = scene.objects[1].material;
    let wave = Wave {
        amplitude_m: (wave_number * wave_number * (1.0 - 1.0 / 1.333)).recip(),
        wavelength_m,
        direction: DVec3::X,
        phase_rad: 0.0,
        period_s,
    };
    scene.materials[water].waves = Waves::new(vec![wave]).ok();
    for moment in 0..5 {
        let time_s = 0.13 * f64::from(moment);
        let light = floor_of(scene.at(time_s), &to(0.01, SIDE));
        let brightest = (0..SIDE).max_by(|a, b| {
            let column = |column: usize| light.iter().skip(column).step_by(SIDE).sum::<f64>();
            column(*a).total_cmp(&column(*b))
        });
        // The floor reaches from −1 m to 1 m.
        let x_m = (brightest.unwrap_or_default() as f64 + 0.5) * 2.0 / SIDE as f64 - 1.0;
        let from_crest = (x_m - wavelength_m * time_s / period_s).rem_euclid(wavelength_m);
        let off_m = from_crest.min(wavelength_m - from_crest);
        assert!(off_m < 2.0 / SIDE as f64, "{time_s} s: {off_m} m from the crest");
    }
}

/// One quad with a wave of a length and a slope.
fn rippled(wavelength_m: f64, slope: f64) -> Scene {
    let mut scene = bumped(AMPLITUDE_M);
    let of = |direction, part: f64| {
        wave(
            part * slope * wavelength_m / TAU,
            wavelength_m * part,
            direction,
            part,
        )
    };
    let waves = vec![of(dvec3(1.0, 0.0, 0.3), 1.0), of(dvec3(-0.4, 0.0, 1.0), 0.8)];
    scene.materials[1].waves = Some(Waves::new(waves).expect("gentle waves"));
    scene
}

#[test]
fn waves_shorter_than_a_cell_are_resolved() {
    let scene = rippled(0.06, 0.02);
    let coarse = bake(scene.clone(), &to(0.05, 96));
    let off = rmse(&floor(&coarse, &scene), &floor_of(scene.clone(), &to(0.01, 96)));
    let noise = estimate(&coarse);
    assert!(off < 1.5 * noise, "{off}, noise {noise}");
}

#[test]
fn waves_finer_than_any_cell_blur_light() {
    let side = 32;
    let scene = rippled(2e-4, 0.1);
    let result = bake(scene.clone(), &to(0.02, side));
    assert_eq!(energy_fault(&result), None);
    // Away from the border the floor is lit from everywhere alike.
    let inner = |map: Vec<f64>| -> Vec<f64> {
        let rows = (8..24).flat_map(|row| map[row * side + 8..row * side + 24].to_vec());
        rows.collect()
    };
    let (fine, flat) = (
        inner(floor(&result, &scene)),
        inner(floor_of(bumped(0.0), &to(0.02, side))),
    );
    let (off, flux) = (rmse(&fine, &flat), flux_ratio(&fine, &flat));
    assert!(off < 0.15 && (flux - 1.0).abs() < 5e-3, "{off} {flux}");
}

#[test]
fn bumps_off_bakes_the_mesh_itself() {
    let wavy = bumped(AMPLITUDE_M);
    for settings in [to(0.03, 32), settings(1e4, 32)] {
        let off = set(settings.clone(), |s| {
            s.effects = EffectSwitches::default().with(Effect::Bumps, EffectSwitch::Off)
        });
        let mut session = session(&wavy);
        let [with, without, again] = [&settings, &off, &settings].map(|settings| run(&mut session, settings));
        assert!(with.plan.is_on(Effect::Bumps) && !without.plan.is_on(Effect::Bumps));
        assert_eq!(energy_fault(&without), None);
        let [lit, unlit, relit] = [&with, &without, &again].map(all_bits);
        assert!(unlit == all_bits(&bake(bumped(0.0), &off)), "normals of the mesh");
        assert!(unlit != lit);
        assert!(relit == lit, "nothing of the other is kept");
        let mut shape = wavy.clone();
        let waves = shape.materials[1].waves.take().expect("it has waves");
        *shape.objects[1].mesh_in_scene_mut() = meshed(DVec3::Y, [1.5; 2], [512; 2], &waves);
        let shape = bake(shape, &settings);
        assert!(!shape.plan.is_on(Effect::Bumps));
    }
}

/// As the waves that it shows, whichever way round its coordinates run, and by both estimators.
#[test]
fn an_image_of_normals_bends_light() {
    let waves = floor_of(by_waves(), &to(0.01, 64));
    for mirrored in [false, true] {
        let image = floor_of(by_image(mirrored), &to(0.01, 64));
        let (off, alike) = (rmse(&image, &waves), correlation(&image, &waves));
        let flux = flux_ratio(&image, &waves);
        // Eight bits of a slope and straight lines between texels are left.
        assert!(off < 0.05 && alike > 0.99, "mirrored {mirrored}: {off} {alike}");
        assert!((flux - 1.0).abs() < 2e-3, "mirrored {mirrored}: {flux}");
    }
    let [bundles, splats] =
        [to(0.01, 32), settings(2e5, 32)].map(|settings| floor_of(by_image(false), &settings));
    let off = rmse(&bundles, &splats);
    assert!(off < 0.05, "{off}");
}
