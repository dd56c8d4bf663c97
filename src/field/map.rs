//! A layer's map on the device, and the passes that every field takes.

use super::columns::ColumnMap;
use super::transfer;
use crate::gpu::layout::{BOUNDS_TEXELS, Histogram};
use crate::gpu::shaders::Shader;
use crate::gpu::{Gpu, GpuError, Pass, Target, binds, shaders};
use crate::scene::ExtinctionProfile;
use std::time::Instant;

/// A layer's map on the device: of its thickness over a flat base, or of columns.
pub(crate) struct Field {
    /// Thickness; or, where it is [`Field::ragged`], what `shaders/shared/columns.wgsl` tells.
    pub(crate) thickness: Target,
    /// Least and greatest thickness of blocks of texels, or lowest base and highest top.
    pub(crate) bounds: Target,
    /// Whether columns have bases, tops and extinctions of their own.
    pub(crate) ragged: bool,
    /// How extinction changes in them.
    profile: ExtinctionProfile,
    /// Height of the base plane above the ground, metres: no base is lower.
    pub(crate) base_m: f64,
    /// Mean height of the bases, metres.
    pub(crate) mean_base_m: f64,
    /// Mean extinction of the cloudy columns, relative to the droplets'.
    pub(crate) density: f64,
    /// Greatest height above the base plane, metres.
    pub(crate) depth_m: f32,
    /// The same at any time, metres: the height of the plane that views from above refer to.
    pub(crate) top_m: f32,
    /// From the lowest base to the highest top at any time, metres, at most.
    pub(crate) room_m: f32,
}

/// How columns stand between their edges.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stands {
    /// Whether they hang from a flat top.
    pub(super) hangs: bool,
    pub(super) profile: ExtinctionProfile,
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
        Ok(Self::sheet(thickness, bounds, greatest_m, greatest_m))
    }

    /// A thickness over a flat base, on the ground.
    pub(super) fn sheet(thickness: Target, bounds: Target, depth_m: f32, top_m: f32) -> Self {
        let (base_m, mean_base_m) = (0.0, 0.0);
        let profile = ExtinctionProfile::Uniform;
        Self {
            thickness,
            bounds,
            ragged: false,
            profile,
            base_m,
            mean_base_m,
            density: 1.0,
            depth_m,
            top_m,
            room_m: top_m,
        }
    }

    /// The same over a base at some height.
    pub(super) fn on(self, base_m: f64) -> Self {
        Self { base_m, mean_base_m: base_m + self.mean_base_m, ..self }
    }

    /// Columns that a pass makes, whose mean base lies `lift_m` above the base plane; on the ground.
    pub(super) fn made_columns(
        gpu: &Gpu,
        columns: Target,
        pass: Pass,
        depth_m: f32,
        lift_m: f64,
        profile: ExtinctionProfile,
        deadline: Option<Instant>,
    ) -> Result<Self, GpuError> {
        let bounds = bounds(gpu, &columns);
        gpu.run("field_columns", deadline, &[pass, find_column_bounds(&columns, &bounds)])?;
        let (base_m, density, top_m) = (0.0, 1.0, depth_m);
        Ok(Self {
            thickness: columns,
            bounds,
            ragged: true,
            profile,
            base_m,
            mean_base_m: lift_m,
            density,
            depth_m,
            top_m,
            room_m: depth_m,
        })
    }

    /// The thickness hung down from a flat top, or columns that hang from it already; `mean_m` is that of the cloudy part.
    pub(super) fn hung(
        self,
        gpu: &Gpu,
        top_m: f64,
        mean_m: f64,
        profile: ExtinctionProfile,
        deadline: Option<Instant>,
    ) -> Result<Self, GpuError> {
        let (base_m, mean_base_m) = (top_m - f64::from(self.depth_m), top_m - mean_m);
        let top_m = self.depth_m;
        let columns = if self.ragged { self } else { self.columns(gpu, [top_m, 1.0], profile, deadline)? };
        Ok(Self { base_m, mean_base_m, top_m, ..columns })
    }

    /// The same with a profile: where extinction changes with height a thickness is not enough.
    pub(super) fn with(
        self,
        gpu: &Gpu,
        profile: ExtinctionProfile,
        deadline: Option<Instant>,
    ) -> Result<Self, GpuError> {
        if self.ragged || profile == ExtinctionProfile::Uniform {
            return Ok(self);
        }
        self.columns(gpu, [0.0, 0.0], profile, deadline)
    }

    /// The columns of a thickness. `hang`: height of a flat top above the base plane, and 1 where they hang from it.
    fn columns(
        self,
        gpu: &Gpu,
        hang: [f32; 2],
        profile: ExtinctionProfile,
        deadline: Option<Instant>,
    ) -> Result<Self, GpuError> {
        let columns = gpu.texture("columns", [self.thickness.width, self.thickness.height], 4, 1);
        let law = gpu.texture_from("law", [1, 1], 4, &[hang[0], hang[1], profile.on_device() as f32, 0.0]);
        let binds = binds![&self.thickness, &law, &columns.levels[0]];
        let bounds = bounds(gpu, &columns);
        let pass = Pass::new(&shaders::FIELD_HANG, [columns.width, columns.height], binds);
        gpu.run("field_hang", deadline, &[pass, find_column_bounds(&columns, &bounds)])?;
        Ok(Self { thickness: columns, bounds, ragged: true, profile, ..self })
    }

    /// A field of columns.
    pub(super) fn of_columns(gpu: &Gpu, map: &ColumnMap, deadline: Option<Instant>) -> Result<Self, GpuError> {
        let columns = gpu.texture_from("columns", map.size, 4, map.texels.as_flattened());
        let bounds = bounds(gpu, &columns);
        gpu.run("field_bounds", deadline, &[find_column_bounds(&columns, &bounds)])?;
        let depth_m = map.depth_m as f32;
        let (base_m, [mean_base_m, _], density) = (map.base_m, map.mean_m, map.density);
        let profile = map.profile;
        Ok(Self {
            thickness: columns,
            bounds,
            ragged: true,
            profile,
            base_m,
            mean_base_m,
            density,
            depth_m,
            top_m: depth_m,
            room_m: depth_m,
        })
    }

    /// The one of two shaders that reads this kind of map.
    pub(crate) fn shader(&self, [sheet, columns]: [&'static Shader; 2]) -> &'static Shader {
        match (self.ragged, self.profile) {
            (false, _) => sheet,
            (true, ExtinctionProfile::Uniform) => columns,
            (true, ExtinctionProfile::Adiabatic) => columns.growing(),
        }
    }

    /// Bytes on the device.
    pub(crate) fn size(&self) -> u64 {
        self.thickness.size() + self.bounds.size()
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

fn find_column_bounds(map: &Target, bounds: &Target) -> Pass {
    Pass::new(&shaders::FIELD_BOUNDS_COLUMNS, [bounds.width, bounds.height], binds![map, &bounds.levels[0]])
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
