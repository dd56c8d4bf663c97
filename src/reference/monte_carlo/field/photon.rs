//! One photon from above the clouds to its end.

use std::f64::consts::TAU;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use super::maps::{FluxMap, NADIR_COSINE};
use super::medium::{Flight, Medium, Surface};
use super::problem::FieldProblem;
use super::tally::Counts;
use crate::reference::monte_carlo::random::Random;
use crate::reference::monte_carlo::scattering::Scattering;

/// Photons with one stream of random numbers.
const CHUNK: u64 = 1024;
/// Directions are at least this steep, so that every flight ends.
const LEAST_SLOPE: f64 = 1e-6;
/// What happened last to a photon.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Last {
    /// Nothing yet, and it is the sun's.
    Sun,
    /// It came from the sky or from the ground.
    Surface,
    /// It was scattered at this place.
    Cloud(DVec3),
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
    pub(super) fn new(problem: &FieldProblem<'_>, sun_part: f64) -> Self {
        let [east, north, up] = problem.towards_sun;
        Self {
            medium: Medium::new(problem),
            scattering: problem.layers.iter().map(|layer| Scattering::new(layer.phase)).collect(),
            albedo: problem.layers.iter().map(|layer| layer.albedo).collect(),
            ground_albedo: Surface::new(problem.ground_albedo, [0.0; 2], problem.extent_m),
            extent_m: problem.extent_m,
            sunlight: sloping(DVec3::new(-east, north, -up).normalize_or(DVec3::NEG_Z)),
            sun_part,
        }
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
            let mut random = Random::new(seed, (batch << 40) | chunk);
            let numbers = chunk * CHUNK..counts.photons.min((chunk + 1) * CHUNK);
            let count = numbers.end - numbers.start;
            for number in numbers {
                if cancelled.load(Ordering::Relaxed) {
                    return;
                }
                let inside = [random.uniform(), random.uniform()];
                let (square, parts) = if number < squares * squares {
                    ([number % squares, number / squares], squares)
                } else {
                    ([0, 0], 1)
                };
                let start = [0, 1].map(|i| (square[i] as f64 + inside[i]) / parts as f64 * self.extent_m);
                self.follow(start, counts, &mut random, cancelled);
            }
            let done = reached.fetch_add(count, Ordering::Relaxed) + count;
            progress(done as f64 / counts.photons as f64);
        });
    }

    /// Follows one photon from above `start`, metres east and south.
    fn follow(&self, start: [f64; 2], counts: &Counts, random: &mut Random, cancelled: &AtomicBool) {
        let edges_m = &self.medium.edges_m;
        let mut edge = edges_m.len() - 1;
        let mut place = DVec3::new(start[0], start[1], edges_m[edge]);
        let (mut direction, mut last) = if random.uniform() < self.sun_part {
            (self.sunlight, Last::Sun)
        } else {
            (-lambertian(random), Last::Surface)
        };
        let count = |map: FluxMap, place: DVec3| counts.count(map, place.x / self.extent_m, place.y / self.extent_m);
        loop {
            // At an edge.
            let up = direction.z > 0.0;
            if edge == self.medium.base_edge {
                let down = if last == Last::Sun { FluxMap::BaseDirect } else { FluxMap::BaseDiffuse };
                count(if up { FluxMap::BaseUp } else { down }, place);
            }
            if up && edge == edges_m.len() - 1 {
                count(FluxMap::Up, place);
                if let Last::Cloud(column) = last {
                    count(FluxMap::Column, column);
                    if direction.z > NADIR_COSINE {
                        count(FluxMap::ColumnNadir, column);
                    }
                }
                return;
            }
            if !up && edge == 0 {
                count(if last == Last::Sun { FluxMap::GroundDirect } else { FluxMap::GroundDiffuse }, place);
                if random.uniform() >= self.ground_albedo.at(place.x, place.y) {
                    counts.absorb_in_ground();
                    return;
                }
                direction = lambertian(random);
                last = Last::Surface;
                // Up through the edge on the ground as well, where that is the base.
                continue;
            }
            // Into the band above or below, until an edge is reached.
            let band = if up { edge } else { edge - 1 };
            while let Flight::Collision(layer) = self.medium.fly(band, &mut place, direction, random) {
                if random.uniform() >= self.albedo[layer] {
                    counts.absorb_in_cloud();
                    return;
                }
                if cancelled.load(Ordering::Relaxed) {
                    return;
                }
                // Or coordinates lose digits on long ways.
                place.x = place.x.rem_euclid(self.extent_m);
                place.y = place.y.rem_euclid(self.extent_m);
                direction = sloping(self.scattering[layer].draw(direction, random).0);
                last = Last::Cloud(place);
            }
            edge = if direction.z > 0.0 { band + 1 } else { band };
        }
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
