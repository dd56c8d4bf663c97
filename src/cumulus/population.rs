//! A field of clouds at a time: which there are, where, how wide and how old.

use super::body::Sphere;
use super::coverage::{Class, Cover, least_m};
use super::hash::{follow, pcg3d, uniform};
use super::shape::{Cloud, Scratch};
use glam::{DVec2, dvec2};
use rayon::prelude::*;

/// Life of a cloud, seconds a metre of its width.
const LIFE_S_PER_M: f64 = 1.5;
/// Step of widths, and of the chance to be filled, from one cloud of a cell to the next: spreads them evenly over time.
const NEXT: [f64; 2] = [0.618_033_988_749_894_9, 0.414_213_562_373_095_1];

/// A field of clouds.
#[derive(Debug, Clone)]
pub(super) struct Field {
    lattices: Vec<Lattice>,
    coarse: f64,
    base_m: f64,
    extent_m: f64,
    /// Details below this are not to be seen.
    detail_m: f64,
}

/// The cells of a class of clouds.
#[derive(Debug, Clone)]
struct Lattice {
    class: Class,
    key: [u32; 3],
    /// Of every cell a place in three orders: each spreads its numbers evenly over all cells, and not like the others.
    orders: [Vec<u32>; 3],
}

impl Lattice {
    fn new(class: Class, key: [u32; 3]) -> Self {
        let orders = [0, 1, 2].map(|order| shuffled(class.side * class.side, follow(key, order)));
        Self { class, key, orders }
    }

    /// A number from 0 to below 1 of a cell in an order.
    fn part(&self, order: usize, cell: u32) -> f64 {
        let count = self.orders[order].len() as f64;
        self.orders[order].get(cell as usize).map_or(0.0, |&place| (f64::from(place) + 0.5) / count)
    }
}

/// The numbers from 0 to below a count in an order that follows from a key (Fisher and Yates).
fn shuffled(count: u32, key: [u32; 3]) -> Vec<u32> {
    let mut order: Vec<u32> = (0..count).collect();
    for last in (1..count).rev() {
        let [part, ..] = uniform(follow(key, last));
        order.swap(last as usize, (part * f64::from(last + 1)) as usize);
    }
    order
}

/// Names a sphere of a field for as long as it lives: its cloud, and its number there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Name {
    pub(super) cloud: [u32; 3],
    pub(super) number: u32,
}

impl Field {
    /// Clouds that cover a part of a domain, of these widths, least and greatest, which are small against its side; of the domain
    /// its side and that of a texel.
    pub(super) fn new(coverage: f64, width_m: [f64; 2], seed: u32, base_m: f64, [extent_m, texel_m]: [f64; 2]) -> Self {
        let Cover { classes, coarse } = Cover::new(coverage, width_m, extent_m);
        let lattice = |(number, class)| Lattice::new(class, pcg3d([number, seed, 0]));
        let lattices = (1..).zip(classes).map(lattice).collect();
        Self { lattices, coarse, base_m, extent_m, detail_m: 0.5 * texel_m }
    }

    /// Spheres on others are not much smaller, in the smallest clouds.
    pub(super) fn least_m(&self) -> f64 {
        let least = self.lattices.iter().map(|lattice| self.least_of(lattice.class.width_m[0]));
        least.reduce(f64::min).unwrap_or(0.0)
    }

    fn least_of(&self, width_m: f64) -> f64 {
        least_m(self.coarse, self.detail_m, width_m)
    }

    /// Gives all clouds of a time.
    fn clouds(&self, time_s: f64, mut give: impl FnMut(Cloud)) {
        for lattice in &self.lattices {
            let (class, side) = (lattice.class, lattice.class.side);
            let [age, ..] = uniform(lattice.key);
            let shift = uniform(follow(lattice.key, 3));
            let life_s = LIFE_S_PER_M * class.width_m[1];
            for cell in 0..side * side {
                let lives = time_s / life_s + (age + lattice.part(0, cell)).fract();
                let born = lives.floor();
                if (lattice.part(1, cell) + NEXT[1] * born).fract() >= class.filled {
                    continue;
                }
                let of_cell = follow(lattice.key, 4 + cell);
                let key = pcg3d([of_cell[0], of_cell[1] ^ born as i64 as u32, of_cell[2]]);
                let [east, north, _] = uniform(key);
                let at = [cell % side, cell / side].map(f64::from);
                let place = dvec2(at[0] + east + shift[0], at[1] + north + shift[1]) / f64::from(side);
                give(Cloud {
                    key,
                    centre: (place - place.floor() - DVec2::splat(0.5)) * self.extent_m,
                    base_m: self.base_m,
                    width_m: class.width_of((lattice.part(2, cell) + NEXT[0] * born).fract()),
                    age: lives - born,
                });
            }
        }
    }

    /// All spheres of a time with their names, in an order that does not depend on the number of cores.
    pub(super) fn spheres(&self, time_s: f64) -> Vec<(Name, Sphere)> {
        let mut clouds = Vec::new();
        self.clouds(time_s, |cloud| clouds.push(cloud));
        let of_cloud = |scratch: &mut Scratch, cloud: &Cloud| {
            let mut spheres = Vec::new();
            cloud.spheres(self.least_of(cloud.width_m), scratch, |number, sphere| {
                spheres.push((Name { cloud: cloud.key, number }, sphere));
            });
            spheres
        };
        clouds.par_iter().map_init(Scratch::default, of_cloud).collect::<Vec<_>>().concat()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;

    /// Spheres of a time by their names.
    fn named(field: &Field, time_s: f64) -> HashMap<Name, Sphere> {
        let (mut named, mut count) = (HashMap::new(), 0);
        for (name, sphere) in field.spheres(time_s) {
            count += 1;
            named.insert(name, sphere);
        }
        assert_eq!(named.len(), count, "a name is given twice at {time_s} s");
        named
    }

    fn radius(spheres: &HashMap<Name, Sphere>, name: &Name) -> f64 {
        spheres.get(name).map_or(0.0, |sphere| sphere.radius_m)
    }

    /// No radius jumps and no sphere does, over births and deaths: whatever was not there had no radius.
    #[test]
    fn radii_change_by_three_metres_a_second_at_most() {
        const STEP_S: f64 = 0.5;
        let (mut seen, mut born) = (0, 0);
        for (width_m, extent_m, begin_s) in
            [([200.0, 600.0], 2500.0, 0.0), ([900.0, 900.0], 3000.0, 1e7), ([60.0, 90.0], 500.0, 12_345.0)]
        {
            let field = Field::new(0.2, width_m, 5, 700.0, [extent_m, 10.0]);
            let (mut before, mut fastest) = (named(&field, begin_s), 0.0_f64);
            for step in 1..=500 {
                let now = named(&field, begin_s + STEP_S * f64::from(step));
                for name in now.keys().chain(before.keys()) {
                    fastest = fastest.max((radius(&now, name) - radius(&before, name)).abs() / STEP_S);
                    if let (Some(a), Some(b)) = (before.get(name), now.get(name)) {
                        // Tops rise by a few metres a second.
                        let way_m = a.centre.distance(b.centre);
                        assert!(way_m <= 6.0 * STEP_S, "{name:?} moves {way_m} m");
                    }
                }
                seen += now.len();
                born += now.keys().filter(|name| !before.contains_key(name)).count();
                before = now;
            }
            assert!(fastest <= 3.0, "{width_m:?}: {fastest} m/s");
        }
        assert!(seen > 100_000 && born > 300, "{seen} seen, {born} born");
    }

    #[test]
    fn an_order_has_every_number_once() {
        for count in [1, 2, 9, 1000] {
            let mut order = shuffled(count, [1, 2, count]);
            assert!(count < 9 || order.windows(2).any(|pair| pair[0] > pair[1]));
            order.sort_unstable();
            assert_eq!(order, (0..count).collect::<Vec<_>>());
        }
    }
}
