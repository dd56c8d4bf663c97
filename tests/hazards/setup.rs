//! One uniform slab seen from one direction: what the device computed, and the same light from other formulas.

use crate::sky::Sky;
use serde_json::{Value, json};
use skyloom::gpu::HostMap;
use skyloom::optics::gauss_legendre;
use skyloom::render::{RendererOptions, Stages, Watch};
use skyloom::slice::CLOSURE_ROWS;
use skyloom::tables::MixTables;
use std::f64::consts::{FRAC_PI_2, PI, SQRT_2};
use std::sync::{Arc, LazyLock, Mutex, MutexGuard, PoisonError};

/// Shader against double precision, relative: about 30 roundings (6e-8 each), exponents up to 20 (1.2e-6), and rows of
/// tables found with an error of 1e-4 rows, of which each changes a value by at most 9 %.
pub(crate) const SHADER: f64 = 3e-5;
/// Optics of the green channel are what the tests look at: all channels are alike here.
const GREEN: usize = 1;

/// The one device of these tests. Hardware filters with 8-bit weights, which are not what is tested here: it samples by
/// hand then.
pub(crate) fn device() -> MutexGuard<'static, Sky> {
    static DEVICE: LazyLock<Mutex<Sky>> = LazyLock::new(|| {
        let sky = Sky::open();
        let software = sky.renderer.adapter().kind == "software";
        let by_hand = RendererOptions { filtering: false, ..RendererOptions::default() };
        Mutex::new(if software { sky } else { Sky::with(&by_hand) })
    });
    // A failed test leaves a whole renderer behind.
    DEVICE.lock().unwrap_or_else(PoisonError::into_inner)
}

pub(crate) fn henyey_greenstein(asymmetry: f64, albedo: f64) -> Value {
    json!({ "henyey_greenstein": asymmetry, "albedo": albedo })
}

pub(crate) fn cos_deg(degrees: f64) -> f64 {
    degrees.to_radians().cos()
}

/// A uniform slab over even ground, under a sun of irradiance 1 and an even sky.
#[derive(Clone, Debug)]
pub(crate) struct Slab {
    pub(crate) zenith_deg: f64,
    pub(crate) azimuth_deg: f64,
    pub(crate) optical_depth: f64,
    pub(crate) droplets: Value,
    pub(crate) sky: f64,
    pub(crate) ground: f64,
}

impl Slab {
    pub(crate) fn new(zenith_deg: f64, optical_depth: f64, droplets: Value) -> Self {
        Self { zenith_deg, azimuth_deg: 0.0, optical_depth, droplets, sky: 0.0, ground: 0.0 }
    }

    pub(crate) fn scene(&self) -> Value {
        let mut droplets = self.droplets.clone();
        // The densest medium for the thickest slabs, the thinnest for the others: metres stay in their range.
        let extinction = if self.optical_depth > 50.0 { 1.0 } else { 1e-3 };
        droplets["extinction_per_m"] = json!(extinction);
        json!({
            "domain": { "extent_m": 10_000, "resolution": 1 },
            "sun": { "zenith_deg": self.zenith_deg, "azimuth_deg": self.azimuth_deg },
            "atmosphere": { "sun": [1, 1, 1], "sky": [self.sky, self.sky, self.sky] },
            "ground": { "albedo": [self.ground, self.ground, self.ground] },
            "layers": [{
                "base_m": 1000, "droplets": droplets,
                "thickness": { "kind": "uniform", "metres": self.optical_depth / extinction },
            }],
        })
    }

    /// What is seen from `view` (`below`, `above`) in a direction towards the viewer, zenith and azimuth in degrees.
    pub(crate) fn seen(&self, view: &str, direction: (f64, f64)) -> Seen {
        self.seen_by(view, direction, &[("method", "analytic")])
    }

    /// The same by another method: closed forms are what most tests are about, what must hold for all is asked of both.
    pub(crate) fn seen_by(&self, view: &str, direction: (f64, f64), method: &[(&str, &str)]) -> Seen {
        let direction = format!("{},{}", direction.0, direction.1);
        let query = [&[("view", view), ("direction", direction.as_str())], method].concat();
        let mut device = device();
        let job = device.job(&self.scene(), "cloud", &query);
        Seen { stages: device.renderer.inspect(&job, &Watch::default()).unwrap(), tables: Arc::clone(&job.tables()[0]) }
    }

    pub(crate) fn texture(&self, texture: &str, query: &[(&str, &str)]) -> Vec<f32> {
        device().render(&self.scene(), texture, query).data
    }
}

/// The methods, as queries: the coarsest of the tables will do.
pub(crate) const METHODS: [&[(&str, &str)]; 2] =
    [&[("method", "analytic")], &[("method", "tabulated"), ("tolerance", "0.05")]];

/// One texel of cloud with everything that it was made from.
pub(crate) struct Seen {
    pub(crate) stages: Stages,
    pub(crate) tables: Arc<MixTables>,
}

/// Optical depths of the medium without its forward peak: along the view, along the sun, and the smaller one and the
/// difference of the two without cancellation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Path {
    pub(crate) view: f64,
    pub(crate) sun: f64,
    pub(crate) shorter: f64,
    pub(crate) gap: f64,
}

/// Parts of the expected radiance.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Parts {
    pub(crate) order1: f64,
    pub(crate) order2: f64,
    pub(crate) higher: f64,
}

impl Parts {
    pub(crate) fn sum(&self) -> f64 {
        self.order1 + self.order2 + self.higher
    }
}

impl Seen {
    pub(crate) fn radiance(&self) -> f64 {
        self.stages.output[GREEN].into()
    }

    pub(crate) fn alpha(&self) -> f64 {
        self.stages.output[3].into()
    }

    fn is_from_above(&self) -> bool {
        self.stages.view.from_above == 1
    }

    fn cosines(&self) -> (f64, f64) {
        (f64::from(self.stages.view.towards[2]).abs(), self.stages.frame.sun.slant_cosine.into())
    }

    /// True vertical optical depth.
    pub(crate) fn depth(&self) -> f64 {
        f64::from(self.stages.frame.medium.extinction_550) * f64::from(self.stages.thickness.data[0])
    }

    pub(crate) fn path(&self) -> Path {
        let (cosine, sun) = self.cosines();
        let depth = f64::from(self.stages.frame.medium.smooth_part[GREEN]) * self.depth();
        let view = depth / cosine;
        Path { view, sun: depth / sun, shorter: depth / cosine.max(sun), gap: view * (sun - cosine).abs() / sun }
    }

    /// Angle by which the light that is seen was scattered, from what the device was given.
    pub(crate) fn angle(&self) -> f64 {
        let [sun, seen] = [self.stages.frame.sun.towards, self.stages.view.towards].map(wide);
        let cross = [0, 1, 2].map(|i| {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            sun[j] * seen[k] - sun[k] * seen[j]
        });
        let dot: f64 = (0..3).map(|i| sun[i] * seen[i]).sum();
        cross.iter().map(|part| part * part).sum::<f64>().sqrt().atan2(-dot)
    }

    /// Phase function of an order (0: once, 1: twice) per steradian, linear between the columns of its table.
    pub(crate) fn phase(&self, row: usize) -> f64 {
        let half = 0.5 * self.angle();
        let place = |side: f64| 0.5 * (side * SQRT_2).sqrt();
        let place = if self.angle() < FRAC_PI_2 { place(half.sin()) } else { 1.0 - place(half.cos()) };
        let map = &self.stages.tables.phase;
        along_row(map, row, place * f64::from(map.width - 1))
    }

    /// A row of the closure at this slab's depth.
    pub(crate) fn closure(&self, row: usize) -> f64 {
        let map = &self.stages.closure;
        assert_eq!(map.height as usize, CLOSURE_ROWS);
        let share = (self.depth() / 2f64.powi(-16)).min(1.0);
        let value = along_row(map, row, (self.depth().log2() + 16.0) * 8.0);
        // Flux goes with depth below the table, factors do not.
        if row % 3 == 2 { value * share } else { value }
    }

    /// Light of the sun but for the forward peak's, with the geometric factors of orders 1 and 2 given.
    pub(crate) fn expected(&self, orders: impl Fn(Path) -> [f64; 2]) -> Parts {
        let [order1, order2] = orders(self.path());
        let first_row = if self.is_from_above() { 0 } else { 3 };
        let albedo = f64::from(self.stages.frame.medium.smooth_albedo[GREEN]);
        Parts {
            order1: self.closure(first_row) * albedo * self.phase(0) * order1,
            order2: self.closure(first_row + 1) * albedo * albedo * self.phase(1) * order2,
            higher: self.closure(first_row + 2) * self.cosines().1 / PI,
        }
    }

    /// The same by [`integrals`].
    pub(crate) fn expected_parts(&self) -> Parts {
        let above = self.is_from_above();
        self.expected(|path| integrals(path, above))
    }

    /// Fails unless the device found the expected light within [`SHADER`].
    pub(crate) fn check(&self, expected: f64) {
        let (found, depth) = (self.radiance(), self.depth());
        let error = (found / expected - 1.0).abs();
        assert!(error < SHADER, "depth {depth}, {:?}: {found} not {expected}: {error:.1e}", self.stages.view.towards);
    }
}

fn wide(v: [f32; 3]) -> [f64; 3] {
    v.map(f64::from)
}

fn along_row(map: &HostMap, row: usize, column: f64) -> f64 {
    let column = column.clamp(0.0, f64::from(map.width - 1));
    let low = (column as usize).min(map.width as usize - 2);
    let at = |x: usize| f64::from(map.data[(row * map.width as usize + x) * map.channels as usize + GREEN]);
    at(low) + (at(low + 1) - at(low)) * (column - low as f64)
}

/// Geometric factors of orders 1 and 2 as integrals over the depth of scattering, which have no cancellation.
pub(crate) fn integrals(path: Path, reflected: bool) -> [f64; 2] {
    // Panels that halve towards 0 resolve any exponent.
    let integral = |f: &dyn Fn(f64) -> f64| -> f64 {
        let (nodes, weights) = gauss_legendre(16);
        let panel = |k: i32| {
            let width = 2f64.powi(-k - 1);
            let node = |(x, w): (&f64, &f64)| 0.5 * w * width * f(width * (1.5 + 0.5 * x));
            nodes.iter().zip(&weights).map(node).sum::<f64>()
        };
        (0..70).map(panel).sum()
    };
    let (b, x) = (path.view, path.view + path.sun);
    if reflected {
        return [b * integral(&|t| (-x * t).exp()), 0.5 * b * x * integral(&|t| t * (-x * t).exp())];
    }
    let clear = (-path.shorter).exp();
    let ramp = |t: f64| (path.shorter + path.gap * t) * (-path.gap * t).exp();
    [b * clear * integral(&|t| (-path.gap * t).exp()), 0.5 * b * clear * integral(&ramp)]
}
