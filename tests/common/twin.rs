//! What the tests of twins share: the devices, comparisons, and what rounding costs.
#![allow(dead_code, reason = "each test binary uses its part")]

use super::compare::{Tolerance, assert_close, assert_within};
use super::sky::Sky;
use skyloom::gpu::HostMap;
use skyloom::reference::Map;
use skyloom::reference::air::Air;
use skyloom::render::{Renderer, RendererOptions, SkyAir, Stages, Watch};
use std::sync::{LazyLock, Mutex, MutexGuard, PoisonError};

/// Half a unit in the last place of single precision, relative.
pub(crate) const ROUND: f64 = 1.0 / 16_777_216.0;
/// exp(-x): the driver's 1.1e-6, and eight roundings in an x of up to 20, below which nothing is seen, relative.
pub(crate) const BEAM_REL: f64 = 1e-5;
/// A table's row: log2 of up to 16 with the driver's 8e-7, at eight rows an octave, moves by 1e-4 rows, of which each
/// changes a value by at most 9 %, relative. The columns are far smoother.
pub(crate) const TABLE_REL: f64 = 1e-5;
/// A slice's zenith and azimuth: the driver's arc tangents, 2e-5 of up to half a turn, are up to 6e-4 of a node, of which
/// each changes the light by at most 10 %, relative. The same for all texels of a parallel view.
pub(crate) const SLICE_REL: f64 = 6e-5;
/// What is left of a difference of numbers near 1, such as 1 - exp(-x) of a thin cloud.
pub(crate) const CANCEL: f64 = 4.0 * ROUND;
/// Rounding of the scattering angle's half sine: components of two unit vectors and their length.
pub(crate) const DIRECTION: f32 = 2.4e-7;
pub(crate) fn open(filtering: bool) -> Renderer {
    Renderer::new(&RendererOptions { filtering, ..RendererOptions::default() }).unwrap()
}

pub(crate) fn is_software(renderer: &Renderer) -> bool {
    renderer.adapter().kind == "software"
}

pub(crate) fn lock(renderer: &'static Mutex<Renderer>) -> MutexGuard<'static, Renderer> {
    // A failed test leaves a whole renderer behind.
    renderer.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The device of this test run: there must be one. A software one filters, with full weights.
pub(crate) fn device() -> MutexGuard<'static, Renderer> {
    static DEVICE: LazyLock<Mutex<Renderer>> = LazyLock::new(|| {
        let renderer = open(true);
        Mutex::new(if is_software(&renderer) { renderer } else { open(false) })
    });
    lock(&DEVICE)
}

impl Sky {
    pub(crate) fn stages(&self, texture: &str, query: &[(&str, &str)]) -> Stages {
        device().inspect(&self.job(texture, query), &Watch::default()).unwrap()
    }
}

/// The device without filtering.
pub(crate) fn unfiltered() -> MutexGuard<'static, Renderer> {
    static DEVICE: LazyLock<Mutex<Renderer>> = LazyLock::new(|| Mutex::new(open(false)));
    lock(&DEVICE)
}

pub(crate) fn air(host: &SkyAir) -> Air {
    Air { map: map(&host.map), colours: host.colours }
}

pub(crate) fn map(host: &HostMap) -> Map {
    Map::from_f32(host.width as usize, host.height as usize, host.channels as usize, &host.data)
}

pub(crate) fn maps(levels: &[HostMap]) -> Vec<Map> {
    levels.iter().map(map).collect()
}

/// A twin's map with as many channels as the device's.
pub(crate) fn values(twin: &Map, like: &HostMap) -> Vec<f64> {
    twin.texels.iter().flat_map(|texel| &texel[..like.channels as usize]).copied().collect()
}

/// Largest difference of neighbouring texels of a periodic map.
pub(crate) fn largest_step(map: &Map) -> f64 {
    let mut most = 0.0_f64;
    for y in 0..map.height {
        for x in 0..map.width {
            let here = map.texel(x, y);
            for other in [map.texel((x + 1) % map.width, y), map.texel(x, (y + 1) % map.height)] {
                most = here.iter().zip(other).map(|(here, other)| (here - other).abs()).fold(most, f64::max);
            }
        }
    }
    most
}

/// By how much a periodic map's bilinear sample can be wrong, in the map's unit: the place is the sum of up to three
/// numbers below `reach_uv` (at least 1), which is rounded four times; both axes.
pub(crate) fn place_error(map: &Map, reach_uv: f64) -> f64 {
    let texels = 4.0 * ROUND * reach_uv.max(1.0) * map.width.max(map.height) as f64;
    2.0 * texels * largest_step(map)
}

pub(crate) fn lifted(map: &Map, by_m: f64) -> Map {
    Map::from_fn(map.width, map.height, |x, y| [(map.texel(x, y)[0] + by_m).max(0.0), 0.0, 0.0, 0.0])
}

/// Tolerance of each value of a twin: a steady part, and what another run of the twin does to the value.
pub(crate) fn allowed(twin: &[f64], other: &[f64], tolerance: Tolerance) -> Vec<f64> {
    let steady = tolerance.of(twin);
    twin.iter().zip(other).zip(steady).map(|((twin, other), steady)| steady + (twin - other).abs()).collect()
}

pub(crate) fn check(name: &str, gpu: &[f32], twin: &[f64], tolerance: Tolerance) {
    let used = assert_close(name, gpu, twin, tolerance);
    eprintln!("{name}: {used:.3} of the tolerance");
}

pub(crate) fn check_each(name: &str, gpu: &[f32], twin: &[f64], allowed: &[f64]) {
    let used = assert_within(name, gpu, twin, allowed);
    eprintln!("{name}: {used:.3} of the tolerance");
}

pub(crate) fn assert_size(name: &str, gpu: &HostMap, twin: &Map) {
    assert_eq!((gpu.width as usize, gpu.height as usize), (twin.width, twin.height), "{name}");
}

pub(crate) fn check_map(name: &str, gpu: &HostMap, twin: &Map, tolerance: Tolerance) {
    assert_size(name, gpu, twin);
    check(name, &gpu.data, &values(twin, gpu), tolerance);
}

pub(crate) fn largest(map: &Map) -> f64 {
    map.texels.iter().flatten().copied().fold(0.0, f64::max)
}
