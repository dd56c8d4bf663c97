//! Textures on the ground: the sun's beam at each texel, and what is made of it.

use super::inputs::{Inputs, LayerInputs, early};
use crate::gpu::layout::{Disc, View};
use crate::gpu::{Gpu, GpuError, Pass, binds, shaders};
use crate::request::TextureKind;
use std::time::Instant;

/// What the layers leave of the sun's beam at each texel of a band on the ground, with its 5-degree peak or without.
pub(crate) struct GroundSun {
    beam: wgpu::Buffer,
}

impl GroundSun {
    /// Bytes on the device.
    pub(crate) fn size(&self) -> u64 {
        self.beam.size()
    }
}

/// The beams that light on the ground is made of.
#[derive(Clone, Copy)]
pub(crate) struct Beams<'a> {
    /// With its 5-degree peak: no other light has what left it by less. What is asked for without all light does not look.
    pub(crate) with_peak: &'a GroundSun,
    /// What counts as the beam.
    pub(crate) beam: &'a GroundSun,
}

impl<'a> Beams<'a> {
    /// Where nothing but this is looked at.
    pub(crate) fn only(beam: &'a GroundSun) -> Self {
        Self { with_peak: beam, beam }
    }
}

/// The passes that look towards the sun from bands of a texture, and what they fill.
pub(crate) struct TowardsSun {
    /// One a band.
    pub(crate) suns: Vec<GroundSun>,
    /// Passes that are submitted together.
    pub(crate) steps: Vec<Vec<Pass>>,
}

/// Of the numbers of rays that are swept together, bytes: what a device must bind at least.
pub(crate) const SWEPT_BYTES: u64 = 1 << 27;

/// What is left of the sun's beam at each texel of some bands, with its peak where their views say so.
pub(crate) fn towards_sun(gpu: &Gpu, inputs: &Inputs<'_>, bands: &[View]) -> Result<TowardsSun, GpuError> {
    let early = || early("the sun's beam");
    let texels = |view: &View| view.size[0] as usize * view.rows as usize;
    let sun = |view: &View| GroundSun { beam: gpu.storage("beam", 4 * texels(view)) };
    let suns: Vec<GroundSun> = bands.iter().map(sun).collect();
    let in_parts = inputs.layers.iter().skip(1).any(|layer| disc_parts(layer).len() > 1);
    let sums: Vec<_> =
        bands.iter().map(|view| gpu.storage("sums", 4 * if in_parts { texels(view) } else { 1 })).collect();
    let mut steps = Vec::new();
    for (number, layer) in inputs.layers.iter().enumerate() {
        let (field, tables) = (layer.field, layer.tables.ok_or_else(early)?);
        let parts = disc_parts(layer);
        let most = parts.iter().map(|part| part.directions).max().unwrap_or(0);
        let swept = layer.rays.swept.map(|dense| {
            let numbers = most as usize * swept_rays(layer);
            (dense.rows * longer_side(layer), gpu.storage("swept", numbers))
        });
        for part in parts {
            let uniform = gpu.uniform("disc", &part);
            if let Some((rows, swept)) = &swept {
                let shader = field.shader([&shaders::SUN_SWEEP, &shaders::SUN_SWEEP_COLUMNS]);
                let binds = binds![layer.frame, &uniform, &field.thickness, swept];
                steps.push(vec![Pass::new(shader, [*rows, part.directions], binds)]);
            }
            for ((view, sun), sums) in bands.iter().zip(&suns).zip(&sums) {
                let bound = gpu.uniform("view", &View { first: (number == 0).into(), ..*view });
                let mut binds = binds![layer.frame, &bound, &uniform, &field.thickness, &sun.beam, sums];
                let low = layer.rays.are_low();
                let shader = match &swept {
                    Some((_, swept)) => {
                        binds.extend(binds![swept]);
                        if low { &shaders::GROUND_SWEPT_LOW } else { &shaders::GROUND_SWEPT }
                    }
                    None => {
                        binds.extend(binds![&field.bounds, &gpu.repeat]);
                        field.shader(match low {
                            true => [&shaders::GROUND_SUN_LOW, &shaders::GROUND_SUN_LOW_COLUMNS],
                            false => [&shaders::GROUND_SUN, &shaders::GROUND_SUN_COLUMNS],
                        })
                    }
                };
                if low {
                    binds.extend(binds![&tables.transmittance, &gpu.clamp]);
                }
                steps.push(vec![Pass::new(shader, [view.size[0], view.rows], binds)]);
            }
        }
    }
    if let Some((_, cumulus)) = inputs.cumulus {
        for (view, sun) in bands.iter().zip(&suns) {
            let view = View { first: inputs.layers.is_empty().into(), ..*view };
            steps.push(vec![cumulus.below(gpu, &shaders::CUMULUS_GROUND, &view, &[&sun.beam])]);
        }
    }
    Ok(TowardsSun { suns, steps })
}

/// Texels along the longer side of a layer's map.
fn longer_side(layer: &LayerInputs<'_>) -> u32 {
    layer.field.thickness.width.max(layer.field.thickness.height)
}

/// Numbers of the rays towards one place on the sun's disc: as `sweep_row` in `shaders/shared/sweep.wgsl` has them.
fn swept_rays(layer: &LayerInputs<'_>) -> usize {
    layer.rays.swept.map_or(0, |dense| dense.numbers(longer_side(layer) as usize))
}

/// Rays towards places on the disc that are looked at together: all, but for the memory that swept ones take.
fn disc_parts(layer: &LayerInputs<'_>) -> Vec<Disc> {
    let directions = SWEPT_BYTES / (4 * swept_rays(layer).max(1) as u64);
    layer.rays.parts(directions as usize)
}

/// Irradiance at places of the ground alone, domains from the north-western corner: six numbers each, all light and of it the
/// sun's beam. The passes are those of a texture, so a place has the light of a texel whose centre is there.
pub(crate) fn points(
    gpu: &Gpu,
    inputs: &Inputs<'_>,
    view: &View,
    places: &[[f64; 2]],
    deadline: Option<Instant>,
) -> Result<Vec<f32>, GpuError> {
    let (mut passes, mut outputs) = (Vec::new(), Vec::with_capacity(2 * places.len()));
    for place in places {
        let view = View { size: [1; 2], rows: 1, point: place.map(|part| part as f32), pointed: 1, ..*view };
        // One where the beam has its peak.
        let views = [View { peak: 1, ..view }, view];
        let TowardsSun { suns, steps } = towards_sun(gpu, inputs, if view.peak == 1 { &views[1..] } else { &views })?;
        passes.extend(steps.into_iter().flatten());
        let (Some(with_peak), Some(beam)) = (suns.first(), suns.last()) else { return Err(early("a point")) };
        for part in [0, 1] {
            let output = gpu.storage("output", 3);
            let view = View { part, ..view };
            let beams = Some(Beams { with_peak, beam });
            let shaded = on_the_ground(gpu, TextureKind::Irradiance, inputs, beams, &view, &output);
            passes.extend(shaded.ok_or_else(|| early("a point"))?);
            outputs.push(output);
        }
    }
    gpu.run("points", deadline, &passes)?;
    gpu.read_each(&outputs, 3, deadline)
}

pub(super) fn on_the_ground(
    gpu: &Gpu,
    texture: TextureKind,
    inputs: &Inputs<'_>,
    beams: Option<Beams<'_>>,
    view: &View,
    output: &wgpu::Buffer,
) -> Option<Vec<Pass>> {
    let Beams { with_peak, beam } = beams?;
    let frame = inputs.layers.first().map_or(inputs.clear, |layer| layer.frame);
    let mut binds = binds![frame, &gpu.uniform("view", view)];
    let shader = if texture == TextureKind::Shadow { &shaders::SHADOW } else { &shaders::IRRADIANCE };
    if texture == TextureKind::Irradiance {
        binds.extend(binds![&with_peak.beam]);
    }
    binds.extend(binds![&beam.beam]);
    if texture == TextureKind::Irradiance {
        binds.extend(binds![inputs.gathered?, &gpu.repeat]);
    }
    binds.extend(binds![output]);
    Some(vec![Pass::new(shader, [view.size[0], view.rows], binds)])
}
