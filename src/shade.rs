//! Stage `shade`: the textures that are asked for, from thickness, light and tables.

use crate::field::Field;
use crate::gpu::layout::View;
use crate::gpu::shaders::{self, Shader};
use crate::gpu::{Bind, Gpu, GpuError, Target};
use crate::light::Light;
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

/// What a texture is made from; not every texture needs all of it.
pub(crate) struct Inputs<'a> {
    pub(crate) frame: &'a wgpu::Buffer,
    pub(crate) exchange: &'a wgpu::Buffer,
    pub(crate) field: &'a Field,
    pub(crate) tables: Option<&'a DeviceTables>,
    pub(crate) method: Option<CloudMethod<'a>>,
    pub(crate) light: Option<&'a Light>,
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
    let count = view.size as usize * view.rows as usize * texture.channels().len();
    let output = gpu.storage("output", count);
    let view_uniform = gpu.uniform("view", view);
    let (frame, view_bind) = (Bind::Buffer(inputs.frame), Bind::Buffer(&view_uniform));
    let exchange = Bind::Buffer(inputs.exchange);
    let thickness = Bind::View(&inputs.field.thickness.view);
    let (repeat, clamp, out) = (Bind::Sampler(&gpu.repeat), Bind::Sampler(&gpu.clamp), Bind::Buffer(&output));
    let missing = || GpuError::Failed(format!("{} was shaded before its light", texture.name()));
    let (shader, binds): (&Shader, Vec<Bind<'_>>) = match texture {
        TextureKind::Thickness => (&shaders::THICKNESS, vec![frame, view_bind, thickness, repeat, out]),
        TextureKind::Shadow => (&shaders::SHADOW, vec![frame, view_bind, exchange, thickness, repeat, out]),
        TextureKind::Irradiance => {
            let (tables, light) = inputs.tables.zip(inputs.light).ok_or_else(missing)?;
            let transmittance = Bind::View(&tables.transmittance.view);
            let down = Bind::View(&light.down.view);
            let binds = vec![frame, view_bind, exchange, thickness, transmittance, down, repeat, clamp, out];
            (&shaders::IRRADIANCE, binds)
        }
        TextureKind::Cloud => {
            let (tables, light) = inputs.tables.zip(inputs.light).ok_or_else(missing)?;
            let mut binds = vec![
                frame,
                view_bind,
                thickness,
                Bind::View(&tables.transmittance.view),
                Bind::View(&tables.reflectance.view),
                Bind::View(&tables.phase.view),
                Bind::View(&light.upwelling.view),
                repeat,
                clamp,
                out,
            ];
            match inputs.method.ok_or_else(missing)? {
                CloudMethod::Analytic(closure) => {
                    binds.extend([Bind::View(&closure.view), Bind::View(&tables.aureole.view)]);
                    (&shaders::CLOUD_ANALYTIC, binds)
                }
                CloudMethod::Tabulated(slice) => {
                    binds.extend([
                        Bind::View(&slice.sides[1 - view.from_above as usize].view),
                        Bind::View(&tables.near_sun.view),
                        Bind::Sampler(&gpu.linear),
                        Bind::Buffer(&slice.remainder),
                    ]);
                    (&shaders::CLOUD_TABULATED, binds)
                }
            }
        }
    };
    gpu.run(texture.name(), deadline, |pass| gpu.dispatch(pass, shader, &binds, [view.size, view.rows]))?;
    gpu.read(&output, count, deadline)
}
