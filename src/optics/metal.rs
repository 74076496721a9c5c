//! Metals by name: their complex refractive index and what colour they are.

use std::sync::LazyLock;

use super::conductor::conductor_reflectance;
use super::names::{key, nearest};
use super::spectrum::xyz::colour_under_d65;
use super::{LinearSrgb, Nanometres};
use crate::error::Error;

/// Name and table of each: columns wavelength [nm], n, k; from below 360 to above 830 nm (see assets/SOURCES.md).
const TABLES: [(&str, &str); 4] = [
    ("Gold", include_str!("../../assets/metals/gold.csv")),
    ("Silver", include_str!("../../assets/metals/silver.csv")),
    ("Copper", include_str!("../../assets/metals/copper.csv")),
    ("Aluminium", include_str!("../../assets/metals/aluminium.csv")),
];

static METALS: LazyLock<Vec<Metal>> = LazyLock::new(|| {
    let row = |line: &str| -> Option<[f64; 3]> {
        let fields: Option<Vec<f64>> = line.split(',').map(|field| field.parse().ok()).collect();
        fields?.try_into().ok()
    };
    let rows = |table: &str| table.lines().skip(1).map(row).collect::<Option<Vec<_>>>();
    let metal = |(name, table)| Metal {
        name,
        rows: rows(table).expect("our own tables hold three numbers a row"),
    };
    TABLES.into_iter().map(metal).collect()
});

/// A metal, opaque and smooth.
#[derive(Clone, Debug, PartialEq)]
pub struct Metal {
    name: &'static str,
    /// Wavelength [nm], n, k; by increasing wavelength.
    rows: Vec<[f64; 3]>,
}

/// A name that no metal has.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no metal is named `{name}`; there are {known}")]
pub struct UnknownMetal {
    /// What was asked for.
    pub name: String,
    /// Names most like it.
    pub known: String,
}

impl UnknownMetal {
    /// The same fault as an error of the command.
    pub fn at(self, location: impl Into<String>) -> Error {
        Error::usage(location, self.to_string(), "choose one of them")
    }
}

impl Metal {
    /// Every metal.
    pub fn all() -> &'static [Self] {
        &METALS
    }

    /// Gold, silver, copper or aluminium (aluminum), in any case.
    ///
    /// # Errors
    /// [`UnknownMetal`] with the nearest names.
    pub fn by_name(name: &str) -> Result<&'static Self, UnknownMetal> {
        let wanted = key(name);
        let wanted = if wanted == "aluminum" {
            "aluminium"
        } else {
            &wanted
        };
        let found = METALS.iter().find(|metal| key(metal.name) == wanted);
        found.ok_or_else(|| UnknownMetal {
            name: name.into(),
            known: nearest(name, METALS.iter().map(|metal| metal.name)),
        })
    }

    /// Its name.
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// Complex refractive index (n, k) [1] against vacuum: linear between the rows of its table, which cover the
    /// visible; beyond its first and last row, theirs.
    pub fn index(&self, wavelength: Nanometres) -> (f64, f64) {
        let last = self.rows.len() - 1;
        let above = self
            .rows
            .partition_point(|row| row[0] <= wavelength.0)
            .clamp(1, last);
        let [from, to] = [self.rows[above - 1], self.rows[above]];
        let along = ((wavelength.0 - from[0]) / (to[0] - from[0])).clamp(0.0, 1.0);
        (
            from[1] + along * (to[1] - from[1]),
            from[2] + along * (to[2] - from[2]),
        )
    }

    /// Reflectance [0, 1] for unpolarised light that comes in at an angle of the given cosine [0, 1], from air.
    pub fn reflectance(&self, cos_incident: f64, wavelength: Nanometres) -> f64 {
        let (n, k) = self.index(wavelength);
        conductor_reflectance(cos_incident, n, k)
    }

    /// Colour of that reflectance under D65, relative to a perfect mirror, which is white: for light that is traced
    /// as red, green and blue. Nothing is cut off: gold lies outside of sRGB's cube, its red head on being 1.04, so
    /// that white light keeps its luminance but red light would gain.
    pub fn reflectance_srgb(&self, cos_incident: f64) -> LinearSrgb {
        colour_under_d65(|wavelength| self.reflectance(cos_incident, wavelength))
    }
}
