//! Diffuse light that leaves the cloud base downwards. Twin of `shaders/exchange_down.wgsl`.

use super::frame::vec3;
use super::map::{Map, rgb, texel};
use crate::gpu::layout::Budget;

/// What the cloud base gives and gets.
#[derive(Debug, Clone, PartialEq)]
pub struct Base {
    /// Exitance downwards: light of sun and sky, and what the cloud sends back of the ground's light.
    pub down: Map,
    /// Balanced irradiance from the ground.
    pub upwelling: Map,
}

/// Both maps, in units of the sun's irradiance.
pub fn main(budget: &Budget, diffuse: &Map, not_reflected: &Map, arriving: &Map) -> Base {
    let upwelling = |x, y| vec3(budget.scale) * rgb(arriving.texel(x, y));
    let down = |x, y| rgb(diffuse.texel(x, y)) + upwelling(x, y) * (1.0 - rgb(not_reflected.texel(x, y)));
    Base {
        down: Map::from_fn(diffuse.width, diffuse.height, |x, y| texel(down(x, y))),
        upwelling: Map::from_fn(diffuse.width, diffuse.height, |x, y| texel(upwelling(x, y))),
    }
}
