//! Blocks of 4 x 4 texels, as devices read them compressed: BC6H for light, BC4 for parts of a whole.
//!
//! BC6H is found by `block_compression`, Intel's encoder in Rust alone. BC4 is written here: encoders that are kept take it from 8
//! bits, where a mask has more.

use block_compression::encode::compress_rgba16;
use block_compression::{BC6HSettings, CompressionVariant};
use half::f16;
use rayon::prelude::*;

/// Texels of a block's side.
const SIDE: usize = 4;
/// Bytes of a block.
pub(super) const BC6H_BYTES: usize = 16;
pub(super) const BC4_BYTES: usize = 8;
/// The quickest: 0.15 us a texel on a core. Searches that take 7 to 150 times as long win a tenth of the error (1.36 to 1.21 %
/// rms of a panorama with broken clouds).
const SEARCH: BC6HSettings = BC6HSettings::very_fast();

/// Colours without a sign as BC6H. Where a side is no multiple of four the last texels are repeated.
pub(super) fn bc6h(colours: &[[f32; 3]], width: usize, height: usize) -> Vec<u8> {
    let across = width.div_ceil(SIDE);
    let row = |block_row: usize| {
        let texel = |i: usize| {
            let (x, y) = (i % (SIDE * across), i / (SIDE * across));
            let at = (SIDE * block_row + y).min(height - 1) * width + x.min(width - 1);
            let [r, g, b] = colours[at].map(f16::from_f32);
            [r, g, b, f16::ONE]
        };
        let texels: Vec<f16> = (0..SIDE * SIDE * across).flat_map(texel).collect();
        let mut blocks = vec![0; BC6H_BYTES * across];
        // At most a few thousand.
        let wide = (SIDE * across) as u32;
        compress_rgba16(CompressionVariant::BC6H(SEARCH), &texels, &mut blocks, wide, SIDE as u32, 4 * wide);
        blocks
    };
    (0..height.div_ceil(SIDE)).into_par_iter().flat_map_iter(row).collect()
}

/// Values from 0 to 1 as BC4; what lies outside is cut off.
pub(super) fn bc4(values: &[f32], width: usize, height: usize) -> Vec<u8> {
    let across = width.div_ceil(SIDE);
    let row = |block_row: usize| {
        (0..across).flat_map(move |block| {
            let texel = |i: usize| {
                let (x, y) = (SIDE * block + i % SIDE, SIDE * block_row + i / SIDE);
                values[y.min(height - 1) * width + x.min(width - 1)].clamp(0.0, 1.0)
            };
            bc4_block(std::array::from_fn(texel))
        })
    };
    (0..height.div_ceil(SIDE)).into_par_iter().flat_map_iter(row).collect()
}

/// The values that a block can have: eight from one end to the other where the first is larger, else six, 0 and 1.
fn palette([first, second]: [u8; 2]) -> [f32; 8] {
    let mix = |steps: u8, i: u8| {
        let (first, second) = (f32::from(first), f32::from(second));
        (f32::from(steps - i) * first + f32::from(i) * second) / (255.0 * f32::from(steps))
    };
    if first > second {
        [mix(7, 0), mix(7, 7), mix(7, 1), mix(7, 2), mix(7, 3), mix(7, 4), mix(7, 5), mix(7, 6)]
    } else {
        [mix(5, 0), mix(5, 5), mix(5, 1), mix(5, 2), mix(5, 3), mix(5, 4), 0.0, 1.0]
    }
}

/// Of ends around the least and the largest value those with the smallest sum of squared errors.
fn bc4_block(values: [f32; 16]) -> [u8; BC4_BYTES] {
    let ends = |inside: &dyn Fn(&f32) -> bool| {
        let (mut least, mut most) = (f32::INFINITY, f32::NEG_INFINITY);
        for value in values.iter().filter(|value| inside(value)) {
            (least, most) = (least.min(*value), most.max(*value));
        }
        (least <= most).then_some([255.0 * least, 255.0 * most])
    };
    let near =
        |end: f32, by: &[f32]| -> Vec<u8> { by.iter().map(|by| (end + by).round().clamp(0.0, 255.0) as u8).collect() };
    // Eight steps of a range that are fewer than the texels are best a little inside it.
    let (up, down) = ([0.0, -1.0, -3.0], [0.0, 1.0, 3.0]);
    let mut tried: Vec<[u8; 2]> = Vec::new();
    if let Some([least, most]) = ends(&|_| true) {
        for high in near(most, &up) {
            tried.extend(near(least, &down).into_iter().filter(|low| *low < high).map(|low| [high, low]));
        }
    }
    // What is exactly dark or lit needs none of the steps.
    let step = 0.5 / 255.0;
    match ends(&|value| (step..=1.0 - step).contains(value)) {
        Some([least, most]) => {
            for low in near(least, &down) {
                tried.extend(near(most, &up).into_iter().filter(|high| low <= *high).map(|high| [low, high]));
            }
        }
        None => tried.push([0, 255]),
    }
    let nearest = |palette: &[f32; 8], value: f32| {
        let mut best = (0, f32::INFINITY);
        for (i, step) in palette.iter().enumerate() {
            let error = (step - value) * (step - value);
            if error < best.1 {
                best = (i, error);
            }
        }
        best
    };
    let error = |ends: &[u8; 2]| {
        let palette = palette(*ends);
        values.iter().map(|value| nearest(&palette, *value).1).sum::<f32>()
    };
    // The first of equal ones.
    let mut best = ([0, 255], f32::INFINITY);
    for ends in tried {
        let error = error(&ends);
        if error < best.1 {
            best = (ends, error);
        }
    }
    let (ends, palette) = (best.0, palette(best.0));
    let indices = values
        .iter()
        .enumerate()
        .fold(0_u64, |bits, (i, value)| bits | (nearest(&palette, *value).0 as u64) << (3 * i));
    let mut block = [0; BC4_BYTES];
    block[..2].copy_from_slice(&ends);
    block[2..].copy_from_slice(&indices.to_le_bytes()[..6]);
    block
}
