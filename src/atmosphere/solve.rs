//! All orders of scattering, one after the other.

use std::f64::consts::PI;

use super::air::Air;
use super::axes::{Axes, Place};
use super::contraction::{Contracted, Scattered, weigh};
use super::depth::DepthRow;
use super::field::{Field, Sums, SunSeries};
use super::gather::{Gather, Ray, Source};
use super::harmonics::{count, legendre_sum};
use super::profile::rayleigh_phase_per_sr;
use super::quality::Resolution;

/// Orders are added until the ratio of neighbouring ones changes by less than this; then the rest is a geometric
/// series.
const RATIO_SETTLED: f64 = 0.005;
/// No more orders than this; the ratio settles within about ten in the thickest air over the brightest ground.
pub(super) const ORDERS_AT_MOST: usize = 40;

/// The sun's beam scattered once, or reflected once by the boundary.
struct Beam<'a> {
    air: &'a Air,
    ray: &'a Ray,
    rows: Vec<DepthRow<'a>>,
    degree: usize,
    polarised: bool,
}

impl<'a> Beam<'a> {
    fn new(gather: &Gather<'a>, ray: &'a Ray) -> Self {
        let rows = ray.samples.iter().map(|sample| gather.air.depth.at(sample.height_m)).collect();
        Self { air: gather.air, ray, rows, degree: gather.degree, polarised: gather.polarised }
    }

    #[inline]
    fn once(&self, sample: usize, sun_cosine: f64, q: f64, phase: f64) -> Scattered {
        let transmittance = self.rows[sample].transmittance(sun_cosine);
        let sample = &self.ray.samples[sample];
        let aerosol = transmittance * sample.weight.aerosol * phase;
        if self.polarised {
            // 1.5 b_R M with M = T (1 - s s^T) / 8 pi.
            let unit = 1.5 * transmittance * sample.weight.rayleigh / (8.0 * PI);
            let square = (1.0 - sun_cosine) * (1.0 + sun_cosine);
            let xz = -unit * sun_cosine * square.sqrt();
            Scattered { plain: aerosol, tensor: [unit * sun_cosine * sun_cosine, unit, unit * square, xz] }
        } else {
            let rayleigh = rayleigh_phase_per_sr(q + sample.cosine * sun_cosine);
            Scattered { plain: aerosol + transmittance * sample.weight.rayleigh * rayleigh, tensor: [0.0; 4] }
        }
    }
}

impl Source for Beam<'_> {
    fn phase(&self, cosine: f64) -> f64 {
        legendre_sum(|l| self.air.medium.aerosol.moment(l), self.degree, cosine) / (4.0 * PI)
    }

    fn scattered(&self, sample: usize, sun: [f64; 2], q: [f64; 2], _: [f64; 2], phase: [f64; 2]) -> [Scattered; 2] {
        [self.once(sample, sun[0], q[0], phase[0]), self.once(sample, sun[1], q[1], phase[1])]
    }

    fn boundary(&self, sun_cosine: f64) -> f64 {
        if sun_cosine > 0.0 {
            (self.air.boundary.beam_albedo)(sun_cosine) / PI * self.air.beam_on_boundary(sun_cosine)
        } else {
            0.0
        }
    }
}

/// Light of the order before, from its table alone.
struct Diffuse<'a, const N: usize> {
    axes: Axes,
    /// Sun nodes of each sample of the ray.
    nodes: Vec<Contracted<N>>,
    down: &'a SunSeries,
    albedo: f64,
}

impl<'a, const N: usize> Diffuse<'a, N> {
    fn new(gather: &Gather<'_>, ray: &Ray, field: &Field, down: &'a SunSeries) -> Self {
        let suns = field.axes.suns;
        let mut nodes = vec![Contracted::ZERO; ray.samples.len() * suns];
        let mut weights = vec![0.0; count(gather.degree)];
        for (sample, out) in ray.samples.iter().zip(nodes.chunks_exact_mut(suns)) {
            gather.harmonics.evaluate(sample.cosine, &mut weights);
            weigh(&mut weights, gather.degree, sample.weight, &gather.air.medium.aerosol, gather.polarised);
            let rayleigh = if gather.polarised { sample.weight.rayleigh } else { 0.0 };
            Contracted::fill(field, sample.place, 0..suns, &weights, rayleigh, out);
        }
        Self { axes: field.axes, nodes, down, albedo: gather.air.boundary.diffuse_albedo }
    }
}

impl<const N: usize> Source for Diffuse<'_, N> {
    fn phase(&self, _: f64) -> f64 {
        0.0
    }

    #[inline]
    fn scattered(&self, sample: usize, sun: [f64; 2], q: [f64; 2], s: [f64; 2], _: [f64; 2]) -> [Scattered; 2] {
        let nodes = &self.nodes[sample * self.axes.suns..][..self.axes.suns];
        let places = sun.map(|sun| self.axes.sun(sun));
        let [first, second] = places.map(|place| place.unwrap_or_default());
        let pair = |place: Place| [&nodes[place.index], &nodes[place.index + 1]];
        let mut out = Contracted::between([pair(first), pair(second)], [first.fraction, second.fraction], q, s);
        for (out, place) in out.iter_mut().zip(places) {
            if place.is_none() {
                *out = Scattered::default();
            }
        }
        out
    }

    fn boundary(&self, sun_cosine: f64) -> f64 {
        self.albedo / PI * self.down.at(sun_cosine)
    }
}

/// All orders up to one of them: the field, and the diffuse irradiance on the boundary by sun.
pub(super) fn all_orders<const N: usize>(
    air: &Air,
    resolution: Resolution,
    polarised: bool,
    at_most: usize,
    progress: &(dyn Fn(f64) + Sync),
) -> (Field, SunSeries) {
    let axes = Axes { floor_m: air.floor_m(), heights: resolution.heights, suns: resolution.suns };
    let gather = Gather::new(air, axes, resolution, polarised);
    let series = |sums: &Sums| SunSeries::new(axes, (0..axes.suns).map(|sun| sums.down(sun)));
    let mut latest = gather.order(|ray| Beam::new(&gather, ray));
    let mut all = Sums::zero(axes, resolution.degree);
    let mut ratio = 0.0;
    let mut order = 1;
    loop {
        let expected = if order < resolution.orders { resolution.orders + 1 } else { order + 1 };
        progress(order as f64 / expected as f64);
        let total = latest.total();
        if total <= 0.0 || order == at_most {
            break;
        }
        all.add(1.0, &latest);
        let (field, down) = (Field::new(axes, resolution.degree, &latest), series(&latest));
        let next = gather.order(|ray| Diffuse::<N>::new(&gather, ray, &field, &down));
        order += 1;
        let before = ratio;
        ratio = next.total() / total;
        latest = next;
        if order >= resolution.orders && (ratio - before).abs() < RATIO_SETTLED {
            break;
        }
    }
    // The light of the orders that were left out falls off like the last ones.
    all.add(1.0 / (1.0 - ratio.min(0.99)), &latest);
    progress(1.0);
    (Field::new(axes, resolution.degree, &all), series(&all))
}
