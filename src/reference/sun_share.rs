//! How much of the sun a cloud gets. Twin of `shaders/sun_share.wgsl`.

use super::frame::{LEAST_LIT, texel_centre, vec2, vec3};
use super::map::{Map, rgb};
use crate::gpu::layout::{Frame, Share};
use glam::DVec3;

/// More than a column's own light counts as a part of no less than this.
pub const LEAST_OWN: f64 = 0.02;

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
    /// What goes on from the layer above as the sun's light.
    pub above: &'a Map,
    /// Fourth channel: optical depth of transport of the layers above.
    pub above_beam: &'a Map,
}

/// Factors for the light seen from below and from above, as without the layers above; fourth channel: their depth.
pub fn main(frame: &Frame, share: &Share, maps: &Maps<'_>) -> [Map; 2] {
    let side = frame.maps.texels as usize;
    let place =
        |x: usize, y: usize| (texel_centre(x, y, [frame.maps.texels; 2]) + vec2(frame.place.above_uv)).to_array();
    let lit = |x: usize, y: usize| rgb(maps.above.sample_periodic(place(x, y))).max(DVec3::splat(LEAST_LIT));
    let depth = |x: usize, y: usize| maps.above_beam.sample_periodic(place(x, y))[3];
    let below = Map::from_fn(side, side, |x, y| {
        let at = |map: &Map| rgb(map.texel(x, y));
        let diffuse = at(maps.tilted).lerp(vec3(share.entry_scale) * at(maps.entered), share.entry_weight.into());
        let own = at(maps.column);
        let gets = (at(maps.beam) + diffuse) / lit(x, y);
        let dark = 1.0 + (gets - own) / LEAST_OWN;
        let reaches = DVec3::select(own.cmpge(DVec3::splat(LEAST_OWN)), gets / own, dark);
        (vec3(share.in_air) * reaches.max(DVec3::ZERO)).extend(depth(x, y)).to_array()
    });
    let above = Map::from_fn(side, side, |x, y| {
        (maps.reflected.texel(x, y)[3] * vec3(share.reflect_scale)).extend(depth(x, y)).to_array()
    });
    [below, above]
}
