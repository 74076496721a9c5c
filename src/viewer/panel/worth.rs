//! What an effect is worth: a button that finds it, and the line that tells it.

use egui::{Button, RichText, Role, Ui, WidgetInfo};

use super::Facts;
use super::bake::{FAILED, two_digits};
use super::control::significant;
use super::effects::COUNTER;
use crate::effect::Effect;
use crate::illumination::difference::Difference;
use crate::viewer::worker::{BakeState, Worth};

const BUTTON: &str = "Bakes once more without this effect, beside the maps that are shown, and shows in false colours \
                      where it adds light and where it takes light away. Costs a whole bake; any change stops it.";
const LINE: &str = "Light on all maps and layers with the effect minus without it, in luminous-equivalent watts; the \
                    root mean square of the difference over the mean with it.";

/// A button that asks what an effect is worth, unless that is known or being found; tells whether it was pressed.
pub fn button(ui: &mut Ui, effect: Effect, facts: &Facts<'_>) -> bool {
    if found(effect, facts).is_some_and(|worth| worth.difference.is_ok()) || progress(effect, facts).is_some()
    {
        return false;
    }
    let is_ready = !facts.state.is_working() && facts.last.is_some_and(|last| last.is_final);
    let button = ui
        .add_enabled(is_ready, Button::new("worth?").small())
        .on_hover_text(BUTTON)
        .on_disabled_hover_text("Known once the bake is done.");
    let name = effect.name().replace('_', " ");
    button.widget_info(|| WidgetInfo::labeled(Role::Button, is_ready, format!("{name}: worth")));
    button.clicked()
}

/// What was found, or how far that is.
pub fn line(ui: &mut Ui, effect: Effect, facts: &Facts<'_>) {
    if let Some(text) = progress(effect, facts) {
        ui.label(RichText::new(text).size(COUNTER));
        return;
    }
    match found(effect, facts).map(|worth| &worth.difference) {
        Some(Ok(found)) => {
            let text = RichText::new(sentence(found)).size(COUNTER).strong();
            ui.label(text).on_hover_text(LINE);
        }
        Some(Err(sentence)) => drop(ui.colored_label(FAILED, sentence)),
        None => {}
    }
}

fn found<'a>(effect: Effect, facts: &Facts<'a>) -> Option<&'a Worth> {
    facts.worth.filter(|worth| worth.effect == effect)
}

fn progress(effect: Effect, facts: &Facts<'_>) -> Option<String> {
    match facts.state {
        BakeState::Comparing {
            effect: left_out,
            stage,
            fraction,
        } if *left_out == effect => {
            let per_cent = 100.0 * fraction;
            Some(format!("baking without it: {} {per_cent:.0} %", stage.name()))
        }
        _ => None,
    }
}

/// "+12.3 W of 16.1 W deposited; maps differ by 84 % (relative RMSE)".
fn sentence(found: &Difference) -> String {
    let sign = if found.difference_w() < 0.0 { "−" } else { "+" };
    let difference = significant(found.difference_w().abs());
    let with = significant(found.with_w);
    let differ = found
        .relative_rmse
        .map_or("there is no light with it".into(), |rmse| {
            format!("maps differ by {} % (relative RMSE)", two_digits(100.0 * rmse))
        });
    format!("{sign}{difference} W of {with} W deposited; {differ}")
}
