//! Balance of the light between ground and cloud. Twin of `shaders/exchange_budget.wgsl`.

use super::frame::vec3;
use super::map::{Map, rgb};
use crate::gpu::layout::Budget;
use glam::DVec3;

/// What the shader writes into its [`Budget`], in double precision.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Balance {
    /// Factor by which all light between ground and cloud must be multiplied so that as much leaves as enters.
    pub scale: DVec3,
    /// Largest change of irradiance since the last pass, relative to the mean irradiance.
    pub change: DVec3,
}

/// The balance of a pass. What enters is `source`: irradiance of the ground without any exchange. What leaves is absorbed
/// by the ground under `irradiance`, or was `arriving` at the cloud base and is not sent back. `previous` is the
/// irradiance of the pass before, `before` the budget it ended with.
pub fn main(
    source: &Map,
    irradiance: &Map,
    previous: &Map,
    albedo: &Map,
    arriving: &Map,
    not_reflected: &Map,
    before: &Budget,
) -> Balance {
    let last_scale = vec3(before.scale);
    let (mut enter, mut leave, mut total, mut change) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
    for i in 0..source.texels.len() {
        let at = |map: &Map| rgb(map.texels[i]);
        enter += at(source);
        leave += (1.0 - at(albedo)) * at(irradiance) + at(not_reflected) * at(arriving);
        total += at(irradiance);
        change = change.max((at(irradiance) - last_scale * at(previous)).abs());
    }
    let mean = total / source.texels.len() as f64;
    Balance {
        scale: DVec3::select(leave.cmple(DVec3::ZERO), DVec3::ONE, enter / leave),
        change: DVec3::select(mean.cmple(DVec3::ZERO), DVec3::ZERO, change / mean),
    }
}
