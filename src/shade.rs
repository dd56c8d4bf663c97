//! Stage `shade`: the textures that are asked for, from thickness, light and tables.

mod cumulus;
mod ground;
mod inputs;
mod method;
mod plane;
mod sky;
mod tiles;

use crate::gpu::layout::View;
use crate::gpu::{Gpu, GpuError, binds, shaders};
use crate::request::TextureKind;
pub(crate) use cumulus::{CoarseNormals, CumulusField, CumulusInputs, CumulusLight, CumulusLit, SunDepth};
use ground::on_the_ground;
pub(crate) use ground::{Beams, GroundSun, SWEPT_BYTES, TowardsSun, points, towards_sun};
pub(crate) use inputs::{Inputs, LayerInputs};
use inputs::{each, early};
pub(crate) use method::SlabLight;
use plane::on_plane;
pub use plane::{SLABS_ACROSS, SLABS_COUNT, SLABS_PER_OCTAVE};
pub(crate) use sky::{DeviceAir, GroundLit, OnGround, SkyCumulus, SkyInputs, SkyLayer, ground_radiance, sky_band};
pub use sky::{SkyAir, SkyClouds};
use std::time::Instant;
pub(crate) use tiles::dip;

/// Texels of one submission at most: large textures are made in bands, so that a request can be dropped between them,
/// buffers stay below WebGPU's limits and no submission holds the device for long.
const BAND_TEXELS: f64 = 1024.0 * 512.0;
/// Cuts of marched rays in one submission at most: about a third of a second of a software device.
const BAND_CUTS: f64 = 3e7;

/// Rows of a band of a texture of `size` texels across and down whose rays are cut `cuts` times each.
pub(crate) fn band_rows(size: [u32; 2], cuts: f64) -> u32 {
    let texels = BAND_TEXELS.min(BAND_CUTS / cuts.max(1.0));
    ((texels / f64::from(size[0])) as u32).clamp(1, size[1])
}

/// Makes one band of a texture: `view.rows` rows from `view.first_row`. `beams` are those of the band, for textures on the ground.
pub(crate) fn band(
    gpu: &Gpu,
    texture: TextureKind,
    inputs: &Inputs<'_>,
    beams: Option<Beams<'_>>,
    view: &View,
    deadline: Option<Instant>,
) -> Result<Vec<f32>, GpuError> {
    let count = view.size[0] as usize * view.rows as usize * texture.channels().len();
    let output = gpu.storage("output", count);
    let passes = match texture {
        TextureKind::Thickness => each(gpu, inputs, view, false, |layer, view| {
            let binds = binds![layer.frame, view, &layer.field.thickness, &gpu.repeat, &output];
            Some((layer.field.shader([&shaders::THICKNESS, &shaders::THICKNESS_COLUMNS]), binds))
        })
        .map(|mut passes| {
            let view = View { first: passes.is_empty().into(), ..*view };
            let below = |cumulus: &CumulusInputs| cumulus.below(gpu, &shaders::CUMULUS_THICKNESS, &view, &[&output]);
            passes.extend(inputs.cumulus.map(|(_, cumulus)| below(cumulus)));
            passes
        }),
        TextureKind::Shadow | TextureKind::Irradiance => on_the_ground(gpu, texture, inputs, beams, view, &output),
        TextureKind::Cloud => on_plane(gpu, inputs, view, &output),
        // The bands of one are made by `sky_band`, the other is drawn by the host.
        TextureKind::Sky | TextureKind::Compass => None,
    };
    gpu.run(texture.name(), deadline, &passes.ok_or_else(|| early(texture.name()))?)?;
    gpu.read(&output, count, deadline)
}
