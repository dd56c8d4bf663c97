//! The ray of a texel. Twin of `shaders/shared/projection.wgsl`.

use super::frame::vec3;
use crate::gpu::layout::View;
use glam::{DVec2, DVec3, dvec2};

/// A ray that ends at the viewer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// A point of it: east, north, up, metres.
    pub position: DVec3,
    /// Towards the viewer.
    pub seen: DVec3,
}

/// The ray of the texel at `place` (0 to 1 from the north-west corner) of a view of a domain.
pub fn ray(view: &View, extent_m: f64, place: DVec2) -> Ray {
    let position = (dvec2(place.x - 0.5, 0.5 - place.y) * extent_m).extend(view.plane_m.into());
    let seen = if view.perspective == 1 { (vec3(view.eye) - position).normalize() } else { vec3(view.towards) };
    Ray { position, seen }
}
