//! Counts of photons, and what they say with which error.

use std::sync::atomic::{AtomicU64, Ordering};

use super::maps::{COUNTED, FluxMap, MAPS, MapEstimate};
use crate::reference::monte_carlo::estimate::Estimate;

/// Photons of one batch. Whole numbers: the order in which threads add to them is of no consequence.
#[derive(Debug)]
pub(super) struct Counts {
    /// How many the batch has.
    pub(super) photons: u64,
    side: usize,
    /// [`COUNTED`] maps.
    texels: Vec<AtomicU64>,
    ends: [AtomicU64; ENDS],
}

/// How a photon ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum End {
    /// Absorbed by the ground.
    Ground,
    /// Absorbed in a cloud.
    Cloud,
    /// Absorbed in the air.
    Air,
    /// Gone upwards.
    Space,
}

const ENDS: usize = End::Space as usize + 1;

impl Counts {
    /// Counts photons at a place in domains.
    pub(super) fn count(&self, map: FluxMap, u: f64, v: f64, photons: u64) {
        let texel = |place: f64| (((place - place.floor()) * self.side as f64) as usize).min(self.side - 1);
        let at = (map as usize * self.side + texel(v)) * self.side + texel(u);
        self.texels[at].fetch_add(photons, Ordering::Relaxed);
    }

    /// Counts photons that end.
    pub(super) fn end(&self, end: End, photons: u64) {
        self.ends[end as usize].fetch_add(photons, Ordering::Relaxed);
    }
}

/// Sum and sum of squares over batches: whole numbers, exact.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Moments {
    sum: f64,
    squares: f64,
}

impl Moments {
    fn add(&mut self, count: u64) {
        self.sum += count as f64;
        self.squares += (count as f64).powi(2);
    }

    /// Count and its standard error, times `scale`.
    fn estimate(&self, batches: u64, scale: f64) -> Estimate {
        if batches == 0 {
            return Estimate::default();
        }
        let batches = batches as f64;
        let spread = (self.squares - self.sum * self.sum / batches).max(0.0);
        // One batch says nothing about its error.
        let error = if batches > 1.0 { (spread * batches / (batches - 1.0)).sqrt() } else { f64::INFINITY };
        Estimate { value: scale * self.sum, standard_error: scale * error }
    }
}

/// Counts of all batches.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Tally {
    side: usize,
    batches: u64,
    /// [`MAPS`] maps.
    texels: Vec<Moments>,
    /// The maps' sums.
    totals: [Moments; MAPS],
    ends: [Moments; ENDS],
}

impl Tally {
    pub(super) fn new(side: usize) -> Self {
        Self {
            side,
            batches: 0,
            texels: vec![Moments::default(); MAPS * side * side],
            totals: [Moments::default(); MAPS],
            ends: [Moments::default(); ENDS],
        }
    }

    /// Adds a batch, which `work` counts.
    pub(super) fn add(&mut self, photons: u64, work: impl FnOnce(&Counts)) {
        let texels = self.side * self.side;
        let counts = Counts {
            photons,
            side: self.side,
            texels: std::iter::repeat_with(AtomicU64::default).take(COUNTED * texels).collect(),
            ends: std::array::from_fn(|_| AtomicU64::default()),
        };
        work(&counts);
        self.batches += 1;
        for (end, count) in self.ends.iter_mut().zip(&counts.ends) {
            end.add(count.load(Ordering::Relaxed));
        }
        let count = |map: FluxMap, texel: usize| counts.texels[map as usize * texels + texel].load(Ordering::Relaxed);
        let sum = |one, other| move |texel| count(one, texel) + count(other, texel);
        for map in [
            FluxMap::BaseDirect,
            FluxMap::BaseDiffuse,
            FluxMap::BaseUp,
            FluxMap::GroundDirect,
            FluxMap::GroundDiffuse,
            FluxMap::Up,
            FluxMap::Column,
            FluxMap::ColumnNadir,
            FluxMap::TopDirect,
            FluxMap::TopDiffuse,
        ] {
            self.add_map(map, |texel| count(map, texel));
        }
        self.add_map(FluxMap::BaseDown, sum(FluxMap::BaseDirect, FluxMap::BaseDiffuse));
        self.add_map(FluxMap::Ground, sum(FluxMap::GroundDirect, FluxMap::GroundDiffuse));
    }

    fn add_map(&mut self, map: FluxMap, count: impl Fn(usize) -> u64) {
        let mut total = 0;
        for (texel, moments) in self.of_map_mut(map).iter_mut().enumerate() {
            let count = count(texel);
            moments.add(count);
            total += count;
        }
        self.totals[map as usize].add(total);
    }

    fn of_map(&self, map: FluxMap) -> &[Moments] {
        let texels = self.side * self.side;
        &self.texels[map as usize * texels..][..texels]
    }

    fn of_map_mut(&mut self, map: FluxMap) -> &mut [Moments] {
        let texels = self.side * self.side;
        &mut self.texels[map as usize * texels..][..texels]
    }

    /// Mean standard error of the texels of a map over their mean; infinite where nothing came.
    pub(super) fn relative_error(&self, map: FluxMap) -> f64 {
        let errors: f64 = self.of_map(map).iter().map(|texel| texel.estimate(self.batches, 1.0).standard_error).sum();
        let sum = self.totals[map as usize].sum;
        if sum > 0.0 { errors / sum } else { f64::INFINITY }
    }

    pub(super) fn map(&self, map: FluxMap, photons: u64) -> MapEstimate {
        let scale = (self.side * self.side) as f64 * per(photons);
        let estimates = || self.of_map(map).iter().map(|texel| texel.estimate(self.batches, scale));
        MapEstimate {
            values: estimates().map(|estimate| estimate.value).collect(),
            standard_errors: estimates().map(|estimate| estimate.standard_error).collect(),
        }
    }

    pub(super) fn mean(&self, map: FluxMap, photons: u64) -> Estimate {
        self.totals[map as usize].estimate(self.batches, per(photons))
    }

    pub(super) fn ended(&self, end: End, photons: u64) -> Estimate {
        self.ends[end as usize].estimate(self.batches, per(photons))
    }
}

fn per(photons: u64) -> f64 {
    if photons > 0 { 1.0 / photons as f64 } else { 0.0 }
}
