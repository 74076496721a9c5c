//! Generated texture coordinates beside a map: the eight bytes `NEPHUV01`, the number of triangles as a 64-bit integer,
//! then for each triangle of the primitive, in its order, u and v of its three corners as 64-bit floats in [0, 1].
//! Little-endian.

use glam::DVec2;

use crate::error::{Error, Result};

const MAGIC: &[u8; 8] = b"NEPHUV01";
const HEADER_BYTES: usize = 16;
const TRIANGLE_BYTES: usize = 48;

/// Size of a file for a number of triangles [bytes].
pub fn size_bytes(triangles: usize) -> u64 {
    (HEADER_BYTES + TRIANGLE_BYTES * triangles) as u64
}

/// Encodes coordinates as a file.
pub fn encode(corner_uvs: &[[DVec2; 3]]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(HEADER_BYTES + TRIANGLE_BYTES * corner_uvs.len());
    bytes.extend(MAGIC);
    bytes.extend((corner_uvs.len() as u64).to_le_bytes());
    for uv in corner_uvs.iter().flatten() {
        bytes.extend(uv.x.to_le_bytes());
        bytes.extend(uv.y.to_le_bytes());
    }
    bytes
}

/// Decodes a file that should hold `triangles` triangles; `location` is named in errors.
///
/// # Errors
/// Another kind of file, another number of triangles, coordinates outside [0, 1].
pub fn decode(bytes: &[u8], triangles: usize, location: &str) -> Result<Vec<[DVec2; 3]>> {
    let unusable = |what: &str| Error::failure(location, what, "bake the scene again");
    let (header, body) = bytes
        .split_at_checked(HEADER_BYTES)
        .filter(|(header, _)| header.starts_with(MAGIC))
        .ok_or_else(|| unusable("this is not a file of texture coordinates"))?;
    if header[MAGIC.len()..] != (triangles as u64).to_le_bytes() || body.len() != triangles * TRIANGLE_BYTES {
        return Err(unusable(
            "its texture coordinates belong to a surface with other triangles",
        ));
    }
    let values: Vec<f64> = body
        .as_chunks::<8>()
        .0
        .iter()
        .map(|value| f64::from_le_bytes(*value))
        .collect();
    if !values.iter().all(|value| (0.0..=1.0).contains(value)) {
        return Err(unusable("its texture coordinates lie outside 0 to 1"));
    }
    let corners: Vec<DVec2> = values
        .as_chunks::<2>()
        .0
        .iter()
        .map(|uv| DVec2::from_array(*uv))
        .collect();
    Ok(corners.as_chunks::<3>().0.to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_come_back_bit_by_bit() {
        let uvs = vec![[DVec2::new(0.1, 0.2), DVec2::ZERO, DVec2::ONE]; 3];
        let bytes = encode(&uvs);
        assert_eq!(decode(&bytes, 3, "a.uv"), Ok(uvs));
        assert!(decode(&bytes, 2, "a.uv").is_err());
        assert!(decode(&bytes[..bytes.len() - 1], 3, "a.uv").is_err());
        assert!(decode(&bytes[..7], 3, "a.uv").is_err());
        assert!(decode(&encode(&[[DVec2::splat(1.5); 3]]), 1, "a.uv").is_err());
    }
}
