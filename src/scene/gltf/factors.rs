//! Textures of transmission, roughness and metallic factors, combined into one image.

use std::sync::Arc;

use glam::DMat3;
use image::RgbaImage;

use crate::optics::LinearSrgb;
use crate::scene::material::EVEN;
use crate::scene::texture::Wrap;
use crate::scene::{Material, SurfaceKind, Texture};

/// Largest share of other classes on a surface that still counts as one class.
const MOST_OF_OTHERS: f64 = 0.01;

/// What [`Material::class_of`] knows.
const CLASSES: [SurfaceKind; 4] = [
    SurfaceKind::Diffuse,
    SurfaceKind::Mirror,
    SurfaceKind::ThinWall,
    SurfaceKind::Coated,
];

/// A factor texture with its linear channels.
pub struct FactorImage {
    pub pixels: Arc<RgbaImage>,
    pub wrap: [Wrap; 2],
    pub is_nearest: bool,
    /// TEXCOORD set and transform; `None` for a set that is not read.
    pub place: Option<(usize, DMat3)>,
}

impl FactorImage {
    fn mean(&self, channel: usize) -> f64 {
        let codes = self.pixels.pixels().map(|pixel| f64::from(pixel.0[channel]));
        let sum = codes.fold(0.0, |sum, code| sum + code / 255.0);
        sum / f64::from(self.pixels.width() * self.pixels.height())
    }

    /// Code of the texel that lies nearest to a texel of an image of another size.
    fn code(&self, channel: usize, place: [u32; 2], [width, height]: [u32; 2]) -> u8 {
        let scaled = |at: u32, own: u32, other: u32| match own == other {
            true => at,
            false => (u64::from(at) * u64::from(own) / u64::from(other)) as u32,
        };
        let x = scaled(place[0], self.pixels.width(), width);
        let y = scaled(place[1], self.pixels.height(), height);
        self.pixels.get_pixel(x, y).0[channel]
    }
}

/// Factor textures of a material, at least one.
pub struct Factors<'a> {
    pub transmission: Option<&'a FactorImage>,
    pub metallic_roughness: Option<&'a FactorImage>,
}

impl Factors<'_> {
    fn images(&self) -> impl Iterator<Item = &FactorImage> {
        [self.transmission, self.metallic_roughness].into_iter().flatten()
    }

    /// Means of transmission, roughness and metallic.
    pub fn mean(&self) -> LinearSrgb {
        let of = |image: Option<&FactorImage>, channel| image.map_or(1.0, |image| image.mean(channel));
        LinearSrgb::new(
            of(self.transmission, 0),
            of(self.metallic_roughness, 1),
            of(self.metallic_roughness, 2),
        )
    }

    /// TEXCOORD set and transform of all images; `None` if they differ.
    pub fn place(&self) -> Option<(usize, DMat3)> {
        let mut places = self.images().map(|image| image.place);
        let first = places.next()??;
        places.all(|place| place == Some(first)).then_some(first)
    }

    fn size(&self) -> [u32; 2] {
        self.images().fold([1; 2], |[width, height], image| {
            [width.max(image.pixels.width()), height.max(image.pixels.height())]
        })
    }

    /// Codes of transmission, roughness and metallic, row by row.
    fn codes(&self) -> impl Iterator<Item = [u8; 3]> {
        let size = self.size();
        let of = move |image: Option<&FactorImage>, channel, place| {
            image.map_or(u8::MAX, |image| image.code(channel, place, size))
        };
        let places = (0..size[1]).flat_map(move |y| (0..size[0]).map(move |x| [x, y]));
        places.map(move |place| {
            [
                of(self.transmission, 0, place),
                of(self.metallic_roughness, 1, place),
                of(self.metallic_roughness, 2, place),
            ]
        })
    }

    /// Surface class if these textures multiply the factors of a material; `None` if their means do as well, since no
    /// factor varies, or all texels are of one class and the roughness does not vary.
    pub fn class(&self, material: &Material) -> Option<SurfaceKind> {
        let whole = [material.transmission, material.roughness, material.metallic];
        let (mut low, mut high) = ([u8::MAX; 3], [0; 3]);
        let mut counts = CLASSES.map(|class| (class, 0_u64));
        for codes in self.codes() {
            for channel in 0..3 {
                low[channel] = low[channel].min(codes[channel]);
                high[channel] = high[channel].max(codes[channel]);
            }
            let at = |channel: usize| whole[channel] * f64::from(codes[channel]) / 255.0;
            let class = Material::class_of(at(2), at(1), at(0));
            let own = counts.iter_mut().filter(|(known, _)| *known == class);
            own.for_each(|(_, count)| *count += 1);
        }
        let differs = |channel: usize| {
            whole[channel] * (f64::from(high[channel]) - f64::from(low[channel])) / 255.0 >= EVEN
        };
        let all: u64 = counts.iter().map(|(_, count)| count).sum();
        let (most, count) = counts.into_iter().max_by_key(|(_, count)| *count)?;
        let is_one = count as f64 >= (1.0 - MOST_OF_OTHERS) * all as f64;
        match is_one {
            true => differs(1).then_some(most),
            false => (0..3).any(differs).then_some(SurfaceKind::Varied),
        }
    }

    /// All factors in one image, sRGB-encoded like colours.
    pub fn texture(&self, name: String) -> Texture {
        let encoded: Vec<u8> = (0..=u8::MAX)
            .map(|code| (LinearSrgb::encode_channel(f64::from(code) / 255.0) * 255.0).round() as u8)
            .collect();
        let encode = |code: u8| encoded[usize::from(code)];
        let [width, height] = self.size();
        Texture {
            name,
            width,
            height,
            rgba: self
                .codes()
                .map(|codes| {
                    let [r, g, b] = codes.map(encode);
                    [r, g, b, u8::MAX]
                })
                .collect(),
            wrap: self.images().next().map_or([Wrap::Repeat; 2], |image| image.wrap),
            is_nearest: self.images().all(|image| image.is_nearest),
        }
    }
}
