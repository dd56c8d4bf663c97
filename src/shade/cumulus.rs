//! A layer of cumulus on the device, and its passes.

use crate::cumulus::dressed::{ANGLES, PATHS};
use crate::cumulus::lattice::Lattice;
use crate::cumulus::{Relief, Volume};
use crate::gpu::layout::{Cumulus, View};
use crate::gpu::shaders::Shader;
use crate::gpu::{Bind, Gpu, Pass, binds, shaders};
use half::f16;
use std::sync::Arc;

/// Where the cloud is.
pub(crate) struct CumulusField {
    pub(crate) host: Volume,
    volume: wgpu::TextureView,
    leaps: wgpu::TextureView,
    relief: wgpu::TextureView,
}

impl CumulusField {
    /// Brings a volume to the device, where the noise is.
    pub(crate) fn new(gpu: &Gpu, host: Volume, relief: wgpu::TextureView) -> Self {
        let size = |size: [usize; 3]| size.map(|n| n as u32);
        Self {
            volume: gpu.volume_from("cumulus", size(host.size), wgpu::TextureFormat::R8Unorm, &host.samples),
            leaps: gpu.volume_from("leaps", size(host.blocks), wgpu::TextureFormat::R8Uint, &host.leaps),
            relief,
            host,
        }
    }

    /// Brings the noise to the device: the same for all fields.
    pub(crate) fn relief(gpu: &Gpu) -> wgpu::TextureView {
        let relief: Vec<f16> = Relief::samples().iter().map(|&value| f16::from_f32(value)).collect();
        gpu.volume_from("relief", [Relief::side() as u32; 3], wgpu::TextureFormat::R16Float, &relief)
    }
}

/// Its light, scattered many times.
pub(crate) struct CumulusLit {
    /// As of the lattice.
    pub(crate) cell_m: f64,
    pub(crate) floor_m: f64,
    pub(crate) added: [[f64; 3]; 2],
    light: [wgpu::TextureView; 3],
    sun_depth: wgpu::TextureView,
}

impl CumulusLit {
    /// Brings a lattice to the device.
    pub(crate) fn new(gpu: &Gpu, host: &Lattice) -> Self {
        let size = host.size.map(|n| n as u32);
        let light = host
            .light
            .each_ref()
            .map(|light| gpu.volume_from("lattice", size, wgpu::TextureFormat::Rgba16Float, light));
        let sun_depth = gpu.volume_from("sun_depth", size, wgpu::TextureFormat::R16Float, &host.sun_depth);
        Self { cell_m: host.cell_m, floor_m: host.floor_m, added: host.added, light, sun_depth }
    }
}

/// Light that its droplets scatter once: see [`crate::cumulus::dressed::table`].
pub(crate) struct Dressed(wgpu::TextureView);

impl Dressed {
    /// Brings the tables of red, green, blue to the device.
    pub(crate) fn new(gpu: &Gpu, tables: &[Vec<f64>; 3]) -> Self {
        let half = |value: f64| f16::from_f64(value.clamp(0.0, 65504.0));
        let texel = |i: usize| [half(tables[0][i]), half(tables[1][i]), half(tables[2][i]), f16::ZERO];
        let texels: Vec<[f16; 4]> = (0..ANGLES * PATHS).map(texel).collect();
        let size = [ANGLES as u32, PATHS as u32];
        Self(gpu.half_from("dressed", size, &texels))
    }
}

/// A layer that a texture shows.
pub(crate) struct CumulusInputs {
    /// As the passes take it.
    pub(crate) frame: Cumulus,
    pub(crate) bound: wgpu::Buffer,
    pub(crate) field: Arc<CumulusField>,
    /// Where it is seen.
    pub(crate) seen: Option<(Arc<CumulusLit>, Arc<Dressed>)>,
}

impl CumulusInputs {
    /// What every pass reads.
    fn shape(&self, gpu: &Gpu) -> Vec<Bind> {
        let CumulusField { volume, leaps, relief, .. } = &*self.field;
        binds![&self.bound, volume, leaps, relief, &gpu.around, &gpu.tiling]
    }

    /// What passes read that show it; `None` without its light.
    pub(super) fn light(&self, gpu: &Gpu) -> Option<Vec<Bind>> {
        let (lit, dressed) = self.seen.as_ref()?;
        let mut binds = self.shape(gpu);
        let [red, green, blue] = &lit.light;
        binds.extend(binds![red, green, blue, &lit.sun_depth, &dressed.0, &gpu.linear]);
        Some(binds)
    }

    /// Its part in the texture cloud.
    pub(super) fn on_plane(&self, gpu: &Gpu, view: &View, output: &wgpu::Buffer, held: &wgpu::Buffer) -> Option<Pass> {
        let mut binds = self.light(gpu)?;
        binds.extend(binds![&gpu.uniform("view", view), output, held]);
        Some(Pass::new(&shaders::CUMULUS_PLANE, [view.size[0], view.rows], binds))
    }

    /// Its part in what is on the ground, or in the texture thickness.
    pub(super) fn below(&self, gpu: &Gpu, shader: &'static Shader, view: &View, outputs: &[&wgpu::Buffer]) -> Pass {
        let mut binds = self.shape(gpu);
        binds.extend(binds![&gpu.uniform("view", view)]);
        binds.extend(outputs.iter().map(|output| Bind::from(*output)));
        Pass::new(shader, [view.size[0], view.rows], binds)
    }
}
