//! Light at the cloud base before any of it has met the ground. Twin of `shaders/base_light.wgsl`.

use super::frame::{vec2, vec3};
use super::map::{Map, texel};
use super::path::path_in_layer;
use super::slab::{slab_not_reflected_diffuse, slab_transmittance_diffuse};
use super::sun::sun_through;
use crate::gpu::layout::{Exchange, Frame};
use glam::{DVec2, DVec3, dvec2};
use rayon::prelude::*;
use std::f64::consts::PI;

/// Means over each texel of the exchange grid.
#[derive(Debug, Clone, PartialEq)]
pub struct BaseLight {
    /// Horizontal irradiance of the sun's beam.
    pub beam: Map,
    /// Exitance of diffuse light, downwards.
    pub diffuse: Map,
    /// Part of diffuse light from below that the cloud does not send back, 0..1.
    pub not_reflected: Map,
}

/// The three maps, in units of the sun's irradiance.
pub fn main(frame: &Frame, exchange: &Exchange, thickness: &Map, transmittance: &Map, diffuse: &Map) -> BaseLight {
    let side = exchange.texels as usize;
    let samples = f64::from(exchange.samples);
    let sample = |uv: DVec2| -> [DVec3; 3] {
        let path_m = path_in_layer(thickness, frame, uv, vec3(frame.sun));
        let through = sun_through(frame, transmittance, path_m);
        let height_m = thickness.sample_periodic((uv + vec2(frame.offset_uv)).to_array())[0];
        let column = f64::from(frame.extinction[3]) * height_m;
        let sky = PI * vec3(frame.sky_light) * slab_transmittance_diffuse(diffuse, column);
        [through.beam, through.total - through.beam + sky, slab_not_reflected_diffuse(diffuse, column)]
    };
    let mean = |x: usize, y: usize| {
        let mut sum = [DVec3::ZERO; 3];
        for i in 0..exchange.samples * exchange.samples {
            let inside = dvec2(f64::from(i % exchange.samples), f64::from(i / exchange.samples)) + 0.5;
            let uv = (dvec2(x as f64, y as f64) + inside / samples) / f64::from(exchange.texels);
            for (sum, part) in sum.iter_mut().zip(sample(uv)) {
                *sum += part;
            }
        }
        sum.map(|sum| texel(sum / (samples * samples)))
    };
    let means: Vec<_> = (0..side * side).into_par_iter().map(|i| mean(i % side, i / side)).collect();
    let map =
        |part: usize| Map { width: side, height: side, texels: means.iter().map(|texels| texels[part]).collect() };
    BaseLight { beam: map(0), diffuse: map(1), not_reflected: map(2) }
}
