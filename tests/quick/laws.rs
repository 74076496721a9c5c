//! A few rows of the hard cases: those that a wrong sign in Snell's law, a wrong factor in Fresnel's, a lost branch,
//! swapped colour channels or a lost watt would break.

#[path = "../laws/glass.rs"]
mod glass;

use support::laws::hold_some;

#[test]
fn glass_keeps_its_laws() {
    let names = [
        "normal-incidence",
        "every-angle",
        "grazing-sun",
        "below-the-critical-angle",
        "above-the-critical-angle",
        "lamp-in-clear-glass",
        "lamp-in-tinted-glass",
        "stepped-floor-in-coloured-water",
        "bars-below-a-slab",
        "given-up-by-depth",
    ];
    hold_some(glass::fill, &names);
}
