//! A Gaussian blur along one axis. Twin of `shaders/blur.wgsl`.

use super::map::Map;
use crate::gpu::layout::Blur;

/// The blurred first channel of a periodic map.
pub fn main(blur: &Blur, map: &Map) -> Map {
    let place = |at: usize, axis: i32, i: i32, size: usize| {
        (at as i64 + i64::from(axis) * i64::from(i)).rem_euclid(size as i64) as usize
    };
    Map::from_fn(map.width, map.height, |x, y| {
        let (mut sum, mut weights) = (0.0, 0.0);
        for i in -blur.radius..=blur.radius {
            let weight = (-f64::from(blur.sharpness) * f64::from(i * i)).exp();
            let [across, down] = blur.axis;
            sum += weight * map.texel(place(x, across, i, map.width), place(y, down, i, map.height))[0];
            weights += weight;
        }
        [sum / weights, 0.0, 0.0, 0.0]
    })
}
