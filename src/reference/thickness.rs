//! Output: geometric thickness. Twin of `shaders/thickness.wgsl`.

use super::columns::column_thickness;
use super::frame::{image, vec2};
use super::map::Map;
use crate::gpu::layout::{Frame, View};

/// Thickness, metres, of each texel.
pub fn main(frame: &Frame, view: &View, thickness: &Map) -> Vec<f64> {
    image(view, |uv| {
        [column_thickness(frame, thickness.sample_periodic((uv + vec2(frame.place.offset_uv)).to_array()))]
    })
}
