//! Real files made by others (`../shared/scenes`, where it is there): baked without a fault, and light arrives.

use nephroid::effect::Effect;
use nephroid::illumination::IlluminationMap;
use nephroid::optics::LinearSrgb;
use nephroid::scene::{LoadOptions, load};
use nephroid::settings::{BakeSettings, LayerKind, MapResolution};

use crate::support;
use crate::tools::{bake, energy_fault};

/// The first texel that holds no light there can be: not finite, or negative. Light of one wavelength lies outside sRGB, so
/// that a channel may be negative where wavelengths part; its luminance may not, but for what single precision rounds off.
fn impossible_texel(map: &IlluminationMap, wavelengths_part: bool) -> Option<[f32; 3]> {
    let fits = |&[r, g, b]: &[f32; 3]| {
        let light = LinearSrgb::new(f64::from(r), f64::from(g), f64::from(b));
        let most = r.abs().max(g.abs()).max(b.abs());
        let is_light = if wavelengths_part {
            light.luminance() >= -f64::from(4.0 * f32::EPSILON * most)
        } else {
            r.min(g).min(b) >= 0.0
        };
        most.is_finite() && is_light
    };
    let mut texels = map.layers.iter().flat_map(|layer| &layer.irradiance);
    texels.find(|texel| !fits(texel)).copied()
}

#[test]
#[allow(clippy::print_stdout, reason = "the list is what `--nocapture` is for")]
fn real_files_bake_and_at_least_four_get_caustic_light() {
    let Some(folder) = support::shared_or_skip("scenes") else {
        return;
    };
    let mut files: Vec<_> = std::fs::read_dir(folder)
        .expect("a readable folder")
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "glb"))
        .collect();
    files.sort();
    assert!(files.len() >= 13, "only {} files", files.len());
    let options = LoadOptions {
        default_light: true,
        ..LoadOptions::default()
    };
    let settings = BakeSettings {
        density_per_sr: 3e3,
        map_resolution: MapResolution::Fixed {
            width: 64,
            height: 64,
        },
        layers: vec![LayerKind::Caustic],
        ..BakeSettings::splat()
    };
    let mut lit = 0;
    for file in files {
        let scene = load(file.to_str().expect("a readable path"), &options).expect("a valid file");
        let name = scene.name.clone();
        let result = bake(scene, &settings);
        assert_eq!(energy_fault(&result), None, "{name}");
        let parts = result.plan.is_on(Effect::Dispersion);
        for map in &result.maps {
            assert_eq!(impossible_texel(map, parts), None, "{name}");
        }
        let deposited_w: f64 = result
            .ledgers
            .iter()
            .map(|ledger| ledger.energy_w.deposited)
            .sum();
        println!(
            "{name}: {deposited_w:.6e} W on {} maps, {} rays",
            result.maps.len(),
            result.counts.rays
        );
        lit += usize::from(deposited_w > 0.0);
    }
    assert!(lit >= 4, "caustic light arrives in {lit} files only");
}
