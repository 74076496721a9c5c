//! Measures the frame times of a camera path on the graphics device, with and without chains.

use std::time::Instant;

use serde::Serialize;

use super::View;
use super::renderer::{GpuMs, Renderer};
use crate::effect::{Effect, EffectSwitch, EffectSwitches};
use crate::error::{Error, Result};
use crate::gpu::{Gpu, readback, texture_of};
use crate::illumination::IlluminationMap;
use crate::optics::spectrum::xyz::Matrix3;
use crate::progress::{Control, Progress, Stage};
use crate::scene::{Camera, Scene};

/// Samples per pixel, as in the window.
pub const SAMPLES: u32 = 4;

/// Format of the target: sRGB-encoded values, as in the window.
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

/// Maximum number of times that a frame is drawn again because it created pipelines. They are normally created all at
/// once; a renderer that never stops creating them is not waited for.
const MAX_REPEATS: usize = 8;

/// A camera path through a lit scene.
#[derive(Debug)]
pub struct Walk<'a> {
    pub scene: &'a Scene,
    pub maps: &'a [IlluminationMap],
    /// Size, exposure, tone map and background of every frame; its camera is used for auto exposure alone.
    pub view: View,
    /// One per frame.
    pub cameras: &'a [Camera],
    /// Only the switch of dispersion is used.
    pub effects: &'a EffectSwitches,
    /// Matrix by which radiance is multiplied before tone mapping.
    pub white_balance: Matrix3,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Spread {
    /// Lower median for an even number of values.
    pub median: f64,
    /// The smallest value that at least 95 % of the values do not exceed.
    pub p95: f64,
    pub max: f64,
}

impl Spread {
    /// All zero without values.
    pub fn of(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        // Rounded up: 95 % of 20 are 19.
        let rank = (values.len() * 19).div_ceil(20);
        Self {
            p95: values.get(rank.saturating_sub(1)).copied().unwrap_or(0.0),
            max: values.last().copied().unwrap_or(0.0),
            median: values
                .get(values.len().saturating_sub(1) / 2)
                .copied()
                .unwrap_or(0.0),
        }
    }
}

/// GPU time by pass [ms].
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DeviceMs {
    /// The pass over all surfaces.
    pub opaque: Spread,
    /// Tracing chains.
    pub specular: Spread,
    pub tone_mapping: Spread,
    /// All three passes of a frame.
    pub sum: Spread,
}

/// A frame that created pipelines or was the very first. It measures start-up cost and is excluded from all other
/// figures.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct WarmUp {
    /// Number of the frame, from 1 on.
    pub frame: usize,
    /// From the call until the GPU is done [ms].
    pub wall_ms: f64,
    /// GPU time of all passes [ms]; `None` without timestamp queries.
    pub device_ms: Option<f64>,
    /// Pipelines created.
    pub pipelines: u64,
}

/// Times of all frames of a path, drawn with one setting of chains.
#[derive(Clone, Debug, Serialize)]
pub struct MannerTimes {
    pub chains: EffectSwitch,
    /// Timed frames: each frame of the path once, without warm-up.
    pub frames: usize,
    /// `None` without timestamp queries.
    pub device_ms: Option<DeviceMs>,
    /// From the call until the GPU is done [ms].
    pub wall_ms: Spread,
    /// Objects drawn per frame.
    pub drawn_objects: Spread,
    /// Specular objects drawn per frame.
    pub drawn_specular: Spread,
    /// Render pipelines at the end.
    pub pipelines: u64,
    /// Those of them for specular surfaces.
    pub specular_pipelines: u64,
    /// In frame order.
    pub warm_up: Vec<WarmUp>,
}

/// Ratio of the median times of two settings; `None` where the other median is not positive.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Ratio {
    /// GPU time of all passes; also `None` without timestamp queries.
    pub device: Option<f64>,
    /// Time from the call until the GPU is done.
    pub wall: Option<f64>,
}

impl MannerTimes {
    /// Ratio of these times to those of `other`.
    pub fn over(&self, other: &Self) -> Ratio {
        let over = |a: f64, b: f64| (b > 0.0).then(|| a / b);
        let device = self.device_ms.zip(other.device_ms);
        Ratio {
            device: device.and_then(|(a, b)| over(a.sum.median, b.sum.median)),
            wall: over(self.wall_ms.median, other.wall_ms.median),
        }
    }
}

/// Called with the index of a frame, from 0 on, and its pixels: sRGB-encoded RGBA, row 0 at the top.
pub type Keep<'a> = dyn FnMut(usize, Vec<u8>) -> Result<()> + 'a;

/// Draws every frame once with each of `switches`. The order rotates from frame to frame, so that drift affects all
/// switches alike. `keep` receives the frames of the last switch.
///
/// # Errors
/// A picture that the device cannot hold; a lost device; cancellation; errors of `keep`.
pub fn measure(
    gpu: &Gpu,
    walk: &Walk<'_>,
    switches: &[EffectSwitch],
    mut keep: Option<&mut Keep<'_>>,
    progress: &dyn Progress,
    control: &Control,
) -> Result<Vec<MannerTimes>> {
    // One target serves all switches: each frame is finished, and read back if kept, before the next one is drawn.
    gpu.check_texture_size("picture", walk.view.width, walk.view.height)?;
    let size = [walk.view.width, walk.view.height, 1];
    let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC;
    let target = gpu
        .device
        .create_texture(&texture_of("frame", size, FORMAT, usage));

    // Scene and maps are uploaded before any frame is timed.
    let manners = switches
        .iter()
        .map(|switch| TimedRenderer::new(gpu, walk, *switch));
    let mut manners = manners.collect::<Result<Vec<_>>>()?;

    // All switches draw a camera before any of them draws the next one.
    for (frame, camera) in walk.cameras.iter().enumerate() {
        progress.advance(Stage::Picture, frame as u64, walk.cameras.len() as u64);
        let view = View {
            camera: camera.clone(),
            ..walk.view.clone()
        };
        for turn in 0..manners.len() {
            if control.is_cancelled() {
                return Err(Error::cancelled("path"));
            }
            let which = (frame + turn) % manners.len();
            manners[which].draw_settled(gpu, &target, &view, frame)?;
            if let Some(keep) = keep.as_mut().filter(|_| which + 1 == switches.len()) {
                keep(frame, readback::read_texture(gpu, &target)?)?;
            }
        }
    }
    Ok(manners.into_iter().map(TimedRenderer::times).collect())
}

/// Auto exposure of the walk's view [stops].
///
/// # Errors
/// A picture that the device cannot hold; a lost device.
pub fn auto_exposure_stops(gpu: &Gpu, walk: &Walk<'_>) -> Result<f64> {
    let mut renderer = Renderer::new(gpu, walk.scene, FORMAT, SAMPLES)?;
    renderer.set_maps(gpu, walk.scene, walk.maps)?;
    // An eighth of the width and height is enough to estimate the brightness.
    let view = View {
        width: walk.view.width.div_ceil(8),
        height: walk.view.height.div_ceil(8),
        ..walk.view.clone()
    };
    Ok(renderer.radiance(gpu, &view)?.auto_exposure_stops())
}

#[derive(Clone, Copy, Debug)]
struct TimedFrame {
    wall_ms: f64,
    device_ms: Option<GpuMs>,
    objects: u64,
    specular: u64,
}

/// Each switch has a renderer of its own, since switching chains off frees their resources.
struct TimedRenderer {
    chains: EffectSwitch,
    renderer: Renderer,
    drawings: Vec<TimedFrame>,
    warm_up: Vec<WarmUp>,
}

impl TimedRenderer {
    fn new(gpu: &Gpu, walk: &Walk<'_>, chains: EffectSwitch) -> Result<Self> {
        let mut renderer = Renderer::new(gpu, walk.scene, FORMAT, SAMPLES)?;
        renderer.set_maps(gpu, walk.scene, walk.maps)?;
        renderer.set_chains(gpu, chains)?;
        renderer.set_dispersion(walk.effects.get(Effect::Dispersion));
        renderer.set_white_balance(&walk.white_balance);
        gpu.wait()?;
        Ok(Self {
            chains,
            renderer,
            drawings: Vec::new(),
            warm_up: Vec::new(),
        })
    }

    /// Draws a frame until it creates no more pipelines.
    fn draw_settled(&mut self, gpu: &Gpu, target: &wgpu::Texture, view: &View, frame: usize) -> Result<()> {
        let mut is_first = self.drawings.is_empty();
        for repeat in 0.. {
            let before = self.renderer.counts().pipelines;
            let drawing = self.draw(gpu, target, view)?;
            let made = self.renderer.counts().pipelines.saturating_sub(before);
            if (made == 0 && !is_first) || repeat == MAX_REPEATS {
                self.drawings.push(drawing);
                break;
            }
            is_first = false;
            self.warm_up.push(WarmUp {
                frame: frame + 1,
                wall_ms: drawing.wall_ms,
                device_ms: drawing.device_ms.map(|ms| ms.sum()),
                pipelines: made,
            });
        }
        Ok(())
    }

    fn draw(&mut self, gpu: &Gpu, target: &wgpu::Texture, view: &View) -> Result<TimedFrame> {
        let start = Instant::now();
        let target = target.create_view(&wgpu::TextureViewDescriptor::default());
        let mut encoder = gpu
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("frame") });
        self.renderer.draw(gpu, &mut encoder, &target, view)?;
        gpu.queue.submit([encoder.finish()]);
        gpu.wait()?;
        let wall_ms = 1e3 * start.elapsed().as_secs_f64();
        // The GPU is done, so these times are of this frame.
        let is_measured = self.renderer.collect_times(gpu);
        let counts = self.renderer.counts();
        Ok(TimedFrame {
            wall_ms,
            device_ms: counts.timed.filter(|_| is_measured).map(|timed| timed.ms),
            objects: counts.drawn_objects,
            specular: counts.drawn_specular,
        })
    }

    fn times(self) -> MannerTimes {
        let counts = self.renderer.counts();
        let drawings = &self.drawings;
        let spread = |value: &dyn Fn(&TimedFrame) -> f64| Spread::of(drawings.iter().map(value).collect());
        MannerTimes {
            chains: self.chains,
            frames: drawings.len(),
            device_ms: device_ms(drawings),
            wall_ms: spread(&|drawing| drawing.wall_ms),
            drawn_objects: spread(&|drawing| drawing.objects as f64),
            drawn_specular: spread(&|drawing| drawing.specular as f64),
            pipelines: counts.pipelines,
            specular_pipelines: counts.specular_pipelines,
            warm_up: self.warm_up,
        }
    }
}

/// `None` if any frame has no GPU times.
fn device_ms(drawings: &[TimedFrame]) -> Option<DeviceMs> {
    let times: Vec<GpuMs> = drawings
        .iter()
        .map(|drawing| drawing.device_ms)
        .collect::<Option<_>>()?;
    let spread = |value: fn(GpuMs) -> f64| Spread::of(times.iter().copied().map(value).collect());
    Some(DeviceMs {
        opaque: spread(|ms| ms.opaque),
        specular: spread(|ms| ms.specular),
        tone_mapping: spread(|ms| ms.tone_mapping),
        sum: spread(|ms| ms.sum()),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spreads_are_of_the_values() {
        let values: Vec<f64> = (1..=100).rev().map(f64::from).collect();
        let of = |values: &[f64]| Spread::of(values.to_vec());
        let expected = Spread {
            median: 50.0,
            p95: 95.0,
            max: 100.0,
        };
        assert_eq!(of(&values), expected);
        // A hitch in one frame of three is the 95th percentile, in one of a hundred it is not.
        assert_eq!(of(&[1.0, 9.0, 2.0]).p95, 9.0);
        assert_eq!(of(&[1.0, 9.0, 2.0]).median, 2.0);
        assert_eq!(of(&[]), Spread::default());
    }
}
