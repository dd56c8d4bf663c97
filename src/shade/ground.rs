//! Textures on the ground: the sun's beam at each texel, and what is made of it.

use super::inputs::{Inputs, each, early};
use crate::gpu::layout::View;
use crate::gpu::{Gpu, GpuError, Pass, binds, shaders};
use crate::request::TextureKind;
use std::time::Instant;

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
    let passes = each(gpu, inputs, view, false, |layer, view| {
        let (thickness, bounds) = (&layer.field.thickness, &layer.field.bounds);
        let transmittance = &layer.tables?.transmittance;
        let (repeat, clamp) = (&gpu.repeat, &gpu.clamp);
        let binds =
            binds![layer.frame, view, thickness, bounds, transmittance, repeat, clamp, &sun.beam, &sun.unscattered];
        Some((layer.field.shader([&shaders::GROUND_SUN, &shaders::GROUND_SUN_COLUMNS]), binds))
    });
    let mut passes = passes.ok_or_else(|| early("the sun's beam"))?;
    if let Some((_, cumulus)) = inputs.cumulus {
        let view = View { first: passes.is_empty().into(), ..*view };
        passes.push(cumulus.below(gpu, &shaders::CUMULUS_GROUND, &view, &[&sun.beam, &sun.unscattered]));
    }
    gpu.run("ground_sun", deadline, &passes)?;
    Ok(sun)
}

pub(super) fn on_the_ground(
    gpu: &Gpu,
    texture: TextureKind,
    inputs: &Inputs<'_>,
    sun: Option<&GroundSun>,
    view: &View,
    output: &wgpu::Buffer,
) -> Option<Vec<Pass>> {
    let sun = sun?;
    let mut binds = binds![
        inputs.layers.first().map_or(inputs.clear, |layer| layer.frame),
        &gpu.uniform("view", view),
        &sun.beam,
        &sun.unscattered
    ];
    let shader = if texture == TextureKind::Shadow { &shaders::SHADOW } else { &shaders::IRRADIANCE };
    if texture == TextureKind::Irradiance {
        binds.extend(binds![inputs.gathered?, &gpu.repeat]);
    }
    binds.extend(binds![output]);
    Some(vec![Pass::new(shader, [view.size[0], view.rows], binds)])
}
