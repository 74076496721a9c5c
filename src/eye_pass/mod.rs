//! The eye pass: from diffuse surfaces through specular ones into the eye (DS*E).

mod facets;
#[cfg(feature = "gpu")]
pub mod frame_times;
pub mod highlights;
pub mod reference;
mod relief;
#[cfg(feature = "gpu")]
pub mod renderer;
pub mod tone_mapping;
pub mod view;
pub mod wavelengths;
pub mod white_balance;

use std::sync::Arc;

use crate::effect::EffectSwitch;
use crate::error::Result;
use crate::illumination::IlluminationMap;
use crate::progress::{Control, Progress};
use crate::scene::Scene;
use crate::transport::Tracer;
use reference::ReferenceSettings;

pub use view::{Picture, ToneMap, View};
pub use white_balance::WhiteBalance;

/// Renders a view of a scene lit by its maps, on the CPU, with four samples per pixel and more where these differ.
///
/// # Errors
/// It was cancelled.
pub fn render(
    scene: &Arc<Scene>,
    maps: &[IlluminationMap],
    view: &View,
    progress: &dyn Progress,
    control: &Control,
) -> Result<Picture> {
    let settings = ReferenceSettings::still(EffectSwitch::Auto);
    reference::render(
        &Tracer::new(scene.clone()),
        maps,
        view,
        &settings,
        progress,
        control,
    )
}
