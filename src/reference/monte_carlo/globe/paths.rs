//! Paths against the light.

use super::world::{Around, Scatters, Vertex};
use crate::reference::monte_carlo::air::{self, Ray, Tensor};
use crate::reference::monte_carlo::orders::{OUTCOMES, tally};
use crate::reference::monte_carlo::random::Random;
use glam::DVec3;
use std::f64::consts::PI;

/// Paths that can add less than this part of what their start could are continued by chance.
const FAINT: f64 = 0.5;

/// A path on its way.
#[derive(Clone, Copy, Debug)]
struct Flight {
    from: DVec3,
    /// Away from the eye.
    direction: DVec3,
    tensor: Tensor,
    /// How often it was scattered.
    order: usize,
}

impl Around<'_> {
    /// Adds the light that a vertex scatters into a path but for sunlight that comes straight there. The vertex is scattering number
    /// `order` of the path, and its albedo is in the tensor, whose worth is about 1.
    pub(super) fn follow(
        &self,
        (vertex, order): (Vertex, usize),
        view: DVec3,
        tensor: &Tensor,
        outcomes: &mut [f64; OUTCOMES],
        random: &mut Random,
    ) {
        let mut waiting = Vec::new();
        self.scatter((vertex, order), view, tensor, &mut waiting, random);
        while let Some(Flight { from, direction, tensor, order }) = waiting.pop() {
            let ray = Ray::new(from, direction);
            let vertex = self.fly(&ray, random);
            tally(outcomes, order + 1, self.lit(&ray, vertex.as_ref(), direction, &tensor, random));
            match vertex {
                Some(vertex) => {
                    let tensor = tensor.times(self.albedo(&vertex));
                    if tensor.worth() > 0.0 {
                        self.scatter((vertex, order + 1), direction, &tensor, &mut waiting, random);
                    }
                }
                None => tally(outcomes, order, tensor.worth() * self.world.sky_radiance),
            }
        }
    }

    /// Sunlight that a flight along a ray meets at its end, or along it under a low sun.
    fn lit(&self, ray: &Ray, vertex: Option<&Vertex>, view: DVec3, tensor: &Tensor, random: &mut Random) -> f64 {
        let at_vertex = match vertex {
            Some(Vertex::Cloud(part, position)) => {
                self.world.scattered(*part, view) * tensor.worth() * self.sunlight(*position, random).0
            }
            Some(Vertex::Clear(air::Vertex::Ground(position))) => {
                let (sunlight, cosine) = self.sunlight(*position, random);
                self.ground_albedo(*position) / PI * cosine.max(0.0) * sunlight * tensor.worth()
            }
            Some(Vertex::Clear(air::Vertex::Air(position, _))) if self.world.has_low_sun() => {
                self.lit_place(ray, ray.place_of(*position), view, tensor, random)
            }
            Some(Vertex::Clear(air::Vertex::Air(position, air))) => {
                let clear = self.world.lit_air(*position, air, view, tensor) / air.extinction;
                if clear > 0.0 { clear * self.sun_through_clouds(*position, random) } else { 0.0 }
            }
            None => 0.0,
        };
        if !self.world.has_low_sun() {
            return at_vertex;
        }
        let place = ray.start + (ray.end - ray.start) * random.uniform();
        at_vertex + self.lit_place(ray, place, view, tensor, random)
    }

    /// What sunlight scattered by the air at a place of a flight adds at the eye, where places come from two sources: the ends of
    /// flights, and one drawn evenly along the ray, so that lit air is found that flights seldom end in. Each counts as if drawn
    /// from the mean of both (multiple importance sampling: E. Veach, 1997).
    fn lit_place(&self, ray: &Ray, place: f64, view: DVec3, tensor: &Tensor, random: &mut Random) -> f64 {
        let air = self.world.air_at(ray, place);
        let position = ray.position(place);
        let clear = self.world.lit_air(position, &air, view, tensor);
        if clear <= 0.0 {
            return 0.0;
        }
        let transmittance = self.transmittance(ray, [ray.start, place]);
        let found = clear * transmittance / (air.extinction * transmittance + 1.0 / (ray.end - ray.start));
        if found > 0.0 { found * self.sun_through_clouds(position, random) } else { 0.0 }
    }

    /// Scatters a path into one direction, or into two where there is a forward peak and a sun to look for.
    fn scatter(
        &self,
        (vertex, order): (Vertex, usize),
        view: DVec3,
        tensor: &Tensor,
        waiting: &mut Vec<Flight>,
        random: &mut Random,
    ) {
        let (world, from) = (self.world, vertex.position());
        let by = world.scatterer(&vertex, random);
        let mut go_on = |direction: DVec3, weight: f64, worth: f64, random: &mut Random| {
            let tensor = world.turned(by, tensor, direction, weight);
            let worth = tensor.worth() * worth;
            if worth >= FAINT {
                waiting.push(Flight { from, direction, tensor, order });
            } else if random.uniform() * FAINT < worth {
                waiting.push(Flight { from, direction, tensor: tensor.times(FAINT / worth), order });
            }
        };
        let (direction, weight) = world.draw(by, view, tensor, random);
        // A part that has a peak looks for its own, all else for the highest one.
        let about = match by {
            Scatters::Droplets(part) if world.is_peaked(part) => world.peaked().map(|_| part),
            _ => world.peaked(),
        };
        let Some(part) = about else { return go_on(direction, weight, 1.0, random) };
        let (other, to_sun) = world.draw_about_sun(part, random);
        for (direction, weight, to_sun) in [(direction, weight, world.about_sun(part, direction)), (other, 1.0, to_sun)]
        {
            let density = world.density(by, view, tensor, direction);
            if density > 0.0 {
                go_on(direction, weight * density / (density + to_sun), to_sun.max(1.0), random);
            }
        }
    }
}
