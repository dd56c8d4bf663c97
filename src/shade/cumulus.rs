//! A layer of cumulus on the device, and its passes.

use crate::cumulus::lattice::Lattice;
use crate::cumulus::{Coarse, Relief, Volume};
use crate::gpu::layout::{Cumulus, View};
use crate::gpu::shaders::Shader;
use crate::gpu::{Bind, Gpu, Pass, binds, shaders, view_bytes};
use crate::light::Dressed;
use half::f16;
use std::sync::Arc;

/// Below this cosine between a view and the sun no ray towards the sun is followed: that of the shader, less what rounding may add.
const ASIDE: f32 = 0.819;

/// Where the cloud is.
pub(crate) struct CumulusField {
    pub(crate) host: Arc<Volume>,
    volume: wgpu::TextureView,
    leaps: wgpu::TextureView,
    relief: wgpu::TextureView,
}

impl CumulusField {
    /// Brings a volume to the device, where the noise is.
    pub(crate) fn new(gpu: &Gpu, host: Arc<Volume>, relief: wgpu::TextureView) -> Self {
        let size = |size: [usize; 3]| size.map(|n| n as u32);
        Self {
            volume: gpu.volume_from("cumulus", size(host.size), wgpu::TextureFormat::R8Unorm, &host.samples),
            leaps: gpu.volume_from("leaps", size(host.blocks), wgpu::TextureFormat::R8Uint, &host.leaps),
            relief,
            host,
        }
    }

    /// Bytes on the device, and as much on the host.
    pub(crate) fn size(&self) -> u64 {
        2 * (view_bytes(&self.volume) + view_bytes(&self.leaps))
    }

    /// Brings the noise to the device: the same for all fields.
    pub(crate) fn relief(gpu: &Gpu) -> wgpu::TextureView {
        let relief: Vec<f16> = Relief::samples().iter().map(|&value| f16::from_f32(value)).collect();
        gpu.volume_from("relief", [Relief::side() as u32; 3], wgpu::TextureFormat::R16Float, &relief)
    }
}

/// Its depth towards the sun.
pub(crate) struct SunDepth {
    /// As of the lattice.
    pub(crate) cell_m: f64,
    pub(crate) floor_m: f64,
    depths: wgpu::TextureView,
}

impl SunDepth {
    /// Bytes on the device.
    pub(crate) fn size(&self) -> u64 {
        view_bytes(&self.depths)
    }

    /// Brings that of a lattice to the device.
    pub(crate) fn new(gpu: &Gpu, host: &Lattice) -> Self {
        let size = host.size.map(|n| n as u32);
        let depths = gpu.volume_from("sun_depth", size, wgpu::TextureFormat::R16Float, &host.sun_depth);
        Self { cell_m: host.cell_m, floor_m: host.floor_m, depths }
    }
}

/// Its light, scattered many times.
pub(crate) struct CumulusLit {
    pub(crate) sun_depth: SunDepth,
    /// As of the lattice.
    pub(crate) added: [[f64; 3]; 2],
    pub(crate) below: [f64; 3],
    light: [wgpu::TextureView; 3],
    /// For other renderers.
    _host: Arc<Lattice>,
}

impl CumulusLit {
    /// Bytes on the device, and as much on the host.
    pub(crate) fn size(&self) -> u64 {
        2 * (self.light.iter().map(view_bytes).sum::<u64>() + self.sun_depth.size())
    }

    /// Brings a lattice to the device.
    pub(crate) fn new(gpu: &Gpu, host: Arc<Lattice>) -> Self {
        let size = host.size.map(|n| n as u32);
        let light = host
            .light
            .each_ref()
            .map(|light| gpu.volume_from("lattice", size, wgpu::TextureFormat::Rgba16Float, light));
        Self { sun_depth: SunDepth::new(gpu, &host), added: host.added, below: host.below, light, _host: host }
    }
}

/// Normals of the surface that its blobs stand out of.
pub(crate) struct CoarseNormals {
    /// As of the host's.
    pub(crate) cell_m: f64,
    pub(crate) floor_m: f64,
    normals: wgpu::TextureView,
}

impl CoarseNormals {
    /// Bytes on the device.
    pub(crate) fn size(&self) -> u64 {
        view_bytes(&self.normals)
    }

    /// Brings them to the device; one cube without a surface where no light is trapped.
    pub(crate) fn new(gpu: &Gpu, host: Option<&Coarse>) -> Self {
        let none = Coarse::none();
        let host = host.unwrap_or(&none);
        let texels: Vec<[f16; 4]> = host.normals.iter().map(|&[x, y, z]| [x, y, z, 0.0].map(f16::from_f32)).collect();
        let size = host.size.map(|n| n as u32);
        let normals = gpu.volume_from("coarse", size, wgpu::TextureFormat::Rgba16Float, &texels);
        Self { cell_m: host.cell_m, floor_m: host.floor_m, normals }
    }
}

/// What its light is computed from, by method.
pub(crate) enum CumulusLight {
    Lattice(Arc<CumulusLit>, Arc<Dressed>),
    Octaves(Arc<SunDepth>),
    Forward,
    /// Constants of the shader, and whether it is that of 2000.
    Surface {
        coarse: Arc<CoarseNormals>,
        constants: wgpu::Buffer,
        oldest: bool,
    },
}

impl CumulusLight {
    fn binds(&self, gpu: &Gpu) -> Vec<Bind> {
        match self {
            Self::Lattice(lit, dressed) => {
                let [red, green, blue] = &lit.light;
                binds![&lit.sun_depth.depths, red, green, blue, dressed.view(), &gpu.linear]
            }
            Self::Octaves(sun_depth) => binds![&sun_depth.depths],
            Self::Forward => Vec::new(),
            Self::Surface { coarse, constants, .. } => binds![constants, &coarse.normals],
        }
    }

    /// On the plane of the texture cloud; where all rays look aside from the sun, none needs rays towards it.
    fn plane(&self, aside: bool) -> &'static Shader {
        match self {
            Self::Lattice(..) if aside => &shaders::CUMULUS_PLANE_LATTICE_ASIDE,
            Self::Lattice(..) => &shaders::CUMULUS_PLANE_LATTICE,
            Self::Octaves(_) if aside => &shaders::CUMULUS_PLANE_OCTAVES_ASIDE,
            Self::Octaves(_) => &shaders::CUMULUS_PLANE_OCTAVES,
            Self::Forward => &shaders::CUMULUS_PLANE_FORWARD,
            Self::Surface { oldest: false, .. } => &shaders::CUMULUS_PLANE_SHADER,
            Self::Surface { oldest: true, .. } => &shaders::CUMULUS_PLANE_SHADER3,
        }
    }

    /// In the texture sky.
    fn sky(&self) -> &'static Shader {
        match self {
            Self::Lattice(..) => &shaders::CUMULUS_SKY_LATTICE,
            Self::Octaves(_) => &shaders::CUMULUS_SKY_OCTAVES,
            Self::Forward => &shaders::CUMULUS_SKY_FORWARD,
            Self::Surface { oldest: false, .. } => &shaders::CUMULUS_SKY_SHADER,
            Self::Surface { oldest: true, .. } => &shaders::CUMULUS_SKY_SHADER3,
        }
    }
}

/// A layer that a texture shows.
pub(crate) struct CumulusInputs {
    /// As the passes take it.
    pub(crate) frame: Cumulus,
    pub(crate) bound: wgpu::Buffer,
    pub(crate) field: Arc<CumulusField>,
    /// Where it is seen.
    pub(crate) seen: Option<CumulusLight>,
}

impl CumulusInputs {
    /// What every pass reads.
    fn shape(&self, gpu: &Gpu) -> Vec<Bind> {
        let CumulusField { volume, leaps, relief, .. } = &*self.field;
        binds![&self.bound, volume, leaps, relief, &gpu.around, &gpu.tiling]
    }

    /// What passes read that show it; `None` without its light.
    fn light(&self, gpu: &Gpu) -> Option<(&CumulusLight, Vec<Bind>)> {
        let light = self.seen.as_ref()?;
        let mut binds = self.shape(gpu);
        binds.extend(light.binds(gpu));
        Some((light, binds))
    }

    /// The shader that shows it in the texture sky, and what it reads first.
    pub(super) fn on_sky(&self, gpu: &Gpu) -> Option<(&'static Shader, Vec<Bind>)> {
        self.light(gpu).map(|(light, binds)| (light.sky(), binds))
    }

    /// Its part in the texture cloud.
    pub(super) fn on_plane(&self, gpu: &Gpu, view: &View, output: &wgpu::Buffer, held: &wgpu::Buffer) -> Option<Pass> {
        let (light, mut binds) = self.light(gpu)?;
        binds.extend(binds![&gpu.uniform("view", view), output, held]);
        let cosine: f32 = view.towards.iter().zip(&self.frame.sun).map(|(seen, sun)| -seen * sun).sum();
        let aside = view.perspective == 0 && cosine < ASIDE;
        Some(Pass::new(light.plane(aside), [view.size[0], view.rows], binds))
    }

    /// Its part in what is on the ground, or in the texture thickness.
    pub(super) fn below(&self, gpu: &Gpu, shader: &'static Shader, view: &View, outputs: &[&wgpu::Buffer]) -> Pass {
        let mut binds = self.shape(gpu);
        binds.extend(binds![&gpu.uniform("view", view)]);
        binds.extend(outputs.iter().map(|output| Bind::from(*output)));
        Pass::new(shader, [view.size[0], view.rows], binds)
    }
}
