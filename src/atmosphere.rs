//! Clear air: the light of the sky from the ground, from within and from above the air, by day and in twilight.
//!
//! Takes a [`Medium`] (the air at one wavelength) and a [`Boundary`] below it ([`Air`]), gives a table of angular
//! moments of the diffuse light ([`Moments`], once per air), from which the sky of any sun and eye follows: two
//! textures ([`SunSky`]), single views ([`march()`]) and fluxes ([`diffuse_fluxes`]). Radiance is per unit
//! solar irradiance on a plane facing the sun above the air (1/sr), irradiance per the same unit. The planet is a
//! sphere, the sun a point without refraction. All directions point to where light comes from, so that looking at the
//! sun is a cosine of 1. Heights are metres above sea level.

pub mod air;
pub mod axes;
pub mod contraction;
pub mod depth;
pub mod directions;
pub mod exponential;
pub mod field;
pub mod fluxes;
pub mod gather;
pub mod geometry;
pub mod harmonics;
pub mod isotropic;
pub mod march;
pub mod methods;
pub mod moments;
pub mod path;
pub mod peak;
pub mod profile;
pub mod quality;
pub mod row;
pub mod second_order;
pub mod solve;
pub mod sun;
pub mod under;
pub mod wavelength;

pub use air::{Air, BeamAlbedo, Boundary};
pub use depth::{DepthTable, SlantColumns};
pub use fluxes::{COSINES, Fluxes, azimuth_means, cosine_rule, diffuse_fluxes};
pub use march::{Seen, View, march};
pub use methods::{Method, SkyModel};
pub use moments::Moments;
pub use profile::{Aerosol, Coefficients, Depths, Medium, Phase};
pub use quality::{Quality, Resolution};
pub use sun::{Band, End, Layout, SunSky};
pub use under::{Shade, Sky, Under};
