//! Paths against the light.

use std::f64::consts::PI;

use glam::DVec3;

use super::orders::{OUTCOMES, tally};
use super::problem::{AirProblem, PreparedAir};
use super::ray::Ray;
use super::tensor::Tensor;
use crate::atmosphere::geometry::{PLANET_RADIUS_M, TOP_M};
use crate::atmosphere::profile::{Coefficients, OZONE_CORNERS_M, OZONE_PEAK_PER_M};
use crate::reference::monte_carlo::random::Random;
use crate::reference::monte_carlo::scattering::turned;

/// Half of the paths whose worth is below this part of that at their start end there, and the others count double.
const FAINT: f64 = 0.05;
/// A ray going down is followed through this part of its height, and as many metres, under one bound.
const DESCENT_PART: f64 = 0.25;
const DESCENT_M: f64 = 400.0;
/// Zenith angle of the sun, degrees, from which on every flight also looks for lit air along its ray.
const LOW_SUN_DEG: f64 = 87.0;

/// Everything that paths go through.
#[derive(Debug)]
pub(in crate::reference::monte_carlo) struct World<'a> {
    pub(super) air: &'a PreparedAir<'a>,
    sun: DVec3,
    ground_albedo: f64,
    polarised: bool,
    /// Whether the sun is so low that the air that it lights is mostly higher than where light is scattered.
    pub(in crate::reference::monte_carlo) low_sun: bool,
}

/// Where a path is scattered.
#[derive(Clone, Copy, Debug)]
pub(in crate::reference::monte_carlo) enum Vertex {
    /// In the air.
    Air(DVec3, Coefficients),
    /// On the ground.
    Ground(DVec3),
}

/// What scatters at a vertex.
#[derive(Clone, Copy, Debug)]
pub(in crate::reference::monte_carlo) enum Scatterer {
    Molecules,
    Aerosol,
    /// A level surface, with its normal.
    Ground(DVec3),
}

impl<'a> World<'a> {
    pub(super) fn new(problem: &AirProblem<'a>) -> Self {
        Self::lit_from(problem.air, problem.sun(), problem.ground_albedo, problem.polarised)
    }

    /// Air and ground under a sun in a direction, a unit vector from the middle of the Earth.
    pub(in crate::reference::monte_carlo) fn lit_from(
        air: &'a PreparedAir<'a>,
        sun: DVec3,
        ground_albedo: f64,
        polarised: bool,
    ) -> Self {
        let low_sun = sun.z < LOW_SUN_DEG.to_radians().cos();
        Self { air, sun, ground_albedo, polarised, low_sun }
    }

    /// Part of the sun's light that arrives somewhere, and the cosine of its zenith angle there.
    pub(in crate::reference::monte_carlo) fn sunlight(&self, position: DVec3) -> (f64, f64) {
        let radius = position.length();
        let cosine = position.dot(self.sun) / radius;
        (self.air.depths.transmittance((radius - PLANET_RADIUS_M).clamp(0.0, TOP_M), cosine), cosine)
    }

    /// The air at a place of a ray.
    pub(in crate::reference::monte_carlo) fn air_at(&self, ray: &Ray, place: f64) -> Coefficients {
        self.air.profile.at(ray.height(place).min(TOP_M))
    }

    /// Optical depth of the air between two places of a ray.
    pub(in crate::reference::monte_carlo) fn depth_between(&self, ray: &Ray, from: f64, to: f64) -> f64 {
        self.air.depths.between(&self.air.profile, ray, from, to)
    }

    /// What sunlight scattered by a metre of air adds at the eye.
    pub(in crate::reference::monte_carlo) fn lit_air(
        &self,
        position: DVec3,
        air: &Coefficients,
        view: DVec3,
        tensor: &Tensor,
    ) -> f64 {
        let (sunlight, _) = self.sunlight(position);
        if sunlight == 0.0 {
            return 0.0;
        }
        let rayleigh = air.rayleigh * 3.0 / (16.0 * PI) * tensor.across(self.sun);
        let aerosol = air.aerosol * self.air.phase.value(view.dot(self.sun)) / (4.0 * PI) * tensor.worth();
        sunlight * (rayleigh + aerosol)
    }

    /// What sunlight reflected by the ground adds at the eye.
    pub(in crate::reference::monte_carlo) fn lit_ground(&self, position: DVec3, tensor: &Tensor) -> f64 {
        let (sunlight, cosine) = self.sunlight(position);
        self.ground_albedo / PI * cosine.max(0.0) * sunlight * tensor.worth()
    }

    /// Part of the light that a vertex scatters.
    pub(super) fn albedo(&self, vertex: &Vertex) -> f64 {
        match vertex {
            Vertex::Air(_, air) => (air.rayleigh + air.aerosol) / air.extinction,
            Vertex::Ground(_) => self.ground_albedo,
        }
    }

    /// Follows a path on from a vertex that is its scattering number `order`, whose albedo the tensor has already, and
    /// adds the sunlight that it meets at all further ones.
    pub(super) fn follow(
        &self,
        start: (Vertex, usize),
        mut view: DVec3,
        mut tensor: Tensor,
        outcomes: &mut [f64; OUTCOMES],
        random: &mut Random,
    ) {
        let faint = FAINT * tensor.worth();
        let (mut vertex, mut order) = start;
        loop {
            if tensor.worth() <= faint {
                if tensor.worth() <= 0.0 || random.uniform() < 0.5 {
                    return;
                }
                tensor = tensor.times(2.0);
            }
            (view, tensor) = self.turn(&vertex, view, tensor, random);
            let from = match vertex {
                Vertex::Air(position, _) | Vertex::Ground(position) => position,
            };
            order += 1;
            let Some(next) = self.advance((from, order), view, &tensor, outcomes, random) else { return };
            tensor = tensor.times(self.albedo(&next));
            vertex = next;
        }
    }

    /// The next vertex of a path, its scattering number `order`. Adds the sunlight that is scattered into the path
    /// before it leaves the air.
    pub(super) fn advance(
        &self,
        (from, order): (DVec3, usize),
        view: DVec3,
        tensor: &Tensor,
        outcomes: &mut [f64; OUTCOMES],
        random: &mut Random,
    ) -> Option<Vertex> {
        let ray = Ray::new(from, view);
        let vertex = self.fly(&ray, random);
        let at_vertex = match &vertex {
            Some(Vertex::Ground(position)) => self.lit_ground(*position, tensor),
            Some(Vertex::Air(position, air)) if !self.low_sun => {
                self.lit_air(*position, air, view, tensor) / air.extinction
            }
            Some(Vertex::Air(position, _)) => self.lit_place(&ray, position.dot(view), view, tensor),
            None => 0.0,
        };
        let elsewhere = if self.low_sun {
            let place = ray.start + (ray.end - ray.start) * random.uniform();
            self.lit_place(&ray, place, view, tensor)
        } else {
            0.0
        };
        tally(outcomes, order, at_vertex + elsewhere);
        vertex
    }

    /// What sunlight scattered at a place of a flight adds at the eye, where places come from two sources: the end of
    /// the flight, and one drawn evenly along the ray, so that lit air is found that flights seldom end in. Each
    /// counts as if drawn from the mean of both (multiple importance sampling: E. Veach, 1997).
    fn lit_place(&self, ray: &Ray, place: f64, view: DVec3, tensor: &Tensor) -> f64 {
        let air = self.air_at(ray, place);
        let lit = self.lit_air(ray.position(place), &air, view, tensor);
        if lit == 0.0 {
            return 0.0;
        }
        let transmittance = (-self.depth_between(ray, ray.start, place)).exp();
        lit * transmittance / (air.extinction * transmittance + 1.0 / (ray.end - ray.start))
    }

    /// Where the light comes from that a vertex scatters into the path, drawn as the vertex scatters unpolarised light.
    fn turn(&self, vertex: &Vertex, view: DVec3, tensor: Tensor, random: &mut Random) -> (DVec3, Tensor) {
        let scatterer = self.scatterer(vertex, random);
        let (direction, weight) = self.draw(scatterer, view, &tensor, random);
        (direction, self.turned(scatterer, &tensor, direction, weight))
    }

    /// What of a vertex scatters, drawn as it scatters.
    pub(in crate::reference::monte_carlo) fn scatterer(&self, vertex: &Vertex, random: &mut Random) -> Scatterer {
        match vertex {
            Vertex::Ground(position) => Scatterer::Ground(position.normalize()),
            Vertex::Air(_, air) if random.uniform() * (air.rayleigh + air.aerosol) >= air.rayleigh => {
                Scatterer::Aerosol
            }
            Vertex::Air(..) => Scatterer::Molecules,
        }
    }

    /// A direction that light comes from, and its weight, near 1.
    pub(in crate::reference::monte_carlo) fn draw(
        &self,
        scatterer: Scatterer,
        view: DVec3,
        tensor: &Tensor,
        random: &mut Random,
    ) -> (DVec3, f64) {
        match scatterer {
            Scatterer::Ground(normal) => (turned(normal, random.uniform().sqrt(), random), 1.0),
            Scatterer::Aerosol => self.air.phase.draw(view, random),
            Scatterer::Molecules => loop {
                // Two thirds of all directions are taken.
                let direction = turned(DVec3::Z, 2.0 * random.uniform() - 1.0, random);
                if random.uniform() < tensor.dipole_part(direction) {
                    return (direction, 1.0);
                }
            },
        }
    }

    /// How often a direction is drawn: 1 in the mean over the sphere.
    pub(in crate::reference::monte_carlo) fn density(
        &self,
        scatterer: Scatterer,
        view: DVec3,
        tensor: &Tensor,
        direction: DVec3,
    ) -> f64 {
        match scatterer {
            Scatterer::Ground(normal) => 4.0 * normal.dot(direction).max(0.0),
            Scatterer::Aerosol => self.air.phase.value(view.dot(direction)),
            Scatterer::Molecules => 1.5 * tensor.dipole_part(direction),
        }
    }

    /// What light from a direction is worth, if that was drawn as the scatterer has it; times a weight.
    pub(in crate::reference::monte_carlo) fn turned(
        &self,
        scatterer: Scatterer,
        tensor: &Tensor,
        direction: DVec3,
        weight: f64,
    ) -> Tensor {
        match scatterer {
            Scatterer::Molecules if self.polarised => tensor.through_dipole(direction).times(weight),
            _ => Tensor::unpolarised(direction, tensor.worth() * weight),
        }
    }

    /// The next vertex along a ray, exactly distributed: none where it leaves the air.
    pub(super) fn fly(&self, ray: &Ray, random: &mut Random) -> Option<Vertex> {
        let met = self.fly_to(ray, ray.end, random);
        met.or_else(|| ray.meets_ground.then(|| Vertex::Ground(ray.position(ray.end))))
    }

    /// The next vertex in the air before a place of a ray.
    pub(in crate::reference::monte_carlo) fn fly_to(&self, ray: &Ray, end: f64, random: &mut Random) -> Option<Vertex> {
        let mut place = ray.start;
        while place < end {
            let (lowest_m, part_end) = part(ray, place);
            let part_end = part_end.min(end);
            let bound = self.bound(lowest_m);
            let next = if bound > 0.0 { place + random.free_path() / bound } else { part_end };
            if next >= part_end {
                // A free path has no memory: it may be drawn anew from there.
                place = part_end;
                continue;
            }
            place = next;
            let air = self.air_at(ray, place);
            if random.uniform() * bound < air.extinction {
                return Some(Vertex::Air(ray.position(place), air));
            }
        }
        None
    }

    /// An extinction that is not exceeded at this height or above: all but the ozone thins out upwards.
    fn bound(&self, lowest_m: f64) -> f64 {
        let ozone = if lowest_m < OZONE_CORNERS_M[2] { self.air.medium.ozone_depth * OZONE_PEAK_PER_M } else { 0.0 };
        self.air.profile.at(lowest_m).extinction + ozone
    }
}

/// The part of a ray from a place on for which one bound is used: its lowest height and its end.
fn part(ray: &Ray, place: f64) -> (f64, f64) {
    let height_m = ray.height(place).min(TOP_M);
    if place >= 0.0 {
        return (height_m, ray.end);
    }
    let down_m = (height_m * (1.0 - DESCENT_PART) - DESCENT_M).max(0.0);
    let end = (-ray.place_of_height(down_m)).min(ray.end);
    if end > place { (ray.height(end), end) } else { (ray.height(0.0_f64.min(ray.end)), 0.0_f64.min(ray.end)) }
}

#[cfg(test)]
mod tests {
    use super::{AirProblem, DVec3, PLANET_RADIUS_M, PreparedAir, Random, Ray, World};
    use crate::atmosphere::profile::{Aerosol, Medium};

    #[test]
    fn flights_end_as_often_as_the_optical_depth_says() {
        // Ozone absorbs most here, and a flight into its layer from below shows whether the bound holds there.
        let medium = Medium::new(580.0, 1.0, 300.0, Aerosol::henyey_greenstein(0.3, 1200.0, 0.9, 0.7));
        let air = PreparedAir::new(&medium).unwrap();
        let problem = AirProblem { air: &air, ground_albedo: 0.5, sun_zenith_deg: 0.0, polarised: false };
        let world = World::new(&problem);
        let mut random = Random::new(1, 0);
        for (height_m, cosine) in [
            (0.0, 1.0),
            (0.0, 0.02),
            (2000.0, 0.3),
            (16_000.0, 0.02),
            (12_000.0, -0.05),
            (40_000.0, -0.09),
            (99_000.0, -0.17),
        ] {
            let (count, mut escaped) = (40_000, 0);
            let direction = DVec3::new((1.0_f64 - cosine * cosine).sqrt(), 0.0, cosine);
            let ray = Ray::new(DVec3::Z * (PLANET_RADIUS_M + height_m), direction);
            for _ in 0..count {
                escaped += u32::from(world.fly(&ray, &mut random).is_none());
            }
            let part = f64::from(escaped) / f64::from(count);
            let exact = world.air.depths.transmittance(height_m, cosine);
            let error = (exact * (1.0 - exact) / f64::from(count)).sqrt();
            assert!((part - exact).abs() < 4.0 * error + 1e-5, "{part}, not {exact} at {height_m}, {cosine}");
        }
    }
}
