//! skyloom renders sky-lighting textures: cloud colour with alpha, cloud shadow, ground irradiance.
//!
//! ```
//! use skyloom::{Images, Job, Renderer, RendererOptions, Request, Scene, TableLibrary, Watch, encode};
//! use std::sync::Arc;
//!
//! let scene = br#"{ "domain": { "resolution": 32 },
//!     "layers": [{ "thickness": { "kind": "stratocumulus", "coverage": 0.6 },
//!                  "droplets": { "henyey_greenstein": 0.85, "extinction_per_m": 0.03 } }] }"#;
//! let scene = Arc::new(Scene::from_json(scene)?);
//! let query = [("view".to_owned(), "above".to_owned())];
//! let request = Request::parse("cloud", "exr", &query)?;
//!
//! // Tables of a droplet mix are made once, and kept in a store if the library gets one.
//! let library = TableLibrary::new(None);
//! let job = Job::prepare(scene, request, &Images::new(), &library, &|_part| ())?;
//! let mut renderer = Renderer::new(&RendererOptions::default())?;
//! let texture = renderer.render(&job, &Watch::default())?;
//! let file = encode(&texture, &job)?;
//! assert_eq!((texture.width, texture.channels.len(), file.bits), (32, 4, 16));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A sky is a pure function of a scene and a time. Stages, in the order of the data, each with what it takes and gives:
//!
//! | stage | lifetime | gives |
//! |---|---|---|
//! | [`scene`], [`request`], [`image`] | - | validated input, ids |
//! | [`job`], [`plan`], [`method`] | request | what is wanted with all that it takes; methods, sizes and passes for the tolerance |
//! | [`memory`] | request | what it takes of memory, before it is made |
//! | [`optics`] | droplet mix | phase function and its moments, extinction, albedo per colour |
//! | [`slab`] | droplet mix | fluxes of a slab by adding-doubling; closed forms of the first orders of scattering |
//! | [`tables`] | droplet mix | the two above, kept in memory and in a [`store`] |
//! | [`atmosphere`] | air | clear air on a round Earth: its scattered light in every direction, for any sun and eye |
//! | [`cover`] | cloud cover; sun | clouds and ground as what ends the air below, and the mean light within |
//! | [`spectrum`] | - | colours of light that is known at four wavelengths |
//! | [`sun`] | moment | where the sun stands, by place and time |
//! | [`field`] | frame | the thickness map |
//! | [`illumination`] | moment | the sun's direction and beam, and the sky |
//! | [`mod@slice`] | sun | tables as textures; the closure of the orders |
//! | [`exchange`] | moment | light between layers of cloud, and between cloud and ground |
//! | [`light`] | moment | sun, sky and ground light at cloud base and ground |
//! | [`shade`] | request | the texture asked for, in its [`projection`] and [`axes`] |
//! | [`encode`](mod@encode) | request | the bytes of a file |
//!
//! [`render`] runs them; only its pipeline knows this order. [`chart`] measures the methods against exact solutions and draws
//! it. [`mod@reference`] holds a readable f64 twin of every pass that runs on the device.
//!
//! # Units, axes, symbols
//! Metres, seconds; east = +x, north = +y, up = +z; maps have north up: row 0 is the north edge. Light is linear Rec.709.
//! - `cosine`, `mu`: cosine of a zenith angle, measured from straight up (from straight down for faces seen from below).
//! - `depth`, `optical_depth`: vertical optical depth of a slab, tau. `path`: optical depth along a ray, tau / mu.
//! - `extinction`: per metre. `albedo`: of a single scattering, or of the ground. `asymmetry`: mean cosine g.
//! - `phase_function` P: (1/4pi) times its integral over the sphere is 1.
//! - `irradiance`: horizontal unless said otherwise. `radiance`: per steradian.

mod adiabatic;
mod air_map;
pub mod ambient;
pub mod atmosphere;
pub mod axes;
pub mod chart;
pub mod cover;
pub mod cumulus;
mod disc;
pub mod encode;
pub mod exchange;
pub mod field;
mod frame;
pub mod gpu;
mod ground;
pub mod illumination;
pub mod image;
pub mod job;
pub mod light;
pub mod memory;
pub mod method;
mod moment;
pub mod optics;
mod periodic;
pub mod plan;
pub mod projection;
pub mod reference;
pub mod render;
pub mod request;
pub mod scene;
pub mod scene_air;
pub mod shade;
pub mod slab;
pub mod slice;
pub mod spectrum;
pub mod store;
pub mod sun;
mod sun_rays;
pub mod tables;
mod traced;
mod version;

pub use version::VERSION;

pub use job::{Images, Job, RenderError, Texture, Watch};
pub use render::{Renderer, RendererOptions, encode};
pub use request::{Request, RequestError};
pub use scene::{Scene, SceneError};
pub use tables::TableLibrary;
