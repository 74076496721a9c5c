//! Input and output of an eye pass, the same for GPU and CPU.

use serde::{Deserialize, Serialize};
use strum::{EnumMessage, IntoStaticStr, VariantArray};

use crate::optics::LinearSrgb;
use crate::scene::Camera;

/// How radiance becomes display colour.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    Hash,
    Serialize,
    Deserialize,
    EnumMessage,
    IntoStaticStr,
    VariantArray,
)]
#[serde(rename_all = "lowercase")]
#[strum(serialize_all = "lowercase")]
pub enum ToneMap {
    /// Clipped at 1.
    None,
    /// Khronos PBR Neutral: keeps hues, rolls highlights off.
    Neutral,
    /// AgX: soft shoulder, saturated lights turn white.
    AgX,
    /// ACES, in the fit of Stephen Hill: more contrast, darker middle tones.
    Aces,
    /// Exact in dark and middle tones, logarithmic above: preserves detail up to 16 times white.
    #[default]
    Soft,
}

/// A camera, and the size and display settings of its picture.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// Viewpoint, direction and field of view.
    pub camera: Camera,
    /// Width [pixels], > 0.
    pub width: u32,
    /// Height [pixels], > 0.
    pub height: u32,
    /// Radiance [W/(m² sr)] is multiplied by 2^stops before tone mapping.
    pub exposure_stops: f64,
    /// Applied after exposure.
    pub tone_map: ToneMap,
    /// Background radiance [W/(m² sr)] of scenes without an environment.
    pub background: LinearSrgb,
}

impl View {
    /// A view over a black background, at neutral exposure.
    pub fn new(camera: Camera, [width, height]: [u32; 2]) -> Self {
        Self {
            camera,
            width,
            height,
            exposure_stops: 0.0,
            tone_map: ToneMap::default(),
            background: LinearSrgb::BLACK,
        }
    }
}

/// Radiance per pixel [W/(m² sr)], linear sRGB, row 0 at the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Width [pixels].
    pub width: u32,
    /// Height [pixels].
    pub height: u32,
    /// `width × height` values.
    pub radiance: Vec<[f32; 3]>,
}
