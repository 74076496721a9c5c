//! Receivers of every shape: bent ones, ones cut into charts, both sides of sheets, masks.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use glam::{DMat3, DVec2, DVec3};
use nephroid::geometry::Ray;
use nephroid::illumination::lookup::bilinear;
use nephroid::illumination::parametrisation::coverage::{for_each_texel_in_row, rows};
use nephroid::illumination::{Chart, IlluminationMap, Side, UvSet};
use nephroid::optics::LinearSrgb;
use nephroid::scene::builtin::{parts, shapes};
use nephroid::scene::texture::Wrap;
use nephroid::scene::{Adjacency, AlphaMask, Material, Mesh, Scene, Texture, TextureRef};
use nephroid::settings::{BakeSettings, LayerKind, MapResolution};
use nephroid::transport::Tracer;
use nephroid::units::Flux;

use crate::tools::{at, bake, caustic, energy_fault, map_of};

/// 1 W/sr.
const POWER: Flux = Flux(4.0 * PI);

const LAMP: DVec3 = DVec3::new(-0.3, 1.4, -0.2);

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
    let image = LAMP * DVec3::new(1.0, -1.0, 1.0);
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
    let size = DVec2::new(width as f64, height as f64);
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
                let corner = DVec2::new(column as f64, row as f64);
                let texel = row * width + column;
                let mut found = false;
                for index in 0..SAMPLES * SAMPLES {
                    let step = DVec2::new((index % SAMPLES) as f64, (index / SAMPLES) as f64) + 0.5;
                    let place = corner + step / SAMPLES as f64 + DVec2::new(0.6e-6, 1.1e-6);
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

/// Steps of the map across its seams, where the surface is lit evenly: over the local value, all of them.
fn seam_steps(map: &IlluminationMap, mesh: &Mesh, is_even: impl Fn(DVec3, DVec3) -> bool) -> Vec<(f64, f64)> {
    let values = &map.layer(LayerKind::Caustic).expect("a caustic layer").irradiance;
    let adjacency = Adjacency::of(mesh);
    let mut steps = Vec::new();
    for triangle in 0..mesh.triangles.len() {
        for edge in 0..3 {
            let Some((beyond, back)) = adjacency
                .beyond(triangle, edge)
                .filter(|(other, _)| *other > triangle)
            else {
                continue;
            };
            let ends = [(edge, (back + 1) % 3), ((edge + 1) % 3, back)].map(|(here, there)| {
                let uvs = &map.chart.corner_uvs;
                (
                    uvs[triangle][here],
                    uvs[beyond][there],
                    mesh.corners(triangle)[here],
                )
            });
            if ends.iter().all(|(here, there, _)| here.distance(*there) < 1e-9) {
                continue;
            }
            let normals = [triangle, beyond].map(|triangle| mesh.face_normal(triangle));
            if normals[0].dot(normals[1]) < 0.99 || !is_even(ends[0].2.lerp(ends[1].2, 0.5), normals[0]) {
                continue;
            }
            let look = |uv: DVec2| bilinear(values, map.chart.width, map.chart.height, uv).luminance();
            for share in [0.25, 0.5, 0.75] {
                let here = look(ends[0].0.lerp(ends[1].0, share));
                let there = look(ends[0].1.lerp(ends[1].1, share));
                steps.push((
                    0.5 * (here + there),
                    (here - there).abs() / (0.5 * (here + there)),
                ));
            }
        }
    }
    steps
}

/// The same without texture coordinates, so that it is unwrapped.
fn bare(mesh: &Mesh) -> Mesh {
    Mesh {
        uv0: None,
        ..mesh.clone()
    }
}

/// A sheet with coordinates that stretch: the poles of a ball take whole rows.
fn stretched(columns: u32, rows: u32, surface: impl Fn(f64, f64) -> (DVec3, DVec3)) -> Mesh {
    let mut mesh = shapes::sheet(columns, rows, surface);
    let mut uvs = Vec::new();
    for row in 0..=rows {
        for column in 0..=columns {
            let (u, v) = (
                f64::from(column) / f64::from(columns),
                f64::from(row) / f64::from(rows),
            );
            uvs.push(DVec2::new(u + 0.04 * (TAU * u).sin(), 0.7 * v + 0.3 * v * v));
        }
    }
    mesh.uv0 = Some(uvs);
    mesh
}

const MIDDLE: DVec3 = DVec3::new(0.35, 0.8, 0.25);

fn ball() -> Mesh {
    stretched(192, 96, |u, v| {
        let (sine, cosine) = (PI * v).sin_cos();
        let around = DVec2::from_angle(TAU * u);
        let normal = DVec3::new(around.x * sine, cosine, around.y * sine);
        (MIDDLE + normal * 0.3, normal)
    })
}

fn cylinder() -> Mesh {
    let (axis, x) = (
        DVec3::new(1.0, 0.4, 0.2).normalize(),
        DVec3::new(-0.4, 1.0, 0.0).normalize(),
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
        let out = DVec3::new(around.x, 0.3 * around.x, around.y).normalize();
        let up = out
            .cross(DVec3::new(-around.y, -0.3 * around.y, around.x))
            .normalize();
        let normal = out * across.x + up * across.y;
        (MIDDLE + out * 0.3 + normal * 0.12, normal)
    })
}

fn check_bent(name: &str, mesh: Mesh) {
    for (uv, mesh, set, side) in [
        ("own", mesh.clone(), UvSet::TexCoord0, 192),
        ("unwrapped", bare(&mesh), UvSet::Generated, 384),
    ] {
        let scene = scene_with(mesh.clone());
        let result = bake(scene.clone(), &at(8000.0, side));
        assert_eq!(energy_fault(&result), None, "{name} {uv}");
        let map = map_of(&result, &scene, "receiver");
        assert_eq!(map.chart.uv_set, set);
        let tracer = Tracer::new(Arc::new(scene));
        let expected = texel_means(&map.chart, &mesh, |p, n| virtual_irradiance(&tracer, p, n));
        let rmse = relative_rmse(map, &expected);
        let is_lit = |point, normal| virtual_irradiance(&tracer, point, normal) > 0.0;
        let steps = seam_steps(map, &mesh, is_lit);
        let brightest = expected.iter().fold(0.0_f64, |most, e| most.max(*e));
        let bright = steps.iter().filter(|(e, _)| *e > 0.5 * brightest);
        let mut bright: Vec<f64> = bright.map(|(_, step)| *step).collect();
        bright.sort_by(f64::total_cmp);
        assert!(bright.len() > 30, "{name}, {uv}: {} steps", bright.len());
        let step = |share: f64| bright[(share * (bright.len() as f64 - 1.0)) as usize];
        println!(
            "{name}, {uv}: off {:.2} %, {} rays, {} queries; {} steps at seams, half below {:.3} %, nine tenths below \
             {:.3} %, worst {:.2} %",
            100.0 * rmse,
            result.counts.rays,
            result.counts.receiver_queries,
            bright.len(),
            100.0 * step(0.5),
            100.0 * step(0.9),
            100.0 * step(1.0)
        );
        assert!(rmse <= 0.02, "{name}, {uv}: off {rmse}");
        assert!(
            step(0.5) < 0.005 && step(0.9) < 0.015,
            "{name}, {uv}: {} {}",
            step(0.5),
            step(0.9)
        );
    }
}

#[test]
fn a_ball_takes_the_light_of_a_virtual_lamp() {
    check_bent("ball", ball());
}

#[test]
fn a_cylinder_takes_the_light_of_a_virtual_lamp() {
    check_bent("cylinder", cylinder());
}

#[test]
fn a_torus_takes_the_light_of_a_virtual_lamp() {
    check_bent("torus", torus());
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
        0 => DVec2::new(x, y),
        1 => DVec2::new(y, 1.0 - x),
        2 => DVec2::new(1.0 - x, 1.0 - y),
        _ => DVec2::new(1.0 - y, x),
    }
}

/// Map coordinates of a place of a piece.
fn cut_uv(piece: usize, place: DVec2) -> DVec2 {
    // Neighbours on the floor are none in the map.
    let cell = piece * 17 % (PIECES[0] * PIECES[1]);
    let corner = DVec2::new((cell % PIECES[0]) as f64, (cell / PIECES[0]) as f64) * CELL_TEXELS as f64;
    let texel = corner + 1.0 + turned(piece, place) * PIECE_TEXELS as f64;
    texel / (DVec2::new(PIECES[0] as f64, PIECES[1] as f64) * CELL_TEXELS as f64)
}

/// The scene with its floor in pieces that lie pell-mell in the map.
fn with_floor_in_pieces(mut scene: Scene) -> Scene {
    let floor = scene
        .objects
        .iter()
        .position(|object| object.name == "floor")
        .expect("a floor");
    let (low, high) = scene.objects[floor].mesh.bounds().expect("corners");
    let mut mesh = Mesh {
        uv0: Some(Vec::new()),
        ..Mesh::default()
    };
    for piece in 0..PIECES[0] * PIECES[1] {
        let corner = DVec2::new((piece % PIECES[0]) as f64, (piece / PIECES[0]) as f64);
        let first = mesh.positions.len() as u32;
        for place in [DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y] {
            let share = (corner + place) / DVec2::new(PIECES[0] as f64, PIECES[1] as f64);
            let at = low + (high - low) * DVec3::new(share.x, 0.0, share.y);
            mesh.positions.push(at);
            mesh.normals.push(DVec3::Y);
            mesh.uv0.as_mut().expect("a set").push(cut_uv(piece, place));
        }
        mesh.triangles.push([first, first + 3, first + 2]);
        mesh.triangles.push([first, first + 2, first + 1]);
    }
    scene.objects[floor].mesh = Arc::new(mesh);
    scene
}

fn sized(density_per_sr: f64, size: [usize; 2]) -> BakeSettings {
    BakeSettings {
        map_resolution: MapResolution::Fixed {
            width: size[0],
            height: size[1],
        },
        ..at(density_per_sr, 1)
    }
}

#[test]
fn a_floor_in_turned_pieces_holds_the_light_of_a_whole_one() {
    for (name, density_per_sr) in [("ring", 6000.0), ("pool", 6000.0)] {
        let scene = crate::tools::builtin_scene(name);
        let whole = bake(
            scene.clone(),
            &sized(density_per_sr, PIECES.map(|count| count * PIECE_TEXELS)),
        );
        let cut_scene = with_floor_in_pieces(scene.clone());
        let cut = bake(
            cut_scene.clone(),
            &sized(density_per_sr, PIECES.map(|count| count * CELL_TEXELS)),
        );
        assert_eq!(energy_fault(&cut), None, "{name}");
        let (whole_map, cut_map) = (map_of(&whole, &scene, "floor"), map_of(&cut, &cut_scene, "floor"));
        assert_eq!(cut_map.chart.uv_set, UvSet::TexCoord0, "{name}");
        let (whole_e, cut_e) = (caustic(whole_map), caustic(cut_map));
        let size = [whole_map.width(), whole_map.height()];
        let (mut squares, mut sum, mut worst) = (0.0, 0.0, 0.0_f64);
        for (texel, value) in whole_e.iter().enumerate() {
            let place = DVec2::new((texel % size[0]) as f64 + 0.5, (texel / size[0]) as f64 + 0.5)
                / DVec2::new(size[0] as f64, size[1] as f64);
            // The whole floor's map has u towards +x and v towards +z.
            let at = place * DVec2::new(PIECES[0] as f64, PIECES[1] as f64);
            let piece = at.y as usize * PIECES[0] + at.x as usize;
            let uv = cut_uv(piece, at.fract());
            let column = (uv.x * cut_map.width() as f64) as usize;
            let row = (uv.y * cut_map.height() as f64) as usize;
            let other = cut_e[row * cut_map.width() + column];
            squares += (value - other).powi(2);
            sum += value;
            worst = worst.max((value - other).abs());
        }
        let count = whole_e.len() as f64;
        let rmse = (squares * count).sqrt() / sum;
        println!(
            "{name} in pieces: {:.3} % from the whole, worst texel {:.2} % of the mean; {} and {} queries",
            100.0 * rmse,
            100.0 * worst * count / sum,
            whole.counts.receiver_queries,
            cut.counts.receiver_queries
        );
        assert!(rmse <= 0.005, "{name}: {rmse}");
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
    let turned = |mut mesh: Mesh| {
        mesh.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        mesh.normals.iter_mut().for_each(|normal| *normal = -*normal);
        mesh
    };
    let mut scene = scene_with(turned(shapes::floor([-1.0, 1.0], [-1.0, 1.0], 1.9)));
    let z = [-0.4, 0.5];
    let (mesh, cutoff) = match sheet {
        Sheet::None => return scene,
        Sheet::Half => (shapes::floor([0.0, 0.6], z, 0.9), None),
        Sheet::Masked => (shapes::floor([-0.6, 0.6], z, 0.9), Some(0.5)),
        Sheet::CutOutEverywhere => (shapes::floor([-0.6, 0.6], z, 0.9), Some(1.5)),
    };
    // The left of the image is clear, the right is not: between, alpha is a half in the middle of the sheet.
    scene.textures.push(Arc::new(Texture {
        name: "halves".into(),
        width: 2,
        height: 1,
        rgba: vec![[255, 255, 255, 0], [255; 4]],
        wrap: [Wrap::ClampToEdge; 2],
    }));
    let material = Material {
        base_colour_texture: Some(TextureRef {
            texture: 0,
            uv_set: 0,
            uv_transform: DMat3::IDENTITY,
        }),
        alpha_mask: cutoff.map(|cutoff| AlphaMask { cutoff, factor: 1.0 }),
        ..parts::matte("sheet", LinearSrgb::grey(0.5))
    };
    parts::add(&mut scene, "sheet", mesh, material);
    scene
}

#[test]
fn light_goes_through_where_a_mask_cuts_a_sheet_out() {
    let ceiling = |sheet| {
        let scene = scene_under_a(sheet);
        let settings = BakeSettings {
            layers: vec![LayerKind::Caustic, LayerKind::Direct],
            ..at(8000.0, 96)
        };
        let result = bake(scene.clone(), &settings);
        assert_eq!(energy_fault(&result), None);
        let map = map_of(&result, &scene, "receiver").clone();
        let sheet_w: f64 = result
            .maps
            .iter()
            .filter(|map| scene.objects[map.chart.object()].name == "sheet")
            .map(|map| map.flux_w(LayerKind::Caustic).luminance())
            .sum();
        (map, sheet_w)
    };
    let ((half, half_w), (masked, masked_w)) = (ceiling(Sheet::Half), ceiling(Sheet::Masked));
    let off = relative_rmse(&masked, &caustic(&half));
    println!(
        "cut out by a mask: {:.3} % from cut geometry, {masked_w} W on the sheet for {half_w}",
        100.0 * off
    );
    assert!(off < 0.01, "{off}");
    assert!((masked_w / half_w - 1.0).abs() < 0.005, "{masked_w} for {half_w}");
    let ((nothing, _), (invisible, stopped_w)) = (ceiling(Sheet::None), ceiling(Sheet::CutOutEverywhere));
    assert!(
        relative_rmse(&half, &caustic(&nothing)) > 0.1,
        "the sheet casts a shadow"
    );
    // What is nowhere still makes light be followed ray by ray where its box stands.
    let off = relative_rmse(&invisible, &caustic(&nothing));
    assert!(off < 0.01, "{off}");
    assert_eq!(stopped_w, 0.0);
}

#[test]
fn both_sides_of_a_sheet_hold_their_own_light() {
    let mut scene = scene_under_a(Sheet::Half);
    // From above straight, from below by the mirror.
    let settings = BakeSettings {
        layers: vec![LayerKind::Caustic, LayerKind::Direct],
        ..at(6000.0, 64)
    };
    for material in &mut scene.materials {
        material.double_sided = true;
    }
    let result = bake(scene.clone(), &settings);
    let of = |side: Side, kind: LayerKind| {
        let maps = result.maps.iter();
        let found = maps.filter(|map| {
            map.chart.receiver.side() == side && scene.objects[map.chart.object()].name == "sheet"
        });
        found.map(|map| map.flux_w(kind).luminance()).sum::<f64>()
    };
    let [above, below] = [Side::Front, Side::Back]
        .map(|side| [LayerKind::Direct, LayerKind::Caustic].map(|kind| of(side, kind)));
    println!("above {above:?} W, below {below:?} W (direct, caustic)");
    assert!(above[0] > 0.05 && above[1] == 0.0, "{above:?}");
    assert!(below[0] == 0.0 && below[1] > 0.01, "{below:?}");
}
