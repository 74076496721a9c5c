//! The light paths that reach a texel, with the flux of each: found by tracing the scene, without the baked maps.
//!
//! The part of a light's domain that lights the texel is found by dividing the domain into squares; its flux is the
//! flux of the texel. Connected squares on the same path form one [`LightPath`]. It is shown by the ray of these that
//! hits the requested point, found by Newton's method on the ray's start.

mod clip;
mod search;
mod target;
mod walk;

pub use target::Target;

use std::collections::{BTreeMap, HashMap};

use glam::{DMat2, DVec2, DVec3};

use self::search::{LitSquare, TexelSearch};
use self::walk::{LightPathWalker, WalkedPath};
use crate::geometry::DisjointSets;
use crate::geometry::sampling::even_point;
use crate::light_pass::direct::bake_direct;
use crate::light_pass::path::{PathSignature, PathVertex};
use crate::light_pass::photon::domain::DomainPoint;
use crate::light_pass::photon::launch::PhotonLaunch;
use crate::light_pass::visibility::{CullMode, LightVisibility, VisibleLight};
use crate::optics::LinearSrgb;
use crate::progress::Control;
use crate::scene::LightKind;
use crate::settings::ItemBufferKind;
use crate::transport::Tracer;

/// Sample points of an extended light.
const PLACES: u32 = 16;
const PLACES_SEED: u64 = 0;
/// Light that may be neglected, relative to the irradiance of the texel.
const NEGLIGIBLE: f64 = 1e-5;
/// Distance from the requested point at which a path counts as meeting it [m], and maximum number of Newton steps
/// towards that.
const MEETS_M: f64 = 1e-9;
const MAX_STEPS: u32 = 40;

/// A path on which light reaches a texel.
#[derive(Clone, Debug)]
pub struct LightPath {
    /// Index into `Scene::lights`.
    pub light: usize,
    /// Start [m]; for a sun, in front of the scene.
    pub start: DVec3,
    /// Empty for direct light.
    pub vertices: Vec<PathVertex>,
    /// End on the receiver [m].
    pub end: DVec3,
    /// Contribution to the mean irradiance of the texel [W/m²].
    pub irradiance: LinearSrgb,
}

/// The light of a texel, except for light from other matte surfaces.
#[derive(Clone, Debug, Default)]
pub struct Explanation {
    /// Brightest first.
    pub paths: Vec<LightPath>,
    /// Rays traced.
    pub rays: u64,
    /// False if cancelled, or if a search exceeded [`Limits::most_rays`].
    pub is_complete: bool,
}

impl Explanation {
    /// Irradiance from paths over specular surfaces [W/m²].
    pub fn caustic(&self) -> LinearSrgb {
        self.sum(|path| !path.vertices.is_empty())
    }

    /// Irradiance straight from the lights [W/m²].
    pub fn direct(&self) -> LinearSrgb {
        self.sum(|path| path.vertices.is_empty())
    }

    fn sum(&self, is_wanted: impl Fn(&LightPath) -> bool) -> LinearSrgb {
        let wanted = self.paths.iter().filter(|path| is_wanted(path));
        wanted.fold(LinearSrgb::BLACK, |sum, path| sum + path.irradiance)
    }
}

/// Limits of the search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Maximum number of specular surfaces on a path.
    pub max_depth: u32,
    /// Fraction of a ray's flux (luminance) below which a branch is not followed.
    pub branch_threshold: f64,
    /// Maximum number of rays for each sample point of a light.
    pub most_rays: u64,
}

/// Finds the paths that light a texel. `scale_w_m2` > 0: its approximate irradiance, or the least that matters [W/m²];
/// much fainter light is searched for less closely. Glass refracts all light as at 587.56 nm, and rough surfaces are
/// smooth.
pub fn explain(
    tracer: &Tracer,
    target: &Target,
    limits: Limits,
    scale_w_m2: f64,
    control: &Control,
) -> Explanation {
    // The launch domain of each light is searched for the squares whose caustic light reaches the texel.
    let visibility = LightVisibility::take(tracer, ItemBufferKind::Equal, CullMode::Reachable, true);
    let negligible_w = NEGLIGIBLE * scale_w_m2 * target.area_m2;
    let mut found = Explanation {
        is_complete: true,
        ..Explanation::default()
    };
    for visible_light in &visibility.lights {
        explain_light(
            tracer,
            visible_light,
            target,
            (limits, negligible_w),
            control,
            &mut found,
        );
    }

    // Direct light comes from the estimator of the direct layer, so that both agree.
    explain_direct(tracer, target, control, &mut found);
    let brightness = |path: &LightPath| path.irradiance.luminance();
    found
        .paths
        .sort_by(|a, b| brightness(b).total_cmp(&brightness(a)));
    found.is_complete &= !control.is_cancelled();
    found
}

fn explain_light(
    tracer: &Tracer,
    visible_light: &VisibleLight,
    target: &Target,
    (limits, negligible_w): (Limits, f64),
    control: &Control,
    found: &mut Explanation,
) {
    // A light with extent is searched from each of its sample points, which share its strength equally.
    let light = &tracer.scene().lights[visible_light.light];
    let source = light.of_unit_strength();
    let extended = light.has_extent().then_some(&source);
    let launch = PhotonLaunch::of(tracer, visible_light, extended, PLACES_SEED);
    let places = if light.has_extent() { PLACES } else { 1 };
    let strength = light.strength() * (1.0 / f64::from(places));

    // Squares connected on one path are one entry. Points of an extended light see nearly the same paths, which are
    // merged by signature.
    let mut by_way: BTreeMap<PathSignature, LightPath> = BTreeMap::new();
    for place in 0..places {
        let searcher = TexelSearch {
            walker: LightPathWalker {
                tracer,
                launch: &launch,
                lamp: even_point(place, 0, PLACES_SEED),
                target,
                limits,
            },
            negligible_w: negligible_w / strength.luminance().max(f64::MIN_POSITIVE),
            control,
        };
        let search = searcher.search();
        found.rays += search.rays;
        found.is_complete &= search.is_complete;
        for pieces in connected(search.pieces) {
            let way = pieces[0].way;
            let Some(mut path) = path_of(&searcher.walker, visible_light.light, &pieces) else {
                continue;
            };
            path.irradiance = path.irradiance * strength;
            if places == 1 {
                found.paths.push(path);
                continue;
            }
            // Shown from the first sample point of the light that has it.
            let irradiance = path.irradiance;
            by_way
                .entry(way)
                .and_modify(|same| same.irradiance += irradiance)
                .or_insert(path);
        }
    }
    found.paths.extend(by_way.into_values());
}

/// Groups of pieces that are connected by corners and lie on the same path.
fn connected(pieces: Vec<LitSquare>) -> Vec<Vec<LitSquare>> {
    let mut groups = DisjointSets::new(pieces.len());
    let mut owner: HashMap<(PathSignature, DomainPoint), usize> = HashMap::new();
    for (index, piece) in pieces.iter().enumerate() {
        for corner in piece.square.corners() {
            groups.join(index, *owner.entry((piece.way, corner)).or_insert(index));
        }
    }
    groups.grouped(pieces)
}

/// The path of some pieces, for a light of unit strength.
fn path_of(walker: &LightPathWalker<'_>, light: usize, pieces: &[LitSquare]) -> Option<LightPath> {
    let flux_w = pieces
        .iter()
        .fold(LinearSrgb::BLACK, |sum, piece| sum + piece.flux_w);
    let goal = walker.target.place;
    let distance = |piece: &&LitSquare| piece.place.distance_squared(goal);
    let nearest = pieces.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
    let way = meeting(walker, nearest)?;
    Some(LightPath {
        light,
        start: way.start.origin,
        vertices: way.vertices,
        end: way.end.point,
        irradiance: flux_w * (1.0 / walker.target.area_m2),
    })
}

/// The ray of a piece that hits the requested point; the nearest one if none does, as beyond the edge of a caustic.
fn meeting(walker: &LightPathWalker<'_>, piece: &LitSquare) -> Option<WalkedPath> {
    // Newton's method starts from the point of the piece that is known to light the texel.
    let goal = walker.target.place;
    let texel_m = walker.target.area_m2.sqrt();
    let way = |square: DVec2| walker.way(piece.point.root as usize, square, piece.way);
    let side = piece.square.area().sqrt();
    let mut square = piece.point.off_border();
    let mut best = way(square)?;
    let mut step = 1e-4 * side;

    // Finite differences give the derivative of where the ray lands. A neighbour that leaves the path ends the search.
    for _ in 0..MAX_STEPS {
        let miss = goal - best.place;
        if miss.length() * texel_m < MEETS_M {
            break;
        }
        let beside = |offset: DVec2| Some((way(square + offset)?.place - best.place) / step);
        let (Some(across), Some(down)) = (beside(DVec2::new(step, 0.0)), beside(DVec2::new(0.0, step)))
        else {
            break;
        };
        let slope = DMat2::from_cols(across, down);
        if slope.determinant() == 0.0 {
            break;
        }
        let mut move_by = slope.inverse() * miss;
        // Never far beyond the piece, and only to what lands nearer.
        move_by = move_by.clamp_length_max(2.0 * side);
        let better = (0..8).find_map(|halvings| {
            let to = square + move_by * (-f64::from(halvings)).exp2();
            let found = way(to)?;
            (found.place.distance(goal) < best.place.distance(goal)).then_some((to, found))
        });
        let Some((to, found)) = better else { break };

        // Differences shrink with the steps, for precision near the goal, but not so far that rounding dominates them.
        step = (0.1 * to.distance(square)).clamp(1e-7 * side, 1e-4 * side);
        (square, best) = (to, found);
    }
    Some(best)
}

/// Adds the direct light of each light, as the direct layer computes it.
fn explain_direct(tracer: &Tracer, target: &Target, control: &Control, found: &mut Explanation) {
    // The direct layer of each light alone, on a chart of this texel alone.
    let chart = target.chart_of_texel();
    let (low, high) = tracer.scene().bounds().unwrap_or_default();
    for (index, light) in tracer.scene().lights.iter().enumerate() {
        let baked = bake_direct(
            tracer,
            std::slice::from_ref(light),
            &[(&chart, None)],
            &(),
            control,
        );
        let irradiance = LinearSrgb::from(baked[0].irradiance[0].map(f64::from));
        found.rays += baked[0].shadow_rays;
        if irradiance.max_channel() <= 0.0 {
            continue;
        }

        // Parallel light has no start: its path is drawn from a point in front of the scene.
        let start = light.kind.position().or_else(|| {
            let LightKind::Sun { direction, .. } = light.kind else {
                return None;
            };
            Some(target.point - direction * (high - low).length())
        });
        found.paths.push(LightPath {
            light: index,
            // The sky has no position.
            start: start.unwrap_or(target.point),
            vertices: Vec::new(),
            end: target.point,
            irradiance,
        });
    }
}
