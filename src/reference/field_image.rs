//! An image's field at a moment. Twin of `shaders/field_image.wgsl`.

use super::field_blend::displaced;
use super::map::Map;
use crate::gpu::layout::Blend;

/// Thickness before it is brought back to the image's distribution, metres, in the first channel.
pub fn main(blend: &Blend, displacement: &Map, image: &Map) -> Map {
    displaced(blend, displacement, |uv| image.sample_periodic(uv)[0])
}
