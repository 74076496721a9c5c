//! Maps of sizes and contents that strain them.

use super::laws::{apart, deposited_w, emitted_w, luminance, map_of, off};
use super::mirrors::paraboloid;
use super::scenes::{at, glass_ball, upright_mirror};
use super::{Bench, Case, Group};
use crate::error::Result;
use crate::export::exr;
use crate::export::float_image::{Channel, FloatImage};
use crate::settings::{BakeSettings, Estimator, LayerKind, MapResolution, Sigma};

/// Cases of maps.
pub const CASES: &[Case] = &[
    Case::quick("maps-of-one-texel", Group::Numbers, one_texel),
    Case::quick("maps-of-1-to-1000", Group::Numbers, narrow_maps),
    Case::long("maps-of-16384-with-one-lit-tile", Group::Numbers, one_lit_tile),
    Case::quick("sigma-from-nothing-to-huge", Group::Numbers, any_sigma),
    Case::quick("peaks-beyond-half-precision", Group::Numbers, peaks),
];

fn sized(width: usize, height: usize) -> BakeSettings {
    BakeSettings {
        map_resolution: MapResolution::Fixed { width, height },
        ..at(1e3, 1)
    }
}

/// The watts of a map do not depend on its size.
fn same_watts(bench: &mut Bench, sizes: &[(usize, usize)]) -> Result<()> {
    for scene in [upright_mirror(), glass_ball(3)] {
        let usual = bench.bake(&scene, &at(1e3, 32))?;
        for (width, height) in sizes {
            let result = bench.bake(&scene, &sized(*width, *height))?;
            bench.law(
                "watts as of 32 × 32",
                off(deposited_w(&result), deposited_w(&usual)),
                5e-3,
            );
        }
    }
    Ok(())
}

fn one_texel(bench: &mut Bench) -> Result<()> {
    same_watts(bench, &[(1, 1), (1, 2), (3, 1)])
}

fn narrow_maps(bench: &mut Bench) -> Result<()> {
    same_watts(bench, &[(1, 1000), (1000, 1), (4, 4000)])
}

/// All light of a focus in the finest map that 256 MB hold, the rest of which is dark.
fn one_lit_tile(bench: &mut Bench) -> Result<()> {
    let settings = BakeSettings {
        memory_bytes: 256 << 20,
        ..sized(16384, 16384)
    };
    let result = bench.bake(&paraboloid(), &settings)?;
    bench.law("watts of the focus", off(deposited_w(&result), 0.64), 1e-3);
    Ok(())
}

/// Spreads from a thousandth of a footprint to a hundred of them.
fn any_sigma(bench: &mut Bench) -> Result<()> {
    let scene = glass_ball(3);
    for sigma in [1e-6, 1.0, 1e4] {
        let splats = BakeSettings {
            estimator: Estimator::Splat,
            sigma: Sigma::Constant(sigma),
            ..at(2e3, 32)
        };
        let result = bench.bake(&scene, &splats)?;
        bench.law(
            "no more arrives than was sent",
            deposited_w(&result) / emitted_w(&result),
            1.0,
        );
        let patches = BakeSettings {
            sigma: Sigma::Constant(sigma),
            ..at(1e3, 32)
        };
        bench.bake(&scene, &patches)?;
    }
    let exact = bench.bake(&scene, &at(1e3, 32))?;
    let hardly = BakeSettings {
        sigma: Sigma::Constant(1e-6),
        ..at(1e3, 32)
    };
    let hardly = bench.bake(&scene, &hardly)?;
    bench.law(
        "hardly any sigma is hardly any blur",
        apart(&hardly, &exact),
        0.02,
    );
    Ok(())
}

/// E of which half precision knows nothing goes through files as it is.
fn peaks(bench: &mut Bench) -> Result<()> {
    let mut scene = upright_mirror();
    if let crate::scene::LightKind::Point { intensity, .. } = &mut scene.lights[0].kind {
        intensity.0 = 1e9;
    }
    let result = bench.bake(&scene, &at(1e3, 16))?;
    let values: Vec<f32> = luminance(map_of(&result, &scene, "floor"), LayerKind::Caustic)
        .iter()
        .map(|e| *e as f32)
        .collect();
    let peak = values.iter().copied().fold(0.0, f32::max);
    bench.must("the peak is above 65504 W/m²", peak > 65_504.0);
    let image = FloatImage {
        width: 16,
        height: 16,
        channels: vec![Channel {
            name: "Y".into(),
            values: values.clone(),
        }],
    };
    let bytes = exr::encode(image, "", "case")?;
    let back = exr::decode(&bytes, "case")?;
    bench.must(
        "written and read, bit for bit",
        back.channel("Y").is_some_and(|read| read == values),
    );
    Ok(())
}
