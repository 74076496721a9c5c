//! From the diffuse surfaces through specular ones into the eye (DS*E).

#[cfg(feature = "gpu")]
pub mod frame_times;
pub mod reference;
#[cfg(feature = "gpu")]
pub mod renderer;
pub mod tone_mapping;
pub mod view;
pub mod wavelengths;
pub mod white_balance;

pub use view::{Picture, ToneMap, View};
pub use white_balance::WhiteBalance;
