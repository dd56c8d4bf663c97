//! Paths against the light.

use super::medium::{Medium, Met};
use super::problem::{Part, VolumeProblem};
use crate::reference::monte_carlo::orders::{self, BY_ORDER};
use crate::reference::monte_carlo::random::Random;
use crate::reference::monte_carlo::scattering::{Scattering, turned};
use crate::reference::monte_carlo::surface::Surface;
use glam::DVec3;
use std::f64::consts::PI;

/// Outcomes of a path: light of the sun, scattered in clouds alone; of the sun, reflected by the ground at least once; of the
/// sky without the ground; of the sky with it; all; then all by the number of scatterings.
pub(super) const OUTCOMES: usize = BY_ORDERS + BY_ORDER;
pub(super) const SUN: usize = 0;
pub(super) const SUN_GROUND: usize = 1;
pub(super) const SKY: usize = 2;
pub(super) const SKY_GROUND: usize = 3;
pub(super) const TOTAL: usize = 4;
pub(super) const BY_ORDERS: usize = 5;

/// Paths that can add less than this part of what their start could are continued by chance.
const FAINT: f64 = 0.5;
/// Phase functions with a higher peak make paths branch towards the sun: for that of Henyey and Greenstein with an asymmetry of
/// 0.85, a peak of 82, the same error takes half the time then.
const PEAK: f64 = 10.0;
/// Directions are at least this steep, so that every flight ends.
const LEAST_SLOPE: f64 = 1e-4;

/// Everything that paths go through.
#[derive(Debug)]
pub(in crate::reference::monte_carlo) struct World<'a> {
    pub(in crate::reference::monte_carlo) medium: Medium<'a>,
    /// Of each part.
    droplets: Vec<Droplets>,
    ground: Ground,
    /// Unit vector towards the sun.
    pub(super) sun: DVec3,
    /// On a plane facing it; 0 if it is not above the horizon.
    pub(super) sun_irradiance: f64,
    pub(super) sky_radiance: f64,
}

/// The ground's albedo.
#[derive(Debug)]
enum Ground {
    Even(f64),
    Mapped { albedo: Surface, half_m: f64 },
}

#[derive(Debug)]
struct Droplets {
    scattering: Scattering,
    albedo: f64,
    peaked: bool,
}

/// A path on its way.
#[derive(Clone, Copy, Debug)]
struct Flight {
    place: DVec3,
    /// Away from the eye.
    direction: DVec3,
    weight: f64,
    /// Whether it has been reflected by the ground.
    grounded: bool,
    /// How often it has been scattered or reflected.
    order: usize,
}

impl Ground {
    fn new(problem: &VolumeProblem<'_>) -> Self {
        let (map, extent_m) = (problem.ground_albedo, problem.extent_m);
        match map.texels.as_slice() {
            [texel] => Self::Even(texel[0]),
            _ => Self::Mapped { albedo: Surface::new(map, [0.0; 2], extent_m), half_m: 0.5 * extent_m },
        }
    }
}

impl<'a> World<'a> {
    pub(in crate::reference::monte_carlo) fn new(problem: &VolumeProblem<'a>) -> Self {
        let droplets = |part: &Part<'_>| {
            let scattering = Scattering::new(part.phase);
            let peaked = scattering.value(DVec3::Z, DVec3::Z) > PEAK;
            Droplets { scattering, albedo: part.albedo, peaked }
        };
        let sun = problem.towards_sun.normalize_or(DVec3::Z);
        Self {
            medium: Medium::new(problem),
            droplets: problem.parts.iter().map(droplets).collect(),
            ground: Ground::new(problem),
            sun,
            sun_irradiance: if sun.z > 0.0 { problem.sun_irradiance } else { 0.0 },
            sky_radiance: problem.sky_radiance,
        }
    }

    /// Radiance that a part scatters into a path per unit of sunlight's irradiance.
    pub(in crate::reference::monte_carlo) fn scattered(&self, part: usize, direction: DVec3) -> f64 {
        let droplets = &self.droplets[part];
        droplets.albedo * droplets.scattering.value(direction, self.sun) / (4.0 * PI)
    }

    pub(in crate::reference::monte_carlo) fn albedo(&self, part: usize) -> f64 {
        self.droplets[part].albedo
    }

    /// How the droplets of a part scatter.
    pub(in crate::reference::monte_carlo) fn scattering(&self, part: usize) -> &Scattering {
        &self.droplets[part].scattering
    }

    /// Whether they have a forward peak.
    pub(in crate::reference::monte_carlo) fn is_peaked(&self, part: usize) -> bool {
        self.droplets[part].peaked
    }

    /// Of a place on the ground.
    pub(in crate::reference::monte_carlo) fn ground_albedo(&self, place: DVec3) -> f64 {
        match &self.ground {
            Ground::Even(albedo) => *albedo,
            Ground::Mapped { albedo, half_m } => albedo.at(place.x + half_m, half_m - place.y),
        }
    }

    /// Radiance of the ground at a place, one path's worth: in all, and by order.
    pub(super) fn reflected(&self, place: DVec3, random: &mut Random) -> [f64; OUTCOMES] {
        let mut outcomes = [0.0; OUTCOMES];
        let albedo = self.ground_albedo(place);
        if albedo <= 0.0 {
            return outcomes;
        }
        let lit = self.sunlight(place, random) * self.sun.z / PI;
        let flight = Flight { place, direction: from_matt_surface(random), weight: 1.0, grounded: false, order: 1 };
        self.follow_all(vec![flight], &mut outcomes, random);
        outcomes[TOTAL] += lit;
        outcomes[BY_ORDERS + orders::place(1)] += lit;
        outcomes.map(|light| albedo * light)
    }

    /// Radiance that arrives at a level surface but for the sun's beam, in the mean weighted with the cosine; one path's worth.
    pub(super) fn arriving(&self, place: DVec3, random: &mut Random) -> f64 {
        let mut outcomes = [0.0; OUTCOMES];
        let flight = Flight { place, direction: from_matt_surface(random), weight: 1.0, grounded: false, order: 0 };
        self.follow_all(vec![flight], &mut outcomes, random);
        outcomes[TOTAL]
    }

    /// Irradiance of the sun that arrives, on a plane facing it.
    pub(super) fn sunlight(&self, place: DVec3, random: &mut Random) -> f64 {
        if self.sun_irradiance <= 0.0 {
            return 0.0;
        }
        self.sun_irradiance * self.medium.transmittance(place, self.sun, random)
    }

    /// Light that a part scatters into a path of weight 1, without sunlight that comes straight there.
    pub(super) fn follow_scattered(
        &self,
        part: usize,
        place: DVec3,
        direction: DVec3,
        outcomes: &mut [f64; OUTCOMES],
        random: &mut Random,
    ) {
        let mut waiting = Vec::new();
        self.scatter(part, Flight { place, direction, weight: 1.0, grounded: false, order: 1 }, &mut waiting, random);
        self.follow_all(waiting, outcomes, random);
    }

    /// Light that comes along flights, sunlight that is scattered or reflected at their ends included.
    fn follow_all(&self, mut waiting: Vec<Flight>, outcomes: &mut [f64; OUTCOMES], random: &mut Random) {
        while let Some(mut flight) = waiting.pop() {
            let (sun, sky) = if flight.grounded { (SUN_GROUND, SKY_GROUND) } else { (SUN, SKY) };
            match self.medium.fly(flight.place, flight.direction, random) {
                Met::Space => add(outcomes, sky, flight.order, flight.weight * self.sky_radiance),
                Met::Ground(place) => {
                    flight.weight *= self.ground_albedo(place);
                    if flight.weight > 0.0 {
                        let lit = self.sunlight(place, random) * self.sun.z;
                        let (weight, order) = (flight.weight, flight.order + 1);
                        add(outcomes, SUN_GROUND, order, weight * lit / PI);
                        let direction = from_matt_surface(random);
                        go_on(Flight { place, direction, weight, grounded: true, order }, weight, &mut waiting, random);
                    }
                }
                Met::Cloud(part, place) => {
                    let lit = flight.weight * self.scattered(part, flight.direction) * self.sunlight(place, random);
                    flight.order += 1;
                    add(outcomes, sun, flight.order, lit);
                    flight.weight *= self.albedo(part);
                    self.scatter(part, Flight { place, ..flight }, &mut waiting, random);
                }
            }
        }
        outcomes[TOTAL] = outcomes[..TOTAL].iter().sum();
    }

    /// Scatters a path into one direction, or into two where there is a forward peak and a sun to look for.
    fn scatter(&self, part: usize, flight: Flight, waiting: &mut Vec<Flight>, random: &mut Random) {
        let Droplets { scattering, peaked, .. } = &self.droplets[part];
        let (direction, phase) = scattering.draw(flight.direction, random);
        if !*peaked || self.sun_irradiance <= 0.0 {
            go_on(Flight { direction: sloping(direction), ..flight }, flight.weight, waiting, random);
            return;
        }
        let (other, to_sun) = scattering.draw(self.sun, random);
        let directions = [
            (direction, phase, scattering.value(direction, self.sun)),
            (other, scattering.value(flight.direction, other), to_sun),
        ];
        for (direction, phase, to_sun) in directions {
            let weight = flight.weight * phase / (phase + to_sun);
            let branch = Flight { direction: sloping(direction), weight, ..flight };
            go_on(branch, weight * to_sun.max(1.0), waiting, random);
        }
    }

    /// A direction after scattering by a part.
    pub(super) fn turned(&self, part: usize, direction: DVec3, random: &mut Random) -> DVec3 {
        sloping(self.droplets[part].scattering.draw(direction, random).0)
    }
}

/// Adds light of a kind and order.
fn add(outcomes: &mut [f64; OUTCOMES], kind: usize, order: usize, light: f64) {
    outcomes[kind] += light;
    outcomes[BY_ORDERS + orders::place(order)] += light;
}

/// Keeps a path; one that can add little only by chance, with more weight then.
fn go_on(mut flight: Flight, worth: f64, waiting: &mut Vec<Flight>, random: &mut Random) {
    if worth < FAINT {
        if random.uniform() * FAINT >= worth {
            return;
        }
        flight.weight *= FAINT / worth;
    }
    waiting.push(flight);
}

/// A direction up from a matt surface: the cosine's distribution.
pub(super) fn from_matt_surface(random: &mut Random) -> DVec3 {
    sloping(turned(DVec3::Z, random.uniform().sqrt(), random))
}

/// The direction, or one that is steep enough.
pub(super) fn sloping(direction: DVec3) -> DVec3 {
    let steep = direction.z.abs() >= LEAST_SLOPE;
    if steep { direction } else { direction.with_z(LEAST_SLOPE.copysign(direction.z)).normalize() }
}
