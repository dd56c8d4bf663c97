//! Light that the ground sends up. Twin of `shaders/exchange_emit.wgsl`.

use super::map::Map;
use glam::DVec4;

/// Exitance of the ground: albedo (0..1) times irradiance.
pub fn main(albedo: &Map, irradiance: &Map) -> Map {
    let up = |x, y| (DVec4::from_array(albedo.texel(x, y)) * DVec4::from_array(irradiance.texel(x, y))).to_array();
    Map::from_fn(irradiance.width, irradiance.height, up)
}
