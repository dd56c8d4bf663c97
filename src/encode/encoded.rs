//! What an encoder gives, and where it puts it.

use std::io::{self, Cursor, Seek, SeekFrom, Write};

use super::error::EncodeError;

/// A file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Encoded {
    /// The file.
    pub bytes: Vec<u8>,
    /// Bits of a sample: 8, 16 or 32.
    pub bits: u32,
    /// Why an OpenEXR file that may be half is float, such as `largest value 98000 (channel R, column 3, row 4) is above
    /// 65504, the largest half float`.
    pub reason: Option<String>,
}

/// What is told of a file beside its bytes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Written {
    /// As [`Encoded::bits`].
    pub bits: u32,
    /// As [`Encoded::reason`].
    pub reason: Option<String>,
}

/// Where a file is written, from its beginning on, band by band; what is known at the end only, such as a table of places, is put
/// in its place then.
pub trait Target: Write + Seek {}

impl<T: Write + Seek + ?Sized> Target for T {}

/// A target whose first error is remembered: the encoder of a format may pass over that of its last bytes.
pub(super) struct Heedful<'a> {
    file: &'a mut dyn Target,
    error: Option<io::Error>,
}

impl<'a> Heedful<'a> {
    pub(super) fn new(file: &'a mut dyn Target) -> Self {
        Self { file, error: None }
    }

    /// What went wrong, whatever the encoder made of it.
    pub(super) fn end(self) -> io::Result<()> {
        self.error.map_or(Ok(()), Err)
    }

    fn heed<T>(&mut self, done: io::Result<T>) -> io::Result<T> {
        done.map_err(|error| {
            let told = io::Error::new(error.kind(), error.to_string());
            // To be tried again is no failure.
            if error.kind() != io::ErrorKind::Interrupted {
                self.error.get_or_insert(error);
            }
            told
        })
    }
}

impl Write for Heedful<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let done = self.file.write(bytes);
        self.heed(done)
    }

    fn flush(&mut self) -> io::Result<()> {
        let done = self.file.flush();
        self.heed(done)
    }
}

impl Seek for Heedful<'_> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let done = self.file.seek(to);
        self.heed(done)
    }
}

impl Encoded {
    /// A file in memory, of about so many bytes.
    pub(super) fn in_memory(
        bytes: usize,
        write: impl FnOnce(&mut dyn Target) -> Result<Written, EncodeError>,
    ) -> Result<Self, EncodeError> {
        let mut file = Cursor::new(Vec::with_capacity(bytes));
        let Written { bits, reason } = write(&mut file)?;
        Ok(Self { bytes: file.into_inner(), bits, reason })
    }
}
