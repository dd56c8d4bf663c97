//! Host structs of the shaders: the same names, order and offsets as `shaders/shared/frame.wgsl`. A reflection test
//! (`tests/layout.rs`) compares the two. Meanings are told there.

mod cumulus;
mod field;

use bytemuck::{Pod, Zeroable};
pub use cumulus::{Cumulus, CumulusSurface};
pub use field::{Blend, Cells, Columns, Eddies, Histogram, Octaves, Step, Streets, Trails, Transfer, Turned};

/// Grazing rays are computed at this cosine at least: 0.006 degrees above the horizon.
pub const MIN_COSINE: f32 = 1e-4;

/// Squares between texel centres in a block of a thickness map whose bounds are known, a side.
pub const BOUNDS_TEXELS: u32 = 8;

/// The sun at one moment.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
pub struct Sun {
    /// Unit vector towards it: east, north, up.
    pub towards: [f32; 3],
    /// Cosine of its zenith, at least [`MIN_COSINE`]: of rays and tables.
    pub slant_cosine: f32,
    /// Irradiance facing it, 0 below the horizon.
    pub irradiance: [f32; 3],
    /// Cosine of its zenith, at least 0: 0 is night.
    pub cosine: f32,
    /// Part of its beam that air among and below the clouds leaves on the ground.
    pub through_air: [f32; 3],
    /// Unused.
    pub spare: u32,
}

/// What a layer is made of: red, green and blue are 650, 550 and 450 nm.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
pub struct Medium {
    /// Per metre.
    pub extinction: [f32; 3],
    /// At 550 nm.
    pub extinction_550: f32,
    /// Part of extinction that takes light out of the 5-degree beam.
    pub beam: [f32; 3],
    /// At 550 nm.
    pub beam_550: f32,
    /// Extinction of the medium without its forward peak, relative.
    pub smooth_part: [f32; 3],
    /// 1 - asymmetry, that of transport, at 550 nm.
    pub transport_550: f32,
    /// Single-scattering albedo of the medium without its forward peak.
    pub smooth_albedo: [f32; 3],
    /// Unused.
    pub spare: u32,
    /// Part of extinction that takes light out of the 25-degree beam.
    pub forward: [f32; 3],
    /// At 550 nm.
    pub forward_550: f32,
}

/// Where a layer lies, and its field in the domain.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
pub struct Placement {
    /// Where the wind has carried the field.
    pub offset_uv: [f32; 2],
    /// From a ground point to where its sun ray crosses the layer's base.
    pub shift_uv: [f32; 2],
    /// From a point of the base to where its sun ray crosses the base of the layer above.
    pub above_uv: [f32; 2],
    /// Side of the domain.
    pub extent_m: f32,
    /// Height of the cloud base.
    pub base_m: f32,
    /// No cloud is thicker.
    pub depth_m: f32,
    /// Cuts of a ray through the layer.
    pub max_steps: u32,
    /// 1: below the layer there is the ground, 0: another layer.
    pub lowest: u32,
    /// 1: columns have bases, tops and extinctions of their own.
    pub ragged: u32,
}

/// A layer's maps of sunlight.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
pub struct SunMaps {
    /// Where in a texel of theirs thickness is looked at, from its middle, texels; and opposite.
    pub sample_at: [f32; 2],
    /// Texels a side.
    pub texels: u32,
    /// 1: each column is lit from straight above, as if its neighbours were like it; 2: light at the base is marched, but no
    /// part of the top is in the shadow of another; 0: neither.
    pub columns: u32,
}

/// One layer at one moment.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
pub struct Frame {
    /// The sun.
    pub sun: Sun,
    /// What the layer is made of.
    pub medium: Medium,
    /// Where it lies.
    pub place: Placement,
    /// Its maps of sunlight.
    pub maps: SunMaps,
}

/// A place on the sun's disc.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
pub struct DiscPlace {
    /// From a point of the ground to where its ray crosses the layer's base, turned to its direction.
    pub shift_uv: [f32; 2],
    /// Of its zenith.
    pub cosine: f32,
    /// Which of the directions its rays have within the layer.
    pub direction: u32,
}

/// Rays towards the sun's disc that are side by side within a layer.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
pub struct DiscWay {
    /// Unit vector.
    pub towards: [f32; 3],
    /// Rows that they go across for each line: this and the following are theirs where they are swept.
    pub across: f32,
    /// Starts of rays that they go along for each metre of height.
    pub per_metre: f32,
    /// 1: along is the second axis of the map, southwards.
    pub flipped: u32,
    /// 1: they go towards smaller texels.
    pub backwards: u32,
    /// Unused.
    pub spare: u32,
}

/// Places on the sun's disc that are looked at together.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
pub struct Disc {
    /// Rows of rays that are swept over a layer for each of its map's texels across; 0: each ray is followed by itself.
    pub fine: u32,
    /// Directions of rays.
    pub directions: u32,
    /// Places.
    pub count: u32,
    /// Of all that are looked at, so many come before these.
    pub first: u32,
    /// How many are looked at in all.
    pub total: u32,
    /// Lines for each texel along, at which a row looks at columns.
    pub lines: u32,
    /// Rays that start from each line on to the next.
    pub between: u32,
    /// What is kept of a row.
    pub row_numbers: u32,
    /// The directions.
    pub ways: [DiscWay; 32],
    /// The places.
    pub places: [DiscPlace; 32],
}

impl Disc {
    /// Places that are looked at, at most.
    pub const MOST: u32 = 32;
    /// Rows of swept rays whose numbers are side by side in memory: a line of a cache.
    pub const STRIP: u32 = 16;
}

/// One output texture, or a band of its rows.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
pub struct View {
    /// Towards the viewer of a parallel view.
    pub towards: [f32; 3],
    /// 1: the view of a viewer at `eye`.
    pub perspective: u32,
    /// The viewer of a perspective view.
    pub eye: [f32; 3],
    /// Height of the plane that the texels lie in.
    pub plane_m: f32,
    /// Texels across and down.
    pub size: [u32; 2],
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
    /// 1: nothing lies before the layer.
    pub first: u32,
    /// Irradiance: even light that falls on the ground beside that of the layers' exchange.
    pub added: [f32; 3],
    /// 1: several layers are drawn, and carry each other's light on; 0: one by itself.
    pub together: u32,
    /// Where the one texel lies that is shaded by itself, domains from the north-western corner.
    pub point: [f32; 2],
    /// 1: there is a `point`.
    pub pointed: u32,
    /// Unused.
    pub spare: u32,
}

/// One output texture of the whole sky, or a band of its rows.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
pub struct SkyView {
    /// Of a cube's faces, or to the right of a picture: east, north, up.
    pub axis_x: [f32; 3],
    /// How directions become texels: 0 equirect, 1 octahedral, 2 cube, 3 fisheye, 4 camera.
    pub kind: u32,
    /// Towards the picture's top.
    pub axis_y: [f32; 3],
    /// Rows of the band.
    pub rows: u32,
    /// Into the picture.
    pub axis_z: [f32; 3],
    /// First row of the band.
    pub first_row: u32,
    /// Place of the eye, metres.
    pub eye: [f32; 3],
    /// 1: a layer is drawn along the part of each ray that rises, 0: that sinks.
    pub rising: u32,
    /// Texels across and down.
    pub size: [u32; 2],
    /// Azimuth of the left edge, turns from north over east.
    pub first_turn: f32,
    /// Turns from the left edge to the right one, or from the middle to the edge.
    pub turns: f32,
    /// Half the width of the picture, one unit away.
    pub half_width: f32,
    /// Half its height.
    pub half_height: f32,
    /// Samples of the thickness map for each of its texels that a ray crosses.
    pub steps: f32,
    /// Rays of a texel, at most.
    pub rays: u32,
    /// Texels of a map along the ground for each of them.
    pub texels_per_ray: f32,
    /// Mip levels beyond that whose texels are as wide as the picture's.
    pub coarseness: f32,
    /// Sine of the elevation at which the layer begins or ends for the eye.
    pub edge: f32,
    /// Elevation at which the map of the air before the layer begins, radians.
    pub horizon: f32,
    /// As in [`View`].
    pub together: u32,
    /// How far each wave of the drift carries what is seen far off, as a part of its length; 0: nothing drifts.
    pub drift: f32,
    /// Unused.
    pub spare_1: u32,
    /// Unused.
    pub spare_2: u32,
}

/// What lies behind the clouds.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
pub struct Backdrop {
    /// Unit vector towards the sun.
    pub sun: [f32; 3],
    /// Elevation at which the ground ends, radians.
    pub horizon: f32,
    /// Side of the domain.
    pub extent_m: f32,
    /// Unused.
    pub spare: u32,
    /// Unused.
    pub spare_2: [u32; 2],
}

/// Steps of the aerosol's phase function from the sun to the opposite: its peak is a hundredth of a degree wide in them or more.
pub const AEROSOL_ROWS: usize = 256;

/// How aerosol scatters, and what colours are made of.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct AirColours {
    /// Logarithm of the phase function at the four wavelengths, over 4 pi, at angles from the sun that grow as the square.
    pub phase: [[f32; 4]; AEROSOL_ROWS],
    /// Rows of the matrix from these to colours.
    pub matrix: [[f32; 4]; 3],
}

impl Default for AirColours {
    fn default() -> Self {
        Self::zeroed()
    }
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
    pub entry_scale: [f32; 3],
    /// Weight of diffuse light by entry.
    pub entry_weight: f32,
    /// Brings the mean of reflected light by entry to that along the ray.
    pub reflect_scale: [f32; 3],
    /// Unused.
    pub spare: u32,
    /// What air within the layer makes of light that comes through it.
    pub in_air: [f32; 3],
    /// Unused.
    pub spare_2: u32,
}

/// How the light of a layer's lattice is read.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
pub struct LatticeLight {
    /// Part of extinction that takes light out of what the lattice counts as not scattered.
    pub kept: [f32; 3],
    /// Optical depth at 550 nm of the last of its factors, and of its slabs.
    pub reach: f32,
    /// Single-scattering albedo of what it counts as scattered.
    pub albedo: [f32; 3],
    /// Side of its cubes, metres.
    pub cell_m: f32,
    /// Three times the asymmetry of what it counts as scattered.
    pub asymmetry: [f32; 3],
    /// Between two heights of the depths towards the sun, metres.
    pub sun_step_m: f32,
    /// Extinction of its slabs, relative to the layer's.
    pub density: f32,
    /// 1: all colours are alike.
    pub grey: u32,
    /// Unused.
    pub spare_0: u32,
    /// Unused.
    pub spare_1: u32,
    /// What air within the layer leaves of light that comes through it.
    pub in_air: [f32; 3],
    /// Unused.
    pub spare_2: u32,
}

/// What the texels of a radiance slice are multiplied by, per channel.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
pub struct Remainder {
    /// Scaled optical depth per true one.
    pub depth_scale: [f32; 3],
    /// Nodes of optical depth.
    pub depths: f32,
    /// Albedo of single scattering at the scaled depth.
    pub order1_albedo: [f32; 3],
    /// Nodes of view zenith.
    pub zeniths: f32,
    /// Diffusion exponent per scaled depth.
    pub decay: [f32; 3],
    /// Nodes of azimuth.
    pub azimuths: f32,
    /// Depth added by extrapolation at both faces, scaled.
    pub extrapolation: [f32; 3],
    /// Nodes of optical depth per octave.
    pub depths_per_octave: f32,
}
