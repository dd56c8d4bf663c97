//! Layers by maps: columns with bases, tops and optical depths of their own, as the passes read them.

use crate::image::{Image, MissingImage};
use crate::optics::Radii;
use crate::scene::{Droplets, Edge, ExtinctionProfile, Layer, Shape, ShapeMaps};
use std::collections::HashMap;
use std::sync::Arc;

/// The columns of a layer.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ColumnMap {
    /// Texels across and down.
    pub(crate) size: [u32; 2],
    /// How extinction changes in them.
    pub(crate) profile: ExtinctionProfile,
    /// Of each: the thickness that a cloud of the layer's extinction had at the column's optical depth, or at that which droplets of another
    /// radius count as; top and base above the base plane, metres; 1 where extinction grows
    /// with height.
    pub(crate) texels: Vec<[f32; 4]>,
    /// Height of the base plane: the lowest base.
    pub(crate) base_m: f64,
    /// Highest top above it.
    pub(crate) depth_m: f64,
    /// Mean heights of the cloudy columns' bases and tops above the ground.
    pub(crate) mean_m: [f64; 2],
    /// Mean extinction of the cloudy columns, relative to the layer's.
    pub(crate) density: f64,
}

impl ColumnMap {
    /// The columns of a layer that has maps, of droplets of an extinction (550 nm, 1/m, above 0).
    ///
    /// # Errors
    /// An image is missing.
    pub(crate) fn new(
        layer: &Layer,
        images: &HashMap<String, Arc<Image>>,
        extinction_per_m: f64,
    ) -> Result<Self, MissingImage> {
        let shape = &layer.shape;
        let maps = ShapeMaps::new(shape, images)?;
        let sizes = Sizes::new(layer, &maps);
        let derived_m = derived_m(shape, &maps, extinction_per_m);
        // Heights of all columns that have any, cloudy or not, and the cloud in them.
        let column = |number: usize| {
            let column = maps.column(number, derived_m)?;
            let thickness_m = (column.top_m - column.base_m).max(0.0);
            let path_m = match column.optical_depth {
                Some(depth) if thickness_m > 0.0 => depth / extinction_per_m,
                Some(_) => 0.0,
                None => thickness_m,
            };
            let path_m = match (&sizes, column.effective_radius_um) {
                (Some(sizes), Some(radius_um)) => {
                    let depth = path_m * extinction_per_m;
                    sizes.counts_as(depth, radius_um, column.optical_depth.is_some()) / extinction_per_m
                }
                _ => path_m,
            };
            Some([path_m, column.top_m, column.base_m])
        };
        let (mut cloudy, mut path_sum, mut sums) = (0.0, 0.0, [0.0; 2]);
        let (mut low_m, mut high_m) = (f64::INFINITY, f64::NEG_INFINITY);
        for [path_m, top_m, base_m] in (0..maps.count()).filter_map(column).filter(|[path_m, ..]| *path_m > 0.0) {
            cloudy += 1.0;
            path_sum += path_m;
            sums = [sums[0] + base_m, sums[1] + top_m];
            (low_m, high_m) = (low_m.min(base_m), high_m.max(top_m));
        }
        if cloudy == 0.0 {
            let base_m = shape.flat_base_m().unwrap_or(0.0);
            let texels = vec![[0.0; 4]; maps.count()];
            let profile = shape.profile;
            return Ok(Self {
                size: maps.size,
                profile,
                texels,
                base_m,
                depth_m: 0.0,
                mean_m: [base_m; 2],
                density: 1.0,
            });
        }
        let mean_m = sums.map(|sum| sum / cloudy);
        let own_depths = shape.optical_depth.is_some() || sizes.is_some();
        // Where nothing is known a column has no cloud, and the heights to which its neighbours' cloud runs out.
        let unknown = |number: usize| {
            let known: Vec<[f64; 3]> = neighbours(number, maps.size).filter_map(column).collect();
            let mean = |which: usize| {
                let values = known.iter().map(|column| column[which]);
                if known.is_empty() { mean_m[2 - which] } else { values.sum::<f64>() / known.len() as f64 }
            };
            let (top_m, base_m) = (mean(1), mean(2));
            let middle_m = 0.5 * (top_m + base_m);
            // By optical depth it thins out; else it gets flatter.
            if own_depths { [0.0, top_m, base_m] } else { [0.0, middle_m, middle_m] }
        };
        let grows = shape.profile.on_device() as f32;
        let above = |height_m: f64| (height_m.clamp(low_m, high_m) - low_m) as f32;
        let texel = |number: usize| {
            let [path_m, top_m, base_m] = column(number).unwrap_or_else(|| unknown(number));
            let (top, base) = (above(top_m), above(base_m));
            // Without own depths the path is the thickness that single precision leaves.
            [if own_depths { path_m as f32 } else { top - base }, top, base, grows]
        };
        let texels: Vec<[f32; 4]> = (0..maps.count()).map(texel).collect();
        let density = path_sum / (sums[1] - sums[0]);
        let profile = shape.profile;
        Ok(Self { size: maps.size, profile, texels, base_m: low_m, depth_m: high_m - low_m, mean_m, density })
    }

    /// What columns of a layer's extinction are as thick as these are deep, metres.
    pub(crate) fn paths_m(&self) -> impl Iterator<Item = f32> {
        self.texels.iter().map(|texel| texel[0])
    }
}

/// What columns of droplets of other sizes count as.
struct Sizes {
    radii: Radii,
    /// Whether the layer has as many droplets everywhere: larger ones then extinguish more.
    by_number: bool,
}

impl Sizes {
    /// Those of a layer that has a map of effective radius.
    fn new(layer: &Layer, maps: &ShapeMaps<'_>) -> Option<Self> {
        layer.shape.effective_radius.as_ref()?;
        let radii_um = (0..maps.count()).filter_map(|number| maps.column(number, 0.0)?.effective_radius_um);
        let ends_um =
            radii_um.fold([f64::INFINITY, 0.0_f64], |[low, high], radius| [low.min(radius), high.max(radius)]);
        let radii = layer.droplets.mix().radii(&(ends_um[0]..=ends_um[1]))?;
        let by_number = matches!(layer.droplets, Droplets::Gamma { extinction_per_m: None, .. });
        Some(Self { radii, by_number })
    }

    /// The optical depth of the layer's own droplets that a column of droplets of an effective radius (µm) counts as. `depth` is its own where
    /// `is_own`, else that of the layer's droplets in its thickness.
    fn counts_as(&self, depth: f64, radius_um: f64, is_own: bool) -> f64 {
        let denser = if self.by_number && !is_own { self.radii.relative_extinction(radius_um) } else { 1.0 };
        self.radii.counts_as(depth * denser, radius_um)
    }
}

/// Thickness where neither it nor the other edge is given: the droplets' extinction then makes the mean optical depth of the
/// cloudy columns.
fn derived_m(shape: &Shape, maps: &ShapeMaps<'_>, extinction_per_m: f64) -> f64 {
    if shape.thickness.is_some() || (shape.base != Edge::Open && shape.top != Edge::Open) {
        return 0.0;
    }
    let depths = (0..maps.count()).filter_map(|number| maps.column(number, 0.0)?.optical_depth);
    let (count, sum) =
        depths.filter(|depth| *depth > 0.0).fold((0.0, 0.0), |(count, sum), depth| (count + 1.0, sum + depth));
    if count > 0.0 { sum / count / extinction_per_m } else { 0.0 }
}

/// The eight columns around one of a periodic map.
fn neighbours(number: usize, [width, height]: [u32; 2]) -> impl Iterator<Item = usize> {
    let (width, height) = (width as usize, height as usize);
    let (x, y) = (number % width, number / width);
    let around = (0..9).filter(|i| *i != 4);
    around.map(move |i| (y + height + i / 3 - 1) % height * width + (x + width + i % 3 - 1) % width)
}
