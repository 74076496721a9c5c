//! Compiles what mirrors and glass take before the window draws with it: seconds, where the driver has it in no cache.
//!
//! A device of its own draws the view once, small. Drivers compile at the latest then, and keep what they compiled for
//! every device.

use std::sync::Arc;

use super::background::Background;
use super::graphics::{Picture, SAMPLES, texture};
use crate::effect::EffectSwitch;
use crate::error::Result;
use crate::eye_pass::View;
use crate::eye_pass::renderer::{EyeQuality, Renderer};
use crate::gpu::Gpu;
use crate::scene::Scene;

/// Pixels of the picture across.
const WIDTH: u32 = 64;

/// Whether mirrors and glass may be drawn.
#[derive(Debug)]
pub struct WarmUp {
    work: Background<(), Result<()>>,
    is_lit: bool,
    is_done: bool,
}

impl WarmUp {
    /// Nothing is compiled; `wake` is called from another thread when it is.
    pub fn new(wake: Arc<dyn Fn() + Send + Sync>) -> Self {
        Self {
            work: Background::new("shaders", wake),
            is_lit: false,
            is_done: false,
        }
    }

    /// Begins with the second picture of light, so that the first one waits for nothing.
    pub fn begin(&mut self, scene: &Arc<Scene>, view: &View, quality: EyeQuality) {
        let was_lit = std::mem::replace(&mut self.is_lit, true);
        if !was_lit || self.is_done || self.is_coming() {
            return;
        }
        let scene = Arc::clone(scene);
        let view = View {
            width: WIDTH,
            height: (WIDTH * view.height).div_ceil(view.width),
            ..view.clone()
        };
        let started = self.work.start((), move |_| draw(&scene, &view, quality));
        self.is_done = started.is_err();
    }

    /// Whether it is under way.
    pub fn is_coming(&self) -> bool {
        self.work.of().is_some()
    }

    /// How chains are switched in the window, where `wanted` is asked for.
    pub fn switch(&mut self, wanted: EffectSwitch) -> EffectSwitch {
        if let Some((_, outcome)) = self.work.take() {
            self.is_done = true;
            if let Some(Err(error)) = outcome {
                log::warn!("shaders could not be compiled beside the window: {error}");
            }
        }
        if self.is_done { wanted } else { EffectSwitch::Off }
    }
}

fn draw(scene: &Scene, view: &View, quality: EyeQuality) -> Result<()> {
    let gpu = Gpu::headless()?;
    let mut renderer = Renderer::new(&gpu, scene, Picture::FORMAT, SAMPLES)?;
    renderer.set_quality(quality);
    let target = texture(&gpu.device, [view.width, view.height]);
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    renderer.draw(&gpu, &mut encoder, &target, view)?;
    gpu.queue.submit([encoder.finish()]);
    gpu.wait()
}
