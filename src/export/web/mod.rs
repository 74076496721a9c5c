//! A page to walk through baked maps in a browser: a folder that any server serves, or one file that opens from the disk.
//! Nothing is fetched from elsewhere.

use std::collections::{BTreeMap, BTreeSet};
use std::io::Write as _;
use std::path::Path;
use std::sync::Arc;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;
use flate2::Compression;
use flate2::write::GzEncoder;
use serde::Serialize;
use serde_json::{Value, json};

use crate::error::{Error, Result, Warning};
use crate::export::Quantity;
use crate::export::glb::{self, Bits, Carrier, GlbOptions, SceneLights};
use crate::export::manifest::MapEntry;
use crate::export::map_set::MapSet;
use crate::export::textures::encoding::FileMetadata;
use crate::export::textures::ktx2::{self, Packing};
use crate::export::textures::stem;
use crate::export::textures::texels::Texels;
use crate::eye_pass::ToneMap;
use crate::files::{self, OutputFolder, StagedFolder};
use crate::illumination::{Chart, IlluminationMap, Parametrisation, Receiver};
use crate::optics::LinearSrgb;
use crate::progress::Control;
use crate::scene::{LoadOptions, Object, Opened, Scene, SurfaceKind, open_document};
use crate::settings::LayerKind;

mod sizes;

/// The page, with its place for what the scene needs.
const PAGE: &str = include_str!("../../../assets/web/index.html");
/// What stands in the page for its data and scripts.
const PLACE: &str = "<!-- nephroid -->";
/// What marks a page of ours.
const MARK: &str = "name=\"generator\" content=\"nephroid";
/// Where its scripts' data begins.
const ABOUT: &str = "<script type=\"application/json\" id=\"about\">";
/// Most that a page of a folder has [bytes].
const MAX_PAGE_BYTES: u64 = 16 << 20;

/// What names of textures and packed files end with.
const ENDS: [&str; 2] = [".ktx2", ".gz"];

/// Name of a file in the folder, name by which scripts import it, and the file.
type Module = (&'static str, &'static str, &'static str);

macro_rules! module {
    ($file:literal, $name:literal) => {
        ($file, $name, include_str!(concat!("../../../assets/web/", $file)))
    };
}

const MODULES: [Module; 13] = [
    module!("page.js", "page"),
    module!("stage.js", "stage"),
    module!("ktx2.js", "ktx2"),
    module!("shaders.js", "shaders"),
    module!("chains.js", "chains"),
    module!("navigation.js", "navigation"),
    module!("motion.js", "motion"),
    module!("three/three.module.min.js", "three"),
    module!("three/three.core.min.js", "three.core.min"),
    module!("three/loaders/GLTFLoader.js", "GLTFLoader"),
    module!("three/utils/BufferGeometryUtils.js", "BufferGeometryUtils"),
    module!("three/utils/SkeletonUtils.js", "SkeletonUtils"),
    module!("three/libs/zstddec.module.js", "zstddec"),
];
const LICENCE: (&str, &str) = ("three/LICENSE", include_str!("../../../assets/web/three/LICENSE"));

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

/// A map as the page shows it.
struct ShownMap {
    chart: Arc<Chart>,
    entry: MapEntry,
    /// Files of each layer, moment by moment; `None` where it is dark.
    layers: BTreeMap<LayerKind, Vec<Option<String>>>,
    /// Of the largest layer [texels].
    size: (usize, usize),
    /// Nothing in it is brighter [W/m²].
    peak_w_m2: f32,
}

impl ShownMap {
    fn new(map: &IlluminationMap, entry: &MapEntry) -> Self {
        Self {
            chart: Arc::clone(&map.chart),
            entry: entry.clone(),
            layers: BTreeMap::new(),
            size: (0, 0),
            peak_w_m2: 0.0,
        }
    }

    /// What the page reads of it.
    fn describe(mut self, uv: usize, moments: usize) -> Value {
        for files in self.layers.values_mut() {
            files.resize(moments, None);
            if files.windows(2).all(|pair| pair[0] == pair[1]) {
                files.truncate(1);
            }
        }
        json!({
            "node": self.entry.node,
            "primitive": self.entry.primitive,
            "side": self.entry.side,
            "uv": uv,
            "layers": self.layers,
        })
    }

    /// A map of its size, as bright all over as it is anywhere.
    fn stand_in(&self, scene: &Scene) -> IlluminationMap {
        let (chart, (width, height)) = (&self.chart, self.size);
        let mesh = scene.objects[chart.object()].mesh_in_scene();
        let uvs = chart.corner_uvs.clone();
        let sized = Parametrisation::new(chart.object(), mesh, chart.uv_set, uvs).chart(width, height);
        let sized = Arc::new(sized.of_side(chart.receiver.side()));
        let light = vec![[self.peak_w_m2; 3]; width * height];
        IlluminationMap::of_layer(sized, LayerKind::Caustic, light)
    }
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
    /// Makes all files of the page of a scene with its maps at each moment. `exposure_stops`: about that at which its light
    /// is white.
    ///
    /// # Errors
    /// Maps that cannot be read, or none; a scene whose file cannot be taken up, or is packed in a way that the page cannot
    /// undo; [`Error::cancelled`].
    pub fn new(
        scene: &Scene,
        moments: &[MapSet<'_>],
        exposure_stops: f64,
        control: &Control,
    ) -> Result<Self> {
        let Some(first) = moments.first() else {
            return Err(Error::failure("maps", "there are none", "bake the scene again"));
        };
        let opened = open_document(scene, &LoadOptions::default())?;
        refuse_packed(scene, &opened.glb.json)?;
        let mut site = Self {
            about: json!({}),
            files: Vec::new(),
            report: WebReport {
                bytes: 0,
                files: 0,
                layers: Vec::new(),
                textures: 0,
                warnings: Vec::new(),
            },
        };
        let mut shown: BTreeMap<Receiver, ShownMap> = BTreeMap::new();
        for (moment, set) in moments.iter().enumerate() {
            for map in set.read_all()? {
                if control.is_cancelled() {
                    return Err(Error::cancelled(&scene.source));
                }
                site.push_map(scene, set, moment, &map, &mut shown)?;
            }
        }
        site.report.textures = site.files.len();
        let maps: Vec<IlluminationMap> = shown.values().map(|shown| shown.stand_in(scene)).collect();
        let layers: BTreeSet<LayerKind> = shown
            .values()
            .flat_map(|shown| shown.layers.keys().copied())
            .collect();
        site.report.layers = layers.into_iter().collect();
        let coordinates = site.push_scene(scene, opened, &maps)?;
        let sky = scene.environment.as_ref().map(|_| "sky.ktx2");
        if let Some(environment) = &scene.environment {
            let mut texels = Texels::of(environment.size(), environment.pixels().to_vec());
            while texels.size().0 > sizes::MAX_SIDE {
                texels = texels.halved();
            }
            site.files.push(("sky.ktx2".into(), texture("sky", &texels)?));
        }
        let has_chains = moments.len() == 1 && site.push_chains(scene, &maps);
        let maps = shown.into_values().map(|shown| {
            // A surface without coordinates is scaled to nothing.
            let place = (shown.entry.node, shown.entry.primitive);
            shown.describe(coordinates.get(&place).copied().unwrap_or(0), moments.len())
        });
        let maps: Value = maps.collect();
        let objects: Value = scene.objects.iter().map(|object| look(scene, object)).collect();
        let names: Vec<&str> = site.files.iter().map(|(name, _)| &**name).collect();
        let frames = first.fps().map(|fps| json!({"count": moments.len(), "fps": fps}));
        site.about = json!({
            "title": scene.name,
            "exposure_stops": exposure_stops,
            "tone_map": <&str>::from(ToneMap::default()),
            "layers": site.report.layers,
            "maps": maps,
            "objects": objects,
            "sky": sky,
            "chains": has_chains,
            "frames": frames,
            "files": names,
        });
        site.note_missing_light(scene, first);
        Ok(site)
    }

    /// Adds the textures of a map at a moment.
    fn push_map(
        &mut self,
        scene: &Scene,
        set: &MapSet<'_>,
        moment: usize,
        map: &IlluminationMap,
        shown: &mut BTreeMap<Receiver, ShownMap>,
    ) -> Result<()> {
        let (receiver, object) = (map.chart.receiver, &scene.objects[map.chart.object()]);
        let is_its = |entry: &&MapEntry| {
            (entry.node, entry.primitive, entry.side) == (object.node, object.primitive, receiver.side())
        };
        let Some(entry) = set.entries().iter().find(is_its) else {
            return Ok(());
        };
        let shown = shown.entry(receiver).or_insert_with(|| ShownMap::new(map, entry));
        let mut peak_w_m2 = 0.0;
        for (layer, texels) in map.layers.iter().zip(sizes::fitted(map)) {
            let name = format!("maps/{}_{}.ktx2", stem(entry), layer.kind.name());
            let what = format!("{} light of {}", layer.kind.name(), entry.surface);
            let bytes = texture(&what, &texels)?;
            peak_w_m2 += texels.peak();
            shown.size = shown.size.max(texels.size());
            let files = shown.layers.entry(layer.kind).or_default();
            files.resize(moment, None);
            // Light that stands still is there once.
            let last = files.last().and_then(|last| last.clone());
            let is_same = |(known, held): &(String, Vec<u8>)| Some(known) == last.as_ref() && *held == bytes;
            if self.files.iter().any(is_same) {
                files.push(last);
            } else {
                files.push(Some(name.clone()));
                self.files.push((name, bytes));
            }
        }
        shown.peak_w_m2 = shown.peak_w_m2.max(peak_w_m2);
        Ok(())
    }

    /// Adds the scene with the coordinates of these maps; tells the n of TEXCOORD_n of each node and primitive.
    fn push_scene(
        &mut self,
        scene: &Scene,
        opened: Opened,
        maps: &[IlluminationMap],
    ) -> Result<BTreeMap<(usize, usize), usize>> {
        let options = GlbOptions {
            carrier: Carrier::Beside,
            quantity: Quantity::Irradiance,
            lights: SceneLights::Remove,
            bits: Bits::Eight,
            ..GlbOptions::default()
        };
        let (bytes, written) = glb::encode(scene, opened, maps, options)?;
        self.files.push(("scene.glb.gz".into(), gzip(&bytes)));
        self.report.warnings.extend(written.warnings);
        let coordinates = written.maps.iter();
        Ok(coordinates
            .map(|map| ((map.node, map.primitive), map.tex_coord))
            .collect())
    }

    /// Adds what mirrors and glass are traced through; tells whether there is any.
    #[cfg(feature = "gpu")]
    fn push_chains(&mut self, scene: &Scene, maps: &[IlluminationMap]) -> bool {
        match crate::export::chains::encode(scene, maps) {
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
        let previous = files_of_ours(path);
        let root = OutputFolder::open_own(path, previous.is_some(), force, "an export for the web")?;
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
        let is_written = |name: &&String| self.files.iter().any(|(written, _)| written == *name);
        for outdated in previous.iter().flatten().filter(|name| !is_written(name)) {
            files::remove_file(&path.join(outdated))?;
        }
        Ok(self.report)
    }

    /// Writes all as one page.
    ///
    /// # Errors
    /// A place that cannot be written.
    pub fn write_file(mut self, path: &Path) -> Result<WebReport> {
        let mut inline = self.about_tag();
        let modules = MODULES.iter().map(|(_, name, text)| {
            let code = importing_by_name(text);
            (format!("module:{name}"), gzip(code.as_bytes()))
        });
        let licence = (LICENCE.0.to_owned(), LICENCE.1.as_bytes().to_vec());
        for (name, bytes) in self.files.drain(..).chain(modules).chain([licence]) {
            inline += &format!(
                "<script type=\"text/plain\" data-file=\"{name}\">{}</script>\n",
                BASE64.encode(bytes)
            );
        }
        inline += concat!(
            "<script>",
            include_str!("../../../assets/web/unpack.js"),
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
        format!("{ABOUT}{about}</script>\n")
    }
}

/// Files that an earlier page of ours in a folder names as its data; `None` where there is none.
fn files_of_ours(path: &Path) -> Option<Vec<String>> {
    let page = files::read_file(&path.join("index.html"), MAX_PAGE_BYTES).ok()?;
    let page = String::from_utf8_lossy(&page);
    let (_, about) = page.split_once(MARK)?.1.split_once(ABOUT)?;
    let about: Value = serde_json::from_str(about.split_once("</script>")?.0).ok()?;
    let names = about["files"].as_array()?.iter().filter_map(Value::as_str);
    // None that leads out of the folder.
    let is_plain = |name: &&str| {
        let plain = name.strip_prefix("maps/").unwrap_or(name);
        let is_known = |byte: u8| byte.is_ascii_alphanumeric() || b"_-.".contains(&byte);
        !plain.starts_with('.') && plain.bytes().all(is_known) && ENDS.iter().any(|end| plain.ends_with(end))
    };
    Some(names.filter(is_plain).map(str::to_owned).collect())
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

/// A file of one level: the page makes the others.
fn texture(what: &str, texels: &Texels) -> Result<Vec<u8>> {
    let notes = FileMetadata {
        quantity: Quantity::Irradiance,
        exposure_stops: 0.0,
        what: what.into(),
        location: what,
    };
    Ok(ktx2::encode(texels, Packing::Rgb9e5, false, &notes)?.bytes)
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
        SurfaceKind::Coated => "coated",
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
        "coat": material.coat,
        "roughness": material.roughness,
        "absorption_per_m": absorption.to_array(),
    })
}
