//! Small scenes and pictures shared by the tests.

use nephroid::eye_pass::reference::{ChainLimits, EyeRays, ReferenceSettings, render_counted};
use nephroid::eye_pass::ToneMap;
use nephroid::illumination::{Chart, Layer, Receiver, UvSet, parametrise};
use nephroid::light_pass::direct::{DirectLayer, bake_direct};
use nephroid::scene::{Environment, Glow, Object, PanelShape, Volume};

use crate::floors::texture_reference;
use crate::prelude::*;

/// A scene of meshes, each with its own material.
pub fn scene(parts: Vec<(Mesh, Material)>, lights: Vec<Light>) -> Scene {
    let mut scene = Scene {
        name: "test".into(),
        lights,
        ..Scene::default()
    };
    for (index, (mesh, material)) in parts.into_iter().enumerate() {
        scene
            .objects
            .push(Object::new(format!("object {index}"), (index, 0), index, mesh));
        scene.materials.push(material);
    }
    scene
}

pub fn tracer(parts: Vec<(Mesh, Material)>, lights: Vec<Light>) -> Tracer {
    Tracer::new(Arc::new(scene(parts, lights)))
}

pub fn surface(surface: SurfaceKind, ior: f64) -> Material {
    Material {
        surface,
        ior,
        roughness: if surface.is_specular() { 0.0 } else { 1.0 },
        base_colour: LinearSrgb::WHITE,
        ..Material::default()
    }
}

/// A Lambertian surface with an albedo.
pub fn diffuse(albedo: f64) -> Material {
    Material {
        base_colour: LinearSrgb::grey(albedo),
        ..Material::default()
    }
}

pub fn light(kind: LightKind) -> Light {
    Light {
        name: "light".into(),
        colour: LinearSrgb::WHITE,
        spectrum: None,
        kind,
        size: LightSize::None,
    }
}

pub fn point_light(position: DVec3, intensity: f64) -> Light {
    light(LightKind::Point {
        position,
        intensity: RadiantIntensity(intensity),
    })
}

pub fn sun(direction: DVec3, normal_irradiance: f64) -> Light {
    light(LightKind::Sun {
        direction: direction.normalize(),
        normal_irradiance: Irradiance(normal_irradiance),
    })
}

/// A spot, with the angles of its inner and its outer cone [rad].
pub fn spot(position: DVec3, direction: DVec3, intensity: f64, cones_rad: [f64; 2]) -> Light {
    light(LightKind::Spot {
        position,
        direction: direction.normalize(),
        intensity: RadiantIntensity(intensity),
        inner_cone_rad: cones_rad[0],
        outer_cone_rad: cones_rad[1],
    })
}

/// A panel, with its half sides.
pub fn panel(centre: DVec3, [across, down]: [DVec3; 2], shape: PanelShape, radiance: f64) -> Light {
    light(LightKind::Panel {
        centre,
        across,
        down,
        shape,
        radiance: Radiance(radiance),
    })
}

/// Lets an emissive object shine: evenly, or by an image, which becomes the texture of
/// [`texture_reference`](crate::floors::texture_reference) if there is none yet.
pub fn let_glow(scene: &mut Scene, object: usize, image: Option<Texture>) {
    if let Some(image) = image {
        let glow = Glow::new(scene.objects[object].in_scene(), &texture_reference(), &image);
        scene.glows.insert(object, Arc::new(glow.expect("it glows")));
        scene.textures.push(Arc::new(image));
    }
    let radiance = Radiance(scene.emitted_radiance(object).luminance());
    scene.lights.push(light(LightKind::Surface { object, radiance }));
}

/// A scene in the light of a sky alone.
pub fn under_sky(mut scene: Scene, sky: Option<Environment>, scale: f64) -> Scene {
    scene.environment = Some(Arc::new(sky.expect("a sound image")));
    scene.lights = vec![light(LightKind::Environment { scale })];
    scene
}

/// A material of which a body keeps a colour over a distance [m].
pub fn tinted(material: Material, attenuation_distance_m: f64, attenuation_colour: LinearSrgb) -> Material {
    Material {
        volume: Some(Volume {
            attenuation_distance_m,
            attenuation_colour,
        }),
        ..material
    }
}

/// A bulb, a sun and panels of both outlines: small ones, which shine down and towards +z.
pub fn lamps_of_all_kinds(place: DVec3) -> Vec<Light> {
    let sides = [DVec3::X * 0.06, dvec3(0.0, 0.05, 0.06)];
    let panel = |shape| panel(place, sides, shape, 40.0);
    let mut bulb = point_light(place, 2.0);
    bulb.size = LightSize::Radius { radius_m: 0.04 };
    let mut sun = sun(dvec3(0.0, -0.6, 0.8), 3.0);
    sun.size = LightSize::Angle { diameter_rad: 0.05 };
    vec![bulb, sun, panel(PanelShape::Rectangle), panel(PanelShape::Disc)]
}

/// A wave that stands still.
pub fn wave(amplitude_m: f64, wavelength_m: f64, direction: DVec3, phase_rad: f64) -> Wave {
    Wave {
        amplitude_m,
        wavelength_m,
        direction: direction.normalize(),
        phase_rad,
        period_s: 0.0,
    }
}

/// The chart of an object in a tracer's scene.
pub fn chart(tracer: &Tracer, object: usize, width: usize, height: usize) -> Chart {
    parametrise(object, tracer.scene().objects[object].mesh_in_scene())
        .expect("the object has area")
        .chart(width, height)
}

/// The direct layer of an object.
pub fn direct(tracer: &Tracer, chart: &Chart) -> DirectLayer {
    let layer = bake_direct(tracer, &tracer.scene().lights, &[(chart, None)], &(), &Control::default())
        .pop()
        .expect("one layer per chart");
    assert!(layer.complete);
    assert_eq!(layer.irradiance.len(), chart.width * chart.height);
    layer
}

/// Flux on the whole surface in the first channel [W].
pub fn flux_w(chart: &Chart, layer: &DirectLayer) -> f64 {
    layer
        .irradiance
        .iter()
        .enumerate()
        .map(|(texel, e)| f64::from(e[0]) * chart.texel_area_m2(texel))
        .sum()
}

/// A chart of object 0 by generated coordinates of its triangles.
pub fn chart_of(
    corner_uvs: Vec<[DVec2; 3]>,
    (width, height): (usize, usize),
    texel_areas_m2: Vec<f64>,
) -> Chart {
    Chart {
        receiver: Receiver::front(0),
        uv_set: UvSet::Generated,
        corner_uvs,
        width,
        height,
        texel_areas_m2,
        layout: None,
        beyond: Vec::new(),
        joints: Vec::new(),
        islands: std::sync::OnceLock::new(),
    }
}

/// A map with one layer.
pub fn map_of(chart: impl Into<Arc<Chart>>, irradiance: Vec<[f32; 3]>) -> IlluminationMap {
    IlluminationMap {
        chart: chart.into(),
        layers: vec![Layer {
            kind: LayerKind::Caustic,
            irradiance,
        }],
        error: None,
        estimated_relative_rmse: None,
        estimated_visible: None,
    }
}

/// A view with a black background and without tone mapping.
pub fn view(eye: DVec3, target: DVec3, fov_rad: f64, size: [u32; 2]) -> View {
    view_of(Camera::look_at("eye", eye, target, fov_rad), size)
}

/// A camera's view with a black background and without tone mapping.
pub fn view_of(camera: Camera, size: [u32; 2]) -> View {
    View {
        tone_map: ToneMap::None,
        ..View::new(camera, size)
    }
}

/// Settings of the CPU eye pass with other limits of chains.
pub fn limited(change: impl FnOnce(&mut ChainLimits)) -> ReferenceSettings {
    let mut settings = ReferenceSettings::default();
    change(&mut settings.limits);
    settings
}

/// Settings that follow every chain to its end: what is left out is below a billionth.
pub fn to_the_end(samples_per_side: u32) -> ReferenceSettings {
    ReferenceSettings {
        samples_per_side,
        ..limited(|limits| (limits.max_depth, limits.branch_threshold) = (64, 1e-10))
    }
}

/// The picture of the CPU eye pass and the rays traced for it.
pub fn seen(
    tracer: &Tracer,
    maps: &[IlluminationMap],
    view: &View,
    settings: &ReferenceSettings,
) -> (Picture, EyeRays) {
    render_counted(tracer, maps, view, settings, &(), &Control::default()).expect("nobody cancels")
}

/// The bits of a picture, for exact comparison.
pub fn bits(picture: &Picture) -> Vec<u32> {
    let channels = picture.radiance.iter().flatten();
    channels.map(|channel| channel.to_bits()).collect()
}

/// Centres of the pixels of a square picture, or of the texels of a square map, in the unit square, row by row.
pub fn middles(side: usize) -> impl Iterator<Item = DVec2> {
    let at = move |index: usize| (index as f64 + 0.5) / side as f64;
    (0..side * side).map(move |index| dvec2(at(index % side), at(index / side)))
}
