//! What values may be, and the sentences for those that are not.

use glam::DVec3;

use crate::error::{Error, Result};

/// Farthest that anything is moved to [m]: beyond it, squares of distances lose the scene.
const FARTHEST_M: f64 = 1e12;

pub(super) fn out_of_range(owner: &str, what: &str, value: impl std::fmt::Display, range: &str) -> Error {
    Error::usage(
        owner,
        format!("a {what} of {value} is outside {range}"),
        "give a value in that range",
    )
}

pub(super) fn check_place(place: DVec3, owner: &str) -> Result<()> {
    if place.is_finite() && place.abs().max_element() <= FARTHEST_M {
        return Ok(());
    }
    let range = format!("−{FARTHEST_M:e} to {FARTHEST_M:e} m");
    Err(out_of_range(owner, "place", format!("{place} m"), &range))
}
