//! Output: downward irradiance on the ground, or a part of it. Twin of `shaders/irradiance.wgsl`.

use super::frame::{exp, image, vec2, vec3};
use super::gather::gather_light;
use super::map::Map;
use super::path::path_in_layer;
use super::sun::sun_through;
use crate::gpu::layout::{Exchange, Frame, View};

/// Irradiance of each texel, three colours, in units of the sun's irradiance.
pub fn main(
    frame: &Frame,
    view: &View,
    exchange: &Exchange,
    thickness: &Map,
    transmittance: &Map,
    down: &[Map],
) -> Vec<f64> {
    image(view, |uv| {
        let path_m = path_in_layer(thickness, frame, uv + vec2(exchange.shift_uv), vec3(frame.sun));
        let beam = sun_through(frame, transmittance, path_m).beam;
        let total = beam + gather_light(down, exchange, uv);
        let horizontal = vec3(frame.sun_light) * f64::from(frame.sun_light[3]);
        let unscattered = horizontal * exp(-vec3(frame.extinction) * path_m);
        let direct = if view.peak == 1 { beam } else { unscattered.min(beam) };
        match view.part {
            1 => direct,
            2 => total - direct,
            _ => total,
        }
        .to_array()
    })
}
