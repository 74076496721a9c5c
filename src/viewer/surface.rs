//! The window's surface: made, configured, and mended after everything that can happen to it.

use std::sync::Arc;

use winit::window::Window;

use crate::error::{Error, Result};

/// A window with a surface on it.
#[derive(Debug)]
pub struct Screen {
    /// Declared first: it has to go before its window.
    surface: wgpu::Surface<'static>,
    config: wgpu::SurfaceConfiguration,
    window: Arc<Window>,
    /// False while the window has no area: there is nothing to configure or to draw on.
    has_area: bool,
}

/// What came of asking for the next frame.
#[derive(Debug)]
pub enum Acquired {
    /// Draw on it and hand it to [`Screen::present`].
    Frame(wgpu::SurfaceTexture),
    /// Nothing to draw on for the time being; an event will tell when there is.
    Hidden,
    /// Not this time: ask again soon.
    Later,
    /// The surface could not be mended: make everything anew.
    Broken,
}

impl Screen {
    /// Configures a surface for a window.
    ///
    /// # Errors
    /// The adapter cannot draw on it.
    pub fn new(
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
        // The panel blends in display values, so the surface must not convert them.
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

    /// The window.
    pub fn window(&self) -> &Arc<Window> {
        &self.window
    }

    /// Format of the frames.
    pub fn format(&self) -> wgpu::TextureFormat {
        self.config.format
    }

    /// Size of the frames [pixels].
    pub fn size(&self) -> [u32; 2] {
        [self.config.width, self.config.height]
    }

    /// Takes over the window's present size.
    pub fn resize(&mut self, device: &wgpu::Device) {
        let size = self.window.inner_size();
        self.has_area = size.width > 0 && size.height > 0;
        if self.has_area {
            let largest = device.limits().max_texture_dimension_2d;
            self.config.width = size.width.min(largest);
            self.config.height = size.height.min(largest);
            self.surface.configure(device, &self.config);
        }
    }

    /// Asks for the next frame; mends the surface once where that helps.
    pub fn acquire(&mut self, device: &wgpu::Device, instance: &wgpu::Instance) -> Acquired {
        for _ in 0..2 {
            if !self.has_area {
                return Acquired::Hidden;
            }
            use wgpu::CurrentSurfaceTexture as Current;
            match self.surface.get_current_texture() {
                // A suboptimal frame shows well enough; the event that made it so brings a resize.
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

    /// Shows a frame.
    pub fn present(&self, queue: &wgpu::Queue, frame: wgpu::SurfaceTexture) {
        self.window.pre_present_notify();
        queue.present(frame);
    }
}
