//! A thickness map on the device, and the passes that every field takes.

use super::transfer;
use crate::gpu::layout::{BOUNDS_TEXELS, Histogram};
use crate::gpu::{Gpu, GpuError, Pass, Target, binds, shaders};
use std::time::Instant;

/// A thickness map on the device.
pub(crate) struct Field {
    pub(crate) thickness: Target,
    /// Least and greatest thickness of blocks of texels.
    pub(crate) bounds: Target,
    /// Greatest thickness, metres.
    pub(crate) depth_m: f32,
    /// Greatest thickness at any time, metres: the height of the plane that views from above refer to.
    pub(crate) top_m: f32,
}

impl Field {
    /// A field of a map that lies on the device.
    pub(super) fn of(
        gpu: &Gpu,
        thickness: Target,
        greatest_m: f32,
        deadline: Option<Instant>,
    ) -> Result<Self, GpuError> {
        let bounds = bounds(gpu, &thickness);
        gpu.run("field_bounds", deadline, &[find_bounds(&thickness, &bounds)])?;
        Ok(Self { thickness, bounds, depth_m: greatest_m, top_m: greatest_m })
    }

    /// Whether the map is the same everywhere.
    pub(crate) fn is_uniform(&self) -> bool {
        self.thickness.width * self.thickness.height == 1
    }
}

/// Room for the bounds of a map's blocks.
pub(super) fn bounds(gpu: &Gpu, map: &Target) -> Target {
    gpu.texture("bounds", [map.width, map.height].map(|side| side.div_ceil(BOUNDS_TEXELS)), 2, 1)
}

pub(super) fn find_bounds(map: &Target, bounds: &Target) -> Pass {
    Pass::new(&shaders::FIELD_BOUNDS, [bounds.width, bounds.height], binds![map, &bounds.levels[0]])
}

/// Workgroups that count: enough for every core of a device, and few enough that adding up their bins costs little.
const COUNTING_GROUPS: u32 = 64;

/// Counts a field's values into zeroed bins.
pub(super) fn count(gpu: &Gpu, histogram: &Histogram, field: &wgpu::Buffer, bins: &wgpu::Buffer) -> Pass {
    let threads = COUNTING_GROUPS * shaders::FIELD_HISTOGRAM.workgroup[0];
    let binds = binds![&gpu.uniform("histogram", histogram), field, bins];
    Pass::new(&shaders::FIELD_HISTOGRAM, [threads, 1], binds)
}

pub(super) fn read_bins(gpu: &Gpu, bins: &wgpu::Buffer, deadline: Option<Instant>) -> Result<Vec<u32>, GpuError> {
    Ok(gpu.read(bins, transfer::BINS, deadline)?.into_iter().map(f32::to_bits).collect())
}
