//! `render --path` and `--turntable`: the frames of a film, written or timed.

use std::fmt::Write as _;
use std::path::Path;

use nephroid::effect::{Effect, EffectSwitch};
use nephroid::error::Result;
use nephroid::export::frame_folder::FrameFolder;
use nephroid::eye_pass::frame_times::{self, Keep, MannerTimes, SAMPLES, Spread, Walk};
use nephroid::gpu::Gpu;
use nephroid::scene::{CameraPath, turntable};
use nephroid::settings::BakeSettings;
use serde_json::{Value, json};

use super::console::Console;
use super::loaded::LoadedScene;
use super::options::PictureOptions;
use super::picture::{self, EyeOptions};
use super::values::Exposure;

/// A film along a camera path or around the scene.
pub struct Film<'a> {
    /// Camera path; without one, the camera orbits the scene.
    pub path: Option<CameraPath>,
    /// Frames of the orbit.
    pub turntable: usize,
    /// Whether to time frames with and without chains.
    pub stats: bool,
    /// Folder for the frames.
    pub output: Option<&'a Path>,
    /// Folder of existing maps.
    pub maps: Option<&'a Path>,
    /// Look of every frame; its camera is where an orbit begins.
    pub look: (&'a PictureOptions, &'a EyeOptions),
}

impl Film<'_> {
    /// Bakes or reads maps and draws every frame; writes and times them as requested. `name` is that of the path.
    ///
    /// # Errors
    /// Input, output, a bake or a frame that fails; no graphics card; a signal.
    pub fn draw(
        self,
        name: &str,
        settings: &BakeSettings,
        loaded: &LoadedScene,
        console: &Console,
    ) -> Result<()> {
        // A missing device or a bad folder ends the film before the bake.
        let scene = &loaded.scene;
        let gpu = Gpu::headless()?;
        let folder = self.output.map(FrameFolder::open).transpose()?;
        let maps = picture::maps(self.maps, settings, loaded, console)?;
        let (options, eye) = self.look;

        // Cameras of the path, or of one turn around the scene.
        let (cameras, view) = match &self.path {
            Some(path) => {
                let cameras = path.cameras(scene.origin_world);
                let view = picture::view_of(cameras[0].clone(), options, eye);
                (cameras, view)
            }
            None => {
                let view = picture::view(scene, options, eye)?;
                (turntable::around(scene, &view.camera, self.turntable), view)
            }
        };

        let mut walk = Walk {
            scene,
            maps: &maps,
            view,
            cameras: &cameras,
            effects: &settings.effects,
            white_balance: eye.white_balance.unwrap_or_default().matrix(scene),
        };

        // One exposure for all frames: an automatic one for each would flicker.
        walk.view.exposure_stops = match options.exposure {
            Some(Exposure::Stops(stops)) => stops,
            _ => frame_times::auto_exposure_stops(&gpu, &walk)?,
        };

        // Report what is drawn, then draw and time it.
        let (view, source, adapter) = (&walk.view, &scene.source, gpu.adapter_name());
        let (width, height, stops) = (view.width, view.height, view.exposure_stops);
        let (frames, maps) = (cameras.len(), maps.len());
        let mut text = format!(
            "path      {name} of {source}: {frames} frames of {width}x{height}, {SAMPLES} samples a pixel, exposure \
             {stops:+.2} stops, {maps} maps\nadapter   {adapter}\n"
        );
        let kept = self.output.map(|folder| folder.display().to_string());
        let mut report = json!({
            "path": name,
            "scene": source,
            "adapter": adapter,
            "frames": frames,
            "width": width,
            "height": height,
            "samples_per_pixel": SAMPLES,
            "exposure_stops": stops,
            "tone_map": view.tone_map,
            "maps": maps,
            "folder": kept,
        });
        if let Some(folder) = kept {
            let _ = writeln!(text, "frames    {folder}");
        }

        // Frames are drawn, written and timed in one go. Timed in both manners, their ratio is the cost of chains.
        let times = self.times(&gpu, &walk, folder.as_ref(), console)?;
        if let [raster_alone, with_chains] = &times[..] {
            report["stats"] = stats(raster_alone, with_chains, &mut text);
        }
        console.print_result(&text, &report)
    }

    /// Draws and writes every frame. Returns frame times: with chains, and before that without if both are requested.
    fn times(
        &self,
        gpu: &Gpu,
        walk: &Walk<'_>,
        folder: Option<&FrameFolder>,
        console: &Console,
    ) -> Result<Vec<MannerTimes>> {
        let both = [EffectSwitch::Off, walk.effects.get(Effect::Chains)];
        let switches = if self.stats { &both[..] } else { &both[1..] };
        let mut write = |frame: usize, rgba: Vec<u8>| match folder {
            Some(folder) => folder.write(frame, (walk.view.width, walk.view.height), rgba),
            None => Ok(()),
        };
        let keep = folder.map(|_| &mut write as &mut Keep<'_>);
        frame_times::measure(gpu, walk, switches, keep, &console.bar(), console.control())
    }
}

/// Frame times without and with chains as JSON; also appended to `text`.
fn stats(raster_alone: &MannerTimes, with_chains: &MannerTimes, text: &mut String) -> Value {
    let _ = writeln!(
        text,
        "\n{:<30} {:>10} {:>10} {:>10}",
        "ms", "median", "95 %", "max"
    );
    add_manner(text, "raster alone", raster_alone);
    add_manner(text, "with chains", with_chains);
    let ratio = with_chains.over(raster_alone);
    let times = |ratio: Option<f64>| ratio.map_or("-".into(), |ratio| format!("{ratio:.3}"));
    let _ = writeln!(
        text,
        "with chains over raster alone, medians: device {}, wall {}",
        times(ratio.device),
        times(ratio.wall)
    );
    json!({
        "raster_alone": raster_alone,
        "with_chains": with_chains,
        // Ratio of the medians.
        "with_chains_over_raster_alone": ratio,
    })
}

fn add_manner(text: &mut String, name: &str, times: &MannerTimes) {
    // Times of the device tell the passes apart; wall time also has submission and waiting.
    let mut row = |what: &str, spread: &Spread| {
        let Spread { median, p95, max } = spread;
        let what = format!("{name}: {what}");
        let _ = writeln!(text, "{what:<30} {median:>10.3} {p95:>10.3} {max:>10.3}");
    };
    if let Some(device) = &times.device_ms {
        row("opaque", &device.opaque);
        row("specular", &device.specular);
        row("tone mapping", &device.tone_mapping);
        row("device", &device.sum);
    }
    row("wall", &times.wall_ms);

    // Adapters without timestamp queries have wall times alone.
    if times.device_ms.is_none() {
        let _ = writeln!(text, "  the device cannot tell how long it takes");
    }

    // Frames of the warm-up, which create pipelines, would hide the cost of the others.
    let warm_up_ms: f64 = times.warm_up.iter().map(|drawing| drawing.wall_ms).sum();
    let _ = writeln!(
        text,
        "  {} frames; {:.0} objects drawn (at most {:.0}), {:.0} specular (at most {:.0}); {} pipelines, {} of \
         them specular\n  warm-up, counted apart: {} drawings, {:.1} ms",
        times.frames,
        times.drawn_objects.median,
        times.drawn_objects.max,
        times.drawn_specular.median,
        times.drawn_specular.max,
        times.pipelines,
        times.specular_pipelines,
        times.warm_up.len(),
        warm_up_ms
    );
}
