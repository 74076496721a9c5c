//! Objects on the device: materials, maps and what they are bound by.

use std::sync::Arc;

use glam::DVec3;
use wgpu::util::DeviceExt;

use super::bindings::bind_group;
use super::maps::{DeviceMap, ShownMap};
use super::textures::BaseColour;
use super::tiles::Uploaded;
use super::uniforms::{ObjectUniform, rgb};
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::illumination::IlluminationMap;
use crate::optics::LinearSrgb;
use crate::scene::{Material, Object, Scene, SurfaceKind, Texture};

/// What an object looks like but for its map.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Look {
    /// How its material is treated.
    pub(super) surface: SurfaceKind,
    pub(super) double_sided: bool,
    /// Smallest box [m]; `None` without vertices.
    pub(super) bounds: Option<(DVec3, DVec3)>,
    /// Whether what it lets through keeps its colour.
    pub(super) is_grey: bool,
    uniform: ObjectUniform,
    base_colour_texture: Option<usize>,
}

/// One object, ready to be drawn.
#[derive(Debug)]
pub(super) struct DeviceObject {
    pub(super) look: Look,
    pub(super) map: Option<DeviceMap>,
    /// As `buffer` holds it.
    written: ObjectUniform,
    buffer: wgpu::Buffer,
    /// Group 1.
    pub(super) bind_group: wgpu::BindGroup,
}

/// What objects are bound with.
#[derive(Debug)]
struct Shared {
    layout: wgpu::BindGroupLayout,
    /// As `textures` hold them.
    sources: Vec<Arc<Texture>>,
    textures: Vec<BaseColour>,
    white: BaseColour,
    no_map: DeviceMap,
}

/// All objects with the textures they share.
#[derive(Debug)]
pub(super) struct Objects {
    pub(super) list: Vec<DeviceObject>,
    shared: Shared,
    /// Largest radiance that any surface sends out by itself or from its map [W/(m² sr)].
    pub(super) peak_radiance: f64,
}

impl Objects {
    pub(super) fn new(gpu: &Gpu, scene: &Scene, layout: &wgpu::BindGroupLayout) -> Self {
        let textures = scene.textures.iter();
        let shared = Shared {
            layout: layout.clone(),
            sources: scene.textures.clone(),
            textures: textures.map(|texture| BaseColour::new(gpu, texture)).collect(),
            white: BaseColour::white(gpu),
            no_map: DeviceMap::black(gpu),
        };
        let looks = scene.objects.iter().map(|object| Look::of(scene, object));
        let mut objects = Self {
            list: looks.map(|look| DeviceObject::new(gpu, &shared, look)).collect(),
            shared,
            peak_radiance: 0.0,
        };
        objects.find_peak();
        objects
    }

    /// Takes over an edited scene with as many objects; the maps stay.
    pub(super) fn set_scene(&mut self, gpu: &Gpu, scene: &Scene) -> Uploaded {
        let has_other_images = self.shared.sources.len() != scene.textures.len()
            || self
                .shared
                .sources
                .iter()
                .zip(&scene.textures)
                .any(|(a, b)| !Arc::ptr_eq(a, b));
        let mut uploaded = Uploaded::default();
        if has_other_images {
            self.shared.sources.clone_from(&scene.textures);
            let textures = scene.textures.iter();
            self.shared.textures = textures.map(|texture| BaseColour::new(gpu, texture)).collect();
            let texels = scene.textures.iter().map(|texture| texture.rgba.len());
            uploaded += Uploaded::other(4 * texels.sum::<usize>());
        }
        for (object, source) in self.list.iter_mut().zip(&scene.objects) {
            let look = Look::of(scene, source);
            let must_bind = has_other_images || look.base_colour_texture != object.look.base_colour_texture;
            object.look = look;
            uploaded += object.write_uniform(gpu);
            if must_bind {
                object.bind(gpu, &self.shared);
            }
        }
        self.find_peak();
        uploaded
    }

    /// Replaces all maps; objects without one turn dark. Only what differs from the maps before is uploaded.
    ///
    /// # Errors
    /// A map of an object that the scene lacks, or one larger than the device's textures; the old maps stay.
    pub(super) fn set_maps(&mut self, gpu: &Gpu, scene: &Scene, maps: &[ShownMap]) -> Result<Uploaded> {
        let mut map_of: Vec<Option<&ShownMap>> = vec![None; self.list.len()];
        for shown in maps {
            let map = shown.map;
            check_chart(scene, map)?;
            let index = map.chart.object;
            let name = format!("map of {}", scene.objects[index].name);
            gpu.check_texture_size(&name, map.width() as u32, map.height() as u32)?;
            map_of[index] = Some(shown);
        }
        let mut uploaded = Uploaded::default();
        for ((object, source), map) in self.list.iter_mut().zip(&scene.objects).zip(map_of) {
            uploaded += object.set_map(gpu, &self.shared, &source.name, map);
        }
        self.find_peak();
        Ok(uploaded)
    }

    /// Illumination maps on the device [bytes].
    pub(super) fn map_bytes(&self) -> u64 {
        let maps = self.list.iter().filter_map(|object| object.map.as_ref());
        maps.map(DeviceMap::bytes).sum()
    }

    fn find_peak(&mut self) {
        let peaks = self.list.iter().map(DeviceObject::peak_radiance);
        self.peak_radiance = peaks.fold(0.0, f64::max);
    }
}

impl Look {
    fn of(scene: &Scene, object: &Object) -> Self {
        let material = &scene.materials[object.material];
        let bounds = object.mesh.bounds();
        let (low, high) = bounds.unwrap_or_default();
        let body_transmittance = rgb(body_transmittance(material, (high - low).min_element()));
        let base_colour = rgb(material.base_colour);
        let is_grey = |[r, g, b]: [f32; 3]| r == g && g == b;
        Self {
            surface: material.surface,
            double_sided: material.double_sided,
            bounds,
            is_grey: material.base_colour_texture.is_none()
                && is_grey(base_colour)
                && is_grey(body_transmittance),
            uniform: ObjectUniform {
                base_colour,
                irradiance_scale: 1.0,
                emitted_radiance: rgb(material.emitted_radiance),
                ior: material.ior as f32,
                body_transmittance,
                padding: 0,
            },
            base_colour_texture: material.base_colour_texture.as_ref().map(|image| image.texture),
        }
    }

    /// Middle of its box, by which clear objects are sorted [m].
    pub(super) fn centre(&self) -> DVec3 {
        let (low, high) = self.bounds.unwrap_or_default();
        0.5 * (low + high)
    }

    pub(super) fn has_texture(&self) -> bool {
        self.base_colour_texture.is_some()
    }

    /// Whether it shows what is behind it.
    pub(super) fn is_clear(&self) -> bool {
        matches!(self.surface, SurfaceKind::Dielectric | SurfaceKind::ThinWall)
    }
}

impl DeviceObject {
    fn new(gpu: &Gpu, shared: &Shared, look: Look) -> Self {
        let written = ObjectUniform {
            irradiance_scale: shared.no_map.irradiance_scale,
            ..look.uniform
        };
        let buffer = gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("object"),
            contents: bytemuck::bytes_of(&written),
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        });
        Self {
            bind_group: bound(gpu, shared, &look, &buffer, &shared.no_map),
            look,
            map: None,
            written,
            buffer,
        }
    }

    /// Shows another map or none: in the same texture where it has the same size.
    fn set_map(&mut self, gpu: &Gpu, shared: &Shared, name: &str, map: Option<&ShownMap>) -> Uploaded {
        let mut uploaded = match (&mut self.map, map) {
            (Some(shown), Some(map)) if shown.has_size_of(map) => shown.update(gpu, map),
            (None, None) => Uploaded::default(),
            (_, map) => {
                let (shown, uploaded) = map.map(|map| DeviceMap::new(gpu, name, map)).unzip();
                self.map = shown;
                self.bind(gpu, shared);
                uploaded.unwrap_or_default()
            }
        };
        uploaded += self.write_uniform(gpu);
        uploaded
    }

    fn bind(&mut self, gpu: &Gpu, shared: &Shared) {
        let map = self.map.as_ref().unwrap_or(&shared.no_map);
        self.bind_group = bound(gpu, shared, &self.look, &self.buffer, map);
    }

    fn write_uniform(&mut self, gpu: &Gpu) -> Uploaded {
        let wanted = ObjectUniform {
            irradiance_scale: self.map.as_ref().map_or(1.0, |map| map.irradiance_scale),
            ..self.look.uniform
        };
        if wanted == self.written {
            return Uploaded::default();
        }
        self.written = wanted;
        gpu.queue
            .write_buffer(&self.buffer, 0, bytemuck::bytes_of(&wanted));
        Uploaded::other(size_of_val(&wanted))
    }

    /// Bound on the radiance that leaves it, reflections aside [W/(m² sr)].
    fn peak_radiance(&self) -> f64 {
        let largest = |rgb: [f32; 3]| f64::from(rgb.into_iter().fold(0.0, f32::max));
        let peak_w_m2 = self.map.as_ref().map_or(0.0, |map| f64::from(map.peak_w_m2));
        let uniform = &self.look.uniform;
        let diffuse = largest(uniform.base_colour) * peak_w_m2 / std::f64::consts::PI;
        diffuse + largest(uniform.emitted_radiance)
    }
}

fn bound(gpu: &Gpu, shared: &Shared, look: &Look, buffer: &wgpu::Buffer, map: &DeviceMap) -> wgpu::BindGroup {
    let image = look
        .base_colour_texture
        .map_or(&shared.white, |index| &shared.textures[index]);
    let resources = [
        buffer.as_entire_binding(),
        wgpu::BindingResource::TextureView(&map.view),
        wgpu::BindingResource::TextureView(&image.view),
        wgpu::BindingResource::Sampler(&image.sampler),
    ];
    bind_group(gpu, "object", &shared.layout, resources)
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
