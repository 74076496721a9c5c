//! All images of a scene on the device: illumination maps, textures, and the table of their tiles.

use std::sync::Arc;

use super::bindings::Storage;
use super::maps::{self, DeviceMap, ShownMap};
use super::paging::{Level, PagedImage, TILE, TilePool, Uploaded, is_halved};
use super::uniforms::{LightRecord, rgb};
use crate::eye_pass::relief::ReliefLights;
use crate::gpu::Gpu;
use crate::illumination::Receiver;
use crate::optics::LinearSrgb;
use crate::scene::{Material, Scene, SmoothIrradiance, Texture, TextureRef};

/// Stands for a missing image; `NO_IMAGE` in the shaders.
pub(super) const NO_IMAGE: u32 = u32::MAX;

/// Device memory of a map tile [bytes].
const MAP_TILE_BYTES: u64 = (super::paging::STORED * super::paging::STORED * size_of::<maps::Texel>()) as u64;

#[derive(Debug)]
pub(super) struct Images {
    map_pool: TilePool,
    texture_pool: TilePool,
    /// By [`Receiver::index`].
    maps: Vec<Option<DeviceMap>>,
    /// Sources of `textures`, in the same order.
    sources: Vec<Arc<Texture>>,
    textures: Vec<PagedImage<Texel>>,
    /// Texture references by material, in the order of [`Material::images`].
    looks: Vec<[Option<TextureRef>; 4]>,
    /// Lights that shade relief, as `relief.wgsl` reads them; `None` if no surface has one.
    relief_lights: Option<Vec<u32>>,
    /// Bumps by object: the material, and the words that follow its texture reference in the record.
    bumps: Vec<Option<(usize, Vec<u32>)>>,
    /// Records of images with their pages, of texture references, of lights, and of bumps.
    pub(super) table: Storage,
    /// Where records start in the table: of maps by receiver, of texture references by material, of bumps by object.
    map_records: Vec<u32>,
    look_records: Vec<[u32; 4]>,
    bump_records: Vec<u32>,
    /// Memory budget of illumination maps [bytes].
    budget_bytes: u64,
}

impl Images {
    pub(super) fn new(gpu: &Gpu, scene: &Scene, budget_bytes: u64) -> Self {
        let mut images = Self {
            map_pool: TilePool::new(gpu, "map tiles", wgpu::TextureFormat::Rgba16Float),
            texture_pool: TilePool::new(gpu, "texture tiles", wgpu::TextureFormat::Rgba8UnormSrgb),
            maps: (0..2 * scene.objects.len()).map(|_| None).collect(),
            sources: Vec::new(),
            textures: Vec::new(),
            looks: Vec::new(),
            relief_lights: None,
            bumps: Vec::new(),
            table: Storage::new(gpu, "image table"),
            map_records: Vec::new(),
            look_records: Vec::new(),
            bump_records: Vec::new(),
            budget_bytes,
        };
        images.set_scene(gpu, scene);
        images
    }

    /// Switches to the images of an edited scene; maps stay if the number of objects is unchanged.
    pub(super) fn set_scene(&mut self, gpu: &Gpu, scene: &Scene) -> Uploaded {
        // Maps are kept by receiver, whose indices another number of objects changes.
        let mut uploaded = Uploaded::default();
        if self.maps.len() != 2 * scene.objects.len() {
            self.maps
                .iter_mut()
                .flatten()
                .for_each(|map| map.image.release(&mut self.map_pool));
            self.maps = (0..2 * scene.objects.len()).map(|_| None).collect();
        }

        // Most edits keep all textures, which are recognised by their pointers: they are not uploaded again.
        let is_same = self.sources.len() == scene.textures.len()
            && self
                .sources
                .iter()
                .zip(&scene.textures)
                .all(|(a, b)| Arc::ptr_eq(a, b));
        if !is_same {
            self.textures
                .iter_mut()
                .for_each(|image| image.release(&mut self.texture_pool));
            self.sources.clone_from(&scene.textures);
            self.textures.clear();
            let is_normals = |index: usize| {
                let mut maps = scene
                    .materials
                    .iter()
                    .filter_map(|material| material.normal_map.as_ref());
                maps.any(|map| map.image.texture == index)
            };
            for (index, texture) in self.sources.iter().enumerate() {
                let (image, bytes) = upload(gpu, &mut self.texture_pool, texture, is_normals(index));
                self.textures.push(image);
                uploaded += bytes;
            }
        }

        // Freed slots do not shrink a pool: one that is mostly free is replaced by a smaller one.
        if self.texture_pool.is_sparse() {
            self.texture_pool = self.texture_pool.emptied(gpu);
            for image in &mut self.textures {
                let moved = image.move_to(gpu, &mut self.texture_pool);
                uploaded += Uploaded::other(moved.tile_bytes as usize);
            }
        }

        // References, bumps and lights take a few words each and are written anew with the table.
        let looks = |material: &Material| material.images().map(Option::<&TextureRef>::cloned);
        self.looks = scene.materials.iter().map(looks).collect();
        let bumps = |object: usize| {
            let material = scene.objects[object].material;
            Some((material, bumps(&scene.materials[material])?))
        };
        self.bumps = (0..scene.objects.len()).map(bumps).collect();
        let has_relief = scene.materials.iter().any(|material| material.relief().is_some());
        self.relief_lights = has_relief.then(|| relief_lights(&ReliefLights::of(scene)));
        uploaded += self.write_table(gpu);
        uploaded
    }

    /// Shows these maps, by receiver, and no others.
    pub(super) fn set_maps(&mut self, gpu: &Gpu, shown: &[Option<&ShownMap>]) -> Uploaded {
        let mut uploaded = Uploaded::default();

        // A map that keeps its chart uploads only tiles that differ; any other one gives its slots back first.
        for (map, shown) in self.maps.iter_mut().zip(shown) {
            match (&mut *map, shown) {
                (Some(old), Some(shown)) if old.can_become(shown) => {
                    uploaded += old.update(gpu, &mut self.map_pool, shown);
                }
                (_, shown) => {
                    if let Some(old) = map {
                        old.image.release(&mut self.map_pool);
                    }
                    *map = shown.map(|shown| {
                        // A map beyond the budget starts with its coarsest level.
                        let tiles = tiles_of(shown.chart.width, shown.chart.height);
                        let is_too_large = tiles * MAP_TILE_BYTES > self.budget_bytes;
                        let finest = if is_too_large { usize::MAX } else { 0 };
                        let (made, bytes) = DeviceMap::new(gpu, &mut self.map_pool, shown, finest);
                        uploaded += bytes;
                        made
                    });
                }
            }
        }

        // Freed slots do not shrink a pool: one that is mostly free is replaced by a smaller one.
        if self.map_pool.is_sparse() {
            self.map_pool = self.map_pool.emptied(gpu);
            for map in self.maps.iter_mut().flatten() {
                uploaded += map.image.move_to(gpu, &mut self.map_pool);
            }
        }
        uploaded += self.write_table(gpu);
        uploaded
    }

    /// Makes the finest levels resident that fit the budget together. Maps that are seen coarsely, by `needs` [levels],
    /// lose their finest levels first.
    pub(super) fn keep_budget(&mut self, gpu: &Gpu, needs: &[f64]) -> Uploaded {
        let maps: Vec<(usize, &DeviceMap)> = self
            .maps
            .iter()
            .enumerate()
            .filter_map(|(receiver, map)| Some((receiver, map.as_ref()?)))
            .collect();
        let costs = maps.iter().map(|(receiver, map)| Cost {
            need: needs.get(*receiver).copied().unwrap_or(f64::INFINITY),
            tiles: (0..map.image.level_count())
                .map(|level| map.image.tiles_of_level(level))
                .collect(),
        });
        let finest = finest_levels(&costs.collect::<Vec<_>>(), self.budget_bytes / MAP_TILE_BYTES);
        let wanted: Vec<(usize, usize)> = maps.iter().map(|(receiver, _)| *receiver).zip(finest).collect();
        let mut uploaded = Uploaded::default();
        // Evict first, to make room.
        for is_coarser in [true, false] {
            for (receiver, finest) in &wanted {
                if let Some(map) = &mut self.maps[*receiver]
                    && (*finest > map.image.finest()) == is_coarser
                {
                    uploaded += map.image.set_finest(gpu, &mut self.map_pool, *finest);
                }
            }
        }
        uploaded += self.write_table(gpu);
        uploaded
    }

    /// Whether all levels of all maps together could exceed the budget.
    pub(super) fn may_exceed_budget(&self) -> bool {
        let tiles = self.maps.iter().flatten().map(|map| {
            let [width, height] = map.image.size();
            tiles_of(width, height)
        });
        tiles.sum::<u64>() * MAP_TILE_BYTES > self.budget_bytes
    }

    pub(super) fn set_budget(&mut self, bytes: u64) {
        self.budget_bytes = bytes;
    }

    /// Device memory of illumination maps [bytes].
    pub(super) fn map_bytes(&self) -> u64 {
        self.map_pool.tiles() * MAP_TILE_BYTES
    }

    /// Maps whose finest level is not resident.
    pub(super) fn coarse_maps(&self) -> u64 {
        self.maps
            .iter()
            .flatten()
            .filter(|map| map.image.finest() > 0)
            .count() as u64
    }

    pub(super) fn map(&self, receiver: Receiver) -> Option<&DeviceMap> {
        self.maps[receiver.index()].as_ref()
    }

    pub(super) fn map_record(&self, receiver: Receiver) -> u32 {
        self.map_records[receiver.index()]
    }

    /// Records of the texture references of a material.
    pub(super) fn look_records(&self, material: usize) -> [u32; 4] {
        self.look_records[material]
    }

    pub(super) fn bump_record(&self, object: usize) -> u32 {
        self.bump_records.get(object).copied().unwrap_or(NO_IMAGE)
    }

    /// Tiles of maps, and of textures.
    pub(super) fn views(&self) -> [wgpu::TextureView; 2] {
        [self.map_pool.view(), self.texture_pool.view()]
    }

    /// Sizes of the pools of tiles of maps, and of textures.
    pub(super) fn pool_sizes(&self) -> [[u32; 3]; 2] {
        [self.map_pool.size(), self.texture_pool.size()]
    }

    /// Texels of all tiles of textures.
    pub(super) fn texture_tiles(&self) -> Vec<Texel> {
        self.texture_pool
            .filled(self.textures.iter().flat_map(PagedImage::tiles))
    }

    fn write_table(&mut self, gpu: &Gpu) -> Uploaded {
        // All records share one buffer, as shaders may read few buffers; each is known by the index of its first word.
        let mut words = Vec::new();
        let (mut map_records, mut texture_records) = (Vec::new(), Vec::new());
        for map in &self.maps {
            map_records.push(map.as_ref().map_or(NO_IMAGE, |map| {
                let record = words.len() as u32;
                map.image.write_record(&mut words, map.irradiance_scale);
                record
            }));
        }

        // Bit 4 of the wrap modes marks textures that are looked up without interpolation.
        for (texture, source) in self.textures.iter().zip(&self.sources) {
            let record = words.len();
            texture_records.push(record as u32);
            texture.write_record(&mut words, 1.0);
            words[record + 3] |= u32::from(source.is_nearest) << 4;
        }
        self.map_records = map_records;

        // References follow the images, whose indices they contain.
        let mut write_look = |look: &TextureRef| {
            let record = words.len() as u32;
            words.extend([texture_records[look.texture], look.uv_set as u32]);
            // Two rows of the matrix, each followed by its translation.
            let [u, v, shift] = look.uv_transform.to_cols_array_2d();
            let rows = [u[0], v[0], shift[0], u[1], v[1], shift[1]];
            words.extend(rows.map(|number| (number as f32).to_bits()));
            record
        };
        let records = |looks: &[Option<TextureRef>; 4]| {
            [0, 1, 2, 3].map(|which: usize| looks[which].as_ref().map_or(NO_IMAGE, &mut write_look))
        };
        self.look_records = self.looks.iter().map(records).collect();

        // All bumps are shaded by the same lights, which are written once.
        let lights = match &self.relief_lights {
            Some(lights) => {
                let record = words.len() as u32;
                words.extend(lights);
                record
            }
            None => NO_IMAGE,
        };

        // Bumps come last: they refer to a normal map, the last of a material's images, and to the lights.
        self.bump_records.clear();
        for bumps in &self.bumps {
            let record = words.len() as u32;
            self.bump_records.push(match bumps {
                Some((material, rest)) => {
                    words.extend([self.look_records[*material][3], lights]);
                    words.extend(rest);
                    record
                }
                None => NO_IMAGE,
            });
        }
        Uploaded::other(self.table.write(gpu, &words))
    }
}

fn relief_lights(lights: &ReliefLights) -> Vec<u32> {
    let SmoothIrradiance { mean, by_normal } = lights.sky;
    let sky = [mean]
        .into_iter()
        .chain(by_normal)
        .flat_map(rgb)
        .map(f32::to_bits);
    let records: Vec<LightRecord> = lights
        .emitters
        .iter()
        .map(|emitter| LightRecord::of(emitter, |place| place.as_vec3().to_array()))
        .collect();
    let mut words = vec![records.len() as u32];
    words.extend(sky);
    words.extend(bytemuck::cast_slice::<LightRecord, u32>(&records));
    words
}

/// A material's bumps, as `bumps.wgsl` reads them after texture reference and lights.
fn bumps(material: &Material) -> Option<Vec<u32>> {
    if !material.has_bumps() && material.relief().is_none() {
        return None;
    }
    let waves = material.bending_waves().map_or(&[][..], |waves| waves.list());
    let scale = material.normal_map.as_ref().map_or(0.0, |map| map.scale);
    let mut words = vec![(scale as f32).to_bits(), waves.len() as u32];
    for wave in waves {
        let [x, y, z] = wave.wave_vector().to_array();
        let numbers = [x, y, z, wave.phase_rad, wave.amplitude_m];
        words.extend(numbers.map(|number| (number as f32).to_bits()));
    }
    Some(words)
}

/// Memory demand of a map.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Cost {
    /// Finest level that can be resolved where the map is seen from nearest; negative if even level 0 is magnified
    /// there.
    pub(super) need: f64,
    /// Tiles of each level, from fine to coarse.
    pub(super) tiles: Vec<u64>,
}

/// Upper bound of the number of tiles of a map with all its levels.
pub(super) fn tiles_of(width: usize, height: usize) -> u64 {
    let (mut width, mut height, mut tiles) = (width, height, 0);
    loop {
        tiles += (width.div_ceil(TILE) * height.div_ceil(TILE)) as u64;
        if !is_halved([width, height]) {
            return tiles;
        }
        (width, height) = (width.div_ceil(2), height.div_ceil(2));
    }
}

/// The finest level of each map to keep resident, so that all maps take at most `budget` tiles, if their coarsest
/// levels alone do. While they take more, the map that needs its finest level least loses it.
pub(super) fn finest_levels(costs: &[Cost], budget: u64) -> Vec<usize> {
    let mut finest = vec![0; costs.len()];
    let mut total: u64 = costs.iter().flat_map(|cost| &cost.tiles).sum();
    while total > budget {
        // Positive if the finest level that is kept is finer than needed.
        let spare = |index: usize| costs[index].need - finest[index] as f64;
        let can_lose = |index: &usize| finest[*index] + 1 < costs[*index].tiles.len();
        let candidates = (0..costs.len()).filter(can_lose);
        let Some(least) = candidates.max_by(|a, b| spare(*a).total_cmp(&spare(*b)).then(b.cmp(a))) else {
            break;
        };
        total -= costs[least].tiles[finest[least]];
        finest[least] += 1;
    }
    finest
}

/// An sRGB-encoded texel.
pub(super) type Texel = [u8; 4];

/// Uploads an image with its mip levels.
pub(super) fn upload(
    gpu: &Gpu,
    pool: &mut TilePool,
    texture: &Texture,
    is_normals: bool,
) -> (PagedImage<Texel>, Uploaded) {
    let (image, uploaded) = PagedImage::new(gpu, pool, mip_chain(texture, is_normals), texture.wrap, 0);
    (image, Uploaded::other(uploaded.tile_bytes as usize))
}

/// Size [texels], and texels row by row.
type Image = ([usize; 2], Vec<Texel>);

/// The image and its mip levels.
fn mip_chain(texture: &Texture, is_normals: bool) -> Vec<Level<Texel>> {
    let size = [texture.width as usize, texture.height as usize];
    let mut images: Vec<Image> = vec![(size, texture.rgba.clone())];
    while let Some(last) = images.last().filter(|(size, _)| is_halved(*size)) {
        images.push(halved(last, is_normals));
    }
    let level =
        |(size, texels): &Image| Level::of_rows(*size, size.map(|side| side as f32), texture.wrap, texels);
    images.iter().map(level).collect()
}

/// Means of 2×2 texels, of colours in linear light; an odd last row or column is dropped.
fn halved((fine_size, fine): &Image, is_normals: bool) -> Image {
    // sRGB codes are not proportional to light: the mean of codes is darker than the mean of light.
    let [fine_width, fine_height] = *fine_size;
    let (width, height) = ((fine_width / 2).max(1), (fine_height / 2).max(1));
    let linear: Vec<f32> = (0..=u8::MAX)
        .map(|code| LinearSrgb::decode_channel(code) as f32)
        .collect();
    let texel = |x: usize, y: usize| {
        let (x, y) = (x.min(fine_width - 1), y.min(fine_height - 1));
        fine[y * fine_width + x]
    };

    // Alpha and the components of normals are linear in their codes, which are averaged as they are.
    let mean = |x: usize, y: usize| {
        let four = [
            texel(2 * x, 2 * y),
            texel(2 * x + 1, 2 * y),
            texel(2 * x, 2 * y + 1),
            texel(2 * x + 1, 2 * y + 1),
        ];
        std::array::from_fn(|channel| {
            let codes = four.map(|texel| texel[channel]);
            if channel == 3 || is_normals {
                return (codes.iter().map(|code| u32::from(*code)).sum::<u32>() / 4) as u8;
            }
            let light = codes.iter().map(|code| linear[usize::from(*code)]).sum::<f32>() / 4.0;
            (LinearSrgb::encode_channel(f64::from(light)) * 255.0).round() as u8
        })
    };
    let texels = (0..height)
        .flat_map(|y| (0..width).map(move |x| (x, y)))
        .map(|(x, y)| mean(x, y))
        .collect();
    ([width, height], texels)
}
