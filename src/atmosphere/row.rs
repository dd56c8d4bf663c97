//! All azimuths of one elevation for one sun: what a row of a sky texture holds.
//!
//! Heights and local zenith angles are the same for all azimuths of a row, so the source is contracted once per
//! sample, and only for the sun nodes that the row can meet.

use super::axes::Place;
use super::contraction::{Contracted, Scattered, azimuth_cosine, weigh};
use super::geometry::{radius_m, sin_dip};
use super::harmonics::count;
use super::path::{Limits, Path, Target, step_weight};
use super::profile::{Coefficients, rayleigh_phase_per_sr};
use super::under::Sky;

/// An eye and a sun.
#[derive(Clone, Copy, Debug)]
pub struct Viewpoint {
    /// Height of the eye, m.
    pub eye_m: f64,
    /// Cosine of the sun's zenith angle at the eye.
    pub sun_cosine: f64,
    /// Where rays end.
    pub limits: Limits,
    /// Steps along a ray.
    pub steps: usize,
}

/// Integrals along the views of one elevation, by azimuth.
#[derive(Clone, Debug)]
pub struct Row {
    /// Radiance without the aerosol's single scattering: `integral of (b_R P_R T_sun + J) T ds`, 1/sr.
    pub sky: Vec<f64>,
    /// The aerosol's single scattering without its phase function: `integral of b_A T_sun T ds`.
    pub aureole: Vec<f64>,
    /// Cosine between view and sun.
    pub cosines: Vec<f64>,
    /// Local sun's cosine at the end of the ray.
    pub sun_at_end: Vec<f64>,
    /// Transmittance from the eye to the end.
    pub transmittance: f64,
    /// What is at the end.
    pub target: Target,
}

impl Viewpoint {
    /// Sine of the dip of the horizon of the floor, as seen by the eye.
    #[must_use]
    pub fn sin_dip(&self) -> f64 {
        sin_dip(self.eye_m, self.limits.floor_m)
    }

    /// Integrates the row at a view cosine for azimuths (from the sun's) with the cosines given.
    #[must_use]
    pub fn row<'a>(&self, sky: impl Into<Sky<'a>>, cosine: f64, azimuths: &[f64]) -> Row {
        let sky = sky.into();
        match sky.above.field.degree {
            8 => self.contracted_row::<9>(sky, cosine, azimuths),
            12 => self.contracted_row::<13>(sky, cosine, azimuths),
            _ => self.contracted_row::<17>(sky, cosine, azimuths),
        }
    }

    fn contracted_row<const N: usize>(&self, sky: Sky<'_>, cosine: f64, azimuths: &[f64]) -> Row {
        let square = |cosine: f64| ((1.0 - cosine) * (1.0 + cosine)).max(0.0);
        let sines = (square(cosine) * square(self.sun_cosine)).sqrt();
        let cosines: Vec<f64> = azimuths.iter().map(|c| cosine * self.sun_cosine + sines * c).collect();
        let (least, greatest) = cosines.iter().fold((1.0_f64, -1.0_f64), |(a, b), &c| (a.min(c), b.max(c)));
        let molecules: Vec<f64> = cosines.iter().map(|&c| rayleigh_phase_per_sr(c)).collect();
        let path = Path::new(self.eye_m, cosine, self.limits, self.steps);
        let mut row = Row {
            sky: vec![0.0; azimuths.len()],
            aureole: vec![0.0; azimuths.len()],
            cosines,
            sun_at_end: Vec::new(),
            transmittance: 1.0,
            target: path.target,
        };
        let mut weights = vec![0.0; count(sky.above.field.degree)];
        let mut nodes = vec![Contracted::<N>::ZERO; sky.above.field.axes.suns];
        for step in &path.steps {
            let from_zenith = radius_m(self.eye_m) / radius_m(step.height_m) * self.sun_cosine;
            let (moments, shade) = sky.at(step.height_m, from_zenith.clamp(-1.0, 1.0));
            let (air, field) = (&moments.air, &moments.field);
            let at = air.profile.at(step.height_m);
            let (integral, kept) = step_weight(at.extinction, step.length_m);
            let factor = row.transmittance * integral;
            row.transmittance *= kept;
            let weight = Coefficients { rayleigh: at.rayleigh * factor, aerosol: at.aerosol * factor, extinction: 0.0 };
            let from_ray = step.distance_m / radius_m(step.height_m);
            let local = |c: f64| (from_zenith + from_ray * c).clamp(-1.0, 1.0);

            let used = field.axes.sun_nodes(local(least), local(greatest));
            let first = used.start;
            moments.harmonics.evaluate(step.cosine, &mut weights);
            weigh(&mut weights, field.degree, weight, &air.medium.aerosol, moments.polarised);
            let tensor = if moments.polarised { weight.rayleigh } else { 0.0 };
            Contracted::fill(field, field.axes.height(step.height_m), used, &weights, tensor, &mut nodes);

            let depths = air.depth.at(step.height_m);
            let (lit, clear) = shade.map_or((1.0, 1.0), |shade| (shade.beam, shade.clear));
            let asymmetry = air.medium.aerosol.moment(1);
            let of_clouds = shade.map_or(0.0, |shade| shade.scattered(weight, asymmetry, step.cosine));
            let view_square = square(step.cosine);
            let sine = view_square.sqrt();
            // Two azimuths at once; the last of an odd number is computed twice.
            for i in (0..row.cosines.len()).step_by(2) {
                let columns = [i, (i + 1).min(row.cosines.len() - 1)];
                let c = columns.map(|column| row.cosines[column]);
                let sun = c.map(local);
                let places = sun.map(|sun| field.axes.sun(sun));
                let q = [c[0] - step.cosine * sun[0], c[1] - step.cosine * sun[1]];
                let sun_square = sun.map(square);
                let mut scattered = [Scattered::default(); 2];
                if places.iter().any(Option::is_some) {
                    let [one, two] = places.map(|place| place.unwrap_or(Place { index: first, fraction: 0.0 }));
                    let pair = |place: Place| [&nodes[place.index - first], &nodes[place.index - first + 1]];
                    let s = sun_square.map(|square| view_square * square);
                    scattered = Contracted::between([pair(one), pair(two)], [one.fraction, two.fraction], q, s);
                }
                for k in 0..columns[1] - columns[0] + 1 {
                    let column = columns[k];
                    let beam = lit * depths.transmittance(sun[k]);
                    row.aureole[column] += weight.aerosol * beam;
                    row.sky[column] += weight.rayleigh * beam * molecules[column] + of_clouds;
                    if places[k].is_some() {
                        let azimuth = azimuth_cosine(q[k], sine, sun_square[k].sqrt());
                        row.sky[column] += clear * scattered[k].radiance(step.cosine, sine, azimuth).max(0.0);
                    }
                }
            }
        }
        let end_m = if path.target == Target::Floor { self.limits.floor_m } else { self.limits.ceiling_m };
        let (from_zenith, from_ray) = (radius_m(self.eye_m) / radius_m(end_m), path.length_m / radius_m(end_m));
        let at_end = row.cosines.iter().map(|c| from_zenith * self.sun_cosine + from_ray * c);
        row.sun_at_end = at_end.collect();
        row
    }
}
