//! Which maps the picture shows, and what it compares them with: other maps, or a bake without an effect.

use std::borrow::Cow;
use std::sync::Arc;

use serde_json::json;

use super::Model;
use crate::effect::Effect;
use crate::eye_pass::renderer::MapStyle;
use crate::illumination::IlluminationMap;
use crate::illumination::difference::Difference;
use crate::scene::Scene;
use crate::settings::LayerKind;
use crate::viewer::command::CompareCommand;
use crate::viewer::comparison_view::SavedMaps;
use crate::viewer::event_log;
use crate::viewer::false_colours;
use crate::viewer::panel::{LayerShown, Quantity};
use crate::viewer::views::MapSurvey;
use crate::viewer::worker::{BakedLevel, EffectDifference};

/// Identifies the maps in the picture: two equal values show the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MapsShown {
    revision: u64,
    layer: LayerShown,
    pub quantity: Quantity,
}

impl Model {
    /// Layers of the maps shown, sorted, without duplicates.
    pub fn layers(&self) -> Vec<LayerKind> {
        let mut kinds: Vec<_> = self
            .maps()
            .iter()
            .flat_map(|map| &map.layers)
            .map(|layer| layer.kind)
            .collect();
        kinds.sort_unstable();
        kinds.dedup();
        kinds
    }

    /// The quantity in the picture; light if the quantity chosen in the panel is not available.
    pub fn quantity(&self) -> Quantity {
        match self.choices.display.quantity {
            Quantity::Error if false_colours::has_errors(self.maps()) => Quantity::Error,
            Quantity::Difference if self.difference().is_some() => Quantity::Difference,
            Quantity::Error | Quantity::Difference => Quantity::Light,
            other => other,
        }
    }

    /// Whether direct light is to be traced per pixel instead of looked up in the maps: it is shown, and either its
    /// layer is not baked yet, or a light or an object has moved since.
    pub fn traces_lights(&self) -> bool {
        let shown = matches!(
            self.choices.display.layer,
            LayerShown::All | LayerShown::Only(LayerKind::Direct)
        );
        let Some(last) = self
            .last
            .as_ref()
            .filter(|_| shown && self.quantity() == Quantity::Light)
        else {
            return false;
        };
        let is_asked_for = last.request.settings.layers.contains(&LayerKind::Direct);
        if self.layers().contains(&LayerKind::Direct) {
            is_other_light(&last.request.scene, self.scene())
        } else {
            is_asked_for && !last.is_final
        }
    }

    pub fn maps_without_direct(&self) -> Vec<IlluminationMap> {
        let mut maps = self.shown_maps().into_owned();
        for map in &mut maps {
            map.layers.retain(|layer| layer.kind != LayerKind::Direct);
        }
        maps.retain(|map| !map.layers.is_empty());
        maps
    }

    /// The maps in the layer and quantity chosen in the panel.
    pub fn shown_maps(&self) -> Cow<'_, [IlluminationMap]> {
        self.as_shown(self.maps())
    }

    /// `maps` in the layer and quantity chosen in the panel.
    fn as_shown<'a>(&self, maps: &'a [IlluminationMap]) -> Cow<'a, [IlluminationMap]> {
        self.with_quantity(maps, self.quantity())
    }

    /// `maps` in the layer chosen in the panel and in a given quantity.
    fn with_quantity<'a>(
        &self,
        maps: &'a [IlluminationMap],
        quantity: Quantity,
    ) -> Cow<'a, [IlluminationMap]> {
        // Until the next maps arrive, an edit may have turned a receiver into glass or a mirror.
        let receives = |map: &&IlluminationMap| {
            let scene = self.scene();
            let object = scene.objects.get(map.chart.object());
            object.is_none_or(|object| scene.materials[object.material].surface.is_receiver())
        };

        // Error and difference are those of all layers; the dominant wavelength is that of the light shown.
        let in_colours = match quantity {
            Quantity::Wavelength => Some(false_colours::wavelength_maps(
                &self.with_quantity(maps, Quantity::Light),
            )),
            Quantity::Error => Some(false_colours::error_maps(maps)),
            Quantity::Difference => self.difference().map(false_colours::difference_maps),
            _ => None,
        };
        if let Some(maps) = in_colours {
            return Cow::Owned(maps.into_iter().filter(|map| receives(&map)).collect());
        }

        // Maps are borrowed as long as all of them can be shown as they are: copies take as much memory again.
        let LayerShown::Only(kind) = self.choices.display.layer else {
            return if maps.iter().all(|map| receives(&map)) {
                Cow::Borrowed(maps)
            } else {
                Cow::Owned(maps.iter().filter(receives).cloned().collect())
            };
        };
        let with_kind = maps.iter().filter(receives).filter_map(|map| {
            let irradiance = map.layer(kind)?.irradiance.clone();
            let chart = Arc::clone(&map.chart);
            Some(IlluminationMap::of_layer(chart, kind, irradiance))
        });
        Cow::Owned(with_kind.collect())
    }

    /// The light in the maps shown, even if the picture shows another quantity.
    pub(super) fn lit_maps(&self) -> Cow<'_, [IlluminationMap]> {
        self.with_quantity(self.maps(), Quantity::Light)
    }

    /// The maps to show next and how to display them; updates the survey of these maps.
    pub fn maps_to_show(&mut self, without_direct: bool) -> (Vec<IlluminationMap>, MapStyle) {
        let maps = if without_direct {
            self.maps_without_direct()
        } else {
            self.shown_maps().into_owned()
        };
        self.survey = MapSurvey::of(&maps);
        (maps, self.map_style())
    }

    /// How the values of the maps shown are displayed.
    pub fn map_style(&self) -> MapStyle {
        let quantity = self.quantity();
        let choice = &self.choices.display.scale;
        quantity.map_style(self.survey.scale(quantity, choice))
    }

    pub fn maps_shown(&self) -> MapsShown {
        MapsShown {
            revision: self.maps_revision,
            layer: self.choices.display.layer,
            quantity: self.quantity(),
        }
    }

    /// Contribution of an effect to the maps shown, if it was found.
    pub(super) fn difference(&self) -> Option<&Difference> {
        self.worth.as_ref()?.difference.as_ref().ok()
    }

    /// The reference maps in the layer and quantity chosen in the panel.
    pub fn reference_to_show(&self) -> Option<(&Arc<Scene>, Vec<IlluminationMap>)> {
        let reference = self.reference.as_ref()?;
        Some((&reference.scene, self.as_shown(&reference.maps).into_owned()))
    }

    /// Begins or ends a comparison with other maps.
    pub(super) fn compare_with(&mut self, command: &CompareCommand) {
        let scene = self.edits.scene();
        let reference = match command {
            CompareCommand::Keep => SavedMaps::kept(scene, self.maps()).map(Some),
            CompareCommand::Load(folder) => SavedMaps::of_folder(folder, scene).map(Some),
            CompareCommand::End => Ok(None),
        };
        match reference {
            Ok(reference) => {
                self.reference = reference;
                self.refusal = None;
                self.compare_again();
            }
            Err(error) => self.refusal = Some(error.to_string()),
        }
    }

    /// Compares the maps shown with the reference.
    pub(super) fn compare_again(&mut self) {
        let present = self.last.as_ref().map_or(&self.given, |last| &last.result.maps);
        if let Some(reference) = &mut self.reference {
            reference.compare(present);
            let relative_rmse = reference.relative_rmse.as_ref().ok();
            let more = json!({"name": reference.name, "relative_rmse": relative_rmse});
            self.log.write("against", more);
        }
    }

    /// Shows the contribution of an effect; returns whether it belongs to the maps shown.
    pub(super) fn take_worth(&mut self, worth: EffectDifference) -> bool {
        let is_of_shown = |last: &Arc<BakedLevel>| Arc::ptr_eq(last, &worth.with);
        if !self.last.as_ref().is_some_and(is_of_shown) {
            return false;
        }
        self.log.write("compared", event_log::compared(&worth));
        if worth.difference.is_ok() {
            self.choices.display.quantity = Quantity::Difference;
        }
        self.worth = Some(worth);
        true
    }

    /// Starts to compute the contribution of an effect to the maps shown, if their bake is done.
    pub(super) fn compare(&mut self, effect: Effect) {
        let Some(last) = self.last.as_ref().filter(|last| last.is_final) else {
            return;
        };
        if self.worker.compare(effect, Arc::clone(last)) {
            self.state = self.worker.state();
        }
    }
}

/// Whether the direct light differs: a light has changed, or an object has moved.
fn is_other_light(before: &Arc<Scene>, now: &Arc<Scene>) -> bool {
    let (was, is) = (&before.objects, &now.objects);
    let stand_alike = || was.len() == is.len() && was.iter().zip(is).all(|(was, is)| was.stands_as(is));
    !Arc::ptr_eq(before, now) && (before.lights != now.lights || !stand_alike())
}
