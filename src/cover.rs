//! A cloud cover in the air: what it makes of the air above it, and the light on, in and below it in the mean over its area.
//!
//! Cloud layers, the air between, within and below them and the ground together end the air above as one matt
//! [`Boundary`](crate::atmosphere::Boundary), over which [`Moments`](crate::atmosphere::Moments) are solved. Their sky, by
//! cosine, and the sun then light the cover ([`Cover::light`]).
//!
//! One wavelength at a time, plane-parallel, azimuth mode 0. Irradiances are on level surfaces, per unit solar irradiance on a
//! plane facing the sun above the air; heights are metres above sea level. Layers overlap at random, and the light between
//! them is mixed: it forgets below which column it left. So each layer acts by its mean reflection and transmission.

pub mod air;
pub mod contents;
pub mod grid;
pub mod layer;
pub mod level;
pub mod light;
pub mod slab;
pub mod solve;
pub mod stack;

pub use air::AirSlab;
pub use layer::{CloudLayer, Column};
pub use level::Level;
pub use light::CoverLight;
pub use solve::Cover;
