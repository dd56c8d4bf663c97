//! skyloom renders sky-lighting textures: cloud colour with alpha, cloud shadow, ground irradiance.
//!
//! A sky is a pure function of a scene and a time. Stages, in the order of the data, each with what it takes and gives:
//!
//! | stage | lifetime | gives |
//! |---|---|---|
//! | [`scene`], [`request`], [`image`] | - | validated input, ids |
//! | [`plan`] | request | methods, sizes and passes for the tolerance |
//! | [`optics`] | droplet mix | phase function and its moments, extinction, albedo per colour |
//! | [`slab`] | droplet mix | fluxes of a slab by adding-doubling; closed forms of the first orders of scattering |
//! | [`tables`] | droplet mix | the two above, kept in memory and on disk |
//! | [`field`] | scene | the thickness map |
//! | [`mod@slice`] | sun | tables as textures; the closure of the orders |
//! | [`exchange`] | moment | light between layers of cloud, and between cloud and ground |
//! | `light` | moment | sun, sky and ground light at cloud base and ground |
//! | [`shade`] | request | the texture asked for |
//! | [`encode`] | request | the bytes of a file |
//!
//! [`chart`] measures the methods against exact solutions and draws it.
//! [`render`] alone knows this order. [`mod@reference`] holds a readable f64 twin of every pass that runs on the device.
//!
//! # Units, axes, symbols
//! Metres, seconds; east = +x, north = +y, up = +z; maps have north up: row 0 is the north edge. Light is linear Rec.709.
//! - `cosine`, `mu`: cosine of a zenith angle, measured from straight up (from straight down for faces seen from below).
//! - `depth`, `optical_depth`: vertical optical depth of a slab, tau. `path`: optical depth along a ray, tau / mu.
//! - `extinction`: per metre. `albedo`: of a single scattering, or of the ground. `asymmetry`: mean cosine g.
//! - `phase_function` P: (1/4pi) times its integral over the sphere is 1.
//! - `irradiance`: horizontal unless said otherwise. `radiance`: per steradian.

pub mod chart;
pub mod encode;
pub mod exchange;
pub mod field;
pub mod gpu;
pub mod image;
pub mod light;
pub mod optics;
pub mod plan;
pub mod reference;
pub mod render;
pub mod request;
pub mod scene;
pub mod shade;
pub mod slab;
pub mod slice;
pub mod tables;

use std::sync::LazyLock;

/// Version of the renderer: two versions may give different textures for the same request. The crate's version and a
/// hash of all shaders.
pub static VERSION: LazyLock<String> = LazyLock::new(|| {
    let sources: String = gpu::shaders::ALL.iter().map(|shader| shader.source(true)).collect();
    format!("{}+{}", env!("CARGO_PKG_VERSION"), &image::sha256_hex(sources.as_bytes())[..12])
});
