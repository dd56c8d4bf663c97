//! The sun's light at cloud base and top by a lattice. Twin of `shaders/lattice_light.wgsl`.

use super::base_light::{BaseLight, SAMPLES, samples};
use super::frame::{LEAST_LIT, exp, texel_centre, vec2, vec3};
use super::map::{Map, rgb};
use super::path_across::path_across;
use super::slab::slab_reflectance;
use super::sun::sun_through;
use crate::gpu::layout::{Frame, LatticeLight};
use glam::DVec3;
use rayon::prelude::*;

/// The textures that the pass reads.
#[derive(Debug, Clone, Copy)]
pub struct Maps<'a> {
    /// Metres.
    pub thickness: &'a Map,
    /// Transmitted part of a beam: columns of cosine, rows of optical depth.
    pub transmittance: &'a Map,
    /// Reflected part of a beam.
    pub reflectance: &'a Map,
    /// The lattice's scattered light, down and up.
    pub down: &'a Map,
    /// See `down`.
    pub up: &'a Map,
    /// Exact light of a slab over that of the lattice: a row of transmitted, a row of reflected.
    pub factors: &'a Map,
    /// What goes on from the layer above as the sun's light.
    pub above: &'a Map,
}

/// A column that reflects less than this is next to none, and shows no more than this many times its own light.
const LEAST_REFLECTED: f64 = 1e-4;
const MOST_ENTERING: f64 = 8.0;

/// The four maps.
pub fn main(frame: &Frame, lattice: &LatticeLight, maps: &Maps<'_>) -> BaseLight {
    let side = frame.maps.texels as usize;
    let (extinction, cosine) = (f64::from(frame.medium.extinction_550), f64::from(frame.sun.slant_cosine));
    let factor = |depth: f64, row: f64| {
        let nodes = maps.factors.width as f64;
        let node = (depth / f64::from(lattice.reach)).min(1.0).sqrt() * (nodes - 1.0);
        rgb(maps.factors.sample_clamped([(node + 0.5) / nodes, row]))
    };
    let texel = |x: usize, y: usize| {
        let centre = texel_centre(x, y, [frame.maps.texels; 2]);
        let lit = rgb(maps.above.sample_periodic((centre + vec2(frame.place.above_uv)).to_array()))
            .max(DVec3::splat(LEAST_LIT));
        let mut entering = 0.0;
        let mut sums = [DVec3::ZERO; 3];
        for uv in samples(frame, x, y) {
            let place = (uv + vec2(frame.place.offset_uv)).to_array();
            let height_m = maps.thickness.sample_periodic(place)[0];
            let path_m = path_across(maps.thickness, frame, uv, vec3(frame.sun.towards), 0.0);
            let through = sun_through(frame, maps.transmittance, path_m);
            let goes_on = if frame.place.lowest == 1 { through.beam } else { through.forward };
            let direct = exp(-vec3(lattice.kept) * vec3(frame.medium.extinction) * path_m);
            let depth = extinction * path_m * cosine;
            let down = factor(depth, 0.25) * (direct + rgb(maps.down.sample_periodic(place)));
            let own_depth = extinction * height_m;
            let up = factor(own_depth, 0.75) * rgb(maps.up.sample_periodic(place));
            let own = slab_reflectance(maps.reflectance, own_depth, cosine);
            entering += (up.y / own.y.max(LEAST_REFLECTED)).min(MOST_ENTERING);
            let parts = [goes_on, (down - goes_on).max(DVec3::ZERO), up];
            sums.iter_mut().zip(parts).for_each(|(sum, part)| *sum += part);
        }
        let [beam, scattered, up] = sums.map(|sum| lit * sum / SAMPLES as f64);
        [beam.extend(up.x), scattered.extend(up.y), scattered.extend(up.z), up.extend(entering / SAMPLES as f64)]
            .map(|texel| texel.to_array())
    };
    let texels: Vec<_> = (0..side * side).into_par_iter().map(|i| texel(i % side, i / side)).collect();
    let map = |part: usize| Map { width: side, height: side, texels: texels.iter().map(|texel| texel[part]).collect() };
    BaseLight { beam: map(0), tilted: map(1), entered: map(2), reflected: map(3) }
}
