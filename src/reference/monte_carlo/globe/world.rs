//! Clouds and air along rays around the Earth.

use super::problem::GlobeProblem;
use crate::atmosphere::geometry::PLANET_RADIUS_M;
use crate::atmosphere::profile::Coefficients;
use crate::cumulus::Line;
use crate::reference::monte_carlo::air::{self, Ray, Scatterer, Tensor};
use crate::reference::monte_carlo::random::Random;
use crate::reference::monte_carlo::volume;
use glam::{DVec2, DVec3};
use std::ops::ControlFlow;

/// Straight rays bend up where clouds are level: they are followed in parts of this length, metres.
const LEG_M: f64 = 4000.0;

/// Everything that paths go through, whatever the place.
#[derive(Debug)]
pub(super) struct World<'a> {
    air: air::World<'a>,
    clouds: volume::World<'a>,
    /// Unit vector towards the sun.
    pub(super) sun: DVec3,
    /// Above the air, on a plane facing it.
    pub(super) sun_irradiance: f64,
    /// Above the air.
    pub(super) sky_radiance: f64,
    /// The part whose droplets have the highest forward peak, if any has one.
    peaked: Option<usize>,
    /// No cloud is lower or higher, metres.
    heights_m: [f64; 2],
}

/// The world around a place: x points east from there, y north, z up, and 0 is the middle of the Earth.
#[derive(Clone, Copy, Debug)]
pub(super) struct Around<'a> {
    pub(super) world: &'a World<'a>,
    /// The place, metres east and north of the domain's middle.
    pub(super) middle: DVec2,
}

/// Where a path is scattered.
#[derive(Clone, Copy, Debug)]
pub(super) enum Vertex {
    /// In the air, with what is there, or on the ground.
    Clear(air::Vertex),
    /// In a part of the clouds.
    Cloud(usize, DVec3),
}

/// What of a vertex scatters.
#[derive(Clone, Copy, Debug)]
pub(super) enum Scatters {
    Clear(Scatterer),
    Droplets(usize),
}

/// A straight part of a ray in the space where clouds are level.
pub(super) struct Leg {
    pub(super) line: Line,
    /// Place of its start on the ray.
    start: f64,
    /// Metres of the ray for one of the line.
    stretch: f64,
}

impl Leg {
    /// The ray's place so many metres along the leg.
    pub(super) fn place(&self, way_m: f64) -> f64 {
        self.start + way_m * self.stretch
    }

    /// Extinction for a metre of the ray, from that for a metre of the leg.
    pub(super) fn per_metre(&self, extinction: f64) -> f64 {
        extinction / self.stretch
    }
}

impl Vertex {
    pub(super) fn position(&self) -> DVec3 {
        match *self {
            Self::Clear(air::Vertex::Air(position, _) | air::Vertex::Ground(position)) | Self::Cloud(_, position) => {
                position
            }
        }
    }
}

impl<'a> World<'a> {
    pub(super) fn new(problem: &GlobeProblem<'a>) -> Self {
        let clouds = volume::World::new(&problem.clouds);
        let sun = problem.clouds.towards_sun.normalize_or(DVec3::Z);
        let peak = |part: &usize| clouds.scattering(*part).value(DVec3::Z, DVec3::Z);
        let peaked = (0..problem.clouds.parts.len()).filter(|part| clouds.is_peaked(*part));
        Self {
            // The ground's albedo is the clouds' matter: it may be a map.
            air: air::World::lit_from(problem.air, sun, 1.0, problem.polarised),
            peaked: peaked.max_by(|a, b| peak(a).total_cmp(&peak(b))),
            sun,
            sun_irradiance: problem.clouds.sun_irradiance,
            sky_radiance: problem.clouds.sky_radiance,
            heights_m: [clouds.medium.bottom_m(), clouds.medium.top_m()],
            clouds,
        }
    }

    /// The air at a height on a ray.
    pub(super) fn air_at(&self, ray: &Ray, place: f64) -> Coefficients {
        self.air.air_at(ray, place)
    }

    /// Whether the air that the sun lights is mostly higher than where light is scattered.
    pub(super) fn has_low_sun(&self) -> bool {
        self.air.low_sun && self.sun_irradiance > 0.0
    }

    /// Droplets whose forward peak paths look for.
    pub(super) fn peaked(&self) -> Option<usize> {
        self.peaked.filter(|_| self.sun_irradiance > 0.0)
    }

    /// What a metre of clear air that the sun lights through nothing but air adds at the eye.
    pub(super) fn lit_air(&self, position: DVec3, air: &Coefficients, view: DVec3, tensor: &Tensor) -> f64 {
        self.sun_irradiance * self.air.lit_air(position, air, view, tensor)
    }

    /// The sun's irradiance on a plane facing it, and the cosine of its zenith angle, where nothing but air is before it.
    pub(super) fn clear_sunlight(&self, position: DVec3) -> (f64, f64) {
        let (part, cosine) = self.air.sunlight(position);
        (part * self.sun_irradiance, cosine)
    }

    /// Radiance that droplets scatter into a path per unit of sunlight's irradiance.
    pub(super) fn scattered(&self, part: usize, direction: DVec3) -> f64 {
        self.clouds.scattered(part, direction)
    }

    pub(super) fn droplets_albedo(&self, part: usize) -> f64 {
        self.clouds.albedo(part)
    }

    /// Whether the droplets of a part have a forward peak.
    pub(super) fn is_peaked(&self, part: usize) -> bool {
        self.clouds.is_peaked(part)
    }

    /// Relative density of a direction from the sun by the droplets of a part: 1 in the mean.
    pub(super) fn about_sun(&self, part: usize, direction: DVec3) -> f64 {
        self.clouds.scattering(part).value(self.sun, direction)
    }

    /// A direction about the sun, and its density.
    pub(super) fn draw_about_sun(&self, part: usize, random: &mut Random) -> (DVec3, f64) {
        self.clouds.scattering(part).draw(self.sun, random)
    }

    /// What of a vertex scatters, drawn as it scatters.
    pub(super) fn scatterer(&self, vertex: &Vertex, random: &mut Random) -> Scatters {
        match vertex {
            Vertex::Clear(vertex) => Scatters::Clear(self.air.scatterer(vertex, random)),
            Vertex::Cloud(part, _) => Scatters::Droplets(*part),
        }
    }

    /// Where light comes from that is scattered into a path: direction, and its weight.
    pub(super) fn draw(&self, by: Scatters, view: DVec3, tensor: &Tensor, random: &mut Random) -> (DVec3, f64) {
        match by {
            Scatters::Clear(by) => self.air.draw(by, view, tensor, random),
            Scatters::Droplets(part) => (self.clouds.scattering(part).draw(view, random).0, 1.0),
        }
    }

    /// How often a direction is drawn: 1 in the mean over the sphere.
    pub(super) fn density(&self, by: Scatters, view: DVec3, tensor: &Tensor, direction: DVec3) -> f64 {
        match by {
            Scatters::Clear(by) => self.air.density(by, view, tensor, direction),
            Scatters::Droplets(part) => self.clouds.scattering(part).value(view, direction),
        }
    }

    /// What light from a direction is worth, if that was drawn as it is scattered; times a weight.
    pub(super) fn turned(&self, by: Scatters, tensor: &Tensor, direction: DVec3, weight: f64) -> Tensor {
        match by {
            Scatters::Clear(by) => self.air.turned(by, tensor, direction, weight),
            Scatters::Droplets(_) => Tensor::unpolarised(direction, tensor.worth() * weight),
        }
    }
}

impl<'a> Around<'a> {
    /// A place of the domain, and its height, from the middle of the Earth.
    pub(super) fn position(&self, place: DVec3) -> DVec3 {
        let flat = place.truncate() - self.middle;
        let (sine, cosine) = (flat.length() / PLANET_RADIUS_M).sin_cos();
        (flat.normalize_or_zero() * sine).extend(cosine) * (PLANET_RADIUS_M + place.z)
    }

    /// The place of the domain below a position.
    fn below(&self, position: DVec3) -> DVec2 {
        let flat = position.truncate();
        let way_m = PLANET_RADIUS_M * flat.length().atan2(position.z);
        self.middle + flat.normalize_or_zero() * way_m
    }

    /// Of the ground at a position.
    pub(super) fn ground_albedo(&self, position: DVec3) -> f64 {
        self.world.clouds.ground_albedo(self.below(position).extend(0.0))
    }

    /// Part of the light that a vertex scatters.
    pub(super) fn albedo(&self, vertex: &Vertex) -> f64 {
        match vertex {
            Vertex::Clear(air::Vertex::Air(_, air)) => (air.rayleigh + air.aerosol) / air.extinction,
            Vertex::Clear(air::Vertex::Ground(position)) => self.ground_albedo(*position),
            Vertex::Cloud(part, _) => self.world.droplets_albedo(*part),
        }
    }

    /// Visits the parts of a ray between two places that may have clouds, in order, until one breaks.
    pub(super) fn legs<T>(
        &self,
        ray: &Ray,
        [from, to]: [f64; 2],
        mut visit: impl FnMut(&Leg) -> ControlFlow<T>,
    ) -> Option<T> {
        let [bottom_m, top_m] = self.world.heights_m;
        if bottom_m >= top_m {
            return None;
        }
        let (low, high) = (ray.place_of_height(bottom_m), ray.place_of_height(top_m));
        let level = |place: f64| self.below(ray.position(place)).extend(ray.height(place));
        for [start, end] in [[-high, -low], [low, high]] {
            let (start, end) = (start.max(from), end.min(to));
            if start >= end {
                continue;
            }
            let count = ((end - start) / LEG_M).ceil();
            let edge = |number: f64| start + (end - start) * number / count;
            let mut before = level(start);
            for number in 0..count as u64 {
                let [start, end] = [edge(number as f64), edge(number as f64 + 1.0)];
                let after = level(end);
                let way = after - before;
                let length_m = way.length();
                let wrapped = self.world.clouds.medium.wrapped(before);
                let line = Line { origin: wrapped, direction: way / length_m, from_m: 0.0, to_m: length_m };
                before = after;
                if length_m <= 0.0 {
                    continue;
                }
                if let ControlFlow::Break(found) = visit(&Leg { line, start, stretch: (end - start) / length_m }) {
                    return Some(found);
                }
            }
        }
        None
    }

    /// Clouds that a leg goes through, of one part `only` or of all.
    pub(super) fn pieces(&self, leg: &Leg, only: Option<usize>) -> Vec<volume::Piece> {
        self.world.clouds.medium.pieces(&leg.line, only)
    }

    /// Part of the sun's light that clouds let through to a position: its mean is exact.
    pub(super) fn sun_through_clouds(&self, position: DVec3, random: &mut Random) -> f64 {
        let ray = Ray::new(position, self.world.sun);
        let mut part = 1.0;
        self.legs(&ray, [ray.start, ray.end], |leg| {
            part *= self.world.clouds.medium.drawn_transmittance(&leg.line, random);
            if part > 0.0 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        });
        part
    }

    /// The sun's irradiance on a plane facing it, and the cosine of its zenith angle.
    pub(super) fn sunlight(&self, position: DVec3, random: &mut Random) -> (f64, f64) {
        let (clear, cosine) = self.world.clear_sunlight(position);
        (if clear > 0.0 { clear * self.sun_through_clouds(position, random) } else { 0.0 }, cosine)
    }

    /// Part of the light that passes along a ray between two places.
    pub(super) fn transmittance(&self, ray: &Ray, [from, to]: [f64; 2]) -> f64 {
        let mut depth = self.world.air.depth_between(ray, from, to);
        self.legs(ray, [from, to], |leg| {
            depth += self.world.clouds.medium.depth(&leg.line);
            ControlFlow::<()>::Continue(())
        });
        (-depth).exp()
    }

    /// The next vertex along a ray: none where it leaves the air.
    pub(super) fn fly(&self, ray: &Ray, random: &mut Random) -> Option<Vertex> {
        // Clouds first: where paths are scattered most, they end a flight long before the air would.
        let met =
            self.legs(ray, [ray.start, ray.end], |leg| match self.world.clouds.medium.collide(&leg.line, random) {
                Some((part, way_m)) => ControlFlow::Break((part, leg.place(way_m))),
                None => ControlFlow::Continue(()),
            });
        let end = met.map_or(ray.end, |(_, place)| place);
        if let Some(vertex) = self.world.air.fly_to(ray, end, random) {
            return Some(Vertex::Clear(vertex));
        }
        match met {
            Some((part, place)) => Some(Vertex::Cloud(part, ray.position(place))),
            None => ray.meets_ground.then(|| Vertex::Clear(air::Vertex::Ground(ray.position(ray.end)))),
        }
    }
}
