//! Irradiance of the ground on the exchange grid. Twin of `shaders/exchange_return.wgsl`.

use super::frame::{texel_centre, vec2};
use super::gather::gather_light;
use super::map::{Map, rgb, texel};
use crate::gpu::layout::Exchange;

/// The sun's beam, shifted along its ray, and light from the cloud base's exitance `down` (its mip levels).
pub fn main(exchange: &Exchange, beam: &Map, down: &[Map]) -> Map {
    let side = exchange.texels as usize;
    Map::from_fn(side, side, |x, y| {
        let uv = texel_centre(x, y, exchange.texels);
        let direct = rgb(beam.sample_periodic((uv + vec2(exchange.shift_uv)).to_array()));
        texel(direct + gather_light(down, exchange, uv))
    })
}
