//! How fine the maps of sunlight and the grid of the exchange are.

use crate::exchange::TOUCHING_TEXELS;
use crate::plan::Plan;

/// Texels a side of the maps of sunlight and of the exchange grid, at least where anything varies, and at most.
const LEAST_TEXELS: u32 = 16;
const MOST_SUN_TEXELS: u32 = 1024;
const MOST_EXCHANGE_TEXELS: u32 = 256;
/// Where in a texel thickness is looked at, from its middle, before [`sample_at`]: with the opposite place, two knights of
/// chess on a board of 4 x 4, a pattern without gaps along either axis.
const SAMPLE_AT: [f64; 2] = [0.375, 0.125];
/// Between where light enters a cloud and where it leaves: standard deviation on each axis, transport lengths (measured
/// against Monte Carlo in three dimensions).
const SPREAD: f64 = 0.7;

/// The grids of a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Grids {
    /// Texels a side of the maps of sunlight; powers of two.
    pub(crate) sun_texels: u32,
    /// Where in one of them thickness is looked at, from its middle, texels; and opposite.
    pub(crate) sample_at: [f64; 2],
    /// Texels a side of the exchange grid: not finer than the maps of sunlight, unless these have one texel.
    pub(crate) exchange_texels: u32,
}

/// A layer, as far as grids go.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LayerShape {
    /// 1 / (extinction (1 - asymmetry)).
    pub(crate) transport_length_m: f64,
    /// Greatest thickness.
    pub(crate) depth_m: f64,
}

impl LayerShape {
    /// Spread of light between where it enters and where it leaves, metres: in thin cloud no more than its thickness.
    pub(crate) fn spread_m(&self) -> f64 {
        SPREAD * self.transport_length_m.min(self.depth_m)
    }
}

/// What grids are planned from.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SceneShape<'a> {
    pub(crate) extent_m: f64,
    /// Height of the lowest base.
    pub(crate) base_m: f64,
    pub(crate) layers: &'a [LayerShape],
    /// Texels a side of the finest thickness map; 1 where all layers are the same everywhere.
    pub(crate) thickness_texels: u32,
    /// Texels a side of the ground's albedo; 1 for one colour.
    pub(crate) albedo_texels: u32,
}

/// Plans the grids: one texel where nothing varies.
pub(crate) fn grids(scene: &SceneShape<'_>, plan: &Plan) -> Grids {
    let detail = scene.thickness_texels.max(scene.albedo_texels);
    if detail == 1 {
        return Grids { sun_texels: 1, sample_at: SAMPLE_AT, exchange_texels: 1 };
    }
    // Light between the planes is smooth over the height of the base.
    let per_extent =
        |texels: f64, length_m: f64, most: u32| (texels * scene.extent_m / length_m.max(1e-3)).min(most.into()) as u32;
    // Planes that touch need no transforms, which are dear on fine grids.
    let finest = detail.clamp(LEAST_TEXELS, MOST_SUN_TEXELS).next_power_of_two();
    let touching = scene.base_m / scene.extent_m * f64::from(finest) < TOUCHING_TEXELS;
    let most = if touching { MOST_SUN_TEXELS } else { MOST_EXCHANGE_TEXELS };
    let needed = per_extent(plan.texels_per_height, scene.base_m, most);
    let exchange_texels = needed.min(detail).clamp(LEAST_TEXELS, most).next_power_of_two();
    if scene.thickness_texels == 1 {
        return Grids { sun_texels: 1, sample_at: SAMPLE_AT, exchange_texels };
    }
    let finest_m = scene.layers.iter().map(|layer| layer.transport_length_m).fold(f64::MAX, f64::min);
    let needed = per_extent(plan.texels_per_length, finest_m, MOST_SUN_TEXELS);
    let fine = needed.min(scene.thickness_texels).clamp(LEAST_TEXELS, MOST_SUN_TEXELS).next_power_of_two();
    let sun_texels = fine.max(exchange_texels);
    let sample_at = sample_at(f64::from(scene.thickness_texels) / f64::from(sun_texels));
    Grids { sun_texels, sample_at, exchange_texels }
}

/// Where thickness is looked at in a texel that is so many of the thickness map's wide. At those texels' centres a bilinear
/// map is roughest, half-way between them smoothest; a quarter from a centre it is as rough as on the mean. Two samples there
/// are worth more than four elsewhere, which make light through broken cloud wrong by several per cent.
fn sample_at(texels: f64) -> [f64; 2] {
    let texels = texels.max(1.0);
    SAMPLE_AT.map(|at| {
        let place = (0.5 + at) * texels;
        0.5 * ((2.0 * place).floor() + 0.5) / texels - 0.5
    })
}

impl Grids {
    /// Mip level of the maps of sunlight that is the exchange grid.
    pub(crate) fn level(&self) -> usize {
        (self.sun_texels / self.exchange_texels).max(1).ilog2() as usize
    }
}

/// From a point on one plane to where its sun ray crosses another one `height_m` above it, as an offset on the map.
pub(crate) fn shift_uv(sun: [f64; 3], height_m: f64, extent_m: f64) -> [f64; 2] {
    let cosine = sun[2].max(f64::from(crate::gpu::layout::MIN_COSINE));
    let tiles = height_m / (cosine * extent_m);
    // Brought to one tile in f64: at grazing sun the offset is thousands of tiles.
    [(tiles * sun[0]).rem_euclid(1.0), (-tiles * sun[1]).rem_euclid(1.0)]
}

#[cfg(test)]
mod tests {
    use super::sample_at;

    #[test]
    fn samples_lie_a_quarter_of_a_texel_from_a_centre() {
        for texels in [1.0, 2.0, 3.0, 4.0, 8.0] {
            let [x, y] = sample_at(texels);
            for place in [0.5 + x, 0.5 + y] {
                assert!((0.5..1.0).contains(&place), "{place} at {texels}");
                let from_centre = ((place * texels).fract() - 0.5).abs();
                // Rounding.
                assert!((from_centre - 0.25).abs() < 1e-12, "{place} at {texels}");
            }
        }
    }
}
