//! A page to walk through baked maps in a browser: a folder that any server serves, or one file that opens from the
//! disk. The page draws with the program's own shaders by WebGPU; without it, it shows a still picture. Nothing is
//! fetched from elsewhere.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;
use image::ExtendedColorType;
use image::codecs::jpeg::JpegEncoder;
use serde::Serialize;
use serde_json::{Value, json};

use self::layers::{ShownMap, Texture};
use self::packed::gzip;
use crate::error::{Error, Result, Warning};
use crate::export::map_set::MapSet;
use crate::eye_pass::renderer::WebScene;
use crate::eye_pass::{Picture, ToneMap, View, tone_mapping};
use crate::files::{self, OutputFolder, StagedFolder};
use crate::illumination::false_colours::viridis;
use crate::progress::Control;
use crate::scene::{Camera, Scene};
use crate::settings::LayerKind;

mod layers;
mod packed;
mod sizes;

/// The page, with its place for what the scene needs.
const PAGE: &str = include_str!("../../../assets/web/index.html");
/// What stands in the page for its data and scripts.
const PLACE: &str = "<!-- nephroid -->";
/// What marks a page of ours.
const MARK: &str = "name=\"generator\" content=\"nephroid";
/// Most that a page of a folder has [bytes].
const MAX_PAGE_BYTES: u64 = 16 << 20;

/// Scripts by the names that they import each other by.
macro_rules! modules {
    ($($name:literal)+) => { [$(($name, include_str!(concat!("../../../assets/web/", $name, ".js")))),+] };
}
const MODULES: [(&str, &str); 6] = modules!("page" "files" "eye_pass" "geometry" "navigation" "motion");

/// What a browser without WebGPU shows of the first camera: name, size [pixels] and quality [%].
const STILL: &str = "still.jpg";
const STILL_SIZE: [u32; 2] = [1280, 720];
const STILL_QUALITY: u8 = 85;
/// Size of pictures that only the exposure is measured by [pixels].
const MEASURED: [u32; 2] = [160, 90];
/// Stops of the scale of false colours.
const COLOURS: usize = 17;

/// Makes the picture of a view at the first moment.
pub type Eye<'a> = dyn Fn(&View) -> Result<Picture> + 'a;

/// What was written.
#[derive(Clone, Debug, Serialize)]
pub struct WebReport {
    /// Of all files [bytes].
    pub bytes: usize,
    /// How many.
    pub files: usize,
    /// The layers that can be switched.
    pub layers: Vec<LayerKind>,
    /// Moments that can be played.
    pub moments: usize,
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
    /// The report, complete once the page is written.
    pub report: WebReport,
}

impl Site {
    /// Makes all files of the page of a scene with its maps at each moment. `eye` draws the still picture, and measures
    /// the exposure of each camera.
    ///
    /// # Errors
    /// Maps that cannot be read, or none; a scene beyond what browsers hold; those of `eye`; [`Error::cancelled`].
    pub fn new(scene: &Scene, moments: &[MapSet<'_>], eye: &Eye<'_>, control: &Control) -> Result<Self> {
        let Some(first) = moments.first() else {
            return Err(Error::failure("maps", "there are none", "bake the scene again"));
        };

        // Every map becomes textures as it is read. Of a surface, its chart, its largest size and its peak are kept.
        let (mut shown, mut layers, mut light) = (BTreeMap::new(), BTreeSet::new(), Vec::new());
        for set in moments {
            let mut textures = BTreeMap::new();
            for map in set.read_all()? {
                if control.is_cancelled() {
                    return Err(Error::cancelled(&scene.source));
                }
                let (map, receiver) = (map.dense(), map.chart.receiver);
                let shown = shown.entry(receiver).or_insert_with(|| ShownMap::new(&map.chart));
                for (kind, texture) in shown.add(&map) {
                    layers.insert(kind);
                    textures.insert(format!("{}{}", kind.name(), receiver.index()), texture);
                }
            }
            if let Some(environment) = &set.scene().environment {
                textures.insert("sky".into(), Texture::of_sky(environment));
            }
            light.push(textures);
        }

        let mut site = Self {
            about: json!({}),
            files: Vec::new(),
            report: WebReport {
                bytes: 0,
                files: 0,
                layers: layers.into_iter().collect(),
                moments: moments.len(),
                warnings: first.warnings(),
            },
        };

        // Tiles are laid out once for all moments: a stand-in of each map has the largest size and peak of them all.
        let stand_ins: Vec<_> = shown.values().map(|map| map.stand_in(first.scene())).collect();
        let mut first_contents = BTreeMap::new();
        for (set, textures) in moments.iter().zip(light) {
            if control.is_cancelled() {
                return Err(Error::cancelled(&scene.source));
            }
            let WebScene {
                mut description,
                mut contents,
                refusal,
            } = WebScene::new(set.scene(), &stand_ins)?;
            for (name, texture) in textures {
                description["textures"][&name] = json!({"size": texture.size, "scale": texture.scale});
                contents.insert(name, texture.content);
            }
            if site.files.is_empty() {
                let refused = refusal.map(|error| Warning::new(error.location, error.what, error.remedy));
                site.report.warnings.extend(refused);
            } else {
                // The programs are those of the first.
                description["programs"] = Value::Null;
            }
            let file = packed::file(description, &contents, &first_contents);
            site.files.push((moment_file(site.files.len()), file));
            if first_contents.is_empty() {
                first_contents = contents;
            }
        }

        // What scripts read in the page itself: cameras with exposures, the extent, the scale of false colours.
        let names: Vec<String> = (0..moments.len()).map(moment_file).collect();
        let cameras = site.push_still(scene, eye)?;
        let (low, high) = scene.inner_bounds().unwrap_or_default();
        let colour = |stop: usize| {
            let colour = viridis(stop as f64 / (COLOURS - 1) as f64);
            let [r, g, b] = colour.map(|code| (255.0 * code).round());
            format!("rgb({r} {g} {b})")
        };
        site.about = json!({
            "title": scene.name,
            "tone_map": <&str>::from(ToneMap::default()),
            "layers": site.report.layers,
            "cameras": cameras,
            "bounds_m": [low.to_array(), high.to_array()],
            "colours": (0..COLOURS).map(colour).collect::<Vec<_>>(),
            "moments": names,
            "fps": first.fps(),
        });

        // Lamps do not shine in the page: without their layer, caustics lie in the dark.
        if !site.report.layers.contains(&LayerKind::Direct) && !scene.lights.is_empty() {
            site.report.warnings.push(Warning::new(
                first.folder().display().to_string(),
                "holds no direct light, which the page does not compute; it is dark beside the caustics",
                "bake all layers (--layers caustic,direct,indirect)",
            ));
        }
        Ok(site)
    }

    /// Adds the still picture; returns what the page reads of each camera, of which there is at least one.
    fn push_still(&mut self, scene: &Scene, eye: &Eye<'_>) -> Result<Vec<Value>> {
        let aspect = f64::from(STILL_SIZE[0]) / f64::from(STILL_SIZE[1]);
        let all = || Camera::framing("all", scene.inner_bounds().unwrap_or_default(), aspect);
        let cameras = match &scene.cameras[..] {
            [] => vec![all()],
            cameras => cameras.to_vec(),
        };
        let mut described = Vec::new();
        for (index, camera) in cameras.into_iter().enumerate() {
            let size = if index == 0 { STILL_SIZE } else { MEASURED };
            let mut view = View::new(camera, size);
            let picture = eye(&view)?;
            view.exposure_stops = picture.auto_exposure_stops();
            if index == 0 {
                self.files.push((STILL.into(), still(&picture, &view)?));
            }
            described.push(json!({
                "name": view.camera.name,
                "position_m": view.camera.position.to_array(),
                "forward": view.camera.forward.to_array(),
                "fov_rad": view.camera.vertical_fov_rad,
                "exposure_stops": view.exposure_stops,
            }));
        }
        Ok(described)
    }

    /// Writes the folder, all of it or nothing. A page of ours is replaced; another folder that is not empty is taken
    /// only with `force`.
    ///
    /// # Errors
    /// Other people's files; a place that cannot be written.
    pub fn write_folder(mut self, path: &Path, force: bool) -> Result<WebReport> {
        let page = files::read_file(&path.join("index.html"), MAX_PAGE_BYTES);
        let is_ours = page.is_ok_and(|page| String::from_utf8_lossy(&page).contains(MARK));
        let root = OutputFolder::open_own(path, is_ours, force, "an export for the web")?;
        let imports: BTreeMap<_, _> = MODULES.map(|(name, _)| (name, format!("./{name}.js"))).into();
        let scripts = format!(
            "{}<script type=\"importmap\">{}</script>\n<script type=\"module\">import \"page\";</script>",
            self.about_tag(),
            json!({ "imports": imports }),
        );
        let page = PAGE.replace(PLACE, &scripts);
        self.files
            .extend(MODULES.map(|(name, text)| (format!("{name}.js"), text.into())));
        self.files.push(("index.html".into(), page.into()));
        let mut folder = StagedFolder::new(root)?;
        for (name, bytes) in &self.files {
            folder.write(name, bytes)?;
            self.report.bytes += bytes.len();
        }
        self.report.files = self.files.len();
        folder.commit()?;
        // An earlier page may have had more moments: their files are removed.
        let beyond = (self.report.moments..).map(|moment| path.join(moment_file(moment)));
        for outdated in beyond.take_while(|file| is_ours && file.exists()) {
            files::remove_file(&outdated)?;
        }
        Ok(self.report)
    }

    /// Writes all as one page.
    ///
    /// # Errors
    /// A place that cannot be written.
    pub fn write_file(mut self, path: &Path) -> Result<WebReport> {
        let mut inline = self.about_tag();
        let mut still = String::new();
        let modules = MODULES.map(|(name, text)| (format!("module:{name}"), gzip(&[text.as_bytes()])));
        for (name, bytes) in self.files.drain(..).chain(modules) {
            let bytes = BASE64.encode(bytes);
            if name == STILL {
                still = format!("data:image/jpeg;base64,{bytes}");
            } else {
                inline += &format!("<script type=\"text/plain\" data-file=\"{name}\">{bytes}</script>\n");
            }
        }
        inline += concat!(
            "<script>",
            include_str!("../../../assets/web/unpack.js"),
            "</script>"
        );
        let page = PAGE.replace(PLACE, &inline).replace(STILL, &still);
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

fn moment_file(moment: usize) -> String {
    format!("moment{moment}.gz")
}

/// A picture as the page shows it, as JPEG.
fn still(picture: &Picture, view: &View) -> Result<Vec<u8>> {
    let rgba = tone_mapping::display_rgba8(picture, view.exposure_stops, view.tone_map);
    let rgb: Vec<u8> = rgba
        .chunks_exact(4)
        .flat_map(|rgba| &rgba[..3])
        .copied()
        .collect();
    let mut bytes = Vec::new();
    let mut encoder = JpegEncoder::new_with_quality(&mut bytes, STILL_QUALITY);
    let written = encoder.encode(&rgb, picture.width, picture.height, ExtendedColorType::Rgb8);
    written.map_err(|reason| {
        let what = format!("the still picture cannot be encoded ({reason})");
        Error::failure(&view.camera.name, what, "choose another first camera")
    })?;
    Ok(bytes)
}
