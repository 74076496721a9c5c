//! KHR_draco_mesh_compression: decodes the vertices and triangles of a primitive.

use std::collections::BTreeMap;

use draco_core::{DataType, DecodeLimits, DecoderBuffer, Mesh, MeshDecoder};
use gltf::json::Index;
use gltf::json::mesh::{Primitive, Semantic};
use gltf::json::validation::Checked;
use serde::Deserialize;

use super::accessor::Reader;
use super::context::{LoadContext, damaged};
use super::guard;
use crate::error::Result;

pub const NAME: &str = "KHR_draco_mesh_compression";

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct DracoExtension {
    buffer_view: u32,
    /// Identifiers of the attributes within the compressed data.
    attributes: BTreeMap<String, u32>,
}

/// A decompressed primitive.
pub struct Unpacked {
    mesh: Mesh,
    attributes: BTreeMap<String, u32>,
}

/// Decompresses a primitive; `None` if it is not compressed, or the file also has its uncompressed data.
///
/// # Errors
/// Damaged data; more memory than the budget has left.
pub fn unpack(
    reader: Reader,
    primitive: &Primitive,
    owner: &str,
    load: &mut LoadContext,
) -> Result<Option<Unpacked>> {
    // A position accessor with a view of its own states the same data uncompressed, which costs less to read.
    let extensions = primitive.extensions.as_ref();
    let Some(stated) = extensions.and_then(|extensions| extensions.others.get(NAME)) else {
        return Ok(None);
    };
    let positions = primitive.attributes.get(&Checked::Valid(Semantic::Positions));
    let accessor = positions.and_then(|index| reader.root.accessors.get(index.value()));
    if accessor.is_some_and(|accessor| accessor.buffer_view.is_some()) {
        return Ok(None);
    }

    // One view holds all attributes and triangles of the primitive.
    let damaged = |why: &str| {
        let what = format!("its Draco data cannot be unpacked ({why})");
        damaged(owner, what)
    };
    let stated = DracoExtension::deserialize(stated).map_err(|error| damaged(&error.to_string()))?;
    let data = reader.buffers.view(Index::new(stated.buffer_view), owner)?.data;

    // Decompression takes several times the memory of its result.
    let most = load.left() / 4;
    let limits = DecodeLimits::default()
        .with_max_points(most / 12)
        .with_max_faces(most / 12)
        .with_max_decoded_bytes(most);

    // Crafted data may make the decoder panic, which must not end the program.
    let mut mesh = Mesh::new();
    let unpacked = guard::without_panic(|| {
        let mut buffer = DecoderBuffer::new(data).with_limits(limits);
        MeshDecoder::new().decode(&mut buffer, &mut mesh)
    });
    match unpacked {
        Some(Ok(())) => {}
        Some(Err(error)) => return Err(damaged(&error.to_string().replace('\n', " "))),
        None => return Err(damaged("it breaks off")),
    }

    // Counts three numbers of four bytes for each triangle and each attribute of a vertex.
    let bytes = 12 * mesh.num_faces() as u64 + 12 * mesh.num_points() as u64 * stated.attributes.len() as u64;
    load.take(bytes, owner)?;
    Ok(Some(Unpacked {
        mesh,
        attributes: stated.attributes,
    }))
}

impl Unpacked {
    /// Vertex indices, three per triangle.
    pub fn indices(&self) -> Vec<u32> {
        let faces = self.mesh.faces().iter().flatten();
        faces.map(|point| point.0).collect()
    }

    /// An attribute, with integers mapped to [−1, 1] if `normalised`; `None` if the data have none of N components.
    pub fn vectors<const N: usize>(&self, semantic: &Semantic, normalised: bool) -> Option<Vec<[f64; N]>> {
        let id = *self.attributes.get(&semantic.to_string())?;
        let attribute = self.mesh.attribute_by_unique_id(id)?;
        if usize::from(attribute.num_components()) != N {
            return None;
        }
        let scale = match attribute.data_type() {
            DataType::Int8 if normalised => f64::from(i8::MAX),
            DataType::Uint8 if normalised => f64::from(u8::MAX),
            DataType::Int16 if normalised => f64::from(i16::MAX),
            DataType::Uint16 if normalised => f64::from(u16::MAX),
            _ => 1.0,
        };
        // Signed integers reach one step below −1.
        let bounded = |number: f64| if normalised { number.max(-1.0) } else { number };
        let numbers = attribute.read_f32s(self.mesh.num_points(), N);
        let vectors = numbers.as_chunks::<N>().0.iter();
        Some(
            vectors
                .map(|vector| vector.map(|number| bounded(f64::from(number) / scale)))
                .collect(),
        )
    }

    pub fn has(&self, semantic: &Semantic) -> bool {
        self.attributes.contains_key(&semantic.to_string())
    }
}
