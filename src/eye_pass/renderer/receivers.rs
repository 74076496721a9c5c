//! Plane receivers with their light, as specular surfaces are shown them: coarsely, from the maps that the device holds.

use glam::{DVec2, DVec3};
use half::f16;
use rayon::iter::{IntoParallelIterator, ParallelIterator};

use super::maps::DeviceMap;
use super::tiles::{Texel, texel};
use super::uniforms::Receiver;
use crate::illumination::Chart;
use crate::optics::LinearSrgb;
use crate::scene::{Material, Scene};

/// Largest side of a receiver's image [texels].
pub(super) const SIDE: usize = 256;

/// How far a corner may lie off a receiver's plane or parametrisation, as a share of its extent.
const FLATNESS: f64 = 1e-4;

/// A surface with its map.
#[derive(Clone, Copy, Debug)]
pub(super) struct LitSurface<'a> {
    pub(super) chart: &'a Chart,
    pub(super) map: &'a DeviceMap,
}

/// A flat receiver: its plane, and map coordinates as linear functions of the place.
#[derive(Debug)]
pub(super) struct PlaneReceiver {
    normal: DVec3,
    point: DVec3,
    uv_rows: [DVec3; 2],
    uv_at_point: DVec2,
    pub(super) area_m2: f64,
}

impl PlaneReceiver {
    /// The plane of a map's surface; `None` where it is bent, or lies in its map in more than one piece.
    pub(super) fn of(scene: &Scene, chart: &Chart) -> Option<Self> {
        let mesh = &scene.objects[chart.object].mesh;
        let largest = (0..mesh.triangles.len())
            .map(|triangle| {
                let [a, b, c] = mesh.corners(triangle);
                ((b - a).cross(c - a).length(), triangle)
            })
            .max_by(|a, b| a.0.total_cmp(&b.0))?
            .1;
        let corners = mesh.corners(largest);
        let texel_rows = chart.texel_from_world(largest, corners)?;
        let plane = Self {
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

    fn uv(&self, place: DVec3) -> DVec2 {
        let offset = place - self.point;
        self.uv_at_point + DVec2::new(self.uv_rows[0].dot(offset), self.uv_rows[1].dot(offset))
    }

    /// As the shader has it.
    pub(super) fn receiver(&self, image_size: DVec2) -> Receiver {
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

/// Radiance of a receiver [W/(m² sr)], reduced to at most [`SIDE`] texels each way.
#[derive(Debug)]
pub(super) struct Image {
    /// Texels across and down that the whole map covers; the last ones may be covered in part.
    pub(super) size: DVec2,
    width: usize,
    texels: Vec<LinearSrgb>,
}

impl Image {
    pub(super) fn of(scene: &Scene, lit: &LitSurface<'_>) -> Self {
        let [width, height] = lit.map.size();
        let (across, down) = (width.div_ceil(SIDE), height.div_ceil(SIDE));
        let material = scene.material_of(lit.chart.object);
        let per_irradiance = mean_albedo(scene, material) / std::f64::consts::PI;
        let block = &|column: usize, row: usize| {
            let mut sum = LinearSrgb::BLACK;
            let mut count = 0.0;
            for y in row * down..((row + 1) * down).min(height) {
                for x in column * across..((column + 1) * across).min(width) {
                    sum += lit.map.irradiance(y * width + x);
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

    pub(super) fn peak(&self) -> f32 {
        self.texels
            .iter()
            .fold(0.0, |peak: f64, texel| peak.max(texel.max_channel())) as f32
    }
}

/// One layer per image, each in its layer's upper left corner.
pub(super) fn layers_of(images: &[Image], scale: f32) -> Vec<Texel> {
    let mut texels = vec![[f16::ZERO; 4]; images.len() * SIDE * SIDE];
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
pub(super) fn mean_radiance(scene: &Scene, lit: &[LitSurface<'_>]) -> LinearSrgb {
    let (mut exitance_w, mut area_m2) = (LinearSrgb::BLACK, 0.0);
    for LitSurface { chart, map } in lit {
        let [width, height] = map.size();
        let mut flux_w = LinearSrgb::BLACK;
        for texel in 0..width * height {
            flux_w += map.irradiance(texel) * chart.texel_area_m2(texel);
        }
        exitance_w += flux_w * mean_albedo(scene, scene.material_of(chart.object));
        area_m2 += scene.objects[chart.object].mesh.area_m2();
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
