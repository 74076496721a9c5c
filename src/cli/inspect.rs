//! `inspect`: what is in a scene, which effects it calls for, and what a bake would take.

use std::fmt::Write as _;

use serde::Serialize;

use super::bake::{self, Clock};
use super::job::InspectJob;
use super::terminal::Interrupt;
use super::terminal::Terminal;
use nephroid::effect::Effect;
use nephroid::error::{Result, Warning};
use nephroid::illumination::parametrisation::refused_sets;
use nephroid::illumination::{Side, UvSet};
use nephroid::light_pass::emitter::Emitter;
use nephroid::optics::spectrum::Spectrum;
use nephroid::optics::spectrum::temperature::correlated_temperature;
use nephroid::optics::wavelength::VISIBLE;
use nephroid::optics::{Glass, Metal};
use nephroid::plan::{self, EffectLine, EffectPlan};
use nephroid::scene::{Camera, Light, LightKind, LightSize, Scene, SurfaceKind};
use nephroid::session::{BakeCounts, BakeSession, CostPoint, Forecast, ItemBufferReport, Survey};
use nephroid::settings::Preset;

/// The result, as `--json` prints it.
#[derive(Debug, Serialize)]
struct Report {
    scene: String,
    name: String,
    /// Smallest box [m]; `None` without surfaces.
    bounds_m: Option<[[f64; 3]; 2]>,
    triangles: usize,
    objects: Vec<ObjectReport>,
    materials: Vec<MaterialReport>,
    lights: Vec<LightReport>,
    cameras: Vec<String>,
    plan: EffectPlan,
    /// Upper bound of the light rays of the caustic layer's lattice at these settings.
    estimated_rays: u64,
    /// Maps, what each preset is expected to take, and what a pilot took.
    #[serde(flatten)]
    survey: SurveyReport,
    warnings: Vec<Warning>,
}

#[derive(Debug, Serialize)]
struct ObjectReport {
    name: String,
    node: usize,
    primitive: usize,
    triangles: usize,
    area_m2: f64,
    material: String,
    surface: &'static str,
}

#[derive(Debug, Serialize)]
struct MaterialReport {
    name: String,
    surface: &'static str,
    objects: usize,
    ior: Option<f64>,
    glass: Option<GlassReport>,
    /// Of a table by wavelength.
    metal: Option<&'static str>,
}

#[derive(Debug, Serialize)]
struct LightReport {
    name: String,
    kind: &'static str,
    /// Luminous-equivalent; `None` for what is infinitely far.
    power_w: Option<f64>,
    /// Luminous-equivalent, across the beam of a sun; `None` for the others.
    normal_irradiance_w_per_m2: Option<f64>,
    /// Luminous-equivalent radiance over all directions, of an environment; `None` for the others.
    spherical_irradiance_w_per_m2: Option<f64>,
    /// Of a point light or a spot that has one.
    radius_m: Option<f64>,
    /// Of a sun that has one.
    angular_diameter_deg: Option<f64>,
    /// Of what glows, all its glowing sides.
    area_m2: Option<f64>,
    /// Of a lamp that has one.
    spectrum: Option<SpectrumReport>,
}

/// Width over height of the picture that eye-pass effects are told for.
const PICTURE_ASPECT: f64 = 16.0 / 9.0;

/// Loads, plans, bakes a pilot, and prints.
///
/// # Errors
/// A scene that cannot be read, settings that do not fit it.
pub fn run(job: &InspectJob, terminal: &Terminal, interrupt: &Interrupt) -> Result<()> {
    let loaded = bake::load(&job.scene, &Clock::start(), terminal)?;
    let scene = &loaded.scene;
    let survey = BakeSession::new(scene.clone())?.survey(&job.settings, interrupt.control())?;
    let camera = scene.cameras.first().map(|camera| (camera, PICTURE_ASPECT));
    let chains = plan::chains(scene, camera, job.settings.effects.get(Effect::Chains));
    let report = Report::new(scene, &survey, camera, chains);
    terminal.print_result(&text(&report), &report)
}

impl Report {
    fn new(scene: &Scene, survey: &Survey, camera: Option<(&Camera, f64)>, chains: EffectLine) -> Self {
        let mut plan = survey.estimate.plan.clone();
        for line in &mut plan.effects {
            if line.effect == Effect::Dispersion {
                *line = plan::dispersion(line.clone(), scene, camera, &chains);
            }
        }
        plan.effects.push(chains);
        Self {
            scene: scene.source.clone(),
            name: scene.name.clone(),
            bounds_m: scene
                .bounds()
                .map(|(low, high)| [low.to_array(), high.to_array()]),
            triangles: scene.triangle_count(),
            objects: (0..scene.objects.len())
                .map(|object| object_report(scene, object))
                .collect(),
            materials: material_reports(scene),
            lights: scene
                .lights
                .iter()
                .map(|light| light_report(light, scene))
                .collect(),
            cameras: scene.cameras.iter().map(|camera| camera.name.clone()).collect(),
            plan,
            estimated_rays: survey.estimate.rays,
            survey: SurveyReport::new(scene, survey),
            warnings: scene.warnings.clone(),
        }
    }
}

fn object_report(scene: &Scene, index: usize) -> ObjectReport {
    let object = &scene.objects[index];
    let material = scene.material_of(index);
    ObjectReport {
        name: object.name.clone(),
        node: object.node,
        primitive: object.primitive,
        triangles: object.mesh_in_scene().triangles.len(),
        area_m2: object.mesh_in_scene().area_m2(),
        material: material.name.clone(),
        surface: surface_name(material.surface),
    }
}

/// Materials that some object has.
fn material_reports(scene: &Scene) -> Vec<MaterialReport> {
    scene
        .materials
        .iter()
        .enumerate()
        .map(|(index, material)| MaterialReport {
            name: material.name.clone(),
            surface: surface_name(material.surface),
            objects: scene
                .objects
                .iter()
                .filter(|object| object.material == index)
                .count(),
            ior: matches!(
                material.surface,
                SurfaceKind::Dielectric | SurfaceKind::ThinWall | SurfaceKind::Mixed
            )
            .then_some(material.ior),
            glass: material.glass.as_deref().map(GlassReport::new),
            metal: material.metal.map(Metal::name),
        })
        .filter(|report| report.objects > 0)
        .collect()
}

fn light_report(light: &Light, scene: &Scene) -> LightReport {
    let strength = light.strength().luminance();
    let beam_w = strength * full_beam_sr(&light.kind);
    // A facet's intensity on its axis is L·A: the whole lamp sends πLA.
    let glowing = || Emitter::middle(light, scene).map(|middle| middle.strength.luminance());
    let mut report = LightReport {
        name: light.name.clone(),
        kind: "point",
        power_w: None,
        normal_irradiance_w_per_m2: None,
        spherical_irradiance_w_per_m2: None,
        radius_m: None,
        angular_diameter_deg: None,
        area_m2: None,
        spectrum: light.spectrum.as_deref().map(SpectrumReport::new),
    };
    match light.kind {
        LightKind::Point { .. } => report.power_w = Some(beam_w),
        LightKind::Spot { .. } => (report.kind, report.power_w) = ("spot", Some(beam_w)),
        LightKind::Sun { .. } => {
            (report.kind, report.normal_irradiance_w_per_m2) = ("sun", Some(strength));
        }
        LightKind::Panel { .. } | LightKind::Surface { .. } => {
            let is_panel = matches!(light.kind, LightKind::Panel { .. });
            report.kind = if is_panel { "panel" } else { "surface" };
            report.power_w = glowing().map(|axial| axial * std::f64::consts::PI);
            report.area_m2 = glowing().map(|axial| axial / strength);
        }
        LightKind::Environment { .. } => {
            report.kind = "environment";
            let environment = scene.environment.as_ref();
            report.spherical_irradiance_w_per_m2 =
                environment.map(|environment| environment.total_w_per_m2() * strength);
        }
    }
    match light.size {
        LightSize::None => {}
        LightSize::Radius { radius_m } => report.radius_m = Some(radius_m),
        LightSize::Angle { diameter_rad } => report.angular_diameter_deg = Some(diameter_rad.to_degrees()),
    }
    report
}

impl LightReport {
    /// Kind, size and strength with their units.
    fn line(&self) -> String {
        let parts = [
            (self.radius_m, "m radius"),
            (self.angular_diameter_deg, "degrees across"),
            (self.area_m2, "m^2"),
            (self.power_w, "W"),
            (self.normal_irradiance_w_per_m2, "W/m^2"),
            (self.spherical_irradiance_w_per_m2, "W/m^2 from all around"),
        ];
        let stated = parts
            .iter()
            .filter_map(|(value, unit)| value.map(|value| format!(", {value:.4} {unit}")));
        let spectrum = self
            .spectrum
            .as_ref()
            .map(|spectrum| format!(", {}", spectrum.line()));
        let stated: String = stated.chain(spectrum).collect();
        format!("{}: {}{stated}", self.name, self.kind)
    }
}

/// Integral of the fall-off over all directions [sr]: that of a linear ramp's square in the cosine is a third.
fn full_beam_sr(light: &LightKind) -> f64 {
    let cap = match *light {
        LightKind::Spot {
            inner_cone_rad,
            outer_cone_rad,
            ..
        } => {
            let (cos_inner, cos_outer) = (inner_cone_rad.cos(), outer_cone_rad.cos());
            (1.0 - cos_inner) + (cos_inner - cos_outer) / 3.0
        }
        _ => 2.0,
    };
    std::f64::consts::TAU * cap
}

fn surface_name(surface: SurfaceKind) -> &'static str {
    match surface {
        SurfaceKind::Diffuse => "diffuse",
        SurfaceKind::Mirror => "mirror",
        SurfaceKind::Dielectric => "dielectric",
        SurfaceKind::ThinWall => "thin wall",
        SurfaceKind::Mixed => "mixed",
    }
}

fn text(report: &Report) -> String {
    let mut text = String::new();
    let mut line = |name: &str, value: String| {
        let _ = writeln!(text, "{name:<9} {value}");
    };
    line("scene", report.scene.clone());
    if let Some([low, high]) = report.bounds_m {
        line(
            "size",
            format!(
                "{:.4} x {:.4} x {:.4} m, {} triangles",
                high[0] - low[0],
                high[1] - low[1],
                high[2] - low[2],
                report.triangles
            ),
        );
    }
    for object in &report.objects {
        line(
            "object",
            format!(
                "{}: {} triangles, {:.4} m^2, {} ({})",
                object.name, object.triangles, object.area_m2, object.material, object.surface
            ),
        );
    }
    for material in &report.materials {
        let made_of = [
            material.ior.map(|ior| format!(", ior {ior:.4}")),
            material.glass.as_ref().map(|glass| format!(", {}", glass.line())),
            material.metal.map(|metal| format!(", {metal} by wavelength")),
        ];
        let made_of: String = made_of.into_iter().flatten().collect();
        line(
            "material",
            format!("{}: {}{made_of}", material.name, material.surface),
        );
    }
    for light in &report.lights {
        line("light", light.line());
    }
    for camera in &report.cameras {
        line("camera", camera.clone());
    }
    for light in &report.plan.lights {
        let switch = if light.on { "on" } else { "off" };
        line(
            "rays from",
            format!("{}: {switch}, {}", light.light, light.reason),
        );
    }
    for effect in &report.plan.effects {
        let switch = if effect.on { "on" } else { "off" };
        line(
            "effect",
            format!("{}: {switch}, {}", effect.effect.name(), effect.reason),
        );
    }
    for (name, value) in report.survey.lines() {
        line(name, value);
    }
    text
}

/// A glass, as `--json` prints it.
#[derive(Debug, Serialize)]
pub struct GlassReport {
    name: String,
    n_d: f64,
    /// `None` where there is no dispersion.
    abbe_number: Option<f64>,
    /// What its formula was fitted to; `None` where nobody said.
    range_nm: Option<[f64; 2]>,
    /// Whether that is all that the eye sees.
    covers_the_visible: bool,
}

/// The spectrum of a lamp, as `--json` prints it.
#[derive(Debug, Serialize)]
pub struct SpectrumReport {
    /// Of an illuminant or a file; `None` where it has none.
    name: Option<String>,
    /// Of the nearest black body; `None` where none is near.
    correlated_temperature_k: Option<f64>,
    /// Luminous flux by radiant flux between 360 and 830 nm.
    lumens_per_watt: f64,
    /// First and last wavelength of its table.
    range_nm: [f64; 2],
}

impl GlassReport {
    /// Of a material's glass.
    pub fn new(glass: &Glass) -> Self {
        let range = glass.range.as_ref();
        let abbe_number = glass.dispersion.abbe_number();
        Self {
            name: glass.name.clone(),
            n_d: glass.dispersion.n_d(),
            abbe_number: abbe_number.is_finite().then_some(abbe_number),
            range_nm: range.map(|range| [range.start().0, range.end().0]),
            covers_the_visible: glass.is_within(*VISIBLE.start()) && glass.is_within(*VISIBLE.end()),
        }
    }

    /// "N-SF11 (V_d 25.8, measured from 370 to 2500 nm)".
    pub fn line(&self) -> String {
        let mut notes = vec![match self.abbe_number {
            Some(abbe_number) => format!("V_d {abbe_number:.1}"),
            None => "no dispersion".into(),
        }];
        if let Some([first, last]) = self.range_nm.filter(|_| !self.covers_the_visible) {
            notes.push(format!("measured from {first:.0} to {last:.0} nm"));
        }
        format!("{} ({})", self.name, notes.join(", "))
    }
}

impl SpectrumReport {
    /// Of a lamp's spectrum.
    pub fn new(spectrum: &Spectrum) -> Self {
        let range = spectrum.range();
        Self {
            name: spectrum.name().map(str::to_owned),
            correlated_temperature_k: correlated_temperature(spectrum.xyz()).map(|nearest| nearest.kelvin),
            lumens_per_watt: spectrum.luminous_flux_lm() / spectrum.radiant(),
            range_nm: [range.start().0, range.end().0],
        }
    }

    /// "spectrum `D65` of 6504 K, 360 to 830 nm, 204 lm/W".
    pub fn line(&self) -> String {
        let name = (self.name.as_ref()).map_or_else(String::new, |name| format!(" `{name}`"));
        let colour = match self.correlated_temperature_k {
            Some(kelvin) => format!("of {kelvin:.0} K"),
            None => "far from any black body".into(),
        };
        let [first, last] = self.range_nm;
        format!(
            "spectrum{name} {colour}, {first:.0} to {last:.0} nm, {:.0} lm/W",
            self.lumens_per_watt
        )
    }
}

/// As `--json` prints it.
#[derive(Debug, Serialize)]
pub struct SurveyReport {
    /// Maps that light reaches.
    maps: Vec<MapReport>,
    /// What each preset is expected to take.
    presets: Vec<PresetReport>,
    /// What that was learnt from.
    pilot: PilotReport,
}

#[derive(Debug, Serialize)]
struct MapReport {
    surface: String,
    side: Side,
    uv_set: UvSet,
    /// Sets of the file that cannot serve, and why.
    refused_uv_sets: Vec<String>,
    width: usize,
    height: usize,
    /// While it is baked.
    bytes: u64,
}

#[derive(Debug, Serialize)]
struct PresetReport {
    preset: Preset,
    #[serde(flatten)]
    forecast: Option<Forecast>,
}

#[derive(Debug, Serialize)]
struct PilotReport {
    /// Of the whole survey, on the wall.
    seconds: f64,
    counts: BakeCounts,
    course: Vec<CostPoint>,
    item_buffers: Vec<ItemBufferReport>,
}

impl SurveyReport {
    /// Of a survey of a scene.
    pub fn new(scene: &Scene, survey: &Survey) -> Self {
        let maps = survey.pilot.maps.iter().map(|map| MapReport {
            surface: scene.objects[map.chart.object()].name.clone(),
            side: map.chart.receiver.side(),
            uv_set: map.chart.uv_set,
            refused_uv_sets: refused_sets(scene.objects[map.chart.object()].mesh_in_scene())
                .into_iter()
                .map(|(set, refusal)| format!("{set}: {refusal}"))
                .collect(),
            width: map.width(),
            height: map.height(),
            bytes: map.chart.texel_count() as u64 * nephroid::session::BYTES_PER_TEXEL,
        });
        Self {
            maps: maps.collect(),
            presets: survey
                .presets
                .iter()
                .map(|preset| PresetReport {
                    preset: preset.preset,
                    forecast: preset.forecast,
                })
                .collect(),
            pilot: PilotReport {
                seconds: survey.seconds,
                counts: survey.pilot.counts,
                course: survey.pilot.course.clone(),
                item_buffers: survey.pilot.item_buffers.clone(),
            },
        }
    }

    /// Name and value of each line of the text.
    pub fn lines(&self) -> Vec<(&'static str, String)> {
        let counts = &self.pilot.counts;
        let taken = format!(
            "{} light rays, {} shadow rays, {} gather rays",
            counts.rays, counts.shadow_rays, counts.gather_rays
        );
        let mut lines = vec![("pilot", taken)];
        for map in &self.maps {
            lines.push(("map", map_line(map)));
        }
        for preset in &self.presets {
            lines.push((preset.preset.name(), preset_line(preset.forecast.as_ref())));
        }
        lines
    }
}

/// "floor, front: 512 x 512, 4.2 MB, generated (TEXCOORD_0: it overlaps itself)".
fn map_line(map: &MapReport) -> String {
    let side = match map.side {
        Side::Front => "front",
        Side::Back => "back",
    };
    let set = match map.uv_set {
        UvSet::TexCoord0 => "TEXCOORD_0",
        UvSet::TexCoord1 => "TEXCOORD_1",
        UvSet::Generated => "generated",
    };
    let size = format!("{} x {}, {}", map.width, map.height, bytes(map.bytes));
    let mut text = format!("{}, {side}: {size}, {set}", map.surface);
    if !map.refused_uv_sets.is_empty() {
        text += &format!(" ({})", map.refused_uv_sets.join("; "));
    }
    text
}

fn preset_line(forecast: Option<&Forecast>) -> String {
    let Some(forecast) = forecast else {
        return "not known: the pilot found no error to go by".into();
    };
    let doubt = if forecast.factor > 1.0 {
        format!("within a factor of {:.1}", forecast.factor)
    } else {
        "as measured".into()
    };
    format!(
        "{:.1} % error: {} rays, {:.2} s of CPU, {}, {doubt}",
        100.0 * forecast.target,
        forecast.rays,
        forecast.cpu_s,
        bytes(forecast.bytes)
    )
}

/// A size with its unit.
pub fn bytes(count: u64) -> String {
    match count {
        0..1_000 => format!("{count} B"),
        1_000..1_000_000 => format!("{:.1} kB", count as f64 / 1e3),
        1_000_000..1_000_000_000 => format!("{:.1} MB", count as f64 / 1e6),
        _ => format!("{:.2} GB", count as f64 / 1e9),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nephroid::light_pass::emitter::spot_falloff;
    use nephroid::units::RadiantIntensity;

    #[test]
    fn beam_of_a_spot_is_the_integral_of_its_falloff() {
        let spot = LightKind::Spot {
            position: glam::DVec3::ZERO,
            direction: glam::DVec3::Z,
            intensity: RadiantIntensity(1.0),
            inner_cone_rad: 0.3,
            outer_cone_rad: 0.7,
        };
        let steps = 100_000;
        let width = 2.0 / f64::from(steps);
        // Slices of equal solid angle between the planes cosine = constant (Archimedes).
        let integral: f64 = (0..steps)
            .map(|step| -1.0 + (f64::from(step) + 0.5) * width)
            .map(|cosine| spot_falloff(cosine, 0.3, 0.7) * width * std::f64::consts::TAU)
            .sum();
        assert!(
            (integral / full_beam_sr(&spot) - 1.0).abs() < 1e-4,
            "{integral} sr"
        );
    }
}
