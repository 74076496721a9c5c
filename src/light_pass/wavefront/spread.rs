//! Spreads a patch over the surfaces it lights: interpolated rays hit the receivers, and the triangles between them
//! carry the patch's flux.

use glam::DVec2;

use super::band::{SampleId, Samples};
use super::cell::{Patch, PatchKind, SpectralTag};
use super::coverage::FluxTriangle;
use super::lattice_ray::{PathSegment, SegmentEnd};
use super::mesh::{PatchMesh, even_grid};
use super::overshoot::PatchOvershoot;
use super::patch::{CoonsPatch, PatchShape};
use super::receivers::{PatchBeam, Receivers};
use super::shares::{difference, mean, scaled};
use super::spectrum::{LightPart, LightSpectrum, NODES, lands_alike};
use super::virtual_vertex::VirtualRays;
use crate::illumination::Receiver;
use crate::illumination::accumulator::{FluxCount, FluxUnit};
use crate::light_pass::footprint_statistics::FootprintStatistics;
use crate::light_pass::ledger_sum::{Account, LedgerSum};
use crate::optics::{ColourMatrix, LinearSrgb};

/// Fewest slices of the brightest light per texel over which its wavelengths spread: beams may be thinner than texels.
/// Dim light has fewer.
const SLICES_PER_TEXEL: f64 = 4.0;

/// Spread of wavelengths of which some leave the scene [texels].
const FAR_TEXELS: f64 = 32.0;

#[derive(Clone, Copy, Debug)]
pub struct Spreader<'a> {
    pub receivers: &'a Receivers<'a>,
    /// Face of the launch domain.
    pub face: u32,
    /// Samples that the patches refer to.
    pub samples: &'a Samples,
    /// Unit of the flux counts.
    pub unit: FluxUnit,
    /// Whether bodies absorb light along the way.
    pub absorption: bool,
    /// Flux that all lights send to specular surfaces [W, luminance]: over a map, roughly its mean irradiance.
    pub reference_w: f64,
    /// Coarseness of triangles relative to the usual one: above 1 is coarser.
    pub coarseness: f64,
    /// Whether positions of footprints are recorded.
    pub gathers: bool,
    pub light: LightPart<'a>,
}

/// Result of spreading patches.
#[derive(Clone, Debug, Default)]
pub struct SpreadOutput {
    /// Triangles on each receiver's map.
    pub triangles: Vec<(Receiver, Vec<FluxTriangle>)>,
    /// Escaped, absorbed on the way, passed on.
    pub ledger: LedgerSum,
    /// Interpolated rays that were intersected with receivers.
    pub queries: u64,
    /// Sizes of lit areas.
    pub statistics: FootprintStatistics,
    /// Patches that reach farther than their traced rays.
    pub overshoots: Vec<PatchOvershoot>,
}

impl SpreadOutput {
    /// Number of triangles on all maps.
    pub fn triangle_count(&self) -> usize {
        self.triangles.iter().map(|(_, list)| list.len()).sum()
    }

    pub(super) fn list(&mut self, receiver: Receiver) -> &mut Vec<FluxTriangle> {
        // A handful of receivers, most often the last one.
        match self.triangles.iter().rposition(|(of, _)| *of == receiver) {
            Some(index) => &mut self.triangles[index].1,
            None => {
                self.triangles.push((receiver, Vec::new()));
                let last = self.triangles.len() - 1;
                &mut self.triangles[last].1
            }
        }
    }
}

/// Colour transform of a patch, by the part of the spectrum that it carries.
#[derive(Clone, Copy)]
struct PatchColour {
    /// From the flux of segments to the light's channels.
    channels: ColourMatrix,
    /// From RGB factors to the light's channels.
    factors: ColourMatrix,
    /// Whether it is for a wavelength instead of RGB.
    is_spectral: bool,
    /// Whether all samples that it combines land on one surface.
    lands_alike: bool,
}

impl PatchColour {
    const WHITE: Self = Self {
        channels: ColourMatrix::IDENTITY,
        factors: ColourMatrix::IDENTITY,
        is_spectral: false,
        lands_alike: true,
    };

    /// For a band of which one wavelength is traced.
    fn of_node(channels: ColourMatrix, segments: &[&PathSegment]) -> Self {
        let grey_w = mean(segments.iter().map(|segment| segment.flux_w));
        Self {
            channels,
            factors: channels.weighing(grey_w).per_channel(),
            is_spectral: true,
            lands_alike: true,
        }
    }
}

/// Where a whole patch goes, judged by its traced corners.
enum PatchFate {
    /// On to other specular surfaces.
    Onward,
    /// Out of the scene.
    Escapes,
    /// Onto one plane, or past its border.
    Plane(Receiver),
    /// The interpolated rays have to be intersected with the scene.
    Mixed,
}

impl Spreader<'_> {
    pub fn spread(&self, patch: &Patch, out: &mut SpreadOutput) {
        let segments: [&PathSegment; 4] = patch
            .corners
            .map(|(sample, segment)| self.samples.segment(sample, segment));
        let own = &segments[..patch.corner_count()];
        match (patch.tone, self.light) {
            (SpectralTag::Spectrum { others, parted }, LightPart::Spectrum(spectrum)) => {
                self.spread_spectrum(patch, segments, (others, parted), spectrum, out);
            }
            (SpectralTag::Node(node), light) => {
                let node = light.node(usize::from(node));
                let tint = node.map_or(PatchColour::WHITE, |node| {
                    PatchColour::of_node(node.channels, own)
                });
                self.spread_segments(patch, own, tint, out);
            }
            (SpectralTag::White | SpectralTag::Spectrum { .. }, _) => {
                self.spread_segments(patch, own, PatchColour::WHITE, out)
            }
        }
    }

    /// Spreads a patch slice by slice of the spectrum.
    fn spread_spectrum(
        &self,
        patch: &Patch,
        first: [&PathSegment; 4],
        (others, parted): ([[SampleId; 4]; NODES - 1], bool),
        spectrum: &LightSpectrum,
        out: &mut SpreadOutput,
    ) {
        let nodes: [[&PathSegment; NODES]; 4] = std::array::from_fn(|corner| {
            let first = first[corner];
            std::array::from_fn(|node| match node.checked_sub(1) {
                None => first,
                Some(other) => {
                    let sample = self.samples.get(others[other][corner]);
                    let segment = sample.find(first.signature);
                    &sample.segments[segment.expect("the patch has it at all wavelengths")]
                }
            })
        });
        let lands_alike = nodes.iter().all(|nodes| lands_alike(*nodes));
        let brightest_w = self.samples.get(patch.corners[0].0).brightest_w;
        let share = (first[0].flux_w.luminance() / brightest_w).clamp(0.0, 1.0);
        let apart = self.smear(&nodes) * SLICES_PER_TEXEL * share;
        for slice in spectrum.slices(apart) {
            let segments = nodes.map(|nodes| slice.segment(nodes, parted));
            let segments = segments.each_ref();
            let tint = PatchColour {
                channels: ColourMatrix::IDENTITY,
                factors: slice.factors(nodes[0], parted),
                is_spectral: true,
                lands_alike,
            };
            self.spread_segments(patch, &segments[..patch.corner_count()], tint, out);
        }
    }

    /// Distance between the landing points of a patch's outer wavelengths [texels].
    fn smear(&self, nodes: &[[&PathSegment; NODES]; 4]) -> f64 {
        let of_corner = |nodes: &[&PathSegment; NODES]| {
            let texel_m = nodes.iter().find_map(|segment| {
                let surface = self.receivers.get(segment.landing.receiver()?)?;
                let texels = (surface.chart.width * surface.chart.height) as f64;
                Some((surface.area_m2 / texels).sqrt())
            });
            let ends = [nodes[1], nodes[2]].map(PathSegment::landing_point);
            match (texel_m, ends) {
                (Some(texel_m), [Some(a), Some(b)]) => a.distance(b) / texel_m,
                // Some leave, some land: past the horizon of the lit surface.
                (Some(_), _) => FAR_TEXELS,
                (None, _) => 0.0,
            }
        };
        nodes.iter().map(of_corner).fold(0.0, f64::max)
    }

    fn spread_segments(
        &self,
        patch: &Patch,
        segments: &[&PathSegment],
        tint: PatchColour,
        out: &mut SpreadOutput,
    ) {
        let colours = segments
            .iter()
            .map(|segment| tint.channels.apply(segment.flux_w))
            .collect::<Vec<_>>();
        let channels_w = mean(colours.iter().copied()) * patch.area();
        let flux = self.unit.count(channels_w);
        let flux_w = if tint.is_spectral {
            // Y of CIE XYZ: as bright as it looks.
            LinearSrgb::grey(channels_w.g)
        } else {
            channels_w
        };
        out.ledger.book(Account::Quadrature, flux.map(|count| -count));
        let before: Vec<usize> = out.triangles.iter().map(|(_, list)| list.len()).collect();
        let course = if tint.lands_alike {
            self.course(segments)
        } else {
            PatchFate::Mixed
        };
        match course {
            PatchFate::Escapes => out.ledger.book(Account::Escaped, flux),
            PatchFate::Onward => self.onward(segments, flux, tint, out),
            PatchFate::Plane(receiver) => {
                let light = (flux, flux_w, &colours[..]);
                self.over(patch, segments, light, tint, Some(receiver), out);
            }
            PatchFate::Mixed => self.over(patch, segments, (flux, flux_w, &colours), tint, None, out),
        }
        self.note_overshoot(patch, segments, &before, out);
    }

    /// Whether the light of a segment is absorbed on the way from the surface it left.
    pub(super) fn absorbs(&self, segment: &PathSegment) -> bool {
        self.absorption && segment.media.absorbs(self.receivers.tracer.scene())
    }

    /// Records the patch's triangles, those beyond the given counts, if they lie far from its traced rays.
    fn note_overshoot(
        &self,
        patch: &Patch,
        segments: &[&PathSegment],
        before: &[usize],
        out: &mut SpreadOutput,
    ) {
        let squares = &patch.squares[..patch.corner_count().max(3)];
        let middle = squares.iter().sum::<DVec2>() / squares.len() as f64;
        for (index, (receiver, list)) in out.triangles.iter().enumerate() {
            let new = &list[before.get(index).copied().unwrap_or(0)..];
            let traced = segments.iter().filter_map(|segment| match segment.landing {
                SegmentEnd::Receiver {
                    receiver: lit,
                    triangle,
                    barycentric,
                    ..
                } if lit == *receiver => Some(self.receivers.get(lit)?.texel(triangle, barycentric)),
                _ => None,
            });
            let found = PatchOvershoot::of(self.face, middle, *receiver, new, traced);
            out.overshoots.extend(found);
        }
    }

    fn course(&self, segments: &[&PathSegment]) -> PatchFate {
        let landing =
            |wanted: fn(&SegmentEnd) -> bool| segments.iter().all(|segment| wanted(&segment.landing));
        if landing(|landing| matches!(landing, SegmentEnd::Specular { .. })) {
            return PatchFate::Onward;
        }
        let receiver = segments.iter().find_map(|segment| segment.landing.receiver());
        let beam = self.beam(segments);
        let from = segments[0].from;
        let Some(receiver) = receiver else {
            let escapes = landing(|landing| matches!(landing, SegmentEnd::Escaped))
                && !self.receivers.meets_others(&beam, [from; 2]);
            return if escapes {
                PatchFate::Escapes
            } else {
                PatchFate::Mixed
            };
        };
        let Some(surface) = self.receivers.get(receiver) else {
            return PatchFate::Mixed;
        };
        let Some(plane) = surface.plane.filter(|_| surface.is_diffuse) else {
            return PatchFate::Mixed;
        };
        let only = segments.iter().all(|segment| {
            matches!(segment.landing, SegmentEnd::Escaped) || segment.landing.receiver() == Some(receiver)
        });
        if only
            && (plane.fills_map || !goes_out(segments))
            && !self
                .receivers
                .meets_others(&beam, [from, receiver.object() as u32])
        {
            PatchFate::Plane(receiver)
        } else {
            PatchFate::Mixed
        }
    }

    /// The traced rays from their origins to where they land or leave the scene.
    fn beam(&self, segments: &[&PathSegment]) -> PatchBeam {
        PatchBeam::new(segments.iter().map(|segment| {
            let end = segment.landing_point();
            [
                segment.ray.origin,
                end.unwrap_or_else(|| self.receivers.exit_point(&segment.ray)),
            ]
        }))
    }

    /// Passes all of it on, except for absorption.
    fn onward(&self, segments: &[&PathSegment], flux: FluxCount, tint: PatchColour, out: &mut SpreadOutput) {
        let mut passed = flux;
        if self.absorbs(segments[0]) {
            let scene = self.receivers.tracer.scene();
            let transmittance =
                |segment: &&PathSegment| segment.media.transmittance(scene, segment.landing.distance_m());
            let left = tint.factors.apply(mean(segments.iter().map(transmittance)));
            passed = scaled(flux, left);
            out.ledger.book(Account::Absorbed, difference(flux, passed));
        }
        out.ledger.book(Account::Quadrature, passed);
    }

    fn over(
        &self,
        patch: &Patch,
        segments: &[&PathSegment],
        (flux, flux_w, colours): (FluxCount, LinearSrgb, &[LinearSrgb]),
        tint: PatchColour,
        plane: Option<Receiver>,
        out: &mut SpreadOutput,
    ) {
        let shape = shape_of(patch, segments);
        // Light past the border of a plane may escape only where traced light does.
        let goes_out = goes_out(segments);
        let plane = plane.filter(|&receiver| goes_out || self.stays_on_map(&shape, receiver));
        let mut rays = VirtualRays::new(self, &shape, segments, plane, tint.factors);
        let steps = self.steps(&shape, &mut rays, plane.is_some(), flux_w, out);
        if let (PatchShape::Coons(coons), Some(receiver)) = (&shape, plane)
            && !self.absorbs(segments[0])
            && let Some(grid) = self.plane_grid(coons, receiver, steps)
        {
            out.queries += rays.queries + grid.len() as u64;
            return even_grid(receiver, &grid, steps, colours, flux, out);
        }
        let mut mesh = PatchMesh {
            receivers: self.receivers,
            shape: &shape,
            rays,
            colours,
            out,
            absorbs: self.absorbs(segments[0]),
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

    /// Texel coordinates of a grid of rays, row by row; `None` unless all of them hit the plane.
    fn plane_grid(
        &self,
        coons: &CoonsPatch,
        receiver: Receiver,
        steps: (usize, usize),
    ) -> Option<Vec<DVec2>> {
        let plane = self.receivers.get(receiver)?.plane?;
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
}

/// Whether any traced ray leaves the scene.
fn goes_out(segments: &[&PathSegment]) -> bool {
    segments
        .iter()
        .any(|segment| matches!(segment.landing, SegmentEnd::Escaped))
}

fn shape_of(patch: &Patch, segments: &[&PathSegment]) -> PatchShape {
    let step = patch.squares[2] - patch.squares[0];
    match (patch.kind, segments) {
        (PatchKind::Rectangle, [a, b, c, d]) => PatchShape::coons([a, b, c, d], step),
        (PatchKind::BilinearRectangle, [a, b, c, d]) => PatchShape::bilinear([a, b, c, d]),
        (PatchKind::LinearTriangle, [a, b, c]) => PatchShape::linear([a, b, c]),
        (PatchKind::Triangle, [a, b, c]) => {
            let [p, q, r, _] = patch.squares;
            PatchShape::bezier([a, b, c], [p, q, r])
        }
        _ => {
            let [at, low, high, _] = patch.squares;
            PatchShape::around(segments[0], low - at, high - low)
        }
    }
}
