//! A page to walk through baked maps in a browser: a folder that any server serves, or one file that opens from the disk.
//! The page draws with the program's own shaders by WebGPU; without it, it shows a still picture. Nothing is fetched from
//! elsewhere.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;
use image::ExtendedColorType;
use image::codecs::jpeg::JpegEncoder;
use serde::Serialize;
use serde_json::{Value, json};

use self::layers::{ShownMap, Texture};
use self::packed::{Packed, gzip};
use crate::error::{Error, Result, Warning};
use crate::export::map_set::MapSet;
use crate::export::textures::shared_exponent::RGB9E5;
use crate::export::textures::texels::Texels;
use crate::eye_pass::renderer::{Content, WebScene};
use crate::eye_pass::{Picture, ToneMap, View, tone_mapping};
use crate::files::{self, OutputFolder, StagedFolder};
use crate::illumination::false_colours::viridis;
use crate::illumination::{IlluminationMap, Receiver};
use crate::progress::Control;
use crate::scene::{Camera, Environment, Scene};
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
/// Where its scripts' data begins.
const ABOUT: &str = "<script type=\"application/json\" id=\"about\">";
/// Most that a page of a folder has [bytes].
const MAX_PAGE_BYTES: u64 = 16 << 20;

/// What names of packed files and of the still picture end with.
const ENDS: [&str; 2] = [".gz", ".jpg"];

/// Name of a file in the folder, name by which scripts import it, and the file.
type Module = (&'static str, &'static str, &'static str);

macro_rules! module {
    ($name:literal) => {
        (
            concat!($name, ".js"),
            $name,
            include_str!(concat!("../../../assets/web/", $name, ".js")),
        )
    };
}

const MODULES: [Module; 6] = [
    module!("page"),
    module!("files"),
    module!("eye_pass"),
    module!("geometry"),
    module!("navigation"),
    module!("motion"),
];

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
    /// What there is, so far.
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
        let mut shown: BTreeMap<Receiver, ShownMap> = BTreeMap::new();
        for (moment, set) in moments.iter().enumerate() {
            for map in set.read_all()? {
                if control.is_cancelled() {
                    return Err(Error::cancelled(&scene.source));
                }
                let map = map.dense();
                let shown = shown.entry(map.chart.receiver);
                shown
                    .or_insert_with(|| ShownMap::new(&map.chart))
                    .add(moment, &map);
            }
        }
        let shown: Vec<ShownMap> = shown.into_values().collect();
        let layers = shown.iter().flat_map(|map| &map.moments).flat_map(BTreeMap::keys);
        let layers: BTreeSet<LayerKind> = layers.copied().collect();
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
        let moment_files = site.push_moments(moments, &shown, control)?;
        let cameras = site.push_still(scene, eye)?;
        let names: Vec<&str> = site.files.iter().map(|(name, _)| &**name).collect();
        let (low, high) = scene.bounds().unwrap_or_default();
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
            "moments": moment_files,
            "fps": first.fps(),
            "files": names,
        });
        site.note_missing_light(scene, first);
        Ok(site)
    }

    /// Adds a file of each moment; returns their names.
    fn push_moments(
        &mut self,
        moments: &[MapSet<'_>],
        shown: &[ShownMap],
        control: &Control,
    ) -> Result<Vec<String>> {
        let stand_ins: Vec<IlluminationMap> =
            shown.iter().map(|map| map.stand_in(moments[0].scene())).collect();
        let mut first: BTreeMap<String, Content> = BTreeMap::new();
        let mut names = Vec::new();
        for (moment, set) in moments.iter().enumerate() {
            if control.is_cancelled() {
                return Err(Error::cancelled(&set.scene().source));
            }
            let made = WebScene::new(set.scene(), &stand_ins)?;
            let (mut description, mut contents) = (made.description, BTreeMap::new());
            contents.extend(
                made.contents
                    .into_iter()
                    .map(|(name, content)| (name.to_owned(), content)),
            );
            for (index, (map, tiles)) in shown.iter().zip(made.map_tiles).enumerate() {
                contents.insert(format!("tiles{index}"), tiles);
                for (kind, texture) in map.moments.get(moment).into_iter().flatten() {
                    contents.insert(format!("{}{index}", kind.name()), texture.content.clone());
                }
            }
            description["maps"] = shown.iter().map(|map| map.sizes(moment)).collect();
            if let Some(environment) = &set.scene().environment {
                let (texture, scale) = sky(environment);
                description["textures"]["sky"] = json!({"size": texture.size(), "scale": scale});
                contents.insert("sky".into(), texture.content);
            }
            let mut packed = Packed::default();
            for (name, content) in &contents {
                packed.add(name, content, first.get(name));
            }
            match moment {
                0 => {
                    first = contents;
                    self.report.warnings.extend(made.refusal.map(warning));
                }
                // The programs are those of the first.
                _ => description["programs"] = Value::Null,
            }
            names.push(format!("moment{moment}.gz"));
            self.files.push((names[moment].clone(), packed.file(description)));
        }
        Ok(names)
    }

    /// Adds the still picture; returns what the page reads of each camera, of which there is at least one.
    fn push_still(&mut self, scene: &Scene, eye: &Eye<'_>) -> Result<Vec<Value>> {
        let aspect = f64::from(STILL_SIZE[0]) / f64::from(STILL_SIZE[1]);
        let all = || Camera::framing("all", scene.bounds().unwrap_or_default(), aspect);
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

    fn note_missing_light(&mut self, scene: &Scene, set: &MapSet<'_>) {
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
        for (file, text) in texts.chain([("index.html", &*PAGE.replace(PLACE, &scripts))]) {
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
        let mut still = String::new();
        let modules = MODULES.iter().map(|(_, name, text)| {
            let name = format!("module:{name}");
            (name, gzip(&[text.as_bytes()]))
        });
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
        let is_known = |byte: u8| byte.is_ascii_alphanumeric() || byte == b'.';
        !name.starts_with('.') && name.bytes().all(is_known) && ENDS.iter().any(|end| name.ends_with(end))
    };
    Some(names.filter(is_plain).map(str::to_owned).collect())
}

/// A texture of an environment, and what its values are multiplied by.
fn sky(environment: &Environment) -> (Texture, f32) {
    let peak = environment.pixels().iter().flatten().copied().fold(0.0, f32::max);
    // Powers of two are lossless.
    let scale = (peak / RGB9E5.most).log2().ceil().exp2().max(1.0);
    let scaled = environment
        .pixels()
        .iter()
        .map(|pixel| pixel.map(|channel| channel / scale));
    let mut texels = Texels::of(environment.size(), scaled.collect());
    while texels.size().0 > sizes::MAX_SIDE {
        texels = texels.halved();
    }
    (Texture::new(&texels), scale)
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

fn warning(error: Error) -> Warning {
    let Error {
        location,
        what,
        remedy,
        ..
    } = error;
    Warning::new(location, what, remedy)
}
