//! Clouds that grow on spheres that the scene gives: level upon level of smaller ones, as on the roots of a synthetic cloud.

use super::body::Sphere;
use super::hash::pcg3d;
use super::shape::{Ball, LEVELS, reach, sits_on};
use glam::{DVec3, dvec3};
use rayon::prelude::*;

/// Spheres on a root vanish below this radius, metres, and below so much of the root's: a small root has its levels too.
const LEAST_M: f64 = 15.0;
const LEAST_PART: f64 = 0.05;
/// Most spheres. Where there would be more, the smallest are left out.
const MOST_SPHERES: usize = 200_000;

/// A root, and where the roots stand that may hide what sits on it: their numbers, and how far from their own place the nearest of their
/// repetitions is.
struct Root {
    ball: Ball,
    beside: Vec<(usize, DVec3)>,
    least_m: f64,
}

/// The roots and what sits on them, and the least radius of what does. Which spheres these are follows from the roots and the seed alone; those that no
/// texel shows, smaller than half of one, are left out. Roots' heights are above the base.
pub(super) fn grown(given: &[Sphere], levels: u32, seed: u32, [extent_m, texel_m]: [f64; 2]) -> (Vec<Sphere>, f64) {
    let mut roots = roots(given, levels, seed, [extent_m, texel_m]);
    loop {
        let families = families(&roots, levels);
        let count: usize = families.iter().map(Vec::len).sum();
        if count <= MOST_SPHERES.max(roots.len()) {
            let least_m = roots.iter().map(|root| root.least_m).fold(f64::INFINITY, f64::min);
            return (families.iter().flatten().map(Ball::sphere).collect(), least_m);
        }
        // Their number goes with the least radius to the power of -2, nearly.
        let coarser = 1.1 * (count as f64 / MOST_SPHERES as f64).sqrt();
        roots.iter_mut().for_each(|root| root.least_m *= coarser);
    }
}

fn roots(given: &[Sphere], levels: u32, seed: u32, [extent_m, texel_m]: [f64; 2]) -> Vec<Root> {
    let reach = reach(levels);
    let root = |(number, own): (usize, &Sphere)| {
        let beside = given.iter().enumerate().filter(|(other, _)| *other != number).filter_map(|(other, sphere)| {
            let apart = sphere.centre - own.centre;
            let repeated = -extent_m * (apart / extent_m).round();
            let by = dvec3(repeated.x, repeated.y, 0.0);
            let reach_m = reach * (own.radius_m + sphere.radius_m);
            ((apart + by).length_squared() < reach_m * reach_m).then_some((other, by))
        });
        Root {
            ball: Ball::root(pcg3d([number as u32, seed, 1]), *own),
            beside: beside.collect(),
            least_m: (0.5 * texel_m).max(LEAST_M).min(LEAST_PART * own.radius_m),
        }
    };
    given.par_iter().enumerate().map(root).collect()
}

/// Each root with all that sits on it.
fn families(roots: &[Root], levels: u32) -> Vec<Vec<Ball>> {
    let mut families: Vec<Vec<Ball>> = roots.iter().map(|root| vec![root.ball]).collect();
    let mut begins = vec![0; roots.len()];
    for level in LEVELS.into_iter().take(levels as usize) {
        let next = |near: &mut Vec<Sphere>, number: usize| {
            let Root { beside, least_m, .. } = &roots[number];
            let (own, mut added) = (&families[number], Vec::new());
            for parent in begins[number]..own.len() {
                let siblings = own.iter().enumerate().filter(|(other, _)| *other != parent).map(|(_, ball)| *ball);
                let others =
                    beside.iter().flat_map(|(other, by)| families[*other].iter().map(move |ball| ball.shifted(*by)));
                sits_on(&own[parent], siblings.chain(others), level, *least_m, near, &mut added);
            }
            added
        };
        let added: Vec<Vec<Ball>> = (0..roots.len()).into_par_iter().map_init(Vec::new, next).collect();
        begins = families.iter().map(Vec::len).collect();
        families.iter_mut().zip(added).for_each(|(family, mut added)| family.append(&mut added));
    }
    families
}
