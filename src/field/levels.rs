//! Mip levels of a layer's map, for views from which many of its texels are one of the picture.

use super::map::Field;
use crate::gpu::{Gpu, GpuError, Pass, Target, binds, shaders};
use std::time::Instant;

/// The map with every mip level: means, so that all cloud is kept. A map of one texel is its own.
pub(crate) fn levels(gpu: &Gpu, field: &Field, deadline: Option<Instant>) -> Result<Target, GpuError> {
    let thickness = &field.thickness;
    let size = [thickness.width, thickness.height];
    if size == [1; 2] {
        return Ok(thickness.clone());
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
    let passes: Vec<Pass> = sources.zip(&map.levels).enumerate().map(pass).collect();
    gpu.run("levels", deadline, &passes)?;
    Ok(map)
}
