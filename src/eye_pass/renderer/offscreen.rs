//! Pictures without a window: radiance before exposure and tone mapping.

use half::f16;

use super::accumulation::Mean;
use super::draws::Sample;
use super::draws::visible_objects;
use super::{EyeCounts, EyeQuality, MapStyle, Renderer};
use crate::effect::{Effect, EffectSwitch, EffectSwitches};
use crate::error::Result;
use crate::eye_pass::highlights::VisibleLamp;
use crate::eye_pass::{Picture, View, facets};
use crate::gpu::{Gpu, readback};
use crate::illumination::IlluminationMap;
use crate::scene::Scene;

/// The peak radiance is scaled to at most this. Half floats end at 65504, and refraction may still multiply radiance by
/// the square of a refractive index.
const LARGEST_SCALED: f64 = 4096.0;

/// Ratio of the radiance of the environment and of lamps to that of surfaces above which it is clipped. Half floats then
/// keep eleven binary digits for radiance of a thousandth of the brightest surface.
const LARGEST_OVER_SURFACES: f64 = 1024.0;

/// Scaled radiance from which on a mean may contain clipped values.
const CUT_SCALED: f64 = 500.0;
/// Samples across and down a pixel when a picture to be kept is drawn again.
const ANEW_SIDE: u32 = 2;
/// Minimum number of frames per picture when chains split into wavelengths: 48 wavelengths.
const MIN_PARTED: u32 = 16;

impl Renderer {
    /// Radiance per pixel [W/(m² sr)] of a view, sampled at the pixel centres, in the precision of half floats.
    ///
    /// # Errors
    /// A size of 0 or above the device's limit; a lost device.
    pub fn radiance(&mut self, gpu: &Gpu, view: &View) -> Result<Picture> {
        self.radiance_sampled(gpu, view, 1)
    }

    /// [`radiance`](Self::radiance) without chains, which is enough to estimate the brightness.
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

    /// Mean radiance of `samples_per_side`² samples per pixel, at the same positions as in the CPU eye pass. Averages
    /// more frames if chains split into wavelengths or meet rough surfaces, since each frame traces only a few of them.
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
                timing.finish(
                    gpu,
                    &mut encoder,
                    (has_specular, false),
                    (self.quality, view.width),
                );
            }
            gpu.queue.submit([encoder.finish()]);
        }
        let picture = self.read_radiance(gpu, view, scale, pictures > 1)?;
        self.collect_times(gpu);
        Ok(picture)
    }

    /// Radiance of the last frame, or the mean of all frames of its view. Draws the view again if another one was drawn
    /// last, or if it is bright enough to be clipped.
    ///
    /// # Errors
    /// Those of [`radiance`](Self::radiance).
    pub fn shown_radiance(&mut self, gpu: &Gpu, view: &View) -> Result<Picture> {
        let Some(drawn) = self.drawn_as(view) else {
            return self.radiance_sampled(gpu, view, ANEW_SIDE);
        };
        let scale = drawn.exposure_stops.exp2();
        let is_mean = self.mean.as_ref().is_some_and(|mean| mean.count() > 0);
        let picture = self.read_radiance(gpu, view, scale, is_mean)?;
        let largest = picture.radiance.iter().flatten().fold(0.0_f32, |a, b| a.max(*b));
        if f64::from(largest) * scale >= CUT_SCALED {
            return self.radiance_sampled(gpu, view, ANEW_SIDE);
        }
        Ok(picture)
    }

    /// Number of frames for `places` samples per pixel, enough to cover the spectrum and the lobes of rough surfaces.
    fn pictures(&self, view: &View, places: u32) -> u32 {
        let draw_state = self.draw_state();
        let is_chain = |object: &usize| draw_state.is_specular(&self.objects.list[*object]);
        let needed = match draw_state.flags {
            flags if flags.has_lobes => facets::PER_PIXEL,
            flags if flags.is_dispersive => MIN_PARTED,
            _ => return places,
        };
        if visible_objects(&self.objects, view).iter().any(is_chain) {
            needed.div_ceil(places) * places
        } else {
            places
        }
    }

    /// Scale that brings radiance into the range of half floats.
    fn scale(&self, view: &View) -> f64 {
        if matches!(self.map_style, MapStyle::Inspected { .. }) {
            return 1.0;
        }
        let peak = self.objects.peak_radiance.max(self.peak_behind(view));
        let peak = peak.max(self.peak_of_lamps());
        // Powers of two are lossless.
        if peak > 0.0 {
            (LARGEST_SCALED / peak).log2().floor().exp2()
        } else {
            1.0
        }
    }

    /// Largest radiance behind the surfaces [W/(m² sr)]. The sun of an environment may be clipped, as a scale that
    /// holds it would leave too little precision for everything else.
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

    /// Largest radiance of lamps [W/(m² sr)], of which those without extent are seen in mirrors and glass alone. It depends
    /// on the view, so the limit is taken; without lit surfaces, that of white ones that a lamp lights from 1 m.
    fn peak_of_lamps(&self) -> f64 {
        let has_specular = self.draw_state().has_specular(&self.objects);
        let lamps = VisibleLamp::all(&self.scene).into_iter();
        let lamps = lamps.filter(|lamp| has_specular || lamp.has_extent);
        let strongest = lamps.map(|lamp| lamp.strength().max_channel()).reduce(f64::max);
        let lit = match self.objects.peak_radiance {
            0.0 => strongest.map(|strength| strength / std::f64::consts::PI),
            of_surfaces => strongest.map(|_| of_surfaces),
        };
        lit.unwrap_or_default() * LARGEST_OVER_SURFACES
    }

    fn add_to_mean(&mut self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder, is_first: bool) {
        let Some(targets) = &self.targets else { return };
        let mut mean = Mean::of_size(self.mean.take(), gpu, targets.size);
        if is_first {
            mean.clear();
        }
        mean.add(gpu, encoder, &targets.resolved_view);
        self.mean = Some(mean);
    }

    /// The last frame, or the mean of several, without its scale.
    fn read_radiance(&self, gpu: &Gpu, view: &View, scale: f64, is_mean: bool) -> Result<Picture> {
        let mean = self.mean.as_ref().filter(|_| is_mean);
        let channels: Vec<f64> = match (mean, &self.targets) {
            (Some(mean), _) => {
                let bytes = readback::read_texture(gpu, mean.picture().0)?;
                let floats = bytes.chunks_exact(4).map(bytemuck::pod_read_unaligned::<f32>);
                floats.map(f64::from).collect()
            }
            (None, Some(targets)) => {
                let bytes = readback::read_texture(gpu, &targets.resolved)?;
                let halves = bytes.chunks_exact(2).map(bytemuck::pod_read_unaligned::<f16>);
                halves.map(f64::from).collect()
            }
            (None, None) => Vec::new(),
        };
        let pixels = channels.chunks_exact(4);
        Ok(Picture {
            width: view.width,
            height: view.height,
            radiance: pixels
                .map(|rgba| [0, 1, 2].map(|channel| (rgba[channel] / scale) as f32))
                .collect(),
        })
    }
}

/// Renders one picture in the quality of stills, with `samples_per_side`² samples per pixel and switches for chains and
/// dispersion; also returns the renderer's counts.
///
/// # Errors
/// Those of [`Renderer::new`], [`Renderer::set_maps`] and [`Renderer::radiance`].
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
