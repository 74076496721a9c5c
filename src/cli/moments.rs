//! Options of moving scenes: which moment, or which frames.

use clap::Args;
use nephroid::effect::{Effect, EffectSwitch, EffectSwitches};
use nephroid::error::{Error, Result};
use nephroid::export::sequence::FrameTimes;
use nephroid::scene::Scene;
use nephroid::scene::camera_path::MAX_FRAMES;

use super::values;

/// Latest moment [s]: a day.
const MAX_TIME_S: f64 = 86_400.0;

#[derive(Debug, Default, Args)]
pub struct MomentOptions {
    /// Moment of a scene that moves
    #[arg(long, value_name = "SECONDS", value_parser = values::within(0.0..=MAX_TIME_S, "seconds"))]
    time: Option<f64>,
    /// So many moments, one after the other
    #[arg(long, value_name = "N", value_parser = values::within(1..=MAX_FRAMES, "frames"))]
    frames: Option<usize>,
    /// Frames per second
    #[arg(
        long,
        value_name = "F",
        requires = "frames",
        default_value = "24",
        value_parser = values::within(0.01..=1000.0, "frames a second"),
        hide_short_help = true
    )]
    fps: f64,
    /// Fit the periods of waves to the frames
    #[arg(long = "loop", requires = "frames", hide_short_help = true)]
    is_loop: bool,
}

impl MomentOptions {
    /// The requested frames; `None` if a single moment is requested.
    pub fn sequence(&self) -> Option<FrameTimes> {
        self.times().filter(|_| self.time.is_none())
    }

    fn times(&self) -> Option<FrameTimes> {
        self.frames.map(|frames| FrameTimes {
            frames,
            fps: self.fps,
            is_loop: self.is_loop,
        })
    }

    /// The scene at the requested moment, or with the waves of a loop.
    ///
    /// # Errors
    /// A scene that does not move, or whose motion is switched off.
    pub fn apply(&self, scene: Scene, effects: &EffectSwitches) -> Result<Scene> {
        if self.time.is_none() && self.frames.is_none() {
            return Ok(scene);
        }
        if effects.get(Effect::Motion) == EffectSwitch::Off {
            return Err(Error::usage(
                "--effects motion=off",
                "--time and --frames move the scene",
                "leave one of the two out",
            ));
        }
        if !scene.is_animated() {
            return Err(Error::failure(
                &scene.source,
                "nothing in it moves",
                "leave --time and --frames out, or give it waves or an animation",
            ));
        }
        let (scene, time_s) = match self.times() {
            None => (scene, self.time),
            Some(times) => (times.scene(&scene), self.time.map(|time_s| times.within(time_s))),
        };
        Ok(match time_s {
            None => scene,
            Some(time_s) => scene.at(time_s),
        })
    }
}
