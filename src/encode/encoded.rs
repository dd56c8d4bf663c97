//! What an encoder gives.

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
