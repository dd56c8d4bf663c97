//! The lattice of a layer on the device, as view rays read it.

use super::lattice::LatticeMaps;
use crate::cumulus::dressed::{ANGLES, PATHS};
use crate::gpu::layout::LatticeLight;
use crate::gpu::{Bind, Gpu, binds, view_bytes};
use half::f16;
use std::sync::Arc;

/// Light that droplets scatter once: see [`crate::cumulus::dressed::tables`].
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

    /// The texture.
    pub(crate) fn view(&self) -> &wgpu::TextureView {
        &self.0
    }
}

/// A lattice, and what of it is on the device.
pub(crate) struct LatticeLit {
    pub(crate) maps: Arc<LatticeMaps>,
    within: wgpu::TextureView,
    depths: wgpu::TextureView,
    slabs: wgpu::TextureView,
    dressed: Arc<Dressed>,
}

impl LatticeLit {
    /// Brings a lattice to the device.
    pub(crate) fn new(gpu: &Gpu, maps: Arc<LatticeMaps>, dressed: Arc<Dressed>) -> Self {
        let size = |[x, y, z]: [usize; 3]| [x as u32, y as u32, z as u32];
        let [nx, ny, nz] = maps.size;
        let stacked = size([nx, ny, 2 * nz]);
        let lines = size(maps.depths.size);
        let within = gpu.volume_from("lattice", stacked, wgpu::TextureFormat::Rgba16Float, &maps.within);
        let depths = gpu.volume_from("sun_depths", lines, wgpu::TextureFormat::R16Float, &maps.depths.depths);
        let slabs = gpu.half_from("slabs", maps.slabs_size.map(|n| n as u32), &maps.slabs);
        Self { maps, within, depths, slabs, dressed }
    }
}

impl LatticeLit {
    /// Bytes on the device, and as much on the host.
    pub(crate) fn size(&self) -> u64 {
        let Self { within, depths, slabs, .. } = self;
        2 * [within, depths, slabs].map(view_bytes).iter().sum::<u64>()
    }
}

/// How a view ray reads the sun's light of a layer.
pub(crate) struct LatticeSeen {
    lit: Arc<LatticeLit>,
    light: wgpu::Buffer,
}

impl LatticeSeen {
    /// `in_air`: what air within the layer leaves of light that comes through it.
    pub(crate) fn new(gpu: &Gpu, lit: Arc<LatticeLit>, in_air: [f32; 3]) -> Self {
        let light = gpu.uniform("lattice", &LatticeLight { in_air, ..lit.maps.light });
        Self { lit, light }
    }

    /// Bytes of the lattice.
    pub(crate) fn size(&self) -> u64 {
        self.lit.size()
    }

    /// What the pass reads beside what it does without a lattice.
    pub(crate) fn binds(&self, gpu: &Gpu) -> Vec<Bind> {
        let LatticeLit { within, depths, slabs, dressed, .. } = &*self.lit;
        binds![&self.light, within, depths, slabs, dressed.view(), &gpu.around, &gpu.linear]
    }
}
