//! Accessors, checked against their buffers before any memory is allocated.

use gltf::json::accessor::{Accessor, ComponentType, Type, sparse::Sparse};
use gltf::json::validation::Checked;
use gltf::json::{Index, Root, buffer};

use super::buffers::Buffers;
use super::context::{LoadContext, damaged};
use crate::error::{Error, Result};

/// Reads the accessors of a file.
#[derive(Clone, Copy, Debug)]
pub struct Reader<'a> {
    pub root: &'a Root,
    pub buffers: &'a Buffers<'a>,
}

/// Extension that allows integers in vertex attributes.
const QUANTISATION: &str = "KHR_mesh_quantization";

/// Component formats that vectors may have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Formats {
    /// 32-bit floats and, if the file uses KHR_mesh_quantization, integers of 8 and 16 bits.
    Float,
    /// The same, and normalised unsigned integers of 8 and 16 bits, [0, 1].
    FloatOrShare,
    /// Floats, and normalised signed integers of 8 and 16 bits, [−1, 1].
    FloatOrSigned,
    /// Unsigned integers of 8 and 16 bits.
    Index,
}

impl Formats {
    fn have(self, component: ComponentType, is_normalised: bool, is_quantised: bool) -> bool {
        match component {
            ComponentType::F32 => self != Self::Index,
            ComponentType::U32 => false,
            ComponentType::U8 | ComponentType::U16 if self == Self::FloatOrShare && is_normalised => true,
            ComponentType::U8 | ComponentType::U16 if self == Self::Index => !is_normalised,
            ComponentType::I8 | ComponentType::I16 if self == Self::FloatOrSigned => is_normalised,
            _ => is_quantised && matches!(self, Self::Float | Self::FloatOrShare),
        }
    }
}

impl Reader<'_> {
    /// Vectors of N numbers. `owner` is named in errors.
    ///
    /// # Errors
    /// A missing accessor, a format that is not allowed, data beyond the buffer, too little memory.
    pub fn vectors<const N: usize>(
        &self,
        index: Index<Accessor>,
        formats: Formats,
        owner: &str,
        load: &mut LoadContext,
    ) -> Result<Vec<[f64; N]>> {
        // Shape and format are checked before any bytes are read, as the file may state anything.
        let accessor = self.get(index, owner)?;
        let is_quantised = self.root.extensions_used.iter().any(|name| name == QUANTISATION);
        let component = match (accessor.type_, accessor.component_type) {
            (Checked::Valid(shape), Checked::Valid(component)) if shape.multiplicity() == N => {
                Some(component.0)
            }
            _ => None,
        };
        let is_normalised = accessor.normalized;
        let Some(component) =
            component.filter(|component| formats.have(*component, is_normalised, is_quantised))
        else {
            return Err(broken(
                owner,
                format!(
                    "accessor {} has a format that glTF does not allow there",
                    index.value()
                ),
            ));
        };

        // Each number takes eight bytes from here on, up to eight times what the buffer holds.
        let bytes = self.packed(accessor, N * component.size(), owner, load)?;
        load.take((accessor.count.0).saturating_mul(8 * N as u64), owner)?;
        let numbers = bytes.chunks_exact(component.size());
        let numbers: Vec<f64> = numbers
            .map(|bytes| number(component, is_normalised, bytes))
            .collect();
        Ok(numbers.as_chunks().0.to_vec())
    }

    /// Whether an accessor holds floats: numbers that may have been rounded when the file was written.
    pub fn has_floats(&self, index: Index<Accessor>) -> bool {
        let component = self
            .root
            .accessors
            .get(index.value())
            .map(|accessor| accessor.component_type);
        matches!(component, Some(Checked::Valid(component)) if component.0 == ComponentType::F32)
    }

    /// Vertex indices.
    ///
    /// # Errors
    /// Those of [`vectors`](Self::vectors).
    pub fn indices(&self, index: Index<Accessor>, owner: &str, load: &mut LoadContext) -> Result<Vec<u32>> {
        let accessor = self.get(index, owner)?;
        let component = match (&accessor.type_, &accessor.component_type) {
            (Checked::Valid(Type::Scalar), Checked::Valid(component)) => component.0,
            _ => ComponentType::F32,
        };
        if !matches!(
            component,
            ComponentType::U8 | ComponentType::U16 | ComponentType::U32
        ) {
            return Err(broken(
                owner,
                format!(
                    "accessor {} has a format that glTF does not allow for indices",
                    index.value()
                ),
            ));
        }
        let bytes = self.packed(accessor, component.size(), owner, load)?;
        Ok(bytes.chunks_exact(component.size()).map(unsigned).collect())
    }

    fn get(&self, index: Index<Accessor>, owner: &str) -> Result<&Accessor> {
        let index = index.value();
        let found = self.root.accessors.get(index);
        found.ok_or_else(|| broken(owner, format!("refers to accessor {index}, which does not exist")))
    }

    /// Elements of an accessor without gaps, sparse ones filled in.
    fn packed(
        &self,
        accessor: &Accessor,
        element: usize,
        owner: &str,
        load: &mut LoadContext,
    ) -> Result<Vec<u8>> {
        let bytes = accessor.count.0.saturating_mul(element as u64);
        let mut packed = match accessor.buffer_view {
            // The buffer limits the number of elements.
            Some(view) => {
                let offset = accessor.byte_offset.unwrap_or_default().0;
                self.elements(view, offset, accessor.count.0, element, owner)?
            }
            // Without a view all elements are zero, and only the budget limits their number.
            None => {
                load.take(bytes, owner)?;
                vec![0; bytes as usize]
            }
        };
        if let Some(sparse) = &accessor.sparse {
            self.fill_in(sparse, element, &mut packed, owner)?;
        }
        Ok(packed)
    }

    fn fill_in(&self, sparse: &Sparse, element: usize, packed: &mut [u8], owner: &str) -> Result<()> {
        let Checked::Valid(component) = sparse.indices.component_type else {
            return Err(broken(owner, "has sparse indices of an unknown format"));
        };

        // Sparse data are two packed lists: which elements are replaced, and by what.
        let (count, width) = (sparse.count.0, component.0.size());
        let indices = self.elements(
            sparse.indices.buffer_view,
            sparse.indices.byte_offset.0,
            count,
            width,
            owner,
        )?;
        let values = self.elements(
            sparse.values.buffer_view,
            sparse.values.byte_offset.0,
            count,
            element,
            owner,
        )?;

        // Indices are untrusted: each must name an element of the accessor.
        for (index, value) in indices
            .chunks_exact(width)
            .map(unsigned)
            .zip(values.chunks_exact(element))
        {
            let start = (index as usize).saturating_mul(element);
            let Some(target) = packed.get_mut(start..start.saturating_add(element)) else {
                return Err(broken(
                    owner,
                    format!("has a sparse value for element {index}, which does not exist"),
                ));
            };
            target.copy_from_slice(value);
        }
        Ok(())
    }

    /// `count` elements of a view, without gaps.
    fn elements(
        &self,
        view: Index<buffer::View>,
        offset: u64,
        count: u64,
        element: usize,
        owner: &str,
    ) -> Result<Vec<u8>> {
        // Elements may be interleaved with other attributes, but not overlap.
        let index = view.value();
        let view = self.buffers.view(view, owner)?;
        let stride = view.stride.unwrap_or(element);
        if stride < element {
            return Err(broken(
                owner,
                format!("buffer view {index} has a stride of {stride} bytes for elements of {element}"),
            ));
        }
        if count == 0 {
            return Ok(Vec::new());
        }

        // The last element needs no room beyond its own bytes; sums of stated numbers may overflow.
        let end = (count - 1)
            .checked_mul(stride as u64)
            .and_then(|last| last.checked_add(offset)?.checked_add(element as u64));
        if end.is_none_or(|end| end > view.data.len() as u64) {
            return Err(broken(
                owner,
                format!(
                    "{count} elements do not fit into buffer view {index}, which has {} bytes",
                    view.data.len()
                ),
            ));
        }
        let data = &view.data[offset as usize..];
        Ok(data
            .chunks(stride)
            .take(count as usize)
            .flat_map(|bytes| &bytes[..element])
            .copied()
            .collect())
    }
}

/// Decodes a little-endian number, which is in [−1, 1] if normalised.
fn number(component: ComponentType, is_normalised: bool, bytes: &[u8]) -> f64 {
    let (number, most) = match (component, bytes) {
        (ComponentType::F32, &[a, b, c, d]) => return f64::from(f32::from_le_bytes([a, b, c, d])),
        (ComponentType::I16, &[a, b]) => (f64::from(i16::from_le_bytes([a, b])), f64::from(i16::MAX)),
        (ComponentType::I8, &[a]) => (f64::from(a as i8), f64::from(i8::MAX)),
        (ComponentType::U16, _) => (f64::from(unsigned(bytes)), f64::from(u16::MAX)),
        _ => (f64::from(unsigned(bytes)), f64::from(u8::MAX)),
    };
    if is_normalised {
        (number / most).max(-1.0)
    } else {
        number
    }
}

/// A little-endian number of one, two or four bytes.
fn unsigned(bytes: &[u8]) -> u32 {
    bytes
        .iter()
        .rev()
        .fold(0, |value, byte| value << 8 | u32::from(*byte))
}

fn broken(owner: &str, what: impl Into<String>) -> Error {
    damaged(owner, what)
}
