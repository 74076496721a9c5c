//! The catalogue of metals: complex refractive index and colour.

use std::sync::LazyLock;

use glam::{DMat3, DVec3};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::conductor::conductor_reflectance;
use super::spectrum::xyz::colour_under_d65;
use super::spectrum::{Spectrum, xyz_bar};
use super::wavelength::VISIBLE;
use super::{ColourBasis, LinearSrgb, Nanometres, key, unknown};

/// Name and table of each metal: wavelength [nm], n, k; from below 360 to above 830 nm (see assets/SOURCES.md).
const TABLES: [(&str, &str); 4] = [
    ("Gold", include_str!("../../assets/metals/gold.csv")),
    ("Silver", include_str!("../../assets/metals/silver.csv")),
    ("Copper", include_str!("../../assets/metals/copper.csv")),
    ("Aluminium", include_str!("../../assets/metals/aluminium.csv")),
];

/// Regularisation of [`Metal::factor_under`] towards the colour under D65, relative to the trace of the normal matrix.
const HOLD: f64 = 1e-6;

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

/// An opaque, smooth metal.
#[derive(Clone, Debug, PartialEq)]
pub struct Metal {
    name: &'static str,
    /// Wavelength [nm], n, k; by increasing wavelength.
    rows: Vec<[f64; 3]>,
}

impl Metal {
    pub fn all() -> &'static [Self] {
        &METALS
    }

    /// Gold, silver, copper or aluminium (aluminum), case-insensitive.
    ///
    /// # Errors
    /// An unknown name, with the nearest known ones.
    pub fn by_name(name: &str) -> crate::error::Result<&'static Self> {
        let wanted = key(name);
        let wanted = if wanted == "aluminum" {
            "aluminium"
        } else {
            &wanted
        };
        let found = METALS.iter().find(|metal| key(metal.name) == wanted);
        let names = METALS.iter().map(|metal| metal.name);
        found.ok_or_else(|| unknown("metal", name, names, "choose one of them"))
    }

    /// Serialises a metal by its name.
    ///
    /// # Errors
    /// Those of `serializer`.
    pub(crate) fn write_name<S: Serializer>(
        metal: &Option<&'static Self>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        metal.map(Self::name).serialize(serializer)
    }

    /// Deserialises a metal from its name.
    ///
    /// # Errors
    /// A name that no metal has; those of `deserializer`.
    pub(crate) fn read_name<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Option<&'static Self>, D::Error> {
        let name = Option::<String>::deserialize(deserializer)?;
        name.map(|name| Self::by_name(&name))
            .transpose()
            .map_err(D::Error::custom)
    }

    pub fn name(&self) -> &'static str {
        self.name
    }

    /// Complex refractive index (n, k) [1] against vacuum: linear between the rows of its table, which cover the
    /// visible range; clamped to the first and last row.
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

    /// Reflectance [0, 1] for unpolarised light from air, at an angle of incidence of the given cosine [0, 1].
    pub fn reflectance(&self, cos_incident: f64, wavelength: Nanometres) -> f64 {
        let (n, k) = self.index(wavelength);
        conductor_reflectance(cos_incident, n, k)
    }

    /// Colour of the reflectance under D65, relative to a perfect mirror, which is white: for light that is traced in
    /// RGB. Not clamped: gold is outside the sRGB gamut with a red of 1.04 at normal incidence. White light thus keeps
    /// its luminance, but red light would gain.
    pub fn reflectance_srgb(&self, cos_incident: f64) -> LinearSrgb {
        colour_under_d65(|wavelength| self.reflectance(cos_incident, wavelength))
    }

    /// RGB factor for the reflectance at normal incidence where a lamp is traced by wavelength and factors are
    /// evaluated by [`ColourBasis`]: the reflected light of the lamp has the same XYZ as with the tabulated
    /// reflectance. Channels may exceed 1, as gold's red does. Where the lamp leaves channels undetermined, as a single
    /// spectral line does, they stay close to [`reflectance_srgb`](Self::reflectance_srgb).
    pub fn factor_under(&self, lamp: &Spectrum) -> LinearSrgb {
        let seen_of = |factor: &dyn Fn(Nanometres) -> f64| {
            let seen = |wavelength| xyz_bar(wavelength).map(|channel| channel * factor(wavelength));
            DVec3::from_array(lamp.integral_times(VISIBLE, seen))
        };
        let part = |index: usize| seen_of(&|wavelength| ColourBasis::at(wavelength).row()[index]);
        let parts = DMat3::from_cols(part(0), part(1), part(2));
        let wanted = seen_of(&|wavelength| self.reflectance(1.0, wavelength));
        let usual = DVec3::from_array(self.reflectance_srgb(1.0).to_array());
        // Least squares, regularised towards the usual factor where the columns are nearly dependent.
        let squares = parts.transpose() * parts;
        let trace = squares.x_axis.x + squares.y_axis.y + squares.z_axis.z;
        let held = squares + DMat3::from_diagonal(DVec3::splat(HOLD * trace));
        let step = held.inverse() * (parts.transpose() * (wanted - parts * usual));
        LinearSrgb::from((usual + step).to_array())
    }
}
