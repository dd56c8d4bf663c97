//! What the stage takes.

use super::lattice_device::LatticeLit;
use super::plan::Grids;
use crate::field::Field;
use crate::gpu::HostMap;
use crate::method::Transport;
use crate::scene_air::AirBelow;
use crate::slab::angles::AngleSlice;
use crate::slice::DeviceTables;
use std::sync::Arc;

/// A layer as the stage takes it.
pub(crate) struct LayerInputs<'a> {
    /// The layer's [`crate::gpu::layout::Frame`].
    pub(crate) frame: &'a wgpu::Buffer,
    pub(crate) base_m: f64,
    /// From a point of the base to where its sun ray crosses that of the layer above, domains.
    pub(crate) above_uv: [f64; 2],
    pub(crate) field: &'a Field,
    pub(crate) tables: &'a DeviceTables,
    /// How it treats light by its angles, where there are layers to share light with.
    pub(crate) angles: Option<[AngleSlice; 3]>,
    /// What a lattice has found of it, where that is how sunlight is carried.
    pub(crate) lattice: Option<Arc<LatticeLit>>,
    /// Spread of light between where it enters and where it leaves: standard deviation, texels of the maps of sunlight.
    pub(crate) blur_texels: f64,
}

/// What the stage takes.
pub(crate) struct LightInputs<'a> {
    /// Lowest first, at least one.
    pub(crate) layers: &'a [LayerInputs<'a>],
    /// Horizontal irradiance of the sun above all layers.
    pub(crate) sun: [f64; 3],
    /// Radiance of the sky.
    pub(crate) sky: [f64; 3],
    /// What air among and below the layers makes of light.
    pub(crate) air: AirBelow,
    /// Side of the domain.
    pub(crate) extent_m: f64,
    /// From a ground point to where its sun ray crosses the lowest base, domains.
    pub(crate) shift_uv: [f64; 2],
    pub(crate) grids: &'a Grids,
    pub(crate) transport: Transport,
    /// Sine of the sun's zenith angle.
    pub(crate) sun_sine: f64,
    /// Of the ground, on the exchange grid.
    pub(crate) albedo: &'a HostMap,
    /// Relative change at which the exchange is taken as settled.
    pub(crate) settled: f64,
}
