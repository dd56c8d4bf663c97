//! The surface of a cumulus layer as a volume of samples: what a ray reads instead of thousands of spheres, at a price that does
//! not depend on their number.

use super::body::{Body, Sphere};
use super::relief::Relief;
use glam::{DVec3, IVec3, dvec3};
use rayon::prelude::*;
use std::convert::Infallible;

/// Samples, about: 64 MB on the device.
const SAMPLES: f64 = 64e6;
/// Samples a side, at most: what a device of WebGPU's default limits takes in three dimensions.
const MAX_SIDE: f64 = 2048.0;
/// Samples above each other, at most, with those that are added around the clouds.
const HIGHEST: f64 = 2000.0;
/// Samples that all spheres reach together, at most, each counted by itself: some seconds of work. A hundred thousand spheres as large as the
/// domain would take hours.
const MOST_WORK: f64 = 3e9;
/// Samples a side of a block, the unit in which rays leap over clear air.
pub const BLOCK: usize = 4;
/// Leaps are as long as so many blocks, at most.
const FARTHEST: u8 = 15;

/// Signed depths below the surface of the union of spheres, at the centres of cubes that fill the domain from the lowest cloud to the
/// highest: `max_i(R_i - |p - c_i|)`, metres, kept as a byte between `-band_m` and `band_m`.
#[derive(Debug, Clone, PartialEq)]
pub struct Volume {
    /// Cubes along x, y, z; the first two are whole blocks.
    pub size: [usize; 3],
    /// Side of a cube, metres.
    pub voxel_m: f64,
    /// Height of the lower face of the lowest cubes, metres.
    pub floor_m: f64,
    /// Depth that is kept at most.
    pub band_m: f64,
    /// The samples, those along x next to each other, then y.
    pub samples: Vec<u8>,
    /// Blocks along x, y, z.
    pub blocks: [usize; 3],
    /// How far the next block with cloud is, in blocks; 0 has some itself.
    pub leaps: Vec<u8>,
    /// As of the body.
    pub base_m: f64,
    /// As of the body.
    pub edge_m: f64,
    /// As of the body.
    pub relief_m: f64,
    /// As of the body.
    pub extent_m: f64,
    /// Height of the highest cloud.
    pub top_m: f64,
    relief: Relief,
}

impl Volume {
    /// Samples a body.
    pub fn new(body: &Body) -> Self {
        match Self::new_watched::<Infallible>(body, &|| Ok(())) {
            Ok(volume) => volume,
            Err(never) => match never {},
        }
    }

    /// The same; stops where `look`, which is asked between its steps, fails.
    ///
    /// # Errors
    ///
    /// Those of `look`.
    pub fn new_watched<E>(body: &Body, look: &dyn Fn() -> Result<(), E>) -> Result<Self, E> {
        let lowest = body.spheres.iter().map(|s| s.centre.z - s.radius_m).fold(f64::INFINITY, f64::min);
        let highest = body.spheres.iter().map(|s| s.centre.z + s.radius_m).fold(f64::NEG_INFINITY, f64::max);
        let bottom_m = if body.spheres.is_empty() { body.base_m } else { lowest.max(body.base_m) };
        let top_m = highest.max(bottom_m) + body.relief_m;
        let height_m = (top_m - bottom_m).max(1e-3 * body.extent_m);
        let side = (SAMPLES / height_m * body.extent_m).cbrt().min(MAX_SIDE).min(HIGHEST * body.extent_m / height_m);
        let side = side.min(affordable(body));
        // Finer than this no edge can be seen.
        let side = side.min(body.extent_m / 2.0).max(1.0);
        let across = BLOCK * (side / BLOCK as f64).floor().max(1.0) as usize;
        let voxel_m = body.extent_m / across as f64;
        // A cube of clear air below and above, so that what lies between samples is seen.
        let floor_m = bottom_m - voxel_m;
        let up = ((top_m - floor_m) / voxel_m).ceil() as usize + 1;
        let size = [across, across, up.next_multiple_of(BLOCK)];
        let band_m = (2.5 * voxel_m).max(body.edge_m + body.relief_m + voxel_m);
        let mut volume = Self {
            size,
            voxel_m,
            floor_m,
            band_m,
            samples: vec![0; size.iter().product()],
            blocks: size.map(|n| n / BLOCK),
            leaps: Vec::new(),
            base_m: body.base_m,
            edge_m: body.edge_m,
            relief_m: body.relief_m,
            extent_m: body.extent_m,
            top_m,
            relief: Relief::new(body.extent_m),
        };
        look()?;
        volume.fill(&body.spheres);
        look()?;
        volume.leap();
        Ok(volume)
    }

    fn fill(&mut self, spheres: &[Sphere]) {
        let [nx, ny, _] = self.size;
        let (voxel_m, floor_m, band_m, half_m) = (self.voxel_m, self.floor_m, self.band_m, 0.5 * self.extent_m);
        // Spheres by the slices that they touch.
        let mut touching: Vec<Vec<u32>> = vec![Vec::new(); self.size[2]];
        for (number, sphere) in spheres.iter().enumerate() {
            let reach = sphere.radius_m + band_m;
            let slice = |z: f64| ((z - floor_m) / voxel_m - 0.5).clamp(0.0, self.size[2] as f64 - 1.0);
            let (low, high) = (slice(sphere.centre.z - reach).ceil(), slice(sphere.centre.z + reach).floor());
            for list in touching.get_mut(low as usize..=high as usize).into_iter().flatten() {
                list.push(number as u32);
            }
        }
        let scale = (127.5 / band_m) as f32;
        self.samples.par_chunks_mut(nx * ny).zip(&touching).enumerate().for_each(|(k, (slice, touching))| {
            let z = floor_m + (k as f64 + 0.5) * voxel_m;
            for &number in touching {
                let sphere = &spheres[number as usize];
                let (dz, reach) = (z - sphere.centre.z, sphere.radius_m + band_m);
                let wide = reach * reach - dz * dz;
                if wide <= 0.0 {
                    continue;
                }
                // Places in units of cubes, from the centre of the first.
                let place = |at: f64| (at + half_m) / voxel_m - 0.5;
                let (cx, cy, wide) = (place(sphere.centre.x), place(sphere.centre.y), wide.sqrt() / voxel_m);
                for j in (cy - wide).ceil() as i64..=(cy + wide).floor() as i64 {
                    let dy = (j as f64 - cy) * voxel_m;
                    let row = reach * reach - dz * dz - dy * dy;
                    if row <= 0.0 {
                        continue;
                    }
                    let across = row.sqrt() / voxel_m;
                    let start = nx * j.rem_euclid(ny as i64) as usize;
                    let (from, to) = ((cx - across).ceil() as i64, (cx + across).floor() as i64);
                    // At most one whole row, in at most two runs without a wrap.
                    let to = to.min(from + nx as i64 - 1);
                    let (rest, radius) = ((dz * dz + dy * dy) as f32, sphere.radius_m as f32);
                    let inner = (sphere.radius_m - band_m).max(0.0).powi(2) - dz * dz - dy * dy;
                    let within = inner.max(0.0).sqrt() / voxel_m;
                    let mut i = from;
                    while i <= to {
                        let first = i.rem_euclid(nx as i64) as usize;
                        let run = ((to - i) as usize + 1).min(nx - first);
                        let offset = ((i as f64 - cx) * voxel_m) as f32;
                        let row = &mut slice[start + first..start + first + run];
                        let mut draw = |samples: std::ops::Range<usize>| {
                            for (step, sample) in samples.clone().zip(&mut row[samples]) {
                                let dx = offset + step as f32 * voxel_m as f32;
                                let depth = radius - (rest + dx * dx).sqrt();
                                // Rounded; the cast holds it between 0 and 255.
                                *sample = (*sample).max((depth * scale + 128.0) as u8);
                            }
                        };
                        // Deep inside all is alike.
                        let [from, to] =
                            [-within, within].map(|at| (cx + at - i as f64).ceil().clamp(0.0, run as f64) as usize);
                        draw(0..from);
                        draw(to..run);
                        row[from..to].fill(u8::MAX);
                        i += run as i64;
                    }
                }
            }
        });
    }

    /// Finds how far a ray may leap from each block.
    fn leap(&mut self) {
        // Cloud begins where noise may lift the surface to.
        let clear = ((1.0 - self.relief_m / self.band_m) * 127.5).floor().max(0.0) as u8;
        let mut leaps: Vec<u8> =
            self.highest().into_iter().map(|highest| if highest > clear { 0 } else { FARTHEST }).collect();
        for _ in 1..FARTHEST {
            leaps = self.grow(leaps);
        }
        self.leaps = leaps;
    }

    /// The highest sample that a place in each block reads: its own ones, and those next to it.
    fn highest(&self) -> Vec<u8> {
        let [nx, ny, nz] = self.size;
        let [bx, by, _] = self.blocks;
        let mut highest = vec![0; self.leaps_len()];
        highest.par_chunks_mut(bx * by).enumerate().for_each(|(layer, highest)| {
            let mut row_highest = vec![0_u8; bx];
            for z in (layer * BLOCK).saturating_sub(1)..((layer + 1) * BLOCK + 1).min(nz) {
                for y in 0..ny {
                    let row = &self.samples[nx * (y + ny * z)..][..nx];
                    for (block, value) in row_highest.iter_mut().enumerate() {
                        let (first, last) = (block * BLOCK, (block + 1) * BLOCK);
                        let own = row[first..last].iter().fold(0, |highest: u8, &sample| highest.max(sample));
                        *value = own.max(row[(first + nx - 1) % nx]).max(row[last % nx]);
                    }
                    let mut merge = |block: usize| {
                        let into = &mut highest[bx * block..][..bx];
                        into.iter_mut().zip(&row_highest).for_each(|(into, &value)| *into = value.max(*into));
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
        });
        highest
    }

    fn leaps_len(&self) -> usize {
        self.blocks.iter().product()
    }

    /// Distances that are no more than one above those of their neighbours.
    fn grow(&self, leaps: Vec<u8>) -> Vec<u8> {
        let [bx, by, bz] = self.blocks;
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

    /// Whether a place has clear air around it, as far as `reach_m`.
    pub(super) fn is_far(&self, place: DVec3, reach_m: f64) -> bool {
        let blocks = (reach_m / (self.voxel_m * BLOCK as f64)).ceil();
        let corner = dvec3(-0.5 * self.extent_m, -0.5 * self.extent_m, self.floor_m);
        f64::from(self.leap_at(((place - corner) / (self.voxel_m * BLOCK as f64)).floor().as_ivec3())) > blocks
    }

    /// How many blocks a ray may leap from a place: 0 where cloud may be.
    pub(super) fn leap_at(&self, block: IVec3) -> u8 {
        let [bx, by, bz] = self.blocks;
        let z = block.z.clamp(0, bz as i32 - 1) as usize;
        let (x, y) = (wrapped(block.x.into(), bx), wrapped(block.y.into(), by));
        self.leaps[x + bx * (y + by * z)]
    }

    /// The sample that is nearest to a place, in cubes from the corner.
    pub(super) fn nearest(&self, place: DVec3) -> u8 {
        let [nx, ny, nz] = self.size;
        let (x, y) = (wrapped(floor(place.x), nx), wrapped(floor(place.y), ny));
        self.samples[x + nx * (y + ny * floor(place.z).clamp(0, nz as i64 - 1) as usize)]
    }

    /// Depth below the surface of the spheres: linear between samples, from `-band_m` to `band_m`.
    pub fn depth(&self, place: DVec3) -> f64 {
        let [nx, ny, nz] = self.size;
        let corner = dvec3(-0.5 * self.extent_m, -0.5 * self.extent_m, self.floor_m);
        let texel = (place - corner) / self.voxel_m - 0.5;
        let low = [texel.x, texel.y, texel.z].map(floor);
        let part = texel - dvec3(low[0] as f64, low[1] as f64, low[2] as f64);
        let pair = |low: i64, size: usize| {
            let low = wrapped(low, size);
            [low, if low + 1 < size { low + 1 } else { 0 }]
        };
        let (x, y) = (pair(low[0], nx), pair(low[1], ny));
        let z = [0, 1].map(|s| (low[2] + s).clamp(0, nz as i64 - 1) as usize);
        let at = |x: usize, y: usize, z: usize| f64::from(self.samples[x + nx * (y + ny * z)]);
        let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
        let row = |y: usize, z: usize| mix(at(x[0], y, z), at(x[1], y, z), part.x);
        let slice = |z: usize| mix(row(y[0], z), row(y[1], z), part.y);
        (mix(slice(z[0]), slice(z[1]), part.z) / 127.5 - 1.0) * self.band_m
    }

    /// The same with the noise that moves the surface.
    pub fn rugged_depth(&self, place: DVec3) -> f64 {
        let depth = self.depth(place);
        match self.relief_m > 0.0 && depth.abs() < self.edge_m + self.relief_m {
            true => depth + self.relief_m * self.relief.at(place),
            false => depth,
        }
    }

    /// Density at a place, 0 to 1, in the mean over a length that a sharp edge is drawn over.
    pub fn density(&self, place: DVec3, over_m: f64) -> f64 {
        let depth = self.rugged_depth(place);
        let edge = match self.edge_m > over_m {
            true => depth / self.edge_m,
            false => 0.5 + (depth - 0.5 * self.edge_m) / over_m,
        };
        edge.clamp(0.0, 1.0) * self.above_base(place.z)
    }

    /// Part of the density that the flat base leaves at a height.
    pub fn above_base(&self, z: f64) -> f64 {
        match self.edge_m > 0.0 {
            true => ((z - self.base_m) / self.edge_m).clamp(0.0, 1.0),
            false => f64::from(z >= self.base_m),
        }
    }
}

/// The next whole number below: the library's function costs more than all the rest of a sample.
pub(super) fn floor(value: f64) -> i64 {
    let whole = value as i64;
    whole - i64::from(value < whole as f64)
}

/// An index in a row that repeats; most are within it.
fn wrapped(index: i64, size: usize) -> usize {
    if (0..size as i64).contains(&index) { index as usize } else { index.rem_euclid(size as i64) as usize }
}

/// Samples a side of the domain at which a body's spheres reach no more than [`MOST_WORK`] of them.
fn affordable(body: &Body) -> f64 {
    let reach_m = |sphere: &Sphere| (2.0 * (sphere.radius_m + body.edge_m + body.relief_m)).min(2.0 * body.extent_m);
    let volume_m3: f64 = body.spheres.iter().map(|sphere| reach_m(sphere).powi(3)).sum();
    body.extent_m * (MOST_WORK / volume_m3.max(f64::MIN_POSITIVE)).cbrt()
}
