//! The window with everything that draws in it. It is dropped and created anew when the device is lost.

use std::sync::Arc;
use std::time::Duration;

use winit::dpi::LogicalSize;
use winit::event_loop::{ActiveEventLoop, EventLoopProxy};
use winit::window::{Window, WindowAttributes};

use super::app::UserEvent;
use super::interface::{Interface, Painting};
use super::pace::PictureQuality;
use crate::effect::EffectSwitch;
use crate::error::{Error, Result};
use crate::eye_pass::renderer::{MapStyle, Renderer, TimedFrame, Uploaded};
use crate::eye_pass::{self, View};
use crate::gpu::{Gpu, texture_of};
use crate::illumination::IlluminationMap;
use crate::optics::spectrum::xyz::{IDENTITY, Matrix3};
use crate::scene::Scene;

/// Smallest inner size of the window [logical pixels]: room for the panel and a picture about as wide.
const SMALLEST: LogicalSize<u32> = LogicalSize::new(700, 400);
/// Multisampling: samples per pixel.
pub(super) const SAMPLES: u32 = 4;

/// Format of pictures. It holds encoded values because egui blends and shows them as they are.
pub(super) const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

/// Outcome of showing a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameOutcome {
    /// The frame was shown.
    Yes,
    /// The window is hidden or has no area; an event will come when it is visible again.
    Hidden,
    /// No frame is available at present: try again after [`RETRY_AFTER`].
    Later,
    /// Window and device have to be recreated.
    Broken,
}

/// How pictures are rendered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RenderOptions {
    /// Whether reflections and refractions are traced.
    pub chains: EffectSwitch,
    /// Whether refraction depends on wavelength.
    pub dispersion: EffectSwitch,
    /// Matrix applied to radiance before tone mapping.
    pub white_balance: Matrix3,
}

impl Default for RenderOptions {
    fn default() -> Self {
        Self {
            chains: EffectSwitch::default(),
            dispersion: EffectSwitch::default(),
            white_balance: IDENTITY,
        }
    }
}

/// A picture in the window: its render target, its renderer, and what both show.
pub struct Canvas {
    target: wgpu::TextureView,
    /// egui's id of the picture.
    pub id: egui::TextureId,
    size: [u32; 2],
    /// `None` if the picture is out of date.
    shown: Option<View>,
    /// Pixels of the picture per pixel of the view.
    scale: f64,
    pub renderer: Renderer,
    /// The scene on the device.
    scene: Arc<Scene>,
    style: MapStyle,
    options: RenderOptions,
}

impl Canvas {
    /// A picture of one pixel, registered with egui.
    fn new(gpu: &Gpu, egui: &mut egui_wgpu::Renderer, scene: &Arc<Scene>) -> Result<Self> {
        let size = [1, 1];
        let target = texture(&gpu.device, size);
        Ok(Self {
            id: egui.register_native_texture(&gpu.device, &target, wgpu::FilterMode::Nearest),
            target,
            size,
            shown: None,
            scale: 1.0,
            renderer: Renderer::new(gpu, scene, FORMAT, SAMPLES)?,
            scene: Arc::clone(scene),
            style: MapStyle::default(),
            options: RenderOptions::default(),
        })
    }

    /// Whether the picture shows a view.
    fn shows(&self, view: &View) -> bool {
        self.shown.as_ref() == Some(view)
    }

    /// Uploads an edited scene and returns what had to be uploaded. If that is anything, the maps have to be set
    /// again, as surfaces may have become receivers.
    ///
    /// # Errors
    /// The scene does not fit on the device.
    pub fn set_scene(&mut self, gpu: &Gpu, scene: &Arc<Scene>) -> Result<Uploaded> {
        if Arc::ptr_eq(&self.scene, scene) {
            return Ok(Uploaded::default());
        }
        self.scene = Arc::clone(scene);
        let uploaded = self.renderer.set_scene(gpu, scene)?;
        if uploaded != Uploaded::default() {
            self.shown = None;
        }
        Ok(uploaded)
    }

    /// Uploads maps and returns what had to be uploaded.
    ///
    /// # Errors
    /// The maps do not fit on the device; the previous ones stay.
    pub fn set_maps(&mut self, gpu: &Gpu, maps: &[IlluminationMap], style: MapStyle) -> Result<Uploaded> {
        self.set_style(style);
        self.shown = None;
        self.renderer.set_maps(gpu, &self.scene, maps)
    }

    /// Changes how the present maps are displayed.
    pub fn set_style(&mut self, style: MapStyle) {
        if self.style != style {
            (self.style, self.shown) = (style, None);
            self.renderer.set_map_style(style);
        }
    }

    /// Whether direct light is traced per pixel. If so, maps have to be set without direct light.
    pub fn set_traces_lights(&mut self, traces: bool) {
        self.shown = None;
        self.renderer.set_traces_lights(traces);
    }

    /// Sets how pictures are rendered.
    ///
    /// # Errors
    /// The resources needed do not fit on the device.
    pub fn set_options(&mut self, gpu: &Gpu, options: RenderOptions) -> Result<()> {
        if self.options == options {
            return Ok(());
        }
        (self.options, self.shown) = (options, None);
        self.renderer.set_dispersion(options.dispersion);
        self.renderer.set_white_balance(&options.white_balance);
        self.renderer.set_chains(gpu, options.chains)
    }

    pub fn quality(&self) -> PictureQuality {
        PictureQuality {
            scale: self.scale,
            eye: self.renderer.quality(),
        }
    }

    /// Draws a view, unless the picture shows it already in that quality; returns whether it drew.
    fn draw(
        &mut self,
        gpu: &Gpu,
        egui: &mut egui_wgpu::Renderer,
        view: &View,
        quality: PictureQuality,
    ) -> Result<bool> {
        if self.shows(view) && self.quality() == quality {
            return Ok(false);
        }

        // Another exposure or tone map of what was drawn, in whichever quality, needs no new frame.
        if self.shown.is_some() && !self.shows(view) {
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            let scaled = scaled(view, self.scale);
            if self.renderer.expose(gpu, &mut encoder, &self.target, &scaled) {
                self.shown = Some(view.clone());
                gpu.queue.submit([encoder.finish()]);
                return Ok(true);
            }
        }

        // The target has the size of the frame; egui scales it to that of the view.
        if self.renderer.quality() != quality.eye {
            self.renderer.set_quality(quality.eye);
        }
        self.scale = quality.scale;
        let frame = scaled(view, self.scale);
        if self.size != [frame.width, frame.height] {
            self.size = [frame.width, frame.height];
            self.target = texture(&gpu.device, self.size);
            let filter = if self.scale < 1.0 {
                wgpu::FilterMode::Linear
            } else {
                wgpu::FilterMode::Nearest
            };
            let target = &self.target;
            egui.update_egui_texture_from_wgpu_texture(&gpu.device, target, filter, self.id);
        }
        self.shown = Some(view.clone());
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        self.renderer.draw(gpu, &mut encoder, &self.target, &frame)?;
        gpu.queue.submit([encoder.finish()]);
        Ok(true)
    }

    /// Adds a sample to the mean that the picture shows, or draws the view if the picture does not show it in that
    /// quality.
    fn refine(
        &mut self,
        gpu: &Gpu,
        egui: &mut egui_wgpu::Renderer,
        view: &View,
        quality: PictureQuality,
    ) -> Result<()> {
        if self.draw(gpu, egui, view, quality)? {
            return Ok(());
        }
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        self.renderer
            .refine(gpu, &mut encoder, &self.target, &scaled(view, self.scale))?;
        gpu.queue.submit([encoder.finish()]);
        Ok(())
    }
}

/// A window, its graphics device and its pictures.
pub struct Graphics {
    pub interface: Interface,
    pub main: Canvas,
    /// The right part of the picture in a comparison.
    pub beside: Option<Canvas>,
    screen: Screen,
    pub gpu: Gpu,
}

impl Graphics {
    /// Opens a window for a scene.
    ///
    /// # Errors
    /// The system offers no window or no graphics adapter.
    pub fn new(
        event_loop: &ActiveEventLoop,
        proxy: EventLoopProxy<UserEvent>,
        scene: &Arc<Scene>,
        (width, height): (u32, u32),
    ) -> Result<Self> {
        // Hidden until everything is ready: assistive technology has to be connected first, and an empty window would
        // flash.
        let attributes = WindowAttributes::default()
            .with_title(format!("Nephroid – {}", scene.name))
            .with_inner_size(LogicalSize::new(width, height))
            .with_min_inner_size(SMALLEST)
            .with_visible(false);
        let window = event_loop
            .create_window(attributes)
            .map_err(|error| window_error(&error.to_string()))?;
        let window = Arc::new(window);

        // The surface comes before the adapter, which has to be able to present to it.
        let display = Box::new(event_loop.owned_display_handle());
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_with_display_handle_from_env(
            display,
        ));
        let surface = instance
            .create_surface(Arc::clone(&window))
            .map_err(|error| window_error(&error.to_string()))?;
        let gpu = Gpu::for_surface(instance, &surface)?;

        // egui's pipelines are made for the format of the surface.
        let screen = Screen::new(Arc::clone(&window), surface, &gpu)?;
        let mut interface = Interface::new(event_loop, &window, proxy, &gpu.device, screen.config.format);
        let main = Canvas::new(&gpu, &mut interface.renderer, scene)?;
        window.set_visible(true);
        Ok(Self {
            interface,
            main,
            beside: None,
            screen,
            gpu,
        })
    }

    pub fn window(&self) -> &Arc<Window> {
        &self.screen.window
    }

    /// Sets the maps of the comparison's right part and their scene; `None` ends the comparison.
    ///
    /// # Errors
    /// The maps do not fit on the device.
    pub fn set_beside(&mut self, shown: Option<(&Arc<Scene>, &[IlluminationMap], MapStyle)>) -> Result<()> {
        let egui = &mut self.interface.renderer;
        let before = self.beside.take();
        let Some((scene, maps, style)) = shown else {
            if let Some(beside) = before {
                egui.free_texture(&beside.id);
            }
            return Ok(());
        };
        let mut beside = match before {
            Some(beside) => beside,
            None => Canvas::new(&self.gpu, egui, scene)?,
        };
        beside.set_scene(&self.gpu, scene)?;
        beside.set_options(&self.gpu, self.main.options)?;
        beside.set_maps(&self.gpu, maps, style)?;
        self.beside = Some(beside);
        self.main.shown = None;
        Ok(())
    }

    /// To be called when the window's size has changed.
    pub fn resize(&mut self) {
        self.screen.resize(&self.gpu.device);
    }

    /// The latest frame whose GPU time is known; `None` if there is none since the last call.
    pub fn take_times(&mut self) -> Option<TimedFrame> {
        let is_new = self.main.renderer.collect_times(&self.gpu);
        self.main.renderer.counts().timed.filter(|_| is_new)
    }

    /// Measures the exposure that suits the picture [stops].
    ///
    /// # Errors
    /// The device was lost.
    pub fn measure_exposure(&mut self, view: &View) -> Result<f64> {
        // One pixel in 64 is enough to measure the brightness.
        let part = View {
            width: view.width.div_ceil(8),
            height: view.height.div_ceil(8),
            ..view.clone()
        };
        let picture = self.main.renderer.glance(&self.gpu, &part)?;
        Ok(picture.auto_exposure_stops())
    }

    /// Radiance of every pixel of the picture shown.
    ///
    /// # Errors
    /// A picture with no area or above the device's limits; a lost device.
    pub fn radiance(&mut self, view: &View) -> Result<eye_pass::Picture> {
        self.main.renderer.shown_radiance(&self.gpu, view)
    }

    /// Whether the picture, with both parts of a comparison, shows a view.
    pub fn shows(&self, view: &View) -> bool {
        let beside = self.beside.as_ref();
        self.main.shows(view) && beside.is_none_or(|beside| beside.shows(view))
    }

    /// Adds a sample to the picture shown, or draws the view if it is not shown in that quality.
    ///
    /// # Errors
    /// A picture of that size does not fit on the device.
    pub fn refine_picture(&mut self, view: &View, quality: PictureQuality) -> Result<()> {
        for canvas in [Some(&mut self.main), self.beside.as_mut()].into_iter().flatten() {
            canvas.refine(&self.gpu, &mut self.interface.renderer, view, quality)?;
        }
        Ok(())
    }

    /// Draws the view unless it is shown already; returns whether it drew.
    ///
    /// # Errors
    /// A picture of that size does not fit on the device.
    pub fn draw_picture(&mut self, view: &View, quality: PictureQuality) -> Result<bool> {
        let egui = &mut self.interface.renderer;
        if let Some(beside) = &mut self.beside {
            beside.set_options(&self.gpu, self.main.options)?;
            beside.draw(&self.gpu, egui, view, quality)?;
        }
        self.main.draw(&self.gpu, egui, view, quality)
    }

    /// Presents the interface, which contains the picture.
    pub fn show(&mut self, painting: &mut Painting) -> FrameOutcome {
        let acquired = if self.gpu.is_lost() {
            Err(FrameOutcome::Broken)
        } else {
            self.screen.acquire(&self.gpu)
        };
        let config = &self.screen.config;
        let target = acquired.as_ref().ok().map(|frame| {
            let view = frame.texture.create_view(&wgpu::TextureViewDescriptor::default());
            (view, [config.width, config.height])
        });
        self.interface.paint(&self.gpu, painting, target);
        match acquired {
            Ok(frame) => {
                self.screen.window.pre_present_notify();
                self.gpu.queue.present(frame);
                FrameOutcome::Yes
            }
            Err(outcome) => outcome,
        }
    }
}

/// Delay before the next attempt after [`FrameOutcome::Later`].
pub const RETRY_AFTER: Duration = Duration::from_millis(50);

fn window_error(what: &str) -> Error {
    Error::failure(
        "window",
        format!("the system gives none ({what})"),
        "check the display, or use `bake` and `render`, which need no window",
    )
}

/// A view with fewer pixels.
fn scaled(view: &View, scale: f64) -> View {
    let scaled = |pixels: u32| (f64::from(pixels) * scale).ceil() as u32;
    View {
        width: scaled(view.width),
        height: scaled(view.height),
        ..view.clone()
    }
}

pub(super) fn texture(device: &wgpu::Device, [width, height]: [u32; 2]) -> wgpu::TextureView {
    let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING;
    let texture = device.create_texture(&texture_of("picture", [width, height, 1], FORMAT, usage));
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

/// A window and its surface.
#[derive(Debug)]
struct Screen {
    /// Declared first so that it is dropped before its window.
    surface: wgpu::Surface<'static>,
    config: wgpu::SurfaceConfiguration,
    window: Arc<Window>,
    /// False while the window has no area: its surface cannot be configured then.
    has_area: bool,
}

impl Screen {
    /// Configures a surface for a window.
    ///
    /// # Errors
    /// The adapter cannot draw on the surface.
    fn new(window: Arc<Window>, surface: wgpu::Surface<'static>, gpu: &Gpu) -> Result<Self> {
        let size = window.inner_size();
        let mut config = surface
            .get_default_config(&gpu.adapter, size.width.max(1), size.height.max(1))
            .ok_or_else(|| {
                Error::failure(
                    "window",
                    format!("{} cannot draw on it", gpu.adapter.get_info().name),
                    "choose another driver, or use `bake` and `render`, which need no window",
                )
            })?;
        // egui blends in encoded values, so the surface must not convert to sRGB.
        let formats = surface.get_capabilities(&gpu.adapter).formats;
        if let Some(format) = formats.into_iter().find(|format| !format.is_srgb()) {
            config.format = format;
        }
        config.present_mode = wgpu::PresentMode::AutoVsync;
        let mut screen = Self {
            surface,
            config,
            window,
            has_area: false,
        };
        screen.resize(&gpu.device);
        Ok(screen)
    }

    /// Adapts the surface to the window's size.
    fn resize(&mut self, device: &wgpu::Device) {
        let size = self.window.inner_size();
        self.has_area = size.width > 0 && size.height > 0;
        if self.has_area {
            let largest = device.limits().max_texture_dimension_2d;
            self.config.width = size.width.min(largest);
            self.config.height = size.height.min(largest);
            self.surface.configure(device, &self.config);
        }
    }

    /// Acquires the next frame; reconfigures or recreates the surface once if that may help. Without a frame, tells
    /// what to do.
    fn acquire(&mut self, gpu: &Gpu) -> std::result::Result<wgpu::SurfaceTexture, FrameOutcome> {
        for _ in 0..2 {
            if !self.has_area {
                return Err(FrameOutcome::Hidden);
            }
            use wgpu::CurrentSurfaceTexture as Current;
            match self.surface.get_current_texture() {
                // A suboptimal frame is good enough: a resize event follows.
                Current::Success(frame) | Current::Suboptimal(frame) => return Ok(frame),
                Current::Timeout => return Err(FrameOutcome::Later),
                Current::Occluded => return Err(FrameOutcome::Hidden),
                Current::Outdated => self.resize(&gpu.device),
                Current::Lost => {
                    log::warn!("the window's surface was lost; it is made anew");
                    match gpu.instance.create_surface(Arc::clone(&self.window)) {
                        Ok(surface) => self.surface = surface,
                        Err(error) => {
                            log::warn!("the window's surface cannot be made anew: {error}");
                            return Err(FrameOutcome::Broken);
                        }
                    }
                    self.resize(&gpu.device);
                }
                Current::Validation => return Err(FrameOutcome::Broken),
            }
        }
        Err(FrameOutcome::Later)
    }
}
