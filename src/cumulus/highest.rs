//! How high a layer of cumulus reaches at any time.

use super::shape::reach;
use crate::scene::quantity::Quantity as _;
use crate::scene::{Cumulus, CumulusShape};

/// No cloud rises higher above its base, widths: the highest root, and what sits on it.
const HIGHEST: f64 = 0.85;

/// Height that no cloud of a layer reaches above at any time, metres.
pub fn highest_m(cumulus: &Cumulus, extent_m: f64) -> f64 {
    let base_m = cumulus.base_m.get();
    match &cumulus.shape {
        CumulusShape::Field { width_m: [_, greatest], .. } => {
            base_m + HIGHEST * greatest.get().min(Cumulus::widest_m(extent_m)) + cumulus.edge_m.get()
        }
        CumulusShape::Spheres { given, levels, .. } => {
            let reach = reach(*levels);
            let top_m = given.iter().map(|[_, _, z, radius_m]| z + reach * radius_m).fold(base_m, f64::max);
            top_m + 0.5 * cumulus.edge_m.get()
        }
    }
}
