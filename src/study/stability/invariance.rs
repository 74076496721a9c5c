//! To come.
use super::Case;
/// Cases.
pub const CASES: &[Case] = &[];
