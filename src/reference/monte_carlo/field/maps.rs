//! Maps of what is counted.

/// [`FluxMap::ColumnNadir`] counts light that leaves with a larger cosine than this.
pub const NADIR_COSINE: f64 = 0.85;

/// What is counted in a texel. Light is direct if it comes from the sun and was neither scattered nor reflected, by air or
/// anything else; all other light is diffuse, that of the sky included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FluxMap {
    /// Down through the plane of the lowest base, direct.
    BaseDirect,
    /// Down through the plane of the lowest base, diffuse.
    BaseDiffuse,
    /// Up through the plane of the lowest base.
    BaseUp,
    /// On the ground, direct.
    GroundDirect,
    /// On the ground, diffuse.
    GroundDiffuse,
    /// Up through the plane of the highest top, where it crosses it. Without air it never comes back.
    Up,
    /// The part of [`Self::Up`] that comes straight from a cloud, in the texel of its last scattering.
    Column,
    /// The part of [`Self::Column`] that leaves with a cosine above [`NADIR_COSINE`]. A flux, not a radiance.
    ColumnNadir,
    /// Down through the plane of the highest top, direct: all sunlight that enters from above where there is no air.
    TopDirect,
    /// Down through the plane of the highest top, diffuse.
    TopDiffuse,
    /// Down through the plane of the lowest base, all.
    BaseDown,
    /// On the ground, all.
    Ground,
}

/// Maps that photons count in; [`FluxMap::BaseDown`] and [`FluxMap::Ground`] are sums of two of them.
pub(super) const COUNTED: usize = FluxMap::TopDiffuse as usize + 1;
/// All maps.
pub(super) const MAPS: usize = FluxMap::Ground as usize + 1;

/// A map of fluxes as fractions of [`FieldLight::incident`](super::light::FieldLight::incident), by rows.
#[derive(Clone, Debug, PartialEq)]
pub struct MapEstimate {
    /// Means over texels.
    pub values: Vec<f64>,
    /// Their standard errors, nearly independent between texels. 0 where no photon came, which does not mean that none
    /// could; infinite where a time limit left one batch.
    pub standard_errors: Vec<f64>,
}
