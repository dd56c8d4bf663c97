//! Radiance HDR (`.hdr`): RGBE with runs. Written here, as the encoder of the `image` crate cuts mantissas off, which takes
//! 0.2 % of the light in the mean.

use rayon::prelude::*;

use super::encoded::{Target, Written};
use super::error::EncodeError;
use super::metadata::Metadata;
use super::pixels::Pixels;
use super::shared::{Range, check, rgbe};

/// Widths that the newer form of the runs takes; others are written without runs.
const WITH_RUNS: std::ops::RangeInclusive<u32> = 8..=32_767;
/// Shortest run that is worth being one.
const LEAST_RUN: usize = 4;

/// A Radiance file; a texture of one channel is grey. Its header tells what the texture is in comment lines.
///
/// # Errors
/// [`EncodeError::OutsideShared`] for values below 0; [`EncodeError::Codec`] where the file cannot be written.
pub(super) fn write(pixels: &Pixels<'_>, metadata: &Metadata, file: &mut dyn Target) -> Result<Written, EncodeError> {
    pixels.check()?;
    check(pixels, &Range::RGBE)?;
    let mut head = format!("#?RADIANCE\n# skyloom {}\n", metadata.version);
    for (name, value) in metadata.in_words() {
        // A line each, whatever a word may hold.
        head.push_str(&format!("# {name} = {}\n", value.replace(|letter: char| letter.is_control(), " ")));
    }
    head.push_str(&format!("FORMAT=32-bit_rle_rgbe\n\n-Y {} +X {}\n", pixels.height, pixels.width));
    file.write_all(head.as_bytes())?;
    for band in pixels.bands() {
        let rows: Vec<Vec<u8>> = band.par_chunks(pixels.row_len()).map(|row| line(row, pixels)).collect();
        file.write_all(&rows.concat())?;
    }
    Ok(Written { bits: 8, reason: None })
}

fn line(row: &[f32], pixels: &Pixels<'_>) -> Vec<u8> {
    let texels: Vec<[u8; 4]> = row
        .chunks(pixels.channels.len())
        .map(|texel| match *texel {
            [r, g, b] => rgbe([r, g, b]),
            _ => rgbe([texel.first().copied().unwrap_or(0.0); 3]),
        })
        .collect();
    if !WITH_RUNS.contains(&pixels.width) {
        return texels.into_flattened();
    }
    let mut line = vec![2, 2, (pixels.width >> 8) as u8, pixels.width as u8];
    for part in 0..4 {
        let values: Vec<u8> = texels.iter().map(|texel| texel[part]).collect();
        runs(&values, &mut line);
    }
    line
}

/// Runs of equal bytes as 128 + length and the byte, others as their number and themselves.
fn runs(values: &[u8], line: &mut Vec<u8>) {
    let mut rest = values;
    while let Some(&first) = rest.first() {
        let length = rest.iter().take(127).take_while(|value| **value == first).count();
        if length >= LEAST_RUN {
            line.extend([128 + length as u8, first]);
            rest = &rest[length..];
            continue;
        }
        let is_run = |window: &[u8]| window.iter().all(|value| *value == window[0]);
        let until = rest.windows(LEAST_RUN).position(is_run).unwrap_or(rest.len()).min(128);
        line.push(until as u8);
        line.extend_from_slice(&rest[..until]);
        rest = &rest[until..];
    }
}
