//! One order of scattering at the nodes of the table: light from all directions, summed into moments.
//!
//! Along a straight ray the plane of ray and zenith is the same at all points, and so is the side of it on which the
//! sun stands. So the coherency of polarised light needs no rotation on the way: its components along and across that
//! plane add up.

use std::f64::consts::PI;

use rayon::prelude::*;

use super::air::Air;
use super::axes::{Axes, Place};
use super::contraction::{Scattered, azimuth_cosine};
use super::directions::around_horizon;
use super::field::{Sums, TENSOR};
use super::geometry::radius_m;
use super::harmonics::{Harmonics, index};
use super::path::{Path, Target, step_weight};
use super::profile::Coefficients;
use super::quality::Resolution;

/// A sample on a ray of a node.
#[derive(Clone, Debug)]
pub struct Sample {
    /// Height, m.
    pub height_m: f64,
    /// Height on the table.
    pub place: Place,
    /// Local cosine of the ray.
    pub cosine: f64,
    /// Local sine of the ray.
    pub sine: f64,
    /// Coefficients times the transmittance to the node, integrated over the step.
    pub weight: Coefficients,
    /// The local sun's cosine is `from_zenith mu_s + from_ray c`.
    from_zenith: f64,
    from_ray: f64,
}

/// A ray that ends at a node.
#[derive(Clone, Debug)]
pub struct Ray {
    cosine: f64,
    sine: f64,
    /// Weight of the quadrature over the cosine.
    weight: f64,
    /// Samples from the node outwards.
    pub samples: Vec<Sample>,
    /// Transmittance to the boundary and the two factors of the sun's cosine there.
    boundary: Option<[f64; 3]>,
}

/// All rays of all nodes, and the sums over azimuth.
#[derive(Debug)]
pub struct Gather<'a> {
    /// The air.
    pub air: &'a Air,
    /// The nodes.
    pub axes: Axes,
    /// Degree of the moments.
    pub degree: usize,
    /// Follow Rayleigh's polarisation.
    pub polarised: bool,
    /// The polynomials.
    pub harmonics: Harmonics,
    rays: Vec<Vec<Ray>>,
    /// Cosine and sine of an azimuth, and `cos(m phi)`.
    azimuths: Vec<(f64, f64, Vec<f64>)>,
}

/// What scatters along a ray: an order of the light.
pub trait Source: Sync {
    /// The cut phase function of the sun's beam for a cosine between ray and sun, per steradian, if the source needs
    /// it.
    fn phase(&self, cosine: f64) -> f64;
    /// Light scattered into the ray at a sample, `q` and `s` as in [`super::harmonics`].
    fn scattered(
        &self,
        sample: usize,
        sun_cosine: [f64; 2],
        q: [f64; 2],
        s: [f64; 2],
        phase: [f64; 2],
    ) -> [Scattered; 2];
    /// Radiance of the boundary.
    fn boundary(&self, sun_cosine: f64) -> f64;
}

impl<'a> Gather<'a> {
    /// Lays out the rays.
    #[must_use]
    pub fn new(air: &'a Air, axes: Axes, resolution: Resolution, polarised: bool) -> Self {
        let rays = (0..axes.heights).map(|height| {
            let height_m = axes.height_m(height);
            let directions = around_horizon(height_m, axes.floor_m, resolution.directions).into_iter();
            directions.map(|(cosine, weight)| Ray::new(air, axes, height_m, cosine, weight, resolution.steps)).collect()
        });
        let azimuths = (0..resolution.azimuths).map(|k| {
            let angle = PI * (k as f64 + 0.5) / resolution.azimuths as f64;
            (angle.cos(), angle.sin(), (0..=resolution.degree).map(|m| (m as f64 * angle).cos()).collect())
        });
        Self {
            air,
            axes,
            degree: resolution.degree,
            polarised,
            harmonics: Harmonics::new(resolution.degree),
            rays: rays.collect(),
            azimuths: azimuths.collect(),
        }
    }

    /// Sums one order; `source` makes the order's source for a ray. The result does not depend on the number of
    /// threads.
    pub fn order<'s, S: Source>(&'s self, source: impl Fn(&'s Ray) -> S + Sync) -> Sums {
        let mut sums = Sums::zero(self.axes, self.degree);
        let stride = sums.stride();
        sums.values.par_chunks_mut(self.axes.suns * stride).zip(&self.rays).for_each(|(values, rays)| {
            let parts: Vec<Vec<f64>> = rays.par_iter().map(|ray| self.ray(ray, &source(ray), stride)).collect();
            for part in parts {
                for (value, part) in values.iter_mut().zip(part) {
                    *value += part;
                }
            }
            // The moments are stored without the sun's sine.
            for (sun, values) in values.chunks_exact_mut(stride).enumerate() {
                let cosine = self.axes.sun_cosine(sun);
                let sine = ((1.0 - cosine) * (1.0 + cosine)).sqrt();
                for l in 1..=self.degree {
                    let mut power = 1.0;
                    for m in 1..=l {
                        power *= sine;
                        values[index(l, m)] /= power;
                    }
                }
            }
        });
        sums
    }

    /// What one ray adds to its node, for all suns.
    fn ray<S: Source>(&self, ray: &Ray, source: &S, stride: usize) -> Vec<f64> {
        let mut values = vec![0.0; self.axes.suns * stride];
        let tensor_at = stride - TENSOR - 1;
        let mut shapes = vec![0.0; tensor_at];
        self.harmonics.evaluate(ray.cosine, &mut shapes);
        for l in 1..=self.degree {
            let mut power = 1.0;
            for shape in &mut shapes[index(l, 1)..index(l + 1, 0)] {
                power *= ray.sine;
                *shape *= power;
            }
        }
        let share = 0.5 * ray.weight / self.azimuths.len() as f64;
        let (mu, sine) = (ray.cosine, ray.sine);
        let mut by_order = vec![0.0; self.degree + 1];
        for (sun, values) in values.chunks_exact_mut(stride).enumerate() {
            let sun_cosine = self.axes.sun_cosine(sun);
            let sun_sine = ((1.0 - sun_cosine) * (1.0 + sun_cosine)).sqrt();
            by_order.fill(0.0);
            for pair in self.azimuths.chunks_exact(2) {
                let to_sun = |k: usize| mu * sun_cosine + sine * sun_sine * pair[k].0;
                let sums = ray.add_up(source, sun_cosine, [to_sun(0), to_sun(1)]);
                for ([tt, pp, tp], (c, s, multiples)) in sums.into_iter().zip(pair) {
                    for (sum, multiple) in by_order.iter_mut().zip(multiples) {
                        *sum += share * (tt + pp) * multiple;
                    }
                    let tensor = [
                        tt * mu * mu * c * c + pp * s * s - 2.0 * tp * mu * c * s,
                        tt * mu * mu * s * s + pp * c * c + 2.0 * tp * mu * c * s,
                        tt * sine * sine,
                        tp * sine * s - tt * mu * c * sine,
                    ];
                    for (sum, value) in values[tensor_at..].iter_mut().zip(tensor) {
                        *sum += share * value;
                    }
                }
            }
            let mut rest = &shapes[..];
            for l in 0..=self.degree {
                let (row, next) = rest.split_at(l + 1);
                for ((value, shape), sum) in values[index(l, 0)..].iter_mut().zip(row).zip(&by_order) {
                    *value = shape * sum;
                }
                rest = next;
            }
            values[tensor_at + TENSOR] = 4.0 * PI * mu.max(0.0) * by_order[0];
        }
        values
    }
}

impl Ray {
    fn new(air: &Air, axes: Axes, height_m: f64, cosine: f64, weight: f64, steps: usize) -> Self {
        let path = Path::to_space(height_m, cosine, axes.floor_m, steps);
        let mut transmittance = 1.0;
        let samples = path.steps.iter().map(|step| {
            let at = air.profile.at(step.height_m);
            let (integral, kept) = step_weight(at.extinction, step.length_m);
            let factor = transmittance * integral;
            transmittance *= kept;
            Sample {
                height_m: step.height_m,
                place: axes.height(step.height_m),
                cosine: step.cosine,
                sine: ((1.0 - step.cosine) * (1.0 + step.cosine)).sqrt(),
                weight: Coefficients { rayleigh: at.rayleigh * factor, aerosol: at.aerosol * factor, extinction: 0.0 },
                from_zenith: radius_m(height_m) / radius_m(step.height_m),
                from_ray: step.distance_m / radius_m(step.height_m),
            }
        });
        let samples = samples.collect();
        let boundary = (path.target == Target::Floor).then(|| {
            let from_ray = path.length_m / radius_m(axes.floor_m);
            [transmittance, radius_m(height_m) / radius_m(axes.floor_m), from_ray]
        });
        Self { cosine, sine: ((1.0 - cosine) * (1.0 + cosine)).sqrt(), weight, samples, boundary }
    }

    /// Components `tt`, `pp`, `tp` of the light that arrives for two azimuths, for a sun with a cosine at the node and
    /// `cosines` to the ray.
    #[inline]
    fn add_up<S: Source>(&self, source: &S, sun_at_node: f64, cosines: [f64; 2]) -> [[f64; 3]; 2] {
        let phase = cosines.map(|c| source.phase(c));
        let mut sums = [[0.0; 3]; 2];
        for (i, sample) in self.samples.iter().enumerate() {
            let sun = cosines.map(|c| (sample.from_zenith * sun_at_node + sample.from_ray * c).clamp(-1.0, 1.0));
            let q = [cosines[0] - sample.cosine * sun[0], cosines[1] - sample.cosine * sun[1]];
            let sun_square = sun.map(|sun| (1.0 - sun) * (1.0 + sun));
            let s = sun_square.map(|square| sample.sine * sample.sine * square);
            let scattered = source.scattered(i, sun, q, s, phase);
            for k in 0..2 {
                let azimuth = azimuth_cosine(q[k], sample.sine, sun_square[k].sqrt());
                let across = scattered[k].across(sample.cosine, sample.sine, azimuth);
                sums[k][0] += across.tt;
                sums[k][1] += across.pp;
                sums[k][2] += across.tp;
            }
        }
        if let Some([transmittance, from_zenith, from_ray]) = self.boundary {
            for (sums, cosine) in sums.iter_mut().zip(cosines) {
                let half = 0.5 * transmittance * source.boundary(from_zenith * sun_at_node + from_ray * cosine);
                sums[0] += half;
                sums[1] += half;
            }
        }
        sums
    }
}
