//! What a cumulus layer is at a moment.

use glam::DVec3;

/// A ball of cloud.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sphere {
    /// Its centre, metres above the ground's middle.
    pub centre: DVec3,
    /// Its radius, metres.
    pub radius_m: f64,
}

/// Cloud made of spheres at one moment: the one description that pictures, light, shadows and Monte Carlo read.
///
/// Its density at `p`, relative to that of the droplets, is
///
/// `clamp01((max_i(R_i - |p - c_i|) + relief_m n(p)) / edge_m) clamp01((p.z - base_m) / edge_m)`
///
/// with the noise `n` of [`super::Relief`], -1 to 1; with an edge of 0 it is 1 inside and 0 outside. It repeats over the domain.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// The spheres; their centres may lie anywhere, for the domain repeats.
    pub spheres: Vec<Sphere>,
    /// No cloud is below this height, metres.
    pub base_m: f64,
    /// Over what depth the density rises from 0 to 1, metres.
    pub edge_m: f64,
    /// How far the noise moves the surface, metres, at most.
    pub relief_m: f64,
    /// Side of the domain, metres.
    pub extent_m: f64,
}
