//! Diffuse light of clear air for every height, sun and direction.
//!
//! In a shell lit by parallel light, diffuse radiance depends on height, local sun and direction only, and light that
//! is scattered again needs only low angular moments of it. So one table over (height, sun) serves all suns and eyes,
//! twilight included. Light scattered once is integrated along the view with the whole phase function.

use super::air::{Air, twilight};
use super::axes::Axes;
use super::contraction::{Contracted, azimuth_cosine, weigh};
use super::field::{Field, Sums, SunSeries, TENSOR};
use super::harmonics::{Harmonics, count};
use super::isotropic::Isotropic;
use super::methods::SkyModel;
use super::quality::{DEGREES, Quality, Resolution};
use super::solve::{ORDERS_AT_MOST, all_orders};
use crate::method::AirMethod;

/// The solved table of one wavelength.
#[derive(Clone, Debug)]
pub struct Moments {
    /// The air it was solved for.
    pub air: Air,
    /// Rayleigh's polarisation was followed.
    pub polarised: bool,
    /// The table.
    pub field: Field,
    down: SunSeries,
    /// The polynomials up to the table's degree.
    pub harmonics: Harmonics,
}

impl Moments {
    /// Solves the table. `progress` hears fractions up to 1. The result does not depend on the number of threads.
    ///
    /// `polarised: false` treats light as a scalar, as many programs do: up to 8 % off at 440 nm.
    #[must_use]
    pub fn solve(air: Air, quality: Quality, polarised: bool, progress: &(dyn Fn(f64) + Sync)) -> Self {
        Self::orders(air, quality, polarised, ORDERS_AT_MOST, progress)
    }

    /// The table as a method fills it: whatever reads it then shows what that method makes of the air.
    #[must_use]
    pub fn by(method: AirMethod, air: Air, quality: Quality, polarised: bool, progress: &(dyn Fn(f64) + Sync)) -> Self {
        match method {
            AirMethod::Moments => Self::solve(air, quality, polarised, progress),
            // The table's light is that which is scattered once more when it is read.
            AirMethod::SecondOrder => Self::orders(air, quality, polarised, 1, progress),
            AirMethod::Isotropic => {
                let sum = Isotropic::new(air.clone());
                Self::even(air, quality, polarised, |height_m, sun| sum.mean(height_m, sun), |sun| sum.irradiance(sun))
            }
            AirMethod::Single => Self::even(air, quality, polarised, |_, _| 0.0, |_| 0.0),
        }
    }

    fn orders(air: Air, quality: Quality, polarised: bool, at_most: usize, progress: &(dyn Fn(f64) + Sync)) -> Self {
        let resolution = Resolution::new(quality, &air.medium);
        // The inner loops are compiled for each degree: they run over arrays of known length.
        let (field, down) = match resolution.degree {
            l if l <= DEGREES[0] => all_orders::<9>(&air, resolution, polarised, at_most, progress),
            l if l <= DEGREES[1] => all_orders::<13>(&air, resolution, polarised, at_most, progress),
            _ => all_orders::<17>(&air, resolution, polarised, at_most, progress),
        };
        Self { air, polarised, harmonics: Harmonics::new(field.degree), field, down }
    }

    /// Light that comes from everywhere alike: its mean radiance by height and sun, and the irradiance on the boundary by sun.
    fn even(
        air: Air,
        quality: Quality,
        polarised: bool,
        mean: impl Fn(f64, f64) -> f64,
        irradiance: impl Fn(f64) -> f64,
    ) -> Self {
        let Resolution { degree, heights, suns, .. } = Resolution::new(quality, &air.medium);
        let axes = Axes { floor_m: air.floor_m(), heights, suns };
        let mut sums = Sums::zero(axes, degree);
        let (stride, moments) = (sums.stride(), sums.moments);
        for (i, node) in sums.values.chunks_exact_mut(stride).enumerate() {
            let mean = mean(axes.height_m(i / suns), axes.sun_cosine(i % suns));
            node[0] = mean;
            node[moments..moments + 3].fill(mean / 3.0);
        }
        let down = SunSeries::new(axes, (0..suns).map(|sun| irradiance(axes.sun_cosine(sun))));
        let field = Field::new(axes, degree, &sums);
        Self { air, polarised, harmonics: Harmonics::new(degree), field, down }
    }

    /// The table as numbers, to be kept.
    #[must_use]
    pub fn to_numbers(&self) -> Vec<f64> {
        [&self.field.ln_mean[..], &self.field.ratios, self.down.logarithms()].concat()
    }

    /// Restores a table that was solved with these settings; `None` where the numbers are not such a one.
    #[must_use]
    pub fn from_numbers(air: Air, quality: Quality, polarised: bool, numbers: &[f64]) -> Option<Self> {
        let Resolution { degree, heights, suns, .. } = Resolution::new(quality, &air.medium);
        let axes = Axes { floor_m: air.floor_m(), heights, suns };
        let nodes = heights * suns;
        let ratios = nodes * (count(degree) + TENSOR);
        if numbers.len() != nodes + ratios + suns || !numbers.iter().all(|number| number.is_finite()) {
            return None;
        }
        let (ln_mean, rest) = numbers.split_at(nodes);
        let (ratios, down) = rest.split_at(ratios);
        let field = Field { axes, degree, ln_mean: ln_mean.to_vec(), ratios: ratios.to_vec() };
        let down = SunSeries::from_logarithms(axes, down.to_vec());
        Some(Self { air, polarised, field, down, harmonics: Harmonics::new(degree) })
    }

    fn source<const N: usize>(&self, height_m: f64, sun_cosine: f64, view_cosine: f64, cosine: f64) -> f64 {
        let Some(sun) = self.field.axes.sun(sun_cosine) else { return 0.0 };
        let coefficients = self.air.profile.at(height_m);
        let mut weights = vec![0.0; count(self.field.degree)];
        self.harmonics.evaluate(view_cosine, &mut weights);
        weigh(&mut weights, self.field.degree, coefficients, &self.air.medium.aerosol, self.polarised);
        let rayleigh = if self.polarised { coefficients.rayleigh } else { 0.0 };
        let mut nodes = [Contracted::<N>::ZERO; 2];
        let place = self.field.axes.height(height_m);
        Contracted::fill(&self.field, place, sun.index..sun.index + 2, &weights, rayleigh, &mut nodes);
        let q = cosine - view_cosine * sun_cosine;
        let view_square = (1.0 - view_cosine) * (1.0 + view_cosine);
        let sun_square = (1.0 - sun_cosine) * (1.0 + sun_cosine);
        let pair = [&nodes[0], &nodes[1]];
        let s = view_square * sun_square;
        let [scattered, _] = Contracted::between([pair, pair], [sun.fraction; 2], [q; 2], [s; 2]);
        let sine = view_square.sqrt();
        scattered.radiance(view_cosine, sine, azimuth_cosine(q, sine, sun_square.sqrt())).max(0.0)
    }
}

impl SkyModel for Moments {
    fn air(&self) -> &Air {
        &self.air
    }

    fn source(&self, height_m: f64, sun_cosine: f64, view_cosine: f64, cosine: f64) -> f64 {
        match self.field.degree {
            8 => self.source::<9>(height_m, sun_cosine, view_cosine, cosine),
            12 => self.source::<13>(height_m, sun_cosine, view_cosine, cosine),
            _ => self.source::<17>(height_m, sun_cosine, view_cosine, cosine),
        }
    }

    fn irradiance(&self, sun_cosine: f64) -> f64 {
        self.down.at(sun_cosine) * twilight(self.air.floor_m(), sun_cosine)
    }
}
