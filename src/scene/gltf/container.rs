//! Splits a file into its JSON and binary parts.

use super::context::{LoadContext, damaged};
use crate::error::{Error, Result};

/// Parts of a `.glb` or `.gltf` file.
#[derive(Debug)]
pub struct Container<'a> {
    pub json: &'a [u8],
    pub is_binary: bool,
    /// Binary chunk of a `.glb`.
    pub binary: Option<&'a [u8]>,
    /// Further chunks, with their headers.
    pub others: &'a [u8],
}

pub const HEADER_BYTES: usize = 12;
const CHUNK_HEADER_BYTES: usize = 8;
const JSON_CHUNK: [u8; 4] = *b"JSON";
const BINARY_CHUNK: [u8; 4] = *b"BIN\0";

/// Recognises binary glTF by its first bytes, whatever the name of the file; anything else is taken for JSON.
///
/// # Errors
/// A binary file that is truncated, has another version, or does not begin with a JSON chunk.
pub fn split<'a>(bytes: &'a [u8], load: &mut LoadContext) -> Result<Container<'a>> {
    // A file in text is its own JSON part.
    if !bytes.starts_with(b"glTF") {
        return Ok(Container {
            json: bytes,
            is_binary: false,
            binary: None,
            others: &[],
        });
    }

    // The header has the magic number, the version, and the length of the whole file, as little-endian words.
    let word = |at: usize| {
        let four = bytes.get(at..at + 4)?;
        Some(u32::from_le_bytes(four.try_into().ok()?))
    };
    let (Some(version), Some(length)) = (word(4), word(8)) else {
        return Err(broken("the file ends within its header"));
    };
    if version != 2 {
        return Err(Error::failure(
            "GLB header",
            format!("is version {version} of binary glTF"),
            "export it as glTF 2.0",
        ));
    }

    // A file shorter than stated was cut off; bytes after the stated end are no part of it.
    let length = length as usize;
    if length < HEADER_BYTES || length > bytes.len() {
        return Err(broken(format!(
            "the header states {length} bytes, the file has {}",
            bytes.len()
        )));
    }
    if length < bytes.len() {
        load.warn_damaged(
            "GLB header",
            format!("{} bytes after the stated end were ignored", bytes.len() - length),
        );
    }
    split_chunks(&bytes[HEADER_BYTES..length], load)
}

fn split_chunks<'a>(mut rest: &'a [u8], load: &mut LoadContext) -> Result<Container<'a>> {
    let Some((JSON_CHUNK, json)) = next_chunk(&mut rest)? else {
        return Err(broken("its first chunk is not JSON"));
    };
    let mut binary = None;
    let mut others = rest;
    let mut index = 1;
    while let Some((kind, data)) = next_chunk(&mut rest)? {
        match kind {
            BINARY_CHUNK if index == 1 => (binary, others) = (Some(data), rest),
            // The specification has unknown chunks ignored, but these two have a fixed place.
            BINARY_CHUNK | JSON_CHUNK => {
                load.warn_damaged(format!("GLB chunk {index}"), "has no place there and was ignored")
            }
            _ => {}
        }
        index += 1;
    }
    Ok(Container {
        json,
        is_binary: true,
        binary,
        others,
    })
}

/// Kind and data of the first chunk of `rest`, which is split off.
fn next_chunk<'a>(rest: &mut &'a [u8]) -> Result<Option<([u8; 4], &'a [u8])>> {
    if rest.is_empty() {
        return Ok(None);
    }
    let Some((header, body)) = rest.split_first_chunk::<CHUNK_HEADER_BYTES>() else {
        return Err(broken("the file ends within a chunk's header"));
    };
    let [l0, l1, l2, l3, kind @ ..] = *header;
    let length = u32::from_le_bytes([l0, l1, l2, l3]) as usize;
    if !length.is_multiple_of(4) {
        return Err(broken(format!(
            "a chunk's length of {length} bytes is not a multiple of 4"
        )));
    }
    let Some((data, after)) = body.split_at_checked(length) else {
        return Err(broken(format!(
            "a chunk states {length} bytes where {} are left",
            body.len()
        )));
    };
    *rest = after;
    Ok(Some((kind, data)))
}

fn broken(what: impl Into<String>) -> Error {
    damaged("GLB", what)
}
