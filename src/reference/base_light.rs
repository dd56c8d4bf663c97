//! The sun's light at cloud base and top. Twin of `shaders/base_light.wgsl`.

use super::frame::{LEAST_LIT, texel_centre, vec2, vec3};
use super::map::{Map, rgb};
use super::path_across::path_across;
use super::slab::slab_reflectance;
use super::sun::{SunThrough, sun_through};
use crate::gpu::layout::Frame;
use glam::{DVec2, DVec3, Vec2Swizzles as _};
use rayon::prelude::*;

/// Means over each texel of the maps of sunlight, as parts of the horizontal irradiance above all layers.
#[derive(Debug, Clone, PartialEq)]
pub struct BaseLight {
    /// Beam at the base; fourth channel: red light sent up along slanted rays.
    pub beam: Map,
    /// Diffuse light at the base along slanted rays; fourth channel: green light sent up.
    pub tilted: Map,
    /// Diffuse light at the base by entry; fourth channel: blue light sent up.
    pub entered: Map,
    /// Light sent up by entry; fourth channel: what enters, relative.
    pub reflected: Map,
}

/// The textures that the pass reads.
#[derive(Debug, Clone, Copy)]
pub struct Maps<'a> {
    /// Metres.
    pub thickness: &'a Map,
    /// Transmitted part of a beam: columns of cosine, rows of optical depth.
    pub transmittance: &'a Map,
    /// Reflected part of a beam.
    pub reflectance: &'a Map,
    /// Relative irradiance of the cloud's top.
    pub entry: &'a Map,
    /// The same, blurred.
    pub blurred: &'a Map,
    /// What goes on from the layer above as the sun's light.
    pub above: &'a Map,
}

/// Light spreads in clouds deeper than a third of a transport length.
const SPREADING: f64 = 3.0;

/// How many places in a texel of the maps of sunlight the thickness map is sampled at.
pub(super) const SAMPLES: usize = 2;

/// The places themselves.
pub(super) fn samples(frame: &Frame, x: usize, y: usize) -> [DVec2; SAMPLES] {
    let (middle, apart) =
        (texel_centre(x, y, [frame.maps.texels; 2]), vec2(frame.maps.sample_at) / f64::from(frame.maps.texels));
    let apart = if (x + y) % 2 == 1 { apart.yx() } else { apart };
    [middle + apart, middle - apart]
}

/// The four maps.
pub fn main(frame: &Frame, maps: &Maps<'_>) -> BaseLight {
    let side = frame.maps.texels as usize;
    let (extinction, cosine) = (f64::from(frame.medium.extinction_550), f64::from(frame.sun.slant_cosine));
    let going_on = |through: &SunThrough| if frame.place.lowest == 1 { through.beam } else { through.forward };
    let texel = |x: usize, y: usize| {
        let centre = texel_centre(x, y, [frame.maps.texels; 2]);
        let lit = rgb(maps.above.sample_periodic((centre + vec2(frame.place.above_uv)).to_array()))
            .max(DVec3::splat(LEAST_LIT));
        let (at_place, around) = (maps.entry.texel(x, y)[0], maps.blurred.texel(x, y)[0]);
        let mut entering_sum = 0.0;
        let mut sums = [DVec3::ZERO; 5];
        for uv in samples(frame, x, y) {
            let height_m = maps.thickness.sample_periodic((uv + vec2(frame.place.offset_uv)).to_array())[0];
            let column_m = height_m / cosine;
            // Light leaves a thin cloud where it came in.
            let spread = -(-SPREADING * f64::from(frame.medium.transport_550) * extinction * height_m).exp_m1();
            let entering = at_place + (around - at_place) * spread;
            entering_sum += entering;
            let path_m = match frame.maps.columns {
                1 => column_m,
                _ => path_across(maps.thickness, frame, uv, vec3(frame.sun.towards), 0.0),
            };
            let reflectance = |path_m: f64| slab_reflectance(maps.reflectance, extinction * path_m * cosine, cosine);
            let through = |path_m: f64| sun_through(frame, maps.transmittance, path_m);
            let (along, down) = (through(path_m), through(column_m));
            let parts = [
                going_on(&along),
                along.total - going_on(&along),
                entering * (down.total - going_on(&down)),
                entering * reflectance(column_m),
                reflectance(path_m),
            ];
            sums.iter_mut().zip(parts).for_each(|(sum, part)| *sum += part);
        }
        let [beam, tilted, entered, reflected, sent_up] = sums.map(|sum| lit * sum / SAMPLES as f64);
        [
            beam.extend(sent_up.x),
            tilted.extend(sent_up.y),
            entered.extend(sent_up.z),
            reflected.extend(entering_sum / SAMPLES as f64),
        ]
        .map(|texel| texel.to_array())
    };
    let texels: Vec<_> = (0..side * side).into_par_iter().map(|i| texel(i % side, i / side)).collect();
    let map = |part: usize| Map { width: side, height: side, texels: texels.iter().map(|texel| texel[part]).collect() };
    BaseLight { beam: map(0), tilted: map(1), entered: map(2), reflected: map(3) }
}
