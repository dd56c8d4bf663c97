//! Methods of slab light: what each keeps for one droplet mix and one sun, and its shader.

use crate::gpu::shaders::{self, Shader};
use crate::gpu::{Bind, Gpu, Target, binds};
use crate::plan::SlabMethod;
use crate::slice::{self, DeviceSlice, DeviceTables, HostSlice};
use crate::tables::MixTables;
use std::sync::Arc;

/// A method, made for one droplet mix and one sun. Clones are the same.
#[derive(Clone)]
pub(crate) enum SlabLight {
    /// The closure of the orders.
    Analytic(Arc<Target>),
    /// The radiance tables cut at the sun.
    Tabulated(Arc<DeviceSlice>),
}

impl SlabLight {
    /// Makes a method's textures. `ratio`: extinctions relative to that at 550 nm; `cosine` of the sun's zenith. Radiance tables
    /// are made here if nobody made them before.
    pub(crate) fn make(gpu: &Gpu, method: SlabMethod, tables: &MixTables, ratio: [f64; 3], cosine: f64) -> Self {
        match method {
            SlabMethod::Analytic => {
                let closure = slice::closure(tables, ratio, cosine);
                Self::Analytic(Arc::new(slice::upload(gpu, "closure", &closure)))
            }
            SlabMethod::Tabulated(detail) => {
                let slice = HostSlice::new(&tables.radiance(detail, &|_| ()), ratio, cosine);
                Self::Tabulated(Arc::new(DeviceSlice::new(gpu, &slice)))
            }
        }
    }

    /// The shader of the cloud pass.
    pub(crate) fn shader(&self) -> &'static Shader {
        match self {
            Self::Analytic(_) => &shaders::CLOUD_ANALYTIC,
            Self::Tabulated(_) => &shaders::CLOUD_TABULATED,
        }
    }

    /// The shader of the clouds of a sky.
    pub(crate) fn sky_shader(&self) -> &'static Shader {
        match self {
            Self::Analytic(_) => &shaders::SKY_ANALYTIC,
            Self::Tabulated(_) => &shaders::SKY_TABULATED,
        }
    }

    /// What the shader reads beside what all methods do.
    pub(crate) fn binds(&self, gpu: &Gpu, tables: &DeviceTables, from_above: bool) -> Vec<Bind> {
        match self {
            Self::Analytic(closure) => binds![&**closure, &tables.aureole],
            Self::Tabulated(slice) => {
                let side = &slice.sides[usize::from(!from_above)];
                binds![side, &tables.near_sun, &gpu.linear, &slice.remainder]
            }
        }
    }
}
