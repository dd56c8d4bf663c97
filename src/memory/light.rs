//! Light between the layers and the ground.

use super::droplets::transport_length_m;
use super::heights::Heights;
use super::tally::Tally;
use crate::field::FieldBytes;
use crate::ground;
use crate::job::Images;
use crate::light::{Grids, LayerShape, SceneShape, grids};
use crate::plan::Plan;
use crate::request::Request;
use crate::scene::{Layer, Scene};

/// A texel of a map of light.
const TEXEL: u64 = 16;
/// Maps of a layer's sunlight with mip levels, one more where there are several layers; those without; and bytes of the single ones of entry.
const AVERAGED: u64 = 6;
const SINGLE: u64 = 3;
const ENTRY: u64 = 12;
/// Of these, what stays: two shares.
const SHARES: u64 = 2;
/// Light on a layer from above and from below on the exchange grid: four maps on the device, as they are and on their way.
const EXCHANGED: u64 = 4;
/// What the host has of a texel of the exchange grid, for each layer: seven maps as they are read back, as sources and as sums of the stack;
/// and once: transfer, albedo, and the fields of the solver for two pairs of colours.
const HOST_OF_LAYER: u64 = 7 * TEXEL * 3 + 4 * 12 * 2 + 72 + 96 + 72;
const HOST: u64 = 2 * 14 * 16 + 8 * 24;

fn planned(scene: &Scene, plan: &Plan, maps: &[FieldBytes], images: &Images) -> Grids {
    let heights: Vec<Heights> = scene.layers.iter().map(|layer| Heights::new(layer, images)).collect();
    let shape = |(layer, heights): (&Layer, &Heights)| LayerShape {
        transport_length_m: transport_length_m(&layer.droplets),
        depth_m: heights.deepest_m,
    };
    let layers: Vec<LayerShape> = scene.layers.iter().zip(&heights).map(shape).collect();
    let shape = SceneShape {
        extent_m: scene.extent_m(),
        base_m: heights.first().map_or(0.0, |lowest| lowest.base_m),
        layers: &layers,
        thickness_texels: maps.iter().map(|map| map.size[0].max(map.size[1])).max().unwrap_or(1),
        albedo_texels: ground::texels_a_side(&scene.ground.albedo, images),
    };
    grids(&shape, plan)
}

/// The maps of sunlight, and the exchange.
pub(super) fn light(
    tally: &mut Tally,
    scene: &Scene,
    request: &Request,
    plan: &Plan,
    maps: &[FieldBytes],
    images: &Images,
) {
    if !request.texture().needs().light || maps.is_empty() {
        return;
    }
    let layers = maps.len() as u64;
    let grids = planned(scene, plan, maps, images);
    let square = |side: u32| u64::from(side) * u64::from(side);
    let (sun, exchange) = (square(grids.sun_texels), square(grids.exchange_texels));
    let averaged = TEXEL * sun * (AVERAGED + u64::from(layers > 1)) * if grids.level() > 0 { 4 } else { 3 } / 3;
    let own = averaged + sun * (SINGLE * TEXEL + ENTRY);
    let host = layers * exchange * HOST_OF_LAYER + exchange * HOST;
    tally.pass("light", layers * own + host);
    tally.keep("light", layers * (SHARES * TEXEL * sun + 2 * EXCHANGED * TEXEL * exchange) + TEXEL * exchange);
}
