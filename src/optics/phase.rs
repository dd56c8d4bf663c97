//! Phase functions: how scattered light spreads over the scattering angle.
//!
//! P is dimensionless with (1/4pi) times its integral over the sphere equal to 1: P/4pi is a
//! density per steradian. All phase functions share one grid of angles, symmetric about 90 degrees
//! and fine towards 0 and 180, between which log P is linear in the angle (P spans six decades, so
//! that P itself would have to be sampled far more finely around 0). Every integral is one of this
//! interpolant.

use super::error::{OpticsError, check};
use std::f64::consts::PI;
use std::sync::OnceLock;

use super::quadrature::gauss_legendre;

/// Largest size of the asymmetry of a Henyey-Greenstein phase function.
pub const MAX_ASYMMETRY: f64 = 0.99;

/// Parts of the first half of the grid, in hundredths of a degree: (end, step). The finest steps
/// resolve the forward peak and the glory of droplets of 50 µm; the bows lie at 120..160 degrees.
const GRID_PARTS: [(u32, u32); 5] = [(50, 1), (500, 2), (1000, 5), (6000, 10), (9000, 50)];
/// Zeros are raised to this part of the largest value, as their logarithm does not exist.
const FLOOR: f64 = 1e-12;
/// Largest Gauss-Legendre rule used within one panel.
const MAX_PANEL_NODES: usize = 64;

/// Scattering angles in degrees at which phase functions are stored: increasing, 0 to 180,
/// symmetric about 90.
#[must_use]
pub fn grid_deg() -> &'static [f64] {
    static GRID: OnceLock<Vec<f64>> = OnceLock::new();
    GRID.get_or_init(|| {
        let mut half = vec![0];
        let mut at = 0;
        for (end, step) in GRID_PARTS {
            while at < end {
                at += step;
                half.push(at);
            }
        }
        let mirrored: Vec<u32> = half.iter().rev().skip(1).map(|a| 18000 - a).collect();
        half.iter().chain(&mirrored).map(|a| f64::from(*a) / 100.0).collect()
    })
}

/// The grid in radians.
fn grid() -> &'static [f64] {
    static GRID: OnceLock<Vec<f64>> = OnceLock::new();
    GRID.get_or_init(|| {
        let mut grid: Vec<f64> = grid_deg().iter().map(|a| a.to_radians()).collect();
        if let Some(last) = grid.last_mut() {
            *last = PI;
        }
        grid
    })
}

/// Gauss-Legendre rules on -1..1 of 0..=MAX_PANEL_NODES points.
pub(super) fn rules() -> &'static [(Vec<f64>, Vec<f64>)] {
    static RULES: OnceLock<Vec<(Vec<f64>, Vec<f64>)>> = OnceLock::new();
    RULES.get_or_init(|| (0..=MAX_PANEL_NODES).map(gauss_legendre).collect())
}

/// A normalised phase function on the common grid.
#[derive(Clone, Debug, PartialEq)]
pub struct PhaseFunction {
    values: Vec<f64>,
    logs: Vec<f64>,
    /// Part of the light scattered by less than each angle of the grid.
    within: Vec<f64>,
}

/// A phase function split in two by [`PhaseFunction::smooth_cut`]: P = fraction * peak + (1 -
/// fraction) * rest.
#[derive(Clone, Debug, PartialEq)]
pub struct Cut {
    /// Part of all scattered light that belongs to the forward peak, 0..1.
    pub peak_fraction: f64,
    /// The forward peak, normalised.
    pub peak: PhaseFunction,
    /// Everything else, normalised.
    pub rest: PhaseFunction,
}

impl PhaseFunction {
    /// A phase function from values proportional to P at the angles of [`grid_deg`]; normalised
    /// here.
    ///
    /// # Errors
    /// What is wrong with the values: their number, a negative or not finite one, or nothing but
    /// zeros.
    pub fn from_grid_values(values: Vec<f64>) -> Result<Self, OpticsError> {
        if values.len() != grid().len() {
            return Err(OpticsError::Count { given: values.len(), wanted: grid().len() });
        }
        if let Some(bad) = values.iter().find(|v| !(v.is_finite() && **v >= 0.0)) {
            return Err(OpticsError::Value(*bad));
        }
        let largest = values.iter().copied().fold(0.0, f64::max);
        if largest <= 0.0 {
            return Err(OpticsError::Dark);
        }
        // Scaled first: the integral of huge or tiny values must neither overflow nor vanish.
        let scaled: Vec<f64> = values.iter().map(|v| (v / largest).max(FLOOR)).collect();
        let norm = Self::from_positive_values(scaled.clone()).1;
        Ok(Self::from_positive_values(scaled.iter().map(|v| v / norm).collect()).0)
    }

    /// Takes values as they are (all > 0); also returns their norm (1/4pi) int P dOmega, by which
    /// nothing but `within` is divided.
    fn from_positive_values(values: Vec<f64>) -> (Self, f64) {
        let logs = values.iter().map(|v| v.ln()).collect();
        let mut phase = Self { values, logs, within: Vec::new() };
        let mut within = Vec::with_capacity(grid().len());
        let mut sum = 0.0;
        within.push(sum);
        for panel in 0..grid().len() - 1 {
            phase.for_panel_nodes(panel, grid()[panel + 1], 0, |_, weight| sum += weight);
            within.push(sum);
        }
        phase.within = within.iter().map(|w| w / sum).collect();
        (phase, sum)
    }

    /// Restores values saved from [`Self::grid_values`] bit by bit; None where they are not a
    /// normalised phase function.
    pub(super) fn from_normalised(values: &[f64]) -> Option<Self> {
        const NORM_TOLERANCE: f64 = 1e-9;
        if values.len() != grid().len() || !values.iter().all(|v| v.is_finite() && *v > 0.0) {
            return None;
        }
        let (phase, norm) = Self::from_positive_values(values.to_vec());
        ((norm - 1.0).abs() < NORM_TOLERANCE).then_some(phase)
    }

    /// Henyey and Greenstein's phase function (1941) of asymmetry `g` in -0.99..0.99: (1 - g²) / (1
    /// + g² - 2 g cos)^(3/2).
    ///
    /// # Errors
    /// `g` out of range.
    pub fn henyey_greenstein(g: f64) -> Result<Self, OpticsError> {
        check("asymmetry", g, &(-MAX_ASYMMETRY..=MAX_ASYMMETRY))?;
        // 1 + g² - 2 g cos a without cancellation near the peak.
        let at = |angle: f64| {
            let half = if g >= 0.0 { (0.5 * angle).sin() } else { (0.5 * angle).cos() };
            let g = g.abs();
            (1.0 - g * g) / ((1.0 - g).powi(2) + 4.0 * g * half * half).powf(1.5)
        };
        Self::from_grid_values(grid().iter().map(|a| at(*a)).collect())
    }

    /// P at the angles of [`grid_deg`], all > 0.
    #[must_use]
    pub fn grid_values(&self) -> &[f64] {
        &self.values
    }

    /// Part of the light scattered by less than each angle of [`grid_deg`].
    pub(super) fn within(&self) -> &[f64] {
        &self.within
    }

    /// Number of the panel that contains `angle` (radians).
    fn panel(angle: f64) -> usize {
        grid().partition_point(|a| *a <= angle).clamp(1, grid().len() - 1) - 1
    }

    /// log P inside a panel.
    fn log_in_panel(&self, panel: usize, angle: f64) -> f64 {
        let (from, to) = (grid()[panel], grid()[panel + 1]);
        let t = (angle - from) / (to - from);
        self.logs[panel] * (1.0 - t) + self.logs[panel + 1] * t
    }

    /// P at a scattering angle in radians (clamped to 0..pi).
    #[must_use]
    pub fn value(&self, angle: f64) -> f64 {
        let angle = angle.clamp(0.0, PI);
        self.log_in_panel(Self::panel(angle), angle).exp()
    }

    /// Part of the scattered light that leaves within `angle` (radians, clamped to 0..pi) of the
    /// forward direction, 0..1.
    #[must_use]
    pub fn fraction_within(&self, angle: f64) -> f64 {
        let angle = angle.clamp(0.0, PI);
        let panel = Self::panel(angle);
        let mut sum = self.within[panel];
        self.for_panel_nodes(panel, angle, 0, |_, weight| sum += weight);
        sum.min(1.0)
    }

    /// Mean cosine of the scattering angle, -1..1.
    #[must_use]
    pub fn asymmetry(&self) -> f64 {
        self.integral(|angle| angle.cos())
    }

    /// (1/4pi) int f(angle) P dOmega for a smooth f.
    #[must_use]
    pub fn integral(&self, f: impl Fn(f64) -> f64) -> f64 {
        let mut sum = 0.0;
        self.for_nodes(1, |angle, weight| sum += weight * f(angle));
        sum
    }

    /// Calls `node(angle, weight)` for the nodes of a quadrature over the sphere whose weights
    /// contain P/2 sin(angle) and that is exact to rounding for P times Legendre polynomials up to
    /// `degree`.
    pub fn for_nodes(&self, degree: usize, mut node: impl FnMut(f64, f64)) {
        for panel in 0..grid().len() - 1 {
            self.for_panel_nodes(panel, grid()[panel + 1], degree, &mut node);
        }
    }

    /// The nodes of one panel from its start to `end`.
    fn for_panel_nodes(&self, panel: usize, end: f64, degree: usize, mut node: impl FnMut(f64, f64)) {
        let from = grid()[panel];
        let half = 0.5 * (end - from);
        // A Gauss rule follows exp(s x) or cos(s x) on -1..1 to rounding with about s + 6 points.
        let steepness = 0.25 * (self.logs[panel + 1] - self.logs[panel]).abs();
        let count = (steepness + degree as f64 * half * 0.75).ceil() as usize + 5;
        let (nodes, weights) = &rules()[count.min(MAX_PANEL_NODES)];
        for (x, weight) in nodes.iter().zip(weights) {
            let angle = from + half * (1.0 + x);
            node(angle, 0.5 * half * weight * self.log_in_panel(panel, angle).exp() * angle.sin());
        }
    }

    /// Splits P into a forward peak, P times a window that is 1 inside `inner` and falls as a
    /// smoothstep to 0 at `outer` (radians), and the rest; None where one of the two would be
    /// empty.
    #[must_use]
    pub fn smooth_cut(&self, inner: f64, outer: f64) -> Option<Cut> {
        let window = |angle: f64| {
            let t = if outer > inner {
                ((outer - angle) / (outer - inner)).clamp(0.0, 1.0)
            } else {
                f64::from(angle < inner)
            };
            t * t * (3.0 - 2.0 * t)
        };
        let peak = grid().iter().zip(&self.values).map(|(a, v)| v * window(*a)).collect();
        let rest = grid().iter().zip(&self.values).map(|(a, v)| v * (1.0 - window(*a))).collect();
        let peak_fraction = self.integral(window).clamp(0.0, 1.0);
        Some(Cut { peak_fraction, peak: Self::from_grid_values(peak).ok()?, rest: Self::from_grid_values(rest).ok()? })
    }
}
