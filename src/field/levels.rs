//! Mip levels of a layer's map, for views from which many of its texels are one of the picture, or of which a ray crosses many.

use super::map::Field;
use crate::gpu::layout::BOUNDS_TEXELS;
use crate::gpu::{Gpu, GpuError, Pass, Target, binds, shaders};
use std::time::Instant;

/// Blocks of bounds are up to so many times as wide as the least, as a power of two: 64 texels.
const BOUNDS_DOUBLED: u32 = 3;

/// A layer's map and its bounds with mip levels.
pub(crate) struct Levels {
    /// Means, so that all cloud is kept. A map of one texel is its own.
    pub(crate) map: Target,
    /// Ends of all that is in a block of texels, as long as blocks come in pairs.
    pub(crate) bounds: Target,
}

impl Levels {
    /// Bytes on the device.
    pub(crate) fn size(&self) -> u64 {
        self.map.size() + self.bounds.size()
    }
}

/// The levels of a field.
pub(crate) fn levels(gpu: &Gpu, field: &Field, deadline: Option<Instant>) -> Result<Levels, GpuError> {
    let thickness = &field.thickness;
    let size = [thickness.width, thickness.height];
    if size == [1; 2] {
        return Ok(Levels { map: thickness.clone(), bounds: field.bounds.clone() });
    }
    let levels = size[0].max(size[1]).ilog2() + 1;
    let map = gpu.texture("levels", size, if field.ragged { 4 } else { 1 }, levels);
    let sources = std::iter::once(&thickness.levels[0]).chain(&map.levels);
    let pass = |(level, (from, to)): (usize, (&wgpu::TextureView, &wgpu::TextureView))| {
        Pass::new(
            field.shader([&shaders::FIELD_LEVEL, &shaders::FIELD_LEVEL_COLUMNS]),
            map.level_size(level),
            binds![from, to],
        )
    };
    let mut passes: Vec<Pass> = sources.zip(&map.levels).enumerate().map(pass).collect();
    let blocks = [field.bounds.width, field.bounds.height];
    let even = size.iter().all(|side| side % BOUNDS_TEXELS == 0);
    let doubled = if even { (blocks[0] | blocks[1]).trailing_zeros().min(BOUNDS_DOUBLED) } else { 0 };
    let bounds = gpu.texture("bounds", blocks, 2, doubled + 1);
    let least = field.shader([&shaders::FIELD_BOUNDS, &shaders::FIELD_BOUNDS_COLUMNS]);
    passes.push(Pass::new(least, blocks, binds![thickness, &bounds.levels[0]]));
    for (level, pair) in (1..).zip(bounds.levels.windows(2)) {
        passes.push(Pass::new(&shaders::FIELD_BOUNDS_LEVEL, bounds.level_size(level), binds![&pair[0], &pair[1]]));
    }
    gpu.run("levels", deadline, &passes)?;
    Ok(Levels { map, bounds })
}
