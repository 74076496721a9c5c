//! Playing: time advances in a scene that moves, and its maps follow.

use std::sync::Arc;
use std::time::{Duration, Instant};

use serde_json::json;

use super::Model;
use crate::effect::{Effect, EffectSwitch};
use crate::viewer::command::PlayCommand;
use crate::viewer::playback::Playback;
use crate::viewer::worker::{BakeRequest, BakedLevel};

/// For so long a bake hands out no levels: while time runs, only the last maps of each moment are shown.
const NO_LEVELS: Duration = Duration::from_secs(3600);

impl Model {
    /// The clock of the scene.
    pub fn playback(&self) -> &Playback {
        &self.playback
    }

    /// Whether the scene moves by itself.
    pub fn can_play(&self) -> bool {
        let switch = self.choices.settings.effects.get(Effect::Motion);
        switch != EffectSwitch::Off && self.edits.scene().is_animated()
    }

    /// Does what was asked of the scene's time.
    pub(super) fn set_time(&mut self, command: PlayCommand) {
        match command {
            PlayCommand::Play(plays) => {
                let rate = self.playback.rate();
                let was_playing = self.playback.is_playing;
                if plays && self.can_play() {
                    self.playback.is_playing = true;
                } else if was_playing {
                    self.playback.stop();
                    // Better maps of the moment at which it stands.
                    self.rebake();
                }
                let is_playing = self.playback.is_playing;
                let more = json!({"plays": is_playing, "time_s": self.playback.time_s, "rate": rate});
                self.log.write("plays", more);
            }
            PlayCommand::Speed(speed) => self.playback.speed = speed,
            PlayCommand::GoTo(time_s) => {
                self.playback.stop();
                self.playback.time_s = time_s;
                self.playback.ask(self.edits.scene());
                self.revision += 1;
            }
        }
    }

    /// What is asked for and what is shown stay at their moments though the scene was edited.
    pub(super) fn stand_at_moment(&mut self) {
        self.playback.ask(self.edits.scene());
        self.playback.follow(self.edits.scene());
    }

    /// Asks for the maps of the present moment as soon as those before are there.
    pub(super) fn play_moment(&mut self) {
        if !self.playback.is_playing || self.state.is_baking() {
            return;
        }
        self.settle();
        let rest = Arc::clone(self.edits.scene());
        let scene = self.playback.ask(&rest);
        let request = BakeRequest::new(scene, self.playback.settings(&self.choices.settings, &rest));
        if request.settings.validate().is_err() {
            return;
        }
        self.asked = Some((self.worker.request(request.clone()), request));
        self.worker.look_away(NO_LEVELS);
        self.state = self.worker.state();
    }

    /// Takes note of maps that came: those of a moment get the layers that were not baked.
    pub(super) fn take_moment(&mut self, level: &mut BakedLevel) {
        if self.playback.is_playing {
            self.playback.complete(&mut level.result);
            if level.is_final {
                self.playback.learn(level.seconds, Instant::now());
            }
        } else if level.is_final {
            self.playback.keep(&level.result.maps);
        }
        self.playback.show(&level.request.scene);
    }
}
