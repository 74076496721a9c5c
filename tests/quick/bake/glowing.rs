//! Surfaces that glow are the lamps that they look like.

use nephroid::geometry::sampling::even_point;
use nephroid::scene::PanelShape;
use nephroid::scene::emitter::{EmitterKind, EmitterSampler};
use support::floors::{image, texture_reference};
use support::meshes::{floor, grid, quad, sphere};
use support::scenes::{chart, diffuse, direct, flux_w, let_glow, panel, point_light, scene, surface};
use support::tools::{bake, caustic, energy_fault, map_of, set, to};

use crate::prelude::*;

/// Height of the lamps over the floor [m].
const HEIGHT_M: f64 = 2.0;

/// A square that hangs below the ceiling and faces down.
fn hanging(side_m: f64) -> Mesh {
    let corner = dvec3(-0.5 * side_m, HEIGHT_M, -0.5 * side_m);
    quad(corner, DVec3::Z * side_m, DVec3::X * side_m)
}

/// Shines with 10 W/(m² sr), or with an image of that brightness.
fn glowing(double_sided: bool, image: Option<&Texture>) -> Material {
    Material {
        emitted_radiance: LinearSrgb::grey(10.0),
        emission_texture: image.map(|_| texture_reference()),
        double_sided,
        ..diffuse(0.0)
    }
}

/// A floor below a ball of glass and a lamp.
fn below(lamp: Mesh, material: Material, image: Option<Texture>) -> Scene {
    let ball = sphere(dvec3(0.0, 0.5, 0.0), 0.3, 48, 24);
    let glass = Material {
        roughness: 0.0,
        ..surface(SurfaceKind::Dielectric, 1.5)
    };
    let parts = vec![(floor(1.0, 0.0), diffuse(0.5)), (ball, glass), (lamp, material)];
    let mut scene = scene(parts, vec![]);
    let_glow(&mut scene, 2, image);
    scene
}

/// Black but for a square of so many texels in the middle.
fn spot(side: usize, bright: usize) -> Texture {
    let is_bright = |at: usize| (side - bright) / 2 <= at && at < (side + bright) / 2;
    let texel = |texel: usize| match is_bright(texel % side) && is_bright(texel / side) {
        true => [255; 4],
        false => [0, 0, 0, 255],
    };
    image(
        side as u32,
        (0..side * side).map(texel).collect(),
        Wrap::ClampToEdge,
    )
}

/// Relative RMSE of the caustic on the floor.
fn off(found: &Bake, expected: &Bake, scene: &Scene) -> f64 {
    let name = &scene.objects[0].name;
    let [found, expected] = [found, expected].map(|bake| caustic(map_of(bake, scene, name)));
    let mean = expected.iter().sum::<f64>() / expected.len() as f64;
    let squares = found.iter().zip(&expected).map(|(a, b)| (a - b).powi(2));
    (squares.sum::<f64>() / expected.len() as f64).sqrt() / mean
}

/// A spot on a black image lights a scene as a lamp of its size does, and takes about as many rays: they start there.
#[test]
fn a_spot_of_an_image_is_a_small_lamp() {
    let (side, bright) = (256, 8);
    let spotted = spot(side, bright);
    let material = glowing(false, Some(&spotted));
    let by_image = below(hanging(2.0), material, Some(spotted));
    let lamp_m = 2.0 * bright as f64 / side as f64;
    let by_lamp = below(hanging(lamp_m), glowing(false, None), None);

    // Direct light, without the shadow of the ball.
    let [of_image, of_lamp] = [&by_image, &by_lamp].map(|scene| {
        let tracer = Tracer::new(Arc::new(scene.clone())).without_clear_bodies();
        let chart = chart(&tracer, 0, 16, 16);
        flux_w(&chart, &direct(&tracer, &chart))
    });
    near(of_image, of_lamp, 0.005 * of_lamp, "direct light");

    let settings = to(0.1, 32);
    let [of_image, of_lamp] = [&by_image, &by_lamp].map(|scene| bake(scene.clone(), &settings));
    assert_eq!(energy_fault(&of_image), None);
    let off = off(&of_image, &of_lamp, &by_lamp);
    assert!(off < 0.15, "{off}");
    let rays = [&of_image, &of_lamp].map(|bake| bake.counts.rays);
    assert!(rays[0] < 16 * rays[1], "{rays:?}");
}

/// However an image is spread over triangles, samples of the lamp have its power in the mean, and none of them outshines
/// the others. Single bright texels lie between the samples of their triangles' means.
#[test]
fn bright_texels_are_sampled_as_often_as_they_shine() {
    const SIDE: usize = 2048;
    const CELLS: usize = 8;
    let mut stars = image(SIDE as u32, vec![[0, 0, 0, 255]; SIDE * SIDE], Wrap::ClampToEdge);
    for star in (1..SIDE * SIDE).step_by(100_003) {
        stars.rgba[star] = [255; 4];
    }
    let mut sheet = grid(CELLS, CELLS, |u, v| dvec3(u, 0.0, v));
    let uvs = sheet.positions.iter().map(|place| DVec2::new(place.x, place.z));
    sheet.uv0 = Some(uvs.collect());
    let material = glowing(false, Some(&stars));
    let scene = below(sheet, material, Some(stars));

    // The sheet has an area of 1 m².
    let whole = scene.lights[0].strength().luminance();
    let samples = 40_000_u32;
    let sampler = EmitterSampler::new(&scene.lights[0], &scene);
    let (mut sum, mut most) = (0.0, 0.0_f64);
    for index in 0..samples {
        let sample = sampler.sample(even_point(index, 0, 1)).expect("it shines");
        assert!(matches!(sample.kind, EmitterKind::Facet { .. }));
        sum += sample.strength.luminance();
        most = most.max(sample.strength.luminance());
    }
    near(sum / f64::from(samples), whole, 0.02 * whole, "the mean");
    assert!(most <= 16.0 * whole, "{most} for {whole}");
}

/// A rectangle that glows is as exact and as cheap as a panel of its size, on whichever side it shines.
#[test]
fn rectangles_that_glow_are_panels() {
    let side_m = 0.1;
    let sides = [DVec3::X, DVec3::Z].map(|side| side * (0.5 * side_m));
    let settings = to(0.05, 64);
    let mut by_panel = below(hanging(side_m), diffuse(0.0), None);
    // Just below the square, which would keep its light.
    let centre = DVec3::Y * (HEIGHT_M - 1e-6);
    by_panel.lights = vec![panel(centre, sides, PanelShape::Rectangle, 10.0)];
    let expected = bake(by_panel.clone(), &settings);
    for (double_sided, faces_up) in [(false, false), (true, false), (true, true)] {
        let mut lamp = hanging(side_m);
        if faces_up {
            lamp = support::meshes::inside_out(lamp);
        }
        let found = bake(below(lamp, glowing(double_sided, None), None), &settings);
        assert_eq!(energy_fault(&found), None);
        let off = off(&found, &expected, &by_panel);
        assert!(off < 0.06, "{double_sided}, {faces_up}: {off}");
        let rays = [&found, &expected].map(|bake| bake.counts.rays);
        assert!(rays[0] < 2 * rays[1], "{double_sided}, {faces_up}: {rays:?}");
    }
}

/// A ball of light is the sphere that it stands for, from afar and with its glass within reach.
#[test]
fn balls_of_light_are_glowing_spheres() {
    let settings = to(0.1, 32);
    for (height_m, radius_m) in [(HEIGHT_M, 0.05), (1.0, 0.15)] {
        let centre = DVec3::Y * height_m;
        let mesh = sphere(centre, radius_m, 128, 64);
        let by_mesh = below(mesh, glowing(false, None), None);
        let mut by_ball = by_mesh.clone();
        by_ball.objects.pop();
        let intensity = 10.0 * PI * radius_m * radius_m;
        by_ball.lights = vec![Light {
            size: LightSize::Radius { radius_m },
            ..point_light(centre, intensity)
        }];
        let [of_mesh, of_ball] = [&by_mesh, &by_ball].map(|scene| bake(scene.clone(), &settings));
        assert_eq!(energy_fault(&of_ball), None);
        let emitted = [&of_mesh, &of_ball].map(|bake| bake.ledgers[0].energy_w.emitted);
        near(
            emitted[0],
            emitted[1],
            0.01 * emitted[1],
            "light towards the glass",
        );
        let off = off(&of_ball, &of_mesh, &by_ball);
        assert!(off < 0.15, "{radius_m} m: {off}");
        let rays = [&of_ball, &of_mesh].map(|bake| bake.counts.rays);
        assert!(rays[0] <= rays[1], "{rays:?}");
    }
}

/// Light of a wide lamp has no fine detail: its map has fewer texels than that of a point.
#[test]
fn maps_are_no_finer_than_the_image_of_a_lamp() {
    let settings = set(to(0.1, 32), |settings| {
        settings.map_resolution = MapResolution::Auto;
    });
    let texels = |scene: Scene| {
        let name = scene.objects[0].name.clone();
        let result = bake(scene.clone(), &settings);
        map_of(&result, &scene, &name).chart.texel_count()
    };
    let wide = below(hanging(0.6), glowing(false, None), None);
    let mut small = wide.clone();
    small.lights = vec![point_light(DVec3::Y * (HEIGHT_M - 1e-6), 1.0)];
    let texels = [wide, small].map(texels);
    assert!(8 * texels[0] <= texels[1], "{texels:?}");
}
