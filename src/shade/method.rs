//! Methods of slab light on the device: what each keeps for one droplet mix and one sun, and its shader.

use crate::field::Field;
use crate::gpu::shaders::{self, Shader};
use crate::gpu::{Bind, Gpu, Target, binds};
use crate::slice::{self, DeviceSlice, DeviceTables, HostSlab};
use std::sync::Arc;

/// A method, made for one droplet mix and one sun. Clones are the same.
#[derive(Clone)]
pub(crate) enum SlabLight {
    /// The veil.
    Forward(Arc<Target>),
    /// The closure of the orders.
    Analytic(Arc<Target>),
    /// The radiance tables cut at the sun.
    Tabulated(Arc<DeviceSlice>),
}

impl SlabLight {
    /// Brings what a method keeps to the device.
    pub(crate) fn new(gpu: &Gpu, host: &HostSlab) -> Self {
        match host {
            HostSlab::Forward(veil) => Self::Forward(Arc::new(slice::upload(gpu, "veil", veil))),
            HostSlab::Analytic(closure) => Self::Analytic(Arc::new(slice::upload(gpu, "closure", closure))),
            HostSlab::Tabulated(slice) => Self::Tabulated(Arc::new(DeviceSlice::new(gpu, slice))),
        }
    }

    /// The shader of slabs of all depths in a parallel view.
    pub(crate) fn slabs_shader(&self) -> &'static Shader {
        match self {
            Self::Forward(_) => &shaders::SLABS_FORWARD,
            Self::Analytic(_) => &shaders::SLABS_ANALYTIC,
            Self::Tabulated(_) => &shaders::SLABS_TABULATED,
        }
    }

    /// The shader of clouds that an eye sees.
    pub(crate) fn shader(&self, field: &Field) -> &'static Shader {
        field.shader(match self {
            Self::Forward(_) => [&shaders::CLOUD_FORWARD, &shaders::CLOUD_FORWARD_COLUMNS],
            Self::Analytic(_) => [&shaders::CLOUD_ANALYTIC, &shaders::CLOUD_ANALYTIC_COLUMNS],
            Self::Tabulated(_) => [&shaders::CLOUD_TABULATED, &shaders::CLOUD_TABULATED_COLUMNS],
        })
    }

    /// The same where the sun's light is that of a lattice along the view ray.
    pub(crate) fn lattice_shader(&self, field: &Field) -> &'static Shader {
        field.shader(match self {
            Self::Forward(_) => [&shaders::LATTICE_FORWARD, &shaders::LATTICE_FORWARD_COLUMNS],
            Self::Analytic(_) => [&shaders::LATTICE_ANALYTIC, &shaders::LATTICE_ANALYTIC_COLUMNS],
            Self::Tabulated(_) => [&shaders::LATTICE_TABULATED, &shaders::LATTICE_TABULATED_COLUMNS],
        })
    }

    /// The shader of the clouds of a sky.
    pub(crate) fn sky_shader(&self, field: &Field) -> &'static Shader {
        field.shader(match self {
            Self::Forward(_) => [&shaders::SKY_FORWARD, &shaders::SKY_FORWARD_COLUMNS],
            Self::Analytic(_) => [&shaders::SKY_ANALYTIC, &shaders::SKY_ANALYTIC_COLUMNS],
            Self::Tabulated(_) => [&shaders::SKY_TABULATED, &shaders::SKY_TABULATED_COLUMNS],
        })
    }

    /// The same where the sun's light is that of a lattice along the view ray.
    pub(crate) fn sky_lattice_shader(&self, field: &Field) -> &'static Shader {
        field.shader(match self {
            Self::Forward(_) => [&shaders::SKY_LATTICE_FORWARD, &shaders::SKY_LATTICE_FORWARD_COLUMNS],
            Self::Analytic(_) => [&shaders::SKY_LATTICE_ANALYTIC, &shaders::SKY_LATTICE_ANALYTIC_COLUMNS],
            Self::Tabulated(_) => [&shaders::SKY_LATTICE_TABULATED, &shaders::SKY_LATTICE_TABULATED_COLUMNS],
        })
    }

    /// What the shader reads beside what all methods do.
    pub(crate) fn binds(&self, gpu: &Gpu, tables: &DeviceTables, from_above: bool) -> Vec<Bind> {
        match self {
            Self::Forward(veil) => binds![&**veil, &tables.phase],
            Self::Analytic(closure) => binds![&**closure, &tables.aureole, &tables.phase],
            Self::Tabulated(slice) => {
                let side = &slice.sides[usize::from(!from_above)];
                binds![side, &tables.near_sun, &gpu.linear, &slice.remainder, &tables.phase]
            }
        }
    }
}
