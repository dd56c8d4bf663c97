//! A ray from an eye, cut into steps, so that scatterings on it can be drawn from where they are likely.

use super::problem::GlobeView;
use super::world::{Around, Vertex};
use crate::reference::monte_carlo::air::{self, Ray, Tensor, pieces};
use crate::reference::monte_carlo::orders::{OUTCOMES, TOTAL, tally};
use crate::reference::monte_carlo::random::Random;
use crate::reference::monte_carlo::volume::MAX_PARTS;
use glam::DVec3;
use std::f64::consts::PI;
use std::ops::ControlFlow;

/// Nothing is seen behind this optical depth.
const OPAQUE: f64 = 40.0;
/// Steps less deep than this are taken as even.
const THIN: f64 = 1e-9;

/// A ray and its steps.
pub(super) struct Seen<'a> {
    around: Around<'a>,
    ray: Ray,
    direction: DVec3,
    clouds: Vec<Piece>,
    steps: Vec<Step>,
    /// Where it meets the ground, with the albedo there.
    ground: Option<(DVec3, f64)>,
    /// Part of the light from its end that arrives.
    transmittance: f64,
    /// Light scattered once that the steps and the ground add where no cloud shades them.
    lit: [f64; 2],
    /// Part of even light that the steps and the ground scatter into the ray.
    scattered: [f64; 2],
}

/// A piece of cloud on the ray.
#[derive(Clone, Copy)]
struct Piece {
    from: f64,
    to: f64,
    /// Of each part, and of all, for a metre of the ray.
    extinctions: [f64; MAX_PARTS],
    extinction: f64,
}

/// A piece of the ray with one extinction.
struct Step {
    start: f64,
    length: f64,
    extinction: f64,
    /// The number of the piece of cloud that it lies in.
    cloud: Option<usize>,
    /// Scattering at its middle, by air and droplets.
    scattering: f64,
    /// Light scattered once, without the clouds' shadows, and part of even light that is scattered into the ray, in all steps up to and
    /// with this one.
    lit: f64,
    scattered: f64,
}

impl<'a> Seen<'a> {
    pub(super) fn new(around: Around<'a>, view: &GlobeView) -> Self {
        let direction = view.direction.normalize_or(DVec3::Z);
        let ray = Ray::new(around.position(view.eye), direction);
        let clouds = cloud_pieces(&around, &ray, view.only);
        let mut seen = Self {
            around,
            ray,
            direction,
            clouds,
            steps: Vec::new(),
            ground: None,
            transmittance: 1.0,
            lit: [0.0; 2],
            scattered: [0.0; 2],
        };
        seen.cut();
        if ray.meets_ground && seen.transmittance > 0.0 {
            let position = ray.position(ray.end);
            let albedo = around.ground_albedo(position);
            let (sunlight, cosine) = around.world.clear_sunlight(position);
            seen.ground = Some((position, albedo));
            seen.lit[1] = seen.transmittance * albedo / PI * cosine.max(0.0) * sunlight;
            seen.scattered[1] = seen.transmittance * albedo;
        }
        seen
    }

    fn cut(&mut self) {
        let (world, tensor) = (self.around.world, Tensor::unpolarised(self.direction, 1.0));
        let by_part: [f64; MAX_PARTS] = std::array::from_fn(|part| {
            let met = self.clouds.iter().any(|piece| piece.extinctions[part] > 0.0);
            if met { world.scattered(part, self.direction) } else { 0.0 }
        });
        let mut edges = vec![self.ray.end];
        edges.extend(pieces(self.ray.start, self.ray.end).map(|(start, _)| start));
        edges.extend(self.clouds.iter().flat_map(|piece| [piece.from, piece.to]));
        edges.sort_unstable_by(f64::total_cmp);
        let (mut depth, mut next) = (0.0, 0);
        for edge in edges.windows(2) {
            let [start, length] = [edge[0], edge[1] - edge[0]];
            let middle = start + 0.5 * length;
            if length <= 0.0 {
                continue;
            }
            if depth > OPAQUE {
                self.transmittance = 0.0;
                return;
            }
            while self.clouds.get(next).is_some_and(|piece| piece.to <= middle) {
                next += 1;
            }
            let cloud = self.clouds.get(next).filter(|piece| piece.from <= middle).copied();
            let air = world.air_at(&self.ray, middle);
            let position = self.ray.position(middle);
            let extinction = air.extinction + cloud.map_or(0.0, |piece| piece.extinction);
            let scattering = air.rayleigh + air.aerosol + cloud.map_or(0.0, |piece| self.by_droplets(&piece));
            let mut lit = world.lit_air(position, &air, self.direction, &tensor);
            if let Some(piece) = cloud {
                let source: f64 =
                    piece.extinctions.iter().zip(by_part).map(|(extinction, part)| extinction * part).sum();
                lit += source * world.clear_sunlight(position).0;
            }
            let deep = extinction * length;
            // The mean transmittance within the step is (1 - e^-depth)/depth.
            let mean = if deep < THIN { 1.0 } else { -(-deep).exp_m1() / deep };
            let through = (-depth).exp() * mean * length;
            self.lit[0] += through * lit;
            self.scattered[0] += through * scattering;
            let cloud = cloud.map(|_| next);
            let [lit, scattered] = [self.lit[0], self.scattered[0]];
            self.steps.push(Step { start, length, extinction, cloud, scattering, lit, scattered });
            depth += deep;
        }
        self.transmittance = (-depth).exp();
    }

    /// Scattering by droplets, for a metre of the ray.
    fn by_droplets(&self, piece: &Piece) -> f64 {
        let parts = piece.extinctions.iter().enumerate().filter(|(_, extinction)| **extinction > 0.0);
        parts.map(|(part, extinction)| extinction * self.around.world.droplets_albedo(part)).sum()
    }

    /// Light of an even sky that comes straight.
    pub(super) fn sky(&self) -> f64 {
        if self.ray.meets_ground { 0.0 } else { self.transmittance * self.around.world.sky_radiance }
    }

    /// One path: all light but that of the sky that comes straight.
    pub(super) fn path(&self, random: &mut Random) -> [f64; OUTCOMES] {
        let mut outcomes = [0.0; OUTCOMES];
        let lit = self.lit[0] + self.lit[1];
        if lit > 0.0 {
            let part = random.uniform() * lit;
            let position = match self.ground {
                Some((position, _)) if part >= self.lit[0] => position,
                _ => self.ray.position(self.place(self.steps.partition_point(|step| step.lit <= part), random).1),
            };
            tally(&mut outcomes, 1, lit * self.around.sun_through_clouds(position, random));
        }
        let scattered = self.scattered[0] + self.scattered[1];
        if scattered <= 0.0 {
            return outcomes;
        }
        let part = random.uniform() * scattered;
        let (vertex, share) = match self.ground {
            Some((position, _)) if part >= self.scattered[0] => (Vertex::Clear(air::Vertex::Ground(position)), 1.0),
            _ => self.scattering(self.steps.partition_point(|step| step.scattered <= part), random),
        };
        let mut higher = [0.0; OUTCOMES];
        let tensor = Tensor::unpolarised(self.direction, share);
        self.around.follow((vertex, 1), self.direction, &tensor, &mut higher, random);
        outcomes.iter_mut().zip(higher).for_each(|(outcome, higher)| *outcome += scattered * higher);
        debug_assert!(outcomes[TOTAL].is_finite());
        outcomes
    }

    /// A place in a step, drawn as light from there arrives at the step's start.
    fn place(&self, number: usize, random: &mut Random) -> (&Step, f64) {
        let step = &self.steps[number.min(self.steps.len() - 1)];
        let deep = step.extinction * step.length;
        let part = random.uniform();
        let way = if deep < THIN { part } else { -(part * (-deep).exp_m1()).ln_1p() / deep };
        (step, step.start + step.length * way.min(1.0))
    }

    /// A scattering in a step, and what is scattered there as a multiple of what the step counts: near 1, so that steps make no
    /// error.
    fn scattering(&self, number: usize, random: &mut Random) -> (Vertex, f64) {
        let (step, place) = self.place(number, random);
        let air = self.around.world.air_at(&self.ray, place);
        let position = self.ray.position(place);
        let by_air = air.rayleigh + air.aerosol;
        let cloud = step.cloud.map(|cloud| &self.clouds[cloud]);
        let whole = by_air + cloud.map_or(0.0, |piece| self.by_droplets(piece));
        let mut vertex = Vertex::Clear(air::Vertex::Air(position, air));
        let mut left = random.uniform() * whole - by_air;
        if let Some(piece) = cloud.filter(|_| left >= 0.0) {
            for (part, extinction) in piece.extinctions.iter().enumerate().filter(|(_, extinction)| **extinction > 0.0)
            {
                vertex = Vertex::Cloud(part, position);
                left -= extinction * self.around.world.droplets_albedo(part);
                if left < 0.0 {
                    break;
                }
            }
        }
        (vertex, whole / step.scattering)
    }
}

/// Clouds on a ray, in order, as far as anything is seen of them.
fn cloud_pieces(around: &Around<'_>, ray: &Ray, only: Option<usize>) -> Vec<Piece> {
    let (mut found, mut depth) = (Vec::new(), 0.0);
    around.legs(ray, [ray.start, ray.end], |leg| {
        for piece in around.pieces(leg, only) {
            depth += piece.extinction * (piece.to_m - piece.from_m);
            found.push(Piece {
                from: leg.place(piece.from_m),
                to: leg.place(piece.to_m),
                extinctions: piece.extinctions.map(|extinction| leg.per_metre(extinction)),
                extinction: leg.per_metre(piece.extinction),
            });
        }
        if depth > OPAQUE { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    found
}
