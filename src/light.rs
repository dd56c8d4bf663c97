//! Stage `light`: what sun and sky give to each layer of cloud and to the ground, and what these give each other.
//!
//! On the device (`sunlight`), on a square, periodic grid: the sun's light that reaches base and top of each layer, from the
//! highest to the lowest, along slanted rays and by where it enters (methods: [`Transport`]). What follows is smooth, so
//! that a coarser grid does, and is solved on the host (`between`): the layers are added to one composite column, which
//! exchanges light with the ground ([`crate::exchange`]). The grids are small: reading them back costs less than a
//! device's waiting for each pass.

mod between;
mod plan;
mod sunlight;

use crate::field::Field;
use crate::gpu::layout::{Frame, Share};
use crate::gpu::{Gpu, GpuError, HostMap, Target};
use crate::request::Transport;
use crate::slice::DeviceTables;
use std::time::Instant;

pub use between::{ColumnMaps, Energy};
pub(crate) use plan::{Grids, LayerShape, SceneShape, grids, shift_uv};
pub(crate) use sunlight::SunMaps;
pub use sunlight::blur;

/// Light of a layer at one moment, as shading needs it.
pub(crate) struct LayerLight {
    /// Horizontal irradiance that arrives from below and from above but for the sun.
    pub(crate) from_below: Target,
    pub(crate) from_above: Target,
    /// The sun's light relative to a slab's under the open sun: seen from below and from above.
    pub(crate) share: [Target; 2],
}

/// Light at one moment.
pub(crate) struct Light {
    /// Lowest first.
    pub(crate) layers: Vec<LayerLight>,
    /// Diffuse irradiance of the ground.
    pub(crate) gathered: Target,
    pub(crate) energy: Energy,
}

/// A layer as the stage takes it.
pub(crate) struct LayerInputs<'a> {
    pub(crate) frame: &'a Frame,
    pub(crate) uniform: &'a wgpu::Buffer,
    pub(crate) field: &'a Field,
    pub(crate) tables: &'a DeviceTables,
    /// Spread of light between where it enters and where it leaves: standard deviation, texels of the maps of sunlight.
    pub(crate) blur_texels: f64,
}

/// What the stage takes.
pub(crate) struct LightInputs<'a> {
    /// Lowest first, at least one.
    pub(crate) layers: &'a [LayerInputs<'a>],
    /// Radiance of the sky.
    pub(crate) sky: [f64; 3],
    pub(crate) grids: &'a Grids,
    pub(crate) transport: Transport,
    /// Of the ground, on the exchange grid.
    pub(crate) albedo: &'a HostMap,
    /// Relative change at which the exchange is taken as settled.
    pub(crate) settled: f64,
}

/// What lies between the stage's passes and its result, for tests.
pub(crate) struct Lit {
    /// Lowest first.
    pub(crate) maps: Vec<SunMaps>,
    pub(crate) columns: Vec<ColumnMaps>,
    pub(crate) shares: Vec<Share>,
    pub(crate) light: Light,
}

/// Runs the stage.
pub(crate) fn light(gpu: &Gpu, inputs: &LightInputs<'_>, deadline: Option<Instant>) -> Result<Lit, GpuError> {
    let maps = sunlight::maps(gpu, inputs, deadline)?;
    let columns = sunlight::read(gpu, &maps, inputs.grids, deadline)?;
    let between = between::solve(&columns, inputs);
    let upload = |label, colours: &[[f32; 3]]| {
        let data: Vec<f32> = colours.iter().flat_map(|[r, g, b]| [*r, *g, *b, 0.0]).collect();
        gpu.texture_from(label, [colours.len().isqrt() as u32; 2], 4, &data)
    };
    let shares = sunlight::shares(gpu, inputs, &maps, &between.shares, deadline)?;
    let layers = between.layers.iter().zip(shares).map(|(layer, share)| LayerLight {
        from_below: upload("from_below", &layer.from_below),
        from_above: upload("from_above", &layer.from_above),
        share,
    });
    let light =
        Light { layers: layers.collect(), gathered: upload("gathered", &between.gathered), energy: between.energy };
    Ok(Lit { maps, columns, shares: between.shares, light })
}
