//! Rows of section *Scene* for a glass: its name, index and dispersion.

use std::sync::Arc;

use egui::{Response, Ui};

use super::Command;
use super::control::{CONTROL_WIDTH, Entry, edited, pick, slider};
use crate::optics::Glass;
use crate::optics::glass::{Dispersion, catalogue};
use crate::scene::{Edit, Material, MaterialEdit};

const ONE_INDEX: &str = "one index";
/// Shown for a glass that is not in the catalogue.
const BY_NUMBERS: &str = "by numbers";

/// Shows the rows of a transparent material; their defaults are those of the file. Pushes edits to `commands`.
pub fn show(
    ui: &mut Ui,
    material: usize,
    (shown, of_file): (&Material, &Material),
    why_not: Option<&str>,
    commands: &mut Vec<Command>,
) {
    let mut glass = edited(ui, "Glass", why_not, (&shown.glass, &of_file.glass), by_name);
    let (before, default) = (dispersion_of(shown), dispersion_of(of_file));
    let value = (&before, &default);
    if let Some(dispersion) = edited(ui, "Dispersion [20/V]", why_not, value, slider(0.0..=1.0, 3)) {
        // The file's dispersion restores the file's glass.
        glass = Some(if dispersion == default && shown.ior == of_file.ior {
            of_file.glass.clone()
        } else {
            let is_dispersive = dispersion > 0.0;
            is_dispersive.then(|| Arc::new(Glass::with_abbe_number(shown.ior, 20.0 / dispersion)))
        });
    }
    if let Some(glass) = glass.filter(|glass| *glass != shown.glass) {
        let ior = match &glass {
            Some(glass) => glass.dispersion.n_d(),
            None => shown.ior,
        };
        let substance = MaterialEdit::Substance {
            ior,
            glass,
            base_colour: shown.base_colour,
            metal: shown.metal,
        };
        commands.push(Command::Edit(Edit::Material(material, substance)));
    }
}

/// 20 over the Abbe number; 0 without dispersion.
fn dispersion_of(material: &Material) -> f64 {
    let glass = material.glass.as_ref();
    let parting = glass.filter(|glass| glass.dispersion.is_dispersive());
    let abbe_number = parting.map(|glass| match glass.dispersion {
        // The exact number: the fitted formula reproduces it only approximately.
        Dispersion::Abbe { v_d, .. } => v_d,
        other => other.abbe_number(),
    });
    // Rounded to the digits shown, so that displaying the number does not change it.
    abbe_number.map_or(0.0, |v_d| (20.0 / v_d * 1e3).round() / 1e3)
}

fn by_name(ui: &mut Ui, glass: &mut Option<Arc<Glass>>) -> Response {
    let all: Vec<&Glass> = catalogue::all().collect();
    let known = |glass: &Glass| all.iter().position(|known| known.name == glass.name);
    // The first entry stands for no glass.
    let (shown, at) = match glass.as_deref() {
        None => (ONE_INDEX, Some(0)),
        Some(glass) => match known(glass) {
            Some(index) => (all[index].name.as_str(), Some(index + 1)),
            None => (BY_NUMBERS, None),
        },
    };
    let mut names: Vec<Entry> = vec![(ONE_INDEX, "".into(), None)];
    names.extend(all.iter().map(|glass| {
        let (n_d, abbe) = (glass.dispersion.n_d(), glass.dispersion.abbe_number());
        let hover = format!("n = {n_d:.4}, Abbe number {abbe:.1}");
        (glass.name.as_str(), hover.into(), None)
    }));
    let (response, picked) = pick(ui, ("glass", CONTROL_WIDTH), (shown, at), &names);
    if let Some(index) = picked {
        *glass = index.checked_sub(1).map(|index| Arc::new(all[index].clone()));
    }
    response
}
