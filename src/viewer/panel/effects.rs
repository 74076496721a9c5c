//! Section *Effects*: what the scene calls for, and why.

use egui::{RichText, Ui};

use crate::plan::EffectPlan;

/// Shows the plan of the last bake.
pub fn show(ui: &mut Ui, plan: Option<&EffectPlan>) {
    let Some(plan) = plan else {
        ui.label(RichText::new("Known after the first bake.").weak());
        return;
    };
    for line in &plan.effects {
        entry(ui, &line.effect.name().replace('_', " "), line.on, &line.reason);
    }
    for line in &plan.lights {
        entry(ui, &format!("light {}", line.light), line.on, &line.reason);
    }
}

fn entry(ui: &mut Ui, name: &str, on: bool, reason: &str) {
    let state = if on { "on" } else { "off" };
    let mut title = RichText::new(format!("{name}: {state}"));
    if on {
        title = title.strong();
    }
    ui.label(title);
    ui.indent(("effect", name), |ui| ui.label(RichText::new(reason).weak()));
}
