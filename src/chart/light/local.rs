//! What was done in 2006 instead: light of each column by itself, its first orders by the normal of the cloud's top, and
//! shadows by the vertical column that the shifted ground point meets.

use super::scenes::{BASE_M, EXTENT_M, EXTINCTION_PER_M, FINER, SIDE};
use crate::chart::medium::Medium;
use crate::reference::Map;

/// Where the column of a ground point stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shift {
    /// At base height times the sine of the sun's zenith angle, as the paper prints it.
    Sine,
    /// Times its tangent: where the ray to the sun meets the base.
    Tangent,
}

/// Light of columns under one sun.
pub(super) struct Local<'a> {
    thickness: &'a Map,
    towards_sun: [f64; 3],
    /// Transmitted by orders 0 to 2 and by all others, at even steps of thickness.
    orders: Vec<[f64; 2]>,
    step_m: f64,
}

/// Steps of thickness.
const STEPS: usize = 400;

impl<'a> Local<'a> {
    pub(super) fn new(medium: &Medium, thickness: &'a Map, towards_sun: [f64; 3]) -> Self {
        let most_m = thickness.texels.iter().map(|texel| texel[0]).fold(1.0, f64::max);
        let step_m = most_m / (STEPS - 1) as f64;
        let mu_sun = towards_sun[2];
        let (smooth_part, _) = medium.without_peak();
        let depths: Vec<f64> = (0..STEPS).map(|step| step as f64 * step_m * EXTINCTION_PER_M).collect();
        let low = medium.low_orders_at(&depths, mu_sun);
        let orders = depths.iter().zip(low).map(|(depth, low)| {
            let all = medium.fluxes.beam(*depth, mu_sun).transmittance;
            let first = (-smooth_part * depth / mu_sun).exp() + low.transmitted[0] + low.transmitted[1];
            // The closed form of order 2 may exceed what there is.
            let first = first.min(all);
            [first, all - first]
        });
        Self { thickness, towards_sun, orders: orders.collect(), step_m }
    }

    fn orders_of(&self, thickness_m: f64) -> [f64; 2] {
        let place = (thickness_m / self.step_m).clamp(0.0, (STEPS - 1) as f64);
        let low = (place as usize).min(STEPS - 2);
        let part = place - low as f64;
        [0, 1].map(|i| self.orders[low][i] + (self.orders[low + 1][i] - self.orders[low][i]) * part)
    }

    /// Means over texels of a value at points, given in uv.
    fn means(value: impl Fn([f64; 2]) -> f64 + Sync) -> Vec<f64> {
        let texel = |x: usize, y: usize| {
            let inside = |texel: usize, part: usize| (texel as f64 + (part as f64 + 0.5) / FINER as f64) / SIDE as f64;
            let sum: f64 = (0..FINER * FINER).map(|k| value([inside(x, k % FINER), inside(y, k / FINER)])).sum();
            [sum / (FINER * FINER) as f64, 0.0, 0.0, 0.0]
        };
        Map::from_fn(SIDE, SIDE, texel).texels.into_iter().map(|texel| texel[0]).collect()
    }

    /// Light at the base.
    pub(super) fn base(&self) -> Vec<f64> {
        let [east, north, up] = self.towards_sun;
        let half = 0.5 / SIDE as f64;
        let texel_m = EXTENT_M / SIDE as f64;
        Self::means(|[u, v]| {
            let at = |du: f64, dv: f64| self.thickness.sample_periodic([u + du, v + dv])[0];
            let [first, rest] = self.orders_of(at(0.0, 0.0));
            let slope_east = (at(half, 0.0) - at(-half, 0.0)) / texel_m;
            // Rows go south.
            let slope_north = (at(0.0, -half) - at(0.0, half)) / texel_m;
            let lit = (1.0 - (slope_east * east + slope_north * north) / up).max(0.0);
            lit * first + rest
        })
    }

    /// The beam on the ground.
    pub(super) fn shifted_beam(&self, shift: Shift) -> Vec<f64> {
        let [east, north, up] = self.towards_sun;
        let way = match shift {
            Shift::Sine => 1.0,
            Shift::Tangent => 1.0 / up,
        } * BASE_M
            / EXTENT_M;
        Self::means(|[u, v]| {
            let thickness_m = self.thickness.sample_periodic([u + way * east, v - way * north])[0];
            (-EXTINCTION_PER_M * thickness_m / up).exp()
        })
    }
}
