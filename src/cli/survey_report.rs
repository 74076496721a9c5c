//! What a bake would take, as `inspect` tells it.

use nephroid::illumination::parametrisation::refused_sets;
use nephroid::illumination::{Side, UvSet};
use nephroid::scene::Scene;
use nephroid::session::{BakeCounts, CostPoint, Forecast, ItemBufferReport, Survey};
use nephroid::settings::Preset;
use serde::Serialize;

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
            refused_uv_sets: refused_sets(&scene.objects[map.chart.object()].mesh)
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
