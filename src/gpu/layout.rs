//! Host structs of the shaders: the same names, order and offsets as `shaders/shared/frame.wgsl`. A reflection test
//! (`tests/layout.rs`) compares the two. Meanings are told there.

use bytemuck::{Pod, Zeroable};

/// Grazing rays are computed at this cosine at least: 0.006 degrees above the horizon.
pub const MIN_COSINE: f32 = 1e-4;

/// Squares between texel centres in a block of a thickness map whose bounds are known, a side.
pub const BOUNDS_TEXELS: u32 = 8;

/// One layer at one moment.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
pub struct Frame {
    /// Towards the sun; w: cosine for tables.
    pub sun: [f32; 4],
    /// Irradiance facing the sun; w: cosine of zenith, at least 0.
    pub sun_light: [f32; 4],
    /// Extinction per metre; w: 550 nm.
    pub extinction: [f32; 4],
    /// Part of extinction that takes light out of the 5-degree beam; w: 550 nm.
    pub beam: [f32; 4],
    /// Extinction of the medium without its forward peak, relative; w: 1 - asymmetry, that of transport, at 550 nm.
    pub smooth_part: [f32; 4],
    /// Single-scattering albedo of that medium.
    pub smooth_albedo: [f32; 4],
    /// Where the wind has carried the field.
    pub offset_uv: [f32; 2],
    /// From a ground point to where its sun ray crosses the layer's base.
    pub shift_uv: [f32; 2],
    /// From a point of the base to where its sun ray crosses the base of the layer above.
    pub above_uv: [f32; 2],
    /// Where in a texel of the maps of sunlight thickness is looked at, from its middle, texels; and opposite.
    pub sample_at: [f32; 2],
    /// Side of the domain.
    pub extent_m: f32,
    /// Height of the cloud base.
    pub base_m: f32,
    /// No cloud is thicker.
    pub depth_m: f32,
    /// Cuts of a ray through the layer.
    pub max_steps: u32,
    /// Of the maps of sunlight, a side.
    pub texels: u32,
    /// 1: each column is lit from straight above, as if its neighbours were like it; 2: light at the base is marched, but no
    /// part of the top is in the shadow of another.
    pub columns: u32,
    /// Places on the sun's disc that are looked at.
    pub discs: u32,
    /// Radius of the sun's disc, radians.
    pub sun_radius: f32,
}

/// One output texture, or a band of its rows.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
pub struct View {
    /// Towards the viewer of a parallel view; w: 1 for a perspective view.
    pub towards: [f32; 4],
    /// The viewer of a perspective view.
    pub eye: [f32; 4],
    /// Texels a side.
    pub size: u32,
    /// First row of the band.
    pub first_row: u32,
    /// Rows of the band.
    pub rows: u32,
    /// 1: seen from above.
    pub from_above: u32,
    /// Irradiance: 0 total, 1 direct, 2 diffuse.
    pub part: u32,
    /// 1: light scattered by less than 5 degrees counts as beam.
    pub peak: u32,
    /// Height of the plane that the texels lie in.
    pub plane_m: f32,
    /// 1: nothing lies before the layer.
    pub first: u32,
}

/// A Gaussian blur along one axis of a periodic map.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
pub struct Blur {
    /// (1, 0) or (0, 1).
    pub axis: [i32; 2],
    /// Texels to either side.
    pub radius: i32,
    /// 1 / (2 sigma^2), texels.
    pub sharpness: f32,
}

/// How the maps of sunlight are put together.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
pub struct Share {
    /// Brings the mean of light by entry to that of light along the ray.
    pub entry_scale: [f32; 4],
    /// Brings the mean of reflected light by entry to that along the ray.
    pub reflect_scale: [f32; 4],
    /// Weight of diffuse light by entry.
    pub entry_weight: f32,
    /// Unused.
    pub spare_0: u32,
    /// Unused.
    pub spare_1: u32,
    /// Unused.
    pub spare_2: u32,
}

/// What the texels of a radiance slice are multiplied by, per channel.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
pub struct Remainder {
    /// Scaled optical depth per true one.
    pub depth_scale: [f32; 4],
    /// Albedo of single scattering at the scaled depth.
    pub order1_albedo: [f32; 4],
    /// Diffusion exponent per scaled depth.
    pub decay: [f32; 4],
    /// Depth added by extrapolation at both faces, scaled.
    pub extrapolation: [f32; 4],
    /// Nodes of optical depth.
    pub depths: f32,
    /// Nodes of view zenith.
    pub zeniths: f32,
    /// Nodes of azimuth.
    pub azimuths: f32,
    /// Nodes of optical depth per octave.
    pub depths_per_octave: f32,
}

/// Octaves of a synthetic field that share a texture.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
pub struct Octaves {
    /// Picks one field of many.
    pub seed: u32,
    /// The first of the four.
    pub first: u32,
    /// Of the field.
    pub count: u32,
    /// Texels a side.
    pub width: u32,
}

/// Convective cells of a synthetic field at one moment.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
pub struct Cells {
    /// Picks one field of many.
    pub seed: u32,
    /// 0 closed, 1 open.
    pub kind: u32,
    /// Cells a side of the coarser lattice.
    pub count: u32,
    /// Texels a side.
    pub width: u32,
    /// Weight of that lattice.
    pub coarser: f32,
    /// Weight of the lattice with one cell more.
    pub finer: f32,
    /// Of the slowest of the cells' points.
    pub turns: f32,
    /// Unused.
    pub spare: u32,
}

/// Phases of the eddies' four bands at one moment.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
pub struct Eddies {
    /// Of the bands.
    pub cosines: [f32; 4],
    /// Of the bands.
    pub sines: [f32; 4],
}

/// A step of the displacement.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
pub struct Step {
    /// 0 where a layer is born.
    pub keep: [f32; 4],
    /// Way at the root mean square of speed, domains.
    pub length_uv: f32,
    /// Unused.
    pub spare_0: u32,
    /// Unused.
    pub spare_1: u32,
    /// Unused.
    pub spare_2: u32,
}

/// How a field is put together at one moment.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
pub struct Blend {
    /// Amplitudes of octaves 0 to 3.
    pub low: [f32; 4],
    /// 4 to 7.
    pub middle: [f32; 4],
    /// 8 to 11.
    pub high: [f32; 4],
    /// Amplitude of the cells.
    pub cells: f32,
    /// Weight of the first layer of displacement.
    pub first: f32,
    /// Weight of the second.
    pub second: f32,
    /// Texels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Unused.
    pub spare: u32,
    /// Where the mean wind has carried the field.
    pub offset_uv: [f32; 2],
}

/// Equal bins of a field's values.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
pub struct Histogram {
    /// Where the first begins.
    pub low: f32,
    /// Bins per unit.
    pub per_unit: f32,
    /// Values.
    pub count: u32,
    /// Unused.
    pub spare: u32,
}

/// From a Gaussian field to thickness.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
pub struct Transfer {
    /// Of the logarithm of water path.
    pub spread: f32,
    /// Water path below which there is no cloud.
    pub threshold: f32,
    /// Thickness at a water path of 1 above the threshold.
    pub scale_m: f32,
    /// Thickness that is never reached.
    pub clip_m: f32,
    /// Texels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Unused.
    pub spare_0: u32,
    /// Unused.
    pub spare_1: u32,
}
