//! What textures are made from, and how passes take it.

use super::cumulus::CumulusInputs;
use super::method::SlabLight;
use crate::field::{Field, Levels};
use crate::gpu::layout::View;
use crate::gpu::shaders::Shader;
use crate::gpu::{Bind, Gpu, GpuError, Pass, Target, binds};
use crate::light::LayerLight;
use crate::slice::DeviceTables;
use crate::sun_rays::SunRays;

/// A layer that a texture is made from; not every texture needs all of it.
pub(crate) struct LayerInputs<'a> {
    pub(crate) frame: &'a wgpu::Buffer,
    pub(crate) field: &'a Field,
    pub(crate) tables: Option<&'a DeviceTables>,
    pub(crate) method: Option<&'a SlabLight>,
    pub(crate) light: Option<&'a LayerLight>,
    /// Of its field, for flat rays.
    pub(crate) levels: Option<&'a Levels>,
    /// From the ground towards the sun's disc.
    pub(crate) rays: &'a SunRays,
}

/// What a texture is made from.
pub(crate) struct Inputs<'a> {
    /// The layers that it shows, in the order in which they are drawn: from the viewer on.
    pub(crate) layers: Vec<LayerInputs<'a>>,
    /// The cumulus, and how many of the layers are drawn before it.
    pub(crate) cumulus: Option<&'a (usize, CumulusInputs)>,
    /// Light on a scene without stratiform layers, as a layer of no cloud.
    pub(crate) clear: &'a wgpu::Buffer,
    /// Diffuse irradiance of the ground.
    pub(crate) gathered: Option<&'a Target>,
}

/// What layers are drawn on, one after the other.
pub(super) struct DrawnOn<'a> {
    /// Radiance and alpha.
    pub(super) texels: &'a wgpu::Buffer,
    /// Even light beyond all layers: horizontal irradiance.
    pub(super) behind: &'a Target,
    /// What of light from behind is held, where several layers are drawn together.
    pub(super) held: &'a wgpu::Buffer,
    /// Whether no layer is drawn between the viewer and this one.
    pub(super) first: bool,
}

/// What layers that are drawn together hold of light from behind, in each of `texels`: nothing yet.
pub(super) fn held(gpu: &Gpu, together: bool, texels: usize) -> wgpu::Buffer {
    gpu.storage("held", 4 * if together { texels } else { 1 })
}

/// A stage that was asked for before those that it takes from.
pub(super) fn early(what: &str) -> GpuError {
    GpuError::Failed(format!("{what} was shaded before its light"))
}

/// What every method's pass reads of a layer, in the order of its bindings. `view` is a [`View`] or a sky's, `shape` how
/// that looks at the layer's thickness.
pub(super) fn cloud_binds(
    gpu: &Gpu,
    layer: &LayerInputs<'_>,
    view: &wgpu::Buffer,
    shape: Vec<Bind>,
    from_above: bool,
    output: &DrawnOn<'_>,
) -> Option<Vec<Bind>> {
    let (tables, light) = (layer.tables?, layer.light?);
    let mut binds = binds![layer.frame, view];
    binds.extend(shape);
    binds.extend(binds![
        &tables.transmittance,
        &tables.reflectance,
        if output.first { &light.all_from_below } else { &light.from_below },
        &light.from_above[usize::from(from_above)],
        &light.share[usize::from(from_above)],
        &gpu.repeat,
        &gpu.clamp,
        output.texels,
        output.behind,
        output.held,
    ]);
    Some(binds)
}

/// A pass for each stratiform layer; the first is told that nothing lies before it, unless it is drawn `over` something. `None` where
/// something is missing.
pub(super) fn each<'a>(
    gpu: &Gpu,
    inputs: &'a Inputs<'a>,
    view: &View,
    over: bool,
    mut make: impl FnMut(&'a LayerInputs<'a>, &wgpu::Buffer) -> Option<(&'static Shader, Vec<Bind>)>,
) -> Option<Vec<Pass>> {
    let together = (inputs.layers.len() > 1).into();
    let views = [0, 1].map(|first| gpu.uniform("view", &View { first, together, ..*view }));
    let pass = |(i, layer): (usize, &'a LayerInputs<'a>)| {
        let (shader, binds) = make(layer, &views[usize::from(i == 0 && !over)])?;
        Some(Pass::new(shader, [view.size[0], view.rows], binds))
    };
    inputs.layers.iter().enumerate().map(pass).collect()
}
