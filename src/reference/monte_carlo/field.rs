//! Exact light in clouds of uneven thickness, three-dimensional: photons from the sun and the sky through all layers to
//! the ground and back, with or without air around and inside the clouds.
//!
//! Each layer fills `base < z < base + h(x, y)` with droplets of one kind, h the bilinear interpolation of its map.
//! Air has molecules, particles and ozone by height, the same everywhere: it is level, so that what it errs for being so
//! grows towards low suns. The ground at z = 0 is Lambertian. Everything repeats with the extent of the domain.
//! Photons fly from collision to collision by null-collision tracking (E. Woodcock et al., 1965), which samples that
//! medium without any discretisation, and are counted whole: they are scattered or absorbed, so that what leaves and what
//! is absorbed add up to what came in, to the last photon. In air above the highest top a photon of below is eight, so
//! that light scattered there has less noise; light adds up in the mean then.
//!
//! Maps hold fractions of the light that falls on a level square above clouds and air ([`FieldLight::incident`]), as means
//! over the texels of an even grid, row 0 in the north. Their errors are nothing but noise, which is measured: photons
//! come in [`BATCHES`] independent batches, and standard errors are those between them.
//!
//! [`trace`] does one colour, [`irradiance`] three, [`waves`] the four wavelengths of sunlight in air.

mod air;
mod light;
mod maps;
mod medium;
mod photon;
mod problem;
mod rgb;
mod tally;
mod waves;

pub use light::{BATCHES, FieldLight, MAX_SIDE, trace};
pub use maps::{FluxMap, MapEstimate, NADIR_COSINE};
pub use problem::{FieldProblem, Layer, MAX_LAYERS};
pub use rgb::{Irradiance, RgbLayer, RgbScene, irradiance};
pub use waves::{AirScene, colour, waves};
