//! The texture `cloud`: layers as a plane over the domain shows them.

use super::inputs::{DrawnOn, Inputs, LayerInputs, cloud_binds, each, held};
use crate::gpu::layout::View;
use crate::gpu::shaders::Shader;
use crate::gpu::{Bind, Gpu, Pass, binds, shaders};
use crate::slab::fluxes::{DEPTH_COUNT, DEPTHS_PER_OCTAVE};

/// Optical depths in an octave of which a parallel view's slabs are made, and in all, over those that flux tables span.
pub const SLABS_PER_OCTAVE: usize = 192;
/// See [`SLABS_PER_OCTAVE`].
pub const SLABS_COUNT: usize = (DEPTH_COUNT - 1) / DEPTHS_PER_OCTAVE * SLABS_PER_OCTAVE + 1;
/// Of them in a row of invocations.
pub const SLABS_ACROSS: usize = 64;
/// Floats of one: three vectors of four.
const SLAB_FLOATS: usize = 12;

/// Passes that draw the layers, from the viewer on. `None` where something is missing.
pub(super) fn on_plane(gpu: &Gpu, inputs: &Inputs<'_>, view: &View, output: &wgpu::Buffer) -> Option<Vec<Pass>> {
    let held = held(gpu, inputs.layers.len() > 1, view.size[0] as usize * view.rows as usize);
    // A new buffer holds zeros: what is drawn first may as well add to them.
    let over = inputs.cumulus.is_some_and(|(before, _)| *before == 0);
    let parallel = view.perspective == 0;
    let mut slabs = Vec::new();
    let mut seen = Vec::new();
    if parallel {
        for layer in &inputs.layers {
            let (pass, buffer) = slabs_of_view(gpu, layer, view)?;
            slabs.push(pass);
            seen.push(buffer);
        }
    }
    let behind = inputs.layers.last().and_then(|last| last.light);
    let mut slabs_seen = seen.iter();
    let mut drawn = each(gpu, inputs, view, over, |layer, bound| {
        let beyond = behind?.beyond(view.from_above == 1);
        let drawn_on = DrawnOn { texels: output, behind: beyond, held: &held, first: false };
        match slabs_seen.next() {
            Some(slabs) => parallel_layer(gpu, layer, view, bound, slabs, &drawn_on),
            None => layer_from_eye(gpu, layer, bound, &drawn_on, view.from_above == 1),
        }
    })?;
    if let Some((before, cumulus)) = inputs.cumulus {
        let view = View { together: (inputs.layers.len() > 1).into(), ..*view };
        drawn.insert(*before, cumulus.on_plane(gpu, &view, output, &held)?);
    }
    slabs.extend(drawn);
    Some(slabs)
}

/// Slabs of a layer's droplets, of all depths, as a parallel view shows them.
fn slabs_of_view(gpu: &Gpu, layer: &LayerInputs<'_>, view: &View) -> Option<(Pass, wgpu::Buffer)> {
    let (tables, method) = (layer.tables?, layer.method?);
    let slabs = gpu.storage("slabs of a view", SLAB_FLOATS * SLABS_COUNT);
    let view_of = gpu.uniform("view", view);
    let mut binds = binds![layer.frame, &view_of, &tables.transmittance, &tables.reflectance, &gpu.clamp, &slabs];
    binds.extend(method.binds(gpu, tables, view.from_above == 1));
    let size = [SLABS_ACROSS as u32, SLABS_COUNT.div_ceil(SLABS_ACROSS) as u32];
    Some((Pass::new(method.slabs_shader(), size, binds), slabs))
}

/// A layer in a parallel view.
fn parallel_layer(
    gpu: &Gpu,
    layer: &LayerInputs<'_>,
    view: &View,
    bound: &wgpu::Buffer,
    slabs: &wgpu::Buffer,
    drawn_on: &DrawnOn<'_>,
) -> Option<(&'static Shader, Vec<Bind>)> {
    let (field, light, side) = (layer.field, layer.light?, view.from_above as usize);
    // Upright rays are in one column each.
    let upright = view.towards[..2] == [0.0; 2];
    let mut binds = binds![layer.frame, bound];
    binds.extend(if upright { binds![&field.thickness] } else { shape(layer) });
    binds.extend(binds![
        slabs,
        &light.from_below,
        &light.from_above[side],
        &light.share[side],
        &gpu.repeat,
        drawn_on.texels,
        drawn_on.behind,
        drawn_on.held,
    ]);
    let shader = match &light.lattice {
        Some(lattice) => {
            binds.extend(lattice.binds(gpu));
            field.shader(match upright {
                true => [&shaders::LATTICE_UPRIGHT, &shaders::LATTICE_UPRIGHT_COLUMNS],
                false => [&shaders::LATTICE_PARALLEL, &shaders::LATTICE_PARALLEL_COLUMNS],
            })
        }
        None if upright => &shaders::CLOUD_UPRIGHT,
        None => field.shader([&shaders::CLOUD_PARALLEL, &shaders::CLOUD_PARALLEL_COLUMNS]),
    };
    Some((shader, binds))
}

/// A layer as an eye sees it.
fn layer_from_eye(
    gpu: &Gpu,
    layer: &LayerInputs<'_>,
    view: &wgpu::Buffer,
    drawn_on: &DrawnOn<'_>,
    from_above: bool,
) -> Option<(&'static Shader, Vec<Bind>)> {
    let (tables, method) = (layer.tables?, layer.method?);
    let mut binds = cloud_binds(gpu, layer, view, shape(layer), from_above, drawn_on)?;
    binds.extend(method.binds(gpu, tables, from_above));
    let Some(lattice) = layer.light.and_then(|light| light.lattice.as_ref()) else {
        return Some((method.shader(layer.field), binds));
    };
    binds.extend(lattice.binds(gpu));
    Some((method.lattice_shader(layer.field), binds))
}

/// A layer's shape as planes look at it: coarser where rays are flat.
fn shape(layer: &LayerInputs<'_>) -> Vec<Bind> {
    let field = binds![&layer.field.thickness, &layer.field.bounds];
    layer.levels.map_or(field, |levels| binds![&levels.map, &levels.bounds])
}
