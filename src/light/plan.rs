//! How fine the exchange grid is, and where its rings lie.

use crate::gpu::layout::{Exchange, Frame};

/// Weights of the four rings: least squares against the exact kernel, four bilinear taps a ring. Their sum is 1.
const RING_WEIGHTS: [f32; 4] = [0.189, 0.429, 0.255, 0.127];
/// Grid texels a side, at least where anything varies, and at most.
const TEXELS: [u32; 2] = [16, 1024];
/// Samples a side of the thickness map in one texel, at most.
const MAX_SAMPLES: u32 = 4;

/// The exchange grid of a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct GridPlan {
    /// Texels a side, a power of two.
    pub(crate) texels: u32,
    /// Samples a side of the thickness map in one texel.
    pub(crate) samples: u32,
}

/// Plans the grid: one texel where nothing varies, otherwise so many per height of the base, over which light between
/// the planes is smooth, but no finer than what varies (`detail`: texels a side of the finest map).
pub(crate) fn grid_plan(extent_m: f64, base_m: f64, texels_per_height: f64, uniform: bool, detail: u32) -> GridPlan {
    if uniform {
        return GridPlan { texels: 1, samples: 1 };
    }
    let needed = (texels_per_height * extent_m / base_m.max(1e-3)).min(f64::from(TEXELS[1])) as u32;
    let texels = needed.min(detail).clamp(TEXELS[0], TEXELS[1]).next_power_of_two();
    GridPlan { texels, samples: detail.div_ceil(texels).clamp(1, MAX_SAMPLES) }
}

/// From a point on the ground to where its sun ray crosses the cloud base, as an offset on the map.
fn shift_uv(sun: [f64; 3], base_m: f64, extent_m: f64) -> [f32; 2] {
    let cosine = sun[2].max(f64::from(crate::gpu::layout::MIN_COSINE));
    let tiles = base_m / (cosine * extent_m);
    // Brought to one tile in f64: at grazing sun the offset is thousands of tiles.
    [(tiles * sun[0]).rem_euclid(1.0) as f32, (-tiles * sun[1]).rem_euclid(1.0) as f32]
}

impl GridPlan {
    /// The rings lie at radii in proportion to the height: ring k stands for a square of side 2^k heights, its four taps
    /// a quarter of that from the middle, each on the mip level whose texels are half as wide.
    pub(crate) fn exchange(&self, frame: &Frame) -> Exchange {
        let height_texels = f64::from(frame.base_m) * f64::from(self.texels) / f64::from(frame.extent_m);
        let side = |ring: usize| (1u32 << ring) as f32;
        let ring = |value: &dyn Fn(usize) -> f32| [value(0), value(1), value(2), value(3)];
        let sun = [frame.sun[0], frame.sun[1], frame.sun[2]].map(f64::from);
        Exchange {
            shift_uv: shift_uv(sun, frame.base_m.into(), frame.extent_m.into()),
            texels: self.texels,
            samples: self.samples,
            weights: RING_WEIGHTS,
            levels: ring(&|k| (0.5 * height_texels as f32 * side(k)).max(1.0).log2()),
            offsets_uv: ring(&|k| 0.25 * side(k) * frame.base_m / frame.extent_m),
        }
    }
}
