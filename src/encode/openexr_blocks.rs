//! Blocks of an OpenEXR file of ZIP compression, a few lines each.
//!
//! As the format has it: samples line by line, in a line channel by channel; their bytes of even places and then those of
//! odd ones; of these the differences from byte to byte; of those a stream of zlib. A block that would grow is stored as it is.

use half::f16;
use half::slice::HalfFloatSliceExt;
use zlib_rs::{Deflate, DeflateError, DeflateFlush, Status};

use super::channels::Channel;
use super::openexr::Depth;

/// Effort of the compression: files of textures come out as large as at the level 4 of the `exr` crate, within a tenth, in less than half
/// of its time. Level 1 would nearly halve the time again, for files up to a fifth larger, of smooth skies a third.
const LEVEL: i32 = 2;

/// The window of zlib, as a power of two bytes: the largest.
const WINDOW_BITS: u8 = 15;

/// Lines of a texture that are compressed together.
pub(super) struct Block {
    /// Texels of a line.
    pub(super) width: usize,
    /// The first line.
    pub(super) top: usize,
    /// Lines.
    pub(super) rows: usize,
}

/// Packs blocks one after the other: what it works in is made once.
pub(super) struct Packer {
    deflate: Deflate,
    line: Vec<f32>,
    halves: Vec<f16>,
    differences: Vec<u8>,
}

impl Packer {
    /// A packer that has done nothing yet.
    pub(super) fn new() -> Self {
        Self {
            deflate: Deflate::new(LEVEL, true, WINDOW_BITS),
            line: Vec::new(),
            halves: Vec::new(),
            differences: Vec::new(),
        }
    }

    /// The block's bytes as they stand in the file.
    ///
    /// # Errors
    /// None that input can cause: a fault of the compressor.
    pub(super) fn pack(
        &mut self,
        channels: &[Channel<'_>],
        depth: Depth,
        block: &Block,
    ) -> Result<Vec<u8>, DeflateError> {
        let samples = self.samples(channels, depth, block);
        differences(&samples, &mut self.differences);
        // What does not fit into as many bytes is not worth its compression.
        let mut packed = vec![0; samples.len()];
        self.deflate.reset();
        let status = self.deflate.compress(&self.differences, &mut packed, DeflateFlush::Finish)?;
        let length = self.deflate.total_out() as usize;
        if status == Status::StreamEnd && length < samples.len() {
            packed.truncate(length);
            Ok(packed)
        } else {
            Ok(samples)
        }
    }

    /// Little-endian samples.
    fn samples(&mut self, channels: &[Channel<'_>], depth: Depth, block: &Block) -> Vec<u8> {
        let width = block.width;
        let mut samples = Vec::with_capacity(block.rows * width * channels.len() * depth.bits() as usize / 8);
        for row in block.top..block.top + block.rows {
            for channel in channels {
                let start = row * width * channel.step;
                let texels = channel.data.get(start..start + width * channel.step).unwrap_or_default();
                self.line.clear();
                self.line.extend(texels.iter().skip(channel.place).step_by(channel.step));
                match depth {
                    Depth::Half => {
                        self.halves.resize(width, f16::ZERO);
                        self.halves.convert_from_f32_slice(&self.line);
                        samples.extend(self.halves.iter().flat_map(|value| value.to_le_bytes()));
                    }
                    Depth::Float => samples.extend(self.line.iter().flat_map(|value| value.to_le_bytes())),
                }
            }
        }
        samples
    }
}

/// Differences from byte to byte, 128 for none, of the bytes of even places and then those of odd ones. The samples' bytes are
/// even in number.
fn differences(samples: &[u8], differences: &mut Vec<u8>) {
    let [even, odd] = [0, 1].map(|place| samples.iter().skip(place).step_by(2).copied());
    differences.clear();
    differences.extend(even.chain(odd));
    // From the last on: each needs the byte before it as it was. The first stays as it is.
    let mut later = differences.as_mut_slice();
    while let [before @ .., last] = later {
        let Some(previous) = before.last() else { break };
        *last = last.wrapping_sub(*previous).wrapping_add(128);
        later = before;
    }
}
