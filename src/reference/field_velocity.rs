//! Velocity of the eddies. Twin of `shaders/field_velocity.wgsl`.

use super::map::Map;
use crate::gpu::layout::Eddies;

/// Velocity relative to its root mean square, in the first two channels.
pub fn main(eddies: &Eddies, bands: &[Map]) -> Map {
    Map::from_fn(bands[0].width, bands[0].height, |x, y| {
        let part = |axis: usize| -> f64 {
            let of_band = |(b, band): (usize, &Map)| {
                let texel = band.texel(x, y);
                f64::from(eddies.cosines[b]) * texel[axis] + f64::from(eddies.sines[b]) * texel[2 + axis]
            };
            bands.iter().enumerate().map(of_band).sum()
        };
        [part(0), part(1), 0.0, 0.0]
    })
}
