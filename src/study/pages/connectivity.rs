//! Figure 3: what the neighbours of a ray know that the neighbours of a hit do not.

use glam::{DVec2, DVec3};

use super::{Bench, floor, paper, percent, pictures, scene_and_truth, verdict, wavefront};
use crate::error::{Error, Result};
use crate::geometry::Ray;
use crate::illumination::compare::{Grid, at_common_size, compare};
use crate::optics::LinearSrgb;
use crate::scene::LightKind;
use crate::study::page::{Cell, Page, Table};
use crate::study::references::DEFAULT_SURFACE;
use crate::transport::{MediumStack, Tracer};

/// [1/sr].
const DENSITY_PER_SR: f64 = 79_577.5;
const QUICK_PER_SR: f64 = 8_000.0;

/// Hits that a density is taken of.
const NEAREST: [usize; 3] = [4, 16, 64];

/// Most mirrors on a path.
const MOST_MIRRORS: usize = 16;

/// Half the side of the built-in floor [m].
const HALF_M: f64 = 1.0;

/// Buckets across and down.
const BUCKETS: usize = 64;

const COLUMNS: [(&str, &str); 4] = [
    ("estimate", "estimate"),
    ("rays", "rays"),
    ("relative_rmse", "error"),
    ("ard", "ARD"),
];

/// Where light fell on the floor: place from its corner [floor sides], and flux [W].
struct Hit {
    place: DVec2,
    flux_w: f64,
}

pub(super) fn page(bench: &Bench) -> Result<Page> {
    let (scene, truth) = scene_and_truth("ring")?;
    let Some(reference) = truth.grid() else {
        return Err(Error::failure(
            "connectivity",
            "the reference is of several surfaces",
            "report this",
        ));
    };
    let density_per_sr = if bench.quick { QUICK_PER_SR } else { DENSITY_PER_SR };
    let side = bench.side() / 2;
    let hits = hits(&Tracer::new(scene.clone()), density_per_sr);
    let mut table = Table::new(&COLUMNS);
    let (mut maps, mut nearest, mut rays) = (vec![reference.clone()], Vec::new(), Vec::new());
    let mut add = |name: String, count: u64, map: Grid| {
        let known = at_common_size(&map, reference).map(|(map, reference)| compare(&map, &reference));
        let rmse = known.and_then(|known| known.relative_rmse).unwrap_or(f64::NAN);
        let ard = known
            .and_then(|known| known.average_relative_difference)
            .unwrap_or(f64::NAN);
        table.rows.push(vec![
            name.into(),
            count.into(),
            Cell::Share(rmse),
            Cell::Share(ard),
        ]);
        maps.push(map);
        rmse
    };
    let buckets = Buckets::new(&hits);
    for count in NEAREST {
        let map = density(&buckets, &hits, (side, count));
        nearest.push(add(format!("{count} nearest hits"), hits.len() as u64, map));
    }
    for (name, settings) in [
        ("areas between rays, splat", paper(density_per_sr)),
        ("areas between rays, wavefront", wavefront(density_per_sr)),
    ] {
        let result = bench.bake(&scene, &bench.at(settings, side))?;
        if let Some(map) = floor(&scene, &result.maps) {
            rays.push(add(name.into(), result.counts.rays, map));
        }
    }
    let best = |errors: &[f64]| errors.iter().copied().fold(f64::INFINITY, f64::min);
    let caption = "The reference, densities of 4, 16 and 64 nearest hits, splats and the wavefront.".into();
    Ok(Page {
        title: "Figure 3: nearest hits against neighbouring rays".into(),
        settings: format!(
            "`builtin:ring`, {density_per_sr} rays/sr, maps of {side} × {side} texels, against {}. A density estimate sums the flux of the \
             hits nearest to a texel's centre and divides by the disc that holds them.",
            truth.kind
        ),
        pictures: vec![pictures::sheet("connectivity", caption, &maps, (3, 256))],
        table,
        plots: Vec::new(),
        findings: vec![format!(
            "The best density estimate has an error of {}, areas between neighbouring rays {} (splat) and {} (wavefront) with about as \
             many rays. That what rays know of their neighbours removes the bias of nearest hits {} with the paper.",
            percent(best(&nearest)),
            percent(rays.first().copied().unwrap_or(f64::NAN)),
            percent(rays.last().copied().unwrap_or(f64::NAN)),
            verdict(best(&rays) < best(&nearest))
        )],
    })
}

/// Where the light of the scene's lamp falls by way of mirrors: directions on a spiral, evenly dense.
fn hits(tracer: &Tracer, density_per_sr: f64) -> Vec<Hit> {
    let golden = 0.5 * (5_f64.sqrt() - 1.0);
    let mut hits = Vec::new();
    for light in &tracer.scene().lights {
        let LightKind::Point { position, intensity } = light.kind else {
            continue;
        };
        let count = (4.0 * std::f64::consts::PI * density_per_sr).round();
        let flux_w = intensity.0 * light.colour.luminance() * 4.0 * std::f64::consts::PI / count;
        for index in 0..count as u64 {
            let height = 1.0 - (2.0 * index as f64 + 1.0) / count;
            let (sine, cosine) = (std::f64::consts::TAU * (index as f64 * golden).fract()).sin_cos();
            let across = (1.0 - height * height).sqrt();
            let direction = DVec3::new(across * cosine, height, across * sine);
            let ray = Ray {
                origin: position,
                direction,
            };
            hits.extend(follow(tracer, ray, flux_w));
        }
    }
    hits
}

/// Where one ray comes to the floor after at least one mirror.
fn follow(tracer: &Tracer, mut ray: Ray, flux_w: f64) -> Option<Hit> {
    let (mut media, mut weight) = (MediumStack::default(), LinearSrgb::WHITE);
    for mirrors in 0..=MOST_MIRRORS {
        let hit = tracer.closest_hit(&ray)?;
        let is_floor = tracer.scene().objects[hit.object].name == DEFAULT_SURFACE;
        if is_floor {
            let place = DVec2::new(hit.point.x, hit.point.z) / (2.0 * HALF_M) + 0.5;
            return (mirrors > 0).then(|| Hit {
                place,
                flux_w: flux_w * weight.luminance(),
            });
        }
        let branch = tracer.interact(&hit, ray.direction, &media).reflection?;
        weight = weight * branch.share;
        (ray, media) = (branch.ray, branch.media);
    }
    None
}

/// Hits by the square of the floor that they lie in.
struct Buckets(Vec<Vec<usize>>);

impl Buckets {
    fn new(hits: &[Hit]) -> Self {
        let mut buckets = vec![Vec::new(); BUCKETS * BUCKETS];
        for (index, hit) in hits.iter().enumerate() {
            let [column, row] = bucket(hit.place);
            buckets[row * BUCKETS + column].push(index);
        }
        Self(buckets)
    }

    /// Hits whose buckets are at most so many away.
    fn around(&self, place: DVec2, rings: usize) -> impl Iterator<Item = usize> {
        let [column, row] = bucket(place);
        let near = move |index: usize| index.saturating_sub(rings)..(index + rings + 1).min(BUCKETS);
        near(row).flat_map(move |row| {
            near(column).flat_map(move |column| self.0[row * BUCKETS + column].iter().copied())
        })
    }
}

fn bucket(place: DVec2) -> [usize; 2] {
    [place.x, place.y].map(|along| ((along * BUCKETS as f64) as usize).min(BUCKETS - 1))
}

/// E [W/m²] by the density of the `count` nearest hits.
fn density(buckets: &Buckets, hits: &[Hit], (side, count): (usize, usize)) -> Grid {
    let floor_m2 = 4.0 * HALF_M * HALF_M;
    let texel = |index: usize| {
        let at = |index: usize| (index as f64 + 0.5) / side as f64;
        let centre = DVec2::new(at(index % side), at(index / side));
        // A bucket more than holds enough: the corners of the square are farther than its sides.
        let holds_enough = |rings: &usize| buckets.around(centre, *rings).nth(2 * count).is_some();
        let rings = (0..BUCKETS).find(holds_enough).unwrap_or(BUCKETS);
        let mut near: Vec<(f64, f64)> = buckets
            .around(centre, rings + 1)
            .map(|hit| (hits[hit].place.distance_squared(centre), hits[hit].flux_w))
            .collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        near.truncate(count);
        let radius_squared = near.last().map_or(f64::INFINITY, |last| last.0);
        let flux_w: f64 = near.iter().map(|hit| hit.1).sum();
        flux_w / (std::f64::consts::PI * radius_squared * floor_m2)
    };
    Grid {
        width: side,
        height: side,
        values: (0..side * side).map(texel).collect(),
    }
}
