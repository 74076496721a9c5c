//! Real files made by others (`../shared/scenes`, where it is there): baked without a fault, and light arrives.

use nephroid::illumination::IlluminationMap;
use nephroid::scene::{LoadOptions, load};
use nephroid::settings::{BakeSettings, LayerKind, MapResolution};

use crate::support;
use crate::tools::{bake, energy_fault};

fn is_finite(map: &IlluminationMap) -> bool {
    map.layers.iter().all(|layer| {
        layer
            .irradiance
            .iter()
            .flatten()
            .all(|e| e.is_finite() && *e >= 0.0)
    })
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
        density_per_sr: 1e4,
        map_resolution: MapResolution::Fixed {
            width: 128,
            height: 128,
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
        assert!(
            result.maps.iter().all(is_finite),
            "{name}: a texel is negative or not finite"
        );
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
