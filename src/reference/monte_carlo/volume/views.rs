//! What an eye sees of clouds along rays.

use super::medium::Piece;
use super::paths::{BY_ORDERS, OUTCOMES, SKY, SKY_GROUND, SUN, SUN_GROUND, TOTAL, World};
use super::problem::{VolumeProblem, VolumeView};
use super::rays::{Ray, ray};
use crate::cumulus::Line;
use crate::reference::monte_carlo::error::MonteCarloError;
use crate::reference::monte_carlo::estimate::{Effort, Estimate};
use crate::reference::monte_carlo::orders::Orders;
use crate::reference::monte_carlo::path::NEGLIGIBLE;
use crate::reference::monte_carlo::random::Random;
use crate::reference::monte_carlo::run::run;
use crate::reference::monte_carlo::work::each;
use glam::DVec3;
use std::sync::atomic::AtomicBool;

/// Steps of the integral of light scattered once: at most so deep, and so long, metres.
const STEP_DEPTH: f64 = 0.1;
const STEP_M: f64 = 8.0;
/// What comes from deeper is not integrated.
const DEEPEST: f64 = 20.0;

/// Outcomes of a path of a view: those of paths, and light from behind the clouds.
const SEEN: usize = OUTCOMES + 1;
const BEHIND: usize = OUTCOMES;

/// Light of clouds along a ray, in the unit of the problem's light; what is behind them is in it where the view is backed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VolumeRadiance {
    /// Optical depth of the ray.
    pub optical_depth: f64,
    /// `1 - exp(-optical_depth)`.
    pub alpha: f64,
    /// Sunlight scattered once: by quadrature.
    pub order1: f64,
    /// Sunlight scattered twice and more, by clouds alone.
    pub higher: Estimate,
    /// Sunlight that the ground has reflected at least once.
    pub sun_by_ground: Estimate,
    /// Light of the sky, by clouds alone.
    pub sky: Estimate,
    /// Light of the sky that the ground has reflected at least once.
    pub sky_by_ground: Estimate,
    /// Light from behind the clouds, of the sky or of the ground, as it comes through them; 0 unless the view is backed.
    pub behind: Estimate,
    /// All light. Its error is not that of independent parts.
    pub total: Estimate,
    /// All light by the number of scatterings; a reflection by the ground is one.
    pub orders: Orders,
    /// Paths.
    pub paths: u64,
}

/// Light of clouds along each of the `views`, with [`Effort::photons`] paths a view. Each view has random numbers of its own,
/// and its share of the time limit; it ends early when its total is within the relative error asked for. `progress` hears
/// fractions 0..=1, from any thread.
///
/// The same bits for the same seed whatever the number of threads, unless a time limit ends a run.
///
/// # Errors
/// An input out of its range, or `cancelled` was raised.
pub fn radiance(
    problem: &VolumeProblem<'_>,
    views: &[VolumeView],
    effort: &Effort,
    progress: &(dyn Fn(f64) + Sync),
    cancelled: &AtomicBool,
) -> Result<Vec<VolumeRadiance>, MonteCarloError> {
    problem.check()?;
    views.iter().try_for_each(VolumeView::check)?;
    let world = World::new(problem);
    each(views.len(), effort, progress, cancelled, |number, watch| {
        let seen = Seen::new(&world, &views[number]);
        let (order1, sky) = (seen.order1(), seen.sky());
        let mut found = VolumeRadiance {
            optical_depth: seen.depth,
            alpha: -(-seen.depth).exp_m1(),
            order1,
            higher: Estimate::default(),
            sun_by_ground: Estimate::default(),
            sky: Estimate::default(),
            sky_by_ground: Estimate::default(),
            behind: Estimate { value: sky, standard_error: 0.0 },
            total: Estimate { value: order1 + sky, standard_error: 0.0 },
            orders: Orders::default().plus(0, sky).plus(1, order1),
            paths: 0,
        };
        if seen.depth > 0.0 || seen.ground.is_some() {
            let enough = |total: Estimate| total.plus(order1 + sky).within(effort.relative_error);
            let sums = run(effort, watch, |random| seen.path(random), |sums| enough(sums.estimate(TOTAL)))?;
            found.higher = sums.estimate(SUN);
            found.sun_by_ground = sums.estimate(SUN_GROUND);
            found.sky = sums.estimate(SKY);
            found.sky_by_ground = sums.estimate(SKY_GROUND);
            found.behind = sums.estimate(BEHIND).plus(sky);
            found.orders = Orders::of(&sums, BY_ORDERS).plus(0, sky).plus(1, order1);
            found.total = sums.estimate(TOTAL).plus(order1 + sky);
            found.paths = sums.count;
        }
        Ok(found)
    })
}

/// A ray cut into pieces, so that the first scattering of its paths can be drawn from where it is likely.
struct Seen<'a> {
    world: &'a World<'a>,
    /// Where it goes. Over a round Earth its legs go up and down from that, which is for where clouds are; the angle between
    /// it and the sun is the eye's.
    direction: DVec3,
    /// Pieces of cloud, each with the leg that it lies on.
    pieces: Vec<(Line, Piece)>,
    /// Optical depth to the end of each piece.
    depths: Vec<f64>,
    depth: f64,
    /// Whether the sky is seen behind the clouds.
    is_sky_seen: bool,
    /// The place of the ground that is seen behind the clouds.
    ground: Option<DVec3>,
}

impl<'a> Seen<'a> {
    fn new(world: &'a World<'a>, view: &VolumeView) -> Self {
        let medium = &world.medium;
        let Ray { legs, ground } = ray(view, [medium.bottom_m(), medium.top_m()]);
        let on_leg = |leg: Line| medium.pieces(&leg, view.only).into_iter().map(move |piece| (leg, piece));
        let pieces: Vec<(Line, Piece)> = legs.into_iter().flat_map(on_leg).collect();
        let mut depth = 0.0;
        let depths = pieces.iter().map(|(_, piece)| {
            depth += piece.extinction * (piece.to_m - piece.from_m);
            depth
        });
        let depths: Vec<f64> = depths.collect();
        Self {
            world,
            direction: view.direction.normalize_or(DVec3::Z),
            pieces,
            depths,
            depth,
            is_sky_seen: view.backed && ground.is_none(),
            ground: ground.filter(|_| view.backed),
        }
    }

    /// Light of the sky behind the clouds.
    fn sky(&self) -> f64 {
        if self.is_sky_seen { self.world.sky_radiance * (-self.depth).exp() } else { 0.0 }
    }

    /// Sunlight scattered once: two points of Gauss a step.
    fn order1(&self) -> f64 {
        let world = self.world;
        if world.sun_irradiance <= 0.0 || self.depth <= 0.0 {
            return 0.0;
        }
        let parts = self.pieces[0].1.extinctions.len();
        let most = |part: usize| self.pieces.iter().map(|(_, piece)| piece.extinctions[part]).fold(0.0, f64::max);
        let scattered: Vec<f64> =
            (0..parts).map(|part| if most(part) > 0.0 { world.scattered(part, self.direction) } else { 0.0 }).collect();
        let mut light = 0.0;
        for ((leg, piece), end) in self.pieces.iter().zip(&self.depths) {
            let length_m = piece.to_m - piece.from_m;
            let depth = piece.extinction * length_m;
            let start = end - depth;
            if start > DEEPEST {
                break;
            }
            let sources = piece.extinctions.iter().zip(&scattered);
            let source: f64 = sources.map(|(extinction, scattered)| extinction * scattered).sum();
            let steps = (depth / STEP_DEPTH).max(length_m / STEP_M).ceil();
            for point in 0..2 * steps as u64 {
                let node = [0.5 - 0.5 / 3.0_f64.sqrt(), 0.5 + 0.5 / 3.0_f64.sqrt()][(point % 2) as usize];
                let part = ((point / 2) as f64 + node) / steps;
                // Close together at the ends: they are the cloud's surface, where the way to the sun grows like a root.
                let way_m = length_m * part * part * (3.0 - 2.0 * part);
                let step_m = length_m * 6.0 * part * (1.0 - part) / steps;
                let to_sun = Line::from(leg.at(piece.from_m + way_m), world.sun);
                let depth = start + piece.extinction * way_m + world.medium.depth(&to_sun);
                light += 0.5 * step_m * source * (-depth).exp();
            }
        }
        light * world.sun_irradiance
    }

    /// One path: all light but sunlight scattered once, and but that of the sky behind.
    fn path(&self, random: &mut Random) -> [f64; SEEN] {
        let mut seen = [0.0; SEEN];
        if self.depth > 0.0 {
            seen[..OUTCOMES].copy_from_slice(&self.scattered_path(random));
        }
        let clear = (-self.depth).exp();
        if let Some(place) = self.ground.filter(|_| clear > NEGLIGIBLE) {
            let behind = self.world.reflected(place, random);
            seen[BEHIND] = clear * behind[TOTAL];
            seen[TOTAL] += seen[BEHIND];
            let orders = seen.iter_mut().zip(behind).skip(BY_ORDERS);
            orders.for_each(|(light, behind)| *light += clear * behind);
        }
        seen
    }

    /// One path that clouds scatter into the ray.
    fn scattered_path(&self, random: &mut Random) -> [f64; OUTCOMES] {
        let mut outcomes = [0.0; OUTCOMES];
        let scattered = -(-self.depth).exp_m1();
        let depth = -(-random.uniform() * scattered).ln_1p();
        let number = self.depths.partition_point(|end| *end <= depth).min(self.pieces.len() - 1);
        let (leg, piece) = &self.pieces[number];
        let way_m = piece.to_m - (self.depths[number] - depth).max(0.0) / piece.extinction;
        let mut part = 0;
        let mut chosen = random.uniform() * piece.extinction;
        for (number, extinction) in piece.extinctions.iter().enumerate().filter(|(_, extinction)| **extinction > 0.0) {
            part = number;
            if chosen < *extinction {
                break;
            }
            chosen -= extinction;
        }
        let place = leg.at(way_m.max(piece.from_m));
        self.world.follow_scattered(part, place, self.direction, &mut outcomes, random);
        outcomes.map(|outcome| outcome * scattered * self.world.albedo(part))
    }
}
