//! Output: the part of the sun's beam that reaches the ground. Twin of `shaders/shadow.wgsl`.

use crate::gpu::layout::Frame;
use glam::DVec4;

/// The part, 0..1, at 550 nm, of each texel; 0 when the sun is down. `beam`: what is left of it there.
pub fn main(frame: &Frame, beam: &[DVec4]) -> Vec<f64> {
    let day = frame.sun.cosine > 0.0;
    beam.iter().map(|beam| if day { beam.w } else { 0.0 }).collect()
}
