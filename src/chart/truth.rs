//! Exact radiance of slabs: doubling of many moments at exactly the wanted angles, with exact single scattering and no table.

use std::f64::consts::PI;

use rayon::prelude::*;

use super::medium::Medium;
use crate::slab::doubling::{Directions, Outgoing, Problem, ScaledMedium};
use crate::slab::radiance::{Scaling, Side};

/// Effort of the doubling: moments kept and quadrature cosines per hemisphere, a third more than half the moments.
#[derive(Clone, Copy, Debug)]
pub(super) struct Effort {
    pub(super) moments: usize,
    pub(super) nodes: usize,
}

/// Within 0.1 % rms of still more moments, for light beyond 10 degrees from the sun.
pub(super) const USUAL: Effort = Effort { moments: 96, nodes: 64 };
/// Also near the sun: what remains of the cut forward peak is 1 % there.
pub(super) const NEAR_SUN: Effort = Effort { moments: 160, nodes: 108 };

/// log2 of the first slab's optical depth, which has to be small against the smallest cosine.
const LOG2_START: f64 = -22.0;

/// Radiances of slabs of the depths `first * 2^k` for every pair of a sun and a view.
pub(super) struct Truth<'a> {
    medium: &'a Medium,
    scaling: Scaling,
    depths: Vec<f64>,
    suns: Vec<f64>,
    views: Vec<f64>,
    /// By mode: depth by sun by view; remainder reflected and transmitted.
    modes: Vec<Vec<[f64; 2]>>,
}

impl<'a> Truth<'a> {
    /// `first_depth`: true optical depth of the first slab; `count`: slabs, each twice as deep as the one before; `suns` and `views`:
    /// cosines of zeniths.
    pub(super) fn new(
        medium: &'a Medium,
        effort: Effort,
        first_depth: f64,
        count: usize,
        suns: &[f64],
        views: &[f64],
        done: &(dyn Fn(f64) + Sync),
    ) -> Self {
        let scaled = ScaledMedium::new(medium.channel.albedo, &medium.channel.moments, effort.moments);
        let mut extra: Vec<f64> = suns.iter().chain(views).copied().collect();
        extra.sort_by(f64::total_cmp);
        extra.dedup();
        // Every wanted cosine is in `extra` as it is.
        let place = |mu: &f64| effort.nodes + extra.partition_point(|other| other < mu);
        let (sun_places, view_places): (Vec<_>, Vec<_>) =
            (suns.iter().map(place).collect(), views.iter().map(place).collect());
        let directions = Directions::new(effort.nodes, &extra);
        let before = (first_depth.log2() - LOG2_START).ceil().max(1.0) as usize;
        let start = first_depth * scaled.depth_scale * (-(before as f64)).exp2();
        let finished = std::sync::atomic::AtomicUsize::new(0);
        let mode = |mode: usize| {
            let problem = Problem::new(&scaled, mode, &directions, Outgoing::All);
            let phase = problem.phase();
            let mut found = Vec::with_capacity(count * suns.len() * views.len());
            problem.ladder(start, before + count - 1, |k, slab| {
                if k < before {
                    return;
                }
                for (mu_sun, j) in suns.iter().zip(&sun_places) {
                    for (mu_view, i) in views.iter().zip(&view_places) {
                        let once = |side: Side, phase: f64| {
                            scaled.albedo / (4.0 * PI) * phase * side.order1(slab.depth, *mu_sun, *mu_view)
                        };
                        let whole = mu_sun / PI;
                        found.push([
                            slab.reflection[(*i, *j)] * whole - once(Side::Reflected, phase.backward[(*i, *j)]),
                            slab.transmission[(*i, *j)] * whole - once(Side::Transmitted, phase.forward[(*i, *j)]),
                        ]);
                    }
                }
            });
            let number = finished.fetch_add(1, std::sync::atomic::Ordering::Relaxed) + 1;
            done(number as f64 / effort.moments as f64);
            found
        };
        let modes = (0..effort.moments).into_par_iter().map(mode).collect();
        Self {
            medium,
            scaling: Scaling::new(medium.channel.albedo, &scaled),
            depths: (0..count).map(|k| first_depth * (k as f64).exp2()).collect(),
            suns: suns.to_vec(),
            views: views.to_vec(),
            modes,
        }
    }

    /// True optical depths of the slabs.
    pub(super) fn depths(&self) -> &[f64] {
        &self.depths
    }

    /// Reflected and transmitted diffuse radiance, 1/sr per unit sun irradiance on a plane facing the sun; the first three are indices.
    pub(super) fn radiance(&self, depth: usize, sun: usize, view: usize, azimuth: f64) -> [f64; 2] {
        let at = (depth * self.suns.len() + sun) * self.views.len() + view;
        let mut sums = [0.0; 2];
        // cos(m azimuth) by recurrence.
        let (mut before, mut wave) = (azimuth.cos(), 1.0);
        for (mode, values) in self.modes.iter().enumerate() {
            let weight = if mode == 0 { 1.0 } else { 2.0 * wave };
            (0..2).for_each(|side| sums[side] += weight * values[at][side]);
            (before, wave) = (wave, 2.0 * azimuth.cos() * wave - before);
        }
        let (depth, mu_sun, mu_view) = (self.depths[depth], self.suns[sun], self.views[view]);
        Side::BOTH.map(|side| {
            let phase = self.medium.channel.phase.value(side.scattering_cosine(mu_sun, mu_view, azimuth).acos());
            let once = self.scaling.order1_albedo / (4.0 * PI)
                * phase
                * side.order1(self.scaling.depth_scale * depth, mu_sun, mu_view);
            sums[side as usize] + once
        })
    }
}
