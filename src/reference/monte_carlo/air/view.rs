//! What an eye sees along a ray.

use std::sync::atomic::AtomicBool;
use std::time::Instant;

use glam::DVec3;

use super::orders::{AirOrders, OUTCOMES};
use super::paths::{Vertex, World};
use super::problem::{AirProblem, AirView, eye};
use super::ray::Ray;
use super::tensor::Tensor;
use crate::atmosphere::geometry::TOP_M;
use crate::reference::monte_carlo::error::MonteCarloError;
use crate::reference::monte_carlo::estimate::{Effort, Estimate};
use crate::reference::monte_carlo::random::Random;
use crate::reference::monte_carlo::run::{FIRST_ROUND, Watch, run};

/// Steps of the ray on each side of its lowest point.
const STEPS: usize = 1000;

/// Radiance along a ray per unit solar irradiance above the air, 1/sr.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AirRadiance {
    /// Scattered once by air and aerosol: by quadrature, good to 1e-4.
    pub order1_air: f64,
    /// Sunlight that the ground reflects into the ray, without any scattering: exact.
    pub order1_ground: f64,
    /// The part of light from behind the ray that passes along it; 0 if it meets the ground.
    pub transmittance: f64,
    /// Orders from the second on, without the first, which is 0 here.
    pub multiple: AirOrders,
    /// All light.
    pub total: Estimate,
    /// Paths.
    pub paths: u64,
}

/// Radiance along each of the `views`, with [`Effort::photons`] paths a view. Each view has random numbers of its
/// own, and its share of the time limit; it ends early when its total is within the relative error asked for.
/// `progress` hears fractions 0..=1, from any thread.
///
/// The same bits for the same seed whatever the number of threads, unless a time limit ends a run.
///
/// # Errors
/// An input out of its range, or `cancelled` was raised.
pub fn radiance(
    problem: &AirProblem<'_>,
    views: &[AirView],
    effort: &Effort,
    progress: &(dyn Fn(f64) + Sync),
    cancelled: &AtomicBool,
) -> Result<Vec<AirRadiance>, MonteCarloError> {
    problem.check()?;
    views.iter().try_for_each(AirView::check)?;
    let world = World::new(problem);
    let deadline = effort.time_limit.and_then(|time| Instant::now().checked_add(time));
    let estimate = |(i, view): (usize, &AirView)| {
        let seen = Seen::new(&world, view);
        let left = views.len() - i;
        let watch = Watch {
            // Stream 0 is that of the fluxes.
            stream: i as u64 + 1,
            first_round: FIRST_ROUND,
            time: deadline.map(|end| end.saturating_duration_since(Instant::now()) / left as u32),
            progress: &|part| progress((i as f64 + part) / views.len() as f64),
            cancelled,
        };
        let order1 = seen.order1_air + seen.order1_ground;
        let total = |multiple: AirOrders| multiple.total.plus(order1);
        let sums = run(
            effort,
            &watch,
            |random| seen.path(random),
            |sums| total(AirOrders::of(sums)).within(effort.relative_error),
        )?;
        let multiple = AirOrders::of(&sums);
        Ok(AirRadiance {
            order1_air: seen.order1_air,
            order1_ground: seen.order1_ground,
            transmittance: if seen.ground.is_some() { 0.0 } else { seen.transmittance },
            multiple,
            total: total(multiple),
            paths: sums.count,
        })
    };
    views.iter().enumerate().map(estimate).collect()
}

/// A ray cut into steps, so that the first scattering of its paths can be drawn from where it is likely.
struct Seen<'a> {
    world: &'a World<'a>,
    ray: Ray,
    direction: DVec3,
    steps: Vec<Step>,
    order1_air: f64,
    order1_ground: f64,
    /// From the eye to the end.
    transmittance: f64,
    /// Where it meets the ground.
    ground: Option<DVec3>,
}

/// A piece of the ray, with one extinction.
struct Step {
    start: f64,
    length: f64,
    extinction: f64,
    /// From the eye to the start.
    transmittance: f64,
    /// Light scattered into the ray in all steps up to and with this one, for light of radiance 1 from everywhere.
    scattered: f64,
}

impl<'a> Seen<'a> {
    fn new(world: &'a World<'a>, view: &AirView) -> Self {
        let direction = view.direction();
        let ray = Ray::new(eye(view.eye_m), direction);
        let end = ray.end.min(ray.start + view.reach_m);
        let tensor = Tensor::unpolarised(direction, 1.0);
        let mut seen = Self {
            world,
            ray,
            direction,
            steps: Vec::new(),
            order1_air: 0.0,
            order1_ground: 0.0,
            transmittance: 1.0,
            ground: (ray.meets_ground && end == ray.end).then(|| ray.position(ray.end)),
        };
        let mut scattered = 0.0;
        for (start, length) in pieces(ray.start, end) {
            let middle = start + length / 2.0;
            let air = world.air.profile.at(ray.height(middle).min(TOP_M));
            let depth = air.extinction * length;
            // The mean transmittance within the piece is (1 - e^-depth)/depth.
            let mean = if depth < 1e-9 { 1.0 } else { -(-depth).exp_m1() / depth };
            let through = seen.transmittance * mean * length;
            seen.order1_air += through * world.lit_air(ray.position(middle), &air, direction, &tensor);
            scattered += through * (air.rayleigh + air.aerosol);
            let (extinction, transmittance) = (air.extinction, seen.transmittance);
            seen.steps.push(Step { start, length, extinction, transmittance, scattered });
            seen.transmittance *= (-depth).exp();
        }
        if let Some(ground) = seen.ground {
            seen.order1_ground = seen.transmittance * world.lit_ground(ground, &tensor);
        }
        seen
    }

    /// One path: light scattered twice and more.
    fn path(&self, random: &mut Random) -> [f64; OUTCOMES] {
        let mut outcomes = [0.0; OUTCOMES];
        let air = self.steps.last().map_or(0.0, |step| step.scattered);
        let ground = self.ground.map(Vertex::Ground);
        let whole = air + ground.map_or(0.0, |ground| self.transmittance * self.world.albedo(&ground));
        if whole <= 0.0 {
            return outcomes;
        }
        let part = random.uniform() * whole;
        let (vertex, worth) = match ground {
            Some(ground) if part >= air => (ground, whole),
            _ => {
                let (vertex, share) = self.in_air(part, random);
                (vertex, share * whole)
            }
        };
        let tensor = Tensor::unpolarised(self.direction, worth);
        self.world.follow((vertex, 1), self.direction, tensor, &mut outcomes, random);
        outcomes
    }

    /// A scattering in the step in which `part` of the light is scattered into the ray, and what is scattered there
    /// as a multiple of the mean of the step: near 1, so that steps make no error.
    fn in_air(&self, part: f64, random: &mut Random) -> (Vertex, f64) {
        let i = self.steps.partition_point(|step| step.scattered <= part).min(self.steps.len() - 1);
        let step = &self.steps[i];
        let before = if i == 0 { 0.0 } else { self.steps[i - 1].scattered };
        let distance = step.length * random.uniform();
        let place = step.start + distance;
        let air = self.world.air.profile.at(self.ray.height(place).min(TOP_M));
        let scattered = step.transmittance * (-step.extinction * distance).exp() * (air.rayleigh + air.aerosol);
        (Vertex::Air(self.ray.position(place), air), scattered * step.length / (step.scattered - before))
    }
}

/// Pieces of a ray, short where it is low: their ends are as the squares from the lowest point of it.
pub(in crate::reference::monte_carlo) fn pieces(start: f64, end: f64) -> impl Iterator<Item = (f64, f64)> {
    let lowest = 0.0_f64.clamp(start, end);
    let edge = |i: usize| (i as f64 / STEPS as f64).powi(2);
    let down = (0..STEPS).rev().map(move |i| {
        let from = lowest - (lowest - start) * edge(i + 1);
        (from, lowest - (lowest - start) * edge(i) - from)
    });
    let up = (0..STEPS).map(move |i| {
        let from = lowest + (end - lowest) * edge(i);
        (from, lowest + (end - lowest) * edge(i + 1) - from)
    });
    down.chain(up).filter(|(_, length)| *length > 0.0)
}

#[cfg(test)]
mod tests {
    use super::{AirView, Ray, Seen, World, eye, pieces};
    use crate::atmosphere::profile::{Aerosol, Medium};
    use crate::reference::monte_carlo::air::problem::{AirProblem, PreparedAir};
    use std::f64::consts::PI;

    #[test]
    fn light_scattered_once_is_that_of_finer_steps_without_tables() {
        let medium = Medium::new(640.0, 1.0, 300.0, Aerosol::henyey_greenstein(0.1, 1200.0, 0.93, 0.7));
        let air = PreparedAir::new(&medium).unwrap();
        let mut worst = 0.0_f64;
        for (sun_zenith_deg, eye_m, elevation_deg, azimuth_deg) in
            [(88.0, 1.0, 0.5, 0.0), (30.0, 1.0, 90.0, 0.0), (70.0, 5000.0, -30.0, 60.0), (93.0, 2000.0, 3.0, 20.0)]
        {
            let problem = AirProblem { air: &air, ground_albedo: 0.0, sun_zenith_deg, polarised: false };
            let world = World::new(&problem);
            let view = AirView::new(eye_m, elevation_deg, azimuth_deg);
            let found = Seen::new(&world, &view).order1_air;
            let (direction, sun) = (view.direction(), problem.sun());
            let ray = Ray::new(eye(eye_m), direction);
            let cosine = direction.dot(sun);
            let phase = [3.0 * (1.0 + cosine * cosine) / (16.0 * PI), (medium.aerosol.phase)(cosine) / (4.0 * PI)];
            let (mut sum, mut depth) = (0.0, 0.0);
            for (start, length) in pieces(ray.start, ray.end)
                .flat_map(|(start, length)| (0..8).map(move |i| (start + length * f64::from(i) / 8.0, length / 8.0)))
            {
                let middle = start + length / 2.0;
                let air_here = air.profile.at(ray.height(middle));
                let to_sun = Ray::new(ray.position(middle), sun);
                if !to_sun.meets_ground {
                    let path = depth
                        + air_here.extinction * length / 2.0
                        + air.depths.between(&air.profile, &to_sun, to_sun.start, to_sun.end);
                    sum += length * (-path).exp() * (air_here.rayleigh * phase[0] + air_here.aerosol * phase[1]);
                }
                depth += air_here.extinction * length;
            }
            worst = worst.max((found / sum - 1.0).abs());
        }
        // The midpoint rule's error falls with the square of the step; 1.3e-5 was found.
        assert!(worst < 3e-5, "{worst}");
    }
}
