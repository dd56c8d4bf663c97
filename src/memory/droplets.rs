//! Optics of droplets as far as sizes go: without the tables that take seconds.

use crate::optics::{Mix, SizeDistribution};
use crate::scene::Droplets;
use crate::scene::quantity::Quantity as _;

/// Extinction efficiency of droplets that are large against the wavelength, and somewhat more.
const EFFICIENCY: f64 = 2.3;
/// One minus the asymmetry of droplets of water, at most: those of 4 micrometres, the smallest that clouds of any thickness have.
const WATER: f64 = 0.18;

/// Extinction, 1/m, about.
pub(super) fn extinction_per_m(droplets: &Droplets) -> f64 {
    let area_um2 = match droplets.mix() {
        Mix::Gamma { effective_radius_um, broadness, .. } => {
            SizeDistribution { effective_radius_um, broadness }.mean_area_um2()
        }
        Mix::HenyeyGreenstein { .. } | Mix::Tabulated { .. } => 0.0,
    };
    droplets.extinction_per_m([EFFICIENCY * area_um2; 3])[1]
}

/// Length over which light forgets its direction, metres, at least.
pub(super) fn transport_length_m(droplets: &Droplets) -> f64 {
    let turned = match droplets {
        Droplets::Gamma { .. } => WATER,
        Droplets::HenyeyGreenstein { asymmetry, .. } => 1.0 - asymmetry.get(),
        Droplets::Tabulated { .. } => 1.0,
    };
    1.0 / (extinction_per_m(droplets) * turned).max(1e-9)
}
