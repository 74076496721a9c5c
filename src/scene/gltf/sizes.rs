//! Sizes of punctual lights. glTF gives them none, so they are read from `extras`, of the node or else of the light:
//! `radius_m` of point lights and spots, `angular_diameter_deg` of suns.

use gltf::json::Value;

use super::report::Report;
use crate::scene::{LightKind, LightSize};

/// Extent of a light, from the extras of its node or else its own; 0 means none. Values that are invalid or unsuitable
/// for the kind cause a warning.
pub fn read(extras: [Option<&Value>; 2], kind: &LightKind, owner: &str, report: &mut Report) -> LightSize {
    let stated = |key: &str| extras.into_iter().flatten().find_map(|extras| extras.get(key));
    let (radius_m, angle_deg) = (stated("radius_m"), stated("angular_diameter_deg"));
    let is_sun = matches!(kind, LightKind::Sun { .. });
    let (stated, other) = if is_sun {
        (angle_deg, radius_m)
    } else {
        (radius_m, angle_deg)
    };
    if other.is_some() {
        let (what, remedy) = if is_sun {
            ("radius_m", "state angular_diameter_deg for a sun")
        } else {
            ("angular_diameter_deg", "state radius_m for a lamp")
        };
        report.warn(owner, format!("its {what} was ignored"), remedy);
    }
    let Some(stated) = stated else {
        return LightSize::None;
    };
    let size = stated
        .as_f64()
        .and_then(|number| if is_sun { angle(number) } else { radius(number) });
    size.unwrap_or_else(|| {
        let (what, range) = if is_sun {
            ("angular_diameter_deg", "use degrees from 0 to 180")
        } else {
            ("radius_m", "use metres from 0 up")
        };
        report.warn(
            owner,
            format!("its {what} was ignored, as it is not a size"),
            range,
        );
        LightSize::None
    })
}

fn radius(radius_m: f64) -> Option<LightSize> {
    match radius_m {
        0.0 => Some(LightSize::None),
        _ if radius_m > 0.0 && radius_m.is_finite() => Some(LightSize::Radius { radius_m }),
        _ => None,
    }
}

fn angle(degrees: f64) -> Option<LightSize> {
    match degrees {
        0.0 => Some(LightSize::None),
        _ if degrees > 0.0 && degrees <= 180.0 => Some(LightSize::Angle {
            diameter_rad: degrees.to_radians(),
        }),
        _ => None,
    }
}
