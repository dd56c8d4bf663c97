//! Stage `shade`: the textures that are asked for, from thickness, light and tables.

use crate::field::Field;
use crate::gpu::layout::View;
use crate::gpu::shaders::{self, Shader};
use crate::gpu::{Bind, Gpu, GpuError, Target};
use crate::light::LayerLight;
use crate::request::TextureKind;
use crate::slice::{DeviceSlice, DeviceTables};
use std::time::Instant;

/// What the methods of the cloud pass need.
#[derive(Clone, Copy)]
pub(crate) enum CloudMethod<'a> {
    /// The closure of the orders for this sun.
    Analytic(&'a Target),
    /// The radiance tables cut at this sun.
    Tabulated(&'a DeviceSlice),
}

/// A layer that a texture is made from; not every texture needs all of it.
pub(crate) struct LayerInputs<'a> {
    pub(crate) frame: &'a wgpu::Buffer,
    pub(crate) field: &'a Field,
    pub(crate) tables: Option<&'a DeviceTables>,
    pub(crate) method: Option<CloudMethod<'a>>,
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

/// Rows of a band of textures whose rays are cut `cuts` times each.
pub(crate) fn band_rows(size: u32, cuts: f64) -> u32 {
    let texels = BAND_TEXELS.min(BAND_CUTS / cuts.max(1.0));
    ((texels / f64::from(size)) as u32).clamp(1, size)
}

/// Makes one band of a texture: `view.rows` rows from `view.first_row`.
pub(crate) fn band(
    gpu: &Gpu,
    texture: TextureKind,
    inputs: &Inputs<'_>,
    view: &View,
    deadline: Option<Instant>,
) -> Result<Vec<f32>, GpuError> {
    let texels = view.size as usize * view.rows as usize;
    let count = texels * texture.channels().len();
    let output = gpu.storage("output", count);
    let views = [0, 1].map(|first| gpu.uniform("view", &View { first, ..*view }));
    let size = [view.size, view.rows];
    let missing = || GpuError::Failed(format!("{} was shaded before its light", texture.name()));
    let dispatches: Vec<(&Shader, Vec<Bind<'_>>)> = match texture {
        TextureKind::Thickness => each(&inputs.layers, &views, |layer, view| {
            let thickness = Bind::View(&layer.field.thickness.view);
            let binds =
                vec![Bind::Buffer(layer.frame), view, thickness, Bind::Sampler(&gpu.repeat), Bind::Buffer(&output)];
            Ok((&shaders::THICKNESS, binds))
        })?,
        TextureKind::Shadow | TextureKind::Irradiance => {
            let sun = [gpu.storage("beam", 4 * texels), gpu.storage("unscattered", 4 * texels)];
            let marches = each(&inputs.layers, &views, |layer, view| {
                Ok((&shaders::GROUND_SUN, ground_sun(gpu, layer, view, &sun).ok_or_else(missing)?))
            })?;
            let frame = Bind::Buffer(inputs.layers.first().ok_or_else(missing)?.frame);
            let mut binds = vec![frame, Bind::Buffer(&views[1]), Bind::Buffer(&sun[0]), Bind::Buffer(&sun[1])];
            let shader = if texture == TextureKind::Shadow { &shaders::SHADOW } else { &shaders::IRRADIANCE };
            if texture == TextureKind::Irradiance {
                let gathered = inputs.gathered.ok_or_else(missing)?;
                binds.extend([Bind::View(&gathered.view), Bind::Sampler(&gpu.repeat)]);
            }
            binds.push(Bind::Buffer(&output));
            gpu.run(texture.name(), deadline, |pass| {
                marches.iter().for_each(|(shader, binds)| gpu.dispatch(pass, shader, binds, size));
                gpu.dispatch(pass, shader, &binds, size);
            })?;
            return gpu.read(&output, count, deadline);
        }
        TextureKind::Cloud => each(&inputs.layers, &views, |layer, bound| {
            cloud(gpu, layer, bound, view.from_above == 1, &output).ok_or_else(missing)
        })?,
    };
    gpu.run(texture.name(), deadline, |pass| {
        dispatches.iter().for_each(|(shader, binds)| gpu.dispatch(pass, shader, binds, size));
    })?;
    gpu.read(&output, count, deadline)
}

/// A dispatch for each layer; the first is told that nothing lies before it.
fn each<'a, 'b>(
    layers: &'a [LayerInputs<'a>],
    views: &'b [wgpu::Buffer; 2],
    make: impl Fn(&'a LayerInputs<'a>, Bind<'b>) -> Result<(&'static Shader, Vec<Bind<'b>>), GpuError>,
) -> Result<Vec<(&'static Shader, Vec<Bind<'b>>)>, GpuError>
where
    'a: 'b,
{
    layers.iter().enumerate().map(|(i, layer)| make(layer, Bind::Buffer(&views[usize::from(i == 0)]))).collect()
}

fn ground_sun<'b>(
    gpu: &'b Gpu,
    layer: &'b LayerInputs<'b>,
    view: Bind<'b>,
    sun: &'b [wgpu::Buffer; 2],
) -> Option<Vec<Bind<'b>>> {
    Some(vec![
        Bind::Buffer(layer.frame),
        view,
        Bind::View(&layer.field.thickness.view),
        Bind::View(&layer.field.bounds.view),
        Bind::View(&layer.tables?.transmittance.view),
        Bind::Sampler(&gpu.repeat),
        Bind::Sampler(&gpu.clamp),
        Bind::Buffer(&sun[0]),
        Bind::Buffer(&sun[1]),
    ])
}

fn cloud<'b>(
    gpu: &'b Gpu,
    layer: &'b LayerInputs<'b>,
    view: Bind<'b>,
    from_above: bool,
    output: &'b wgpu::Buffer,
) -> Option<(&'static Shader, Vec<Bind<'b>>)> {
    let (tables, light) = layer.tables.zip(layer.light)?;
    let mut binds = vec![
        Bind::Buffer(layer.frame),
        view,
        Bind::View(&layer.field.thickness.view),
        Bind::View(&layer.field.bounds.view),
        Bind::View(&tables.transmittance.view),
        Bind::View(&tables.reflectance.view),
        Bind::View(&tables.phase.view),
        Bind::View(&light.from_below.view),
        Bind::View(&light.from_above.view),
        Bind::View(&light.share[usize::from(from_above)].view),
        Bind::Sampler(&gpu.repeat),
        Bind::Sampler(&gpu.clamp),
        Bind::Buffer(output),
    ];
    Some(match layer.method? {
        CloudMethod::Analytic(closure) => {
            binds.extend([Bind::View(&closure.view), Bind::View(&tables.aureole.view)]);
            (&shaders::CLOUD_ANALYTIC, binds)
        }
        CloudMethod::Tabulated(slice) => {
            binds.extend([
                Bind::View(&slice.sides[usize::from(!from_above)].view),
                Bind::View(&tables.near_sun.view),
                Bind::Sampler(&gpu.linear),
                Bind::Buffer(&slice.remainder),
            ]);
            (&shaders::CLOUD_TABULATED, binds)
        }
    })
}
