//! Closes the analytic orders against the fluxes of all orders: what orders 1 and 2 leave of the flux belongs to the higher orders.
//!
//! The orders are those of the modified medium, in which scattering inside the forward peak counts as no scattering: optical depth
//! `(1 - P_f) tau` with the phase function `P_s` that is zero inside the peak. By construction no order is negative and the sum over
//! all orders is the flux that they are closed against.

use std::f64::consts::{FRAC_PI_2, PI};

use super::analytic::{order1_reflected, order1_transmitted, order2_reflected, order2_transmitted};
use super::appendix;
use super::fluxes::FluxTable;
use super::quadrature::{Rule, gauss_legendre};

/// Zenith nodes per panel of at most [`PANEL_WIDTH`]; panels end at the antisolar point, at the sun and at the edges of the forward
/// peak. With [`AZIMUTH_NODES`] the fluxes of the orders are within 3e-4 of the limit of many nodes, bows included.
const ZENITH_NODES: usize = 8;
/// Widest zenith panel, radians (10 degrees): with the nodes above it resolves the bows of droplets.
const PANEL_WIDTH: f64 = PI / 18.0;
/// Azimuth nodes per panel over half a turn; the half turn is one panel, or two where it crosses the edge of the forward peak.
const AZIMUTH_NODES: usize = 24;

/// Fluxes of all orders together.
#[derive(Clone, Copy, Debug)]
pub enum Totals<'a> {
    /// Exact, by adding-doubling.
    Exact(&'a FluxTable),
    /// The paper's fit (appendix B) for its own droplets, which absorb nothing: off by up to 0.07.
    Fitted {
        /// Metres of the paper's cloud in an optical depth of 1.
        metres_per_depth: f64,
    },
}

impl Totals<'_> {
    /// Reflectance and transmittance, with the unscattered light; at most 1 together.
    fn beam(&self, optical_depth: f64, mu_sun: f64) -> [f64; 2] {
        match self {
            Self::Exact(table) => {
                let exact = table.beam(optical_depth, mu_sun);
                [exact.reflectance, exact.transmittance]
            }
            Self::Fitted { metres_per_depth } => {
                let transmitted = appendix::total_transmittance(metres_per_depth * optical_depth, mu_sun);
                [1.0 - transmitted, transmitted]
            }
        }
    }
}

/// The low orders of one colour channel.
#[derive(Clone, Copy)]
pub struct LowOrders<'a> {
    /// Fluxes that the orders of the channel are closed against.
    pub totals: Totals<'a>,
    /// Single-scattering albedo, 0..=1.
    pub albedo: f64,
    /// Fraction `P_f` of the scattered light inside the forward peak, 0..1.
    pub forward_fraction: f64,
    /// Half-width of the forward peak, radians: `order1_phase` is zero inside.
    pub forward_edge: f64,
    /// `P_s / 4pi` (1/sr) at a scattering angle in radians, 0..=pi.
    pub order1_phase: &'a dyn Fn(f64) -> f64,
    /// `(P_s * P_s) / 4pi` (1/sr) at a scattering angle in radians.
    pub order2_phase: &'a dyn Fn(f64) -> f64,
}

impl std::fmt::Debug for LowOrders<'_> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter
            .debug_struct("LowOrders")
            .field("albedo", &self.albedo)
            .field("forward_fraction", &self.forward_fraction)
            .field("forward_edge", &self.forward_edge)
            .finish_non_exhaustive()
    }
}

/// How to complete the low orders at one optical depth on one side.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Completion {
    /// Factor for order 1, 0..=1; below 1 only where order 1 alone exceeds the exact flux.
    pub order1_scale: f64,
    /// Factor for order 2, 0..=1.
    pub order2_scale: f64,
    /// Flux of the orders 3 and up as a fraction of the incident irradiance, >= 0.
    pub higher_flux: f64,
}

/// Completions for one sun; one entry per optical-depth node of the [`FluxTable`].
#[derive(Clone, Debug, PartialEq)]
pub struct Closure {
    /// Light leaving through the sunlit side.
    pub reflected: Vec<Completion>,
    /// Light leaving through the far side, besides the unscattered light `exp(-tau/mu_l)` and the light scattered only inside the
    /// forward peak, `exp(-(1 - P_f) tau/mu_l) - exp(-tau/mu_l)`.
    pub transmitted: Vec<Completion>,
}

/// Fluxes of orders 1 and 2 on both sides, as fractions of the incident irradiance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OrderFluxes {
    /// Reflected: orders 1 and 2.
    pub reflected: [f64; 2],
    /// Transmitted: orders 1 and 2.
    pub transmitted: [f64; 2],
}

impl LowOrders<'_> {
    /// Closes the orders for the sun at `mu_sun` (clamped to 1e-4..=1).
    #[must_use]
    pub fn close(&self, mu_sun: f64) -> Closure {
        let mu_sun = mu_sun.clamp(1e-4, 1.0);
        let depths = FluxTable::optical_depths();
        let orders = self.fluxes(&depths, mu_sun);
        let mut closure =
            Closure { reflected: Vec::with_capacity(depths.len()), transmitted: Vec::with_capacity(depths.len()) };
        for (depth, orders) in depths.iter().zip(&orders) {
            let [reflected, transmitted] = self.totals.beam(*depth, mu_sun);
            // The table interpolates in mu, the exponential does not, and the fit knows of neither: where nearly nothing is scattered the
            // transmittance may come out below the unscattered light. Reflection gives way then.
            let straight = (-self.modified_depth(*depth) / mu_sun).exp();
            let reflected = (reflected - (straight - transmitted).max(0.0)).max(0.0);
            let transmitted = transmitted.max(straight);
            closure.reflected.push(complete(reflected, orders.reflected));
            closure.transmitted.push(complete(transmitted - straight, orders.transmitted));
        }
        closure
    }

    /// Fluxes of orders 1 and 2 at the given true optical depths.
    #[must_use]
    pub fn fluxes(&self, optical_depths: &[f64], mu_sun: f64) -> Vec<OrderFluxes> {
        let views = self.views(mu_sun);
        let (once, twice) = (self.albedo / mu_sun, self.albedo * self.albedo / mu_sun);
        let of_depth = |depth: &f64| {
            let depth = self.modified_depth(*depth);
            let mut fluxes = OrderFluxes::default();
            for view in &views {
                fluxes.reflected[0] += view.reflected[0] * order1_reflected(depth, mu_sun, view.mu);
                fluxes.reflected[1] += view.reflected[1] * order2_reflected(depth, mu_sun, view.mu);
                fluxes.transmitted[0] += view.transmitted[0] * order1_transmitted(depth, mu_sun, view.mu);
                fluxes.transmitted[1] += view.transmitted[1] * order2_transmitted(depth, mu_sun, view.mu);
            }
            for side in [&mut fluxes.reflected, &mut fluxes.transmitted] {
                side[0] *= once;
                side[1] *= twice;
            }
            fluxes
        };
        optical_depths.iter().map(of_depth).collect()
    }

    fn modified_depth(&self, optical_depth: f64) -> f64 {
        (1.0 - self.forward_fraction) * optical_depth
    }

    /// Phase functions integrated over the azimuth, at the zenith nodes, with their flux weights. They serve every optical depth.
    fn views(&self, mu_sun: f64) -> Vec<View> {
        let zenith_sun = mu_sun.acos();
        let mut ends = vec![0.0, FRAC_PI_2, zenith_sun];
        ends.extend([zenith_sun - self.forward_edge, zenith_sun + self.forward_edge, self.forward_edge - zenith_sun]);
        ends.retain(|end| (0.0..=FRAC_PI_2).contains(end));
        ends.sort_by(f64::total_cmp);
        // Wide panels are cut evenly.
        let mut cuts = vec![0.0];
        for pair in ends.windows(2) {
            let pieces = ((pair[1] - pair[0]) / PANEL_WIDTH).ceil();
            cuts.extend((1..=pieces as usize).map(|k| pair[0] + (pair[1] - pair[0]) * k as f64 / pieces));
        }
        let azimuths = gauss_legendre(AZIMUTH_NODES);
        let mut views = Vec::new();
        for (zenith, weight) in panels(&cuts, &gauss_legendre(ZENITH_NODES)) {
            let (sine, mu) = zenith.sin_cos();
            // cos T = +-mu mu_l + s s_l cos(phi), + for transmitted light.
            let slope = sine * zenith_sun.sin();
            let side = |offset: f64| {
                let crossing = (self.forward_edge.cos() - offset) / slope;
                let ends = if crossing.abs() < 1.0 { vec![0.0, crossing.acos(), PI] } else { vec![0.0, PI] };
                let mut sums = [0.0; 2];
                for (azimuth, weight) in panels(&ends, &azimuths) {
                    let angle = (offset + slope * azimuth.cos()).clamp(-1.0, 1.0).acos();
                    // Two half turns.
                    sums[0] += 2.0 * weight * (self.order1_phase)(angle);
                    sums[1] += 2.0 * weight * (self.order2_phase)(angle);
                }
                sums.map(|sum| sum * mu * sine * weight)
            };
            views.push(View { mu, reflected: side(-mu * mu_sun), transmitted: side(mu * mu_sun) });
        }
        views
    }
}

/// A zenith node: flux weight times azimuth integral of the phase functions of orders 1 and 2.
struct View {
    mu: f64,
    reflected: [f64; 2],
    transmitted: [f64; 2],
}

/// Nodes and weights of a rule repeated between neighbouring `ends`.
fn panels(ends: &[f64], rule: &Rule) -> Vec<(f64, f64)> {
    let panel = |pair: &[f64]| {
        let (start, width) = (pair[0], pair[1] - pair[0]);
        let nodes = rule.nodes.iter().zip(&rule.weights);
        nodes.map(move |(node, weight)| (start + width * node, width * weight)).collect::<Vec<_>>()
    };
    ends.windows(2).filter(|pair| pair[1] > pair[0]).flat_map(panel).collect()
}

/// Fills `exact` with order 1, then order 2, then the rest.
fn complete(exact: f64, [order1, order2]: [f64; 2]) -> Completion {
    // The share of an order that fits into what is left; an order without flux keeps its factor.
    let share = |left: f64, order: f64| {
        if order > left { (left / order).max(0.0) } else { 1.0 }
    };
    let order1_scale = share(exact, order1);
    let left = (exact - order1).max(0.0);
    let order2_scale = share(left, order2);
    Completion { order1_scale, order2_scale, higher_flux: (left - order2).max(0.0) }
}
