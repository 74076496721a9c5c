//! `inspect`: contents of a scene, the effects that it needs and why, and the expected cost of a bake.

use clap::Args;
use nephroid::bake::{BYTES_PER_TEXEL, Baker, Forecast, Survey};
use nephroid::effect::Effect;
use nephroid::error::Result;
use nephroid::illumination::IlluminationMap;
use nephroid::illumination::parametrisation::refused_sets;
use nephroid::light_pass::emitter::Emitter;
use nephroid::optics::spectrum::Spectrum;
use nephroid::optics::spectrum::temperature::correlated_temperature;
use nephroid::optics::wavelength::VISIBLE;
use nephroid::optics::{Glass, Metal};
use nephroid::plan::{self, EffectPlan};
use nephroid::scene::watertight;
use nephroid::scene::{Light, LightKind, LightSize, Material, Scene, SurfaceKind};
use nephroid::settings::LayerKind;
use serde_json::{Value, json};

use super::bake_options::BakeOptions;
use super::console::{Console, bytes, extend, in_lines};
use super::loaded::LoadedScene;
use super::options::{RunOptions, SceneOptions};

#[derive(Debug, Args)]
pub struct InspectArguments {
    /// .glb, .gltf or builtin:NAME
    scene: String,
    #[command(flatten)]
    scene_options: SceneOptions,
    #[command(flatten)]
    bake: BakeOptions,
    #[command(flatten)]
    pub run: RunOptions,
}

/// Aspect ratio of the picture for which eye-pass effects are listed.
const PICTURE_ASPECT: f64 = 16.0 / 9.0;

/// Name and value of each line of the text.
type Lines = Vec<(&'static str, String)>;

impl InspectArguments {
    /// Loads the scene, plans, bakes a pilot, and prints.
    ///
    /// # Errors
    /// Bad usage; a scene that cannot be read; settings that do not fit it.
    pub fn run(&self, console: &Console) -> Result<()> {
        let settings = self.bake.settings(&[LayerKind::Caustic], self.run.threads())?;
        let options = self.scene_options.load_options(true);
        let scene = &LoadedScene::load(&self.scene, &options, false, console)?.scene;
        let survey = Baker::new(scene.clone())?.survey(&settings, console.control())?;
        let camera = scene.cameras.first().map(|camera| (camera, PICTURE_ASPECT));
        let chains = plan::chains(scene, camera, settings.effects.get(Effect::Chains));
        let mut plan = survey.estimate.plan.clone();
        for line in &mut plan.effects {
            if line.effect == Effect::Dispersion {
                *line = plan::dispersion(line.clone(), scene, camera, &chains);
            }
        }
        plan.effects.push(chains);
        let (report, lines) = report(scene, &survey, &plan);
        console.print_result(&in_lines(&lines), &report)
    }
}

/// The result as JSON and as text.
fn report(scene: &Scene, survey: &Survey, plan: &EffectPlan) -> (Value, Lines) {
    let mut lines = vec![("scene", scene.source.clone())];

    // The extent in metres shows a scene that was modelled in another unit.
    let bounds = scene.bounds();
    if let Some((low, high)) = bounds {
        let [x, y, z] = (high - low).to_array();
        let triangles = scene.triangle_count();
        lines.push((
            "size",
            format!("{x:.4} x {y:.4} x {z:.4} m, {triangles} triangles"),
        ));
    }

    // What the scene is made of; each report also adds its lines of text.
    let objects: Vec<Value> = (0..scene.objects.len())
        .map(|object| object_report(scene, object, &mut lines))
        .collect();
    let bodies: Vec<Value> = (0..scene.objects.len())
        .filter(|&object| scene.body_of(object) == object && scene.material_of(object).is_solid())
        .map(|object| body_report(scene, object, &mut lines))
        .collect();

    // Materials that no object uses meet no light, and are left out.
    let in_use = |index: usize| {
        scene
            .objects
            .iter()
            .filter(|object| object.material == index)
            .count()
    };
    let materials = scene.materials.iter().enumerate();
    let materials: Vec<Value> = materials
        .filter(|(index, _)| in_use(*index) > 0)
        .map(|(index, material)| material_report(material, in_use(index), &mut lines))
        .collect();

    let lights: Vec<Value> = scene
        .lights
        .iter()
        .map(|light| light_report(light, scene, &mut lines))
        .collect();
    let cameras: Vec<&String> = scene.cameras.iter().map(|camera| &camera.name).collect();
    lines.extend(cameras.iter().map(|camera| ("camera", (*camera).clone())));

    // The plan, with the reason for each switch.
    let switch = |on: bool| if on { "on" } else { "off" };
    for light in &plan.lights {
        lines.push((
            "rays from",
            format!("{}: {}, {}", light.light, switch(light.on), light.reason),
        ));
    }
    for line in &plan.effects {
        lines.push((
            "effect",
            format!("{}: {}, {}", line.effect.name(), switch(line.on), line.reason),
        ));
    }

    // The pilot bake, and what it forecasts for each preset.
    let counts = &survey.pilot.counts;
    let taken = format!(
        "{} light rays, {} shadow rays, {} gather rays",
        counts.rays, counts.shadow_rays, counts.gather_rays
    );
    lines.push(("pilot", taken));
    let maps: Vec<Value> = survey
        .pilot
        .maps
        .iter()
        .map(|map| map_report(map, scene, &mut lines))
        .collect();
    let presets = survey.presets.iter().map(|known| {
        let forecast = known.forecast.as_ref();
        lines.push((known.preset.name(), preset_line(forecast)));
        let mut report = json!({"preset": known.preset});
        extend(&mut report, &forecast);
        report
    });
    let presets: Vec<Value> = presets.collect();

    // The document also holds the course of the pilot, to which the forecasts are fitted.
    let report = json!({
        "scene": scene.source,
        "name": scene.name,
        "bounds_m": bounds.map(|(low, high)| [low.to_array(), high.to_array()]),
        "triangles": scene.triangle_count(),
        "objects": objects,
        "bodies": bodies,
        "materials": materials,
        "lights": lights,
        "cameras": cameras,
        "plan": plan,
        // Upper bound of the light rays of the caustic layer's lattice at these settings.
        "estimated_rays": survey.estimate.rays,
        "maps": maps,
        // Forecast of each preset.
        "presets": presets,
        // What the forecasts are based on; wall-clock time is that of the whole survey.
        "pilot": {
            "seconds": survey.seconds,
            "counts": counts,
            "course": survey.pilot.course,
            "item_buffers": survey.pilot.item_buffers,
        },
        "warnings": scene.warnings,
    });
    (report, lines)
}

fn object_report(scene: &Scene, index: usize, lines: &mut Lines) -> Value {
    let (object, material) = (&scene.objects[index], scene.material_of(index));
    let (triangles, area_m2) = (object.mesh().triangles.len(), object.in_scene().area_m2());
    let (name, surface) = (&object.name, surface_name(material.surface));
    lines.push((
        "object",
        format!(
            "{name}: {triangles} triangles, {area_m2:.4} m^2, {} ({surface})",
            material.name
        ),
    ));
    json!({
        "name": name,
        "node": object.node,
        "primitive": object.primitive,
        "triangles": triangles,
        "area_m2": area_m2,
        "material": material.name,
        "surface": surface,
    })
}

/// A body of glass: the objects that bound it and, if a single closed mesh does, its volume.
fn body_report(scene: &Scene, body: usize, lines: &mut Lines) -> Value {
    let parts: Vec<usize> = (0..scene.objects.len())
        .filter(|&object| scene.body_of(object) == body)
        .collect();
    let object = &scene.objects[body];
    let is_closed = parts.len() > 1 || watertight::is_closed(object.mesh());
    let volume_m3 = (parts.len() == 1 && is_closed).then(|| watertight::volume_m3(object.in_scene()));
    let shape = if is_closed { "closed" } else { "open" };
    let volume = volume_m3.map_or(String::new(), |volume_m3| format!(", {volume_m3:.3e} m^3"));
    let line = format!("{}: {shape}, of {} objects{volume}", object.name, parts.len());
    lines.push(("body", line));
    json!({
        "object": body,
        "objects": parts,
        "closed": is_closed,
        "volume_m3": volume_m3,
    })
}

fn material_report(material: &Material, objects: usize, lines: &mut Lines) -> Value {
    use SurfaceKind::{Coated, Dielectric, ThinWall, Varied};
    let (name, surface) = (&material.name, surface_name(material.surface));
    let ior = matches!(material.surface, Dielectric | ThinWall | Coated | Varied).then_some(material.ior);
    let glass = material.glass.as_deref().map(glass_report);
    let metal = material.metal.map(Metal::name);
    let made_of = [
        ior.map(|ior| format!(", ior {ior:.4}")),
        glass.as_ref().map(|(_, line)| format!(", {line}")),
        metal.map(|metal| format!(", {metal} by wavelength")),
        material
            .is_solid_by_shape
            .then(|| ", solid as its mesh is closed".into()),
    ];
    let made_of: String = made_of.into_iter().flatten().collect();
    lines.push(("material", format!("{name}: {surface}{made_of}")));
    json!({
        "name": name,
        "surface": surface,
        "objects": objects,
        "ior": ior,
        "glass": glass.map(|(report, _)| report),
        "metal": metal,
    })
}

/// Strengths are luminous-equivalent; what a light does not have is null.
fn light_report(light: &Light, scene: &Scene, lines: &mut Lines) -> Value {
    // The power of a beam is its axial intensity times the solid angle that its falloff weighs.
    let strength = light.strength().luminance();
    let beam_w = strength * full_beam_sr(&light.kind);

    // A facet's axial intensity is L·A, its power πLA.
    let glowing = || Emitter::middle(light, scene).map(|middle| middle.strength.luminance());

    // Lamps state watts; sunlight and skies fill all of space, and state an irradiance.
    let (mut power_w, mut area_m2, mut across_beam, mut from_all_around) = (None, None, None, None);
    let kind = match light.kind {
        LightKind::Point { .. } => {
            power_w = Some(beam_w);
            "point"
        }
        LightKind::Spot { .. } => {
            power_w = Some(beam_w);
            "spot"
        }
        LightKind::Sun { .. } => {
            across_beam = Some(strength);
            "sun"
        }
        LightKind::Panel { .. } | LightKind::Surface { .. } => {
            power_w = glowing().map(|axial| axial * std::f64::consts::PI);
            area_m2 = glowing().map(|axial| axial / strength);
            let is_panel = matches!(light.kind, LightKind::Panel { .. });
            if is_panel { "panel" } else { "surface" }
        }
        LightKind::Environment { .. } => {
            let environment = scene.environment.as_ref();
            from_all_around = environment.map(|environment| environment.total_w_per_m2() * strength);
            "environment"
        }
    };

    // State what the light has, in text and in JSON.
    let (radius_m, diameter_deg) = match light.size {
        LightSize::None => (None, None),
        LightSize::Radius { radius_m } => (Some(radius_m), None),
        LightSize::Angle { diameter_rad } => (None, Some(diameter_rad.to_degrees())),
    };
    let spectrum = light.spectrum.as_deref().map(spectrum_report);
    let parts = [
        (radius_m, "m radius"),
        (diameter_deg, "degrees across"),
        (area_m2, "m^2"),
        (power_w, "W"),
        (across_beam, "W/m^2"),
        (from_all_around, "W/m^2 from all around"),
    ];
    let stated = parts
        .iter()
        .filter_map(|(value, unit)| value.map(|value| format!(", {value:.4} {unit}")));
    let stated: String = stated
        .chain(spectrum.as_ref().map(|(_, line)| format!(", {line}")))
        .collect();
    lines.push(("light", format!("{}: {kind}{stated}", light.name)));

    json!({
        "name": light.name,
        "kind": kind,
        "power_w": power_w,
        "normal_irradiance_w_per_m2": across_beam,
        "spherical_irradiance_w_per_m2": from_all_around,
        "radius_m": radius_m,
        "angular_diameter_deg": diameter_deg,
        "area_m2": area_m2,
        "spectrum": spectrum.map(|(report, _)| report),
    })
}

/// Integral of the falloff over all directions [sr]. It is the square of a linear ramp in the cosine, which has the
/// mean 1/3.
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
        SurfaceKind::Coated => "coated",
        SurfaceKind::Varied => "varied",
    }
}

/// A glass as JSON and as text: "N-SF11 (V_d 25.8, measured from 370 to 2500 nm)".
fn glass_report(glass: &Glass) -> (Value, String) {
    let abbe_number = Some(glass.dispersion.abbe_number()).filter(|number| number.is_finite());
    // The range that its formula was fitted to, if known.
    let range_nm = glass.range.as_ref().map(|range| [range.start().0, range.end().0]);
    let covers_the_visible = glass.is_within(*VISIBLE.start()) && glass.is_within(*VISIBLE.end());
    let dispersion = abbe_number.map_or("no dispersion".into(), |number| format!("V_d {number:.1}"));
    let measured = range_nm.filter(|_| !covers_the_visible);
    let measured = measured.map_or(String::new(), |[first, last]| {
        format!(", measured from {first:.0} to {last:.0} nm")
    });
    let report = json!({
        "name": glass.name,
        "n_d": glass.dispersion.n_d(),
        "abbe_number": abbe_number,
        "range_nm": range_nm,
        "covers_the_visible": covers_the_visible,
    });
    (report, format!("{} ({dispersion}{measured})", glass.name))
}

/// A lamp's spectrum as JSON and as text: "spectrum `D65` of 6504 K, 360 to 830 nm, 204 lm/W".
fn spectrum_report(spectrum: &Spectrum) -> (Value, String) {
    let (name, range) = (spectrum.name(), spectrum.range());
    let (first, last) = (range.start().0, range.end().0);
    let kelvin = correlated_temperature(spectrum.xyz()).map(|nearest| nearest.kelvin);
    // Luminous over radiant flux between 360 and 830 nm.
    let efficacy = spectrum.luminous_flux_lm() / spectrum.radiant();
    let called = name.map_or_else(String::new, |name| format!(" `{name}`"));
    let colour = kelvin.map_or("far from any black body".into(), |kelvin| {
        format!("of {kelvin:.0} K")
    });
    let report = json!({
        "name": name,
        "correlated_temperature_k": kelvin,
        "lumens_per_watt": efficacy,
        "range_nm": [first, last],
    });
    let line = format!("spectrum{called} {colour}, {first:.0} to {last:.0} nm, {efficacy:.0} lm/W");
    (report, line)
}

/// A map as JSON and as text: "floor, front: 512 x 512, 4.2 MB, generated (TEXCOORD_0: it overlaps itself)".
fn map_report(map: &IlluminationMap, scene: &Scene, lines: &mut Lines) -> Value {
    let object = &scene.objects[map.chart.object()];

    // UV sets of the file that cannot be used, and why.
    let refused = refused_sets(object.mesh_in_scene()).into_iter();
    let refused: Vec<String> = refused
        .map(|(set, refusal)| format!("{set}: {refusal}"))
        .collect();

    // Memory during the bake.
    let size = map.chart.texel_count() as u64 * BYTES_PER_TEXEL;
    let report = json!({
        "surface": object.name,
        "side": map.chart.receiver.side(),
        "uv_set": map.chart.uv_set,
        "refused_uv_sets": refused,
        "width": map.width(),
        "height": map.height(),
        "bytes": size,
    });

    // The text takes its words from the document, so that both name side and coordinates alike.
    let word = |name: &str| report[name].as_str().unwrap_or_default();
    let mut line = format!(
        "{}, {}: {} x {}, {}, {}",
        object.name,
        word("side"),
        map.width(),
        map.height(),
        bytes(size),
        word("uv_set")
    );
    if !refused.is_empty() {
        line += &format!(" ({})", refused.join("; "));
    }
    lines.push(("map", line));
    report
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
