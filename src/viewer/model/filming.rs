//! The camera path: recorded, played, saved and filmed.

use super::Model;
use crate::error::Result;
use crate::eye_pass::View;
use crate::scene::{PathPlan, turntable};
use crate::viewer::command::FilmCommand;
use crate::viewer::files::working_folder;
use crate::viewer::filming::{FilmJob, Player};
use serde_json::{Value, json};

impl Model {
    /// Whether the camera moves, by its path or by keys.
    pub fn is_moving(&self) -> bool {
        self.player.is_some() || self.navigator.is_moving()
    }

    /// Whether the camera path is being played.
    pub fn is_playing(&self) -> bool {
        self.player.is_some()
    }

    /// Advances the camera along its path by a time [s]; returns whether the path is being played.
    pub(super) fn play_on(&mut self, seconds: f64) -> bool {
        if self.navigator.is_moving() {
            // A movement key ends the playback.
            self.end_play();
        }
        let Some(player) = &mut self.player else {
            return false;
        };
        let (camera, is_last) = player.advance(seconds);
        self.navigator.stand_at(camera);
        if is_last {
            self.end_play();
        }
        true
    }

    fn tell_keys(&mut self) {
        let keys = self.choices.film.keys.len();
        self.log.write("recorded", json!({"keys": keys}));
    }

    fn end_play(&mut self) {
        if self.player.take().is_some() {
            self.log.write("played", Value::Null);
        }
    }

    fn play(&mut self) -> Result<()> {
        let cameras = self.choices.film.path()?.cameras(self.scene().origin_world);
        self.player = Player::new(cameras);
        self.log.write("plays", Value::Null);
        Ok(())
    }

    /// Carries out a command of the section *Camera path*.
    pub(super) fn film(&mut self, command: &FilmCommand) {
        let before = self.choices.clone();
        let outcome = self.filmed(command);
        if before.film != self.choices.film {
            self.edits.note(&before, &self.choices);
            self.edits.release();
        }
        match outcome {
            Ok(None) => {}
            Ok(Some(message)) => self.film_message = Some(message),
            Err(error) => self.film_message = Some(error.to_string()),
        }
    }

    /// Returns a message for the panel, if any.
    fn filmed(&mut self, command: &FilmCommand) -> Result<Option<String>> {
        // Keys are in world coordinates, cameras of the window in those of the scene.
        let origin_world = self.scene().origin_world;
        match command {
            FilmCommand::Record(key) => {
                let (camera, reach_m) = (self.navigator.camera(), self.navigator.radius_m());
                self.choices.film.record(*key, &camera, origin_world, reach_m);
                self.tell_keys();
            }
            FilmCommand::GoTo(index) => {
                if let Some(camera) = self.choices.film.camera_at(*index, origin_world) {
                    self.navigator.stand_at(&camera);
                }
            }
            FilmCommand::Play(true) => self.play()?,
            FilmCommand::Tour => {
                let reach_m = self.navigator.radius_m();
                self.choices.film = self
                    .choices
                    .film
                    .tour(&self.scene().cameras, origin_world, reach_m);
                self.tell_keys();
                self.play()?;
            }
            FilmCommand::Play(false) => self.end_play(),
            FilmCommand::Save => {
                let path = self.choices.film.save(&working_folder(), &self.scene().name)?;
                let message = format!("Written: {}", path.display());
                self.log.write("saved", json!({"files": [path]}));
                return Ok(Some(message));
            }
            FilmCommand::Load(path) => {
                let plan = PathPlan::read(path)?;
                // A path that cannot be played does not replace the present one.
                plan.path(&path.display().to_string())?;
                self.choices.film.take(plan);
                self.tell_keys();
            }
            FilmCommand::Shoot { turns } => self.shoot(*turns)?,
            FilmCommand::Stop => self.exporter.stop(),
        }
        Ok(None)
    }

    /// Starts to draw and write frames on the exporting thread.
    fn shoot(&mut self, turns: bool) -> Result<()> {
        let scene = self.scene().clone();
        let display = self.choices.display;
        let film = &self.choices.film;
        let (width, height) = film.size;
        let camera = self.navigator.camera_for(f64::from(width) / f64::from(height));
        let (cameras, name) = if turns {
            (turntable::around(&scene, &camera, film.frames), "turntable")
        } else {
            (film.path()?.cameras(scene.origin_world), "frames")
        };
        let shooting = FilmJob {
            maps: self.lit_maps().into_owned(),
            cameras,
            view: View {
                exposure_stops: display.exposure_stops,
                tone_map: display.tone_map,
                ..View::new(camera, [width, height])
            },
            effects: self.choices.settings.effects.clone(),
            white_balance: display.white_balance.matrix(&scene),
            scene,
            name,
        };
        self.exporter.film(shooting, working_folder());
        self.log.write_export(&self.exporter.state);
        Ok(())
    }
}
