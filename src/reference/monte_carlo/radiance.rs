//! Radiance by pairs of paths, one from the sun and one from the viewer.
//!
//! A path of n scatterings is a chain of n + 1 directions. Joining the first i scatterings of a path from the sun to
//! the last k of a path from the viewer gives such a chain, n = i + 1 + k, whose one scattering in between was not
//! drawn but has to be counted with its phase function P. Where that is the narrow forward peak of droplets, this is
//! the noise of the usual local estimate (k = 0): few but huge counts. The same chain can however come about n ways,
//! one for each place of the joint, and they share it here in proportion to (mu + mu')/P at the joint, mu and mu' the
//! cosines before and after it. Each share is then bounded by the smallest P/(mu + mu') along the chain, so that a
//! count is large only where every single scattering is inside the peak, which is where the radiance is large (multiple
//! importance sampling: E. Veach, "Robust Monte Carlo methods for light transport simulation", 1997). The depth of the
//! joint needs no drawing: its integral along the two rays has a closed form.
//!
//! Order 1 is exact. Estimates have no bias; their errors are those of a mean of bounded values.

use std::f64::consts::PI;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use glam::DVec3;

use super::error::{MonteCarloError, check};
use super::estimate::{Effort, Estimate};
use super::path::{NEGLIGIBLE, first_depth, scattered_part};
use super::problem::SlabProblem;
use super::random::Random;
use super::run::{FIRST_ROUND, Watch, run};
use super::scattering::Scattering;
use crate::slab::analytic::{LOWEST_VIEW, order1_reflected, order1_transmitted};
use crate::slab::radiance::Side;

/// Most scatterings of a path from the viewer: a chain has one more place for its joint. Enough that all of them are
/// seldom inside the forward peak; time goes with it in thick slabs.
const VIEW_SCATTERINGS: usize = 8;
/// Orders told apart, from the second on; [`RadianceEstimate::higher`] holds those from the third on.
const ORDERS_APART: usize = 4;
/// Outcomes of a pair: the orders apart, orders 3 and up, orders 2 and up.
const OUTCOMES: usize = ORDERS_APART + 2;
/// Cosines count as at least this, to divide by.
const LEAST_COSINE: f64 = 1e-12;

/// A direction of view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Cosine of the angle between the outward normal of the face and the direction to the viewer, 0..=1; below
    /// [`LOWEST_VIEW`] it counts as that.
    pub mu: f64,
    /// Azimuth of the light's travel relative to that of the sunlight, radians: 0 forward, pi with the sun behind the
    /// viewer.
    pub azimuth: f64,
    /// The face.
    pub side: Side,
}

/// Radiance in one direction per unit sun irradiance on a plane facing the sun, 1/sr.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RadianceEstimate {
    /// Scattered once: exact.
    pub order1: f64,
    /// Scattered twice.
    pub order2: Estimate,
    /// Scattered two, three, four and five times, each order on its own.
    pub low_orders: [Estimate; 4],
    /// Scattered three times and more.
    pub higher: Estimate,
    /// All scattered light.
    pub total: Estimate,
    /// Pairs of paths.
    pub pairs: u64,
}

/// Radiance of a slab in each of the `views`. Each view has random numbers of its own, and its share of the time limit;
/// it ends early when its total is within the relative error asked for. `progress` hears fractions 0..=1, from any
/// thread.
///
/// # Errors
/// An input out of its range, or `cancelled` was raised.
pub fn radiance(
    problem: &SlabProblem<'_>,
    views: &[View],
    effort: &Effort,
    progress: &(dyn Fn(f64) + Sync),
    cancelled: &AtomicBool,
) -> Result<Vec<RadianceEstimate>, MonteCarloError> {
    problem.check()?;
    for view in views {
        check("mu of a view", view.mu, 0.0, 1.0)?;
        check("azimuth of a view", view.azimuth, f64::MIN, f64::MAX)?;
    }
    let scattering = Scattering::new(problem.phase);
    let deadline = effort.time_limit.and_then(|time| Instant::now().checked_add(time));
    let estimate = |(i, view): (usize, &View)| {
        let scene = Scene::new(problem, &scattering, view);
        let left = views.len() - i;
        let watch = Watch {
            // Stream 0 is that of the fluxes.
            stream: i as u64 + 1,
            first_round: FIRST_ROUND,
            time: deadline.map(|end| end.saturating_duration_since(Instant::now()) / left as u32),
            progress: &|part| progress((i as f64 + part) / views.len() as f64),
            cancelled,
        };
        let order1 = scene.order1();
        let close = |total: Estimate| total.plus(order1).within(effort.relative_error);
        let sums = run(effort, &watch, |random| scene.pair(random), |sums| close(sums.estimate(ORDERS_APART + 1)))?;
        Ok(RadianceEstimate {
            order1,
            order2: sums.estimate(0),
            low_orders: std::array::from_fn(|i| sums.estimate(i)),
            higher: sums.estimate(ORDERS_APART),
            total: sums.estimate(ORDERS_APART + 1).plus(order1),
            pairs: sums.count,
        })
    };
    views.iter().enumerate().map(estimate).collect()
}

/// A ray of light inside the slab. Depth and z point downwards.
#[derive(Clone, Copy, Debug)]
struct Ray {
    /// Where the ray starts (from the sun) or ends (from the viewer).
    depth: f64,
    /// Direction of travel of the light.
    direction: DVec3,
    /// |z| of the direction, > 0.
    mu: f64,
    /// Part of the light.
    weight: f64,
}

impl Ray {
    fn new(depth: f64, direction: DVec3, weight: f64) -> Self {
        Self { depth, direction, mu: direction.z.abs().max(LEAST_COSINE), weight }
    }
}

/// A ray towards the viewer, with what the chain from it to the viewer adds to the sum over joints.
#[derive(Clone, Copy, Debug)]
struct ViewRay {
    ray: Ray,
    joints: f64,
}

struct Scene<'a> {
    problem: &'a SlabProblem<'a>,
    scattering: &'a Scattering,
    /// Sunlight as it enters; its weight is the irradiance on the slab.
    sun: Ray,
    /// Light to the viewer as it leaves.
    view: Ray,
}

impl<'a> Scene<'a> {
    fn new(problem: &'a SlabProblem<'a>, scattering: &'a Scattering, view: &View) -> Self {
        let sine = |mu: f64| (1.0 - mu * mu).max(0.0).sqrt();
        let mu = view.mu.max(LOWEST_VIEW);
        let (z, depth) = match view.side {
            Side::Reflected => (-mu, 0.0),
            Side::Transmitted => (mu, problem.optical_depth),
        };
        let leaving = DVec3::new(sine(mu) * view.azimuth.cos(), sine(mu) * view.azimuth.sin(), z);
        let entering = DVec3::new(sine(problem.mu_sun), 0.0, problem.mu_sun);
        let (sun, view) = (Ray::new(0.0, entering, problem.mu_sun), Ray::new(depth, leaving, 1.0));
        Self { problem, scattering, sun, view }
    }

    fn order1(&self) -> f64 {
        let order1 = if self.view.direction.z < 0.0 { order1_reflected } else { order1_transmitted };
        let phase = self.scattering.value(self.sun.direction, self.view.direction);
        self.problem.albedo * phase / (4.0 * PI) * order1(self.problem.optical_depth, self.sun.mu, self.view.mu)
    }

    /// Radiance of the orders, see [`OUTCOMES`], by one pair of paths.
    fn pair(&self, random: &mut Random) -> [f64; OUTCOMES] {
        let scale = self.problem.albedo / (4.0 * PI);
        let to_viewer = self.path_to_viewer(random);
        let mut outcome = [0.0; OUTCOMES];
        // recent[c]: sum over the last c scatterings of the path from the sun of (mu + mu')/P.
        let mut recent = [0.0; VIEW_SCATTERINGS + 1];
        let mut from_sun = self.sun;
        let mut scatterings = 0;
        loop {
            for (k, end) in to_viewer.iter().enumerate() {
                let length = self.joined(&from_sun, &end.ray);
                // A chain of one scattering is order 1.
                if length <= 0.0 || scatterings + k == 0 {
                    continue;
                }
                let phase = self.scattering.value(from_sun.direction, end.ray.direction);
                let spread = from_sun.mu + end.ray.mu;
                // Joints further up than these would need a longer path from the viewer.
                let joints = recent[VIEW_SCATTERINGS - k] + spread / phase + end.joints;
                let count = scale * from_sun.weight * end.ray.weight * length * spread / joints;
                let above_second = scatterings + k - 1;
                if above_second < ORDERS_APART {
                    outcome[above_second] += count;
                }
                if above_second > 0 {
                    outcome[ORDERS_APART] += count;
                }
            }
            let start =
                if scatterings == 0 { self.enter(&from_sun, random) } else { self.advance(&from_sun, 1.0, random) };
            let Some((depth, weight)) = start else { break };
            let (direction, phase) = self.scattering.draw(from_sun.direction, random);
            let next = Ray::new(depth, direction, weight);
            let joint = (from_sun.mu + next.mu) / phase;
            for c in (1..recent.len()).rev() {
                recent[c] = recent[c - 1] + joint;
            }
            from_sun = next;
            scatterings += 1;
        }
        outcome[ORDERS_APART + 1] = outcome[0] + outcome[ORDERS_APART];
        outcome
    }

    /// The rays of a path traced from the viewer, from the last one backwards.
    fn path_to_viewer(&self, random: &mut Random) -> Vec<ViewRay> {
        let mut rays = Vec::with_capacity(VIEW_SCATTERINGS + 1);
        let mut last = ViewRay { ray: self.view, joints: 0.0 };
        rays.push(last);
        while rays.len() <= VIEW_SCATTERINGS {
            let start =
                if rays.len() == 1 { self.enter(&last.ray, random) } else { self.advance(&last.ray, -1.0, random) };
            let Some((depth, weight)) = start else { break };
            let (direction, phase) = self.scattering.draw(last.ray.direction, random);
            let ray = Ray::new(depth, direction, weight);
            last = ViewRay { ray, joints: last.joints + (last.ray.mu + ray.mu) / phase };
            rays.push(last);
        }
        rays
    }

    /// Depth and weight after the scattering nearest to the face on which a path begins. A path that would go straight
    /// through is not drawn: its part is taken off the weight.
    fn enter(&self, ray: &Ray, random: &mut Random) -> Option<(f64, f64)> {
        let optical_depth = self.problem.optical_depth;
        let inwards = first_depth(optical_depth, ray.mu, random.uniform());
        let depth = if ray.depth > 0.0 { optical_depth - inwards } else { inwards };
        let weight = ray.weight * self.problem.albedo * scattered_part(optical_depth / ray.mu);
        (weight > 0.0).then_some((depth, weight))
    }

    /// Depth and weight after the next scattering along a ray (`sign` 1) or before it (-1); None where the ray leaves
    /// the slab.
    fn advance(&self, ray: &Ray, sign: f64, random: &mut Random) -> Option<(f64, f64)> {
        let depth = ray.depth + sign * ray.direction.z * random.free_path();
        let weight = ray.weight * self.problem.albedo;
        let inside = (0.0..=self.problem.optical_depth).contains(&depth);
        (inside && weight > NEGLIGIBLE * self.sun.mu).then_some((depth, weight))
    }

    /// Integral over the depth of the joint of both rays' `exp(-path)/mu`: how much light of the one comes to be in the
    /// other.
    fn joined(&self, light: &Ray, view: &Ray) -> f64 {
        let (from, to) = (light.depth, view.depth);
        let down = light.direction.z > 0.0;
        let both = light.mu + view.mu;
        if down == (view.direction.z > 0.0) {
            // On the way from the one to the other.
            let distance = if down { to - from } else { from - to };
            if distance <= 0.0 {
                return 0.0;
            }
            let longer = light.mu.max(view.mu);
            let rates = distance / (light.mu * view.mu);
            let gap = rates * (light.mu - view.mu).abs();
            let mean = if gap < 1e-8 { 1.0 } else { scattered_part(gap) / gap };
            (-distance / longer).exp() * rates * mean
        } else {
            // Beyond both, as far as the face.
            let ahead = if down { to - from } else { from - to };
            let nearest = if ahead > 0.0 { ahead / light.mu } else { -ahead / view.mu };
            let room = if down { self.problem.optical_depth - from.max(to) } else { from.min(to) };
            (-nearest).exp() * scattered_part(room * both / (light.mu * view.mu)) / both
        }
    }
}
