//! What the passes of a layer's field read.

use bytemuck::{Pod, Zeroable};

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

/// Plane waves of cloud streets.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
pub struct Streets {
    /// Texels a side.
    pub width: u32,
    /// Waves.
    pub count: u32,
    /// Unused.
    pub spare_0: u32,
    /// Unused.
    pub spare_1: u32,
    /// Of each: whole cycles a tile eastwards and southwards, phase in turns, amplitude.
    pub waves: [[f32; 4]; 32],
}

/// Cirrus: ice that fell from generating cells.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
pub struct Trails {
    /// Amplitudes of octaves 0 to 3 in the logarithm of ice where it forms.
    pub low: [f32; 4],
    /// 4 to 7.
    pub middle: [f32; 4],
    /// 8 to 11.
    pub high: [f32; 4],
    /// From a trail's end to the head that it came from, straight on, domains.
    pub along_uv: [f32; 2],
    /// And aside.
    pub bend_uv: [f32; 2],
    /// Way aside by a noise of 1, domains.
    pub aside_uv: [f32; 2],
    /// Mean logarithm of a column's ice.
    pub centre: f32,
    /// Over its standard deviation.
    pub per_unit: f32,
    /// Texels a side.
    pub width: u32,
    /// Samples of a trail.
    pub steps: u32,
    /// Samples of a step.
    pub parts: u32,
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

/// Octaves of noise on turned lattices.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
pub struct Turned {
    /// Picks the noise.
    pub seed: u32,
    /// First of the four octaves.
    pub first: u32,
    /// Octaves in all.
    pub count: u32,
    /// Texels in a row and a column.
    pub width: u32,
    /// Of each of the four: lattice steps along and across a row of two lattices, no common divisor.
    pub turns: [[i32; 4]; 4],
}

/// From the optical depths of a field to columns.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
pub struct Columns {
    /// Value at which the first bin begins.
    pub low: f32,
    /// Bins per unit of value.
    pub per_unit: f32,
    /// Thickness at a path of 1 m, without the clip.
    pub scale_m: f32,
    /// Thickness that is never reached.
    pub clip_m: f32,
    /// Height of the thinnest columns' bases above the base plane; none where they hang.
    pub lift_m: f32,
    /// Thickness over which bases come down by a factor of e.
    pub over_m: f32,
    /// Height of the flat top that columns hang from above the base plane; 0 where they stand.
    pub hang_m: f32,
    /// 1 where extinction grows with height, as in adiabatic cloud; else 0.
    pub grows: u32,
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
