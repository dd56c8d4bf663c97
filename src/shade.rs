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
    let count = 4 * view.size as usize * view.rows as usize;
    let sun = GroundSun { beam: gpu.storage("beam", count), unscattered: gpu.storage("unscattered", count) };
    let views = uniforms(gpu, view);
    let dispatches = each(&inputs.layers, &views, |layer, view| {
        let tables =
            layer.tables.ok_or_else(|| GpuError::Failed("the sun was followed before its tables".to_owned()))?;
        let binds = vec![
            Bind::Buffer(layer.frame),
            view,
            Bind::View(&layer.field.thickness.view),
            Bind::View(&layer.field.bounds.view),
            Bind::View(&tables.transmittance.view),
            Bind::Sampler(&gpu.repeat),
            Bind::Sampler(&gpu.clamp),
            Bind::Buffer(&sun.beam),
            Bind::Buffer(&sun.unscattered),
        ];
        Ok((&shaders::GROUND_SUN, binds))
    })?;
    gpu.run("ground_sun", deadline, |pass| {
        dispatches.iter().for_each(|(shader, binds)| gpu.dispatch(pass, shader, binds, [view.size, view.rows]));
    })?;
    Ok(sun)
}

/// Uniforms of a view: for layers behind others, and for the first.
fn uniforms(gpu: &Gpu, view: &View) -> [wgpu::Buffer; 2] {
    [0, 1].map(|first| gpu.uniform("view", &View { first, ..*view }))
}

/// Whether a texture is made from what the layers leave of the beam on the ground.
pub(crate) fn is_on_the_ground(texture: TextureKind) -> bool {
    matches!(texture, TextureKind::Shadow | TextureKind::Irradiance)
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
    let texels = view.size as usize * view.rows as usize;
    let count = texels * texture.channels().len();
    let output = gpu.storage("output", count);
    let views = uniforms(gpu, view);
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
            let sun = sun.ok_or_else(missing)?;
            let frame = Bind::Buffer(inputs.layers.first().ok_or_else(missing)?.frame);
            let mut binds =
                vec![frame, Bind::Buffer(&views[1]), Bind::Buffer(&sun.beam), Bind::Buffer(&sun.unscattered)];
            let shader = if texture == TextureKind::Shadow { &shaders::SHADOW } else { &shaders::IRRADIANCE };
            if texture == TextureKind::Irradiance {
                let gathered = inputs.gathered.ok_or_else(missing)?;
                binds.extend([Bind::View(&gathered.view), Bind::Sampler(&gpu.repeat)]);
            }
            binds.push(Bind::Buffer(&output));
            vec![(shader, binds)]
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
