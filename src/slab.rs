//! Light in a plane-parallel slab of droplets: exact fluxes by adding-doubling, and the analytic low orders closed against them.
//!
//! Conventions of the whole stage: optical depths are along the slab normal; `mu` is the cosine of a zenith angle measured at the slab
//! face, in (0, 1]; the phase function `P` is normalised to `(1/4pi) integral P dOmega = 1`; fluxes are fractions of the incident
//! horizontal irradiance; radiances are per unit sun irradiance on a plane facing the sun (1/sr). Both faces are alike, because the
//! slab is homogeneous.

pub mod analytic;
pub mod angles;
pub(crate) mod appendix;
pub mod closure;
pub mod doubling;
pub mod fluxes;
pub mod forward;
pub mod phase_matrix;
pub mod phases;
pub mod quadrature;
pub mod radiance;
pub mod veil;
