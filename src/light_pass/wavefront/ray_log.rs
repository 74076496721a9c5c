//! What shards searched, ray by ray: enough to count the rays that one bake of the whole would have searched.
//!
//! A bake follows rays that it met before without a search, those of coarser lattices and of neighbouring bands, and does
//! not count them again. Shards know nothing of each other's rays, so each searches all that it meets and writes them
//! down; who adds them up goes through them in the order of the whole bake.

use std::collections::{HashMap, HashSet};
use std::ops::AddAssign;

use super::kept_rays::{self, FreshRay, Help, RayKey};

/// A ray that a shard met.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoggedRay {
    /// Where it started.
    pub key: RayKey,
    /// Its segments.
    pub segments: u32,
    /// Those of them that a transmission began.
    pub transmitted: u32,
    /// What the same ray at another wavelength, searched in the same band, leaves of them.
    pub help: Option<Help>,
}

/// Rays of one band, in the order in which they are kept.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoggedBand {
    /// Its number among the bands of the pass.
    pub number: u64,
    /// Its rays.
    pub rays: Vec<LoggedRay>,
}

/// Rays of the bands of a pass.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RayLog {
    /// Bands of the whole pass.
    pub band_count: u64,
    /// Those that somebody traced.
    pub bands: Vec<LoggedBand>,
}

/// What is counted of rays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RayCounts {
    /// Rays for which something was searched.
    pub rays: u64,
    /// Segments that were searched.
    pub segments: u64,
    /// Those of them that a transmission began.
    pub transmitted: u64,
    /// Those that a reflection began.
    pub reflected: u64,
}

impl AddAssign for RayCounts {
    fn add_assign(&mut self, other: Self) {
        self.rays += other.rays;
        self.segments += other.segments;
        self.transmitted += other.transmitted;
        self.reflected += other.reflected;
    }
}

impl LoggedRay {
    /// What is searched of a ray that is not known, with or without help.
    fn counts(&self, help: Option<Help>) -> RayCounts {
        let (segments, transmitted, reflected) = match help {
            Some(help) => (help.searched, help.transmitted, help.reflected),
            // Nothing began the first.
            None => (
                self.segments,
                self.transmitted,
                self.segments.saturating_sub(1).saturating_sub(self.transmitted),
            ),
        };
        RayCounts {
            rays: 1,
            segments: u64::from(segments),
            transmitted: u64::from(transmitted),
            reflected: u64::from(reflected),
        }
    }
}

impl RayLog {
    /// The number of the next band of the pass.
    pub fn next_band(&mut self) -> u64 {
        self.band_count += 1;
        self.band_count - 1
    }

    /// Writes down a band.
    pub fn take(&mut self, number: u64, fresh: &[FreshRay]) {
        let logged = |ray: &FreshRay| LoggedRay {
            key: ray.key,
            segments: ray.hits.len() as u32,
            transmitted: ray.transmitted,
            help: ray.help,
        };
        self.bands.push(LoggedBand {
            number,
            rays: fresh.iter().map(logged).collect(),
        });
    }

    /// Adds the bands of another part of the pass; false where they are not of the same pass.
    #[must_use]
    pub fn merge(&mut self, other: Self) -> bool {
        let is_first = self.bands.is_empty() && self.band_count == 0;
        let is_alike = is_first || self.band_count == other.band_count;
        self.band_count = other.band_count;
        self.bands.extend(other.bands);
        is_alike
    }

    /// Puts the bands into their order; false where one is missing or there twice.
    #[must_use]
    pub fn sort(&mut self) -> bool {
        self.bands.sort_by_key(|band| band.number);
        let numbers = self.bands.iter().map(|band| band.number);
        numbers.eq(0..self.band_count)
    }

    /// Memory that it holds [bytes], roughly.
    pub fn bytes(&self) -> u64 {
        let of_band = |band: &LoggedBand| size_of::<LoggedBand>() + size_of_val(&band.rays[..]);
        self.bands.iter().map(|band| of_band(band) as u64).sum()
    }
}

/// Rays that a bake of the whole would know.
#[derive(Clone, Debug, Default)]
pub struct KnownRays {
    /// With their segments.
    rays: HashMap<RayKey, u32>,
    bytes: u64,
}

impl KnownRays {
    /// What the bake would count of a band, which it then knows, as far as all rays take no more than so many bytes.
    pub fn count(&mut self, band: &LoggedBand, most_bytes: u64) -> RayCounts {
        let mut counts = RayCounts::default();
        let mut fresh: Vec<&LoggedRay> = Vec::new();
        let has_helpers = band.rays.iter().any(|ray| ray.help.is_some());
        let mut searched = HashSet::new();
        for ray in band.rays.iter().filter(|ray| !self.rays.contains_key(&ray.key)) {
            // Only rays that are searched are a help to others.
            let is_searched = |help: &Help| searched.contains(&ray.key.at_node(help.node));
            let of_ray = ray.counts(ray.help.filter(is_searched));
            if of_ray.segments == 0 {
                continue;
            }
            if has_helpers {
                searched.insert(ray.key);
            }
            counts += of_ray;
            fresh.push(ray);
        }
        for ray in fresh {
            self.insert(ray, most_bytes);
        }
        counts
    }

    /// As [`kept_rays::KeptRays::insert`] does.
    fn insert(&mut self, ray: &LoggedRay, most_bytes: u64) {
        let bytes = |segments: u32| kept_rays::bytes_of(segments as usize);
        let old = self.rays.get(&ray.key).map_or(0, |&segments| bytes(segments));
        let new = self.bytes - old + bytes(ray.segments);
        if new <= most_bytes {
            self.bytes = new;
            self.rays.insert(ray.key, ray.segments);
        }
    }
}
