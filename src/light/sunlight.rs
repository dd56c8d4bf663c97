//! The sun's light at base and top of each layer, on the device.

use super::between::ColumnMaps;
use super::plan::Grids;
use super::{LayerInputs, LightInputs};
use crate::gpu::layout::{Blur, Share};
use crate::gpu::{Bind, Gpu, GpuError, HostMap, Target, shaders};
use std::time::Instant;

/// Maps of a layer's sunlight. Those with mip levels are means over coarser texels there.
pub(crate) struct SunMaps {
    /// Irradiance of the cloud's top, relative, before and after blurring; and in between.
    pub(crate) entry: Target,
    pub(crate) blurred: Target,
    half_blurred: Target,
    pub(crate) beam: Target,
    pub(crate) tilted: Target,
    pub(crate) entered: Target,
    pub(crate) reflected: Target,
    pub(crate) column: Target,
    pub(crate) through: Target,
    pub(crate) not_reflected: Target,
}

/// A blur narrower than this, in texels, is none.
const LEAST_BLUR: f64 = 0.3;
/// Standard deviations from its middle at which a Gaussian ends.
const REACH: f64 = 3.0;
/// Taps to either side, at most.
const MOST_TAPS: i32 = 96;

impl SunMaps {
    fn new(gpu: &Gpu, grids: &Grids) -> Self {
        let size = [grids.sun_texels; 2];
        let single = |label| gpu.texture(label, size, 1, 1);
        let levels = grids.level() + 1;
        let colours = |label| gpu.texture(label, size, 4, levels as u32);
        Self {
            entry: single("entry"),
            blurred: single("blurred"),
            half_blurred: single("half_blurred"),
            beam: colours("beam"),
            tilted: colours("tilted"),
            entered: colours("entered"),
            reflected: colours("reflected"),
            column: gpu.texture("column", size, 4, 1),
            through: colours("through"),
            not_reflected: colours("not_reflected"),
        }
    }

    /// Where blurred entry lies: a blur of nothing is not made.
    pub(crate) fn entering(&self, blur_texels: f64) -> &Target {
        if blur_texels < LEAST_BLUR { &self.entry } else { &self.blurred }
    }

    /// Those that the host reads.
    fn averaged(&self) -> [&Target; 6] {
        [&self.beam, &self.tilted, &self.entered, &self.reflected, &self.through, &self.not_reflected]
    }
}

/// A blur along one axis, (1, 0) or (0, 1), of a standard deviation above 0 in texels.
pub fn blur(axis: [i32; 2], sigma_texels: f64) -> Blur {
    let radius = ((REACH * sigma_texels).ceil() as i32).min(MOST_TAPS);
    Blur { axis, radius, sharpness: (0.5 / (sigma_texels * sigma_texels)) as f32 }
}

/// Maps of all layers, lowest first.
pub(crate) fn maps(gpu: &Gpu, inputs: &LightInputs<'_>, deadline: Option<Instant>) -> Result<Vec<SunMaps>, GpuError> {
    let open = gpu.texture_from("open sun", [1, 1], 4, &[1.0; 4]);
    let maps: Vec<SunMaps> = inputs.layers.iter().map(|_| SunMaps::new(gpu, inputs.grids)).collect();
    gpu.run("sunlight", deadline, |pass| {
        for (i, layer) in inputs.layers.iter().enumerate().rev() {
            let above = maps.get(i + 1).map_or(&open, |above| &above.beam);
            record(gpu, pass, layer, &maps[i], above, inputs.grids);
        }
    })?;
    Ok(maps)
}

fn record(
    gpu: &Gpu,
    pass: &mut wgpu::ComputePass<'_>,
    layer: &LayerInputs<'_>,
    maps: &SunMaps,
    above: &Target,
    grids: &Grids,
) {
    let size = [grids.sun_texels; 2];
    let (thickness, bounds) = (&layer.field.thickness.view, &layer.field.bounds.view);
    let (repeat, clamp) = (&gpu.repeat, &gpu.clamp);
    let binds = [
        Bind::Buffer(layer.uniform),
        Bind::View(thickness),
        Bind::View(bounds),
        Bind::Sampler(repeat),
        Bind::View(&maps.entry.levels[0]),
    ];
    gpu.dispatch(pass, &shaders::SUN_ENTRY, &binds, size);
    if layer.blur_texels >= LEAST_BLUR {
        for (axis, from, to) in [([1, 0], &maps.entry, &maps.half_blurred), ([0, 1], &maps.half_blurred, &maps.blurred)]
        {
            let uniform = gpu.uniform("blur", &blur(axis, layer.blur_texels));
            let binds = [Bind::Buffer(&uniform), Bind::View(&from.view), Bind::View(&to.levels[0])];
            gpu.dispatch(pass, &shaders::BLUR, &binds, size);
        }
    }
    let binds = [
        Bind::Buffer(layer.uniform),
        Bind::View(thickness),
        Bind::View(bounds),
        Bind::View(&layer.tables.transmittance.view),
        Bind::View(&layer.tables.reflectance.view),
        Bind::View(&maps.entry.view),
        Bind::View(&maps.entering(layer.blur_texels).view),
        Bind::View(&above.levels[0]),
        Bind::Sampler(repeat),
        Bind::Sampler(clamp),
        Bind::View(&maps.beam.levels[0]),
        Bind::View(&maps.tilted.levels[0]),
        Bind::View(&maps.entered.levels[0]),
        Bind::View(&maps.reflected.levels[0]),
    ];
    gpu.dispatch(pass, &shaders::BASE_LIGHT, &binds, size);
    let binds = [
        Bind::Buffer(layer.uniform),
        Bind::View(thickness),
        Bind::View(&layer.tables.transmittance.view),
        Bind::View(&layer.tables.diffuse.view),
        Bind::Sampler(repeat),
        Bind::Sampler(clamp),
        Bind::View(&maps.column.levels[0]),
        Bind::View(&maps.through.levels[0]),
        Bind::View(&maps.not_reflected.levels[0]),
    ];
    gpu.dispatch(pass, &shaders::BASE_COLUMN, &binds, size);
    for target in maps.averaged() {
        for level in 1..target.levels.len() {
            let binds = [Bind::View(&target.levels[level - 1]), Bind::View(&target.levels[level])];
            gpu.dispatch(pass, &shaders::DOWNSAMPLE, &binds, target.level_size(level));
        }
    }
}

/// The maps on the exchange grid.
pub(crate) fn read(
    gpu: &Gpu,
    maps: &[SunMaps],
    grids: &Grids,
    deadline: Option<Instant>,
) -> Result<Vec<ColumnMaps>, GpuError> {
    let level = grids.level();
    let wanted: Vec<(&Target, usize)> =
        maps.iter().flat_map(|maps| maps.averaged().map(|target| (target, level))).collect();
    let mut read = gpu.read_maps(&wanted, deadline)?.into_iter();
    let mut next = || read.next().map_or_else(Vec::new, |map: HostMap| texels(&map, grids));
    Ok(maps
        .iter()
        .map(|_| ColumnMaps {
            beam: next(),
            tilted: next(),
            entered: next(),
            reflected: next(),
            through: next(),
            not_reflected: next(),
        })
        .collect())
}

/// Texels on the exchange grid; a map of one texel is the same everywhere.
fn texels(map: &HostMap, grids: &Grids) -> Vec<[f32; 4]> {
    let count = (grids.exchange_texels * grids.exchange_texels) as usize;
    let texels: Vec<[f32; 4]> = map.data.as_chunks().0.to_vec();
    match texels.first() {
        Some(only) if texels.len() == 1 => vec![*only; count],
        _ => texels,
    }
}

/// What each layer gets of the sun: seen from below, and from above.
pub(crate) fn shares(
    gpu: &Gpu,
    inputs: &LightInputs<'_>,
    maps: &[SunMaps],
    shares: &[Share],
    deadline: Option<Instant>,
) -> Result<Vec<[Target; 2]>, GpuError> {
    let open = gpu.texture_from("open sun", [1, 1], 4, &[1.0; 4]);
    let size = [inputs.grids.sun_texels; 2];
    let targets: Vec<[Target; 2]> =
        maps.iter().map(|_| ["share_below", "share_above"].map(|label| gpu.texture(label, size, 4, 1))).collect();
    gpu.run("sun_share", deadline, |pass| {
        for (i, (layer, own)) in inputs.layers.iter().zip(maps).enumerate() {
            let above = maps.get(i + 1).map_or(&open, |above| &above.beam);
            let share = gpu.uniform("share", &shares[i]);
            let binds = [
                Bind::Buffer(layer.uniform),
                Bind::Buffer(&share),
                Bind::View(&own.beam.view),
                Bind::View(&own.tilted.view),
                Bind::View(&own.entered.view),
                Bind::View(&own.column.view),
                Bind::View(&own.reflected.view),
                Bind::View(&above.levels[0]),
                Bind::Sampler(&gpu.repeat),
                Bind::View(&targets[i][0].levels[0]),
                Bind::View(&targets[i][1].levels[0]),
            ];
            gpu.dispatch(pass, &shaders::SUN_SHARE, &binds, size);
        }
    })?;
    Ok(targets)
}
