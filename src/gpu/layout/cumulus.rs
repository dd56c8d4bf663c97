//! Host structs of a cumulus layer.

use bytemuck::{Pod, Zeroable};

/// A cumulus layer at one moment: where it is, what it is made of, how it is lit.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
pub struct Cumulus {
    /// Unit vector towards it.
    pub sun: [f32; 3],
    /// Side of the domain.
    pub extent_m: f32,
    /// Of the sun, facing it.
    pub irradiance: [f32; 3],
    /// No cloud is below.
    pub base_m: f32,
    /// Per metre.
    pub extinction: [f32; 3],
    /// No cloud is above.
    pub top_m: f32,
    /// Part of extinction without the forward peak.
    pub kept: [f32; 3],
    /// No cloud is below, where its spheres end above the base.
    pub low_m: f32,
    /// Of scattering without the peak.
    pub albedo: [f32; 3],
    /// Lower face of the volume.
    pub floor_m: f32,
    /// Three times that of scattering without the peak.
    pub asymmetry: [f32; 3],
    /// Side of its cubes.
    pub voxel_m: f32,
    /// Part of extinction that takes light out of the 5-degree beam.
    pub beam: [f32; 3],
    /// Depths that it holds.
    pub band_m: f32,
    /// Even radiance from the sky.
    pub above: [f32; 3],
    /// Over which density rises from 0 to 1.
    pub edge_m: f32,
    /// Even radiance from the ground.
    pub below: [f32; 3],
    /// By which noise moves the surface.
    pub relief_m: f32,
    /// Where the wind has carried the layer.
    pub offset_m: [f32; 2],
    /// Side of the noise's tile.
    pub tile_m: f32,
    /// Of the sun's disc, radians.
    pub sun_radius: f32,
    /// Side of the lattice's cubes.
    pub cell_m: f32,
    /// Lower face of the lattice.
    pub lattice_floor_m: f32,
    /// 1 where a veil is as it was published.
    pub published: u32,
    /// How far within the cloud the lattice is read.
    pub inward_m: f32,
}

/// Constants of a shader that takes a cumulus for its surface.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
pub struct CumulusSurface {
    /// Exponent of the glow's cosine, times length on the ray and share of the layer.
    pub glow_m: [f32; 3],
    /// Radius of what stands out of the coarser surface.
    pub blob_m: f32,
    /// Even light, of the sun's over pi.
    pub ambient: f32,
    /// Light by the sun's cosine.
    pub diffuse: f32,
    /// How far noise turns the normal.
    pub bump: f32,
    /// Strength of the glow.
    pub corona: f32,
    /// Depth at which a ray meets the body.
    pub reached_m: f32,
    /// Strength of light in creases.
    pub traps: f32,
    /// Where it is: metres, or the arctangent's coefficient.
    pub trap: f32,
    /// Unused.
    pub spare: u32,
}
