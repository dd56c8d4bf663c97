//! Where sunlight enters the cloud. Twin of `shaders/sun_entry.wgsl`.

use super::base_light::{SAMPLES, samples};
use super::columns::column_top;
use super::frame::{vec2, vec3};
use super::map::Map;
use super::path_across::path_across;
use crate::gpu::layout::Frame;
use glam::{DVec2, dvec2};

/// Bound of a face's irradiance.
const MOST: f64 = 30.0;

/// Irradiance of the cloud's top per horizontal irradiance above it, mean over each texel of the maps of sunlight, in the first
/// channel. Of independent columns 1 everywhere.
pub fn main(frame: &Frame, thickness: &Map) -> Map {
    let side = frame.maps.texels as usize;
    if frame.maps.columns == 1 {
        return Map::from_fn(side, side, |_, _| [1.0, 0.0, 0.0, 0.0]);
    }
    let texel = 0.5 / dvec2(thickness.width as f64, thickness.height as f64);
    let height_at = |place: DVec2| column_top(frame, thickness.sample_periodic(place.to_array()));
    let sample = |uv: DVec2| {
        let place = uv + vec2(frame.place.offset_uv);
        if thickness.sample_periodic(place.to_array())[0] <= 0.0 {
            return 0.0;
        }
        let height_m = height_at(place);
        let (right, down) = (dvec2(texel.x, 0.0), dvec2(0.0, texel.y));
        let rise = dvec2(height_at(place + right) - height_at(place - right), {
            height_at(place - down) - height_at(place + down)
        });
        let slope = rise / (2.0 * texel * f64::from(frame.place.extent_m));
        let sun = vec3(frame.sun.towards);
        let facing = 1.0 - slope.dot(sun.truncate()) / f64::from(frame.sun.slant_cosine);
        if facing <= 0.0 {
            return 0.0;
        }
        if frame.maps.columns == 2 {
            return facing.min(MOST);
        }
        let path_m = path_across(thickness, frame, uv, sun, height_m);
        (-f64::from(frame.medium.beam_550) * f64::from(frame.medium.extinction_550) * path_m).exp() * facing.min(MOST)
    };
    let mean = |x, y| samples(frame, x, y).map(sample).iter().sum::<f64>() / SAMPLES as f64;
    Map::from_fn(side, side, |x, y| [mean(x, y), 0.0, 0.0, 0.0])
}
