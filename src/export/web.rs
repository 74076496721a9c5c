//! A page to walk through baked maps in a browser: a folder that any server serves, or one file that opens from the disk.
//! Nothing is fetched from elsewhere.

use std::collections::BTreeMap;
use std::io::Write as _;
use std::path::Path;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;
use flate2::Compression;
use flate2::write::GzEncoder;
use serde::Serialize;
use serde_json::{Value, json};

use super::Quantity;
use super::glb::{self, Bits, Carrier, GlbOptions, SceneLights};
use super::map_set::MapSet;
use super::textures::encoding::FileMetadata;
use super::textures::ktx2::{self, Packing};
use super::textures::texels::Texels;
use crate::error::{Error, Result, Warning};
use crate::eye_pass::ToneMap;
use crate::files::{self, OutputFolder, StagedFolder};
use crate::illumination::IlluminationMap;
use crate::optics::{LinearSrgb, luminance};
use crate::progress::Control;
use crate::scene::{LoadOptions, Object, Scene, SurfaceKind, open_document};
use crate::settings::LayerKind;

/// Longest side of a map or of the sky in the page [texels]: graphics cards of phones hold no more of many.
const MOST_SIDE: usize = 2048;
/// A map is made half as fine as long as it differs by no more than this, root mean square, relative to the light there
/// and a tenth of the mean [1]. Less cannot be seen.
const ALIKE: f64 = 0.01;
/// Below, nothing is gained [texels].
const LEAST_SIDE: usize = 32;

/// The page, with its place for what the scene needs.
const PAGE: &str = include_str!("../../assets/web/index.html");
/// What stands in the page for its data and scripts.
const PLACE: &str = "<!-- nephroid -->";
/// What marks a page of ours.
const MARK: &str = "name=\"generator\" content=\"nephroid";

/// Name of a file in the folder, name by which scripts import it, and the file.
type Module = (&'static str, &'static str, &'static str);

macro_rules! module {
    ($file:literal, $name:literal) => {
        ($file, $name, include_str!(concat!("../../assets/web/", $file)))
    };
}

const MODULES: [Module; 11] = [
    module!("page.js", "page"),
    module!("stage.js", "stage"),
    module!("shaders.js", "shaders"),
    module!("chains.js", "chains"),
    module!("navigation.js", "navigation"),
    module!("three/three.module.min.js", "three"),
    module!("three/three.core.min.js", "three.core.min"),
    module!("three/loaders/GLTFLoader.js", "GLTFLoader"),
    module!("three/utils/BufferGeometryUtils.js", "BufferGeometryUtils"),
    module!("three/utils/SkeletonUtils.js", "SkeletonUtils"),
    module!("three/libs/zstddec.module.js", "zstddec"),
];
const LICENCE: (&str, &str) = ("three/LICENSE", include_str!("../../assets/web/three/LICENSE"));

/// Ways of packing that the page's reader of glTF does not undo.
const PACKED: [&str; 3] = [
    "KHR_draco_mesh_compression",
    "EXT_meshopt_compression",
    "KHR_texture_basisu",
];

/// What was written.
#[derive(Clone, Debug, Serialize)]
pub struct WebReport {
    /// Of all files [bytes].
    pub bytes: usize,
    /// How many.
    pub files: usize,
    /// The layers that can be switched.
    pub layers: Vec<LayerKind>,
    /// Textures of maps.
    pub textures: usize,
    /// What the page cannot show.
    #[serde(skip)]
    pub warnings: Vec<Warning>,
}

/// A page with all that it needs.
#[derive(Clone, Debug)]
pub struct Site {
    /// What its scripts read of it.
    about: Value,
    /// Names and bytes of its files but for scripts and the page itself.
    files: Vec<(String, Vec<u8>)>,
    /// What there is, so far.
    pub report: WebReport,
}

impl Site {
    /// Makes all files of the page of a scene with its maps. `exposure_stops`: about that at which its light is white.
    ///
    /// # Errors
    /// Maps that cannot be read; a scene whose file cannot be taken up, or is packed in a way that the page cannot undo;
    /// [`Error::cancelled`].
    pub fn new(scene: &Scene, set: &MapSet<'_>, exposure_stops: f64, control: &Control) -> Result<Self> {
        let maps = set.read_all()?;
        let opened = open_document(scene, &LoadOptions::default())?;
        refuse_packed(scene, &opened.glb.json)?;
        let options = GlbOptions {
            carrier: Carrier::Beside,
            quantity: Quantity::Irradiance,
            lights: SceneLights::Remove,
            bits: Bits::Eight,
            ..GlbOptions::default()
        };
        let (bytes, written) = glb::encode(scene, opened, &maps, options)?;
        let mut site = Self {
            about: json!({}),
            files: vec![("scene.glb".into(), bytes)],
            report: WebReport {
                bytes: 0,
                files: 0,
                layers: written.layers.clone(),
                textures: 0,
                warnings: written.warnings,
            },
        };
        let coordinates: BTreeMap<_, _> = written
            .maps
            .iter()
            .map(|map| ((map.node, map.primitive), map.tex_coord))
            .collect();
        let mut textures = Vec::new();
        for (map, entry) in maps.iter().filter_map(|map| {
            let object = &scene.objects[map.chart.object()];
            let is_its = |entry: &&super::manifest::MapEntry| {
                (entry.node, entry.primitive) == (object.node, object.primitive)
                    && entry.side == map.chart.receiver.side()
            };
            Some((map, set.entries().iter().find(is_its)?))
        }) {
            let Some(tex_coord) = coordinates.get(&(entry.node, entry.primitive)) else {
                continue;
            };
            let mut layers = BTreeMap::new();
            for layer in &map.layers {
                if control.is_cancelled() {
                    return Err(Error::cancelled(&scene.source));
                }
                let texels = Texels::new(&map.chart, &layer.irradiance, 1.0);
                let name = format!("maps/{}_{}.ktx2", super::textures::stem(entry), layer.kind.name());
                site.push_texture(&name, shrunk(texels))?;
                layers.insert(layer.kind.name(), name);
            }
            site.report.textures += layers.len();
            textures.push(json!({
                "node": entry.node,
                "primitive": entry.primitive,
                "side": entry.side,
                "uv": tex_coord,
                "layers": layers,
            }));
        }
        let mut sky = None;
        if let Some(environment) = &scene.environment {
            let mut texels = Texels::of(environment.size(), environment.pixels().to_vec());
            while texels.size().0 > MOST_SIDE {
                texels = texels.halved();
            }
            site.push_texture("sky.ktx2", texels)?;
            sky = Some("sky.ktx2");
        }
        let has_chains = site.push_chains(scene, &maps);
        let objects: Vec<Value> = scene.objects.iter().map(|object| look(scene, object)).collect();
        site.about = json!({
            "title": scene.name,
            "exposure_stops": exposure_stops,
            "tone_map": <&str>::from(ToneMap::default()),
            "layers": written.layers,
            "maps": textures,
            "objects": objects,
            "sky": sky,
            "chains": has_chains,
        });
        site.note_missing_light(scene, set);
        Ok(site)
    }

    fn push_texture(&mut self, name: &str, texels: Texels) -> Result<()> {
        let notes = FileMetadata {
            quantity: Quantity::Irradiance,
            exposure_stops: 0.0,
            what: name.into(),
            location: name,
        };
        let encoded = ktx2::encode(&texels, Packing::Rgb9e5, name != "sky.ktx2", &notes)?;
        self.files.push((name.into(), encoded.bytes));
        Ok(())
    }

    /// Adds what mirrors and glass are traced through; tells whether there is any.
    #[cfg(feature = "gpu")]
    fn push_chains(&mut self, scene: &Scene, maps: &[IlluminationMap]) -> bool {
        match super::chains::encode(scene, maps) {
            Ok(Some(bytes)) => self.files.push(("chains.gz".into(), bytes)),
            Ok(None) => return false,
            Err(error) => {
                let Error {
                    location,
                    what,
                    remedy,
                    ..
                } = error;
                self.report.warnings.push(Warning::new(location, what, remedy));
                return false;
            }
        }
        true
    }

    #[cfg(not(feature = "gpu"))]
    fn push_chains(&mut self, _: &Scene, _: &[IlluminationMap]) -> bool {
        false
    }

    fn note_missing_light(&mut self, scene: &Scene, set: &MapSet<'_>) {
        self.report.warnings.extend(set.warnings());
        if !self.report.layers.contains(&LayerKind::Direct) && !scene.lights.is_empty() {
            self.report.warnings.push(Warning::new(
                set.folder().display().to_string(),
                "holds no direct light, which the page does not compute; it is dark beside the caustics",
                "bake all layers (--layers caustic,direct,indirect)",
            ));
        }
    }

    /// Writes the folder, all of it or nothing. A page of ours is replaced; another folder that is not empty is taken only
    /// with `force`.
    ///
    /// # Errors
    /// Other people's files; a place that cannot be written.
    pub fn write_folder(mut self, path: &Path, force: bool) -> Result<WebReport> {
        let is_ours = files::read_file(&path.join("index.html"), 1 << 20)
            .is_ok_and(|page| String::from_utf8_lossy(&page).contains(MARK));
        let root = OutputFolder::open_own(path, is_ours, force, "an export for the web")?;
        let imports: BTreeMap<_, _> = MODULES
            .iter()
            .map(|(file, name, _)| (*name, format!("./{file}")))
            .collect();
        let scripts = format!(
            "{}<script type=\"importmap\">{}</script>\n<script type=\"module\">import \"page\";</script>",
            self.about_tag(),
            json!({ "imports": imports }),
        );
        let texts = MODULES.iter().map(|(file, _, text)| (*file, *text));
        for (file, text) in texts.chain([LICENCE, ("index.html", &PAGE.replace(PLACE, &scripts))]) {
            self.files.push((file.into(), text.as_bytes().to_vec()));
        }
        let mut folder = StagedFolder::new(root)?;
        for (name, bytes) in &self.files {
            folder.write(name, bytes)?;
            self.report.bytes += bytes.len();
        }
        self.report.files = self.files.len();
        folder.commit()?;
        Ok(self.report)
    }

    /// Writes all as one page.
    ///
    /// # Errors
    /// A place that cannot be written.
    pub fn write_file(mut self, path: &Path) -> Result<WebReport> {
        let mut inline = self.about_tag();
        let modules = MODULES.iter().map(|(_, name, text)| {
            let code = importing_by_name(text).into_bytes();
            (format!("module:{name}"), code)
        });
        let licence = (LICENCE.0.to_owned(), LICENCE.1.as_bytes().to_vec());
        for (name, bytes) in self.files.drain(..).chain(modules).chain([licence]) {
            let (packing, bytes) = match Path::new(&name).extension() {
                Some(end) if end == "ktx2" || end == "gz" => ("", bytes),
                _ => (" data-gzip", gzip(&bytes)),
            };
            inline += &format!(
                "<script type=\"text/plain\" data-file=\"{name}\"{packing}>{}</script>\n",
                BASE64.encode(bytes)
            );
        }
        inline += concat!(
            "<script>",
            include_str!("../../assets/web/unpack.js"),
            "</script>"
        );
        let page = PAGE.replace(PLACE, &inline);
        files::write_atomically(path, |writer| writer.write_all(page.as_bytes()))?;
        (self.report.bytes, self.report.files) = (page.len(), 1);
        Ok(self.report)
    }

    /// What scripts read, in the page. No text of a scene ends its element.
    fn about_tag(&self) -> String {
        let about = self.about.to_string().replace('<', "\\u003c");
        format!("<script type=\"application/json\" id=\"about\">{about}</script>\n")
    }
}

/// Scripts of one file have no places to be imported from, but for names.
fn importing_by_name(code: &str) -> String {
    let mut code = code.to_owned();
    for (file, name, _) in MODULES {
        let (_, plain) = file.rsplit_once('/').unwrap_or(("", file));
        for folder in ["./", "../utils/"] {
            for quote in ['"', '\''] {
                code = code.replace(&format!("{quote}{folder}{plain}{quote}"), &format!("\"{name}\""));
            }
        }
    }
    code
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
    let written = encoder.write_all(bytes).and_then(|()| encoder.finish());
    written.expect("memory takes all that is written to it")
}

fn refuse_packed(scene: &Scene, document: &Value) -> Result<()> {
    let used = document["extensionsUsed"].as_array().into_iter().flatten();
    match used.filter_map(Value::as_str).find(|name| PACKED.contains(name)) {
        None => Ok(()),
        Some(name) => Err(Error::failure(
            &scene.source,
            format!("is packed with {name}, which the page does not unpack"),
            "export the scene without this compression and bake it again",
        )),
    }
}

/// What the page's shaders need of an object.
fn look(scene: &Scene, object: &Object) -> Value {
    let material = &scene.materials[object.material];
    let kind = match material.surface {
        SurfaceKind::Diffuse | SurfaceKind::Varied => "diffuse",
        SurfaceKind::Mixed => "mixed",
        SurfaceKind::Mirror => "mirror",
        SurfaceKind::Dielectric => "glass",
        SurfaceKind::ThinWall => "pane",
    };
    let absorption = material.volume.as_ref().map_or(LinearSrgb::BLACK, |volume| {
        let distance_m = volume.attenuation_distance_m;
        volume.attenuation_colour.map(|share| -share.ln() / distance_m)
    });
    json!({
        "node": object.node,
        "primitive": object.primitive,
        "kind": kind,
        "base": material.base_colour.to_array(),
        "glow": material.emitted_radiance.to_array(),
        "ior": material.ior,
        "polish": material.polish,
        "roughness": material.roughness,
        "absorption_per_m": absorption.to_array(),
    })
}

/// As few texels as show the same light.
fn shrunk(mut texels: Texels) -> Texels {
    loop {
        let (width, height) = texels.size();
        if width % 2 != 0 || height % 2 != 0 || width.min(height) <= LEAST_SIDE {
            return texels;
        }
        let half = texels.halved();
        if width.max(height) <= MOST_SIDE && difference(&texels, &half) > ALIKE {
            return texels;
        }
        texels = half;
    }
}

/// How far a picture of half the size is off where it is looked up between its texels, root mean square, relative to the
/// light there and a tenth of the mean.
fn difference(texels: &Texels, half: &Texels) -> f64 {
    let (width, height) = texels.size();
    let values = texels.values();
    let mean = values.iter().map(luminance).sum::<f64>() / values.len() as f64;
    let (across, down) = half.size();
    let at = |column: usize, row: usize| luminance(&half.values()[row * across + column]);
    // The nearer and the farther of two texels of half the size, from the middle of a quarter of the nearer.
    let both = |place: usize, count: usize| {
        let beside = if place.is_multiple_of(2) {
            (place / 2).saturating_sub(1)
        } else {
            place / 2 + 1
        };
        (place / 2, beside.min(count - 1))
    };
    let mut squares = 0.0;
    for (texel, value) in values.iter().enumerate() {
        let ((near, far), (upper, lower)) = (both(texel % width, across), both(texel / width, down));
        let row = |row: usize| 0.75 * at(near, row) + 0.25 * at(far, row);
        let (wanted, found) = (luminance(value), 0.75 * row(upper) + 0.25 * row(lower));
        let scale = wanted.max(0.0) + 0.1 * mean;
        if scale > 0.0 {
            squares += ((found - wanted) / scale).powi(2);
        }
    }
    (squares / (width * height) as f64).sqrt()
}
