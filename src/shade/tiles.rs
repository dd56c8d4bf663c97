//! Which tiles of a picture of the sky may show what: a software device runs through all that a branch would skip, and for any
//! device what is not dispatched is cheapest.

use crate::gpu::layout::SkyView;
use crate::projection::{Sphere, SphereLayout};
use glam::DVec3;
use std::f64::consts::PI;
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
    /// Direction of its middle, and how far from it others may be (chord); `None` where it shows nothing.
    around: Option<(DVec3, f64)>,
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
        let mut directions = Vec::with_capacity((LOOKS * LOOKS) as usize);
        let mut before = [None; LOOKS as usize];
        for y in 0..LOOKS {
            let mut left: Option<f64> = None;
            for x in 0..LOOKS {
                // Over what of the tile is in the picture.
                let at = |axis: usize, step: u32| {
                    let side = TILE.min(size[axis] - corner[axis]);
                    f64::from(corner[axis]) + f64::from(step * side) / f64::from(LOOKS - 1)
                };
                let direction = sphere.direction([at(0, x), at(1, y)], size);
                directions.push(direction.map(DVec3::from_array));
                let up = direction.map(|direction| direction[2]);
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
            tiles.push(Tile { name: column | row << 16, up: low - apart..=high + apart, around: around(&directions) });
        }
    }
    tiles
}

/// The middle of the directions that were looked at, and how far others may be from it.
fn around(directions: &[Option<DVec3>]) -> Option<(DVec3, f64)> {
    let middle = directions[directions.len() / 2]?;
    let reach = directions.iter().flatten().map(|direction| direction.distance(middle)).fold(0.0, f64::max);
    // Between them no farther than from the middle to one beside it.
    Some((middle, (1.0 + 2.0 / f64::from(LOOKS - 1)) * reach))
}

/// Names of the tiles that may show what `shows` tells of a range of sines of elevation.
pub(super) fn names(tiles: &[Tile], shows: impl Fn(&RangeInclusive<f64>) -> bool) -> Vec<u32> {
    tiles.iter().filter(|tile| shows(&tile.up)).map(|tile| tile.name).collect()
}

/// The same in two: those that are plain, and the others.
pub(super) fn parted(
    tiles: &[Tile],
    shows: impl Fn(&RangeInclusive<f64>) -> bool,
    plain: impl Fn(&Tile) -> bool,
) -> [Vec<u32>; 2] {
    let (plain, others): (Vec<_>, Vec<_>) = tiles.iter().filter(|tile| shows(&tile.up)).partition(|tile| plain(tile));
    [plain, others].map(|tiles| tiles.into_iter().map(|tile| tile.name).collect())
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

/// How a layer is looked at.
pub(super) struct Look {
    pub(super) eye_m: f64,
    pub(super) base_m: f64,
    pub(super) top_m: f64,
    pub(super) rising: bool,
    /// Texels of its map, for each metre.
    pub(super) per_metre: f64,
    /// Of them for each ray of a texel.
    pub(super) texels_per_ray: f64,
    /// Radians from the lower edge of a texel to its upper one, at most.
    pub(super) rise: f64,
    /// Towards the sun.
    pub(super) sun: DVec3,
}

/// Chord of the angle from the sun within which single scattering is corrected (30 degrees, `shaders/cloud_tabulated.wgsl`) and six more: clouds are seen in the
/// upright of where they are.
const NEAR_SUN: f64 = 0.618_034;
/// Clouds farther than this stand otherwise than at the eye by more than three degrees, metres.
const FAR_M: f64 = 3e5;
/// Of the texels for a ray, so that what single precision rounds makes no other one of it.
const SURELY: f64 = 0.95;

impl Look {
    /// Whether one ray of each texel of a tile is enough, and all of it is far from the sun: as `sky_texel` in the shaders has it.
    pub(super) fn is_plain(&self, tile: &Tile) -> bool {
        let (low, high) = (*tile.up.start(), *tile.up.end());
        let edge = -dip(self.eye_m, if self.rising { 0.0 } else { self.top_m });
        if low - self.rise <= edge && edge <= high + self.rise {
            return false;
        }
        let flattest = if self.rising { low } else { -high };
        let Some((near_m, cosine)) = self.met(flattest) else { return false };
        let along = near_m * self.per_metre * self.rise / cosine;
        let near_sun = tile.around.is_none_or(|(middle, reach)| middle.distance(self.sun) < NEAR_SUN + reach);
        along <= SURELY * self.texels_per_ray && near_m < FAR_M && !(self.rising && near_sun)
    }

    /// How far away a ray meets the layer that rises, or sinks, with this sine of elevation; and the cosine of its zenith there.
    fn met(&self, sine: f64) -> Option<(f64, f64)> {
        let eye = EARTH_RADIUS_M + self.eye_m;
        let at_m = if self.rising { self.base_m.max(self.eye_m) } else { self.top_m.min(self.eye_m) };
        let along = eye * sine;
        let root = (along * along + (at_m - self.eye_m) * (eye + EARTH_RADIUS_M + at_m)).sqrt();
        // Not a number where it does not come as low.
        (sine > 0.0 && root > 0.0).then(|| ((root - along).abs(), root / (EARTH_RADIUS_M + at_m)))
    }
}

/// Radians from the lower edge of a texel to its upper one, at most: as `sphere_cone` in the shaders has it.
pub(super) fn most_rise(sphere: &Sphere, view: &SkyView) -> f64 {
    let texel = 2.0 / f64::from(view.size[0]);
    match sphere.layout {
        SphereLayout::Equirect => PI / f64::from(view.size[1]),
        SphereLayout::Octahedral => texel * 3.0_f64.powf(0.75),
        SphereLayout::Cube => texel,
        SphereLayout::Fisheye { .. } => 2.0 * PI * f64::from(view.turns) * texel,
        SphereLayout::Camera { .. } => f64::from(view.half_width) * texel,
    }
}

/// Whether all that lies behind the clouds of a tile is the ground.
pub(super) fn shows_ground(tile: &Tile, eye_m: f64, rise: f64) -> bool {
    *tile.up.end() + rise < -dip(eye_m, 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::axes::Axes;
    use crate::reference::sphere::{
        cosine_at, misses_ground, rising_distance, sinking_distance, sphere_cone, sphere_direction,
    };
    use glam::dvec2;

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

    /// As the shaders' twin counts rays and knows the ground. Of the sun 30 degrees are near.
    #[test]
    fn texels_of_plain_tiles_have_one_ray_far_from_the_sun_or_the_ground() {
        let sun = DVec3::new(0.3, -0.5, 0.4).normalize();
        for (layout, across) in LAYOUTS.into_iter().flat_map(|layout| [130, 400].map(|size| (layout, size))) {
            let mut plain = 0;
            for eye_m in [2.0, 1200.0, 20_000.0] {
                let sphere = Sphere { layout, axes: Axes::Enu, eye: [0.0, 0.0, eye_m] };
                let size = crate::projection::Projection::Sphere(sphere).size(across);
                let view = crate::frame::sky_view(&sphere, crate::plan::FINEST_SKY, size, 0.0);
                let listed = tiles(&sphere, size, 0, size[1]);
                let rise = most_rise(&sphere, &view);
                let texels = |tile: &Tile| {
                    let corner = [tile.name & 0xffff, tile.name >> 16].map(|at| at * TILE);
                    let texels = (0..TILE * TILE).map(move |i| [corner[0] + i % TILE, corner[1] + i / TILE]);
                    let seen = texels.filter(|[x, y]| *x < size[0] && *y < size[1]);
                    seen.filter_map(|at| sphere_direction(&view, dvec2(at[0].into(), at[1].into()) + 0.5))
                        .collect::<Vec<_>>()
                };
                for tile in listed.iter().filter(|tile| shows_ground(tile, eye_m, rise)) {
                    for direction in texels(tile) {
                        let up = direction.z + sphere_cone(&view, direction).rise;
                        assert!(!misses_ground(eye_m, up), "{layout:?} of {size:?} from {eye_m}: {direction}");
                    }
                }
                for (base_m, top_m, rising) in
                    [(1000.0, 1500.0, false), (1000.0, 1500.0, true), (9000.0, 12_000.0, true)]
                {
                    let look = Look { eye_m, base_m, top_m, rising, per_metre: 0.0256, texels_per_ray: 4.0, rise, sun };
                    let edge = -dip(eye_m, if rising { 0.0 } else { top_m });
                    for tile in listed.iter().filter(|tile| look.is_plain(tile)) {
                        plain += 1;
                        for direction in texels(tile).into_iter().filter(|at| shows(at.z, eye_m, base_m, top_m, rising))
                        {
                            let what = format!(
                                "{layout:?} of {size:?}, {base_m} to {top_m}, {rising}, from {eye_m}: {direction}"
                            );
                            let cone = sphere_cone(&view, direction);
                            assert!((direction.z - edge).abs() >= cone.rise, "{what}");
                            let (at_m, distance): (_, fn(f64, f64, f64) -> f64) = if rising {
                                (base_m.max(eye_m), rising_distance)
                            } else {
                                (top_m.min(eye_m), sinking_distance)
                            };
                            let near_m = distance(eye_m, direction.z, at_m);
                            let cosine = cosine_at(eye_m, direction.z, near_m, at_m).abs();
                            assert!(near_m * look.per_metre * cone.rise / cosine <= look.texels_per_ray, "{what}");
                            assert!(!rising || direction.angle_between(sun).to_degrees() > 30.0, "{what}");
                        }
                    }
                }
            }
            assert!(plain > 0 || across < 400, "{layout:?}");
        }
    }
}
