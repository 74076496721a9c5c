//! The picture of the scene beside the panel: drawn only when it would change.

use crate::eye_pass::View;

/// Encodes linear light on writing …
const DRAWN_AS: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;
/// … and gives egui, which blends display values, the encoded bytes.
const SHOWN_AS: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

/// A texture of the picture's size with what it shows.
#[derive(Debug)]
pub struct Picture {
    drawn: wgpu::TextureView,
    id: egui::TextureId,
    size: [u32; 2],
    /// What it shows; `None` where that is out of date.
    shown: Option<View>,
}

impl Picture {
    /// Format that the scene is drawn in.
    pub const FORMAT: wgpu::TextureFormat = DRAWN_AS;

    /// A picture of one pixel, known to egui by its [`id`](Self::id).
    pub fn new(device: &wgpu::Device, egui: &mut egui_wgpu::Renderer) -> Self {
        let size = [1, 1];
        let (drawn, shown) = textures(device, size);
        let id = egui.register_native_texture(device, &shown, wgpu::FilterMode::Nearest);
        Self { drawn, id, size, shown: None }
    }

    /// Its name in egui.
    pub fn id(&self) -> egui::TextureId {
        self.id
    }

    /// The scene or its maps changed: draw it next time whatever the view.
    pub fn invalidate(&mut self) {
        self.shown = None;
    }

    /// Draws `view` unless it is shown already; tells whether it drew.
    pub fn update(
        &mut self,
        device: &wgpu::Device,
        egui: &mut egui_wgpu::Renderer,
        view: &View,
        draw: impl FnOnce(&wgpu::TextureView),
    ) -> bool {
        if self.shown.as_ref() == Some(view) {
            return false;
        }
        if self.size != [view.width, view.height] {
            self.size = [view.width, view.height];
            let (drawn, shown) = textures(device, self.size);
            self.drawn = drawn;
            egui.update_egui_texture_from_wgpu_texture(device, &shown, wgpu::FilterMode::Nearest, self.id);
        }
        draw(&self.drawn);
        self.shown = Some(view.clone());
        true
    }
}

/// Two views of one texture: to draw on and to show.
fn textures(device: &wgpu::Device, [width, height]: [u32; 2]) -> (wgpu::TextureView, wgpu::TextureView) {
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("picture"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: DRAWN_AS,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[SHOWN_AS],
    });
    let view = |format, usage| {
        texture.create_view(&wgpu::TextureViewDescriptor {
            format: Some(format),
            usage: Some(usage),
            ..wgpu::TextureViewDescriptor::default()
        })
    };
    (
        view(DRAWN_AS, wgpu::TextureUsages::RENDER_ATTACHMENT),
        view(SHOWN_AS, wgpu::TextureUsages::TEXTURE_BINDING),
    )
}
