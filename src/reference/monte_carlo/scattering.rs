//! Draws scattering angles and looks up phase functions, both exactly for the log-linear function of
//! [`PhaseFunction::value`].

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::DVec3;

use super::random::Random;
use crate::optics::PhaseFunction;
use crate::optics::phase::grid_deg;

/// Entries of the table that finds the panel of an angle: the grid's angles are multiples of 0.01 degrees.
const ANGLE_CELLS: usize = 18_000;
/// Entries of the table that finds the panel of a random number.
const GUIDE_CELLS: usize = 8192;

/// A panel of the phase function's grid.
#[derive(Clone, Copy, Debug)]
struct Panel {
    /// First angle, radians.
    start: f64,
    /// Last angle, radians.
    end: f64,
    /// log P at the start.
    log: f64,
    /// Change of log P per radian.
    slope: f64,
    /// No value of P sin is larger than this.
    bound: f64,
    /// Part of the light scattered by less than `end`.
    within: f64,
}

/// A phase function made ready.
#[derive(Debug)]
pub(super) struct Scattering {
    panels: Vec<Panel>,
    /// First panel of each cell of angle.
    of_angle: Vec<u16>,
    /// First panel of each cell of the cumulated distribution.
    guide: Vec<u16>,
}

impl Scattering {
    pub(super) fn new(phase: &PhaseFunction) -> Self {
        let angles: Vec<f64> = grid_deg().iter().map(|degrees| degrees.to_radians()).collect();
        let values = phase.grid_values();
        let mut panels: Vec<Panel> = angles
            .windows(2)
            .zip(values.windows(2))
            .map(|(angle, value)| {
                let (start, end) = (angle[0], angle[1]);
                let highest = FRAC_PI_2.clamp(start, end).sin();
                Panel {
                    start,
                    end,
                    log: value[0].ln(),
                    slope: (value[1].ln() - value[0].ln()) / (end - start),
                    bound: value[0].max(value[1]) * highest,
                    within: phase.fraction_within(end),
                }
            })
            .collect();
        if let Some(last) = panels.last_mut() {
            // Nothing drawn or asked for may fall behind the last panel.
            last.end = f64::INFINITY;
            last.within = f64::INFINITY;
        }
        let of_angle = cells(&panels, ANGLE_CELLS, PI, |panel| panel.end);
        let guide = cells(&panels, GUIDE_CELLS, 1.0, |panel| panel.within);
        Self { panels, of_angle, guide }
    }

    /// P between two unit vectors.
    pub(super) fn value(&self, from: DVec3, to: DVec3) -> f64 {
        let angle = from.dot(to).clamp(-1.0, 1.0).acos();
        let cell = (angle * (ANGLE_CELLS as f64 / PI)) as usize;
        let panel = self.find(&self.of_angle, cell, |panel| panel.end <= angle);
        (panel.log + panel.slope * (angle - panel.start)).exp()
    }

    /// A direction after scattering, drawn from P around `direction`, and P there.
    pub(super) fn draw(&self, direction: DVec3, random: &mut Random) -> (DVec3, f64) {
        let part = random.uniform();
        let panel = self.find(&self.guide, (part * GUIDE_CELLS as f64) as usize, |panel| panel.within <= part);
        let width = panel.end.min(PI) - panel.start;
        loop {
            let offset = width * random.uniform();
            let (sine, cosine) = (panel.start + offset).sin_cos();
            let value = (panel.log + panel.slope * offset).exp();
            if random.uniform() * panel.bound <= value * sine {
                let (side, up) = direction.any_orthonormal_pair();
                let (sin_azimuth, cos_azimuth) = (TAU * random.uniform()).sin_cos();
                let across = side * cos_azimuth + up * sin_azimuth;
                return ((direction * cosine + across * sine).normalize(), value);
            }
        }
    }

    fn find(&self, table: &[u16], cell: usize, before: impl Fn(&Panel) -> bool) -> Panel {
        let mut at = usize::from(table[cell.min(table.len() - 1)]);
        while before(&self.panels[at]) {
            at += 1;
        }
        self.panels[at]
    }
}

/// A direction at an angle from another, at a random azimuth around it.
pub(super) fn turned(direction: DVec3, cosine: f64, random: &mut Random) -> DVec3 {
    let (side, up) = direction.any_orthonormal_pair();
    let (sin_azimuth, cos_azimuth) = (TAU * random.uniform()).sin_cos();
    let across = side * cos_azimuth + up * sin_azimuth;
    (direction * cosine + across * (1.0 - cosine * cosine).max(0.0).sqrt()).normalize()
}

/// The first panel of each of `count` cells of 0..`last`.
fn cells(panels: &[Panel], count: usize, last: f64, end: impl Fn(&Panel) -> f64) -> Vec<u16> {
    let first = |cell: usize| {
        let start = last * cell as f64 / count as f64;
        panels.partition_point(|panel| end(panel) <= start) as u16
    };
    (0..count).map(first).collect()
}

#[cfg(test)]
mod tests {

    use super::{DVec3, PI, Random, Scattering};
    use crate::optics::{PhaseFunction, PhaseTable};

    #[test]
    fn values_are_those_of_the_phase_function() {
        let phase = PhaseFunction::henyey_greenstein(0.95).unwrap();
        let scattering = Scattering::new(&phase);
        for i in 0..=100_000 {
            let angle = PI * f64::from(i) / 1e5;
            let found = scattering.value(DVec3::Z, DVec3::new(angle.sin(), 0.0, angle.cos()));
            // The arc cosine of a rounded cosine: 1e-16 / sin(angle).
            assert!((found / phase.value(angle) - 1.0).abs() < 1e-9, "at {angle}");
        }
    }

    #[test]
    fn drawn_angles_are_spread_like_the_phase_function() {
        // A peak as steep as that of large droplets, on a broad rest.
        let points = [(0.0, 1e5), (1.0, 2e2), (5.0, 5.0), (90.0, 0.03), (140.0, 0.3), (180.0, 0.1)];
        let phase = PhaseTable::new(&points).unwrap().phase().clone();
        let scattering = Scattering::new(&phase);
        let mut random = Random::new(7, 0);
        let axis = DVec3::new(0.6, 0.0, -0.8);
        let count = 200_000;
        let mut angles: Vec<f64> =
            (0..count).map(|_| scattering.draw(axis, &mut random).0.dot(axis).clamp(-1.0, 1.0).acos()).collect();
        angles.sort_by(f64::total_cmp);
        // Kolmogorov-Smirnov: 1.95 / sqrt(n) is exceeded once in a thousand seeds.
        let far = angles
            .iter()
            .enumerate()
            .map(|(i, angle)| (phase.fraction_within(*angle) - (i as f64 + 0.5) / f64::from(count)).abs());
        assert!(far.fold(0.0, f64::max) < 1.95 / f64::from(count).sqrt());
    }
}
