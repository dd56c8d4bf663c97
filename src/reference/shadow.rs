//! Output: the part of the sun's beam that reaches the ground. Twin of `shaders/shadow.wgsl`.

use super::frame::{image, vec2, vec3};
use super::map::Map;
use super::path::path_in_layer;
use crate::gpu::layout::{Exchange, Frame, View};

/// The part, 0..1, at 550 nm, of each texel; 0 when the sun is down.
pub fn main(frame: &Frame, view: &View, exchange: &Exchange, thickness: &Map) -> Vec<f64> {
    image(view, |uv| {
        if frame.sun_light[3] <= 0.0 {
            return [0.0];
        }
        let path_m = path_in_layer(thickness, frame, uv + vec2(exchange.shift_uv), vec3(frame.sun));
        let part = if view.peak == 1 { f64::from(frame.beam[3]) } else { 1.0 };
        [(-part * f64::from(frame.extinction[3]) * path_m).exp()]
    })
}
