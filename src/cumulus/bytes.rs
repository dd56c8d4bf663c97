//! What a layer of cumulus takes of memory, before it is made: its volume and its lattice are as fine as their bounds allow, so
//! that little depends on the clouds but how many cubes hold some.

use super::highest::highest_m;
use super::lattice;
use super::shape::reach;
use super::volume::samples;
use crate::scene::quantity::Quantity as _;
use crate::scene::{Cumulus, CumulusShape};
use std::f64::consts::PI;

/// What a layer of cumulus takes, bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct CumulusBytes {
    /// Of its volume on the host, and as much on the device.
    pub(crate) volume: u64,
    /// Of its light on the device, scattered many times.
    pub(crate) light: u64,
    /// Of what that is found with.
    pub(crate) solved: u64,
    /// Of its depth towards the sun on the device.
    pub(crate) sun_depth: u64,
    /// Of what that is found with.
    pub(crate) looked: u64,
}

/// A cube's light in three colours, and its depth, as halves.
const LIGHT: f64 = 24.0;
const DEPTH: f64 = 2.0;
/// Of every cube while its density and depth are looked for: its number, and where lists of rows are put together.
const NUMBER: f64 = 24.0;
/// What is kept of a cube of cloud while its light settles: its state, three sums, four results and their residuals, each of 64 bytes; its
/// sunlight, place and density, and those of the clear ones beside it.
const SOLVED: f64 = 64.0 * 12.0 + 90.0;
/// The same of one that is only looked at: density at its corners, place and depth, and copies where they are put together.
const LOOKED: f64 = 110.0;
/// Of a cloud's cube from base to top, and the ones that its edge makes partly cloudy, in cubes to either side: measured at coverages of
/// 0.12 to 0.6 in domains of 4 to 80 km.
const FILLED: f64 = 0.5;
const EDGE: f64 = 1.25;

impl CumulusBytes {
    /// Those of a layer in a domain, of droplets of such an extinction at most.
    pub(crate) fn new(cumulus: &Cumulus, extent_m: f64, extinction_per_m: f64) -> Self {
        let height_m = (highest_m(cumulus, extent_m) - lowest_m(cumulus)).max(1e-3 * extent_m);
        let volume = samples(extent_m, height_m);
        let (cubes, cell_m) = lattice::cubes(extent_m, height_m, extinction_per_m, volume.voxel_m);
        let filled = filled(cumulus, extent_m, height_m, cell_m);
        let bytes = |each: f64| (cubes * each) as u64;
        // Blocks of 64 samples have a byte each.
        let volume = (volume.count * (1.0 + 1.0 / 64.0)) as u64;
        // The host's lattice and the copy that is on its way to the device, once the solver's memory is free.
        let copies = 2.0 * (LIGHT + DEPTH) + LIGHT + DEPTH;
        Self {
            volume,
            light: bytes(LIGHT + DEPTH),
            solved: bytes((NUMBER + SOLVED * filled).max(copies)),
            sun_depth: bytes(DEPTH),
            looked: bytes(NUMBER + LOOKED * filled),
        }
    }
}

/// No cloud is below this height.
fn lowest_m(cumulus: &Cumulus) -> f64 {
    let base_m = cumulus.base_m.get();
    match &cumulus.shape {
        CumulusShape::Field { .. } => base_m,
        CumulusShape::Spheres { given, levels, .. } => {
            let reach = reach(*levels);
            given.iter().map(|[_, _, z, radius_m]| z - reach * radius_m).fold(f64::INFINITY, f64::min).max(base_m)
        }
    }
}

/// Part of the cubes that hold cloud.
fn filled(cumulus: &Cumulus, extent_m: f64, height_m: f64, cell_m: f64) -> f64 {
    let filled = match &cumulus.shape {
        CumulusShape::Field { coverage, width_m, .. } => {
            let [least_m, greatest_m] = width_m.map(|width_m| width_m.get().min(Cumulus::widest_m(extent_m)));
            let width_m = (least_m * greatest_m).sqrt();
            FILLED * coverage.get() * (1.0 + 2.0 * EDGE * cell_m / width_m).powi(2)
        }
        CumulusShape::Spheres { given, levels, .. } => {
            let reach = reach(*levels);
            let volume_m3 = |radius_m: f64| 4.0 / 3.0 * PI * (reach * radius_m + cell_m).powi(3);
            given.iter().map(|[.., radius_m]| volume_m3(*radius_m)).sum::<f64>() / (extent_m * extent_m * height_m)
        }
    };
    filled.min(1.0)
}
