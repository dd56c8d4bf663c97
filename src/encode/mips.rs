//! Mip levels: means of light.
//!
//! A level has half as many texels a side as the one before, rounded down, to one at the end. Each texel is the mean over the
//! part of the level before that it covers, in proportion to area, also where a side is odd: so every level has the mean of
//! the first. Colours are meant as light: where they were divided by alpha, they are weighted by it.

use rayon::prelude::*;

/// Rows of texels, channels interleaved.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    /// Texels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// The values.
    pub data: Vec<f32>,
}

/// A level whose values lie elsewhere.
#[derive(Clone, Copy)]
pub(super) struct View<'a> {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) data: &'a [f32],
}

impl Level {
    pub(super) fn view(&self) -> View<'_> {
        View { width: self.width, height: self.height, data: &self.data }
    }
}

/// All levels of a picture of `channels` channels, the picture first. `straight`: the last of four channels is alpha, by which the
/// others were divided.
pub fn levels(picture: Level, channels: usize, straight: bool) -> Vec<Level> {
    let further = further(picture.view(), channels, straight);
    [picture].into_iter().chain(further).collect()
}

/// The levels of a picture without the picture.
fn further(picture: View<'_>, channels: usize, straight: bool) -> Vec<Level> {
    let mut levels: Vec<Level> = Vec::new();
    loop {
        let last = levels.last().map_or(picture, Level::view);
        if last.width <= 1 && last.height <= 1 {
            return levels;
        }
        let next = half(last, channels, straight);
        levels.push(next);
    }
}

/// The same of several faces: the faces of each level but the first.
pub(super) fn further_of_faces(faces: &[View<'_>], channels: usize, straight: bool) -> Vec<Vec<Level>> {
    let mut all: Vec<Vec<Level>> = Vec::new();
    for face in faces {
        let levels = further(*face, channels, straight);
        all.resize_with(levels.len(), Vec::new);
        all.iter_mut().zip(levels).for_each(|(faces, level)| faces.push(level));
    }
    all
}

/// Places of the level before that a texel covers, with their shares, which sum to 1.
fn covered(from: usize, to: usize) -> Vec<Vec<(usize, f64)>> {
    let part = |texel: usize| {
        let (start, end) = (texel * from, (texel + 1) * from);
        let share = |place: usize| {
            let inside = end.min((place + 1) * to) - start.max(place * to);
            (place, inside as f64 / from as f64)
        };
        (start / to..end.div_ceil(to)).map(share).collect()
    };
    (0..to).map(part).collect()
}

fn half(level: View<'_>, channels: usize, straight: bool) -> Level {
    let (width, height) = ((level.width / 2).max(1), (level.height / 2).max(1));
    let (across, down) = (covered(level.width, width), covered(level.height, height));
    let weighted = straight && channels == 4;
    let row = |y: usize| {
        let mut row = Vec::with_capacity(width * channels);
        for columns in &across {
            let mut sum = [0.0_f64; 4];
            for &(line, share_down) in &down[y] {
                for &(column, share) in columns {
                    let at = (line * level.width + column) * channels;
                    let texel = &level.data[at..at + channels];
                    let share = share * share_down;
                    let alpha = if weighted { f64::from(texel[3]) } else { 1.0 };
                    for (channel, value) in texel.iter().enumerate() {
                        let by = if channel < 3 { alpha } else { 1.0 };
                        sum[channel] += share * by * f64::from(*value);
                    }
                }
            }
            let alpha = if weighted { sum[3] } else { 1.0 };
            for (channel, value) in sum.iter().enumerate().take(channels) {
                let by = if channel < 3 { alpha } else { 1.0 };
                row.push(if by > 0.0 { (value / by) as f32 } else { 0.0 });
            }
        }
        row
    };
    Level { width, height, data: (0..height).into_par_iter().flat_map_iter(row).collect() }
}
