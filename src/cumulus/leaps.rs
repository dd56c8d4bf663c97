//! How far rays may leap over clear air.

use super::volume::{BLOCK, Volume};
use rayon::prelude::*;

/// Leaps are as long as so many blocks, at most.
const FARTHEST: u8 = 15;

/// How far the next block with cloud is from each block of a volume, in blocks; 0 has some itself.
pub(super) fn leaps(volume: &Volume) -> Vec<u8> {
    // Cloud begins where noise may lift the surface to.
    let clear = ((1.0 - volume.relief_m / volume.band_m) * 127.5).floor().max(0.0) as u8;
    let mut leaps = highest(volume);
    leaps.iter_mut().for_each(|leap| *leap = if *leap > clear { 0 } else { FARTHEST });
    for _ in 1..FARTHEST {
        leaps = grow(volume.blocks, leaps);
    }
    leaps
}

/// The highest sample that a place in each block reads: its own ones, and those next to it.
fn highest(volume: &Volume) -> Vec<u8> {
    let [nx, ny, nz] = volume.size;
    let [bx, by, bz] = volume.blocks;
    let mut highest = vec![0; bx * by * bz];
    highest.par_chunks_mut(bx * by).enumerate().for_each(|(layer, highest)| {
        // Of each row of blocks: the highest of all samples one above the other and behind each other.
        let mut rows = vec![0; nx * by];
        for z in (layer * BLOCK).saturating_sub(1)..((layer + 1) * BLOCK + 1).min(nz) {
            for y in 0..ny {
                let samples = &volume.samples[nx * (y + ny * z)..][..nx];
                let mut merge = |block: usize| {
                    let row = &mut rows[nx * block..][..nx];
                    row.iter_mut().zip(samples).for_each(|(highest, &sample)| *highest = sample.max(*highest));
                };
                let block = y / BLOCK;
                merge(block);
                match y % BLOCK {
                    0 => merge((block + by - 1) % by),
                    last if last == BLOCK - 1 => merge((block + 1) % by),
                    _ => {}
                }
            }
        }
        for (highest, row) in highest.chunks_mut(bx).zip(rows.chunks(nx)) {
            let mut before = row[nx - 1];
            for (block, (highest, own)) in highest.iter_mut().zip(row.chunks(BLOCK)).enumerate() {
                let after = row[(block + 1) * BLOCK % nx];
                *highest = own.iter().fold(before.max(after), |highest, &sample| highest.max(sample));
                before = own[BLOCK - 1];
            }
        }
    });
    highest
}

/// Distances that are no more than one above those of their neighbours.
fn grow([bx, by, bz]: [usize; 3], leaps: Vec<u8>) -> Vec<u8> {
    let least = |a: &[u8], b: &[u8], c: &[u8], into: &mut [u8]| {
        for (((into, a), b), c) in into.iter_mut().zip(a).zip(b).zip(c) {
            *into = (*a).min(*b).min(*c);
        }
    };
    let mut along = vec![0; leaps.len()];
    let row = |from: &[u8], into: &mut [u8]| {
        into[0] = from[0].min(from[1 % bx]).min(from[bx - 1]);
        into[bx - 1] = from[bx - 1].min(from[0]).min(from[bx.saturating_sub(2)]);
        if bx > 2 {
            least(&from[..bx - 2], &from[1..], &from[2..], &mut into[1..]);
        }
    };
    along.par_chunks_mut(bx).zip(leaps.par_chunks(bx)).for_each(|(into, from)| row(from, into));
    let slice = bx * by;
    let mut across = vec![0; leaps.len()];
    across.par_chunks_mut(bx).enumerate().for_each(|(number, into)| {
        let (y, first) = (number % by, number / by * slice);
        let row = |y: usize| &along[first + bx * (y % by)..][..bx];
        least(row(y + by - 1), row(y), row(y + 1), into);
    });
    let mut grown = leaps;
    grown.par_chunks_mut(slice).enumerate().for_each(|(z, grown)| {
        let layer = |z: usize| &across[slice * z.min(bz - 1)..][..slice];
        let layers = layer(z.saturating_sub(1)).iter().zip(layer(z)).zip(layer(z + 1));
        for (grown, ((a, b), c)) in grown.iter_mut().zip(layers) {
            *grown = (*grown).min(*a.min(b).min(c) + 1);
        }
    });
    grown
}
