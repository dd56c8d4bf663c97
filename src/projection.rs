//! How places and directions become texels.
//!
//! A texture is not always a square, and a texel's ray is not always one of a plane: this says how many texels there are and
//! which ray each of them has. `shaders/shared/projection.wgsl` follows the rays on the device, and
//! [`crate::reference::projection`] is its twin.

use crate::scene::direction;

/// How the texels of a view of the clouds are laid out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Projection {
    /// Texels lie on a horizontal plane over the domain.
    Plane(Plane),
}

/// A view of the tile: each texel is the point where the view ray meets the plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// Which plane, and from which side it is seen.
    pub side: Side,
    /// Where the viewer is.
    pub viewer: Viewer,
}

/// The side from which clouds are seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// From the ground: texels lie on the plane of the lowest base.
    Below,
    /// From the air: texels lie on the plane of the highest top.
    Above,
}

impl Side {
    /// Every side and its name.
    pub const ALL: [(&'static str, Self); 2] = [("below", Self::Below), ("above", Self::Above)];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Below => "below",
            Self::Above => "above",
        }
    }
}

/// Where the viewer is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Viewer {
    /// Far away: the same direction for every texel.
    Parallel {
        /// Towards the viewer, from straight up; from straight down for clouds seen from below. 0 to 89.9 degrees.
        zenith_deg: f64,
        /// Towards the viewer, clockwise from north, degrees.
        azimuth_deg: f64,
    },
    /// At a point, metres (east, north, up).
    At([f64; 3]),
}

impl Viewer {
    /// Straight below or above.
    pub const UPRIGHT: Self = Self::Parallel { zenith_deg: 0.0, azimuth_deg: 0.0 };
}

impl Plane {
    /// The clouds seen from straight below.
    pub const BELOW: Self = Self { side: Side::Below, viewer: Viewer::UPRIGHT };

    /// Unit vector (east, north, up) towards the viewer of a parallel view.
    pub fn towards(&self) -> Option<[f64; 3]> {
        let Viewer::Parallel { zenith_deg, azimuth_deg } = self.viewer else { return None };
        let [east, north, up] = direction(zenith_deg, azimuth_deg);
        Some([east, north, if self.side == Side::Below { -up } else { up }])
    }
}

impl Projection {
    /// Its name.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Plane(_) => "plane",
        }
    }

    /// Texels across and down of a texture of a given size.
    pub fn size(&self, size: u32) -> [u32; 2] {
        match self {
            Self::Plane(_) => [size; 2],
        }
    }

    /// Whether the texture repeats beyond its edges, as the domain does.
    pub fn is_periodic(&self) -> bool {
        match self {
            Self::Plane(plane) => matches!(plane.viewer, Viewer::Parallel { .. }),
        }
    }

    /// The plane that is seen, and from where.
    pub fn plane(&self) -> &Plane {
        match self {
            Self::Plane(plane) => plane,
        }
    }
}
