//! The window with everything that draws in it. It is dropped and created anew when the device is lost.

use std::sync::Arc;
use std::time::Duration;

use winit::dpi::LogicalSize;
use winit::event_loop::{ActiveEventLoop, EventLoopProxy};
use winit::window::{Window, WindowAttributes};

use super::app::UserEvent;
use super::interface::{Interface, Painting};
use crate::effect::EffectSwitch;
use crate::error::{Error, Result};
use crate::eye_pass::renderer::{EyeCounts, EyeQuality, GpuMs, MapStyle, Renderer, Uploaded};
use crate::eye_pass::{self, View};
use crate::gpu::Gpu;
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

/// A picture in the window and its renderer.
struct Canvas {
    picture: Picture,
    renderer: Renderer,
    /// The scene on the device.
    scene: Arc<Scene>,
    style: MapStyle,
    making: RenderOptions,
}

impl Canvas {
    fn new(gpu: &Gpu, egui: &mut egui_wgpu::Renderer, scene: &Arc<Scene>) -> Result<Self> {
        Ok(Self {
            picture: Picture::new(&gpu.device, egui),
            renderer: Renderer::new(gpu, scene, FORMAT, SAMPLES)?,
            scene: Arc::clone(scene),
            style: MapStyle::default(),
            making: RenderOptions::default(),
        })
    }

    fn set_scene(&mut self, gpu: &Gpu, scene: &Arc<Scene>) -> Result<Uploaded> {
        if Arc::ptr_eq(&self.scene, scene) {
            return Ok(Uploaded::default());
        }
        self.scene = Arc::clone(scene);
        let uploaded = self.renderer.set_scene(gpu, scene)?;
        if uploaded != Uploaded::default() {
            self.picture.invalidate();
        }
        Ok(uploaded)
    }

    fn set_maps(&mut self, gpu: &Gpu, maps: &[IlluminationMap], style: MapStyle) -> Result<Uploaded> {
        self.set_style(style);
        self.picture.invalidate();
        self.renderer.set_maps(gpu, &self.scene, maps)
    }

    fn set_style(&mut self, style: MapStyle) {
        if self.style != style {
            self.style = style;
            self.picture.invalidate();
            self.renderer.set_map_style(style);
        }
    }

    fn set_making(&mut self, gpu: &Gpu, making: RenderOptions) -> Result<()> {
        if self.making == making {
            return Ok(());
        }
        self.making = making;
        self.picture.invalidate();
        self.renderer.set_dispersion(making.dispersion);
        self.renderer.set_white_balance(gpu, &making.white_balance);
        self.renderer.set_chains(gpu, making.chains)
    }

    /// Draws a view, unless the picture shows it already in that quality; returns whether it drew.
    fn draw(
        &mut self,
        gpu: &Gpu,
        egui: &mut egui_wgpu::Renderer,
        view: &View,
        quality: EyeQuality,
    ) -> Result<bool> {
        if self.renderer.quality() != quality {
            self.picture.invalidate();
            self.renderer.set_quality(quality);
        }
        self.picture.update(&gpu.device, egui, view, |target| {
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            self.renderer.draw(gpu, &mut encoder, target, view)?;
            gpu.queue.submit([encoder.finish()]);
            Ok(())
        })
    }

    /// Adds a sample to the mean that the picture shows, or draws the view if the picture does not show it in that
    /// quality.
    fn refine(
        &mut self,
        gpu: &Gpu,
        egui: &mut egui_wgpu::Renderer,
        view: &View,
        quality: EyeQuality,
    ) -> Result<()> {
        if !self.picture.shows(view) || self.renderer.quality() != quality {
            return self.draw(gpu, egui, view, quality).map(|_| ());
        }
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        self.renderer
            .refine(gpu, &mut encoder, &self.picture.texture, view)?;
        gpu.queue.submit([encoder.finish()]);
        Ok(())
    }
}

/// A window, its graphics device and its pictures.
pub struct Graphics {
    interface: Interface,
    main: Canvas,
    /// The right part of the picture in a comparison.
    beside: Option<Canvas>,
    screen: Screen,
    gpu: Gpu,
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
        let display = Box::new(event_loop.owned_display_handle());
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_with_display_handle_from_env(
            display,
        ));
        let surface = instance
            .create_surface(Arc::clone(&window))
            .map_err(|error| window_error(&error.to_string()))?;
        let gpu = Gpu::for_surface(instance, &surface)?;
        let screen = Screen::new(Arc::clone(&window), surface, &gpu.adapter, &gpu.device)?;
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

    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    pub fn interface(&mut self) -> &mut Interface {
        &mut self.interface
    }

    /// egui's id of the picture.
    pub fn picture_id(&self) -> egui::TextureId {
        self.main.picture.id
    }

    /// egui's id of the comparison's right part, if there is one.
    pub fn beside_id(&self) -> Option<egui::TextureId> {
        self.beside.as_ref().map(|beside| beside.picture.id)
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
                egui.free_texture(&beside.picture.id);
            }
            return Ok(());
        };
        let mut beside = match before {
            Some(beside) => beside,
            None => Canvas::new(&self.gpu, egui, scene)?,
        };
        beside.set_scene(&self.gpu, scene)?;
        beside.set_making(&self.gpu, self.main.making)?;
        beside.set_maps(&self.gpu, maps, style)?;
        self.beside = Some(beside);
        self.main.picture.invalidate();
        Ok(())
    }

    /// To be called when the window's size has changed.
    pub fn resize(&mut self) {
        self.screen.resize(&self.gpu.device);
    }

    /// Uploads an edited scene and returns what had to be uploaded. If that is anything, the maps have to be set
    /// again, as surfaces may have become receivers.
    ///
    /// # Errors
    /// The scene does not fit on the device.
    pub fn set_scene(&mut self, scene: &Arc<Scene>) -> Result<Uploaded> {
        self.main.set_scene(&self.gpu, scene)
    }

    /// Uploads maps and returns what had to be uploaded.
    ///
    /// # Errors
    /// The maps do not fit on the device; the previous ones stay.
    pub fn set_maps(&mut self, maps: &[IlluminationMap], style: MapStyle) -> Result<Uploaded> {
        self.main.set_maps(&self.gpu, maps, style)
    }

    /// Changes how the present maps are displayed.
    pub fn set_map_style(&mut self, style: MapStyle) {
        self.main.set_style(style);
    }

    /// Whether direct light is traced per pixel. If so, maps have to be set without direct light.
    pub fn set_traces_lights(&mut self, traces: bool) {
        self.main.picture.invalidate();
        self.main.renderer.set_traces_lights(traces);
    }

    /// Sets how pictures are rendered.
    ///
    /// # Errors
    /// The resources needed do not fit on the device.
    pub fn set_making(&mut self, making: RenderOptions) -> Result<()> {
        self.main.set_making(&self.gpu, making)
    }

    /// Whether mirrors are grey instead of black while chains are switched off.
    pub fn set_stand_in(&mut self, has_stand_in: bool) {
        self.main.renderer.set_stand_in(has_stand_in);
    }

    /// Resource counts of the picture's renderer.
    pub fn counts(&self) -> EyeCounts {
        self.main.renderer.counts()
    }

    /// Whether the device can measure GPU times.
    pub fn tells_times(&self) -> bool {
        self.gpu
            .device
            .features()
            .contains(wgpu::Features::TIMESTAMP_QUERY)
    }

    /// GPU time of the latest picture for which it is known; `None` if there is none since the last call.
    pub fn take_times(&mut self) -> Option<GpuMs> {
        let is_new = self.main.renderer.collect_times(&self.gpu);
        self.counts().gpu_ms.filter(|_| is_new)
    }

    /// Whether GPU times of a picture are still to come.
    pub fn awaits_times(&self) -> bool {
        self.main.renderer.awaits_times()
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

    /// Quality of the picture shown.
    pub fn quality(&self) -> EyeQuality {
        self.main.renderer.quality()
    }

    /// Why reflections and refractions are not drawn although they were requested.
    pub fn chain_refusal(&self) -> Option<&Error> {
        self.main.renderer.chain_refusal()
    }

    /// Whether the picture, with both parts of a comparison, shows a view.
    pub fn shows(&self, view: &View) -> bool {
        self.main.picture.shows(view)
            && self
                .beside
                .as_ref()
                .is_none_or(|beside| beside.picture.shows(view))
    }

    /// Adds a sample to the picture shown, or draws the view if it is not shown in that quality.
    ///
    /// # Errors
    /// A picture of that size does not fit on the device.
    pub fn refine_picture(&mut self, view: &View, quality: EyeQuality) -> Result<()> {
        for canvas in [Some(&mut self.main), self.beside.as_mut()].into_iter().flatten() {
            canvas.refine(&self.gpu, &mut self.interface.renderer, view, quality)?;
        }
        Ok(())
    }

    /// Draws the view unless it is shown already; returns whether it drew.
    ///
    /// # Errors
    /// A picture of that size does not fit on the device.
    pub fn draw_picture(&mut self, view: &View, quality: EyeQuality) -> Result<bool> {
        let egui = &mut self.interface.renderer;
        if let Some(beside) = &mut self.beside {
            beside.set_making(&self.gpu, self.main.making)?;
            beside.draw(&self.gpu, egui, view, quality)?;
        }
        self.main.draw(&self.gpu, egui, view, quality)
    }

    /// Presents the interface, which contains the picture.
    pub fn show(&mut self, painting: &mut Painting) -> FrameOutcome {
        self.interface.upload(&self.gpu.device, &self.gpu.queue, painting);
        let shown = self.show_frame(painting);
        self.interface.release(painting);
        shown
    }

    fn show_frame(&mut self, painting: &Painting) -> FrameOutcome {
        let Self {
            interface,
            screen,
            gpu,
            ..
        } = self;
        if gpu.is_lost() {
            return FrameOutcome::Broken;
        }
        let frame = match screen.acquire(&gpu.device, &gpu.instance) {
            Acquired::Frame(frame) => frame,
            Acquired::Hidden => return FrameOutcome::Hidden,
            Acquired::Later => return FrameOutcome::Later,
            Acquired::Broken => return FrameOutcome::Broken,
        };
        let target = frame.texture.create_view(&wgpu::TextureViewDescriptor::default());
        let mut encoder = gpu
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor {
                label: Some("window"),
            });
        interface.paint(
            &gpu.device,
            &gpu.queue,
            &mut encoder,
            &target,
            [screen.config.width, screen.config.height],
            painting,
        );
        gpu.queue.submit([encoder.finish()]);
        screen.present(&gpu.queue, frame);
        FrameOutcome::Yes
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

/// Render target of a picture, and the view drawn in it.
#[derive(Debug)]
struct Picture {
    texture: wgpu::TextureView,
    id: egui::TextureId,
    size: [u32; 2],
    /// `None` if the picture is out of date.
    shown: Option<View>,
}

impl Picture {
    /// A picture of one pixel, registered with egui.
    fn new(device: &wgpu::Device, egui: &mut egui_wgpu::Renderer) -> Self {
        let size = [1, 1];
        let texture = texture(device, size);
        let id = egui.register_native_texture(device, &texture, wgpu::FilterMode::Nearest);
        Self {
            texture,
            id,
            size,
            shown: None,
        }
    }

    /// Forces the next call to draw, whatever the view: the scene or its maps changed.
    fn invalidate(&mut self) {
        self.shown = None;
    }

    fn shows(&self, view: &View) -> bool {
        self.shown.as_ref() == Some(view)
    }

    /// Draws `view` unless it is shown already; returns whether it drew.
    ///
    /// # Errors
    /// Those of `draw`.
    fn update(
        &mut self,
        device: &wgpu::Device,
        egui: &mut egui_wgpu::Renderer,
        view: &View,
        draw: impl FnOnce(&wgpu::TextureView) -> Result<()>,
    ) -> Result<bool> {
        if self.shown.as_ref() == Some(view) {
            return Ok(false);
        }
        if self.size != [view.width, view.height] {
            self.size = [view.width, view.height];
            self.texture = texture(device, self.size);
            egui.update_egui_texture_from_wgpu_texture(
                device,
                &self.texture,
                wgpu::FilterMode::Nearest,
                self.id,
            );
        }
        self.shown = Some(view.clone());
        draw(&self.texture)?;
        Ok(true)
    }
}

pub(super) fn texture(device: &wgpu::Device, [width, height]: [u32; 2]) -> wgpu::TextureView {
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("picture"),
        size: wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: FORMAT,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    });
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

/// Outcome of acquiring the next frame.
#[derive(Debug)]
enum Acquired {
    /// To be drawn on and passed to [`Screen::present`].
    Frame(wgpu::SurfaceTexture),
    /// Nothing to draw on at present; an event will come when there is.
    Hidden,
    /// No frame is available at present: try again soon.
    Later,
    /// The surface could not be restored: recreate everything.
    Broken,
}

impl Screen {
    /// Configures a surface for a window.
    ///
    /// # Errors
    /// The adapter cannot draw on the surface.
    fn new(
        window: Arc<Window>,
        surface: wgpu::Surface<'static>,
        adapter: &wgpu::Adapter,
        device: &wgpu::Device,
    ) -> Result<Self> {
        let size = window.inner_size();
        let mut config = surface
            .get_default_config(adapter, size.width.max(1), size.height.max(1))
            .ok_or_else(|| {
                Error::failure(
                    "window",
                    format!("{} cannot draw on it", adapter.get_info().name),
                    "choose another driver, or use `bake` and `render`, which need no window",
                )
            })?;
        // egui blends in encoded values, so the surface must not convert to sRGB.
        let formats = surface.get_capabilities(adapter).formats;
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
        screen.resize(device);
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

    /// Acquires the next frame; reconfigures or recreates the surface once if that may help.
    fn acquire(&mut self, device: &wgpu::Device, instance: &wgpu::Instance) -> Acquired {
        for _ in 0..2 {
            if !self.has_area {
                return Acquired::Hidden;
            }
            use wgpu::CurrentSurfaceTexture as Current;
            match self.surface.get_current_texture() {
                // A suboptimal frame is good enough: a resize event follows.
                Current::Success(frame) | Current::Suboptimal(frame) => return Acquired::Frame(frame),
                Current::Timeout => return Acquired::Later,
                Current::Occluded => return Acquired::Hidden,
                Current::Outdated => self.resize(device),
                Current::Lost => {
                    log::warn!("the window's surface was lost; it is made anew");
                    match instance.create_surface(Arc::clone(&self.window)) {
                        Ok(surface) => self.surface = surface,
                        Err(error) => {
                            log::warn!("the window's surface cannot be made anew: {error}");
                            return Acquired::Broken;
                        }
                    }
                    self.resize(device);
                }
                Current::Validation => return Acquired::Broken,
            }
        }
        Acquired::Later
    }

    fn present(&self, queue: &wgpu::Queue, frame: wgpu::SurfaceTexture) {
        self.window.pre_present_notify();
        queue.present(frame);
    }
}
