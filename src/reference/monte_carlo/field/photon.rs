//! One photon from above clouds and air to its end.

use std::f64::consts::TAU;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use super::maps::{FluxMap, NADIR_COSINE};
use super::medium::{Flight, Medium};
use super::problem::FieldProblem;
use super::tally::{Counts, End};
use crate::reference::monte_carlo::error::MonteCarloError;
use crate::reference::monte_carlo::random::Random;
use crate::reference::monte_carlo::scattering::Scattering;
use crate::reference::monte_carlo::surface::Surface;

/// Photons with one stream of random numbers.
const CHUNK: u64 = 1024;
/// Directions are at least this steep, so that every flight ends.
const LEAST_SLOPE: f64 = 1e-6;
/// Photons above the highest top for each below it, where there is air: there they cost little, and scatter seldom. On the
/// way down one of so many goes on and counts as all of them, on the way up it is divided.
pub(super) const ABOVE: u64 = 8;

/// What happened last to a photon.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Last {
    /// Nothing yet, and it is the sun's.
    Sun,
    /// It came from the sky or from the ground, or was scattered by air.
    Other,
    /// It was scattered at this place.
    Cloud(DVec3),
}

/// A photon at an edge.
#[derive(Clone, Copy, Debug)]
struct Photon {
    place: DVec3,
    direction: DVec3,
    last: Last,
    edge: usize,
    /// As how many it counts.
    count: u64,
    /// Whether it has never been below the highest top.
    entering: bool,
}

/// What a thread has at hand while it follows some photons.
struct Work<'a> {
    counts: &'a Counts,
    random: Random,
    /// Parts of photons that are still to be followed.
    waiting: Vec<Photon>,
    /// Which of the next [`ABOVE`] photons that enter goes on.
    next: u64,
    cancelled: &'a AtomicBool,
}

impl Work<'_> {
    /// Whether a photon goes on down through the highest top: one of [`ABOVE`]. Of those that enter it is one in every
    /// so many, as what becomes of them does not change who enters next; of others that would not be fair, and it is by
    /// chance.
    fn goes_on(&mut self, entering: bool) -> bool {
        if !entering {
            return self.random.uniform() * (ABOVE as f64) < 1.0;
        }
        let goes_on = self.next == 0;
        self.next = if goes_on { ABOVE - 1 } else { self.next - 1 };
        goes_on
    }
}

/// A problem made ready.
#[derive(Debug)]
pub(super) struct Tracer {
    medium: Medium,
    /// Of each layer.
    scattering: Vec<Scattering>,
    albedo: Vec<f64>,
    ground_albedo: Surface,
    extent_m: f64,
    /// Direction of travel of sunlight: east, south, up.
    sunlight: DVec3,
    /// Part of the light that is the sun's.
    sun_part: f64,
}

impl Tracer {
    pub(super) fn new(problem: &FieldProblem<'_>, sun_part: f64) -> Result<Self, MonteCarloError> {
        let [east, north, up] = problem.towards_sun;
        Ok(Self {
            medium: Medium::new(problem)?,
            scattering: problem.layers.iter().map(|layer| Scattering::new(layer.phase)).collect(),
            albedo: problem.layers.iter().map(|layer| layer.albedo).collect(),
            ground_albedo: Surface::new(problem.ground_albedo, [0.0; 2], problem.extent_m),
            extent_m: problem.extent_m,
            sunlight: sloping(DVec3::new(-east, north, -up).normalize_or(DVec3::NEG_Z)),
            sun_part,
        })
    }

    /// Follows a batch of photons on all cores.
    pub(super) fn batch(
        &self,
        counts: &Counts,
        seed: u64,
        batch: u64,
        progress: &(dyn Fn(f64) + Sync),
        cancelled: &AtomicBool,
    ) {
        // As many as possible start from the squares of a grid, one from each, the others anywhere: less noise than
        // without, and no pattern.
        let squares = counts.photons.isqrt();
        let reached = AtomicU64::new(0);
        (0..counts.photons.div_ceil(CHUNK)).into_par_iter().for_each(|chunk| {
            let random = Random::new(seed, (batch << 40) | chunk);
            let numbers = chunk * CHUNK..counts.photons.min((chunk + 1) * CHUNK);
            let count = numbers.end - numbers.start;
            let mut work = Work { counts, random, waiting: Vec::new(), next: 0, cancelled };
            if self.medium.air().is_some() {
                work.next = (work.random.uniform() * ABOVE as f64) as u64;
            }
            for number in numbers {
                if cancelled.load(Ordering::Relaxed) {
                    return;
                }
                let inside = [work.random.uniform(), work.random.uniform()];
                let (square, parts) = if number < squares * squares {
                    ([number % squares, number / squares], squares)
                } else {
                    ([0, 0], 1)
                };
                let start = [0, 1].map(|i| (square[i] as f64 + inside[i]) / parts as f64 * self.extent_m);
                self.follow(start, &mut work);
            }
            let done = reached.fetch_add(count, Ordering::Relaxed) + count;
            progress(done as f64 / counts.photons as f64);
        });
    }

    /// Follows one photon from above `start`, metres east and south, and all its parts.
    fn follow(&self, start: [f64; 2], work: &mut Work<'_>) {
        let mut photon = self.enter(start, &mut work.random);
        if self.cross(&mut photon, work) {
            work.waiting.push(photon);
        }
        while let Some(mut photon) = work.waiting.pop() {
            while self.fly(&mut photon, work) && self.cross(&mut photon, work) {}
        }
    }

    /// One photon from above `start`, metres east and south.
    fn enter(&self, start: [f64; 2], random: &mut Random) -> Photon {
        let edge = self.medium.edges_m.len() - 1;
        let place = DVec3::new(start[0], start[1], self.medium.edges_m[edge]);
        let (direction, last) = if random.uniform() < self.sun_part {
            (self.sunlight, Last::Sun)
        } else {
            (-lambertian(random), Last::Other)
        };
        Photon { place, direction, last, edge, count: 1, entering: true }
    }

    /// Counts a photon at its edge, and tells whether it goes on from there. Of those that go up through the highest top
    /// into air, all parts but one are left for later.
    fn cross(&self, photon: &mut Photon, work: &mut Work<'_>) -> bool {
        let (last_edge, top_edge) = (self.medium.edges_m.len() - 1, self.medium.top_edge);
        let (up, direct) = (photon.direction.z > 0.0, photon.last == Last::Sun);
        let number = photon.count;
        let count = |map: FluxMap, place: DVec3| {
            work.counts.count(map, place.x / self.extent_m, place.y / self.extent_m, number);
        };
        if photon.edge == self.medium.base_edge {
            let down = if direct { FluxMap::BaseDirect } else { FluxMap::BaseDiffuse };
            count(if up { FluxMap::BaseUp } else { down }, photon.place);
        }
        if photon.edge == top_edge {
            let down = if direct { FluxMap::TopDirect } else { FluxMap::TopDiffuse };
            count(if up { FluxMap::Up } else { down }, photon.place);
            if let (true, Last::Cloud(column)) = (up, photon.last) {
                count(FluxMap::Column, column);
                if photon.direction.z > NADIR_COSINE {
                    count(FluxMap::ColumnNadir, column);
                }
            }
        }
        if up && photon.edge == last_edge {
            work.counts.end(End::Space, number);
            return false;
        }
        if !up && photon.edge == 0 {
            count(if direct { FluxMap::GroundDirect } else { FluxMap::GroundDiffuse }, photon.place);
            if work.random.uniform() >= self.ground_albedo.at(photon.place.x, photon.place.y) {
                work.counts.end(End::Ground, number);
                return false;
            }
            photon.direction = lambertian(&mut work.random);
            photon.last = Last::Other;
            // Up through the edge on the ground as well, where that is the base.
            return self.cross(photon, work);
        }
        if photon.edge == top_edge && top_edge < last_edge {
            if up {
                photon.count /= ABOVE;
                work.waiting.extend((1..ABOVE).map(|_| *photon));
            } else if work.goes_on(photon.entering) {
                photon.count *= ABOVE;
                photon.entering = false;
            } else {
                return false;
            }
        }
        true
    }

    /// Flies into the band above or below until an edge is reached; false if none is.
    fn fly(&self, photon: &mut Photon, work: &mut Work<'_>) -> bool {
        let random = &mut work.random;
        let band = if photon.direction.z > 0.0 { photon.edge } else { photon.edge - 1 };
        loop {
            match self.medium.fly(band, &mut photon.place, photon.direction, random) {
                Flight::Edge => break,
                Flight::Collision(layer) => {
                    if random.uniform() >= self.albedo[layer] {
                        work.counts.end(End::Cloud, photon.count);
                        return false;
                    }
                    photon.place = self.wrapped(photon.place);
                    photon.direction = sloping(self.scattering[layer].draw(photon.direction, random).0);
                    photon.last = Last::Cloud(photon.place);
                }
                Flight::Air(met) => {
                    let air = self.medium.air();
                    let Some(direction) = air.and_then(|air| air.scatter(met, photon.direction, random)) else {
                        work.counts.end(End::Air, photon.count);
                        return false;
                    };
                    photon.place = self.wrapped(photon.place);
                    photon.direction = sloping(direction);
                    photon.last = Last::Other;
                }
            }
            if work.cancelled.load(Ordering::Relaxed) {
                return false;
            }
        }
        photon.edge = if photon.direction.z > 0.0 { band + 1 } else { band };
        true
    }

    /// The same place of the domain itself: or coordinates lose digits on long ways.
    fn wrapped(&self, place: DVec3) -> DVec3 {
        DVec3 { x: place.x.rem_euclid(self.extent_m), y: place.y.rem_euclid(self.extent_m), ..place }
    }
}

/// A direction upwards of light from an even surface: the cosine's distribution.
fn lambertian(random: &mut Random) -> DVec3 {
    let squared = random.uniform();
    let (sine, cosine) = (TAU * random.uniform()).sin_cos();
    let across = squared.sqrt();
    DVec3::new(across * cosine, across * sine, (1.0 - squared).sqrt().max(LEAST_SLOPE))
}

/// The direction, or one that is steep enough.
fn sloping(direction: DVec3) -> DVec3 {
    DVec3 {
        z: if direction.z.abs() < LEAST_SLOPE { LEAST_SLOPE.copysign(direction.z) } else { direction.z },
        ..direction
    }
}
