//! Objects on the device: materials, maps and what they are bound by.

use glam::DVec3;
use wgpu::util::DeviceExt;

use super::bindings::bind_group;
use super::maps::DeviceMap;
use super::textures::BaseColour;
use super::uniforms::{ObjectUniform, rgb};
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::illumination::IlluminationMap;
use crate::optics::LinearSrgb;
use crate::scene::{Material, Object, Scene, SurfaceKind};

/// One object, ready to be drawn.
#[derive(Debug)]
pub(super) struct DeviceObject {
    /// How its material is treated.
    pub(super) surface: SurfaceKind,
    pub(super) double_sided: bool,
    /// Middle of its box, by which clear objects are sorted [m].
    pub(super) centre: DVec3,
    /// Whether what it lets through keeps its colour.
    pub(super) is_grey: bool,
    uniform: ObjectUniform,
    base_colour_texture: Option<usize>,
    /// Group 1.
    pub(super) bind_group: Option<wgpu::BindGroup>,
}

/// All objects with the textures they share.
#[derive(Debug)]
pub(super) struct Objects {
    pub(super) list: Vec<DeviceObject>,
    textures: Vec<BaseColour>,
    white: BaseColour,
    no_map: DeviceMap,
    /// Largest radiance that any surface sends out by itself or from its map [W/(m² sr)].
    pub(super) peak_radiance: f64,
}

impl Objects {
    pub(super) fn new(gpu: &Gpu, scene: &Scene, layout: &wgpu::BindGroupLayout) -> Self {
        let mut objects = Self {
            list: scene
                .objects
                .iter()
                .map(|object| DeviceObject::new(scene, object))
                .collect(),
            textures: scene
                .textures
                .iter()
                .map(|texture| BaseColour::new(gpu, texture))
                .collect(),
            white: BaseColour::white(gpu),
            no_map: DeviceMap::black(gpu),
            peak_radiance: 0.0,
        };
        objects.bind(gpu, layout, Vec::new());
        objects
    }

    /// Replaces all maps; objects without one turn dark.
    ///
    /// # Errors
    /// A map of an object that the scene lacks, or one larger than the device's textures; the old maps stay.
    pub(super) fn set_maps(
        &mut self,
        gpu: &Gpu,
        scene: &Scene,
        layout: &wgpu::BindGroupLayout,
        maps: &[IlluminationMap],
    ) -> Result<()> {
        let uploaded = maps
            .iter()
            .map(|map| {
                let index = map.chart.object;
                check_chart(scene, map)?;
                Ok((index, DeviceMap::new(gpu, &scene.objects[index].name, map)?))
            })
            .collect::<Result<Vec<_>>>()?;
        self.bind(gpu, layout, uploaded);
        Ok(())
    }

    fn bind(&mut self, gpu: &Gpu, layout: &wgpu::BindGroupLayout, maps: Vec<(usize, DeviceMap)>) {
        let mut map_of: Vec<Option<DeviceMap>> = self.list.iter().map(|_| None).collect();
        for (object, map) in maps {
            map_of[object] = Some(map);
        }
        self.peak_radiance = 0.0;
        for (object, map) in self.list.iter_mut().zip(&map_of) {
            let map = map.as_ref().unwrap_or(&self.no_map);
            let image = object
                .base_colour_texture
                .map_or(&self.white, |index| &self.textures[index]);
            object.uniform.irradiance_scale = map.irradiance_scale;
            self.peak_radiance = self.peak_radiance.max(object.peak_radiance(map));
            let uniform = gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some("object"),
                contents: bytemuck::bytes_of(&object.uniform),
                usage: wgpu::BufferUsages::UNIFORM,
            });
            let resources = [
                uniform.as_entire_binding(),
                wgpu::BindingResource::TextureView(&map.view),
                wgpu::BindingResource::TextureView(&image.view),
                wgpu::BindingResource::Sampler(&image.sampler),
            ];
            object.bind_group = Some(bind_group(gpu, "object", layout, resources));
        }
    }
}

impl DeviceObject {
    fn new(scene: &Scene, object: &Object) -> Self {
        let material = &scene.materials[object.material];
        let (low, high) = object.mesh.bounds().unwrap_or_default();
        let body_transmittance = rgb(body_transmittance(material, (high - low).min_element()));
        let base_colour = rgb(material.base_colour);
        let is_grey = |[r, g, b]: [f32; 3]| r == g && g == b;
        Self {
            surface: material.surface,
            double_sided: material.double_sided,
            centre: 0.5 * (low + high),
            is_grey: material.base_colour_texture.is_none()
                && is_grey(base_colour)
                && is_grey(body_transmittance),
            uniform: ObjectUniform {
                base_colour,
                irradiance_scale: 1.0,
                emitted_radiance: rgb(material.emitted_radiance),
                ior: material.ior as f32,
                body_transmittance,
                surface: surface_code(material.surface),
            },
            base_colour_texture: material.base_colour_texture.as_ref().map(|image| image.texture),
            bind_group: None,
        }
    }

    /// Bound on the radiance that leaves it, reflections aside [W/(m² sr)].
    fn peak_radiance(&self, map: &DeviceMap) -> f64 {
        let largest = |rgb: [f32; 3]| f64::from(rgb.into_iter().fold(0.0, f32::max));
        let diffuse = largest(self.uniform.base_colour) * f64::from(map.peak_w_m2) / std::f64::consts::PI;
        diffuse + largest(self.uniform.emitted_radiance)
    }
}

/// The shader's `SURFACE_*`.
fn surface_code(surface: SurfaceKind) -> u32 {
    match surface {
        SurfaceKind::Diffuse => 0,
        SurfaceKind::Mirror => 1,
        SurfaceKind::Dielectric => 2,
        SurfaceKind::ThinWall => 3,
        SurfaceKind::Mixed => 4,
    }
}

/// What a body lets through along its thinnest extent [m], standing in for the path that is not traced.
fn body_transmittance(material: &Material, thickness_m: f64) -> LinearSrgb {
    match material.volume {
        Some(volume) if volume.attenuation_distance_m.is_finite() && volume.attenuation_distance_m > 0.0 => {
            volume
                .attenuation_colour
                .map(|colour| colour.powf(thickness_m / volume.attenuation_distance_m))
        }
        _ => LinearSrgb::WHITE,
    }
}

/// Maps come from files too: one of another scene must be refused, not drawn.
fn check_chart(scene: &Scene, map: &IlluminationMap) -> Result<()> {
    let belongs = scene.objects.get(map.chart.object).is_some_and(|object| {
        scene.materials[object.material].surface.is_receiver()
            && object.mesh.triangles.len() == map.chart.corner_uvs.len()
    });
    if belongs {
        return Ok(());
    }
    Err(Error::failure(
        format!("map of object {}", map.chart.object),
        format!("does not belong to the scene {}", scene.name),
        "bake the scene again",
    ))
}
