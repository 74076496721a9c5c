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
use nephroid::session::BakeResult;
use nephroid::settings::LayerKind;
use nephroid::transport::Tracer;
use nephroid::units::Flux;

use crate::bake::common::{CAUSTIC_AND_DIRECT, floor, rmse, sized, with_layers};
use support::tools::{at, bake, builtin_scene, caustic, energy_fault, map_of};

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
        DVec2::new(u + 0.04 * (TAU * u).sin(), 0.7 * v + 0.3 * v * v)
    };
    let uvs = (0..(columns + 1) * (rows + 1)).map(stretch).collect();
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

/// With coordinates of its own, and unwrapped.
fn check_bent(mesh: Mesh) {
    let bare = Mesh {
        uv0: None,
        ..mesh.clone()
    };
    for (mesh, set, side) in [(mesh, UvSet::TexCoord0, 192), (bare, UvSet::Generated, 384)] {
        let scene = scene_with(mesh.clone());
        let result = bake(scene.clone(), &at(8000.0, side));
        assert_eq!(energy_fault(&result), None, "{set:?}");
        let map = map_of(&result, &scene, "receiver");
        assert_eq!(map.chart.uv_set, set);
        let tracer = Tracer::new(Arc::new(scene));
        let expected = texel_means(&map.chart, &mesh, |p, n| virtual_irradiance(&tracer, p, n));
        let off = relative_rmse(map, &expected);
        assert!(off <= 0.02, "{set:?}: off {off}");
        let brightest = expected.iter().fold(0.0_f64, |most, e| most.max(*e));
        let is_lit = |point, normal| virtual_irradiance(&tracer, point, normal) > 0.0;
        let steps = seam_steps(map, &mesh, is_lit).into_iter();
        let bright = steps.filter(|(_, e)| *e > 0.5 * brightest);
        let mut bright: Vec<f64> = bright.map(|(step, _)| step).collect();
        bright.sort_by(f64::total_cmp);
        assert!(bright.len() > 30, "{set:?}: {} steps", bright.len());
        let [half, most] = [0.5, 0.9].map(|share| bright[(share * (bright.len() as f64 - 1.0)) as usize]);
        assert!(half < 0.005 && most < 0.015, "{set:?}: {half} {most}");
    }
}

#[test]
fn a_ball_takes_a_virtual_lamps_light() {
    check_bent(ball());
}

#[test]
fn a_cylinder_takes_a_virtual_lamps_light() {
    check_bent(cylinder());
}

#[test]
fn a_torus_takes_a_virtual_lamps_light() {
    check_bent(torus());
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
    let mut objects = scene.objects.iter_mut();
    let floor = objects.find(|object| object.name == "floor").expect("a floor");
    let (low, high) = floor.mesh_in_scene().bounds().expect("corners");
    let (mut mesh, mut uvs) = (Mesh::default(), Vec::new());
    for piece in 0..PIECES[0] * PIECES[1] {
        let corner = DVec2::new((piece % PIECES[0]) as f64, (piece / PIECES[0]) as f64);
        let first = mesh.positions.len() as u32;
        for place in [DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y] {
            let share = (corner + place) / DVec2::new(PIECES[0] as f64, PIECES[1] as f64);
            let at = low + (high - low) * DVec3::new(share.x, 0.0, share.y);
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
        let whole = bake(scene.clone(), &sized(at(6000.0, 1), whole_size));
        let in_pieces = with_floor_in_pieces(scene.clone());
        let cut = bake(in_pieces.clone(), &sized(at(6000.0, 1), cut_size));
        assert_eq!(energy_fault(&cut), None, "{name}");
        let map = map_of(&cut, &in_pieces, "floor");
        assert_eq!(map.chart.uv_set, UvSet::TexCoord0, "{name}");
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
        assert!(off <= 0.005, "{name}: {off}");
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

/// Watts that a layer brings to the named object's side.
fn flux_w(result: &BakeResult, scene: &Scene, side: Side, kind: LayerKind) -> f64 {
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
        let result = bake(scene.clone(), &with_layers(&CAUSTIC_AND_DIRECT, at(8000.0, 96)));
        assert_eq!(energy_fault(&result), None);
        let sides = [Side::Front, Side::Back];
        let sheet_w: f64 = sides
            .map(|side| flux_w(&result, &scene, side, LayerKind::Caustic))
            .iter()
            .sum();
        (map_of(&result, &scene, "receiver").clone(), sheet_w)
    };
    let [
        (half, half_w),
        (masked, masked_w),
        (nothing, _),
        (invisible, stopped_w),
    ] = [Sheet::Half, Sheet::Masked, Sheet::None, Sheet::CutOutEverywhere].map(ceiling);
    let off = relative_rmse(&masked, &caustic(&half));
    assert!(off < 0.01, "{off} from cut geometry");
    assert!((masked_w / half_w - 1.0).abs() < 0.005, "{masked_w} for {half_w}");
    let shadow = relative_rmse(&half, &caustic(&nothing));
    assert!(shadow > 0.1, "the sheet casts a shadow");
    // What is nowhere still makes light be followed ray by ray where its box stands.
    let off = relative_rmse(&invisible, &caustic(&nothing));
    assert!(off < 0.01, "{off}");
    assert_eq!(stopped_w, 0.0);
}

/// From above straight, from below by the mirror.
#[test]
fn sides_of_a_sheet_hold_their_own_light() {
    let mut scene = scene_under_a(Sheet::Half);
    for material in &mut scene.materials {
        material.double_sided = true;
    }
    let result = bake(scene.clone(), &with_layers(&CAUSTIC_AND_DIRECT, at(6000.0, 64)));
    let [above, below] = [Side::Front, Side::Back]
        .map(|side| [LayerKind::Direct, LayerKind::Caustic].map(|kind| flux_w(&result, &scene, side, kind)));
    assert!(above[0] > 0.05 && above[1] == 0.0, "{above:?}");
    assert!(below[0] == 0.0 && below[1] > 0.01, "{below:?}");
}
