//! Output: the part of the sun's beam that reaches the ground. Twin of `shaders/shadow.wgsl`.

use super::ground_sun::GroundSun;
use crate::gpu::layout::{Frame, View};

/// The part, 0..1, at 550 nm, of each texel; 0 when the sun is down.
pub fn main(frame: &Frame, view: &View, ground_sun: &[GroundSun]) -> Vec<f64> {
    let part = |sun: &GroundSun| match (frame.sun.cosine > 0.0, view.peak) {
        (false, _) => 0.0,
        (true, 1) => sun.beam.w,
        (true, _) => sun.unscattered.w,
    };
    ground_sun.iter().map(part).collect()
}
