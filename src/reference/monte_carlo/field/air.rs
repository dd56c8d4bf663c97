//! Air around the clouds as a photon meets it: level, from the ground to where it ends.

use glam::DVec3;

use crate::atmosphere::Medium;
use crate::atmosphere::geometry::TOP_M;
use crate::atmosphere::profile::{OZONE_CORNERS_M, OZONE_PEAK_PER_M, Profile};
use crate::optics::PhaseFunction;
use crate::optics::phase::grid_deg;
use crate::reference::monte_carlo::error::MonteCarloError;
use crate::reference::monte_carlo::random::Random;
use crate::reference::monte_carlo::scattering::{Scattering, turned};

/// Levels of greatest extinction, thin near the ground: their edges are squares. Fewer cost more collisions that are
/// none, more cost steps; between 24 and 64 nothing is gained.
const LEVELS: usize = 32;

/// What a photon meets in air.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Met {
    /// A molecule that scatters.
    Molecule,
    /// A particle that scatters.
    Particle,
    /// Something that absorbs: ozone, or a particle.
    Absorber,
}

/// Air made ready.
#[derive(Debug)]
pub(super) struct Air {
    profile: Profile,
    /// Heights of the levels' edges, one more than levels.
    edges_m: [f64; LEVELS + 1],
    /// No extinction in the level is greater, 1/m.
    greatest_per_m: [f64; LEVELS],
    particles: Scattering,
}

impl Air {
    pub(super) fn new(medium: &Medium) -> Result<Self, MonteCarloError> {
        let profile = medium.profile();
        let edges_m = std::array::from_fn(|i| TOP_M * (i as f64 / LEVELS as f64).powi(2));
        let greatest_per_m = std::array::from_fn(|i| {
            let (low_m, high_m) = (edges_m[i], edges_m[i + 1]);
            // All but ozone thins upwards, and ozone thickens evenly up to its middle.
            let [base_m, middle_m, _] = OZONE_CORNERS_M;
            let rising_m = (high_m.min(middle_m) - low_m.max(base_m)).max(0.0);
            profile.at(low_m).extinction + medium.ozone_depth * OZONE_PEAK_PER_M * OZONE_PEAK_PER_M * rising_m
        });
        let values = grid_deg().iter().map(|angle| (medium.aerosol.phase)(angle.to_radians().cos())).collect();
        let phase = PhaseFunction::from_grid_values(values).map_err(|_refused| MonteCarloError::AerosolPhase)?;
        Ok(Self { profile, edges_m, greatest_per_m, particles: Scattering::new(&phase) })
    }

    /// Flies from a height along a direction of slope `up` (its vertical part, not 0) for `end_m` at most: the way to what
    /// is met, if anything is.
    pub(super) fn fly(&self, start_m: f64, up: f64, end_m: f64, random: &mut Random) -> Option<(f64, Met)> {
        let mut level = self.level(start_m);
        let mut optical = random.free_path();
        let mut way_m = 0.0;
        loop {
            let wall_m = self.edges_m[if up > 0.0 { level + 1 } else { level }];
            let next_m = ((wall_m - start_m) / up).clamp(way_m, end_m.max(way_m));
            let greatest = self.greatest_per_m[level];
            let through = (next_m - way_m) * greatest;
            if optical >= through {
                optical -= through;
                way_m = next_m;
                level = match up > 0.0 {
                    true if level + 1 < LEVELS => level + 1,
                    false if level > 0 => level - 1,
                    _ => return None,
                };
                if way_m >= end_m {
                    return None;
                }
                continue;
            }
            way_m += optical / greatest;
            let here = self.profile.at(start_m + up * way_m);
            // Null-collision tracking: of the greatest extinction only a part is there.
            let drawn = greatest * random.uniform();
            if drawn < here.extinction {
                let met = match drawn {
                    drawn if drawn < here.rayleigh => Met::Molecule,
                    drawn if drawn < here.rayleigh + here.aerosol => Met::Particle,
                    _ => Met::Absorber,
                };
                return Some((way_m, met));
            }
            optical = random.free_path();
        }
    }

    /// The level of a height; on an edge, either of the two.
    fn level(&self, height_m: f64) -> usize {
        (((height_m / TOP_M).max(0.0).sqrt() * LEVELS as f64) as usize).min(LEVELS - 1)
    }

    /// A direction after what was met; none if it absorbs.
    pub(super) fn scatter(&self, met: Met, direction: DVec3, random: &mut Random) -> Option<DVec3> {
        match met {
            Met::Molecule => Some(turned(direction, rayleigh_cosine(random), random)),
            Met::Particle => Some(self.particles.draw(direction, random).0),
            Met::Absorber => None,
        }
    }
}

/// A cosine drawn from 3/8 (1 + c²), whose integral is a cubic.
fn rayleigh_cosine(random: &mut Random) -> f64 {
    let half = 4.0 * random.uniform() - 2.0;
    let root = (half + half.hypot(1.0)).cbrt();
    (root - 1.0 / root).clamp(-1.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::{Air, Met, OZONE_CORNERS_M, Random, rayleigh_cosine};
    use crate::atmosphere::{Aerosol, Medium};

    #[test]
    fn no_extinction_is_above_the_greatest_of_its_level() {
        for (scale_m, ozone) in [(100.0, 300.0), (1200.0, 1000.0), (10_000.0, 0.0)] {
            let medium = Medium::new(580.0, 1.0, ozone, Aerosol::henyey_greenstein(0.2, scale_m, 0.9, 0.7));
            let air = Air::new(&medium).unwrap();
            let heights = (0..100_000).map(f64::from).chain(OZONE_CORNERS_M);
            for height_m in heights {
                let (found, most) = (medium.profile().at(height_m).extinction, air.greatest_per_m[air.level(height_m)]);
                assert!(found <= most * (1.0 + 1e-12), "{found} {most} at {height_m}");
            }
        }
    }

    #[test]
    fn free_paths_are_those_of_the_optical_depth() {
        let medium = Medium::new(580.0, 1.0, 1000.0, Aerosol::henyey_greenstein(0.4, 700.0, 0.8, 0.7));
        let air = Air::new(&medium).unwrap();
        let mut random = Random::new(5, 0);
        // Of so many, those that arrive are binomial: one standard error is at most 0.0011.
        let count = 200_000;
        for (from_m, to_m, slope) in [
            (0.0, 100_000.0, 1.0),
            (100_000.0, 0.0, 0.5),
            (300.0, 20_000.0, 0.2),
            (40_000.0, 900.0, 0.1),
            (7.0, 8.0, 1e-4),
        ] {
            let up = if to_m > from_m { slope } else { -slope };
            let arrived =
                (0..count).filter(|_| air.fly(from_m, up, (to_m - from_m) / up, &mut random).is_none()).count();
            let found = arrived as f64 / f64::from(count);
            let depth = (medium.depth_above(from_m) - medium.depth_above(to_m)).abs();
            let exact = (-depth / slope).exp();
            assert!((found - exact).abs() < 4.0 * 0.0011, "{from_m} to {to_m}: {found}, not {exact}");
        }
    }

    #[test]
    fn what_is_met_goes_with_what_is_there() {
        let medium = Medium::new(580.0, 1.0, 0.0, Aerosol::henyey_greenstein(0.4, 700.0, 0.8, 0.7));
        let air = Air::new(&medium).unwrap();
        let here = medium.profile().at(1000.0);
        let (mut random, mut met) = (Random::new(6, 0), [0.0; 3]);
        // A thin sheet, flown through for so long that something is met: coefficients change by 2 % in it.
        for _ in 0..100_000 {
            if let Some((_, what)) = air.fly(995.0, 1e-6, 1e7, &mut random) {
                met[what as usize] += 1.0;
            }
        }
        let all: f64 = met.iter().sum();
        let expected = [here.rayleigh, here.aerosol, here.extinction - here.rayleigh - here.aerosol];
        for (what, (found, expected)) in
            [Met::Molecule, Met::Particle, Met::Absorber].iter().zip(met.iter().zip(expected))
        {
            let (found, exact) = (found / all, expected / here.extinction);
            assert!((found - exact).abs() < 0.008, "{what:?}: {found}, not {exact}");
        }
    }

    #[test]
    fn molecules_scatter_as_rayleigh_says() {
        let mut random = Random::new(7, 0);
        let count = 400_000;
        let mut sums = [0.0; 4];
        for _ in 0..count {
            let cosine = rayleigh_cosine(&mut random);
            (0..4).for_each(|power| sums[power] += cosine.powi(power as i32 + 1));
        }
        // Moments of 3/8 (1 + c²): the square is 2/5, the fourth power 9/35.
        for (sum, exact) in sums.into_iter().zip([0.0, 0.4, 0.0, 9.0 / 35.0]) {
            assert!((sum / f64::from(count) - exact).abs() < 0.005, "{sum}, not {exact}");
        }
    }
}
