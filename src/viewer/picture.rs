//! The picture of the scene beside the panel: drawn only when it would change.

use crate::error::Result;
use crate::eye_pass::View;

/// Holds encoded values, which egui blends and shows as they are.
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

/// A texture of the picture's size with what it shows.
#[derive(Debug)]
pub struct Picture {
    texture: wgpu::TextureView,
    id: egui::TextureId,
    size: [u32; 2],
    /// What it shows; `None` where that is out of date.
    shown: Option<View>,
}

impl Picture {
    /// Format that the scene is drawn in.
    pub const FORMAT: wgpu::TextureFormat = FORMAT;

    /// A picture of one pixel, known to egui by its [`id`](Self::id).
    pub fn new(device: &wgpu::Device, egui: &mut egui_wgpu::Renderer) -> Self {
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

    /// Its name in egui.
    pub fn id(&self) -> egui::TextureId {
        self.id
    }

    /// The scene or its maps changed: draw it next time whatever the view.
    pub fn invalidate(&mut self) {
        self.shown = None;
    }

    /// Whether it shows a view.
    pub fn shows(&self, view: &View) -> bool {
        self.shown.as_ref() == Some(view)
    }

    /// What it is drawn into, of the size of the view that it shows.
    pub fn target(&self) -> &wgpu::TextureView {
        &self.texture
    }

    /// Draws `view` unless it is shown already; tells whether it drew.
    ///
    /// # Errors
    /// That of `draw`: the picture stays as it was.
    pub fn update(
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

fn texture(device: &wgpu::Device, [width, height]: [u32; 2]) -> wgpu::TextureView {
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
