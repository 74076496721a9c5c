//! Pictures of scenes whose radiance is known.

use std::sync::Arc;

use glam::DVec2;
use nephroid::effect::{Effect, EffectSwitch, EffectSwitches};
use nephroid::eye_pass::renderer::{Renderer, render_counted, render_offscreen, render_sampled};
use nephroid::eye_pass::{Picture, View};
use nephroid::gpu::Gpu;
use nephroid::illumination::IlluminationMap;
use nephroid::optics::{LinearSrgb, fresnel};
use nephroid::scene::{Material, Scene, SurfaceKind};

use crate::device::gpu;
use crate::scenes::{
    diffuse, floor, floor_map, floor_scene, four_colours, from_above, lambert, texture_reference,
};

/// Rounding of one half float, relative; the map and the picture are one each.
const HALF_ROUNDING: f64 = 1.0 / 2048.0;

fn render(gpu: &Gpu, scene: &Scene, maps: &[IlluminationMap], view: &View) -> Picture {
    let picture = render_offscreen(gpu, scene, maps, view).expect("it renders");
    assert_eq!(gpu.take_error(), None);
    assert_eq!(picture.radiance.len(), (view.width * view.height) as usize);
    picture
}

#[track_caller]
fn assert_close(found: [f32; 3], expected: [f64; 3], relative: f64) {
    for channel in 0..3 {
        let (found, expected) = (f64::from(found[channel]), expected[channel]);
        assert!(
            (found - expected).abs() <= relative * expected.abs(),
            "{found} instead of {expected}"
        );
    }
}

#[test]
fn an_empty_scene_shows_the_background() {
    let Some(gpu) = gpu() else { return };
    let background = LinearSrgb::new(0.25, 3.0, 1e5);
    // A width whose rows are no multiple of the copy's alignment.
    let view = View {
        width: 7,
        height: 3,
        background,
        ..from_above(1)
    };
    for samples_per_side in [1, 2, 3] {
        let picture =
            render_sampled(&gpu, &Scene::default(), &[], &view, samples_per_side).expect("it renders");
        assert_eq!(picture.radiance.len(), 21);
        for pixel in picture.radiance {
            assert_close(pixel, background.to_array(), HALF_ROUNDING);
        }
    }
    assert_eq!(gpu.take_error(), None);
}

#[test]
fn a_uniformly_lit_floor_sends_albedo_times_irradiance_over_pi() {
    let Some(gpu) = gpu() else { return };
    let albedo = LinearSrgb::new(0.8, 0.5, 0.25);
    let scene = floor_scene(diffuse(albedo));
    let irradiance = [3.0_f32, 1.0, 0.125];
    let maps = [floor_map(0, 3, 5, vec![irradiance; 15])];
    let picture = render(&gpu, &scene, &maps, &from_above(16));
    let expected = [lambert(0.8, 3.0), lambert(0.5, 1.0), lambert(0.25, 0.125)];
    for pixel in picture.radiance {
        assert_close(pixel, expected, 2.0 * HALF_ROUNDING);
    }
}

#[test]
fn layers_of_a_map_add_up() {
    let Some(gpu) = gpu() else { return };
    let scene = floor_scene(diffuse(LinearSrgb::WHITE));
    let mut map = floor_map(0, 1, 1, vec![[1.0; 3]]);
    let mut direct = map.layers[0].clone();
    direct.kind = nephroid::settings::LayerKind::Direct;
    direct.irradiance = vec![[2.0; 3]];
    map.layers.push(direct);
    let picture = render(&gpu, &scene, &[map], &from_above(2));
    assert_close(picture.radiance[0], [lambert(1.0, 3.0); 3], 2.0 * HALF_ROUNDING);
}

#[test]
fn peaks_beyond_half_floats_and_what_is_dim_beside_them_both_survive() {
    let Some(gpu) = gpu() else { return };
    let scene = floor_scene(diffuse(LinearSrgb::WHITE));
    let maps = [floor_map(0, 2, 1, vec![[1e6; 3], [0.5; 3]])];
    let picture = render(&gpu, &scene, &maps, &from_above(8));
    // Outermost pixels lie beyond the texel centres, where nothing is interpolated.
    assert_close(picture.radiance[0], [lambert(1.0, 1e6); 3], 2.0 * HALF_ROUNDING);
    assert_close(picture.radiance[7], [lambert(1.0, 0.5); 3], 2.0 * HALF_ROUNDING);
}

#[test]
fn a_bright_texel_shows_where_the_chart_puts_it() {
    let Some(gpu) = gpu() else { return };
    let scene = floor_scene(diffuse(LinearSrgb::WHITE));
    let (width, height, column, row) = (4, 8, 3, 1);
    let mut irradiance = vec![[0.0; 3]; width * height];
    irradiance[row * width + column] = [1.0; 3];
    let view = from_above(64);
    let picture = render(&gpu, &scene, &[floor_map(0, width, height, irradiance)], &view);
    let (mut sum, mut weight) = (DVec2::ZERO, 0.0);
    for (index, pixel) in picture.radiance.iter().enumerate() {
        let uv = DVec2::new((index % 64) as f64 + 0.5, (index / 64) as f64 + 0.5) / 64.0;
        // Bilinear between texel centres, held at the border: hats of one texel's width.
        let texel = uv * DVec2::new(width as f64, height as f64) - 0.5;
        let across = (1.0 - (texel.x.clamp(0.0, width as f64 - 1.0) - column as f64).abs()).max(0.0);
        let down = (1.0 - (texel.y.clamp(0.0, height as f64 - 1.0) - row as f64).abs()).max(0.0);
        let expected = lambert(1.0, across * down);
        let found = f64::from(pixel[0]);
        assert!(
            (found - expected).abs() <= 1e-3,
            "{uv}: {found} instead of {expected}"
        );
        sum += uv * found;
        weight += found;
    }
    assert!(weight > 0.0);
    let centre = sum / weight;
    assert!(centre.x > 0.75 && centre.y > 0.1 && centre.y < 0.3, "{centre}");
}

#[test]
fn base_colour_images_multiply_and_lie_as_gltf_says() {
    let Some(gpu) = gpu() else { return };
    let mut scene = floor_scene(Material {
        base_colour_texture: Some(texture_reference()),
        ..diffuse(LinearSrgb::grey(0.5))
    });
    scene.textures.push(four_colours().into());
    let maps = [floor_map(0, 1, 1, vec![[1.0; 3]])];
    let picture = render(&gpu, &scene, &maps, &from_above(8));
    let at = |x: usize, y: usize| picture.radiance[y * 8 + x];
    let half = lambert(0.5, 1.0);
    for ((x, y), expected) in [
        ((0, 0), [half, 0.0, 0.0]),
        ((7, 0), [0.0, half, 0.0]),
        ((0, 7), [0.0, 0.0, half]),
        ((7, 7), [half, half, half]),
    ] {
        assert_close(at(x, y), expected, 2.0 * HALF_ROUNDING);
    }
}

#[test]
fn surfaces_without_a_map_are_black_and_emission_shows() {
    let Some(gpu) = gpu() else { return };
    let scene = floor_scene(diffuse(LinearSrgb::WHITE));
    let mut view = from_above(4);
    view.background = LinearSrgb::grey(1.0);
    assert_eq!(render(&gpu, &scene, &[], &view).radiance, vec![[0.0; 3]; 16]);

    let emitted = LinearSrgb::new(2.0, 0.0, 7.0);
    let scene = floor_scene(Material {
        emitted_radiance: emitted,
        ..diffuse(LinearSrgb::WHITE)
    });
    for pixel in render(&gpu, &scene, &[], &view).radiance {
        assert_close(pixel, emitted.to_array(), HALF_ROUNDING);
    }
}

#[test]
fn the_nearer_floor_hides_the_farther_one_whatever_their_order() {
    let Some(gpu) = gpu() else { return };
    for (first, second) in [(0.0, 1e-4), (1e-4, 0.0)] {
        let mut scene = floor_scene(diffuse(LinearSrgb::WHITE));
        scene.objects = vec![floor("first", 0, first), floor("second", 0, second)];
        let upper = if first > second { 0 } else { 1 };
        let map = |object| floor_map(object, 1, 1, vec![[if object == upper { 1.0 } else { 0.25 }; 3]]);
        let picture = render(&gpu, &scene, &[map(0), map(1)], &from_above(8));
        for pixel in picture.radiance {
            assert_close(pixel, [lambert(1.0, 1.0); 3], 2.0 * HALF_ROUNDING);
        }
    }
}

#[test]
fn a_pane_dims_what_is_behind_it_by_its_transmittance() {
    let Some(gpu) = gpu() else { return };
    let tint = LinearSrgb::new(1.0, 0.5, 0.25);
    let mut scene = floor_scene(diffuse(LinearSrgb::WHITE));
    scene.materials.push(Material {
        surface: SurfaceKind::ThinWall,
        base_colour: tint,
        ior: 1.5,
        ..Default::default()
    });
    scene.objects.insert(0, floor("pane", 1, 0.5));
    // A map on the floor only; the view's background is black, and so is what the pane reflects upwards.
    let picture = render(
        &gpu,
        &scene,
        &[floor_map(1, 1, 1, vec![[1.0; 3]])],
        &from_above(65),
    );
    let transmittance = 1.0 - fresnel::thin_wall_reflectance(1.0, 1.5);
    let centre = picture.radiance[65 * 32 + 32];
    assert_close(
        centre,
        tint.to_array()
            .map(|channel| channel * transmittance * lambert(1.0, 1.0)),
        4.0 * HALF_ROUNDING,
    );
}

#[test]
fn radiance_falls_by_the_square_of_the_index_into_a_body_and_rises_out_of_it() {
    let Some(gpu) = gpu() else { return };
    let water = Material {
        surface: SurfaceKind::Dielectric,
        ior: 1.33,
        base_colour: LinearSrgb::WHITE,
        ..Default::default()
    };
    let mut scene = floor_scene(diffuse(LinearSrgb::WHITE));
    scene.materials.push(water);
    scene.objects.push(floor("surface of water", 1, 0.5));
    let maps = [floor_map(0, 1, 1, vec![[1.0; 3]])];
    let centre = |scene: &Scene| render(&gpu, scene, &maps, &from_above(65)).radiance[65 * 32 + 32];
    let transmittance = 1.0 - fresnel::dielectric_reflectance(1.0, 1.33);
    let under_water = lambert(1.0, 1.0) * transmittance / (1.33 * 1.33);
    assert_close(centre(&scene), [under_water; 3], 4.0 * HALF_ROUNDING);

    // A second face, looking down: the floor lies below a slab. Light that goes to and fro within it adds up to the
    // transmittance of all orders, of which the device follows those of two surfaces both ways.
    let lower = floor("lower face", 1, 0.25);
    let mesh = Arc::make_mut(&mut scene.objects[1].mesh);
    let triangles = lower.mesh.triangles.iter();
    mesh.triangles
        .extend(triangles.map(|&[a, b, c]| [a + 4, c + 4, b + 4]));
    mesh.positions.extend(&lower.mesh.positions);
    mesh.normals.extend([-glam::DVec3::Y; 4]);
    mesh.uv0 = None;
    let reflectance = 1.0 - transmittance;
    let once = lambert(1.0, 1.0) * transmittance * transmittance;
    let all_orders = once / (1.0 - reflectance * reflectance);
    let found = f64::from(centre(&scene)[0]);
    assert!(
        (once * 0.999..=all_orders * 1.001).contains(&found),
        "{found} is not between {once} and {all_orders}"
    );
}

#[test]
fn maps_can_be_replaced_and_bad_ones_leave_the_old_in_place() {
    let Some(gpu) = gpu() else { return };
    let scene = floor_scene(diffuse(LinearSrgb::WHITE));
    let mut renderer =
        Renderer::new(&gpu, &scene, wgpu::TextureFormat::Rgba8Unorm, 4).expect("the scene is uploaded");
    let mut shown = |maps: &[IlluminationMap]| {
        let set = renderer.set_maps(&gpu, &scene, maps);
        (
            set,
            renderer
                .radiance(&gpu, &from_above(4))
                .expect("it renders")
                .radiance[5],
        )
    };
    let (set, pixel) = shown(&[floor_map(0, 1, 1, vec![[1.0; 3]])]);
    assert!(set.is_ok());
    assert_close(pixel, [lambert(1.0, 1.0); 3], 2.0 * HALF_ROUNDING);
    let (set, pixel) = shown(&[floor_map(1, 1, 1, vec![[5.0; 3]])]);
    assert!(set.is_err());
    assert_close(pixel, [lambert(1.0, 1.0); 3], 2.0 * HALF_ROUNDING);
    // Larger than any texture of the device: tiles hold it all the same.
    let (set, pixel) = shown(&[floor_map(0, 1 << 20, 1, vec![[5.0; 3]; 1 << 20])]);
    assert!(set.is_ok());
    assert_close(pixel, [lambert(1.0, 5.0); 3], 2.0 * HALF_ROUNDING);
    let (set, pixel) = shown(&[]);
    assert!(set.is_ok());
    assert_eq!(pixel, [0.0; 3]);
    assert_eq!(gpu.take_error(), None);
}

#[test]
fn pictures_that_no_device_holds_are_refused() {
    let Some(gpu) = gpu() else { return };
    let view = View {
        width: 1 << 24,
        ..from_above(1)
    };
    let error = render_offscreen(&gpu, &Scene::default(), &[], &view).expect_err("too wide");
    assert!(error.to_string().starts_with("picture: 16777216×1 "), "{error}");
    let empty = View {
        width: 0,
        ..from_above(1)
    };
    assert!(render_offscreen(&gpu, &Scene::default(), &[], &empty).is_err());
    assert!(Renderer::new(&gpu, &Scene::default(), wgpu::TextureFormat::Rgba8Unorm, 3).is_err());
    assert_eq!(gpu.take_error(), None);
}

#[test]
fn a_tint_next_to_white_changes_next_to_nothing() {
    let Some(gpu) = gpu() else { return };
    let picture = |tint: LinearSrgb| {
        let mut scene = floor_scene(diffuse(LinearSrgb::WHITE));
        let glass = Material {
            surface: SurfaceKind::Dielectric,
            base_colour: tint,
            ..Default::default()
        };
        scene.materials.push(glass);
        scene.objects.push(floor("glass", 1, 0.5));
        let mut view = from_above(33);
        view.camera.vertical_fov_rad = 2.5;
        view.background = LinearSrgb::grey(0.25);
        render(&gpu, &scene, &[floor_map(0, 1, 1, vec![[1.0; 3]])], &view)
    };
    // A tint of one part in ten million.
    let (grey, tinted) = (
        picture(LinearSrgb::WHITE),
        picture(LinearSrgb::new(1.0, 1.0, 1.0 - 1e-7)),
    );
    for (a, b) in grey.radiance.iter().zip(&tinted.radiance) {
        assert_close(*a, b.map(f64::from), 4.0 * HALF_ROUNDING);
    }
}

#[test]
fn meshes_beyond_a_small_devices_buffers_are_drawn_whole() {
    let Some(gpu) = gpu() else { return };
    let small = Gpu::headless_within(|limits| wgpu::Limits {
        max_buffer_size: 1 << 16,
        ..limits
    })
    .expect("less is always granted");
    // 64 × 64 quads: 24576 corners of 32 bytes against 65536 bytes.
    let quads = 64_u32;
    let mut scene = floor_scene(diffuse(LinearSrgb::WHITE));
    let mesh = Arc::make_mut(&mut scene.objects[0].mesh);
    let side = quads + 1;
    let points = (0..side * side).map(|index| DVec2::new(f64::from(index % side), f64::from(index / side)));
    let uvs: Vec<DVec2> = points.map(|point| point / f64::from(quads)).collect();
    mesh.positions = uvs.iter().map(|uv| glam::DVec3::new(uv.x, 0.0, uv.y)).collect();
    mesh.normals = vec![glam::DVec3::Y; uvs.len()];
    mesh.triangles = (0..quads * quads)
        .flat_map(|quad| {
            let corner = quad / quads * side + quad % quads;
            [
                [corner, corner + side + 1, corner + 1],
                [corner, corner + side, corner + side + 1],
            ]
        })
        .collect();
    let corner_uvs = mesh
        .triangles
        .iter()
        .map(|triangle| triangle.map(|vertex| uvs[vertex as usize]))
        .collect();
    mesh.uv0 = Some(uvs);
    // A second, clear one above it shares its corners between triangles.
    let mut pane = scene.objects[0].clone();
    Arc::make_mut(&mut pane.mesh)
        .positions
        .iter_mut()
        .for_each(|position| position.y = 0.5);
    pane.material = 1;
    scene.objects.push(pane);
    scene.materials.push(Material {
        surface: SurfaceKind::ThinWall,
        ..Default::default()
    });

    let texels = (0..64).map(|index| [index as f32; 3]).collect();
    let mut map = floor_map(0, 8, 8, texels);
    let chart = nephroid::illumination::Chart {
        corner_uvs,
        ..(*map.chart).clone()
    };
    map.chart = Arc::new(chart);
    let whole = render(&gpu, &scene, std::slice::from_ref(&map), &from_above(48));
    let lit = whole.radiance.iter().filter(|pixel| pixel[0] > 0.0);
    assert!(lit.count() > 48 * 48 * 9 / 10);
    // Chains need all of a scene at a time: without them the pane is left out, and that is said.
    let maps = [map];
    let mut renderer =
        Renderer::new(&small, &scene, wgpu::TextureFormat::Rgba8Unorm, 1).expect("it is uploaded");
    renderer.set_maps(&small, &scene, &maps).expect("the maps fit");
    let shown = renderer.radiance(&small, &from_above(48)).expect("it renders");
    let refusal = renderer
        .chain_refusal()
        .expect("the scene is too large")
        .to_string();
    assert!(
        refusal.contains("reads 64 KiB at a time, and 16384 triangles take more"),
        "{refusal}"
    );
    assert_eq!(renderer.counts().specular_pipelines, 0);
    let off = EffectSwitches::default().with(Effect::Chains, EffectSwitch::Off);
    let (bare, _) = render_counted(&gpu, &scene, &maps, &from_above(48), 1, &off).expect("it renders");
    assert_eq!(shown.radiance, bare.radiance);
    assert_eq!(small.take_error(), None);
}
