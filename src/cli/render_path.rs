//! `render --path` and `--turntable`: the frames of a camera that moves, kept as pictures or timed.

use std::fmt::Write as _;

use nephroid::effect::{Effect, EffectSwitch};
use nephroid::error::Result;
use nephroid::export::frame_folder::FrameFolder;
use nephroid::eye_pass::frame_times::{self, Keep, MannerTimes, Ratio, SAMPLES, Spread, Walk};
use nephroid::eye_pass::{ToneMap, View};
use nephroid::gpu::Gpu;
use nephroid::optics::LinearSrgb;
use nephroid::scene::{CameraPath, turntable};
use serde::Serialize;

use super::bake::{self, Clock};
use super::job::{Motion, PathJob};
use super::render;
use super::terminal::Interrupt;
use super::terminal::StageBar;
use super::terminal::Terminal;
use super::values::Exposure;

/// The result, as `--json` prints it.
#[derive(Debug, Serialize)]
struct Report {
    /// The file, or `turntable`.
    path: String,
    scene: String,
    adapter: String,
    frames: usize,
    width: u32,
    height: u32,
    samples_per_pixel: u32,
    exposure_stops: f64,
    tone_map: ToneMap,
    maps: usize,
    /// Where the frames were kept.
    folder: Option<String>,
    /// What is timed: nothing without --stats.
    #[serde(skip_serializing_if = "Option::is_none")]
    stats: Option<Stats>,
}

/// How the camera moves, read.
enum Way {
    Path(CameraPath),
    Turntable(usize),
}

#[derive(Debug, Serialize)]
struct Stats {
    raster_alone: MannerTimes,
    with_chains: MannerTimes,
    /// Of the medians.
    with_chains_over_raster_alone: Ratio,
}

/// Loads, bakes or reads maps, draws every frame, keeps and times them as asked.
///
/// # Errors
/// Input, output, a bake or a frame that failed; no graphics card; a signal.
pub fn run(job: &PathJob, terminal: &Terminal, interrupt: &Interrupt) -> Result<()> {
    let clock = Clock::start();
    // What cannot be read is told before anything is baked.
    let way = match &job.motion {
        Motion::Path(file) => Way::Path(CameraPath::read(file)?),
        Motion::Turntable(frames) => Way::Turntable(*frames),
    };
    let loaded = bake::load(&job.scene, &clock, terminal)?;
    let gpu = Gpu::headless()?;
    let folder = job.output.as_deref().map(FrameFolder::open).transpose()?;
    let maps = render::maps(&job.maps, &loaded, &clock, terminal, interrupt)?;
    let cameras = match way {
        Way::Path(path) => path.cameras(loaded.scene.origin_world),
        Way::Turntable(frames) => {
            let first = render::choose_camera(&loaded.scene, &job.picture)?;
            turntable::around(&loaded.scene, &first, frames)
        }
    };
    let (width, height) = job.picture.size;
    let view = View {
        camera: cameras[0].clone(),
        width,
        height,
        exposure_stops: 0.0,
        tone_map: job.picture.tone_map,
        background: LinearSrgb::BLACK,
    };
    let mut walk = Walk {
        scene: &loaded.scene,
        maps: &maps,
        view,
        cameras: &cameras,
        effects: &job.maps.settings().effects,
        white_balance: job.picture.white_balance.matrix(&loaded.scene),
    };
    walk.view.exposure_stops = match job.picture.exposure {
        Exposure::Stops(stops) => stops,
        Exposure::Auto => frame_times::auto_exposure_stops(&gpu, &walk)?,
    };
    let mut report = Report {
        path: match &job.motion {
            Motion::Path(file) => file.display().to_string(),
            Motion::Turntable(_) => "turntable".into(),
        },
        scene: loaded.scene.source.clone(),
        adapter: gpu.adapter_name(),
        frames: cameras.len(),
        width,
        height,
        samples_per_pixel: SAMPLES,
        exposure_stops: walk.view.exposure_stops,
        tone_map: walk.view.tone_map,
        maps: maps.len(),
        folder: job.output.as_ref().map(|folder| folder.display().to_string()),
        stats: None,
    };
    report.stats = draw(&gpu, &walk, job, folder.as_ref(), terminal, interrupt)?;
    terminal.print_result(&report.text(), &report)
}

/// Draws, keeps and times what is asked for.
fn draw(
    gpu: &Gpu,
    walk: &Walk<'_>,
    job: &PathJob,
    folder: Option<&FrameFolder>,
    terminal: &Terminal,
    interrupt: &Interrupt,
) -> Result<Option<Stats>> {
    let wanted = job.maps.settings().effects.get(Effect::Chains);
    let both = [EffectSwitch::Off, wanted];
    let switches = if job.stats { &both[..] } else { &both[1..] };
    let mut write = |frame: usize, rgba: Vec<u8>| match folder {
        Some(folder) => folder.write(frame, (walk.view.width, walk.view.height), rgba),
        None => Ok(()),
    };
    let keep = folder.map(|_| &mut write as &mut Keep<'_>);
    let bar = StageBar::new(terminal);
    let times = frame_times::measure(gpu, walk, switches, keep, &bar, interrupt.control())?;
    let [raster_alone, with_chains] = match <[MannerTimes; 2]>::try_from(times) {
        Ok(both) => both,
        Err(_) => return Ok(None),
    };
    let ratio = with_chains.over(&raster_alone);
    Ok(Some(Stats {
        raster_alone,
        with_chains,
        with_chains_over_raster_alone: ratio,
    }))
}

impl Report {
    fn text(&self) -> String {
        let mut text = format!(
            "path      {} of {}: {} frames of {}x{}, {} samples a pixel, exposure {:+.2} stops, {} maps\n\
             adapter   {}\n",
            self.path,
            self.scene,
            self.frames,
            self.width,
            self.height,
            self.samples_per_pixel,
            self.exposure_stops,
            self.maps,
            self.adapter
        );
        if let Some(folder) = &self.folder {
            let _ = writeln!(text, "frames    {folder}");
        }
        if let Some(stats) = &self.stats {
            stats.add_to(&mut text);
        }
        text
    }
}

impl Stats {
    fn add_to(&self, text: &mut String) {
        let _ = writeln!(
            text,
            "\n{:<30} {:>10} {:>10} {:>10}",
            "ms", "median", "95 %", "max"
        );
        for (name, times) in [
            ("raster alone", &self.raster_alone),
            ("with chains", &self.with_chains),
        ] {
            add_manner(text, name, times);
        }
        let times = |ratio: Option<f64>| ratio.map_or("-".into(), |ratio| format!("{ratio:.3}"));
        let ratio = &self.with_chains_over_raster_alone;
        let _ = writeln!(
            text,
            "with chains over raster alone, medians: device {}, wall {}",
            times(ratio.device),
            times(ratio.wall)
        );
    }
}

fn add_manner(text: &mut String, name: &str, times: &MannerTimes) {
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
    if times.device_ms.is_none() {
        let _ = writeln!(text, "  the device cannot tell how long it takes");
    }
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
