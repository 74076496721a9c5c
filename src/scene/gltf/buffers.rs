//! Binary data of a file: buffers, and views into them.

use std::borrow::Cow;
use std::collections::HashSet;
use std::path::Path;

use gltf::json::{Index, Value, buffer};

use super::context::{LoadContext, damaged};
use super::meshopt::Compressed;
use super::uri;
use crate::error::Result;

#[derive(Debug)]
pub struct Buffers<'a> {
    views: &'a [buffer::View],
    /// `None` for a placeholder buffer.
    data: Vec<Option<Cow<'a, [u8]>>>,
    /// Decompressed views, or what is wrong with them; `None` for uncompressed ones.
    unpacked: Vec<Option<std::result::Result<Vec<u8>, String>>>,
}

#[derive(Clone, Copy, Debug)]
pub struct View<'a> {
    pub data: &'a [u8],
    /// Distance of elements [bytes]; `None` if they are packed.
    pub stride: Option<usize>,
}

impl<'a> Buffers<'a> {
    /// Reads every buffer of the file and decompresses the compressed views.
    ///
    /// # Errors
    /// A buffer that cannot be read or is shorter than stated; more memory than the budget has left.
    pub fn resolve(
        all: &[buffer::Buffer],
        views: &'a [buffer::View],
        binary: Option<&'a [u8]>,
        folder: &Path,
        load: &mut LoadContext,
    ) -> Result<Self> {
        let mut data = Vec::with_capacity(all.len());
        let compressed: Vec<_> = views.iter().map(compression).collect();
        // Buffers that hold compressed views for readers that cannot decompress them.
        let spare: HashSet<usize> = views
            .iter()
            .zip(&compressed)
            .filter_map(|(view, compressed)| compressed.as_ref().map(|_| view.buffer.value()))
            .collect();

        // A spare buffer without data, or one that the file marks as a fallback, need not be read.
        for (index, buffer) in all.iter().enumerate() {
            let owner = format!("buffer {index}");
            let is_binary = index == 0 && binary.is_some();
            if spare.contains(&index) && !is_binary && is_fallback(buffer) {
                data.push(None);
                continue;
            }

            // A first buffer without a URI is the binary chunk, which is borrowed and was counted with the file.
            let bytes: Option<Cow<[u8]>> = match (&buffer.uri, binary) {
                (Some(uri), _) => Some(uri::read(uri, folder, load.left(), &owner)?.into()),
                (None, Some(binary)) if index == 0 => Some(binary.into()),
                (None, _) => None,
            };
            let Some(bytes) = bytes else {
                load.warn_damaged(owner, "has no data");
                data.push(None);
                continue;
            };
            if matches!(bytes, Cow::Owned(_)) {
                load.take(bytes.len() as u64, &owner)?;
            }
            data.push(Some(trimmed(bytes, buffer.byte_length.0, &owner, load)?));
        }

        // A damaged view is no error here: it matters only to those who need it.
        let mut buffers = Self {
            views,
            data,
            unpacked: Vec::new(),
        };
        for (index, compressed) in compressed.into_iter().enumerate() {
            let unpacked = match compressed {
                None => None,
                Some(Err(error)) => Some(Err(error.to_string())),
                Some(Ok(stated)) => Some(buffers.unpack(&stated, index, load)?),
            };
            buffers.unpacked.push(unpacked);
        }
        Ok(buffers)
    }

    fn unpack(
        &self,
        stated: &Compressed,
        view: usize,
        load: &mut LoadContext,
    ) -> Result<std::result::Result<Vec<u8>, String>> {
        let Some(data) = self.range(stated.buffer, stated.byte_offset, stated.byte_length) else {
            return Ok(Err("its data does not lie within a buffer".into()));
        };
        let Some(bytes) = stated.unpacked_bytes() else {
            return Ok(Err("its size cannot be right".into()));
        };
        load.take(bytes, &format!("buffer view {view}"))?;
        Ok(stated.unpack(data).ok_or_else(|| "its data is damaged".into()))
    }

    fn range(&self, buffer: usize, start: u64, length: u64) -> Option<&[u8]> {
        let end = start.checked_add(length)?;
        let range = usize::try_from(start).ok()?..usize::try_from(end).ok()?;
        self.data.get(buffer)?.as_ref()?.get(range)
    }

    /// Bytes of a view. `owner` is named in errors.
    ///
    /// # Errors
    /// A view that does not exist or does not lie within its buffer.
    pub fn view(&self, view: Index<buffer::View>, owner: &str) -> Result<View<'_>> {
        let index = view.value();
        let broken = |what: String| damaged(owner, what);
        let Some(view) = self.views.get(index) else {
            return Err(broken(format!(
                "refers to buffer view {index}, which does not exist"
            )));
        };
        let stride = view.byte_stride.map(|stride| stride.0);

        // Compressed views are whole by themselves; their buffer may be a placeholder.
        if let Some(unpacked) = &self.unpacked[index] {
            return match unpacked {
                Ok(data) => Ok(View { data, stride }),
                Err(why) => Err(broken(format!(
                    "needs buffer view {index}, which cannot be unpacked ({why})"
                ))),
            };
        }

        // Offset and length come from the file and must lie within the bytes that were read.
        let buffer = view.buffer.value();
        if self.data.get(buffer).is_none_or(Option::is_none) {
            return Err(broken(format!(
                "needs buffer {buffer}, which does not exist or has no data"
            )));
        }
        let start = view.byte_offset.unwrap_or_default().0;
        let Some(data) = self.range(buffer, start, view.byte_length.0) else {
            return Err(broken(format!(
                "needs buffer view {index}, which ends beyond its buffer"
            )));
        };
        Ok(View { data, stride })
    }
}

/// Compression parameters of a view, if it is compressed.
fn compression(view: &buffer::View) -> Option<serde_json::Result<Compressed>> {
    Compressed::stated(&view.extensions.as_ref()?.others)
}

/// Whether a buffer has no data of its own, or only a fallback for compressed views.
fn is_fallback(buffer: &buffer::Buffer) -> bool {
    let is_marked = |stated: &Value| stated.get("fallback") == Some(&Value::Bool(true));
    let mut stated = buffer
        .extensions
        .iter()
        .flat_map(|extensions| extensions.others.values());
    buffer.uri.is_none() || stated.any(is_marked)
}

/// Exactly the stated bytes of a buffer.
fn trimmed<'a>(
    bytes: Cow<'a, [u8]>,
    stated: u64,
    owner: &str,
    load: &mut LoadContext,
) -> Result<Cow<'a, [u8]>> {
    let held = bytes.len() as u64;
    if held < stated {
        return Err(damaged(
            owner,
            format!("holds {held} bytes where the file states {stated}"),
        ));
    }
    // Chunks of a binary file are padded to four bytes.
    if held >= stated + 4 || stated == 0 {
        load.warn_damaged(
            owner,
            format!("holds {held} bytes where the file states {stated}; the rest was ignored"),
        );
    }
    let stated = stated as usize;
    Ok(match bytes {
        Cow::Borrowed(bytes) => Cow::Borrowed(&bytes[..stated]),
        Cow::Owned(mut bytes) => {
            bytes.truncate(stated);
            Cow::Owned(bytes)
        }
    })
}
