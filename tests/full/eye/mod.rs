//! Maps on surfaces, the direct layer and the CPU eye pass, on scenes whose answer is known.

mod chains;
mod dispersion;
mod soft_light;
