//! Light by bundles and photons.
//!
//! Light that stays together is computed: the launch domain is divided into squares, and the light of one path over a
//! square is a *bundle*, which is deposited as a whole. What bundles get wrong is left to photons: paths sampled from a
//! light, one branch at each event, each hit counted in its texel. In the mean, photons contribute exactly the difference
//! between the light and its bundles. The steps are in `residual`.
//!
//! Point of the lamp, micro-normals and wavelength are dimensions of a photon's path. Without squares (`pass`), photons
//! carry all of the light.

mod bundle;
mod bundle_deposit;
mod cells;
pub mod domain;
mod edge;
pub mod filter;
pub mod footprints;
mod image;
pub mod launch;
pub mod pass;
mod paths;
mod receivers;
pub mod residual;
mod slits;
pub mod spectrum;
pub mod spheres;
mod squares;
pub mod subcell_features;
mod survey;
pub mod walk;
