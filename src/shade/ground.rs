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
    let (sun, passes) = towards_sun(gpu, inputs, view).ok_or_else(|| early("the sun's beam"))?;
    gpu.run("ground_sun", deadline, &passes)?;
    Ok(sun)
}

/// The passes that march towards the sun, and what they fill.
fn towards_sun(gpu: &Gpu, inputs: &Inputs<'_>, view: &View) -> Option<(GroundSun, Vec<Pass>)> {
    let count = 4 * view.size[0] as usize * view.rows as usize;
    let sun = GroundSun { beam: gpu.storage("beam", count), unscattered: gpu.storage("unscattered", count) };
    let mut passes = each(gpu, inputs, view, false, |layer, view| {
        let (thickness, bounds) = (&layer.field.thickness, &layer.field.bounds);
        let transmittance = &layer.tables?.transmittance;
        let (repeat, clamp) = (&gpu.repeat, &gpu.clamp);
        let binds =
            binds![layer.frame, view, thickness, bounds, transmittance, repeat, clamp, &sun.beam, &sun.unscattered];
        Some((layer.field.shader([&shaders::GROUND_SUN, &shaders::GROUND_SUN_COLUMNS]), binds))
    })?;
    if let Some((_, cumulus)) = inputs.cumulus {
        let view = View { first: passes.is_empty().into(), ..*view };
        passes.push(cumulus.below(gpu, &shaders::CUMULUS_GROUND, &view, &[&sun.beam, &sun.unscattered]));
    }
    Some((sun, passes))
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
        let (sun, marched) = towards_sun(gpu, inputs, &view).ok_or_else(|| early("the sun's beam"))?;
        passes.extend(marched);
        for part in [0, 1] {
            let output = gpu.storage("output", 3);
            let view = View { part, ..view };
            let shaded = on_the_ground(gpu, TextureKind::Irradiance, inputs, Some(&sun), &view, &output);
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
