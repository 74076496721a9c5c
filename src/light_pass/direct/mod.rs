//! Direct light (LD): irradiance of every texel straight from the lamps.
//!
//! E = I cos θ/r² for points and spots and E⊥ cos θ for suns, with θ from the interpolated normal. Every surface casts
//! shadows, clear glass included: what passes through it is caustic light (LS+D). A surface of partial coverage lets
//! the rest of the light pass. The medium around a lamp absorbs on the way. Each side of a surface has its own map.
//! Extended lights are averaged over samples, and where these are noisy over neighbouring texels that they light
//! evenly.

pub mod border;
pub(super) mod facet;
mod lighting;
mod polygon;
mod source;
mod texel;

use glam::DVec2;
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use std::sync::atomic::{AtomicU64, Ordering};

use crate::illumination::Chart;
use crate::illumination::gutter::{fill_gutter, neighbours};
use crate::illumination::parametrisation::coverage::{Polygon, for_each_texel_in_row, rows};
use crate::optics::LinearSrgb;
use crate::progress::{Control, Progress, Stage};
use crate::scene::{Light, Material};
use crate::transport::Tracer;
use border::{SubdividedTexels, is_steep};
use facet::Facet;
use lighting::{IncidentLight, UnshadowedLight};
use source::{DirectSource, Emission};
use texel::{LargestOverlap, LightsOfTexel, Sample, SamplingDetail, Texel, TexelRow, TexelSum, mark_of};

/// Offset of all samples, about a millionth of a texel: none may lie on the diagonal between two triangles of a square,
/// where both would count it.
const OFF_THE_DIAGONALS: DVec2 = DVec2::new(0.6e-6, 1.1e-6);

/// The direct layer of one map.
#[derive(Clone, Debug)]
pub struct DirectLayer {
    /// Mean E over the covered part of each texel [W/m²], gutter filled.
    pub irradiance: Vec<[f32; 3]>,
    /// Mean E over each small texel at shadow borders [W/m²].
    pub divided: Option<SubdividedTexels<[f32; 3]>>,
    pub shadow_rays: u64,
    /// False if cancelled: missing rows are black.
    pub complete: bool,
    /// False if the time was up before all texels had the samples that they need.
    pub is_refined: bool,
}

/// Bakes the direct light of some lights, one layer per chart. A chart's companion, if there is one, maps the same
/// surface with small texels, into which texels at shadow borders are subdivided. The result does not depend on the
/// number of threads, unless `control` has a deadline: after it, texels keep what a few samples found. Progress counts
/// rows over all charts.
pub fn bake_direct(
    tracer: &Tracer,
    lights: &[Light],
    charts: &[(&Chart, Option<&Chart>)],
    progress: &dyn Progress,
    control: &Control,
) -> Vec<DirectLayer> {
    let sources = sources(tracer, lights);
    let first = FirstLook::of(&sources, control);
    let passes = if first == FirstLook::Coarse { 2 } else { 3 };
    let rows = |(chart, smaller): &(&Chart, Option<&Chart>)| {
        passes * chart.height as u64 + smaller.map_or(0, |smaller| 2 * smaller.height as u64)
    };
    let total: u64 = charts.iter().map(rows).sum();
    let done = AtomicU64::new(0);
    let row_done = || progress.advance(Stage::Direct, done.fetch_add(1, Ordering::Relaxed) + 1, total);
    let of = |&(chart, smaller): &(&Chart, Option<&Chart>)| {
        let smaller = smaller.map(|smaller| Baker::new(tracer, (&sources, first), smaller));
        Baker::new(tracer, (&sources, first), chart).bake(smaller.as_ref(), &row_done, control)
    };
    charts.iter().map(of).collect()
}

/// Marks the texels at the shadow borders of a light, and counts the shadow rays traced to find them; `None` if
/// cancelled. The result does not depend on the number of threads.
pub fn find_borders(
    tracer: &Tracer,
    light: &Light,
    charts: &[&Chart],
    control: &Control,
) -> Option<(Vec<Vec<bool>>, u64)> {
    let sources = sources(tracer, std::slice::from_ref(light));
    let first = FirstLook::of(&sources, control);
    let mut shadow_rays = 0;
    let of = |chart: &&Chart| {
        let baker = Baker::new(tracer, (&sources, first), chart);
        let mut seen = ChartStatistics::new(chart);
        baker.look_around(&mut seen, &|| (), control);
        shadow_rays += seen.shadow_rays;
        let texels = &seen.texels;
        let is_border = |texel: usize| is_steep(chart, texels, texel) && baker.is_unclear(texels, texel);
        let borders = (0..texels.len()).map(is_border);
        seen.complete.then(|| borders.collect())
    };
    let found: Option<Vec<Vec<bool>>> = charts.iter().map(of).collect();
    Some((found?, shadow_rays))
}

fn sources(tracer: &Tracer, lights: &[Light]) -> Vec<Option<DirectSource>> {
    let lights = lights.iter().enumerate();
    lights
        .map(|(index, light)| DirectSource::new(light, tracer, index))
        .collect()
}

/// How texels are sampled first.
#[derive(Clone, Copy, PartialEq, Eq)]
enum FirstLook {
    Coarse,
    /// At a glance, then coarsely where that was not enough.
    Glance,
    /// At a glance, then coarsely everywhere as far as the time allows.
    Hurried,
}

impl FirstLook {
    fn of(sources: &[Option<DirectSource>], control: &Control) -> Self {
        let soft = sources.iter().flatten();
        let soft = soft.filter_map(|source| match &source.emission {
            Emission::Extended(soft) => Some(soft.is_even),
            Emission::Single(_) => None,
        });
        let even: Vec<bool> = soft.collect();
        if even.is_empty() {
            Self::Coarse
        } else if even.iter().all(|is_even| *is_even) {
            Self::Glance
        } else if control.time_left_s().is_some() {
            Self::Hurried
        } else {
            Self::Coarse
        }
    }

    fn detail(self) -> SamplingDetail {
        match self {
            Self::Coarse => SamplingDetail::COARSE,
            Self::Glance | Self::Hurried => SamplingDetail::GLANCE,
        }
    }
}

/// Results for a chart so far.
struct ChartStatistics {
    width: usize,
    texels: Vec<Texel>,
    shadow_rays: u64,
    complete: bool,
    is_refined: bool,
}

impl ChartStatistics {
    fn new(chart: &Chart) -> Self {
        Self {
            width: chart.width,
            texels: vec![Texel::DARK; chart.width * chart.height],
            shadow_rays: 0,
            complete: true,
            is_refined: true,
        }
    }

    fn take(&mut self, rows: Vec<TexelRow>) {
        for (row, content) in rows.into_iter().enumerate() {
            self.count(&content);
            for (column, texel) in content.texels {
                self.texels[row * self.width + column as usize] = texel;
            }
        }
    }

    fn take_small(&mut self, rows: Vec<TexelRow>, divided: &mut SubdividedTexels<Texel>) {
        for (row, content) in rows.into_iter().enumerate() {
            self.count(&content);
            for (column, texel) in content.texels {
                divided.set(column as usize, row, texel);
            }
        }
    }

    fn count(&mut self, row: &TexelRow) {
        self.shadow_rays += row.shadow_rays;
        self.complete &= !row.cancelled;
        self.is_refined &= !row.is_late;
    }
}

struct Baker<'a> {
    tracer: &'a Tracer,
    /// By light; `None` for one that emits nothing.
    sources: &'a [Option<DirectSource>],
    first_look: FirstLook,
    chart: &'a Chart,
    material: &'a Material,
    /// Row r is overlapped by `triangles[first[r]..first[r + 1]]`.
    first: Vec<usize>,
    triangles: Vec<u32>,
}

impl<'a> Baker<'a> {
    fn new(
        tracer: &'a Tracer,
        (sources, first_look): (&'a [Option<DirectSource>], FirstLook),
        chart: &'a Chart,
    ) -> Self {
        // A counting sort of the triangles by the rows of texels that they overlap: each row reads one contiguous
        // range.
        let size = DVec2::new(1.0, chart.height as f64);
        let reach = |uvs: &[DVec2; 3]| rows(uvs.map(|uv| uv * size), chart.height);
        let mut first = vec![0; chart.height + 1];
        for uvs in &chart.corner_uvs {
            for row in reach(uvs) {
                first[row + 1] += 1;
            }
        }
        for row in 0..chart.height {
            first[row + 1] += first[row];
        }

        // Triangles of a row keep the order of the mesh, and with it the order of the float sums in its texels.
        let mut next = first.clone();
        let mut triangles = vec![0; first[chart.height]];
        for (triangle, uvs) in chart.corner_uvs.iter().enumerate() {
            for row in reach(uvs) {
                triangles[next[row]] = triangle as u32;
                next[row] += 1;
            }
        }
        Self {
            tracer,
            sources,
            first_look,
            chart,
            material: tracer.scene().material_of(chart.object()),
            first,
            triangles,
        }
    }

    /// Samples all texels coarsely, then those finely where visibility changes within a texel or between neighbours. At
    /// shadow borders small texels are sampled instead.
    fn bake(&self, smaller: Option<&Baker>, row_done: &(impl Fn() + Sync), control: &Control) -> DirectLayer {
        let mut seen = ChartStatistics::new(self.chart);
        self.look_around(&mut seen, row_done, control);
        let texels = &seen.texels;
        let mut unclear: Vec<bool> = (0..texels.len())
            .map(|texel| texels[texel].is_uncertain || self.meets_other(texels, texel, |texel| texel.lit))
            .collect();
        let divided = smaller.map(|smaller| self.divide(smaller, &mut unclear, &mut seen, row_done, control));
        self.smooth(&mut seen.texels, &mut unclear);
        seen.take(self.pass(row_done, control, SamplingDetail::FINE, |texel| unclear[texel]));
        let irradiance = seen.texels.into_iter().map(|texel| texel.irradiance);
        let mut irradiance: Vec<[f32; 3]> = irradiance.collect();
        fill_gutter(self.chart, &mut irradiance);
        DirectLayer {
            irradiance,
            divided: divided.map(|divided| divided.map(|texel| texel.irradiance)),
            shadow_rays: seen.shadow_rays,
            complete: seen.complete,
            is_refined: seen.is_refined,
        }
    }

    /// The first pass over all texels. If that was a glance, a coarse pass follows where it was not enough.
    fn look_around(&self, seen: &mut ChartStatistics, row_done: &(impl Fn() + Sync), control: &Control) {
        seen.take(self.pass(
            row_done,
            &control.without_deadline(),
            self.first_look.detail(),
            |_| true,
        ));
        if self.first_look == FirstLook::Coarse {
            return;
        }
        let texels = &seen.texels;
        let coarse = self.pass(row_done, control, SamplingDetail::COARSE, |texel| {
            self.first_look == FirstLook::Hurried
                || texels[texel].is_uncertain
                || self.meets_other(texels, texel, |texel| texel.soft_lit)
        });
        seen.take(coarse);
    }

    /// Subdivides the texels at shadow borders and samples their small texels. No more samples are needed there.
    fn divide(
        &self,
        smaller: &Baker,
        unclear: &mut [bool],
        seen: &mut ChartStatistics,
        row_done: &(impl Fn() + Sync),
        control: &Control,
    ) -> SubdividedTexels<Texel> {
        // A texel is divided where its light is steep and unclear, but not once the time is up.
        let texels = &seen.texels;
        let is_late = control.is_cancelled();
        let steep =
            |texel: usize| !is_late && is_steep(self.chart, texels, texel) && self.is_unclear(texels, texel);
        let steep: Vec<bool> = (0..unclear.len()).map(steep).collect();

        // Small texels replace the texel's own light, so that each gets a first look, whatever the deadline. Only those
        // that stay unclear get more samples, as far as the time allows.
        let side = smaller.chart.width / self.chart.width;
        let mut divided = SubdividedTexels::new(self.chart, side, &steep, Texel::DARK);
        let is_there = |small: usize| divided.get(small).is_some();
        let rows = smaller.pass(
            row_done,
            &control.without_deadline(),
            self.first_look.detail(),
            is_there,
        );
        seen.take_small(rows, &mut divided);
        let rows = smaller.pass(row_done, control, SamplingDetail::SMALL, |small| {
            divided.is_unclear(small)
        });
        seen.take_small(rows, &mut divided);

        // The mean of its small texels is better than any finer samples of a texel, which needs none from here on.
        for (texel, unclear) in unclear.iter_mut().enumerate() {
            let Some(small) = divided.within(texel) else {
                continue;
            };
            *unclear = false;
            let sum = small.iter().fold([0.0; 3], |sum: [f32; 3], small| {
                [0, 1, 2].map(|channel| sum[channel] + small.irradiance[channel])
            });
            seen.texels[texel].irradiance = sum.map(|sum| sum / small.len() as f32);
        }
        divided
    }

    /// Averages noisy texels with those around them where the light is even enough; the others stay unclear.
    fn smooth(&self, texels: &mut [Texel], unclear: &mut [bool]) {
        let (width, height) = (self.chart.width, self.chart.height);
        let around = |texel: usize| {
            let (column, row) = (texel % width, texel / width);
            let is_inside = (1..width.saturating_sub(1)).contains(&column)
                && (1..height.saturating_sub(1)).contains(&row);
            let square = |index: usize| texels[texel + index % 3 + width * (index / 3) - width - 1];
            is_inside.then(|| std::array::from_fn(square))
        };
        let smoothed: Vec<(usize, [f32; 3])> = (0..texels.len())
            .into_par_iter()
            .filter(|&texel| unclear[texel] && texels[texel].is_uncertain)
            .filter_map(|texel| Some((texel, Texel::smoothed(&around(texel)?)?)))
            .collect();
        for (texel, irradiance) in smoothed {
            texels[texel].irradiance = irradiance;
            unclear[texel] = false;
        }
    }

    /// Whether a texel needs more samples.
    fn is_unclear(&self, texels: &[Texel], texel: usize) -> bool {
        let around = || neighbours(texel, self.chart.width, self.chart.height).map(|other| texels[other]);
        texels[texel].is_unclear(around)
    }

    /// Whether visibility differs within a texel or between it and its neighbours.
    fn meets_other(&self, texels: &[Texel], texel: usize, lit: impl Fn(&Texel) -> LightsOfTexel) -> bool {
        let around = neighbours(texel, self.chart.width, self.chart.height);
        lit(&texels[texel]).differs(around.map(|other| lit(&texels[other])))
    }

    /// Samples the wanted texels, until the time is up.
    fn pass(
        &self,
        row_done: &(impl Fn() + Sync),
        control: &Control,
        detail: SamplingDetail,
        wanted: impl Fn(usize) -> bool + Sync,
    ) -> Vec<TexelRow> {
        let whole = control.without_deadline();
        (0..self.chart.height)
            .into_par_iter()
            .map(|row| {
                if control.is_cancelled() {
                    let cancelled = whole.is_cancelled();
                    return TexelRow {
                        cancelled,
                        is_late: !cancelled,
                        ..TexelRow::default()
                    };
                }
                let content = self.row(row, detail, &wanted);
                row_done();
                content
            })
            .collect()
    }

    fn row(&self, row: usize, detail: SamplingDetail, wanted: &impl Fn(usize) -> bool) -> TexelRow {
        // Triangles that share a texel add their samples to one sum.
        let width = self.chart.width;
        let mut sums = vec![TexelSum::EMPTY; width];
        let mut content = TexelRow::default();
        for &triangle in &self.triangles[self.first[row]..self.first[row + 1]] {
            let Some(facet) = self.facet(triangle) else {
                continue;
            };
            for_each_texel_in_row(facet.corners_texels, row, width, |column, part| {
                if wanted(row * width + column) {
                    let texel = DVec2::new(column as f64, row as f64);
                    let hash = self.hash(row * width + column);
                    let sum = &mut sums[column];
                    content.shadow_rays += self.add_part(&facet, part, (texel, hash), detail, sum);
                }
            });
        }

        // A surface too thin for the grid of samples is sampled at the centroid of its largest overlap, lest the texel
        // stay black.
        for (column, sum) in sums.iter_mut().enumerate() {
            if let (true, Some(part)) = (sum.lit == LightsOfTexel::EMPTY, sum.largest)
                && let Some(facet) = self.facet(part.triangle)
            {
                let sample = self.sample(
                    &facet,
                    part.middle,
                    (self.hash(row * width + column), 0),
                    (1, detail),
                );
                content.shadow_rays += sample.shadow_rays;
                sum.add(sample, part.area_m2);
            }
            if sum.lit != LightsOfTexel::EMPTY {
                content.texels.push((column as u32, sum.finished()));
            }
        }
        content
    }

    /// Adds the samples of a texel that lie in its overlap with one triangle; returns the number of shadow rays.
    fn add_part(
        &self,
        facet: &Facet,
        part: &Polygon,
        (texel, hash): (DVec2, u64),
        detail: SamplingDetail,
        sum: &mut TexelSum,
    ) -> u64 {
        // The largest overlap is remembered for texels in which no sample lies on the surface.
        let area_m2 = part.area() * facet.m2_per_texel2;
        if sum.largest.is_none_or(|largest| largest.area_m2 < area_m2) {
            sum.largest = Some(LargestOverlap {
                triangle: facet.triangle,
                area_m2,
                middle: part.centroid(),
            });
        }

        // The samples of a texel form one regular grid. Each triangle takes those within its overlap; off the
        // diagonals, none is taken twice.
        let side = detail.side;
        let step = 1.0 / side as f64;
        let mut shadow_rays = 0;
        for index in 0..side * side {
            let place = texel
                + DVec2::new((index % side) as f64 + 0.5, (index / side) as f64 + 0.5) * step
                + OFF_THE_DIAGONALS;
            if part.contains(place) {
                let sample = self.sample(facet, place, (hash, index), (side * side, detail));
                shadow_rays += sample.shadow_rays;
                sum.add(sample, facet.m2_per_texel2 * step * step);
            }
        }
        shadow_rays
    }

    /// Direct light at a map position [texels], the `index`th sample point of a texel with this hash. `detail` begins
    /// with the number of sample points of a texel.
    fn sample(
        &self,
        facet: &Facet,
        place: DVec2,
        (hash, index): (u64, usize),
        detail: (usize, SamplingDetail),
    ) -> Sample {
        // The diffuse fraction and the coat at the point decide how much of the arriving light the map stores.
        let point = facet.at(place);
        let object = self.chart.object();
        let response = self
            .tracer
            .diffuse_response(object, point.triangle, point.barycentric);
        let mut sample = Sample {
            irradiance: LinearSrgb::BLACK,
            mask: 0,
            soft_mask: Some(0),
            soft: 0.0,
            shadow_rays: 0,
        };

        // Marks of the lights that arrive are combined, so that texels that see different lights can be told apart.
        for (light, source) in self.sources.iter().enumerate() {
            let Some(source) = source else { continue };
            match &source.emission {
                Emission::Single(emitter) => {
                    // A single point or direction is visible, blocked, or dimmed by partial coverage, which has a mark
                    // of its own.
                    let arriving = IncidentLight::new(emitter, point.position).and_then(|beam| {
                        UnshadowedLight::from_beam(
                            &beam,
                            &point,
                            &response,
                            (self.tracer.scene(), &source.media),
                        )
                    });
                    let Some(arriving) = arriving else { continue };
                    sample.shadow_rays += 1;
                    let ray = point.spawn(arriving.to_light);
                    let passing = self.tracer.passing_share(&ray, arriving.distance_m);
                    sample.irradiance += arriving.irradiance * passing;
                    if passing == 1.0 {
                        sample.mask ^= mark_of(light);
                    } else if passing > 0.0 {
                        sample.mask ^= mark_of(light).rotate_left(1);
                    }
                }
                Emission::Extended(soft) => {
                    // A run of samples decides visibility. Where it is partial, the texel counts as crossed by a
                    // penumbra.
                    let run = soft.run(hash, index, detail);
                    let gathered = soft.gather(
                        self.tracer,
                        &point,
                        (self.material, &response),
                        &source.media,
                        run,
                    );
                    sample.shadow_rays += gathered.shadow_rays;
                    sample.irradiance += gathered.irradiance;
                    sample.soft += gathered.irradiance.luminance();
                    if gathered.blocked_rays == 0 && gathered.shadow_rays > 0 {
                        sample.soft_mask = sample.soft_mask.map(|mask| mask ^ mark_of(light));
                    } else if gathered.blocked_rays < gathered.shadow_rays {
                        sample.soft_mask = None;
                    }
                }
            }
        }
        sample
    }

    /// Distinguishes the texels of all maps.
    fn hash(&self, texel: usize) -> u64 {
        (self.chart.receiver.index() as u64) << 40 ^ texel as u64
    }

    fn facet(&self, triangle: u32) -> Option<Facet> {
        let mesh = self.tracer.scene().objects[self.chart.object()].mesh_in_scene();
        Facet::new(mesh, self.chart, triangle)
    }
}
