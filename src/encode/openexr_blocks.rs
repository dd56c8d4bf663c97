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
                // As many steps as textures have channels are known here, so that many texels are taken at once.
                match channel.step {
                    1 => every::<1>(texels, channel.place, &mut self.line),
                    3 => every::<3>(texels, channel.place, &mut self.line),
                    _ => every::<4>(texels, channel.place, &mut self.line),
                }
                match depth {
                    Depth::Half => {
                        self.halves.resize(width, f16::ZERO);
                        self.halves.convert_from_f32_slice(&self.line);
                        let start = samples.len();
                        samples.resize(start + 2 * width, 0);
                        let (places, _) = samples[start..].as_chunks_mut::<2>();
                        places.iter_mut().zip(&self.halves).for_each(|(to, value)| *to = value.to_le_bytes());
                    }
                    Depth::Float => {
                        let start = samples.len();
                        samples.resize(start + 4 * width, 0);
                        let (places, _) = samples[start..].as_chunks_mut::<4>();
                        places.iter_mut().zip(&self.line).for_each(|(to, value)| *to = value.to_le_bytes());
                    }
                }
            }
        }
        samples
    }
}

/// Every `STEP`th value from a place on.
fn every<const STEP: usize>(texels: &[f32], place: usize, line: &mut Vec<f32>) {
    line.clear();
    line.extend(texels.as_chunks::<STEP>().0.iter().map(|texel| texel[place]));
}

/// Differences from byte to byte, 128 for none, of the bytes of even places and then those of odd ones. The samples' bytes are
/// even in number.
fn differences(samples: &[u8], differences: &mut Vec<u8>) {
    let (pairs, _) = samples.as_chunks::<2>();
    let ([first, ..], [.., last]) = (pairs, pairs) else { return differences.clear() };
    differences.resize(samples.len(), 0);
    let (even, odd) = differences.split_at_mut(pairs.len());
    // The first byte stays as it is, and the last of even places is before the first of odd ones.
    let difference = |byte: u8, before: u8| byte.wrapping_sub(before).wrapping_add(128);
    (even[0], odd[0]) = (first[0], difference(first[1], last[0]));
    // All from the samples and none from another difference, so that many are made at once.
    let following = pairs.iter().zip(pairs.iter().skip(1));
    for (((before, pair), even), odd) in following.zip(even.iter_mut().skip(1)).zip(odd.iter_mut().skip(1)) {
        *even = difference(pair[0], before[0]);
        *odd = difference(pair[1], before[1]);
    }
}
