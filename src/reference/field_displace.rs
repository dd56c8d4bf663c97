//! A step of the displacement. Twin of `shaders/field_displace.wgsl`.

use super::map::Map;
use crate::gpu::layout::Step;

/// Two layers of displacement (x, y and z, w) after the step, domains.
pub fn main(step: &Step, velocity: &Map, before: &Map) -> Map {
    let length = f64::from(step.length_uv);
    Map::from_fn(before.width, before.height, |x, y| {
        let uv = [(x as f64 + 0.5) / before.width as f64, (y as f64 + 0.5) / before.height as f64];
        let back = |way: [f64; 4], by: f64| [uv[0] - by * way[0], uv[1] - by * way[1]];
        let moved = velocity.sample_periodic(back(velocity.texel(x, y), 0.5 * length));
        let carried = before.sample_periodic(back(moved, length));
        std::array::from_fn(|i| f64::from(step.keep[i]) * carried[i] + length * moved[i % 2])
    })
}
