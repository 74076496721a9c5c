//! Where the panel's controls are, as assistive technology is told: for the event log.

use egui::accesskit::{Node, NodeId, Role, TreeUpdate};

/// A control on the screen.
#[derive(Clone, Debug, PartialEq)]
pub struct Control {
    /// What kind of control, by AccessKit's name for it.
    pub role: String,
    /// Its own text, or that of the label in front of it, or else its value.
    pub name: String,
    /// Left, top, right and bottom in the window [pixels].
    pub rect: [f64; 4],
}

/// The controls of an interface of so many pixels per point, from top to bottom.
pub fn of(update: &TreeUpdate, pixels_per_point: f64) -> Vec<Control> {
    let name_of = |id: &NodeId| {
        let node = update.nodes.iter().find(|(candidate, _)| candidate == id);
        node.and_then(|(_, node)| node.label().or(node.value()).map(str::to_owned))
    };
    let control = |node: &Node| {
        let bounds = node.bounds().filter(|_| is_control(node.role()))?;
        let label = || node.labelled_by().iter().find_map(name_of);
        let value = || node.value().map(str::to_owned);
        let name = node.label().map(str::to_owned).or_else(label).or_else(value)?;
        Some(Control {
            role: format!("{:?}", node.role()),
            name,
            rect: [bounds.x0, bounds.y0, bounds.x1, bounds.y1].map(|at| at * pixels_per_point),
        })
    };
    let mut found: Vec<Control> = update
        .nodes
        .iter()
        .filter_map(|(_, node)| control(node))
        .collect();
    found.sort_by(|a, b| a.rect[1].total_cmp(&b.rect[1]));
    found
}

fn is_control(role: Role) -> bool {
    matches!(
        role,
        Role::Button
            | Role::CheckBox
            | Role::ComboBox
            | Role::DisclosureTriangle
            | Role::RadioButton
            | Role::Slider
            | Role::SpinButton
            | Role::TextInput
            | Role::Tab
    )
}
