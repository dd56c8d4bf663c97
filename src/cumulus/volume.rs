//! The surface of a cumulus layer as a volume of samples: what a ray reads instead of thousands of spheres, at a price that does
//! not depend on their number.

use super::body::{Body, Sphere};
use super::leaps::leaps;
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
    /// Radius of the body's largest ball.
    pub root_m: f64,
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
        let across = across(body.extent_m, height_m, affordable(body));
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
            root_m: body.spheres.iter().map(|sphere| sphere.radius_m).fold(0.0, f64::max),
            relief: Relief::new(body.extent_m),
        };
        look()?;
        volume.fill(&body.spheres);
        look()?;
        volume.leaps = leaps(&volume);
        Ok(volume)
    }

    fn fill(&mut self, spheres: &[Sphere]) {
        let [nx, ny, _] = self.size;
        let (voxel_m, floor_m, band_m, half_m) = (self.voxel_m, self.floor_m, self.band_m, 0.5 * self.extent_m);
        // Large ones first: what is deep inside of them need not be looked at again. In memory too, where slices read them in this order.
        let mut spheres = spheres.to_vec();
        spheres.sort_by(|a, b| b.radius_m.total_cmp(&a.radius_m));
        // Spheres by the slices that they touch.
        let mut touching: Vec<Vec<u32>> = vec![Vec::new(); self.size[2]];
        for (number, sphere) in (0_u32..).zip(&spheres) {
            let reach = sphere.radius_m + band_m;
            let slice = |z: f64| ((z - floor_m) / voxel_m - 0.5).clamp(0.0, self.size[2] as f64 - 1.0);
            let (low, high) = (slice(sphere.centre.z - reach).ceil(), slice(sphere.centre.z + reach).floor());
            for list in touching.get_mut(low as usize..=high as usize).into_iter().flatten() {
                list.push(number);
            }
        }
        let (scale, per_m) = ((127.5 / band_m) as f32, (1.0 / voxel_m) as f32);
        self.samples.par_chunks_mut(nx * ny).zip(&touching).enumerate().for_each(|(k, (slice, touching))| {
            let z = floor_m + (k as f64 + 0.5) * voxel_m;
            // Pages that are written first are made once: those that are read first are a shared one of zeros, and then a copy of it.
            slice.fill(0);
            for &number in touching {
                let sphere = &spheres[number as usize];
                let (dz, reach) = (z - sphere.centre.z, sphere.radius_m + band_m);
                let wide = reach * reach - dz * dz;
                if wide <= 0.0 {
                    continue;
                }
                // Places in units of cubes, from the centre of the first.
                let place = |at: f64| (at + half_m) / voxel_m - 0.5;
                let (cx, cy, across) = (place(sphere.centre.x), place(sphere.centre.y), wide.sqrt() / voxel_m);
                for j in -whole(across - cy)..=whole(cy + across) {
                    let dy = (f64::from(j) - cy) * voxel_m;
                    // Samples at its ends are out of reach in any case: rounding may take them or not.
                    let across = f64::from(((wide - dy * dy) as f32).max(0.0).sqrt() * per_m);
                    let row = &mut slice[nx * wrapped(j.into(), ny)..][..nx];
                    let [from, to] = [-whole(across - cx), whole(cx + across)].map(i64::from);
                    // At most one whole row, in at most two runs without a wrap.
                    let end = (to + 1).min(from + nx as i64);
                    let ball = Chord {
                        radius_m: sphere.radius_m as f32,
                        apart_m2: (dz * dz + dy * dy) as f32,
                        voxel_m: voxel_m as f32,
                        scale,
                    };
                    let mut i = from;
                    while i < end {
                        let first = wrapped(i, nx);
                        // Whole lanes where there is room: what is out of reach stays as it is.
                        let run = ((end - i) as usize).next_multiple_of(LANES).min(nx - first);
                        ball.draw(((i as f64 - cx) * voxel_m) as f32, &mut row[first..first + run]);
                        i += run as i64;
                    }
                }
            }
        });
    }

    /// How far along x, from a place on, all places have clear air around them, as far as `reach_m`; 0 if the place itself has not.
    pub(super) fn clear_m(&self, place: DVec3, reach_m: f64) -> f64 {
        let block_m = self.voxel_m * BLOCK as f64;
        let corner = dvec3(-0.5 * self.extent_m, -0.5 * self.extent_m, self.floor_m);
        let block = ((place - corner) / block_m).floor();
        let clear = f64::from(self.leap_at(block.as_ivec3())) - (reach_m / block_m).ceil();
        if clear > 0.0 { (block.x + clear) * block_m + corner.x - place.x } else { 0.0 }
    }

    /// How many blocks a ray may leap from a place: 0 where cloud may be.
    pub(super) fn leap_at(&self, block: IVec3) -> u8 {
        let [bx, by, bz] = self.blocks;
        let z = block.z.clamp(0, bz as i32 - 1) as usize;
        let (x, y) = (wrapped(block.x.into(), bx), wrapped(block.y.into(), by));
        self.leaps[x + bx * (y + by * z)]
    }

    /// Depth below the surface of the spheres: linear between samples, from `-band_m` to `band_m`.
    pub fn depth(&self, place: DVec3) -> f64 {
        let [nx, ny, nz] = self.size;
        let corner = dvec3(-0.5 * self.extent_m, -0.5 * self.extent_m, self.floor_m);
        let texel = (place - corner) / self.voxel_m - 0.5;
        let [x, y, z] = texel.to_array().map(whole);
        let part = texel - dvec3(f64::from(x), f64::from(y), f64::from(z));
        let pair = |low: i32, size: usize| {
            let low = wrapped(low.into(), size);
            [low, if low + 1 < size { low + 1 } else { 0 }]
        };
        let (x, y) = (pair(x, nx), pair(y, ny));
        let z = [0, 1].map(|s| (z + s).clamp(0, nz as i32 - 1) as usize);
        let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
        let row = |y: usize, z: usize| {
            let row = &self.samples[nx * (y + ny * z)..][..nx];
            mix(row[x[0]].into(), row[x[1]].into(), part.x)
        };
        let slice = |z: usize| mix(row(y[0], z), row(y[1], z), part.y);
        (mix(slice(z[0]), slice(z[1]), part.z) / 127.5 - 1.0) * self.band_m
    }

    /// The same with the noise that moves the surface.
    pub fn rugged_depth(&self, place: DVec3) -> f64 {
        self.rugged(self.depth(place), place)
    }

    fn rugged(&self, depth: f64, place: DVec3) -> f64 {
        match self.relief_m > 0.0 && depth.abs() < self.edge_m + self.relief_m {
            true => depth + self.relief_m * self.relief.at(place),
            false => depth,
        }
    }

    /// Density at a place, 0 to 1, in the mean over a length that a sharp edge is drawn over.
    pub fn density(&self, place: DVec3, over_m: f64) -> f64 {
        self.density_of(self.rugged_depth(place), place.z, over_m)
    }

    fn density_of(&self, depth: f64, z: f64, over_m: f64) -> f64 {
        // Depths beyond the band are not known: an edge that is drawn over more would leave cloud in clear air.
        let over_m = over_m.min(2.0 * self.band_m - self.edge_m);
        let edge = match self.edge_m > over_m {
            true => depth / self.edge_m,
            false => 0.5 + (depth - 0.5 * self.edge_m) / over_m,
        };
        edge.clamp(0.0, 1.0) * self.above_base(z)
    }

    /// The same at the corners of a cube of half a side around a centre: along x, then y, then z.
    pub(super) fn densities(&self, centre: DVec3, half_m: f64, over_m: f64) -> [f64; 8] {
        let [nx, ny, nz] = self.size;
        let corner = dvec3(-0.5 * self.extent_m, -0.5 * self.extent_m, self.floor_m);
        let corners = [centre - half_m, centre + half_m];
        // Of each axis and side: what lies before and after, and the part of the way between.
        let [a, b] = corners.map(|place| {
            let texel = (place - corner) / self.voxel_m - 0.5;
            let low = texel.to_array().map(whole);
            (low, texel - DVec3::from_array(low.map(f64::from)))
        });
        let pair = |low: i32, size: usize| {
            let low = wrapped(low.into(), size);
            [low, if low + 1 < size { low + 1 } else { 0 }]
        };
        let (xs, ys) = ([a, b].map(|(low, _)| pair(low[0], nx)), [a, b].map(|(low, _)| pair(low[1], ny)));
        let zs = [a, b].map(|(low, _)| [0, 1].map(|s| (low[2] + s).clamp(0, nz as i32 - 1) as usize));
        let parts = [a.1, b.1];
        let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
        let mut densities = [0.0; 8];
        for (k, pair) in densities.chunks_exact_mut(2).enumerate() {
            let (j, k) = (k & 1, k >> 1);
            let (part, y, z) = (parts[j].y, ys[j], zs[k]);
            let rows = [0, 1, 2, 3].map(|i| &self.samples[nx * (y[i & 1] + ny * z[i >> 1])..][..nx]);
            for (i, density) in pair.iter_mut().enumerate() {
                let [a, b, c, d] = rows.map(|row| mix(row[xs[i][0]].into(), row[xs[i][1]].into(), parts[i].x));
                let depth = (mix(mix(a, b, part), mix(c, d, part), parts[k].z) / 127.5 - 1.0) * self.band_m;
                let place = dvec3(corners[i].x, corners[j].y, corners[k].z);
                *density = self.density_of(self.rugged(depth, place), place.z, over_m);
            }
        }
        densities
    }

    /// Part of the density that the flat base leaves at a height.
    pub fn above_base(&self, z: f64) -> f64 {
        match self.edge_m > 0.0 {
            true => ((z - self.base_m) / self.edge_m).clamp(0.0, 1.0),
            false => f64::from(z >= self.base_m),
        }
    }
}

/// Samples across a domain that is filled to a height, of so many that can be paid.
fn across(extent_m: f64, height_m: f64, affordable: f64) -> usize {
    let side = (SAMPLES / height_m * extent_m).cbrt().min(MAX_SIDE).min(HIGHEST * extent_m / height_m);
    // Finer than 2 m no edge can be seen.
    let side = side.min(affordable).min(extent_m / 2.0).max(1.0);
    BLOCK * (side / BLOCK as f64).floor().max(1.0) as usize
}

/// How finely clouds up to a height are sampled.
pub(super) struct Samples {
    pub(super) voxel_m: f64,
    pub(super) count: f64,
}

/// The samples of a domain that is filled to a height, at most.
pub(super) fn samples(extent_m: f64, height_m: f64) -> Samples {
    let across = across(extent_m, height_m, f64::INFINITY) as f64;
    let voxel_m = extent_m / across;
    // Cubes of clear air below and above, to whole blocks.
    Samples { voxel_m, count: across * across * (height_m / voxel_m + 2.0 + BLOCK as f64) }
}

/// Samples of a row that are drawn at once.
const LANES: usize = 8;

/// Where a row of samples passes a sphere.
struct Chord {
    radius_m: f32,
    /// Square of its distance from the sphere's centre.
    apart_m2: f32,
    voxel_m: f32,
    /// Bytes a metre.
    scale: f32,
}

impl Chord {
    /// Draws it on samples, the first of which is so far beyond the centre.
    #[inline]
    fn draw(&self, offset_m: f32, samples: &mut [u8]) {
        let depth = |step: f32| {
            let along_m = offset_m + step * self.voxel_m;
            let depth = (self.radius_m - (self.apart_m2 + along_m * along_m).sqrt()) * self.scale;
            // Rounded, by what is left of the digits of a float: a cast would look at each lane by itself.
            ((depth + 127.5).clamp(0.0, 255.0) + ROUND).to_bits() as u8
        };
        let (lanes, rest) = samples.as_chunks_mut::<LANES>();
        // Sums of small whole numbers: they cost less than casts do.
        let mut first = 0.0;
        for lane in lanes {
            if *lane != [u8::MAX; LANES] {
                let drawn: [u8; LANES] = std::array::from_fn(|step| depth(first + step as f32));
                lane.iter_mut().zip(drawn).for_each(|(sample, drawn)| *sample = (*sample).max(drawn));
            }
            first += LANES as f32;
        }
        for (step, sample) in rest.iter_mut().enumerate() {
            *sample = (*sample).max(depth(first + step as f32));
        }
    }
}

/// Floats from here to twice this are whole numbers.
const ROUND: f32 = 8_388_608.0;

/// The next whole number below: the library's function costs more than all the rest of a sample.
pub(super) fn floor(value: f64) -> i64 {
    let whole = value as i64;
    whole - i64::from(value < whole as f64)
}

/// The same, or the number itself less 1 where it is a whole one, of what is not far from 0: for cells whose borders belong to either, at
/// a price below that of a cast.
#[inline]
pub(super) fn whole(value: f64) -> i32 {
    /// Doubles around this are whole numbers.
    const ROUND: f64 = 6_755_399_441_055_744.0;
    (value - 0.5 + ROUND).to_bits() as i32
}

/// An index in a row that repeats; most are within it.
#[inline]
pub(super) fn wrapped(index: i64, size: usize) -> usize {
    if (0..size as i64).contains(&index) { index as usize } else { index.rem_euclid(size as i64) as usize }
}

/// Samples a side of the domain at which a body's spheres reach no more than [`MOST_WORK`] of them.
fn affordable(body: &Body) -> f64 {
    let reach_m = |sphere: &Sphere| (2.0 * (sphere.radius_m + body.edge_m + body.relief_m)).min(2.0 * body.extent_m);
    let volume_m3: f64 = body.spheres.iter().map(|sphere| reach_m(sphere).powi(3)).sum();
    body.extent_m * (MOST_WORK / volume_m3.max(f64::MIN_POSITIVE)).cbrt()
}
