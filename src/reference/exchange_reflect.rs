//! Light from the ground that arrives at the cloud base. Twin of `shaders/exchange_reflect.wgsl`.

use super::frame::texel_centre;
use super::gather::gather_light;
use super::map::{Map, texel};
use crate::gpu::layout::Exchange;

/// Irradiance of the cloud base from below, from the ground's exitance `up` (its mip levels).
pub fn main(exchange: &Exchange, up: &[Map]) -> Map {
    let side = exchange.texels as usize;
    Map::from_fn(side, side, |x, y| texel(gather_light(up, exchange, texel_centre(x, y, exchange.texels))))
}
