//! Laws that hold to the last bit, and those of single numbers.

use nephroid::settings::BakeSettings;

use crate::changes::{brightened, reordered, scaled, thinned};
use crate::maps::{Baked, bit_fault, number_fault, sum_fault};
use crate::recipe::Recipe;
use crate::tools::energy_fault;
use crate::trial::{baked, hold};

/// Every law on each scene, since its first bake serves them all.
#[test]
fn laws_of_numbers_and_bits() {
    hold(|recipe| {
        let bake = baked(recipe.scene(), &recipe.settings());
        let mut fault = number_fault(&bake, recipe.is_dispersive()).or_else(|| energy_fault(&bake.result));
        for law in [power, size, order, threads, sum] {
            fault = fault.or_else(|| law(recipe, &bake));
        }
        fault.map_or(Ok(bake.is_lit()), Err)
    });
}

/// Powers of two of power are exact.
fn power(recipe: &Recipe, bake: &Baked) -> Option<String> {
    let factor = if recipe.with_direct { 1024.0_f32 } else { 0.0625 };
    let bright = baked(brightened(recipe.scene(), f64::from(factor)), &recipe.settings());
    bit_fault("power", bake, &bright, factor)
}

/// Powers of two of size are exact.
fn size(recipe: &Recipe, bake: &Baked) -> Option<String> {
    let factor = if recipe.with_direct { 64.0 } else { 0.125 };
    let large = baked(scaled(recipe.scene(), factor), &recipe.settings());
    bit_fault("size", bake, &large, thinned(&bake.scene, factor) as f32)
}

/// The order of objects changes no bit.
fn order(recipe: &Recipe, bake: &Baked) -> Option<String> {
    let other = baked(reordered(recipe.scene()), &recipe.settings());
    bit_fault("order of objects", bake, &other, 1.0)
}

/// The number of threads changes no bit of maps, accounts and counts.
fn threads(recipe: &Recipe, bake: &Baked) -> Option<String> {
    let settings = BakeSettings {
        threads: 3,
        ..recipe.settings()
    };
    let other = baked(recipe.scene(), &settings);
    let (a, b) = (&bake.result, &other.result);
    if a.ledgers != b.ledgers || a.counts != b.counts {
        return Some("threads: other accounts or counts".into());
    }
    bit_fault("threads", bake, &other, 1.0)
}

/// The maps of two lights are the sum of those of each.
fn sum(recipe: &Recipe, bake: &Baked) -> Option<String> {
    let settings = recipe.settings();
    let mut other = recipe.scene();
    other.lights = vec![recipe.other_lamp.light("other lamp")];
    let mut both = recipe.scene();
    both.lights.extend(other.lights.clone());
    let [other, both] = [other, both].map(|scene| baked(scene, &settings));
    sum_fault("sum of two lights", [bake, &other], &both)
}
