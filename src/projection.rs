//! How places and directions become texels.
//!
//! A texture is not always a square, and a texel's ray is not always one of a plane: this says how many texels there are and
//! which ray each of them has. `shaders/shared/projection.wgsl` follows the rays on the device, and
//! [`crate::reference::projection`] is its twin.

use crate::axes::Axes;
use crate::scene::direction;
use std::f64::consts::{PI, TAU};

/// Texels across a picture, at most.
const MAX_ACROSS: u32 = 8192;

/// How the texels of a view are laid out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Projection {
    /// Texels lie on a horizontal plane over the domain.
    Plane(Plane),
    /// Texels are directions from an eye.
    Sphere(Sphere),
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

/// A view of the whole sky, or a part of it, from an eye.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sphere {
    /// How directions become texels.
    pub layout: SphereLayout,
    /// The frame that an equirectangular picture and a cube are laid out in; the others know up and north alone.
    pub axes: Axes,
    /// Place of the eye, metres (east, north, up).
    pub eye: [f64; 3],
}

/// How directions become texels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SphereLayout {
    /// Columns are azimuths, rows elevations from straight up to straight down: twice as wide as high. In `enu` axes the left
    /// edge is north, and east lies at a quarter.
    Equirect,
    /// A square: the middle is up, the corners are down; to the right is east, to the top north.
    Octahedral,
    /// Six squares one below the other: +x, -x, +y, -y, +z, -z of the axes by the Khronos table; in `enu` axes east, west,
    /// north, south, up, down.
    Cube,
    /// A disc: equal angles from the middle, which is up; to the right is east, to the top north.
    Fisheye {
        /// Across the disc, degrees: 180 ends at the horizon, 360 is the whole sphere.
        fov_deg: f64,
    },
    /// A picture.
    Camera {
        /// Azimuth and elevation of its middle, degrees.
        look_deg: [f64; 2],
        /// From its lower edge to its upper one, degrees.
        fov_deg: f64,
        /// Width over height.
        aspect: f64,
    },
}

impl SphereLayout {
    /// Names of the layouts.
    pub const NAMES: [&'static str; 5] = ["equirect", "octahedral", "cube", "fisheye", "camera"];

    /// Its place among [`Self::NAMES`], by which the shaders know it.
    pub fn number(&self) -> usize {
        match self {
            Self::Equirect => 0,
            Self::Octahedral => 1,
            Self::Cube => 2,
            Self::Fisheye { .. } => 3,
            Self::Camera { .. } => 4,
        }
    }

    /// Its name.
    pub fn name(&self) -> &'static str {
        Self::NAMES[self.number()]
    }
}

impl Sphere {
    /// The first of all axes in which the picture is the same.
    pub fn plainest_axes(&self) -> Axes {
        let same = |axes: &Axes| match self.layout {
            SphereLayout::Equirect => axes.left_turn() == self.axes.left_turn(),
            SphereLayout::Cube => axes.cube() == self.axes.cube(),
            SphereLayout::Octahedral | SphereLayout::Fisheye { .. } | SphereLayout::Camera { .. } => true,
        };
        Axes::ALL.into_iter().find(same).unwrap_or(self.axes)
    }

    /// What is seen at the middle of each texel of a picture, row by row.
    pub(crate) fn directions(&self, [across, down]: [u32; 2]) -> Vec<Option<[f64; 3]>> {
        let middle = |x: u32, y: u32| [f64::from(x) + 0.5, f64::from(y) + 0.5];
        let texels = (0..down).flat_map(|y| (0..across).map(move |x| middle(x, y)));
        texels.map(|middle| self.direction(middle, [across, down])).collect()
    }

    /// Unit vector (east, north, up) seen at a place of a picture of so many texels, the place counted in texels from the upper
    /// left corner; `None` where the picture shows nothing.
    pub fn direction(&self, [x, y]: [f64; 2], [across, down]: [u32; 2]) -> Option<[f64; 3]> {
        let place = [x / f64::from(across), y / f64::from(down)];
        let (right, top) = (2.0 * place[0] - 1.0, 1.0 - 2.0 * place[1]);
        let vector = match self.layout {
            SphereLayout::Equirect => {
                let turn = self.axes.left_turn() + place[0];
                let ((east, north), (up, level)) = ((TAU * turn).sin_cos(), (0.5 * PI * top).sin_cos());
                [level * east, level * north, up]
            }
            SphereLayout::Octahedral => {
                let up = 1.0 - right.abs() - top.abs();
                let folded = |value: f64| value - (-up).max(0.0).copysign(value);
                [folded(right), folded(top), up]
            }
            SphereLayout::Cube => {
                let face = (6.0 * place[1]).floor().clamp(0.0, 5.0);
                let down = 2.0 * (6.0 * place[1] - face) - 1.0;
                let along = match face as u32 {
                    0 => [1.0, -down, -right],
                    1 => [-1.0, -down, right],
                    2 => [right, 1.0, down],
                    3 => [right, -1.0, -down],
                    4 => [right, -down, 1.0],
                    _ => [-right, -down, -1.0],
                };
                let axes = self.axes.cube();
                std::array::from_fn(|i| (0..3).map(|axis| along[axis] * axes[axis][i]).sum())
            }
            SphereLayout::Fisheye { fov_deg } => {
                let out = right.hypot(top);
                if out > 1.0 {
                    return None;
                }
                let (level, up) = (0.5 * fov_deg.to_radians() * out).sin_cos();
                let scale = if out > 0.0 { level / out } else { 0.0 };
                [right * scale, top * scale, up]
            }
            SphereLayout::Camera { look_deg, fov_deg, aspect } => {
                let [x, y, z] = camera_axes(look_deg);
                let half = (0.5 * fov_deg).to_radians().tan();
                std::array::from_fn(|i| z[i] + half * (aspect * right * x[i] + top * y[i]))
            }
        };
        let length = vector.iter().map(|part| part * part).sum::<f64>().sqrt();
        Some(vector.map(|part| part / length))
    }
}

/// Axes of a camera that looks at an azimuth and an elevation: to the right, to the top, and where it looks (east, north, up).
pub(crate) fn camera_axes([azimuth_deg, elevation_deg]: [f64; 2]) -> [[f64; 3]; 3] {
    let (east, north) = azimuth_deg.to_radians().sin_cos();
    let (up, level) = elevation_deg.to_radians().sin_cos();
    [[north, -east, 0.0], [-up * east, -up * north, level], [level * east, level * north, up]]
}

impl Projection {
    /// Its name.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Plane(_) => "plane",
            Self::Sphere(sphere) => sphere.layout.name(),
        }
    }

    /// Texels across and down of a texture of a given size.
    pub fn size(&self, size: u32) -> [u32; 2] {
        match self {
            Self::Plane(_) => [size; 2],
            Self::Sphere(sphere) => match sphere.layout {
                SphereLayout::Equirect => [2 * size, size],
                SphereLayout::Octahedral | SphereLayout::Fisheye { .. } => [size; 2],
                SphereLayout::Cube => [size, 6 * size],
                SphereLayout::Camera { aspect, .. } => {
                    [((f64::from(size) * aspect).round() as u32).clamp(1, MAX_ACROSS), size]
                }
            },
        }
    }

    /// Whether the texture repeats beyond its edges, as the domain does.
    pub fn is_periodic(&self) -> bool {
        match self {
            Self::Plane(plane) => matches!(plane.viewer, Viewer::Parallel { .. }),
            Self::Sphere(_) => false,
        }
    }

    /// The plane that is seen, and from where.
    pub fn plane(&self) -> Option<&Plane> {
        match self {
            Self::Plane(plane) => Some(plane),
            Self::Sphere(_) => None,
        }
    }

    /// The sphere that is seen.
    pub fn sphere(&self) -> Option<&Sphere> {
        match self {
            Self::Sphere(sphere) => Some(sphere),
            Self::Plane(_) => None,
        }
    }
}
