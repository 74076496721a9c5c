//! A device that all tests of a binary share, and a renderer on it.

use std::sync::OnceLock;

use nephroid::effect::EffectSwitch;
use nephroid::eye_pass::renderer::{EyeQuality, Renderer, Uploaded};
use nephroid::gpu::{Gpu, readback};

pub use support::or_skip;
use support::prelude::*;
use support::skip;

pub const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
/// Maps at their finest, as the CPU looks them up, and both ways on at as many surfaces as the device can.
pub const AS_CPU: EyeQuality = EyeQuality {
    minifies: false,
    ..EyeQuality::STILL
};

/// The device, or `None` after a counted skip where there is no adapter.
pub fn gpu() -> Option<&'static Gpu> {
    static SHARED: OnceLock<Result<Gpu, String>> = OnceLock::new();
    let shared = SHARED.get_or_init(|| Gpu::headless().map_err(|error| error.to_string()));
    let test = std::thread::current();
    let name = test.name().unwrap_or("?");
    shared.as_ref().map_err(|reason| skip(name, reason)).ok()
}

/// A smaller device of a test's own, which may break it.
pub fn own_gpu(limits: impl FnOnce(&mut wgpu::Limits)) -> Option<Gpu> {
    gpu()?;
    let small = Gpu::headless_within(|mut all| {
        limits(&mut all);
        all
    });
    Some(small.expect("less is always granted"))
}

/// Share of the channels that differ by more than 1 % of themselves, or of a tenth of the brightest: borders of shadows,
/// which a map softens over a texel, and outlines.
pub fn unlike(a: &Picture, b: &Picture) -> f64 {
    let channels = || a.radiance.iter().flatten().zip(b.radiance.iter().flatten());
    let peak = channels().fold(0.0_f32, |peak, (a, _)| peak.max(*a));
    assert!(peak > 0.0, "it is not dark");
    let far = channels().filter(|(a, b)| (*a - *b).abs() > 0.01 * a.max(0.1 * peak));
    far.count() as f64 / (3 * a.radiance.len()) as f64
}

/// A renderer, and what it shows.
pub struct Rig<'a> {
    pub gpu: &'a Gpu,
    pub renderer: Renderer,
    pub scene: Scene,
    pub maps: Vec<IlluminationMap>,
    format: wgpu::TextureFormat,
}

impl Rig<'static> {
    /// On the shared device, at the quality of pictures that are kept.
    pub fn new(scene: &Scene, maps: &[IlluminationMap]) -> Option<Self> {
        Some(Self::on(gpu()?, scene, maps))
    }

    /// The same at another quality.
    pub fn at(quality: EyeQuality, scene: &Scene, maps: &[IlluminationMap]) -> Option<Self> {
        let mut rig = Self::new(scene, maps)?;
        rig.renderer.set_quality(quality);
        Some(rig)
    }
}

impl<'a> Rig<'a> {
    pub fn on(gpu: &'a Gpu, scene: &Scene, maps: &[IlluminationMap]) -> Self {
        Self::with_format(gpu, scene, maps, FORMAT, 1)
    }

    /// For targets of a format, with 1 or 4 samples a pixel.
    pub fn with_format(
        gpu: &'a Gpu,
        scene: &Scene,
        maps: &[IlluminationMap],
        format: wgpu::TextureFormat,
        samples: u32,
    ) -> Self {
        let renderer = Renderer::new(gpu, scene, format, samples).expect("it is uploaded");
        let mut rig = Self {
            gpu,
            renderer,
            scene: scene.clone(),
            maps: Vec::new(),
            format,
        };
        rig.renderer.set_quality(EyeQuality::STILL);
        rig.set_maps(maps);
        rig
    }

    pub fn set_maps(&mut self, maps: &[IlluminationMap]) -> Uploaded {
        self.maps = maps.to_vec();
        let uploaded = self.renderer.set_maps(self.gpu, &self.scene, maps);
        uploaded.expect("the maps fit")
    }

    pub fn set_scene(&mut self, scene: &Scene) -> Uploaded {
        self.scene = scene.clone();
        let uploaded = self.renderer.set_scene(self.gpu, scene);
        uploaded.expect("it is uploaded")
    }

    pub fn set_chains(&mut self, switch: EffectSwitch) {
        self.renderer.set_chains(self.gpu, switch).expect("it is made");
    }

    /// Radiance of a view.
    #[track_caller]
    pub fn picture(&mut self, view: &View) -> Picture {
        self.sampled(view, 1)
    }

    /// The mean of `side`² places of each pixel.
    #[track_caller]
    pub fn sampled(&mut self, view: &View, side: u32) -> Picture {
        let picture = self.renderer.radiance_sampled(self.gpu, view, side);
        assert_eq!(self.gpu.take_error(), None);
        picture.expect("it renders")
    }

    /// The picture of a renderer that has never shown anything else.
    pub fn fresh(&self, view: &View) -> Picture {
        let mut fresh = Rig::on(self.gpu, &self.scene, &self.maps);
        fresh.renderer.set_quality(self.renderer.quality());
        fresh.picture(view)
    }

    /// Bytes of a window of which this is a picture of a walk.
    pub fn drawn(&mut self, view: &View) -> Vec<u8> {
        self.shown(view, Renderer::draw)
    }

    /// Bytes of a window of which this is a further picture of a view at rest.
    pub fn refined(&mut self, view: &View) -> Vec<u8> {
        self.shown(view, Renderer::refine)
    }

    /// The same for a picture that is the last frame under another exposure or tone map; `None` if it cannot be.
    pub fn exposed(&mut self, view: &View) -> Option<Vec<u8>> {
        let mut is_shown = false;
        let bytes = self.shown(view, |renderer, gpu, encoder, target, view| {
            is_shown = renderer.expose(gpu, encoder, target, view);
            Ok(())
        });
        is_shown.then_some(bytes)
    }

    fn shown(
        &mut self,
        view: &View,
        draw: impl FnOnce(
            &mut Renderer,
            &Gpu,
            &mut wgpu::CommandEncoder,
            &wgpu::TextureView,
            &View,
        ) -> nephroid::error::Result<()>,
    ) -> Vec<u8> {
        let texture = self.gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d {
                width: view.width.max(1),
                height: view.height.max(1),
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: self.format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let target = texture.create_view(&Default::default());
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let drawn = draw(&mut self.renderer, self.gpu, &mut encoder, &target, view);
        drawn.expect("it draws");
        self.gpu.queue.submit([encoder.finish()]);
        readback::read_texture(self.gpu, &texture).expect("it is read back")
    }
}
