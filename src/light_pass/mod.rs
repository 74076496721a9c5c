//! From the lights through specular surfaces onto diffuse ones.

pub mod direct;
pub mod ledger;
