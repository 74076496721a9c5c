//! Pictures without a window: radiance before exposure and tone mapping.

use half::f16;

use super::accumulation::Mean;
use super::draws::Sample;
use super::draws::visible_objects;
use super::{EyeCounts, EyeQuality, MapStyle, Renderer};
use crate::effect::{Effect, EffectSwitch, EffectSwitches};
use crate::error::Result;
use crate::eye_pass::{Picture, View};
use crate::gpu::{Gpu, readback};
use crate::illumination::IlluminationMap;
use crate::scene::Scene;

/// Largest value of scaled radiance that the picture is scaled to: half floats end at 65504, and a body may still
/// multiply it by the square of its refractive index.
const LARGEST_SCALED: f64 = 4096.0;

/// How much brighter than surfaces an environment may be before it is cut: eleven binary digits of half floats are left
/// for what sends a thousandth of the brightest surface.
const LARGEST_OVER_SURFACES: f64 = 1024.0;

/// From here on a mean may hold something that a picture cut.
const CUT_SCALED: f64 = 500.0;
/// Places across and down a pixel of a picture that is drawn anew to be kept.
const ANEW_SIDE: u32 = 2;
/// Least pictures of a view in which chains go on by wavelength: 48 wavelengths.
const MIN_PARTED: u32 = 16;

impl Renderer {
    /// Radiance per pixel [W/(m² sr)] of a view, looked at through the centres of its pixels, in the precision of half
    /// floats.
    ///
    /// # Errors
    /// A size of 0 or above the device's limit; a lost device.
    pub fn radiance(&mut self, gpu: &Gpu, view: &View) -> Result<Picture> {
        self.radiance_sampled(gpu, view, 1)
    }

    /// [`radiance`](Self::radiance) without what is seen in mirrors and through glass: enough to tell how bright it is.
    ///
    /// # Errors
    /// Those of [`radiance`](Self::radiance).
    pub fn glance(&mut self, gpu: &Gpu, view: &View) -> Result<Picture> {
        let chains = std::mem::replace(&mut self.chains, EffectSwitch::Off);
        let has_stand_in = std::mem::take(&mut self.has_stand_in);
        let picture = self.radiance(gpu, view);
        (self.chains, self.has_stand_in) = (chains, has_stand_in);
        picture
    }

    /// Mean radiance of `samples_per_side`² places of each pixel, those of the CPU eye pass; of at least 16 pictures
    /// where chains go on by wavelength, which each of them follows few of.
    ///
    /// # Errors
    /// Those of [`radiance`](Self::radiance).
    pub fn radiance_sampled(&mut self, gpu: &Gpu, view: &View, samples_per_side: u32) -> Result<Picture> {
        let side = samples_per_side.max(1);
        self.make_sky(gpu);
        let scale = self.scale(view);
        let pictures = self.pictures(view, side * side);
        for index in 0..pictures {
            let mut encoder = gpu
                .device
                .create_command_encoder(&wgpu::CommandEncoderDescriptor {
                    label: Some("radiance"),
                });
            let sample = Sample::of_grid(index, side);
            self.draw_radiance(gpu, &mut encoder, view, scale, sample)?;
            if pictures > 1 {
                self.add_to_mean(gpu, &mut encoder, index == 0);
            }
            let has_specular = self.drawn[1] > 0;
            if let Some(timing) = &mut self.timing {
                timing.finish(&mut encoder, has_specular, false, self.quality);
            }
            gpu.queue.submit([encoder.finish()]);
        }
        let radiance = if pictures > 1 {
            self.read_mean(gpu, scale)?
        } else {
            self.read_resolved(gpu, scale)?
        };
        self.collect_times(gpu);
        Ok(Picture {
            width: view.width,
            height: view.height,
            radiance,
        })
    }

    /// Radiance of the picture that was drawn last, the mean of all that were made of its view. Where another view was
    /// drawn, or something is so bright that the picture cuts it, the view is drawn anew.
    ///
    /// # Errors
    /// Those of [`radiance`](Self::radiance).
    pub fn shown_radiance(&mut self, gpu: &Gpu, view: &View) -> Result<Picture> {
        if self.drawn_view.as_ref() != Some(view) {
            return self.radiance_sampled(gpu, view, ANEW_SIDE);
        }
        let scale = view.exposure_stops.exp2();
        let is_mean = self.mean.as_ref().is_some_and(|mean| mean.count() > 0);
        let radiance = if is_mean {
            self.read_mean(gpu, scale)?
        } else {
            self.read_resolved(gpu, scale)?
        };
        let largest = radiance.iter().flatten().fold(0.0_f32, |a, b| a.max(*b));
        if f64::from(largest) * scale >= CUT_SCALED {
            return self.radiance_sampled(gpu, view, ANEW_SIDE);
        }
        Ok(Picture {
            width: view.width,
            height: view.height,
            radiance,
        })
    }

    /// Pictures of a view, of whose pixels so many places are looked at: enough for all colours.
    fn pictures(&self, view: &View, places: u32) -> u32 {
        let draw_state = self.draw_state();
        let is_chain = |object: &usize| draw_state.is_specular(&self.objects.list[*object]);
        let has_chains = || visible_objects(&self.objects, view).iter().any(is_chain);
        if draw_state.parts_wavelengths && has_chains() {
            MIN_PARTED.div_ceil(places) * places
        } else {
            places
        }
    }

    /// By which radiance fits half floats.
    fn scale(&self, view: &View) -> f64 {
        if matches!(self.map_style, MapStyle::Inspected { .. }) {
            return 1.0;
        }
        let peak = self.objects.peak_radiance.max(self.peak_behind(view));
        // A power of two changes no digit.
        if peak > 0.0 {
            (LARGEST_SCALED / peak).log2().floor().exp2()
        } else {
            1.0
        }
    }

    /// Largest radiance that is seen behind surfaces [W/(m² sr)]. A sun in an environment may be cut: a scale that holds
    /// it must leave what else is seen its digits.
    fn peak_behind(&self, view: &View) -> f64 {
        match (self.scene.sky(), self.seen_sky()) {
            (Some((_, strength)), Some(sky)) => {
                let peak = sky.peak() * strength.max_channel();
                match self.objects.peak_radiance {
                    0.0 => peak,
                    of_surfaces => peak.min(of_surfaces * LARGEST_OVER_SURFACES),
                }
            }
            _ => view.background.max_channel(),
        }
    }

    fn add_to_mean(&mut self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder, is_first: bool) {
        let Some(targets) = &self.targets else { return };
        let fits = |mean: &Mean| mean.has_size(targets.width, targets.height);
        let mut mean = match self.mean.take().filter(fits) {
            Some(mean) => mean,
            None => Mean::new(gpu, targets.width, targets.height),
        };
        if is_first {
            mean.clear();
        }
        mean.add(gpu, encoder, &targets.resolved_view);
        self.mean = Some(mean);
    }

    fn read_resolved(&self, gpu: &Gpu, scale: f64) -> Result<Vec<[f32; 3]>> {
        let bytes = match &self.targets {
            Some(targets) => readback::read_texture(gpu, &targets.resolved)?,
            None => Vec::new(),
        };
        let channel = |texel: &[u8], channel: usize| {
            let half = f16::from_le_bytes([texel[2 * channel], texel[2 * channel + 1]]);
            (f64::from(half) / scale) as f32
        };
        let texels = bytes.chunks_exact(8);
        Ok(texels
            .map(|texel| std::array::from_fn(|index| channel(texel, index)))
            .collect())
    }

    fn read_mean(&self, gpu: &Gpu, scale: f64) -> Result<Vec<[f32; 3]>> {
        let bytes = match &self.mean {
            Some(mean) => readback::read_texture(gpu, mean.picture().0)?,
            None => Vec::new(),
        };
        let channel = |texel: &[u8], channel: usize| {
            let value: f32 = bytemuck::pod_read_unaligned(&texel[4 * channel..4 * channel + 4]);
            (f64::from(value) / scale) as f32
        };
        let texels = bytes.chunks_exact(16);
        Ok(texels
            .map(|texel| std::array::from_fn(|index| channel(texel, index)))
            .collect())
    }
}

/// One picture through the centres of its pixels, in a quality to be kept.
///
/// # Errors
/// Those of [`Renderer::new`], [`Renderer::set_maps`] and [`Renderer::radiance`].
pub fn render_offscreen(gpu: &Gpu, scene: &Scene, maps: &[IlluminationMap], view: &View) -> Result<Picture> {
    render_sampled(gpu, scene, maps, view, 1)
}

/// One picture, the mean of `samples_per_side`² places of each pixel.
///
/// # Errors
/// Those of [`render_offscreen`].
pub fn render_sampled(
    gpu: &Gpu,
    scene: &Scene,
    maps: &[IlluminationMap],
    view: &View,
    samples_per_side: u32,
) -> Result<Picture> {
    let counted = render_counted(
        gpu,
        scene,
        maps,
        view,
        samples_per_side,
        &EffectSwitches::default(),
    )?;
    Ok(counted.0)
}

/// [`render_sampled`] with chains and dispersion switched, and what was made and drawn for it.
///
/// # Errors
/// Those of [`render_offscreen`].
pub fn render_counted(
    gpu: &Gpu,
    scene: &Scene,
    maps: &[IlluminationMap],
    view: &View,
    samples_per_side: u32,
    effects: &EffectSwitches,
) -> Result<(Picture, EyeCounts)> {
    let mut renderer = Renderer::new(gpu, scene, wgpu::TextureFormat::Rgba8Unorm, 1)?;
    renderer.set_quality(EyeQuality::STILL);
    renderer.set_maps(gpu, scene, maps)?;
    renderer.set_chains(gpu, effects.get(Effect::Chains))?;
    renderer.set_dispersion(effects.get(Effect::Dispersion));
    let picture = renderer.radiance_sampled(gpu, view, samples_per_side)?;
    Ok((picture, renderer.counts()))
}
