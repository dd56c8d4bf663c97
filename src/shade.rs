//! Stage `shade`: the textures that are asked for, from thickness, light and tables.

mod cumulus;
mod ground;
mod inputs;
mod method;
mod sky;
mod tiles;

use crate::gpu::layout::View;
use crate::gpu::{Gpu, GpuError, binds, shaders};
use crate::request::TextureKind;
pub(crate) use cumulus::{CoarseNormals, CumulusField, CumulusInputs, CumulusLight, CumulusLit, SunDepth};
use ground::on_the_ground;
pub(crate) use ground::{GroundSun, SWEPT_BYTES, TowardsSun, points, towards_sun};
use inputs::{DrawnOn, cloud_binds, each, early, held};
pub(crate) use inputs::{Inputs, LayerInputs};
pub(crate) use method::SlabLight;
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

/// Makes one band of a texture: `view.rows` rows from `view.first_row`. `sun` is that of the band, for textures on the ground.
pub(crate) fn band(
    gpu: &Gpu,
    texture: TextureKind,
    inputs: &Inputs<'_>,
    sun: Option<&GroundSun>,
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
        TextureKind::Shadow | TextureKind::Irradiance => on_the_ground(gpu, texture, inputs, sun, view, &output),
        TextureKind::Cloud => {
            let from_above = view.from_above == 1;
            let held = held(gpu, inputs.layers.len() > 1, view.size[0] as usize * view.rows as usize);
            let last = inputs.layers.last().and_then(|last| last.light);
            // A new buffer holds zeros: what is drawn first may as well add to them.
            let over = inputs.cumulus.is_some_and(|(before, _)| *before == 0);
            let drawn = each(gpu, inputs, view, over, |layer, bound| {
                let (tables, method) = (layer.tables?, layer.method?);
                let field = binds![&layer.field.thickness, &layer.field.bounds];
                let shape = layer.levels.map_or(field, |levels| binds![&levels.map, &levels.bounds]);
                let drawn_on = DrawnOn { texels: &output, behind: last?.beyond(from_above), held: &held, first: false };
                let mut binds = cloud_binds(gpu, layer, bound, shape, from_above, &drawn_on)?;
                binds.extend(method.binds(gpu, tables, from_above));
                let Some(lattice) = layer.light.and_then(|light| light.lattice.as_ref()) else {
                    return Some((method.shader(layer.field), binds));
                };
                binds.extend(lattice.binds(gpu));
                Some((method.lattice_shader(layer.field), binds))
            });
            match (drawn, inputs.cumulus) {
                (Some(mut passes), Some((before, cumulus))) => {
                    let view = View { together: (inputs.layers.len() > 1).into(), ..*view };
                    cumulus.on_plane(gpu, &view, &output, &held).map(|pass| {
                        passes.insert(*before, pass);
                        passes
                    })
                }
                (drawn, _) => drawn,
            }
        }
        // The bands of one are made by `sky_band`, the other is drawn by the host.
        TextureKind::Sky | TextureKind::Compass => None,
    };
    gpu.run(texture.name(), deadline, &passes.ok_or_else(|| early(texture.name()))?)?;
    gpu.read(&output, count, deadline)
}
