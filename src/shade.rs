//! Stage `shade`: the textures that are asked for, from thickness, light and tables.

mod method;
mod sky;
mod tiles;

use crate::field::Field;
use crate::gpu::layout::View;
use crate::gpu::{Bind, Gpu, GpuError, Pass, Target, binds, shaders};
use crate::light::LayerLight;
use crate::request::TextureKind;
use crate::slice::DeviceTables;
pub(crate) use method::SlabLight;
pub(crate) use sky::{OnGround, SkyInputs, SkyLayer, ground_radiance, sky_band};
use std::time::Instant;

/// A layer that a texture is made from; not every texture needs all of it.
pub(crate) struct LayerInputs<'a> {
    pub(crate) frame: &'a wgpu::Buffer,
    pub(crate) field: &'a Field,
    pub(crate) tables: Option<&'a DeviceTables>,
    pub(crate) method: Option<&'a SlabLight>,
    pub(crate) light: Option<&'a LayerLight>,
}

/// What a texture is made from.
pub(crate) struct Inputs<'a> {
    /// The layers that it shows, in the order in which they are drawn: from the viewer on.
    pub(crate) layers: Vec<LayerInputs<'a>>,
    /// Diffuse irradiance of the ground.
    pub(crate) gathered: Option<&'a Target>,
}

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

/// What the layers leave of the sun's beam at each texel of a band on the ground.
pub(crate) struct GroundSun {
    /// With its 5-degree peak.
    beam: wgpu::Buffer,
    unscattered: wgpu::Buffer,
}

/// Marches towards the sun from each texel of a band.
pub(crate) fn ground_sun(
    gpu: &Gpu,
    inputs: &Inputs<'_>,
    view: &View,
    deadline: Option<Instant>,
) -> Result<GroundSun, GpuError> {
    let count = 4 * view.size[0] as usize * view.rows as usize;
    let sun = GroundSun { beam: gpu.storage("beam", count), unscattered: gpu.storage("unscattered", count) };
    let passes = each(gpu, inputs, view, |layer, view| {
        let (thickness, bounds) = (&layer.field.thickness, &layer.field.bounds);
        let transmittance = &layer.tables?.transmittance;
        let (repeat, clamp) = (&gpu.repeat, &gpu.clamp);
        let binds =
            binds![layer.frame, view, thickness, bounds, transmittance, repeat, clamp, &sun.beam, &sun.unscattered];
        Some((&shaders::GROUND_SUN, binds))
    });
    gpu.run("ground_sun", deadline, &passes.ok_or_else(|| early("the sun's beam"))?)?;
    Ok(sun)
}

/// A stage that was asked for before those that it takes from.
fn early(what: &str) -> GpuError {
    GpuError::Failed(format!("{what} was shaded before its light"))
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
        TextureKind::Thickness => each(gpu, inputs, view, |layer, view| {
            let binds = binds![layer.frame, view, &layer.field.thickness, &gpu.repeat, &output];
            Some((&shaders::THICKNESS, binds))
        }),
        TextureKind::Shadow | TextureKind::Irradiance => on_the_ground(gpu, texture, inputs, sun, view, &output),
        TextureKind::Cloud => each(gpu, inputs, view, |layer, bound| {
            let (tables, method) = (layer.tables?, layer.method?);
            let from_above = view.from_above == 1;
            let shape = binds![&layer.field.thickness, &layer.field.bounds];
            let mut binds = cloud_binds(gpu, layer, bound, shape, from_above, &output)?;
            binds.extend(method.binds(gpu, tables, from_above));
            Some((method.shader(), binds))
        }),
        // Its bands are made by `sky_band`.
        TextureKind::Sky => None,
    };
    gpu.run(texture.name(), deadline, &passes.ok_or_else(|| early(texture.name()))?)?;
    gpu.read(&output, count, deadline)
}

/// What every method's pass reads of a layer, in the order of its bindings. `view` is a [`View`] or a sky's, `shape` how
/// that looks at the layer's thickness.
fn cloud_binds(
    gpu: &Gpu,
    layer: &LayerInputs<'_>,
    view: &wgpu::Buffer,
    shape: Vec<Bind>,
    from_above: bool,
    output: &wgpu::Buffer,
) -> Option<Vec<Bind>> {
    let (tables, light) = (layer.tables?, layer.light?);
    let mut binds = binds![layer.frame, view];
    binds.extend(shape);
    binds.extend(binds![
        &tables.transmittance,
        &tables.reflectance,
        &tables.phase,
        &light.from_below,
        &light.from_above,
        &light.share[usize::from(from_above)],
        &gpu.repeat,
        &gpu.clamp,
        output,
    ]);
    Some(binds)
}

fn on_the_ground(
    gpu: &Gpu,
    texture: TextureKind,
    inputs: &Inputs<'_>,
    sun: Option<&GroundSun>,
    view: &View,
    output: &wgpu::Buffer,
) -> Option<Vec<Pass>> {
    let sun = sun?;
    let mut binds = binds![inputs.layers.first()?.frame, &gpu.uniform("view", view), &sun.beam, &sun.unscattered];
    let shader = if texture == TextureKind::Shadow { &shaders::SHADOW } else { &shaders::IRRADIANCE };
    if texture == TextureKind::Irradiance {
        binds.extend(binds![inputs.gathered?, &gpu.repeat]);
    }
    binds.extend(binds![output]);
    Some(vec![Pass::new(shader, [view.size[0], view.rows], binds)])
}

/// A pass for each layer; the first is told that nothing lies before it. `None` where something is missing.
fn each<'a>(
    gpu: &Gpu,
    inputs: &'a Inputs<'a>,
    view: &View,
    make: impl Fn(&'a LayerInputs<'a>, &wgpu::Buffer) -> Option<(&'static shaders::Shader, Vec<Bind>)>,
) -> Option<Vec<Pass>> {
    let views = [0, 1].map(|first| gpu.uniform("view", &View { first, ..*view }));
    let pass = |(i, layer): (usize, &'a LayerInputs<'a>)| {
        let (shader, binds) = make(layer, &views[usize::from(i == 0)])?;
        Some(Pass::new(shader, [view.size[0], view.rows], binds))
    };
    inputs.layers.iter().enumerate().map(pass).collect()
}
