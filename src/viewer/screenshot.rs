//! The picture in the window as files: what is seen, without the panel, and the radiance behind it.

use std::path::{Path, PathBuf};

use super::files::free_names;
use crate::error::Result;
use crate::export::picture::{display_png, radiance_exr};
use crate::eye_pass::{Picture, View};
use crate::files;
use crate::optics::spectrum::xyz::Matrix3;

/// Writes `nephroid-SCENE-NNNN.png`, `picture` as `view` shows it in this white balance, and with `has_radiance` `.exr`, its radiance
/// [W/(m² sr)]. The number is the first of which the folder holds neither. Returns what was written.
///
/// # Errors
/// A place that cannot be written, a disk that is full, a folder without a free number: nothing is left there then.
pub fn save(
    folder: &Path,
    scene: &str,
    picture: &Picture,
    view: &View,
    white_balance: &Matrix3,
    has_radiance: bool,
) -> Result<Vec<PathBuf>> {
    let stem = format!("nephroid-{}", files::slug(scene, "scene"));
    let names = |number: &str| ["png", "exr"].map(|extension| format!("{stem}-{number}.{extension}"));
    let [png, exr] = free_names(folder, names)?;
    let location = png.display().to_string();
    let shown = display_png(
        picture,
        view.exposure_stops,
        view.tone_map,
        white_balance,
        &location,
    )?;
    if !has_radiance {
        files::write_atomically(&png, |writer| writer.write_all(&shown))?;
        return Ok(vec![png]);
    }
    let radiance = radiance_exr(picture, &exr.display().to_string())?;
    files::write_atomically(&exr, |writer| writer.write_all(&radiance))?;
    if let Err(error) = files::write_atomically(&png, |writer| writer.write_all(&shown)) {
        // Half a pair would take its number; the first error says more than one about tidying up.
        let _ = files::remove_file(&exr);
        return Err(error);
    }
    Ok(vec![png, exr])
}

/// What is told of files that were written.
pub fn told(files: &[PathBuf]) -> String {
    let names: Vec<_> = files.iter().map(|file| file.display().to_string()).collect();
    format!("Saved {}.", names.join(" and "))
}
