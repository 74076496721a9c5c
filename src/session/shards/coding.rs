//! Numbers as bytes: whole ones in seven bits a byte, the least first; of either sign with the sign in the lowest bit.

use std::io::{self, Read};

/// Writes numbers.
#[derive(Debug, Default)]
pub(super) struct Writer(Vec<u8>);

impl Writer {
    pub(super) fn into_bytes(self) -> Vec<u8> {
        self.0
    }

    pub(super) fn whole(&mut self, mut value: u128) {
        while value >= 0x80 {
            self.0.push(value as u8 | 0x80);
            value >>= 7;
        }
        self.0.push(value as u8);
    }

    pub(super) fn signed(&mut self, value: i128) {
        self.whole((value << 1 ^ value >> 127) as u128);
    }

    pub(super) fn real(&mut self, value: f64) {
        self.word(value.to_bits());
    }

    /// All its bytes, the least first.
    pub(super) fn word(&mut self, value: u64) {
        self.0.extend_from_slice(&value.to_le_bytes());
    }
}

/// No time is longer [s].
const MOST_SECONDS: f64 = 1e12;

/// Reads what a [`Writer`] wrote; takes no memory by what it reads.
#[derive(Debug)]
pub(super) struct Reader<R>(pub(super) R);

/// Something that no [`Writer`] writes.
pub(super) fn damaged(what: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, what)
}

impl<R: Read> Reader<R> {
    pub(super) fn bytes<const N: usize>(&mut self) -> io::Result<[u8; N]> {
        let mut bytes = [0; N];
        self.0.read_exact(&mut bytes)?;
        Ok(bytes)
    }

    pub(super) fn large(&mut self) -> io::Result<u128> {
        let mut value = 0;
        for shift in (0..128).step_by(7) {
            let [byte] = self.bytes()?;
            let part = u128::from(byte & 0x7f);
            if part << shift >> shift != part {
                return Err(damaged("a number is too large"));
            }
            value |= part << shift;
            if byte < 0x80 {
                return Ok(value);
            }
        }
        Err(damaged("a number is too long"))
    }

    pub(super) fn whole(&mut self) -> io::Result<u64> {
        u64::try_from(self.large()?).map_err(|_| damaged("a number is too large"))
    }

    pub(super) fn small(&mut self) -> io::Result<u32> {
        u32::try_from(self.large()?).map_err(|_| damaged("a number is too large"))
    }

    pub(super) fn signed(&mut self) -> io::Result<i128> {
        let coded = self.large()?;
        Ok((coded >> 1) as i128 ^ -((coded & 1) as i128))
    }

    pub(super) fn word(&mut self) -> io::Result<u64> {
        Ok(u64::from_le_bytes(self.bytes()?))
    }

    /// A time [s].
    pub(super) fn real(&mut self) -> io::Result<f64> {
        let value = f64::from_bits(self.word()?);
        if (0.0..=MOST_SECONDS).contains(&value) {
            Ok(value)
        } else {
            Err(damaged("a time is none"))
        }
    }

    /// Expects the end.
    pub(super) fn end(&mut self) -> io::Result<()> {
        match self.0.read(&mut [0])? {
            0 => Ok(()),
            _ => Err(damaged("there is more than it should hold")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_come_back() {
        let signed = [0, 1, -1, 63, -64, 64, i128::MAX, i128::MIN, 1 << 100];
        let whole = [0, 0x7f, 0x80, 1 << 63, u128::MAX];
        let mut writer = Writer::default();
        signed.iter().for_each(|&value| writer.signed(value));
        whole.iter().for_each(|&value| writer.whole(value));
        writer.real(0.25);
        let bytes = writer.into_bytes();
        let mut reader = Reader(&bytes[..]);
        for value in signed {
            assert_eq!(reader.signed().expect("written"), value);
        }
        for value in whole {
            assert_eq!(reader.large().expect("written"), value);
        }
        assert_eq!(reader.real().expect("written").to_bits(), 0.25_f64.to_bits());
        reader.end().expect("that is all");
        for torn in 0..bytes.len() {
            let mut reader = Reader(&bytes[..torn]);
            let all = (0..signed.len() + whole.len()).try_for_each(|_| reader.large().map(drop));
            assert!(all.is_err() || reader.real().is_err());
        }
        assert!(Reader(&[0xff_u8; 40][..]).large().is_err());
    }
}
