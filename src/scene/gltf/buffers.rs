//! Binary data of a file: buffers, and views into them.

use std::borrow::Cow;
use std::path::Path;

use gltf::json::{Index, Root, buffer};

use super::report::{Budget, Report};
use super::uri;
use crate::error::{Error, Result};

/// All buffers of a file.
#[derive(Debug)]
pub struct Buffers<'a> {
    views: &'a [buffer::View],
    /// `None` for a buffer that is a mere placeholder.
    data: Vec<Option<Cow<'a, [u8]>>>,
}

/// A range of a buffer.
#[derive(Clone, Copy, Debug)]
pub struct View<'a> {
    /// Its bytes.
    pub data: &'a [u8],
    /// Bytes from one element to the next, where they are not packed.
    pub stride: Option<usize>,
}

impl<'a> Buffers<'a> {
    /// Reads every buffer of the file.
    ///
    /// # Errors
    /// A buffer that cannot be read or is shorter than the file states; more memory than the budget has.
    pub fn resolve(
        root: &'a Root,
        binary: Option<&'a [u8]>,
        folder: &Path,
        budget: &mut Budget,
        report: &mut Report,
    ) -> Result<Self> {
        let mut data = Vec::with_capacity(root.buffers.len());
        for (index, buffer) in root.buffers.iter().enumerate() {
            let owner = format!("buffer {index}");
            let bytes: Option<Cow<[u8]>> = match (&buffer.uri, binary) {
                (Some(uri), _) => Some(uri::read(uri, folder, budget.left(), &owner)?.into()),
                (None, Some(binary)) if index == 0 => Some(binary.into()),
                (None, _) => None,
            };
            let Some(bytes) = bytes else {
                report.warn(
                    owner,
                    "has no data",
                    "export the file again if something is missing",
                );
                data.push(None);
                continue;
            };
            if matches!(bytes, Cow::Owned(_)) {
                budget.take(bytes.len() as u64, &owner)?;
            }
            data.push(Some(trimmed(bytes, buffer.byte_length.0, &owner, report)?));
        }
        Ok(Self {
            views: &root.buffer_views,
            data,
        })
    }

    /// The bytes of a view. `owner` says who wants them.
    ///
    /// # Errors
    /// A view that does not exist or does not lie within its buffer.
    pub fn view(&self, view: Index<buffer::View>, owner: &str) -> Result<View<'_>> {
        let index = view.value();
        let broken = |what: String| Error::failure(owner, what, "export the file again");
        let Some(view) = self.views.get(index) else {
            return Err(broken(format!(
                "refers to buffer view {index}, which does not exist"
            )));
        };
        let buffer = view.buffer.value();
        let Some(Some(data)) = self.data.get(buffer) else {
            return Err(broken(format!(
                "needs buffer {buffer}, which does not exist or has no data"
            )));
        };
        let start = view.byte_offset.unwrap_or_default().0;
        let range = start.checked_add(view.byte_length.0).and_then(|end| {
            let range = usize::try_from(start).ok()?..usize::try_from(end).ok()?;
            data.get(range)
        });
        let Some(data) = range else {
            return Err(broken(format!(
                "needs buffer view {index}, which ends beyond its buffer"
            )));
        };
        Ok(View {
            data,
            stride: view.byte_stride.map(|stride| stride.0),
        })
    }
}

/// Exactly the stated bytes of a buffer.
fn trimmed<'a>(bytes: Cow<'a, [u8]>, stated: u64, owner: &str, report: &mut Report) -> Result<Cow<'a, [u8]>> {
    let held = bytes.len() as u64;
    if held < stated {
        return Err(Error::failure(
            owner,
            format!("holds {held} bytes where the file states {stated}"),
            "copy or export the file again",
        ));
    }
    // Chunks of a binary file are padded to four bytes.
    if held >= stated + 4 || stated == 0 {
        report.warn(
            owner,
            format!("holds {held} bytes where the file states {stated}; the rest was ignored"),
            "export the file again if something is missing",
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
