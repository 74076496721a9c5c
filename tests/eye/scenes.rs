//! Small scenes that the tests share.

use std::sync::Arc;

use glam::DVec3;
use nephroid::illumination::parametrisation::DEFAULT_NOMINAL_SIDE;
use nephroid::illumination::{Chart, parametrise};
use nephroid::light_pass::direct::{DirectLayer, bake_direct};
use nephroid::optics::LinearSrgb;
use nephroid::progress::Control;
use nephroid::scene::{Light, LightKind, Material, Mesh, Object, Scene, SurfaceKind};
use nephroid::transport::Tracer;
use nephroid::units::{Irradiance, RadiantIntensity};

/// A scene of meshes, each with its own material.
pub fn scene(parts: Vec<(Mesh, Material)>, lights: Vec<Light>) -> Scene {
    let mut scene = Scene {
        name: "test".into(),
        lights,
        ..Scene::default()
    };
    for (index, (mesh, material)) in parts.into_iter().enumerate() {
        scene.objects.push(Object {
            name: format!("object {index}"),
            node: index,
            primitive: 0,
            material: index,
            mesh: mesh.into(),
        });
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
        base_colour: LinearSrgb::WHITE,
        ..Material::default()
    }
}

/// Lambert of an albedo.
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
        size: nephroid::scene::LightSize::None,
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

/// The chart of an object of a tracer's scene.
pub fn chart(tracer: &Tracer, object: usize, width: usize, height: usize) -> Chart {
    parametrise(object, &tracer.scene().objects[object].mesh, DEFAULT_NOMINAL_SIDE)
        .expect("the object has area")
        .chart(width, height)
}

/// The direct layer of an object.
pub fn direct(tracer: &Tracer, chart: &Chart) -> DirectLayer {
    let layer = bake_direct(tracer, &tracer.scene().lights, &[chart], &(), &Control::default())
        .pop()
        .expect("one layer per chart");
    assert!(layer.complete);
    assert_eq!(layer.irradiance.len(), chart.width * chart.height);
    layer
}

/// Flux on a whole surface [W], by the first channel.
pub fn flux_w(chart: &Chart, layer: &DirectLayer) -> f64 {
    layer
        .irradiance
        .iter()
        .enumerate()
        .map(|(texel, e)| f64::from(e[0]) * chart.texel_area_m2(texel))
        .sum()
}
