//! Real files made by others (`../shared/scenes`, where it is there): baked without a fault, and light arrives.

use nephroid::effect::Effect;
use nephroid::illumination::IlluminationMap;
use nephroid::optics::LinearSrgb;
use nephroid::scene::{LoadOptions, load};

use support::sound::scene_fault;
use support::tools::{bake, energy_fault, photons};

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
fn real_files_bake() {
    let Some(folder) = support::shared_or_skip("scenes") else {
        return;
    };
    let entries = std::fs::read_dir(folder).expect("a readable folder");
    let files = entries.map(|entry| entry.expect("an entry").path());
    let is_glb = |path: &std::path::PathBuf| path.extension().is_some_and(|extension| extension == "glb");
    let mut files: Vec<_> = files.filter(is_glb).collect();
    files.sort();
    assert!(files.len() >= 13, "only {} files", files.len());
    let options = LoadOptions {
        default_light: true,
        ..LoadOptions::default()
    };
    let mut lit = 0;
    for file in files {
        let scene = load(file.to_str().expect("a readable path"), &options).expect("a valid file");
        let name = scene.name.clone();
        assert_eq!(scene_fault(&scene), None, "{name}");
        assert!(scene.triangle_count() > 0, "{name}");
        let result = bake(scene, &photons(3e4, 64));
        assert_eq!(energy_fault(&result), None, "{name}");
        let parts = result.plan.is_on(Effect::Dispersion);
        for map in &result.maps {
            assert_eq!(impossible_texel(map, parts), None, "{name}");
        }
        let mut ledgers = result.ledgers.iter();
        lit += usize::from(ledgers.any(|ledger| ledger.energy_w.deposited > 0.0));
    }
    assert!(lit >= 4, "caustic light arrives in {lit} files only");
}
