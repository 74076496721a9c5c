//! What specular surfaces are shown instead of their true surroundings: the plane receivers with their light, coarsely,
//! and the background around them.

use bytemuck::Zeroable;
use glam::{DVec2, DVec3};
use half::f16;
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use wgpu::util::DeviceExt;

use super::maps::ShownMap;
use super::tiles::{Texel, TiledImage, Uploaded, kept_scale, texel};
use super::uniforms::{MAX_RECEIVERS, Receiver, Surroundings};
use crate::gpu::Gpu;
use crate::illumination::IlluminationMap;
use crate::optics::LinearSrgb;
use crate::scene::{Material, Scene};

/// Largest side of a receiver's image [texels].
const SIDE: usize = 256;

/// How far a corner may lie off a receiver's plane or parametrisation, as a share of its extent.
const FLATNESS: f64 = 1e-4;

/// The surroundings on the device.
#[derive(Debug)]
pub(super) struct DeviceSurroundings {
    pub(super) uniform: wgpu::Buffer,
    /// As `uniform` holds it.
    written: Surroundings,
    image: TiledImage,
    pub(super) images: wgpu::TextureView,
}

impl DeviceSurroundings {
    /// Nothing but the background.
    pub(super) fn none(gpu: &Gpu) -> Self {
        let written = Surroundings {
            radiance_scale: 1.0,
            ..Zeroable::zeroed()
        };
        let (image, _) = TiledImage::new(gpu, "surroundings", [SIDE; 2], layers_of(&[], 1.0));
        Self {
            uniform: gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some("surroundings"),
                contents: bytemuck::bytes_of(&written),
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            }),
            written,
            images: image.view(wgpu::TextureViewDimension::D2Array),
            image,
        }
    }

    /// Takes the largest plane receivers of the maps; uploads what differs from before.
    pub(super) fn update(&mut self, gpu: &Gpu, scene: &Scene, maps: &[ShownMap]) -> Uploaded {
        let mut planes: Vec<_> = maps
            .iter()
            .filter_map(|map| Some((plane_receiver(scene, map.map)?, map)))
            .collect();
        planes.sort_by(|a, b| b.0.area_m2.total_cmp(&a.0.area_m2));
        planes.truncate(MAX_RECEIVERS);

        let images: Vec<Image> = planes.iter().map(|(_, map)| Image::of(scene, map)).collect();
        let peak = images.iter().map(Image::peak).fold(0.0, f32::max);
        let scale = kept_scale(self.written.radiance_scale, peak);
        let mut wanted = Surroundings {
            radiance_scale: scale,
            count: planes.len() as u32,
            ..Zeroable::zeroed()
        };
        if planes.is_empty() {
            // Only then is it looked at.
            wanted.mean_radiance = super::uniforms::rgb(mean_radiance(scene, maps));
        }
        for (slot, ((plane, _), image)) in wanted.receivers.iter_mut().zip(planes.iter().zip(&images)) {
            *slot = plane.receiver(image.size);
        }
        let texels = layers_of(&images, scale);
        let mut uploaded = if texels.len() == self.image.len() {
            self.image.update(gpu, texels)
        } else {
            let (image, uploaded) = TiledImage::new(gpu, "surroundings", [SIDE; 2], texels);
            self.images = image.view(wgpu::TextureViewDimension::D2Array);
            self.image = image;
            uploaded
        };
        if wanted != self.written {
            self.written = wanted;
            gpu.queue
                .write_buffer(&self.uniform, 0, bytemuck::bytes_of(&wanted));
            uploaded += Uploaded::other(size_of_val(&wanted));
        }
        uploaded.as_other()
    }
}

/// A flat receiver: its plane, and map coordinates as linear functions of the place.
struct PlaneReceiver {
    normal: DVec3,
    point: DVec3,
    uv_rows: [DVec3; 2],
    uv_at_point: DVec2,
    area_m2: f64,
}

impl PlaneReceiver {
    fn uv(&self, place: DVec3) -> DVec2 {
        let offset = place - self.point;
        self.uv_at_point + DVec2::new(self.uv_rows[0].dot(offset), self.uv_rows[1].dot(offset))
    }

    fn receiver(&self, image_size: DVec2) -> Receiver {
        let row = |row: DVec3, at_point: f64| row.extend(at_point - row.dot(self.point)).as_vec4().to_array();
        Receiver {
            plane: row(self.normal, 0.0),
            u: row(self.uv_rows[0], self.uv_at_point.x),
            v: row(self.uv_rows[1], self.uv_at_point.y),
            image_size: image_size.as_vec2().to_array(),
            padding: [0.0; 2],
        }
    }
}

/// The plane of a map's surface; `None` where it is bent, or lies in its map in more than one piece.
fn plane_receiver(scene: &Scene, map: &IlluminationMap) -> Option<PlaneReceiver> {
    let (mesh, chart) = (&scene.objects[map.chart.object].mesh, &map.chart);
    let largest = (0..mesh.triangles.len())
        .map(|triangle| {
            let [a, b, c] = mesh.corners(triangle);
            ((b - a).cross(c - a).length(), triangle)
        })
        .max_by(|a, b| a.0.total_cmp(&b.0))?
        .1;
    let corners = mesh.corners(largest);
    let texel_rows = chart.texel_from_world(largest, corners)?;
    let plane = PlaneReceiver {
        normal: mesh.face_normal(largest),
        point: corners[0],
        uv_rows: [
            texel_rows[0] / chart.width as f64,
            texel_rows[1] / chart.height as f64,
        ],
        uv_at_point: chart.corner_uvs[largest][0],
        area_m2: mesh.area_m2(),
    };
    let (low, high) = mesh.bounds()?;
    let tolerance_m = FLATNESS * (high - low).length();
    let lies_in_it = |triangle: usize| {
        mesh.corners(triangle)
            .iter()
            .zip(chart.corner_uvs[triangle])
            .all(|(corner, uv)| {
                (*corner - plane.point).dot(plane.normal).abs() <= tolerance_m
                    && plane.uv(*corner).distance(uv) <= FLATNESS
            })
    };
    (0..mesh.triangles.len()).all(lies_in_it).then_some(plane)
}

/// Radiance of a receiver [W/(m² sr)], reduced to at most [`SIDE`] texels each way.
struct Image {
    /// Texels across and down that the whole map covers; the last ones may be covered in part.
    size: DVec2,
    width: usize,
    texels: Vec<LinearSrgb>,
}

impl Image {
    fn of(scene: &Scene, shown: &ShownMap) -> Self {
        let (map, irradiance) = (shown.map, &shown.irradiance);
        let (width, height) = (map.width(), map.height());
        let (across, down) = (width.div_ceil(SIDE), height.div_ceil(SIDE));
        let material = scene.material_of(map.chart.object);
        let per_irradiance = mean_albedo(scene, material) / std::f64::consts::PI;
        let block = &|column: usize, row: usize| {
            let mut sum = LinearSrgb::BLACK;
            let mut count = 0.0;
            for y in row * down..((row + 1) * down).min(height) {
                for x in column * across..((column + 1) * across).min(width) {
                    sum += LinearSrgb::from(irradiance[y * width + x].map(f64::from));
                    count += 1.0;
                }
            }
            sum / count * per_irradiance + material.emitted_radiance
        };
        let (columns, rows) = (width.div_ceil(across), height.div_ceil(down));
        Self {
            size: DVec2::new(width as f64 / across as f64, height as f64 / down as f64),
            width: columns,
            texels: (0..rows)
                .into_par_iter()
                .flat_map_iter(|row| (0..columns).map(move |column| block(column, row)))
                .collect(),
        }
    }

    fn peak(&self) -> f32 {
        self.texels
            .iter()
            .fold(0.0, |peak: f64, texel| peak.max(texel.max_channel())) as f32
    }
}

/// One layer per image, each in its layer's upper left corner; at least one layer.
fn layers_of(images: &[Image], scale: f32) -> Vec<Texel> {
    let mut texels = vec![[f16::ZERO; 4]; images.len().max(1) * SIDE * SIDE];
    for (image, layer) in images.iter().zip(texels.chunks_exact_mut(SIDE * SIDE)) {
        for (row, radiance) in layer
            .chunks_exact_mut(SIDE)
            .zip(image.texels.chunks_exact(image.width))
        {
            for (half, radiance) in row.iter_mut().zip(radiance) {
                *half = texel(radiance.to_array().map(|channel| channel as f32), scale);
            }
        }
    }
    texels
}

/// Mean radiance ρE/π of all surfaces with a map, by area [W/(m² sr)]; black without maps.
fn mean_radiance(scene: &Scene, maps: &[ShownMap]) -> LinearSrgb {
    let (mut exitance_w, mut area_m2) = (LinearSrgb::BLACK, 0.0);
    for map in maps.iter().map(|shown| shown.map) {
        let albedo = mean_albedo(scene, scene.material_of(map.chart.object));
        for layer in &map.layers {
            exitance_w += map.flux_w(layer.kind) * albedo;
        }
        area_m2 += scene.objects[map.chart.object].mesh.area_m2();
    }
    if area_m2 > 0.0 {
        exitance_w / (area_m2 * std::f64::consts::PI)
    } else {
        LinearSrgb::BLACK
    }
}

/// Base colour with the mean of its image over a grid of points.
fn mean_albedo(scene: &Scene, material: &Material) -> LinearSrgb {
    const GRID: u32 = 32;
    let Some(image) = material
        .base_colour_texture
        .as_ref()
        .map(|image| &scene.textures[image.texture])
    else {
        return material.base_colour;
    };
    let mut sum = LinearSrgb::BLACK;
    for index in 0..GRID * GRID {
        let point = DVec2::new(f64::from(index % GRID) + 0.5, f64::from(index / GRID) + 0.5);
        sum += image.sample(point / f64::from(GRID));
    }
    material.base_colour * (sum / f64::from(GRID * GRID))
}
