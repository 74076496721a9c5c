//! Physical quantities as types, with the operations that physics allows and no others.
//!
//! All are luminous-equivalent: photometric values are divided by 683 lm/W, so that in a white,
//! non-dispersive scene each is simply its radiometric namesake.

use serde::{Deserialize, Serialize};

/// Luminous efficacy at 540 THz [lm/W], by which glTF's candela, lux and cd/m² are divided.
pub const LUMENS_PER_WATT: f64 = 683.0;

macro_rules! quantity {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd, Serialize, Deserialize)]
        #[serde(transparent)]
        pub struct $name(pub f64);

        impl std::ops::Add for $name {
            type Output = Self;
            fn add(self, other: Self) -> Self {
                Self(self.0 + other.0)
            }
        }
        impl std::ops::Sub for $name {
            type Output = Self;
            fn sub(self, other: Self) -> Self {
                Self(self.0 - other.0)
            }
        }
        impl std::ops::Mul<f64> for $name {
            type Output = Self;
            fn mul(self, factor: f64) -> Self {
                Self(self.0 * factor)
            }
        }
        impl std::iter::Sum for $name {
            fn sum<I: Iterator<Item = Self>>(values: I) -> Self {
                Self(values.map(|value| value.0).sum())
            }
        }
    };
}

macro_rules! product {
    ($a:ident * $b:ident = $c:ident) => {
        impl std::ops::Mul<$b> for $a {
            type Output = $c;
            fn mul(self, other: $b) -> $c {
                $c(self.0 * other.0)
            }
        }
        impl std::ops::Div<$b> for $c {
            type Output = $a;
            fn div(self, other: $b) -> $a {
                $a(self.0 / other.0)
            }
        }
    };
}

quantity!(
    /// Flux Φ [W] of a light ray.
    Flux
);
quantity!(
    /// Radiant intensity I [W/sr] of a point or spot light.
    RadiantIntensity
);
quantity!(
    /// Irradiance E [W/m²] of a texel; for suns, measured across the beam.
    Irradiance
);
quantity!(
    /// Radiance L [W/(m² sr)] that reaches the eye.
    Radiance
);
quantity!(
    /// Area [m²].
    Area
);
quantity!(
    /// Solid angle [sr].
    SolidAngle
);

product!(RadiantIntensity * SolidAngle = Flux);
product!(Irradiance * Area = Flux);
