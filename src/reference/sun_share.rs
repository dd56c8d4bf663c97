//! How much of the sun a cloud gets. Twin of `shaders/sun_share.wgsl`.

use super::frame::{texel_centre, vec2, vec3};
use super::map::{Map, rgb, texel};
use crate::gpu::layout::{Frame, Share};
use glam::DVec3;

/// The textures that the pass reads.
#[derive(Debug, Clone, Copy)]
pub struct Maps<'a> {
    /// Beam at the base.
    pub beam: &'a Map,
    /// Diffuse light at the base along slanted rays.
    pub tilted: &'a Map,
    /// Diffuse light at the base by entry.
    pub entered: &'a Map,
    /// Transmitted part of the sun's light by columns.
    pub column: &'a Map,
    /// Light sent up by entry; fourth channel: what enters, relative.
    pub reflected: &'a Map,
    /// What the layer above leaves of the beam.
    pub above: &'a Map,
}

/// Factors for the light seen from below and from above.
pub fn main(frame: &Frame, share: &Share, maps: &Maps<'_>) -> [Map; 2] {
    let side = frame.maps.texels as usize;
    let below = Map::from_fn(side, side, |x, y| {
        let at = |map: &Map| rgb(map.texel(x, y));
        let diffuse = at(maps.tilted).lerp(vec3(share.entry_scale) * at(maps.entered), share.entry_weight.into());
        texel((at(maps.beam) + diffuse) / at(maps.column).max(DVec3::splat(1e-9)))
    });
    let above = Map::from_fn(side, side, |x, y| {
        let place = texel_centre(x, y, [frame.maps.texels; 2]) + vec2(frame.place.above_uv);
        let lit = rgb(maps.above.sample_periodic(place.to_array()));
        texel(lit * maps.reflected.texel(x, y)[3] * vec3(share.reflect_scale))
    });
    [below, above]
}
