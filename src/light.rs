//! Stage `light`: what sun and sky give to each layer of cloud and to the ground, and what these give each other.
//!
//! On the device (`sunlight`), on a square, periodic grid: the sun's light that reaches base and top of each layer, from the
//! highest to the lowest, along slanted rays and by where it enters (methods:
//! [`Transport`](crate::method::Transport)). What follows is smooth, so that a coarser grid does, and is solved on the host (`between`): the layers are added to one composite column, which
//! exchanges light with the ground ([`crate::exchange`]). The grids are small: reading them back costs less than a
//! device's waiting for each pass.

mod between;
mod inputs;
mod lattice;
mod lattice_device;
mod plan;
mod sunlight;

use crate::gpu::layout::Share;
use crate::gpu::{Gpu, GpuError, HostMap, Target};
use crate::scene_air::AirChange;
use std::sync::Arc;
use std::time::Instant;

pub use between::{ColumnMaps, Energy};
pub(crate) use inputs::{LayerInputs, LightInputs};
pub(crate) use lattice::LatticeInputs;
pub use lattice::LatticeMaps;
pub(crate) use lattice_device::{Dressed, LatticeLit, LatticeSeen};
pub(crate) use plan::{Grids, LayerShape, SceneShape, grids, shift_uv};
pub(crate) use sunlight::SunMaps;
pub use sunlight::blur;

/// Light of a layer at one moment, as shading needs it.
pub(crate) struct LayerLight {
    /// Horizontal irradiance that arrives from below and from above but for the sun's and, as shading counts that as the sun's, for
    /// what only layers have scattered; the latter for one who sees it through the layer, less what the air within takes, and for
    /// one above.
    pub(crate) from_below: Target,
    pub(crate) from_above: [Target; 2],
    /// From below with what layers have scattered: for one who sees no layer below this one.
    pub(crate) all_from_below: Target,
    /// The sun's light relative to a slab's under the open sun, whatever lies above: seen from below and from above. Fourth channel:
    /// optical depth of transport of the layers above, on the way to the sun.
    pub(crate) share: [Target; 2],
    /// What its lattice has for view rays, where it has one.
    pub(crate) lattice: Option<LatticeSeen>,
}

impl LayerLight {
    /// Light that arrives from beyond the layer, for one who looks at it from above or from below.
    pub(crate) fn beyond(&self, from_above: bool) -> &Target {
        if from_above { &self.from_below } else { &self.from_above[1] }
    }
}

impl Light {
    /// Bytes on the device.
    pub(crate) fn size(&self) -> u64 {
        let of_layer = |layer: &LayerLight| {
            let LayerLight { from_below, from_above, all_from_below, share, lattice } = layer;
            let maps = from_above.iter().chain(share).chain([from_below, all_from_below]);
            maps.map(Target::size).sum::<u64>() + lattice.as_ref().map_or(0, LatticeSeen::size)
        };
        self.layers.iter().map(of_layer).sum::<u64>() + self.gathered.size()
    }
}

/// Light at one moment.
pub(crate) struct Light {
    /// Lowest first.
    pub(crate) layers: Vec<LayerLight>,
    /// Diffuse irradiance of the ground.
    pub(crate) gathered: Target,
    /// As without air among and below the layers.
    pub(crate) energy: Energy,
}

/// The stage's result and what lies between its passes, for tests.
pub(crate) struct Lit {
    /// Lowest first.
    pub(crate) maps: Vec<SunMaps>,
    pub(crate) columns: Vec<ColumnMaps>,
    pub(crate) lattices: Vec<Option<Arc<LatticeLit>>>,
    pub(crate) shares: Vec<Share>,
    /// Of the ground, on the exchange grid.
    pub(crate) albedo: HostMap,
    pub(crate) light: Arc<Light>,
}

/// Runs the stage.
pub(crate) fn light(gpu: &Gpu, inputs: &LightInputs<'_>, deadline: Option<Instant>) -> Result<Lit, GpuError> {
    let maps = sunlight::maps(gpu, inputs, deadline)?;
    let columns = sunlight::read(gpu, &maps, inputs.grids, deadline)?;
    let between = between::solve(&columns, inputs);
    let upload = |label, colours: &[[f32; 3]], air: AirChange| {
        let (factor, added) = (air.factor.map(|part| part as f32), air.added.map(|light| light as f32));
        let in_air = |light: &[f32; 3]| [0, 1, 2].map(|c| factor[c] * light[c] + added[c]);
        let data: Vec<f32> = colours.iter().map(in_air).flat_map(|[r, g, b]| [r, g, b, 0.0]).collect();
        gpu.texture_from(label, [colours.len().isqrt() as u32; 2], 4, &data)
    };
    let shares = sunlight::shares(gpu, inputs, &maps, &between.shares, deadline)?;
    let airs = inputs.air.layers;
    let layers = between.layers.iter().zip(shares).zip(airs.into_iter().zip(inputs.air.within));
    let seen = inputs
        .layers
        .iter()
        .zip(&between.shares)
        .map(|(layer, share)| layer.lattice.clone().map(|lattice| LatticeSeen::new(gpu, lattice, share.in_air)));
    let layers = layers.zip(seen).map(|((([all, layer], share), ([below, above], within)), lattice)| LayerLight {
        all_from_below: upload("all_from_below", &all.from_below, below),
        from_below: upload("from_below", &layer.from_below, below),
        from_above: [above.times(within), above].map(|air| upload("from_above", &layer.from_above, air)),
        share,
        lattice,
    });
    let gathered = upload("gathered", &between.gathered, inputs.air.ground_diffuse);
    let light = Light { layers: layers.collect(), gathered, energy: between.energy };
    let lattices = inputs.layers.iter().map(|layer| layer.lattice.clone()).collect();
    Ok(Lit { maps, columns, lattices, shares: between.shares, albedo: inputs.albedo.clone(), light: Arc::new(light) })
}
