//! Illumination maps: the irradiance of a surface, texel by texel.

pub mod accumulator;
pub mod chart;
pub mod compare;
pub mod difference;
pub mod difference_colours;
pub mod false_colours;
pub mod gutter;
pub mod islands;
pub mod lookup;
pub mod map;
pub mod parametrisation;
pub mod resolution;
pub mod seams;
pub mod smoothing;
pub mod tiles;
pub mod uv_file;
pub mod visible;

pub use chart::{Chart, Receiver, Side, UvSet};
pub use map::{IlluminationMap, Layer};
pub use parametrisation::{Parametrisation, parametrise};
