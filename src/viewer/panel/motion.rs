//! Section *Motion*: the clock of a scene that moves.

use egui::{DragValue, Slider, Ui};

use super::control::{ask, row, rows};
use super::{Command, Model};
use crate::viewer::command::PlayCommand;
use crate::viewer::playback::Playback;

/// Fastest that a scene is played [1].
const MAX_SPEED: f64 = 10.0;

/// Shows the section.
pub fn show(ui: &mut Ui, model: &Model, commands: &mut Vec<Command>) {
    let playback = model.playback();
    ui.horizontal(|ui| {
        let (name, plays) = match playback.is_playing {
            true => ("Pause motion", false),
            false => ("Play motion", true),
        };
        ask(ui, name, None, commands, Command::Play(PlayCommand::Play(plays)));
        if let Some((rate_hz, error, side)) = playback.rate() {
            let error = 100.0 * error;
            ui.label(format!("{rate_hz:.1} maps/s at {error:.0} %, {side} texels"));
        }
    });

    // Values are compared with those shown, and only a change becomes a command.
    rows(ui, "motion", |ui| {
        let span_s = Playback::span_s(model.edits().scene());
        // The slider rounds to hundredths, which must not count as the choice of another moment.
        let shown_s = (100.0 * playback.time_s).round() / 100.0;
        let mut time_s = shown_s;
        row(ui, "Moment", None, |ui| {
            let slider = Slider::new(&mut time_s, 0.0..=span_s.max(shown_s));
            ui.add(slider.suffix(" s").fixed_decimals(2))
        });
        if time_s != shown_s {
            commands.push(Command::Play(PlayCommand::GoTo(time_s)));
        }

        let mut speed = playback.speed;
        row(ui, "Speed of time", None, |ui| {
            ui.add(DragValue::new(&mut speed).range(0.0..=MAX_SPEED).speed(0.01))
        });
        if speed != playback.speed {
            commands.push(Command::Play(PlayCommand::Speed(speed)));
        }
    });
}
