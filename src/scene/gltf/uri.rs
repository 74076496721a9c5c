//! Buffers and images that a file refers to by URI: data within the URI, or a file in the scene's own folder.

use std::path::{Component, Path, PathBuf};

use base64::Engine as _;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};

use super::context::damaged;
use crate::error::{Error, Result};
use crate::files;

/// Tolerant, since some writers omit the padding or leave bits set in it.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new()
        .with_decode_padding_mode(DecodePaddingMode::Indifferent)
        .with_decode_allow_trailing_bits(true),
);

/// Data URI of bytes with a media type.
pub fn data(kind: &str, bytes: &[u8]) -> String {
    format!("data:{kind};base64,{}", BASE64.encode(bytes))
}

/// Content behind a URI, at most `max_bytes`.
///
/// # Errors
/// Another scheme than `data:`; a path that leaves `folder`; a missing or too large file; invalid base64. `owner` is
/// named in errors.
pub fn read(uri: &str, folder: &Path, max_bytes: u64, owner: &str) -> Result<Vec<u8>> {
    if let Some(data) = strip_prefix_ignoring_case(uri, "data:") {
        return read_data(data, owner);
    }
    let path = path_within(folder, uri, owner)?;
    files::read_file(&path, max_bytes)
}

fn read_data(data: &str, owner: &str) -> Result<Vec<u8>> {
    let refused = |what: &str| damaged(owner, what);
    let Some((kind, payload)) = data.split_once(',') else {
        return Err(refused("its data URI has no data"));
    };
    if kind.to_ascii_lowercase().ends_with(";base64") {
        let bytes = BASE64.decode(payload);
        return bytes.map_err(|_| refused("its data URI is not valid base64"));
    }
    percent_decode(payload).ok_or_else(|| refused("its data URI is not valid"))
}

/// Path of the file that a URI names; `None` if it may not be read.
pub fn file(uri: &str, folder: &Path) -> Option<PathBuf> {
    // Longer strings are data, or too long for a file name on any system.
    const MAX_BYTES: usize = 1024;
    if uri.len() > MAX_BYTES {
        return None;
    }
    path_within(folder, uri, "").ok()
}

/// Resolves a relative path below `folder`. Files from elsewhere are refused, since a scene must not make the program
/// open arbitrary ones.
fn path_within(folder: &Path, uri: &str, owner: &str) -> Result<PathBuf> {
    // The message quotes untrusted text, which must neither fill the screen nor steer the terminal.
    let refused = |what: &str| {
        Error::failure(
            owner,
            format!(
                "{what} (`{}`)",
                uri.chars()
                    .take(80)
                    .filter(|c| !c.is_control())
                    .collect::<String>()
            ),
            "put the file into the scene's folder and refer to it by a relative path",
        )
    };

    // Whatever has a scheme (RFC 3986, section 3.1) lies elsewhere; a drive letter of Windows looks like one.
    let has_scheme = uri.split_once(':').is_some_and(|(scheme, _)| {
        scheme.starts_with(|c: char| c.is_ascii_alphabetic())
            && scheme
                .chars()
                .all(|c| c.is_ascii_alphanumeric() || "+-.".contains(c))
    });
    if has_scheme {
        return Err(refused("its URI does not name a local file"));
    }

    // Encoded dots and slashes are decoded before the path is judged, or they would leave the folder unseen.
    let decoded = percent_decode(uri).and_then(|bytes| String::from_utf8(bytes).ok());
    let Some(relative) = decoded.filter(|path| !path.is_empty() && !path.contains('\0')) else {
        return Err(refused("its URI is not valid"));
    };
    // Backslashes separate folders on Windows only, where some writers leave them; read everywhere, so that a scene
    // reads the same on all systems. Drives are refused everywhere.
    let relative = relative.replace('\\', "/");
    let mut components = Path::new(&relative).components();
    let stays = components.all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
    if !stays || relative.contains(':') {
        return Err(refused(
            "its URI is not a relative path within the scene's folder",
        ));
    }
    Ok(folder.join(relative))
}

/// Resolves percent-encoding (RFC 3986, section 2.1); `None` if it is malformed.
fn percent_decode(text: &str) -> Option<Vec<u8>> {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.bytes();
    while let Some(byte) = rest.next() {
        if byte == b'%' {
            let mut digit = || char::from(rest.next()?).to_digit(16);
            bytes.push((16 * digit()? + digit()?) as u8);
        } else {
            bytes.push(byte);
        }
    }
    Some(bytes)
}

fn strip_prefix_ignoring_case<'a>(text: &'a str, prefix: &str) -> Option<&'a str> {
    let (head, tail) = text.split_at_checked(prefix.len())?;
    head.eq_ignore_ascii_case(prefix).then_some(tail)
}
