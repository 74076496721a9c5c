//! Base colour images on the device, with their coarser levels.

use super::paging::{Level, PagedImage, Texels, TilePool, Uploaded, is_halved};
use crate::gpu::Gpu;
use crate::optics::LinearSrgb;
use crate::scene::Texture;

/// An sRGB-encoded texel.
pub(super) type Texel = [u8; 4];

/// Uploads an image with its coarser levels.
pub(super) fn upload(gpu: &Gpu, pool: &mut TilePool, texture: &Texture) -> (PagedImage<Texel>, Uploaded) {
    let (image, uploaded) = PagedImage::new(gpu, pool, mip_chain(texture), texture.wrap, 0);
    (image, Uploaded::other(uploaded.tile_bytes as usize))
}

/// Texels across and down, and row by row.
type Image = ([usize; 2], Vec<Texel>);

/// The image and its halvings down to a few texels.
fn mip_chain(texture: &Texture) -> Vec<Level<Texel>> {
    let size = [texture.width as usize, texture.height as usize];
    let mut images: Vec<Image> = vec![(size, texture.rgba.clone())];
    while let Some(last) = images.last().filter(|(size, _)| is_halved(*size)) {
        images.push(halved(last));
    }
    let level = |(size, texels): Image| Level {
        size,
        extent: size.map(|side| side as f32),
        texels: Texels::Rows(texels),
    };
    images.into_iter().map(level).collect()
}

/// Means of 2×2 texels in linear light; an odd last row or column is left out of its neighbour's mean.
fn halved((fine_size, fine): &Image) -> Image {
    let [fine_width, fine_height] = *fine_size;
    let (width, height) = ((fine_width / 2).max(1), (fine_height / 2).max(1));
    let linear: Vec<f32> = (0..=u8::MAX)
        .map(|code| LinearSrgb::decode_channel(code) as f32)
        .collect();
    let texel = |x: usize, y: usize| {
        let (x, y) = (x.min(fine_width - 1), y.min(fine_height - 1));
        fine[y * fine_width + x]
    };
    let mean = |x: usize, y: usize| {
        let four = [
            texel(2 * x, 2 * y),
            texel(2 * x + 1, 2 * y),
            texel(2 * x, 2 * y + 1),
            texel(2 * x + 1, 2 * y + 1),
        ];
        std::array::from_fn(|channel| {
            let codes = four.map(|texel| texel[channel]);
            if channel == 3 {
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
