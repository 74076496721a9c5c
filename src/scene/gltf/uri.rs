//! Buffers and images that a file refers to by URI: data within the URI, or a file in the scene's own folder.

use std::path::{Component, Path, PathBuf};

use base64::Engine as _;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};

use crate::error::{Error, Result};
use crate::files;

/// Writers leave the padding out, or something in its bits.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new()
        .with_decode_padding_mode(DecodePaddingMode::Indifferent)
        .with_decode_allow_trailing_bits(true),
);

/// Bytes of a kind as a URI of their own.
pub fn data(kind: &str, bytes: &[u8]) -> String {
    format!("data:{kind};base64,{}", BASE64.encode(bytes))
}

/// The bytes behind a URI, at most `max_bytes`.
///
/// # Errors
/// Another scheme than `data:`; a path that leaves `folder`; a missing or too large file; data that is no base64.
/// `owner` says whose URI it is.
pub fn read(uri: &str, folder: &Path, max_bytes: u64, owner: &str) -> Result<Vec<u8>> {
    if let Some(data) = strip_prefix_ignoring_case(uri, "data:") {
        return read_data(data, owner);
    }
    let path = path_within(folder, uri, owner)?;
    files::read_file(&path, max_bytes)
}

fn read_data(data: &str, owner: &str) -> Result<Vec<u8>> {
    let refused = |what: &str| Error::failure(owner, what, "export the file again");
    let Some((kind, payload)) = data.split_once(',') else {
        return Err(refused("its data URI has no data"));
    };
    if kind.to_ascii_lowercase().ends_with(";base64") {
        let bytes = BASE64.decode(payload);
        return bytes.map_err(|_| refused("its data URI is not valid base64"));
    }
    percent_decode(payload).ok_or_else(|| refused("its data URI is not valid"))
}

/// The file that a URI names, where it may be read.
pub fn file(uri: &str, folder: &Path) -> Option<PathBuf> {
    // Data, and texts that no system takes for a name.
    const MAX_BYTES: usize = 1024;
    if uri.len() > MAX_BYTES {
        return None;
    }
    path_within(folder, uri, "").ok()
}

/// A relative path below the folder. A file from elsewhere must not make us open what it likes.
fn path_within(folder: &Path, uri: &str, owner: &str) -> Result<PathBuf> {
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
    let has_scheme = uri.split_once(':').is_some_and(|(scheme, _)| {
        scheme.starts_with(|c: char| c.is_ascii_alphabetic())
            && scheme
                .chars()
                .all(|c| c.is_ascii_alphanumeric() || "+-.".contains(c))
    });
    if has_scheme {
        return Err(refused(
            "its URI has a scheme, and nothing is read from elsewhere",
        ));
    }
    let decoded = percent_decode(uri).and_then(|bytes| String::from_utf8(bytes).ok());
    let Some(relative) = decoded.filter(|path| !path.is_empty() && !path.contains('\0')) else {
        return Err(refused("its URI is not valid"));
    };
    // Backslashes and drives are path syntax on Windows only; refused everywhere, so that a scene reads alike.
    let mut components = Path::new(&relative).components();
    let stays = components.all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
    if !stays || relative.contains('\\') || relative.contains(':') {
        return Err(refused("its URI is no relative path within the scene's folder"));
    }
    Ok(folder.join(relative))
}

/// Percent-encoding (RFC 3986, section 2.1) resolved; `None` where it is broken.
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
