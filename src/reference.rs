//! Readable twins, in double precision, of the shaders: one file per WGSL file, the same names, so that the two can be
//! read side by side. `tests/twins.rs` gives each twin what the device had and compares what comes out.
//!
//! A twin's `main` is what the shader's `main` writes, for the whole image. Bindings become arguments: host structs as
//! they are, textures as [`Map`]s, a texture with mip levels as a slice of them. Where a shader guards against rounding,
//! the twin computes the plain formula; where it guards against what the host must not send, the twin asserts. Series
//! that the shaders need near 0 are `exp_m1` here: of the two, the twin is the accurate one.
//!
//! [`monte_carlo`] is no twin but the slow, exact solver that every method is measured against.

pub mod air;
pub mod base_beam;
pub mod base_column;
pub mod base_light;
pub mod blur;
pub mod cloud;
pub mod cloud_analytic;
pub mod cloud_forward;
pub mod cloud_lattice;
pub mod cloud_plane;
pub mod cloud_sky;
pub mod cloud_tabulated;
pub mod columns;
pub mod cumulus;
pub mod cumulus_forward;
pub mod cumulus_octaves;
pub mod cumulus_surface;
pub mod downsample;
pub mod field_blend;
pub mod field_bounds;
pub mod field_cells;
pub mod field_columns;
pub mod field_displace;
pub mod field_heads;
pub mod field_histogram;
pub mod field_image;
pub mod field_level;
pub mod field_octaves;
pub mod field_remap;
pub mod field_streets;
pub mod field_thickness;
pub mod field_trails;
pub mod field_turned;
pub mod field_velocity;
pub mod frame;
pub mod ground_sun;
pub mod irradiance;
pub mod lattice_light;
pub mod map;
pub mod march;
pub mod monte_carlo;
pub mod noise;
pub mod path;
pub mod path_across;
pub mod path_columns;
pub mod path_sampled;
pub mod path_seen;
pub mod projection;
pub mod shadow;
pub mod sky;
pub mod sky_ground;
pub mod slab;
pub mod sphere;
pub mod sun;
pub mod sun_entry;
pub mod sun_share;
pub mod sun_sweep;
pub mod thickness;

pub use map::Map;
