//! Exact light in clouds of uneven thickness, three-dimensional: photons from the sun and the sky through all layers to
//! the ground and back.
//!
//! Each layer fills `base < z < base + h(x, y)` with droplets of one kind, h the bilinear interpolation of its map;
//! there is nothing else in the air. The ground at z = 0 is Lambertian. Everything repeats with the extent of the domain.
//! Photons fly from collision to collision by null-collision tracking (E. Woodcock et al., 1965), which samples that
//! medium without any discretisation, and are counted whole: they are scattered or absorbed, so that what leaves and what
//! is absorbed add up to what came in, to the last photon.
//!
//! Maps hold fractions of the light that falls on a level square above the clouds ([`FieldLight::incident`]), as means
//! over the texels of an even grid, row 0 in the north. Their errors are nothing but noise, which is measured: photons
//! come in [`BATCHES`] independent batches, and standard errors are those between them.
//!
//! [`trace`] does one colour, [`irradiance`] three.

mod air;
mod light;
mod maps;
mod medium;
mod photon;
mod problem;
mod rgb;
mod tally;

pub use light::{BATCHES, FieldLight, MAX_SIDE, trace};
pub use maps::{FluxMap, MapEstimate, NADIR_COSINE};
pub use problem::{FieldProblem, Layer, MAX_LAYERS};
pub use rgb::{Irradiance, RgbLayer, RgbScene, irradiance};
