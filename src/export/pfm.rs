//! Portable float maps. Rows are kept in file order: the first is row 0, v = 0. (The format's documentation stores
//! pictures upside down; irradiance references are written unflipped.)

use super::float_image::{Channel, FloatImage, check_size};
use crate::error::{Error, Result};

/// Whether the bytes begin like a PFM file.
pub fn is_pfm(bytes: &[u8]) -> bool {
    matches!(bytes, [b'P', b'f' | b'F', space, ..] if space.is_ascii_whitespace())
}

/// Decodes one (`Y`) or three (`R`, `G`, `B`) channels; `location` is named in errors.
///
/// # Errors
/// A damaged header, an unusable size, a file that is too short or too long for it.
pub fn decode(bytes: &[u8], location: &str) -> Result<FloatImage> {
    let (header, samples) = Header::parse(bytes).ok_or_else(|| {
        Error::failure(
            location,
            "its PFM header is damaged",
            "write the file again: `Pf` or `PF`, width, height and scale",
        )
    })?;
    check_size(header.width, header.height, location)?;

    // The header fixes the number of bytes: a file of another length is cut off, or holds something else.
    let texels = header.width * header.height;
    let names: &[&str] = if header.colour { &["R", "G", "B"] } else { &["Y"] };
    let expected = texels * names.len() * size_of::<f32>();
    if samples.len() != expected {
        return Err(Error::failure(
            location,
            format!(
                "it holds {} bytes of samples where its size asks for {expected}",
                samples.len()
            ),
            "write the file again",
        ));
    }

    // Samples lie texel by texel in the file, and channel by channel in the image.
    let values: Vec<f32> = samples
        .as_chunks::<4>()
        .0
        .iter()
        .map(|sample| {
            if header.little_endian {
                f32::from_le_bytes(*sample)
            } else {
                f32::from_be_bytes(*sample)
            }
        })
        .collect();
    let channels = names
        .iter()
        .enumerate()
        .map(|(channel, name)| Channel {
            name: (*name).to_string(),
            values: values
                .iter()
                .skip(channel)
                .step_by(names.len())
                .copied()
                .collect(),
        })
        .collect();
    Ok(FloatImage {
        width: header.width,
        height: header.height,
        channels,
    })
}

struct Header {
    colour: bool,
    width: usize,
    height: usize,
    little_endian: bool,
}

impl Header {
    /// The header, four words that each end with one white space, and the bytes after it.
    fn parse(bytes: &[u8]) -> Option<(Self, &[u8])> {
        let mut rest = bytes;
        let mut word = || -> Option<&str> {
            let start = rest.iter().position(|byte| !byte.is_ascii_whitespace())?;
            let length = rest[start..].iter().position(u8::is_ascii_whitespace)?;
            let word = std::str::from_utf8(&rest[start..start + length]).ok()?;
            rest = &rest[start + length + 1..];
            Some(word)
        };
        let colour = match word()? {
            "Pf" => false,
            "PF" => true,
            _ => return None,
        };
        let (width, height) = (word()?.parse().ok()?, word()?.parse().ok()?);
        let scale: f64 = word()?.parse().ok()?;
        let header = Self {
            colour,
            width,
            height,
            // The scale's sign is the byte order; its size has no agreed meaning.
            little_endian: scale < 0.0,
        };
        Some((header, rest))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(header: &str, samples: &[f32]) -> Vec<u8> {
        let mut bytes = header.as_bytes().to_vec();
        bytes.extend(samples.iter().flat_map(|sample| sample.to_le_bytes()));
        bytes
    }

    #[test]
    fn first_stored_row_is_row_zero() {
        let image =
            decode(&file("Pf\n3 2\n-1.0\n", &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0]), "a.pfm").expect("sound");
        assert_eq!((image.width, image.height), (3, 2));
        assert_eq!(image.channel("Y"), Some(&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0][..]));
    }

    #[test]
    fn colours_are_taken_apart() {
        let image = decode(&file("PF 2 1 -1\n", &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]), "a.pfm").expect("sound");
        assert_eq!(image.rgb(""), Some(vec![[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]));
    }

    #[test]
    fn damaged_files_are_refused() {
        for bytes in [
            file("Pf\n", &[]),
            file("Pf\n2 2\n", &[]),
            file("Pf\n2 x\n-1\n", &[0.0; 4]),
            file("Pf\n2 2\n-1\n", &[0.0; 3]),
            file("Pf\n2 2\n-1\n", &[0.0; 5]),
            file("Pf\n0 2\n-1\n", &[]),
            file("Pf\n99999999999 99999999999\n-1\n", &[0.0; 4]),
        ] {
            let error = decode(&bytes, "a.pfm").expect_err("damaged");
            assert_eq!(error.location, "a.pfm");
        }
    }
}
