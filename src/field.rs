//! Stage `field`: the thickness map of a layer. Takes a pattern or an image, gives a periodic texture in the frame that
//! moves with the wind: time only shifts where it is read ([`wind_offset`]), so one map serves every moment.

mod transfer;

use crate::gpu::layout::Pattern;
use crate::gpu::{Bind, Gpu, GpuError, Target, shaders};
use crate::image::Image;
use crate::scene::quantity::Quantity as _;
use crate::scene::{self, Stratocumulus, Thickness, Wind};
use std::time::Instant;
pub use transfer::{Transfer, calibrate};

/// A thickness map on the device.
pub(crate) struct Field {
    pub(crate) thickness: Target,
    /// Greatest thickness, metres.
    pub(crate) depth_m: f32,
    /// The pattern and its Gaussian field, for tests.
    pub(crate) pattern: Option<(Pattern, wgpu::Buffer)>,
}

impl Field {
    /// Whether the map is the same everywhere.
    pub(crate) fn is_uniform(&self) -> bool {
        self.thickness.width * self.thickness.height == 1
    }
}

/// Cycles per domain of the lowest octave of noise: `LOWEST_PERIOD` of `shaders/field_noise.wgsl`.
const LOWEST_PERIOD: u32 = 3;
/// Octaves of noise at most: 3 to 1536 cycles.
const MAX_OCTAVES: u32 = 10;
/// Part of the cells in the Gaussian field: a compromise between visible cells and a -5/3 spectrum.
const CELL_SHARE: f32 = 0.7;
/// Amplitude per octave, 2^(-1/3).
const OCTAVE_GAIN: f64 = 0.793_700_5;
/// Standard deviation of the gradient noise of `shaders/shared/noise.wgsl`.
const GRADIENT_NOISE_STD: f64 = 0.2151;

/// Makes the thickness map of a layer. `image` is the layer's image, if it has one.
pub(crate) fn thickness(
    gpu: &Gpu,
    thickness: &Thickness,
    resolution: u32,
    extent_m: f64,
    image: Option<&Image>,
    deadline: Option<Instant>,
) -> Result<Field, GpuError> {
    match (thickness, image) {
        (Thickness::Uniform(metres), _) => Ok(uploaded(gpu, [1, 1], &[metres.get() as f32])),
        (Thickness::Stratocumulus(wanted), _) => synthetic(gpu, wanted, resolution, extent_m, deadline),
        (Thickness::Map { scale_m, .. }, Some(image)) => {
            let limits = scene::quantity::ThicknessM::RANGE;
            let clamp = |sample: f32| (f64::from(sample) * scale_m.get()).clamp(*limits.start(), *limits.end()) as f32;
            let metres: Vec<f32> = image
                .data
                .chunks(image.channels as usize)
                .filter_map(|texel| texel.first())
                .map(|s| clamp(*s))
                .collect();
            Ok(uploaded(gpu, [image.width, image.height], &metres))
        }
        (Thickness::Map { .. }, None) => Ok(uploaded(gpu, [1, 1], &[0.0])),
    }
}

fn uploaded(gpu: &Gpu, size: [u32; 2], metres: &[f32]) -> Field {
    let depth_m = metres.iter().copied().fold(0.0, f32::max);
    Field { thickness: gpu.texture_from("thickness", size, 1, metres), depth_m, pattern: None }
}

/// Spread of the logarithm of water path: closed cells are even, open ones patchy.
fn spread(pattern: scene::Pattern) -> f64 {
    match pattern {
        scene::Pattern::Closed => 0.5,
        scene::Pattern::Open => 0.9,
        scene::Pattern::Fractal => 0.6,
    }
}

fn synthetic(
    gpu: &Gpu,
    wanted: &Stratocumulus,
    resolution: u32,
    extent_m: f64,
    deadline: Option<Instant>,
) -> Result<Field, GpuError> {
    // No octave is finer than two texels: it could not be shown.
    let octaves =
        (1..=MAX_OCTAVES).take_while(|o| o == &1 || LOWEST_PERIOD << (o - 1) <= resolution / 2).count() as u32;
    let variance: f64 = (0..octaves).map(|o| OCTAVE_GAIN.powi(2 * o as i32)).sum();
    let cells = (extent_m / wanted.cell_m.get()).round().clamp(1.0, f64::from((resolution / 4).max(1)));
    let mut pattern = Pattern {
        seed: wanted.seed,
        octaves,
        cells: cells as u32,
        kind: match wanted.pattern {
            scene::Pattern::Closed => 0,
            scene::Pattern::Open => 1,
            scene::Pattern::Fractal => 2,
        },
        cell_share: if wanted.pattern == scene::Pattern::Fractal { 0.0 } else { CELL_SHARE },
        noise_scale: (1.0 / (variance.sqrt() * GRADIENT_NOISE_STD)) as f32,
        spread: spread(wanted.pattern) as f32,
        width: resolution,
        ..Pattern::default()
    };
    let texels = resolution as usize * resolution as usize;
    let gaussian = gpu.storage("field_noise", texels);
    let size = [resolution, resolution];
    gpu.run("field_noise", deadline, |pass| {
        let uniform = gpu.uniform("pattern", &pattern);
        gpu.dispatch(pass, &shaders::FIELD_NOISE, &[Bind::Buffer(&uniform), Bind::Buffer(&gaussian)], size);
    })?;
    // Coverage and mean are met on the very field that was made, not on a model of it.
    let values = gpu.read(&gaussian, texels, deadline)?;
    let transfer = calibrate(&values, wanted.coverage.get(), wanted.mean_m.get(), f64::from(pattern.spread));
    pattern.threshold = transfer.threshold as f32;
    pattern.scale_m = transfer.scale_m as f32;
    pattern.clip_m = transfer.clip_m as f32;
    let thickness = gpu.texture("thickness", size, 1, 1);
    gpu.run("field_thickness", deadline, |pass| {
        let uniform = gpu.uniform("pattern", &pattern);
        let binds = [Bind::Buffer(&uniform), Bind::Buffer(&gaussian), Bind::View(&thickness.levels[0])];
        gpu.dispatch(pass, &shaders::FIELD_THICKNESS, &binds, size);
    })?;
    // Rounding on the device can lift the thickest texel by a few units in the last place.
    let depth_m = (transfer.greatest_m * (1.0 + 1e-5)) as f32;
    Ok(Field { thickness, depth_m, pattern: Some((pattern, gaussian)) })
}

/// How far the mean wind has carried a field by a time, as the offset to add to a place on the map: the map is read
/// upwind. Kept in f64 and brought to one tile, so that it is exact after years.
pub(crate) fn wind_offset(wind: &Wind, time_s: f64, extent_m: f64) -> [f64; 2] {
    // Wind comes *from* its direction: upwind is towards it. Rows of a map run southwards.
    let upwind = scene::direction(90.0, wind.from_deg.get());
    let tiles = wind.speed_m_s.get() * time_s / extent_m;
    [(tiles * upwind[0]).rem_euclid(1.0), (-tiles * upwind[1]).rem_euclid(1.0)]
}
