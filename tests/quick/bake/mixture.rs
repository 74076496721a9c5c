//! Surfaces that change from place to place are the sum of their parts.

use nephroid::optics::Glass;
use nephroid::scene::Variation;
use support::floors::{image, texture_reference};
use support::meshes::{floor, quad};
use support::scenes::{chart, direct, flux_w, let_glow, scene};
use support::tools::{bake, caustic, energy_fault, photons};

use crate::prelude::*;

/// Texels along a side of the image, and of each of its squares: an even number of them, so that light and dark ones are
/// each other's mirror images.
const TEXELS: usize = 256;
const SQUARE: usize = 64;

/// A chessboard of two texels, or all of one.
fn board(of: impl Fn(bool) -> [u8; 4]) -> Texture {
    let is_light = |texel: usize| (texel % TEXELS / SQUARE + texel / TEXELS / SQUARE).is_multiple_of(2);
    let rgba = (0..TEXELS * TEXELS).map(|texel| of(is_light(texel)));
    image(TEXELS as u32, rgba.collect(), Wrap::ClampToEdge)
}

/// A plate of the material, with the image, between a floor and a ceiling under which a lamp hangs.
fn lit(material: Material, image: Texture) -> Scene {
    let mut scene = Scene::default();
    parts::add(&mut scene, "plate", floor(0.5, 0.0), material);
    parts::add(&mut scene, "floor", floor(4.0, -1.0), Material::default());
    let ceiling = quad(dvec3(-4.0, 1.5, -4.0), DVec3::Z * 8.0, DVec3::X * 8.0);
    parts::add(&mut scene, "ceiling", ceiling, Material::default());
    scene.textures.push(Arc::new(image));
    scene
        .lights
        .push(support::scenes::point_light(dvec3(0.0, 1.0, 0.0), 10.0));
    scene
}

/// What the plate takes part in, and the caustic light of floor and ceiling [W].
fn fluxes(scene: &Scene) -> [f64; 3] {
    let result = bake(scene.clone(), &photons(3e5, 64));
    assert_eq!(energy_fault(&result), None);
    let on = |object: usize| -> f64 {
        let maps = result.maps.iter().filter(|map| map.chart.object() == object);
        maps.map(|map| {
            let light = caustic(map).into_iter().enumerate();
            light
                .map(|(texel, e)| e * map.chart.texel_area_m2(texel))
                .sum::<f64>()
        })
        .sum()
    };
    [result.ledgers[0].energy_w.emitted, on(1), on(2)]
}

/// By factors of the image.
fn varied(material: Material) -> Material {
    Material {
        surface: SurfaceKind::Varied,
        base_colour: LinearSrgb::WHITE,
        variation: Some(Variation {
            image: texture_reference(),
            surface: SurfaceKind::Varied,
        }),
        ..material
    }
}

/// Transmission, roughness and metallic of two kinds of squares, 0 or 255, and the factors that they multiply.
#[test]
fn boards_are_half_of_each_kind() {
    let of = |transmission, roughness, metallic| Material {
        transmission,
        roughness,
        metallic,
        ..Material::default()
    };
    for (what, material, light, dark) in [
        (
            "mirror and matte",
            varied(of(0.0, 1.0, 1.0)),
            [0, 0, 255, 255],
            [0, 255, 0, 255],
        ),
        (
            "mirror and coat",
            varied(of(0.0, 0.0, 1.0)),
            [0, 0, 255, 255],
            [0, 0, 0, 255],
        ),
        (
            "rough and smooth",
            varied(of(0.0, 0.5, 1.0)),
            [0, 255, 255, 255],
            [0, 0, 255, 255],
        ),
        (
            "clear and matte",
            varied(of(1.0, 0.4, 0.0)),
            [255; 4],
            [0, 255, 255, 255],
        ),
    ] {
        let scene = |of: &dyn Fn(bool) -> [u8; 4]| lit(material.clone(), board(of));
        let mixed = fluxes(&scene(&|is_light| if is_light { light } else { dark }));
        let [bright, dim] = [light, dark].map(|all| fluxes(&scene(&|_| all)));
        for (place, flux_w) in mixed.into_iter().enumerate() {
            let expected_w = 0.5 * (bright[place] + dim[place]);
            // Four standard errors of two hundred thousand photons.
            near(flux_w, expected_w, 0.01 * expected_w + 1e-3, (what, place));
        }
    }
}

/// There by the alpha of its image times a factor.
fn covered(factor: f64) -> Material {
    Material {
        coverage: Some(factor),
        base_colour_texture: Some(texture_reference()),
        roughness: 1.0,
        surface: SurfaceKind::Varied,
        ..Material::default()
    }
}

/// What is there in part lets the rest of direct light pass, of a point and of a ball.
#[test]
fn shadows_of_boards_are_half_of_each_kind() {
    for size in [LightSize::None, LightSize::Radius { radius_m: 0.1 }] {
        let shone_w = |factor: f64, of: &dyn Fn(bool) -> u8| {
            let image = board(|is_light| [255, 255, 255, of(is_light)]);
            let mut scene = lit(covered(factor), image);
            scene.lights[0].size = size;
            let tracer = Tracer::new(Arc::new(scene));
            let chart = chart(&tracer, 1, 64, 64);
            flux_w(&chart, &direct(&tracer, &chart))
        };
        let (shut_w, open_w) = (shone_w(1.0, &|_| 255), shone_w(1.0, &|_| 0));
        let mixed_w = shone_w(1.0, &|is_light| if is_light { 255 } else { 0 });
        let quarter_w = shone_w(0.25, &|_| 255);
        near(mixed_w, 0.5 * (shut_w + open_w), 0.01 * open_w, "half of each");
        near(
            quarter_w,
            0.25 * shut_w + 0.75 * open_w,
            1e-3 * open_w,
            "a quarter",
        );
        assert!(shut_w < 0.9 * open_w);
    }
}

/// By an image that is the same everywhere, glass disperses as it does without one.
#[test]
fn glass_that_varies_disperses() {
    let lit_by = |change: fn(Material) -> Material| {
        let mut glass = parts::dielectric("glass", 1.5);
        glass.set_glass(Arc::new(Glass::with_abbe_number(1.5, 20.0)));
        let mut scene = Scene::default();
        let ball = shapes::sphere(dvec3(0.0, 0.5, 0.0), 0.3, 4);
        parts::add(&mut scene, "ball", ball, change(glass));
        parts::add(&mut scene, "floor", floor(1.0, 0.0), Material::default());
        scene.textures.push(Arc::new(board(|_| [255; 4])));
        let lamp = support::scenes::point_light(dvec3(0.0, 3.0, 0.0), 10.0);
        scene.lights.push(lamp);
        let result = bake(scene, &photons(1e5, 32));
        let floor = result.maps.iter().find(|map| map.chart.object() == 1);
        floor.cloned().expect("a lit floor").layers[0].irradiance.clone()
    };
    let (plain, by_image) = (lit_by(|glass| glass), lit_by(varied));
    assert!(plain.iter().any(|[red, _, blue]| (red - blue).abs() > 0.2 * red));
    assert!(plain == by_image);
}

/// Flux on a floor under a lamp of radiance 10 W/(m² sr) where its image is white [W].
fn shone_by(image: Option<Texture>) -> f64 {
    let lamp = Material {
        emitted_radiance: LinearSrgb::grey(10.0),
        emission_texture: image.is_some().then(texture_reference),
        double_sided: false,
        ..Material::default()
    };
    let hanging = quad(dvec3(-0.5, 1.0, -0.5), DVec3::Z, DVec3::X);
    let mut scene = scene(
        vec![(floor(2.0, 0.0), Material::default()), (hanging, lamp)],
        vec![],
    );
    let_glow(&mut scene, 1, image);
    let tracer = Tracer::new(Arc::new(scene));
    let chart = chart(&tracer, 0, 16, 16);
    flux_w(&chart, &direct(&tracer, &chart))
}

/// Over a mirror, most places of which are black.
#[test]
fn lamps_that_are_mostly_black_shine() {
    let mut image = board(|_| [0, 0, 0, 255]);
    image.rgba[..4 * TEXELS].fill([255; 4]);
    let mut scene = lit(parts::mirror(), image.clone());
    let lamp = &mut scene.materials[2];
    lamp.emitted_radiance = LinearSrgb::grey(10.0);
    lamp.emission_texture = Some(texture_reference());
    scene.lights.clear();
    let_glow(&mut scene, 2, Some(image));
    let result = bake(scene, &photons(3e5, 16));
    assert_eq!(energy_fault(&result), None);
    assert!(result.ledgers[0].energy_w.emitted > 0.0);
}

#[test]
fn glowing_boards_are_half_of_each_kind() {
    let (light, dark) = ([255; 4], [99, 99, 99, 255]);
    let mixed_w = shone_by(Some(board(|is_light| if is_light { light } else { dark })));
    let [bright_w, dim_w] = [light, dark].map(|all| shone_by(Some(board(|_| all))));
    near(bright_w, shone_by(None), 1e-9 * bright_w, "a white image is none");
    near(
        dim_w / bright_w,
        LinearSrgb::decode_channel(99),
        1e-3,
        "as bright as its image",
    );
    near(mixed_w, 0.5 * (bright_w + dim_w), 0.02 * mixed_w, "half of each");
}
