//! Output: downward irradiance on the ground, or a part of it. Twin of `shaders/irradiance.wgsl`.

use super::frame::{image, vec3};
use super::ground_sun::GroundSun;
use super::map::{Map, rgb};
use crate::gpu::layout::{Frame, View};
use glam::DVec3;

/// Irradiance of each texel, three colours, in units of the sun's irradiance. `gathered`: light of the cloud base on the
/// ground.
pub fn main(frame: &Frame, view: &View, ground_sun: &[GroundSun], gathered: &Map) -> Vec<f64> {
    let sun = &frame.sun;
    let horizontal = vec3(sun.irradiance) * f64::from(sun.cosine) * vec3(sun.through_air);
    let diffuse = image(view, |uv| rgb(gathered.sample_periodic(uv.to_array())).to_array());
    let texels = diffuse.chunks(3).zip(ground_sun);
    texels
        .flat_map(|(diffuse, sun): (_, &GroundSun)| {
            let beam = horizontal * sun.beam.truncate();
            let total = beam + DVec3::from_slice(diffuse);
            let direct = if view.peak == 1 { beam } else { horizontal * sun.unscattered.truncate() };
            match view.part {
                1 => direct,
                2 => total - direct,
                _ => total,
            }
            .to_array()
        })
        .collect()
}
