//! Spreads a patch over the surfaces it lights: rays between the traced ones meet the receivers, and the triangles
//! between them carry the patch's flux.

use glam::{DVec2, DVec3};

use super::band::Samples;
use super::cell::{Patch, PatchKind};
use super::coverage::FluxTriangle;
use super::patch::{CoonsPatch, PatchShape};
use super::receivers::Receivers;
use super::strand::{Landing, Strand};
use super::virtual_vertex::{Place, VirtualRays, VirtualVertex};
use crate::illumination::accumulator::{FluxCount, FluxUnit};
use crate::light_pass::caustic::statistics::FootprintStatistics;
use crate::light_pass::ledger_sum::{Account, LedgerSum};
use crate::optics::LinearSrgb;

/// Deviation from straight that triangles may have [texels].
const CHORD_TEXELS: f64 = 0.02;

/// Change of the lit area from one triangle to the next, as a share, that is left where triangles are larger than
/// texels.
const DENSITY_STEP: f64 = 0.01;

/// How much coarser patches are divided that add next to nothing to their map.
const COARSEST_TOLERANCE: f64 = 10.0;

/// Most triangles along a patch.
const MOST_STEPS: usize = 128;

/// Steps along a patch whose rays do not all go to one surface.
const MIXED_STEPS: usize = 6;

/// Texels that such a patch is taken to light.
const MIXED_TEXELS: f64 = 16.0;

/// Bisections of a virtual edge between rays that go to different surfaces.
const CUT_STEPS: u32 = 10;

/// How often a triangle is cut that meets several surfaces.
const DEEPEST_CUT: u32 = 4;

/// Patches of a wavefront cell that a map resolves details of, along each side: a cubic patch says more than its
/// corners.
const DETAILS_PER_PATCH: f64 = 64.0;

/// Spreads patches.
#[derive(Clone, Copy, Debug)]
pub struct Spreader<'a> {
    /// Who is lit.
    pub receivers: &'a Receivers<'a>,
    /// The patches' strands.
    pub samples: &'a Samples,
    /// Of the accounts.
    pub unit: FluxUnit,
    /// Whether any volume absorbs.
    pub absorption: bool,
    /// Flux that all lights send to specular surfaces [W, luminance]: over a map, about its mean irradiance.
    pub reference_w: f64,
    /// How much coarser (> 1) or finer triangles may be than is usual.
    pub coarseness: f64,
}

/// What patches became.
#[derive(Clone, Debug, Default)]
pub struct SpreadOutput {
    /// By object: triangles on its map.
    pub triangles: Vec<(u32, Vec<FluxTriangle>)>,
    /// Escaped, absorbed on the way, passed on.
    pub ledger: LedgerSum,
    /// Rays between traced ones that were intersected with receivers.
    pub queries: u64,
    /// Sizes of lit areas.
    pub statistics: FootprintStatistics,
}

impl SpreadOutput {
    /// Triangles on the map of an object.
    fn list(&mut self, object: u32) -> &mut Vec<FluxTriangle> {
        // A handful of objects, most often the last one.
        match self.triangles.iter().rposition(|(of, _)| *of == object) {
            Some(index) => &mut self.triangles[index].1,
            None => {
                self.triangles.push((object, Vec::new()));
                let last = self.triangles.len() - 1;
                &mut self.triangles[last].1
            }
        }
    }
}

/// Where all of a patch goes, as its traced corners say.
enum Course {
    /// On to other specular surfaces.
    Onward,
    /// Out of the scene.
    Escapes,
    /// Onto one plane, or past its border.
    Plane(u32),
    /// The hierarchy has to tell.
    Mixed,
}

impl Spreader<'_> {
    /// Spreads one patch.
    pub fn spread(&self, patch: &Patch, out: &mut SpreadOutput) {
        let strands: [&Strand; 4] = patch
            .corners
            .map(|(sample, strand)| self.samples.strand(sample, strand));
        let strands = &strands[..patch.corner_count()];
        let mean = strands
            .iter()
            .fold(LinearSrgb::BLACK, |sum, strand| sum + strand.flux_w)
            * (strands.len() as f64).recip();
        let flux_w = mean * patch.area();
        let flux = self.unit.count(flux_w);
        out.ledger.book(Account::Quadrature, flux.map(|count| -count));
        match self.course(strands) {
            Course::Escapes => out.ledger.book(Account::Escaped, flux),
            Course::Onward => self.onward(strands, flux, out),
            Course::Plane(object) => self.over(patch, strands, flux, flux_w, Some(object), out),
            Course::Mixed => self.over(patch, strands, flux, flux_w, None, out),
        }
    }

    fn course(&self, strands: &[&Strand]) -> Course {
        let landing = |wanted: fn(&Landing) -> bool| strands.iter().all(|strand| wanted(&strand.landing));
        if landing(|landing| matches!(landing, Landing::Specular { .. })) {
            return Course::Onward;
        }
        let receiver = strands.iter().find_map(|strand| match strand.landing {
            Landing::Receiver { object, .. } => Some(object),
            Landing::Escaped | Landing::Specular { .. } => None,
        });
        let (low, high) = self.beam_bounds(strands);
        let from = strands[0].from;
        let Some(object) = receiver else {
            let escapes = landing(|landing| matches!(landing, Landing::Escaped))
                && !self.receivers.meets_others(low, high, [from; 2]);
            return if escapes { Course::Escapes } else { Course::Mixed };
        };
        let Some(surface) = self.receivers.get(object) else {
            return Course::Mixed;
        };
        let Some(plane) = surface.plane.filter(|_| surface.is_diffuse) else {
            return Course::Mixed;
        };
        let only = strands
            .iter()
            .all(|strand| strand.landing.object().is_none_or(|landed| landed == object));
        let past_border = strands
            .iter()
            .any(|strand| matches!(strand.landing, Landing::Escaped));
        if only
            && (plane.fills_map || !past_border)
            && !self.receivers.meets_others(low, high, [from, object])
        {
            Course::Plane(object)
        } else {
            Course::Mixed
        }
    }

    /// Box around the traced rays from their origins to where they land or leave the scene [m].
    fn beam_bounds(&self, strands: &[&Strand]) -> (DVec3, DVec3) {
        let mut low = DVec3::INFINITY;
        let mut high = DVec3::NEG_INFINITY;
        for strand in strands {
            let end = strand
                .landing_point()
                .unwrap_or_else(|| self.receivers.exit_point(&strand.ray));
            for point in [strand.ray.origin, end] {
                (low, high) = (low.min(point), high.max(point));
            }
        }
        (low, high)
    }

    /// All of it goes on; volumes take their share.
    fn onward(&self, strands: &[&Strand], flux: FluxCount, out: &mut SpreadOutput) {
        let mut passed = flux;
        if self.absorption {
            let scene = self.receivers.tracer.scene();
            let left = strands.iter().fold(LinearSrgb::BLACK, |sum, strand| {
                sum + strand.media.transmittance(scene, strand.landing.distance_m())
            }) * (strands.len() as f64).recip();
            passed = scaled(flux, left);
            out.ledger.book(Account::Absorbed, difference(flux, passed));
        }
        out.ledger.book(Account::Quadrature, passed);
    }

    fn over(
        &self,
        patch: &Patch,
        strands: &[&Strand],
        flux: FluxCount,
        flux_w: LinearSrgb,
        plane: Option<u32>,
        out: &mut SpreadOutput,
    ) {
        let shape = shape_of(patch, strands);
        // Light past the border of a plane goes out only where traced light does.
        let goes_out = strands
            .iter()
            .any(|strand| matches!(strand.landing, Landing::Escaped));
        let plane = plane.filter(|&object| goes_out || self.stays_on_map(&shape, object));
        let colours: Vec<LinearSrgb> = strands.iter().map(|strand| strand.flux_w).collect();
        let mut rays = VirtualRays::new(self, &shape, strands, plane);
        let steps = self.steps(&shape, &mut rays, plane.is_some(), flux_w, out);
        if let (PatchShape::Coons(coons), Some(object)) = (&shape, plane)
            && let Some(grid) = self.plane_grid(coons, object, steps)
        {
            out.queries += rays.queries + grid.len() as u64;
            return even_grid(object, &grid, steps, &colours, flux, out);
        }
        let mut mesh = Spread {
            shape: &shape,
            rays,
            colours: &colours,
            out,
            absorption: self.absorption,
            goes_out,
        };
        if shape.is_rectangle() {
            mesh.rectangle(steps, flux);
        } else {
            mesh.triangle(steps.0.max(steps.1), flux);
        }
        let queries = mesh.rays.queries;
        out.queries += queries;
    }

    /// Whether nine rays of a patch meet a plane within its map.
    fn stays_on_map(&self, shape: &PatchShape, object: u32) -> bool {
        let Some(surface) = self.receivers.get(object) else {
            return false;
        };
        let Some(plane) = surface.plane else {
            return false;
        };
        let size = DVec2::new(surface.chart.width as f64, surface.chart.height as f64);
        (0..9).all(|index| {
            let at = probe_place(shape, index % 3, index / 3);
            plane
                .meet(&shape.ray(at))
                .is_some_and(|(texel, _)| texel.cmpge(DVec2::ZERO).all() && texel.cmple(size).all())
        })
    }

    /// Texel coordinates of a grid of rays, row by row, where all of them meet one plane and nothing is absorbed.
    fn plane_grid(&self, coons: &CoonsPatch, object: u32, steps: (usize, usize)) -> Option<Vec<DVec2>> {
        let plane = self.receivers.get(object)?.plane?;
        if self.absorption {
            return None;
        }
        let mut grid = Vec::with_capacity((steps.0 + 1) * (steps.1 + 1));
        let mut all = true;
        coons.for_each_row(steps, |_, rays| {
            for ray in rays {
                match plane.meet(ray) {
                    Some((texel, _)) => grid.push(texel),
                    None => all = false,
                }
            }
        });
        all.then_some(grid)
    }

    /// How finely a patch has to be divided, from nine of its rays.
    fn steps(
        &self,
        shape: &PatchShape,
        rays: &mut VirtualRays,
        is_plane: bool,
        flux_w: LinearSrgb,
        out: &mut SpreadOutput,
    ) -> (usize, usize) {
        let probes: [[VirtualVertex; 3]; 3] =
            std::array::from_fn(|j| std::array::from_fn(|i| rays.vertex(probe_place(shape, i, j))));
        let first = probes[0][0].place;
        let is_one = probes.iter().flatten().all(|vertex| vertex.place.is_same(&first));
        let Some(object) = first.object().filter(|_| is_one) else {
            let lit = probes.iter().flatten().find_map(|vertex| vertex.place.object());
            let tolerance = lit.map_or(1.0, |object| {
                self.tolerance(object, flux_w.luminance(), MIXED_TEXELS)
            });
            return mixed_steps(&probes, is_plane, tolerance);
        };
        let texel = |i: usize, j: usize| probes[j][i].place.texel();
        self.count_area(object, &texel, flux_w, out);
        let bend = |a: DVec2, b: DVec2, c: DVec2| (a - b * 2.0 + c).length() * 0.25;
        let across = (0..3)
            .map(|j| bend(texel(0, j), texel(1, j), texel(2, j)))
            .fold(0.0, f64::max);
        let down = (0..3)
            .map(|i| bend(texel(i, 0), texel(i, 1), texel(i, 2)))
            .fold(0.0, f64::max);
        let corner = |i: usize, j: usize| {
            let (a, b, c) = (texel(i, j), texel(i + 1, j), texel(i, j + 1));
            (b - a).perp_dot(c - a)
        };
        let areas = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
        let largest = areas.iter().fold(0.0_f64, |m, a| m.max(a.abs()));
        let change = |a: f64, b: f64| {
            if largest > 0.0 {
                (a - b).abs() / largest
            } else {
                0.0
            }
        };
        let lit_texels = 0.5 * areas.iter().map(|area| area.abs()).sum::<f64>();
        let tolerance = self.tolerance(object, flux_w.luminance(), lit_texels);
        let length = |a: DVec2, b: DVec2, c: DVec2| a.distance(b) + b.distance(c);
        let width = (0..3)
            .map(|j| length(texel(0, j), texel(1, j), texel(2, j)))
            .fold(0.0, f64::max);
        let height = (0..3)
            .map(|i| length(texel(i, 0), texel(i, 1), texel(i, 2)))
            .fold(0.0, f64::max);
        let steps = |bend: f64, change: f64, length: f64| {
            let straight = (bend / (CHORD_TEXELS * tolerance)).sqrt();
            let even = change / (DENSITY_STEP * tolerance);
            // Of triangles below a texel only those at its border are seen.
            let even = even.min((even * length).sqrt());
            (straight.max(even).ceil() as usize).clamp(1, MOST_STEPS)
        };
        (
            steps(
                across,
                change(areas[0], areas[1]).max(change(areas[3], areas[2])),
                width,
            ),
            steps(
                down,
                change(areas[0], areas[3]).max(change(areas[1], areas[2])),
                height,
            ),
        )
    }

    /// How much coarser than the finest a patch may be divided: where it adds little to its map, what it adds need not
    /// be as exact.
    fn tolerance(&self, object: u32, flux_w: f64, lit_texels: f64) -> f64 {
        let Some(surface) = self.receivers.get(object) else {
            return 1.0;
        };
        let texels = (surface.chart.width * surface.chart.height) as f64;
        let mean_w = self.reference_w / texels;
        let local_w = flux_w / lit_texels.max(1.0);
        if local_w > 0.0 {
            self.coarseness * (mean_w / local_w).sqrt().clamp(1.0, COARSEST_TOLERANCE)
        } else {
            self.coarseness * COARSEST_TOLERANCE
        }
    }

    /// Notes how large an area a patch lights.
    fn count_area(
        &self,
        object: u32,
        texel: &impl Fn(usize, usize) -> DVec2,
        flux_w: LinearSrgb,
        out: &mut SpreadOutput,
    ) {
        let Some(surface) = self.receivers.get(object) else {
            return;
        };
        let (a, b, c, d) = (texel(0, 0), texel(2, 0), texel(2, 2), texel(0, 2));
        let texels = 0.5 * ((b - a).perp_dot(c - a).abs() + (c - a).perp_dot(d - a).abs());
        let share = texels / (surface.chart.width * surface.chart.height) as f64;
        out.statistics.add(
            object as usize,
            flux_w.luminance(),
            share * surface.area_m2 / DETAILS_PER_PATCH,
            share / DETAILS_PER_PATCH,
        );
    }
}

/// One of nine places over a patch; those of a triangle are drawn together at its last corner.
fn probe_place(shape: &PatchShape, i: usize, j: usize) -> DVec2 {
    let at = DVec2::new(i as f64, j as f64) * 0.5;
    if shape.is_rectangle() {
        at
    } else {
        DVec2::new(at.x * (1.0 - at.y), at.y)
    }
}

/// Rays that do not all meet one surface: enough to see the border between.
fn mixed_steps(probes: &[[VirtualVertex; 3]; 3], is_plane: bool, tolerance: f64) -> (usize, usize) {
    let lost = probes
        .iter()
        .flatten()
        .all(|vertex| vertex.place.object().is_none());
    let steps = match (is_plane, lost) {
        // Far off the map with every ray.
        (true, true) => 2,
        (true, false) => 2 * MIXED_STEPS,
        (false, _) => MIXED_STEPS,
    };
    let steps = (steps as f64 / tolerance.sqrt()).ceil().max(2.0) as usize;
    (steps, steps)
}

fn shape_of(patch: &Patch, strands: &[&Strand]) -> PatchShape {
    let step = patch.squares[2] - patch.squares[0];
    match (patch.kind, strands) {
        (PatchKind::Rectangle, [a, b, c, d]) => PatchShape::coons([a, b, c, d], step),
        (PatchKind::BilinearRectangle, [a, b, c, d]) => PatchShape::bilinear([a, b, c, d]),
        (PatchKind::LinearTriangle, [a, b, c]) => PatchShape::linear([a, b, c]),
        (PatchKind::Triangle, [a, b, c]) => {
            let [p, q, r, _] = patch.squares;
            PatchShape::bezier([a, b, c], [p, q, r])
        }
        _ => {
            let [at, low, high, _] = patch.squares;
            PatchShape::around(strands[0], low - at, high - low)
        }
    }
}

/// Each channel times a factor in [0, 1], rounded.
fn scaled(flux: FluxCount, factor: LinearSrgb) -> FluxCount {
    let factors = factor.to_array();
    std::array::from_fn(|channel| {
        let count = flux[channel];
        ((count as f64 * factors[channel]).round() as i64).clamp(0, count.max(0))
    })
}

fn difference(a: FluxCount, b: FluxCount) -> FluxCount {
    std::array::from_fn(|channel| a[channel] - b[channel])
}

/// The triangles of a whole grid on one plane.
fn even_grid(
    object: u32,
    grid: &[DVec2],
    (across, down): (usize, usize),
    colours: &[LinearSrgb],
    flux: FluxCount,
    out: &mut SpreadOutput,
) {
    let (width, height) = ((across as f64).recip(), (down as f64).recip());
    let total = colours
        .iter()
        .fold(LinearSrgb::BLACK, |sum, colour| sum + *colour)
        * 0.25;
    let mut share = Shares::new(flux, 2 * across * down, total);
    let list = out.list(object);
    list.reserve(2 * across * down);
    for j in 0..down {
        let t = (j as f64 + 0.5) * height;
        let left = colours[0] * (1.0 - t) + colours[3] * t;
        let right = colours[1] * (1.0 - t) + colours[2] * t;
        let rows = [&grid[j * (across + 1)..], &grid[(j + 1) * (across + 1)..]];
        for i in 0..across {
            let s = (i as f64 + 0.5) * width;
            let colour = left * (1.0 - s) + right * s;
            let (a, b, c, d) = (rows[0][i], rows[0][i + 1], rows[1][i + 1], rows[1][i]);
            for corners in [[a, b, c], [a, c, d]] {
                let flux = share.next(colour);
                if flux != [0; 3] {
                    list.push(FluxTriangle {
                        corners,
                        flux,
                        island: 0,
                    });
                }
            }
        }
    }
}

/// One patch while it is spread.
struct Spread<'a, 'b> {
    shape: &'a PatchShape,
    rays: VirtualRays<'a>,
    /// Flux density at the patch's corners.
    colours: &'a [LinearSrgb],
    out: &'b mut SpreadOutput,
    absorption: bool,
    /// Whether any traced ray of the patch leaves the scene.
    goes_out: bool,
}

/// A virtual ray with its place on the patch.
#[derive(Clone, Copy, Debug)]
struct Knot {
    at: DVec2,
    vertex: VirtualVertex,
}

impl Spread<'_, '_> {
    fn knot(&mut self, at: DVec2) -> Knot {
        Knot {
            at,
            vertex: self.rays.vertex(at),
        }
    }

    fn colour(&self, at: DVec2) -> LinearSrgb {
        let weights = self.shape.weights(at);
        self.colours
            .iter()
            .zip(weights)
            .fold(LinearSrgb::BLACK, |sum, (colour, weight)| sum + *colour * weight)
    }

    fn rectangle(&mut self, (across, down): (usize, usize), flux: FluxCount) {
        let at = |i: usize, j: usize| DVec2::new(i as f64 / across as f64, j as f64 / down as f64);
        let mut share = Shares::new(flux, 2 * across * down, self.total_colour());
        let mut row: Vec<Knot> = (0..=across).map(|i| self.knot(at(i, 0))).collect();
        for j in 0..down {
            let next: Vec<Knot> = (0..=across).map(|i| self.knot(at(i, j + 1))).collect();
            for i in 0..across {
                let corners = [row[i], row[i + 1], next[i + 1], next[i]];
                let middle = self.colour((corners[0].at + corners[2].at) * 0.5);
                for triangle in [[0, 1, 2], [0, 2, 3]] {
                    let flux = share.next(middle);
                    self.settle(triangle.map(|corner| corners[corner]), flux, DEEPEST_CUT);
                }
            }
            row = next;
        }
    }

    fn triangle(&mut self, steps: usize, flux: FluxCount) {
        let at = |i: usize, j: usize| DVec2::new(i as f64, j as f64) / steps as f64;
        let mut share = Shares::new(flux, steps * steps, self.total_colour());
        let mut row: Vec<Knot> = (0..=steps).map(|i| self.knot(at(i, 0))).collect();
        for j in 0..steps {
            let next: Vec<Knot> = (0..steps - j).map(|i| self.knot(at(i, j + 1))).collect();
            for i in 0..steps - j {
                let mut pieces = vec![[row[i], row[i + 1], next[i]]];
                if i + 1 < next.len() {
                    pieces.push([row[i + 1], next[i + 1], next[i]]);
                }
                for piece in pieces {
                    let middle = (piece[0].at + piece[1].at + piece[2].at) / 3.0;
                    let flux = share.next(self.colour(middle));
                    self.settle(piece, flux, DEEPEST_CUT);
                }
            }
            row = next;
        }
    }

    /// Mean colour of the patch.
    fn total_colour(&self) -> LinearSrgb {
        self.colours
            .iter()
            .fold(LinearSrgb::BLACK, |sum, colour| sum + *colour)
            * (self.colours.len() as f64).recip()
    }

    /// Gives a triangle's flux to where its rays go.
    fn settle(&mut self, knots: [Knot; 3], flux: FluxCount, cuts_left: u32) {
        if flux == [0; 3] {
            return;
        }
        let places = knots.map(|knot| knot.vertex.place);
        if places[0].is_same(&places[1]) && places[0].is_same(&places[2]) {
            return self.place(&knots, flux);
        }
        if cuts_left == 0 {
            // A corner where many surfaces meet, some thousandth of a patch wide: all of it goes where its first ray
            // goes.
            return self.place(&[knots[0]; 3], flux);
        }
        let lone = (0..3)
            .find(|&i| places[(i + 1) % 3].is_same(&places[(i + 2) % 3]))
            .unwrap_or(0);
        let [apex, left, right] = [knots[lone], knots[(lone + 1) % 3], knots[(lone + 2) % 3]];
        let (t1, near1, far1) = self.bracket(apex, left);
        let (t2, near2, far2) = self.bracket(apex, right);
        let parts = [t1 * t2, 1.0 - t1];
        let first = scaled(flux, LinearSrgb::grey(parts[0]));
        let second = scaled(
            difference(flux, first),
            LinearSrgb::grey(parts[1] / (1.0 - parts[0]).max(f64::MIN_POSITIVE)),
        );
        let third = difference(difference(flux, first), second);
        self.settle([apex, near1, near2], first, cuts_left - 1);
        self.settle([far1, left, right], second, cuts_left - 1);
        self.settle([far1, right, far2], third, cuts_left - 1);
    }

    /// Where between two knots the rays stop going where the first goes: the place between them [0, 1], the last knot
    /// on the first's side, and the first on the other.
    fn bracket(&mut self, from: Knot, to: Knot) -> (f64, Knot, Knot) {
        let (mut low, mut high) = (0.0, 1.0);
        let (mut near, mut far) = (from, to);
        for _ in 0..CUT_STEPS {
            let middle = 0.5 * (low + high);
            let knot = self.knot(from.at.lerp(to.at, middle));
            if knot.vertex.place.is_same(&from.vertex.place) {
                (low, near) = (middle, knot);
            } else {
                (high, far) = (middle, knot);
            }
        }
        (0.5 * (low + high), near, far)
    }

    /// All three rays go to the same surface, or nowhere.
    fn place(&mut self, knots: &[Knot; 3], flux: FluxCount) {
        let mut arrived = flux;
        if self.absorption {
            let left = knots
                .iter()
                .fold(LinearSrgb::BLACK, |sum, knot| sum + knot.vertex.transmittance)
                * (1.0 / 3.0);
            arrived = scaled(flux, left);
            self.out.ledger.book(Account::Absorbed, difference(flux, arrived));
        }
        match knots[0].vertex.place {
            Place::Nowhere if self.goes_out => self.out.ledger.book(Account::Escaped, arrived),
            // No traced ray of the patch left the scene: a ray that was continued too far did.
            Place::Nowhere => self.out.ledger.book(Account::Unresolved, arrived),
            Place::Onward => self.out.ledger.book(Account::Quadrature, arrived),
            Place::Refused => self.out.ledger.book(Account::Unresolved, arrived),
            Place::On { object, island, .. } => {
                let share = knots.iter().map(|knot| knot.vertex.deposit).sum::<f64>() / 3.0;
                let deposit = if share < 1.0 {
                    scaled(arrived, LinearSrgb::grey(share))
                } else {
                    arrived
                };
                self.out
                    .ledger
                    .book(Account::Quadrature, difference(arrived, deposit));
                let triangle = FluxTriangle {
                    corners: knots.map(|knot| knot.vertex.place.texel()),
                    flux: deposit,
                    island,
                };
                self.out.list(object).push(triangle);
            }
        }
    }
}

/// Hands out a count in parts whose sum is exact.
struct Shares {
    flux: FluxCount,
    given: FluxCount,
    /// Per channel: share of the whole so far.
    sum: [f64; 3],
    /// Per channel: share of the whole of a part of unit colour.
    scale: [f64; 3],
    left: usize,
    /// Whether all channels were alike so far.
    is_grey: bool,
}

impl Shares {
    /// For so many parts of equal area whose mean colour is known; the last part takes what rounding, and a mean that
    /// is not exact, leave.
    fn new(flux: FluxCount, parts: usize, mean: LinearSrgb) -> Self {
        let scale = mean.to_array().map(|mean| {
            if mean > 0.0 {
                1.0 / (mean * parts as f64)
            } else {
                0.0
            }
        });
        Self {
            flux,
            given: [0; 3],
            sum: [0.0; 3],
            scale,
            left: parts,
            is_grey: flux[0] == flux[1] && flux[1] == flux[2] && scale[0] == scale[1] && scale[1] == scale[2],
        }
    }

    fn next(&mut self, colour: LinearSrgb) -> FluxCount {
        self.left -= 1;
        let colour = colour.to_array();
        let is_grey = self.is_grey && colour[0] == colour[1] && colour[1] == colour[2];
        if is_grey {
            return [self.next_of(0, colour[0]); 3];
        }
        // Greys are summed in the first channel alone.
        if self.is_grey {
            self.is_grey = false;
            self.sum = [self.sum[0]; 3];
            self.given = [self.given[0]; 3];
        }
        std::array::from_fn(|channel| self.next_of(channel, colour[channel]))
    }

    fn next_of(&mut self, channel: usize, colour: f64) -> i64 {
        self.sum[channel] += colour * self.scale[channel];
        let upto = if self.left == 0 {
            self.flux[channel]
        } else {
            // Cumulative: no rounding adds up. Not negative, so that cutting rounds down.
            ((self.flux[channel] as f64 * self.sum[channel].min(1.0) + 0.5) as i64).min(self.flux[channel])
        };
        let part = upto - self.given[channel];
        self.given[channel] = upto;
        part
    }
}
