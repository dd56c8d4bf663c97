//! A ZIP archive that is sent while it is made (PKWARE, APPNOTE.TXT 6.3.10). Files are stored as they are: textures compress
//! themselves, or do not compress.
//!
//! Written here, and not by the crate `zip`: written without seeking, its archives have the sizes of stored files behind them, where
//! programs that unpack a stream cannot find them. These lines need no more than the checksum of `flate2`.

use std::io;

use axum::body::Bytes;
use flate2::CrcReader;

use crate::app::blocking;
use crate::problem::ApiError;
use crate::spool::Content;

/// The first day that the format can tell, 1980-01-01: the same files always make the same archive.
const DATE: u16 = 1 << 5 | 1;
/// Version of the format that a reader has to know: without, and with 64-bit places.
const VERSION: u16 = 10;
const VERSION_64: u16 = 45;
/// Names are UTF-8.
const FLAGS: u16 = 1 << 11;
/// From here on numbers stand in their 64-bit fields.
const FULL: u64 = u32::MAX as u64;
const MANY: u64 = u16::MAX as u64;

/// What an archive says of a file.
#[derive(Clone, Copy, Debug)]
pub struct Sum {
    length: u64,
    crc: u32,
}

impl Sum {
    /// Reads a file for it.
    pub fn of(file: &Content) -> io::Result<Self> {
        let mut crc = CrcReader::new(file.reader());
        let length = io::copy(&mut crc, &mut io::sink())?;
        Ok(Self { length, crc: crc.crc().sum() })
    }
}

/// The same from where others do not wait.
pub async fn sum(file: &Content) -> Result<Sum, ApiError> {
    let file = file.clone();
    blocking(move || Sum::of(&file).map_err(|error| ApiError::Internal(error.to_string()))).await
}

/// An archive in the making: what its end has to say.
#[derive(Debug, Default)]
pub struct Archive {
    /// Bytes so far.
    length: u64,
    directory: Vec<u8>,
    count: u64,
}

impl Archive {
    /// What stands in the archive before a file, which has to follow as it is.
    pub fn before(&mut self, name: &str, file: &Sum) -> Result<Bytes, ApiError> {
        let large = |_| ApiError::Internal(format!("{name} has {} bytes, too many for an archive", file.length));
        let size = u32::try_from(file.length).map_err(large)?;
        let offset = self.length;
        let far = offset >= FULL;
        let [method, time] = [0_u16; 2];
        let words = [FLAGS, method, time, DATE].map(u16::to_le_bytes);
        let sizes = [file.crc, size, size].map(u32::to_le_bytes);
        // Names are those of textures: a dozen bytes.
        let name_length = (name.len() as u16).to_le_bytes();
        let common = [words.as_flattened(), sizes.as_flattened(), &name_length].concat();
        let head = [&b"PK\x03\x04"[..], &VERSION.to_le_bytes(), &common[..], &[0; 2], name.as_bytes()].concat();
        self.length += head.len() as u64 + file.length;

        let place = if far { u32::MAX } else { offset as u32 };
        let mut wide = Vec::new();
        if far {
            wide.extend([1, 8].map(u16::to_le_bytes).as_flattened());
            wide.extend(offset.to_le_bytes());
        }
        let version = if far { VERSION_64 } else { VERSION };
        self.directory.extend(b"PK\x01\x02");
        self.directory.extend([version; 2].map(u16::to_le_bytes).as_flattened());
        self.directory.extend(common);
        self.directory.extend((wide.len() as u16).to_le_bytes());
        // No comment, disk 0, no attributes.
        self.directory.extend([0; 10]);
        self.directory.extend(place.to_le_bytes());
        self.directory.extend(name.as_bytes());
        self.directory.extend(wide);
        self.count += 1;
        Ok(head.into())
    }

    /// The directory at the end.
    pub fn end(self) -> Bytes {
        let (begin, size, count) = (self.length, self.directory.len() as u64, self.count);
        let mut end = self.directory;
        if begin >= FULL || size >= FULL || count >= MANY {
            let own = begin + size;
            end.extend(b"PK\x06\x06");
            end.extend(44_u64.to_le_bytes());
            end.extend([VERSION_64; 2].map(u16::to_le_bytes).as_flattened());
            end.extend([0; 8]);
            end.extend([count, count, size, begin].map(u64::to_le_bytes).as_flattened());
            end.extend(b"PK\x06\x07");
            end.extend([0; 4]);
            end.extend(own.to_le_bytes());
            end.extend(1_u32.to_le_bytes());
        }
        // What does not fit says that it stands above.
        let short = count.min(MANY) as u16;
        end.extend(b"PK\x05\x06");
        end.extend([0, 0, short, short].map(u16::to_le_bytes).as_flattened());
        end.extend([size, begin].map(|number| (number.min(FULL) as u32).to_le_bytes()).as_flattened());
        end.extend([0; 2]);
        end.into()
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test stops where it fails")]
mod tests {
    use super::*;

    fn number<const N: usize>(bytes: &[u8], at: usize) -> [u8; N] {
        bytes[at..at + N].try_into().unwrap()
    }

    #[test]
    fn places_beyond_four_gibibytes_have_fields_of_their_own() {
        let mut archive = Archive { length: FULL + 5, count: MANY, ..Archive::default() };
        let head = archive.before("a.f32", &Sum::of(&Content::Memory("1234".into())).unwrap()).unwrap();
        assert_eq!(head.len(), 30 + 5);
        let end = archive.end();
        // The entry, with its extra field.
        assert_eq!(u32::from_le_bytes(number(&end, 42)), u32::MAX);
        assert_eq!(u16::from_le_bytes(number(&end, 30)), 12);
        assert_eq!(u64::from_le_bytes(number(&end, 46 + 5 + 4)), FULL + 5);
        let wide = 46 + 5 + 12;
        assert_eq!(number(&end, wide), *b"PK\x06\x06");
        assert_eq!(u64::from_le_bytes(number(&end, wide + 32)), MANY + 1);
        assert_eq!(u64::from_le_bytes(number(&end, wide + 48)), FULL + 5 + 35 + 4);
        assert_eq!(number(&end, wide + 56), *b"PK\x06\x07");
        assert_eq!(u64::from_le_bytes(number(&end, wide + 64)), FULL + 5 + 35 + 4 + wide as u64);
        assert_eq!(number(&end, wide + 76), *b"PK\x05\x06");
        assert_eq!(u16::from_le_bytes(number(&end, wide + 76 + 8)), u16::MAX);
        assert_eq!(end.len(), wide + 76 + 22);
    }
}
