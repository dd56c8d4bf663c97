//! The remainder by adding-doubling at exactly the wanted depths and angles, without any table.

use std::f64::consts::PI;

use rayon::prelude::*;
use skyloom::slab::doubling::{Directions, Outgoing, Problem, ScaledMedium};
use skyloom::slab::radiance::Side;

/// One sun, view and azimuth.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ray {
    pub(crate) mu_sun: f64,
    pub(crate) mu_view: f64,
    pub(crate) azimuth: f64,
}

/// Remainders (reflected, transmitted) of `rays` for a slab of true optical depth `depth`, with `streams` moments kept and `nodes`
/// quadrature cosines per hemisphere.
pub(crate) fn remainders(
    albedo: f64,
    moments: &[f64],
    streams: usize,
    nodes: usize,
    depth: f64,
    rays: &[Ray],
) -> Vec<[f64; 2]> {
    const DOUBLINGS: usize = 22;
    let medium = ScaledMedium::new(albedo, moments, streams);
    let mut extra: Vec<f64> = rays.iter().flat_map(|ray| [ray.mu_sun, ray.mu_view]).collect();
    extra.sort_by(f64::total_cmp);
    extra.dedup();
    let at = |mu: f64| nodes + extra.iter().position(|other| *other == mu).unwrap();
    let places: Vec<[usize; 2]> = rays.iter().map(|ray| [at(ray.mu_view), at(ray.mu_sun)]).collect();
    let directions = Directions::new(nodes, &extra);
    // First slab thin against the smallest cosine.
    let doublings = (DOUBLINGS as f64 + depth.log2().min(0.0)).max(8.0) as usize;
    let scaled = depth * medium.depth_scale;
    let modes: Vec<Vec<[f64; 2]>> = (0..streams)
        .into_par_iter()
        .map(|mode| {
            let problem = Problem::new(&medium, mode, &directions, Outgoing::All);
            let mut found = Vec::new();
            problem.ladder(scaled * (-(doublings as f64)).exp2(), doublings, |k, slab| {
                if k == doublings {
                    found = rays
                        .iter()
                        .zip(&places)
                        .map(|(ray, [i, j])| {
                            let wave = if mode == 0 { 1.0 } else { 2.0 * (mode as f64 * ray.azimuth).cos() };
                            let once = |side: Side, phase: f64| {
                                medium.albedo / (4.0 * PI) * phase * side.order1(scaled, ray.mu_sun, ray.mu_view)
                            };
                            let phase = problem.phase();
                            [
                                wave * (slab.reflection[(*i, *j)] * ray.mu_sun / PI
                                    - once(Side::Reflected, phase.backward[(*i, *j)])),
                                wave * (slab.transmission[(*i, *j)] * ray.mu_sun / PI
                                    - once(Side::Transmitted, phase.forward[(*i, *j)])),
                            ]
                        })
                        .collect();
                }
            });
            found
        })
        .collect();
    (0..rays.len()).map(|ray| [0, 1].map(|side| modes.iter().map(|mode| mode[ray][side]).sum())).collect()
}
