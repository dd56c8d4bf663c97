//! A field of clouds at a time: which there are, where, how wide and how old.

use super::body::Sphere;
use super::coverage::{Class, classes};
use super::hash::{follow, pcg3d, uniform};
use super::shape::{Cloud, Scratch};
use glam::{DVec2, dvec2};

/// Life of a cloud, seconds a metre of its width.
const LIFE_S_PER_M: f64 = 1.5;
/// No cloud is wider than this part of the domain: it would come near itself beyond the domain's edge.
const WIDEST: f64 = 1.0 / 3.0;
/// Steps from cell to cell that spread ages, and widths, evenly over any part of a lattice (ages: Roberts' sequence), and the
/// step of widths from one cloud of a cell to the next.
const AGES: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];
const WIDTHS: [f64; 2] = [0.414_213_562_373_095_1, 0.732_050_807_568_877_2];
const NEXT: f64 = 0.618_033_988_749_894_9;

/// A field of clouds.
#[derive(Debug, Clone)]
pub(super) struct Field {
    classes: Vec<Class>,
    seed: u32,
    base_m: f64,
    extent_m: f64,
    least_m: f64,
}

/// Names a sphere of a field for as long as it lives: its cloud, and its number there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Name {
    pub(super) cloud: [u32; 3],
    pub(super) number: u32,
}

impl Field {
    /// Clouds that cover a part of a domain, of these widths, least and greatest.
    pub(super) fn new(coverage: f64, width_m: [f64; 2], seed: u32, base_m: f64, [extent_m, texel_m]: [f64; 2]) -> Self {
        let width_m = width_m.map(|width_m| width_m.min(WIDEST * extent_m));
        let least_m = f64::max((0.03 * width_m[1]).min(15.0), 0.5 * texel_m);
        Self { classes: classes(coverage, width_m, extent_m), seed, base_m, extent_m, least_m }
    }

    /// Spheres on others are not much smaller.
    pub(super) fn least_m(&self) -> f64 {
        self.least_m
    }

    /// Gives all clouds of a time.
    fn clouds(&self, time_s: f64, mut give: impl FnMut(Cloud)) {
        for (number, class) in (1..).zip(&self.classes) {
            let lattice = pcg3d([number, self.seed, 0]);
            let [age, width, _] = uniform(lattice);
            let shift = uniform(follow(lattice, 1));
            let life_s = LIFE_S_PER_M * class.width_m[1];
            for cell in 0..class.side * class.side {
                let at = [cell % class.side, cell / class.side];
                let [x, y] = at.map(f64::from);
                let lives = time_s / life_s + (age + AGES[0] * x + AGES[1] * y).fract();
                let born = lives.floor();
                let cell_key = pcg3d([at[0], at[1], lattice[2]]);
                let key = pcg3d([cell_key[0] ^ born as i64 as u32, cell_key[1], cell_key[2]]);
                let [east, north, filled] = uniform(key);
                if filled >= class.filled {
                    continue;
                }
                let narrower = (width + WIDTHS[0] * x + WIDTHS[1] * y + NEXT * born).fract();
                let place = dvec2(x + east + shift[0], y + north + shift[1]) / f64::from(class.side);
                give(Cloud {
                    key,
                    centre: (place - place.floor() - DVec2::splat(0.5)) * self.extent_m,
                    base_m: self.base_m,
                    width_m: class.width_of(narrower),
                    age: lives - born,
                });
            }
        }
    }

    /// Gives all spheres of a time with their names.
    pub(super) fn spheres(&self, time_s: f64, mut give: impl FnMut(Name, Sphere)) {
        let mut scratch = Scratch::default();
        self.clouds(time_s, |cloud| {
            cloud.spheres(self.least_m, &mut scratch, |number, sphere| give(Name { cloud: cloud.key, number }, sphere));
        });
    }
}
