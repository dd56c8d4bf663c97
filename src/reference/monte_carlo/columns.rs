//! Columns with bases, tops and extinctions of their own, as a photon meets them.

use super::surface::Surface;
use crate::adiabatic::{GROWTH, growth_at};
use crate::reference::columns::grows;
use crate::reference::map::Map;

/// Columns of a layer, by metres east and south.
#[derive(Debug)]
pub(super) struct Columns {
    path: Surface,
    top: Surface,
    base: Surface,
    densest: Surface,
    /// Whether extinction grows with height, as in adiabatic cloud.
    grows: bool,
}

impl Columns {
    /// Of a map of paths, tops and bases, metres.
    pub(super) fn new(map: &Map, offset_uv: [f64; 2], extent_m: f64) -> Self {
        let surface = |which: usize| Surface::of(map, offset_uv, extent_m, move |texel| texel[which]);
        let grows = map.texels.first().is_some_and(|column| grows(*column));
        let most = if grows { GROWTH } else { 1.0 };
        let density =
            |[path_m, top_m, base_m, _]: [f64; 4]| if path_m > 0.0 { most * path_m / (top_m - base_m) } else { 0.0 };
        let densest = Surface::of(map, offset_uv, extent_m, density);
        Self { path: surface(0), top: surface(1), base: surface(2), densest, grows }
    }

    /// Density, relative to that of the layer, at a place and a height above the base plane.
    pub(super) fn density_at(&self, x_m: f64, y_m: f64, height_m: f64) -> f64 {
        let (top_m, base_m) = (self.top.at(x_m, y_m), self.base.at(x_m, y_m));
        if height_m <= base_m || height_m >= top_m {
            return 0.0;
        }
        let even = self.path.at(x_m, y_m) / (top_m - base_m);
        if self.grows { even * growth_at((height_m - base_m) / (top_m - base_m)) } else { even }
    }

    /// Greatest heights and densities in each of `cells` x `cells` equal parts of the domain. Between columns the density is
    /// that of none of them exceeded: it is a mean of theirs, weighted by thickness.
    pub(super) fn greatest_in(&self, cells: usize) -> [Vec<f64>; 2] {
        [self.top.greatest_in(cells), self.densest.greatest_in(cells)]
    }
}
