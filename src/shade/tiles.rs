//! Which tiles of a picture of the sky may show what: a software device runs through all that a branch would skip, and for any
//! device what is not dispatched is cheapest.

use crate::projection::Sphere;
use std::ops::RangeInclusive;

/// Texels a side of a tile: one workgroup.
pub(super) const TILE: u32 = 16;
/// Places of a tile that are looked at, a side.
const LOOKS: u32 = 5;
/// Radius of the Earth, metres, as the shaders have it.
pub(super) const EARTH_RADIUS_M: f64 = 6_371_000.0;

/// A tile, and between which sines of elevation its texels lie.
pub(super) struct Tile {
    /// Column, and from 16 bits on row, of the band.
    name: u32,
    up: RangeInclusive<f64>,
}

/// The tiles of a band of rows of a picture of `size` texels, but those that show nothing.
pub(super) fn tiles(sphere: &Sphere, size: [u32; 2], first_row: u32, rows: u32) -> Vec<Tile> {
    let mut tiles = Vec::new();
    // Column by column: near the horizon texels cost the most, and devices that hand out workgroups in a few even parts, as software
    // does, then have as much of it in each.
    for (row, column) in
        (0..size[0].div_ceil(TILE)).flat_map(|column| (0..rows.div_ceil(TILE)).map(move |r| (r, column)))
    {
        let corner = [column * TILE, first_row + row * TILE];
        let (mut low, mut high, mut apart, mut seen) = (1.0_f64, -1.0_f64, 0.0_f64, false);
        let mut before = [None; LOOKS as usize];
        for y in 0..LOOKS {
            let mut left: Option<f64> = None;
            for x in 0..LOOKS {
                // Over what of the tile is in the picture.
                let at = |axis: usize, step: u32| {
                    let side = TILE.min(size[axis] - corner[axis]);
                    f64::from(corner[axis]) + f64::from(step * side) / f64::from(LOOKS - 1)
                };
                let up = sphere.direction([at(0, x), at(1, y)], size).map(|direction| direction[2]);
                if let Some(up) = up {
                    (low, high, seen) = (low.min(up), high.max(up), true);
                    for near in [left, before[x as usize]].into_iter().flatten() {
                        apart = apart.max((up - near).abs());
                    }
                }
                (left, before[x as usize]) = (up, up);
            }
        }
        if seen {
            // Between the places that were looked at it may go a little further: by a half of what lies between two would be
            // much for a smooth picture.
            tiles.push(Tile { name: column | row << 16, up: low - apart..=high + apart });
        }
    }
    tiles
}

/// Names of the tiles that may show what `shows` tells of a range of sines of elevation.
pub(super) fn names(tiles: &[Tile], shows: impl Fn(&RangeInclusive<f64>) -> bool) -> Vec<u32> {
    tiles.iter().filter(|tile| shows(&tile.up)).map(|tile| tile.name).collect()
}

/// Sine of how far below the horizontal a level lies that is seen to end `height_m` above the ground, from `eye_m`: rays that
/// sink more than this come lower than that.
pub(crate) fn dip(eye_m: f64, height_m: f64) -> f64 {
    let (eye, level) = (EARTH_RADIUS_M + eye_m, EARTH_RADIUS_M + height_m);
    if height_m >= eye_m { 0.0 } else { ((eye_m - height_m) * (eye + level)).sqrt() / eye }
}

/// Whether rays between two sines of elevation sink into a layer, or rise through it.
pub(super) fn meets(up: &RangeInclusive<f64>, eye_m: f64, base_m: f64, top_m: f64, rising: bool) -> bool {
    // Below this they come under the top.
    let under_top = -dip(eye_m, top_m);
    if !rising {
        return base_m < eye_m && *up.start() <= under_top;
    }
    let straight = *up.end() >= 0.0 && eye_m < top_m;
    let horizon = -dip(eye_m, 0.0);
    // Rays that sank below the top and missed the ground.
    straight || (*up.start() <= under_top && *up.end() >= horizon)
}

/// Whether rays between two sines of elevation meet the ground.
pub(super) fn meets_ground(up: &RangeInclusive<f64>, eye_m: f64) -> bool {
    *up.start() <= -dip(eye_m, 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::axes::Axes;
    use crate::projection::SphereLayout;

    const LAYOUTS: [SphereLayout; 7] = [
        SphereLayout::Equirect,
        SphereLayout::Octahedral,
        SphereLayout::Cube,
        SphereLayout::Fisheye { fov_deg: 180.0 },
        SphereLayout::Fisheye { fov_deg: 360.0 },
        SphereLayout::Camera { look_deg: [200.0, -2.0], fov_deg: 30.0, aspect: 1.7 },
        SphereLayout::Camera { look_deg: [20.0, 60.0], fov_deg: 170.0, aspect: 1.0 },
    ];
    /// Places of a tile that are looked at, a side.
    const DENSE: u32 = 49;

    /// Height of the lowest point of a ray.
    fn lowest_m(eye_m: f64, up: f64) -> f64 {
        if up >= 0.0 { eye_m } else { (EARTH_RADIUS_M + eye_m) * (1.0 - up * up).sqrt() - EARTH_RADIUS_M }
    }

    fn shows(up: f64, eye_m: f64, base_m: f64, top_m: f64, rising: bool) -> bool {
        let lowest = lowest_m(eye_m, up);
        let low_m = base_m.max(lowest);
        if rising { low_m < top_m && (up >= 0.0 || lowest > 0.0) } else { up < 0.0 && eye_m.min(top_m) > low_m }
    }

    #[test]
    fn no_tile_is_left_out_that_shows_something() {
        for (layout, across) in LAYOUTS.into_iter().flat_map(|layout| [4, 8, 20, 50, 130].map(|size| (layout, size))) {
            let size =
                crate::projection::Projection::Sphere(Sphere { layout, axes: Axes::Enu, eye: [0.0; 3] }).size(across);
            let sphere = Sphere { layout, axes: Axes::Enu, eye: [0.0; 3] };
            let mut dense: Vec<Vec<f64>> = Vec::new();
            let listed = tiles(&sphere, size, 0, size[1]);
            for (row, column) in
                (0..size[1].div_ceil(TILE)).flat_map(|row| (0..size[0].div_ceil(TILE)).map(move |c| (row, c)))
            {
                let at = |corner: u32, step: u32, end: u32| {
                    let place = f64::from(corner * TILE) + f64::from(step * TILE) / f64::from(DENSE - 1);
                    place.min(f64::from(end) - 1e-9)
                };
                let places = (0..DENSE * DENSE).map(|i| [at(column, i % DENSE, size[0]), at(row, i / DENSE, size[1])]);
                let ups: Vec<f64> = places.filter_map(|place| Some(sphere.direction(place, size)?[2])).collect();
                let name = column | row << 16;
                assert!(ups.is_empty() || listed.iter().any(|tile| tile.name == name), "{layout:?}: {column}, {row}");
                dense.push(ups);
            }
            let name = |i: usize| {
                let columns = size[0].div_ceil(TILE);
                (i as u32 % columns) | (i as u32 / columns) << 16
            };
            for eye_m in [0.0, 2.0, 999.0, 1000.0, 1100.0, 1500.0, 1501.0, 20_000.0, 100_000.0] {
                let ground = names(&listed, |up| meets_ground(up, eye_m));
                for (i, ups) in dense.iter().enumerate() {
                    let hit = ups.iter().any(|up| lowest_m(eye_m, *up) <= 0.0 && *up < 0.0);
                    assert!(
                        !hit || ground.contains(&name(i)),
                        "{layout:?} of {size:?}, eye at {eye_m}: ground, tile {i}"
                    );
                }
                for (base_m, top_m) in [(0.0, 300.0), (1000.0, 1500.0), (9000.0, 12_000.0)] {
                    for rising in [false, true] {
                        let shown = names(&listed, |up| meets(up, eye_m, base_m, top_m, rising));
                        for (i, ups) in dense.iter().enumerate() {
                            let seen = ups.iter().any(|up| shows(*up, eye_m, base_m, top_m, rising));
                            let what = format!("{layout:?} of {size:?}, eye at {eye_m}, {base_m} to {top_m}, {rising}");
                            assert!(!seen || shown.contains(&name(i)), "{what}: tile {i}");
                        }
                    }
                }
            }
        }
    }
}
