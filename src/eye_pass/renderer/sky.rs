//! The environment on the device: drawn behind all surfaces and sampled where chains escape. Only for scenes that have
//! one.

use std::sync::Arc;

use wgpu::util::DeviceExt;

use super::bindings::{Binding, bind_group, bind_group_layout, texture};
use super::pipelines::Beside;
use super::shaders::SKY;
use crate::gpu::{Gpu, texture_of};
use crate::scene::Environment;

/// Radiance may exceed the range of half floats.
pub(super) const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;

/// Group 2 of what shows the environment.
const BINDINGS: [Binding; 1] = [texture(false, wgpu::TextureViewDimension::D2)];

/// An environment, uploaded and ready to be drawn.
#[derive(Debug)]
pub(super) struct Sky {
    source: Arc<Environment>,
    /// Group 2 of pipelines that show it.
    bound: wgpu::BindGroup,
    pipeline: wgpu::RenderPipeline,
    /// Largest channel of any pixel [W/(m² sr)].
    peak: f64,
    bytes: u64,
}

/// Layout of group 2 of pipelines that show an environment.
pub(super) fn layout(gpu: &Gpu) -> wgpu::BindGroupLayout {
    bind_group_layout(gpu, "sky", &BINDINGS)
}

impl Sky {
    /// Uploads an environment, halved until it fits the device's textures.
    pub(super) fn new(
        gpu: &Gpu,
        source: &Arc<Environment>,
        frame_layout: &wgpu::BindGroupLayout,
        sample_count: u32,
    ) -> Self {
        let layout = layout(gpu);
        let (width, height, pixels) = fitted(source, gpu.limits().max_texture_dimension_2d as usize);
        let image = gpu.device.create_texture_with_data(
            &gpu.queue,
            &texture_of(
                "sky",
                [width as u32, height as u32, 1],
                FORMAT,
                wgpu::TextureUsages::TEXTURE_BINDING,
            ),
            wgpu::util::TextureDataOrder::LayerMajor,
            bytemuck::cast_slice(&pixels),
        );
        let view = image.create_view(&Default::default());
        let peak = source.pixels().iter().flatten().copied().fold(0.0, f32::max);
        Self {
            source: Arc::clone(source),
            bound: bind_group(gpu, "sky", &layout, [wgpu::BindingResource::TextureView(&view)]),
            pipeline: pipeline(gpu, frame_layout, &layout, sample_count),
            peak: f64::from(peak),
            bytes: size_of_val(&pixels[..]) as u64,
        }
    }

    pub(super) fn is_of(&self, source: &Arc<Environment>) -> bool {
        Arc::ptr_eq(&self.source, source)
    }

    pub(super) fn bound(&self) -> &wgpu::BindGroup {
        &self.bound
    }

    pub(super) fn peak(&self) -> f64 {
        self.peak
    }

    /// Device memory [bytes].
    pub(super) fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Draws the environment into a surface pass whose group 0 is set, before any surface.
    pub(super) fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(2, &self.bound, &[]);
        pass.draw(0..3, 0..1);
    }
}

/// Size and pixels of an environment, halved by means of 2 × 2 pixels until both sides are at most `limit`.
pub(super) fn fitted(source: &Environment, limit: usize) -> (usize, usize, Vec<[f32; 4]>) {
    let (mut width, mut height) = source.size();
    let mut pixels: Vec<[f32; 4]> = source.pixels().iter().map(|&[r, g, b]| [r, g, b, 1.0]).collect();
    while width.max(height) > limit.max(1) {
        let (wide, high) = (width.div_ceil(2), height.div_ceil(2));
        let pixel = |x: usize, y: usize| pixels[y.min(height - 1) * width + x.min(width - 1)];
        let mean = |x: usize, y: usize| {
            let four =
                [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(right, down)| pixel(2 * x + right, 2 * y + down));
            // Scaled before they are added: the sum of four large values would overflow.
            std::array::from_fn(|channel| four.iter().map(|pixel| 0.25 * pixel[channel]).sum())
        };
        pixels = (0..high)
            .flat_map(|y| (0..wide).map(move |x| (x, y)))
            .map(|(x, y)| mean(x, y))
            .collect();
        (width, height) = (wide, high);
    }
    (width, height, pixels)
}

fn pipeline(
    gpu: &Gpu,
    frame: &wgpu::BindGroupLayout,
    sky: &wgpu::BindGroupLayout,
    sample_count: u32,
) -> wgpu::RenderPipeline {
    // Group 1 is used by chains, which this pipeline does not trace. The environment covers every pixel before any surface
    // is drawn.
    let nothing = bind_group_layout(gpu, "nothing", &[]);
    let drawn = Beside {
        program: SKY,
        groups: &[frame, &nothing, sky],
        entry_points: ["behind", "sky_drawn"],
        buffers: &[],
        depth_compare: wgpu::CompareFunction::Always,
        blend: None,
    };
    drawn.pipeline(gpu, sample_count)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_skies_are_halved_and_keep_their_mean() {
        let pixels = (0..8 * 4).map(|pixel| [pixel as f32, 1.0, f32::MAX]).collect();
        let Some(sky) = Environment::new(8, 4, pixels) else {
            panic!("a sound image");
        };
        assert_eq!(fitted(&sky, 8).2.len(), 32);
        let (width, height, pixels) = fitted(&sky, 3);
        assert_eq!((width, height, pixels.len()), (2, 1, 2));
        let mean = pixels.iter().map(|pixel| pixel[0]).sum::<f32>() / 2.0;
        assert_eq!(mean, 15.5);
        assert!(pixels.iter().all(|pixel| pixel[1..3] == [1.0, f32::MAX]));
    }
}
