//! Material records of all objects, in one buffer.

use glam::DVec3;

use super::bindings::Storage;
use super::geometry::Geometry;
use super::images::Images;
use super::maps::ShownMap;
use super::paging::Uploaded;
use super::uniforms::{ObjectRecord, rgb};
use crate::error::{Error, Result};
use crate::eye_pass::highlights;
use crate::gpu::Gpu;
use crate::illumination::false_colours::ColourScale;
use crate::illumination::{Chart, Receiver};
use crate::optics::glass::Dispersion;
use crate::scene::{InScene, Material, Scene, SurfaceKind};

/// Appearance of an object, apart from its map.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Appearance {
    pub(super) surface: SurfaceKind,
    pub(super) double_sided: bool,
    pub(super) has_bumps: bool,
    /// Bounding box [m]; `None` without vertices.
    pub(super) bounds: Option<(DVec3, DVec3)>,
    /// References to images are filled in when it is written.
    record: ObjectRecord,
    material: usize,
    pub(super) has_texture: bool,
}

/// Maximum number of dispersive glasses in a scene: the capacity of the shader's uniform.
const MAX_GLASSES: usize = 128;

/// All objects, with the images that they share.
#[derive(Debug)]
pub(super) struct Objects {
    pub(super) list: Vec<Appearance>,
    pub(super) images: Images,
    pub(super) records: Storage,
    /// The scene's dispersive glasses, each once.
    pub(super) glasses: Vec<Dispersion>,
    /// Map texels per metre, by receiver; `None` without a map.
    texels_per_m: Vec<Option<f64>>,
    /// Largest radiance of any surface, emitted or diffuse [W/(m² sr)].
    pub(super) peak_radiance: f64,
}

impl Objects {
    pub(super) fn new(gpu: &Gpu, scene: &Scene, geometry: &Geometry, map_budget_bytes: u64) -> Self {
        let mut objects = Self {
            list: Vec::new(),
            images: Images::new(gpu, scene, map_budget_bytes),
            records: Storage::new(gpu, "objects"),
            glasses: Vec::new(),
            texels_per_m: vec![None; 2 * scene.objects.len()],
            peak_radiance: 0.0,
        };
        objects.set_scene(gpu, scene, geometry);
        objects
    }

    /// Switches to an edited scene; the maps stay if the number of objects is unchanged.
    pub(super) fn set_scene(&mut self, gpu: &Gpu, scene: &Scene, geometry: &Geometry) -> Uploaded {
        let mut uploaded = self.images.set_scene(gpu, scene);
        self.texels_per_m.resize(2 * scene.objects.len(), None);
        self.list = (0..scene.objects.len())
            .map(|object| Appearance::of(scene, object, geometry.rows(object)))
            .collect();
        self.number_glasses(scene);
        for (number, (object, _)) in (1..).zip(highlights::lamps_in_lobes(scene)) {
            if let Some(object) = object {
                self.list[object].record.lamp = number;
            }
        }
        uploaded += self.write_records(gpu);
        uploaded
    }

    /// Numbers the dispersive glasses.
    fn number_glasses(&mut self, scene: &Scene) {
        self.glasses.clear();
        for (object, look) in self.list.iter_mut().enumerate() {
            let material = scene.material_of(object);
            let Some(glass) = material.glass.as_ref().filter(|_| material.is_dispersive()) else {
                continue;
            };
            let known = self.glasses.iter().position(|known| *known == glass.dispersion);
            let place = known.unwrap_or(self.glasses.len());
            if place == MAX_GLASSES {
                log::warn!(
                    "`{}` is one glass more than the {MAX_GLASSES} seen by wavelength",
                    glass.name
                );
                continue;
            }
            if known.is_none() {
                self.glasses.push(glass.dispersion);
            }
            look.record.glass = place as u32 + 1;
        }
    }

    /// Replaces all maps; receivers without one are dark. Uploads only what differs from the previous maps.
    ///
    /// # Errors
    /// A map that does not belong to the scene; the old maps stay.
    pub(super) fn set_maps(&mut self, gpu: &Gpu, scene: &Scene, maps: &[ShownMap]) -> Result<Uploaded> {
        let mut map_of: Vec<Option<&ShownMap>> = vec![None; 2 * self.list.len()];
        for shown in maps {
            check_chart(scene, &shown.chart)?;
            map_of[shown.chart.receiver.index()] = Some(shown);
        }
        let mut uploaded = self.images.set_maps(gpu, &map_of);
        for (density, map) in self.texels_per_m.iter_mut().zip(&map_of) {
            *density = map.map(|shown| {
                let chart = &shown.chart;
                texels_per_m(chart, scene.objects[chart.object()].in_scene())
            });
        }
        uploaded += self.write_records(gpu);
        Ok(uploaded)
    }

    /// Fits the maps into their budget, with most detail near `eye`. `pixel_rad` is the angle of a pixel.
    pub(super) fn keep_budget(
        &mut self,
        gpu: &Gpu,
        eye: DVec3,
        pixel_rad: f64,
        visible: &[usize],
    ) -> Uploaded {
        if !self.images.may_exceed_budget() && self.images.coarse_maps() == 0 {
            return Uploaded::default();
        }
        let need = |receiver: Receiver| {
            let index = receiver.object();
            let density = self.texels_per_m[receiver.index()];
            let (Some(density), Some((low, high))) = (density, self.list[index].bounds) else {
                return 0.0;
            };
            let distance_m = (eye.clamp(low, high) - eye).length();
            let level = (distance_m * pixel_rad * density).max(1e-9).log2().floor();
            // An object out of view may still be seen in a mirror, but mostly from farther away.
            if visible.contains(&index) {
                level
            } else {
                level + 2.0
            }
        };
        let needs: Vec<f64> = Receiver::all(self.list.len()).map(need).collect();
        let mut uploaded = self.images.keep_budget(gpu, &needs);
        uploaded += self.write_records(gpu);
        uploaded
    }

    /// Whether any mirror or clear surface has a texture.
    pub(super) fn has_tinted_glass(&self) -> bool {
        let mut looks = self.list.iter();
        looks.any(|look| look.surface.is_specular() && !look.surface.is_receiver() && look.has_texture)
    }

    fn write_records(&mut self, gpu: &Gpu) -> Uploaded {
        let records: Vec<ObjectRecord> = (0..)
            .zip(&self.list)
            .map(|(index, look)| {
                let [texture, variation, glow, _] = self.images.look_records(look.material);
                ObjectRecord {
                    map: self.images.map_record(Receiver::front(index)),
                    back_map: self.images.map_record(Receiver::back(index)),
                    texture,
                    variation,
                    glow,
                    bumps: self.images.bump_record(index),
                    ..look.record
                }
            })
            .collect();
        let peaks = (0..).zip(&self.list).map(|(index, look)| {
            let sides = [Receiver::front(index), Receiver::back(index)];
            let maps = sides.into_iter().filter_map(|side| self.images.map(side));
            let peak_w_m2 = maps.map(|map| map.peak_w_m2).fold(0.0, f32::max);
            look.peak_radiance(f64::from(peak_w_m2))
        });
        self.peak_radiance = peaks.fold(0.0, f64::max);
        Uploaded::other(self.records.write(gpu, &records))
    }
}

impl Appearance {
    fn of(scene: &Scene, index: usize, [row_x, row_y, row_z]: [[f32; 4]; 3]) -> Self {
        let object = &scene.objects[index];
        let material = &scene.materials[object.material];
        let emitted = match scene.glows.get(&index) {
            // The shader multiplies this by the texture of the emission.
            Some(glow) => scene.emitted_radiance(index) * glow.per_colour(),
            None => scene.emitted_radiance(index),
        };

        // Records of images and the number of the glass are filled in later, once they are known.
        Self {
            surface: material.surface,
            double_sided: material.has_back(),
            has_bumps: material.has_bumps() || material.relief().is_some(),
            bounds: object.bounds(),
            record: ObjectRecord {
                base_colour: rgb(material.base_colour),
                ior: material.ior as f32,
                emitted_radiance: rgb(emitted),
                surface: surface_code(material.surface),
                absorption_per_m: absorption_per_m(material),
                double_sided: u32::from(material.has_back()),
                roughness: material.roughness as f32,
                coat: material.coat as f32,
                alpha_cutoff: alpha_cutoff(material),
                metallic: material.metallic as f32,
                transmission: material.transmission as f32,
                coverage: material.coverage.map_or(-1.0, |factor| factor as f32),
                solid: if material.is_solid() {
                    scene.body_of(index) as u32 + 1
                } else {
                    0
                },
                row_x,
                row_y,
                row_z,
                ..ObjectRecord::default()
            },
            material: object.material,
            has_texture: material.base_colour_texture.is_some(),
        }
    }

    pub(super) fn has_mask(&self) -> bool {
        self.record.alpha_cutoff > 0.0
    }

    /// Upper bound of the radiance that leaves it, without reflections [W/(m² sr)].
    fn peak_radiance(&self, peak_w_m2: f64) -> f64 {
        let largest = |rgb: [f32; 3]| f64::from(rgb.into_iter().fold(0.0, f32::max));
        let diffuse = largest(self.record.base_colour) * peak_w_m2 / std::f64::consts::PI;
        diffuse + largest(self.record.emitted_radiance)
    }
}

/// The shaders' `SURFACE_*`.
pub(super) fn surface_code(surface: SurfaceKind) -> u32 {
    match surface {
        SurfaceKind::Diffuse => 0,
        SurfaceKind::Mirror => 1,
        SurfaceKind::Dielectric => 2,
        SurfaceKind::ThinWall => 3,
        SurfaceKind::Coated => 4,
        SurfaceKind::Varied => 5,
    }
}

/// Alpha of a texture below which the surface is cut out; 0 without a mask.
fn alpha_cutoff(material: &Material) -> f32 {
    match material.alpha_mask {
        Some(mask) if mask.factor >= mask.cutoff => (mask.cutoff / mask.factor).max(0.0) as f32,
        // Cut out everywhere, whatever the texture.
        Some(_) => f32::INFINITY,
        None => 0.0,
    }
}

/// Absorption coefficient of a body [1/m]: −ln(colour)/distance, per channel.
pub(super) fn absorption_per_m(material: &Material) -> [f32; 3] {
    match material.volume {
        Some(volume) if volume.attenuation_distance_m.is_finite() && volume.attenuation_distance_m > 0.0 => {
            rgb(volume
                .attenuation_colour
                .map(|colour| -colour.ln() / volume.attenuation_distance_m))
        }
        _ => [0.0; 3],
    }
}

/// Mean linear density of a map's texels on its surface [1/m]; 0 if the surface has no area.
fn texels_per_m(chart: &Chart, mesh: InScene) -> f64 {
    let in_map: f64 = chart
        .corner_uvs
        .iter()
        .map(|[a, b, c]| 0.5 * (*b - *a).perp_dot(*c - *a).abs())
        .sum();
    let area_m2 = mesh.area_m2();
    if area_m2 > 0.0 {
        (in_map * (chart.width * chart.height) as f64 / area_m2).sqrt()
    } else {
        0.0
    }
}

/// Maps also come from files: a map of another scene must be rejected, not drawn.
fn check_chart(scene: &Scene, chart: &Chart) -> Result<()> {
    let belongs = scene.objects.get(chart.object()).is_some_and(|object| {
        scene.materials[object.material].surface.is_receiver()
            && object.mesh().triangles.len() == chart.corner_uvs.len()
    });
    if belongs {
        return Ok(());
    }
    Err(Error::failure(
        format!("map of the {:?}", chart.receiver),
        format!("does not belong to the scene {}", scene.name),
        "bake the scene again",
    ))
}

/// What map values mean.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum MapStyle {
    /// Irradiance [W/m²] of a lit scene, with reflections and refractions.
    #[default]
    Lit,
    /// Linear colours, shown as they are. Clear bodies are left out, and surfaces without a map are black.
    AsItIs,
    /// Irradiance [W/m²] of surfaces that show a property instead. The result is in display colours, to be shown
    /// without exposure and tone mapping.
    Inspected {
        what: Inspected,
        /// Scale of false colours, in the property's own unit.
        scale: ColourScale,
    },
}

impl MapStyle {
    /// Start of the scale of false colours, and the factor of distances from it.
    pub(super) fn colour_scale(self) -> [f64; 2] {
        match self {
            Self::Inspected { scale, .. } => scale.for_shaders(),
            Self::Lit | Self::AsItIs => [0.0; 2],
        }
    }

    pub(super) fn is_logarithmic(self) -> bool {
        matches!(self, Self::Inspected { scale, .. } if scale.is_logarithmic)
    }
}

/// A property that surfaces show instead of their radiance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Inspected {
    /// Luminance of the map [W/m²] in false colours; clear bodies are left out.
    Irradiance,
    /// Texels of the map as a checkerboard; clear bodies are left out.
    Texels,
    /// Texels of the map per metre in false colours; clear bodies are left out.
    TexelDensity,
    /// Mesh normals n in scene axes: red, green and blue are (n + 1)/2 of x, y and z.
    Normals,
    /// Texture coordinates of the base colour, or of set 0 without a texture: red is u, green v, fractional parts only.
    Uv,
    /// Coordinates in the illumination map: red is u, green v; clear bodies are left out.
    MapUv,
}

impl Inspected {
    /// `INSPECTED_*` of the shader.
    pub(super) fn code(self) -> u32 {
        match self {
            Self::Irradiance => 0,
            Self::Texels => 1,
            Self::TexelDensity => 2,
            Self::Normals => 3,
            Self::Uv => 4,
            Self::MapUv => 5,
        }
    }

    /// Whether surfaces without a map have this property, too.
    pub(super) fn is_of_shape(self) -> bool {
        matches!(self, Self::Normals | Self::Uv)
    }
}
