//! Output: downward irradiance on the ground, or a part of it. Twin of `shaders/irradiance.wgsl`.

use super::frame::{image, vec3};
use super::map::{Map, rgb};
use crate::gpu::layout::{Frame, View};
use glam::{DVec3, DVec4};

/// Irradiance of each texel, three colours, in units of the sun's irradiance. `gathered`: light of the cloud base on the
/// ground. `with_peak`: what is left of the sun's beam with its 5-degree peak; `beam`: of what counts as the beam.
pub fn main(frame: &Frame, view: &View, [with_peak, beam]: [&[DVec4]; 2], gathered: &Map) -> Vec<f64> {
    let sun = &frame.sun;
    let horizontal = vec3(sun.irradiance) * f64::from(sun.cosine) * vec3(sun.through_air);
    let diffuse = image(view, |uv| rgb(gathered.sample_periodic(uv.to_array())).to_array());
    let texels = diffuse.chunks(3).zip(with_peak.iter().zip(beam));
    texels
        .flat_map(|(diffuse, (with_peak, beam))| {
            let total = horizontal * with_peak.truncate() + DVec3::from_slice(diffuse);
            let direct = horizontal * beam.truncate();
            match view.part {
                1 => direct,
                2 => total - direct,
                _ => total,
            }
            .to_array()
        })
        .collect()
}
