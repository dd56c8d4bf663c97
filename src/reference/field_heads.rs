//! Ice at the height where it forms. Twin of `shaders/field_heads.wgsl`.

use super::frame::texel_centre;
use super::map::Map;
use crate::gpu::layout::Trails;

/// Ice in the first channel. `octaves`: up to three maps of four octaves each.
pub fn main(trails: &Trails, octaves: &[Map]) -> Map {
    let width = trails.width as usize;
    let weights = [trails.low, trails.middle, trails.high];
    let value = |place: [f64; 2]| {
        let noise = octaves.iter().zip(weights).map(|(map, weights)| {
            map.sample_periodic(place).iter().zip(weights).map(|(noise, weight)| noise * f64::from(weight)).sum::<f64>()
        });
        noise.sum::<f64>().exp()
    };
    let parts = f64::from(trails.parts);
    let step_uv = trails.along_uv.map(|way| f64::from(way) / f64::from(trails.steps));
    Map::from_fn(width, width, |x, y| {
        let uv = texel_centre(x, y, [trails.width; 2]);
        let part = |i: u32| {
            let way = (f64::from(i) + 0.5) / parts - 0.5;
            value([uv.x + step_uv[0] * way, uv.y + step_uv[1] * way])
        };
        [(0..trails.parts).map(part).sum::<f64>() / parts, 0.0, 0.0, 0.0]
    })
}
