//! Sunlight along a view ray through a layer by its lattice, relative to that of a slab. Twin of `shaders/shared/cloud_lattice.wgsl`.

use super::cloud::{Looked, Sunlight, ViewRay};
use super::columns::{column_piece, is_ragged};
use super::cumulus::dressed_at;
use super::frame::{vec2, vec3};
use super::map::Map;
use super::path_sampled::path_lines;
use crate::cumulus::dressed;
use crate::gpu::layout::{Frame, LatticeLight};
use crate::light::LatticeMaps;
use glam::{DVec2, DVec3, DVec4, dvec2, dvec3};
use half::f16;

/// Parts of a ray that are looked at, at most, but for gaps.
pub const SAMPLES: u32 = 4;
/// And where few are enough: see [`ViewRay::few`].
pub const FEW: u32 = 2;
/// So much of its share, times what is scattered of all light, the last part ends before all is.
pub const LAST: f64 = 0.25;
/// A ray's way between clouds beyond which they are looked at by themselves, cubes.
pub const GAP: f64 = 0.5;
/// Steps of a plane's ray at most.
pub const RAY_MOST_STEPS: f64 = 256.0;
/// Level of the map from which on few places along a ray are enough.
pub const FAR_LEVEL: f64 = 0.5;
/// Cosine of a parallel view's zenith from which on they are.
pub const STEEP_COSINE: f64 = 0.7;
/// No mean radiance: the least of a half float.
pub const DARK: f64 = 6e-8;
/// What a slab's light is multiplied with, at most.
pub const MOST: f64 = 16.0;

/// What the shader reads of a layer's lattice.
#[derive(Debug, Clone, Copy)]
pub struct LatticeSeen<'a> {
    /// How it is read.
    pub light: &'a LatticeLight,
    /// Cubes; as [`LatticeMaps::within`].
    pub size: [usize; 3],
    /// See `size`.
    pub within: &'a [[f16; 4]],
    /// Lines and heights; depths towards the sun.
    pub lines: [usize; 3],
    /// See `lines`.
    pub depths: &'a [f16],
    /// See [`LatticeMaps::slabs`].
    pub slabs: &'a [[f16; 4]],
    /// Columns and rows of those.
    pub slabs_size: [usize; 2],
    /// [`crate::cumulus::dressed::tables`].
    pub dressed: [&'a [f64]; 3],
}

impl<'a> LatticeSeen<'a> {
    /// That of a lattice.
    pub fn new(maps: &'a LatticeMaps, dressed: [&'a [f64]; 3]) -> Self {
        let (light, size, within) = (&maps.light, maps.size, maps.within.as_slice());
        let (lines, depths) = (maps.depths.size, maps.depths.depths.as_slice());
        Self { light, size, within, lines, depths, slabs: &maps.slabs, slabs_size: maps.slabs_size, dressed }
    }
}

/// A place along a ray: height above the base plane, optical depth before it, and depth that it stands for.
struct Sample {
    height_m: f64,
    before: f64,
    depth: f64,
}

/// Eight texels around a place and what each counts; x and y repeat.
fn around([nx, ny, nz]: [usize; 3], uv: DVec2, height: f64) -> [(usize, f64); 8] {
    let wrap = |part: f64, n: usize| {
        let place = part * n as f64 - 0.5;
        (place.floor() as i64, place - place.floor())
    };
    let (x, y) = (wrap(uv.x, nx), wrap(uv.y, ny));
    let place = (height - 0.5).clamp(0.0, (nz - 1) as f64);
    let low = (place as usize).min(nz.saturating_sub(2));
    let up = place - low as f64;
    std::array::from_fn(|corner| {
        let [i, j, k] = [corner & 1, corner >> 1 & 1, corner >> 2];
        let side = |part: f64, at: usize| if at == 1 { part } else { 1.0 - part };
        let at = |(low, _): (i64, f64), i: usize, n: usize| (low + i as i64).rem_euclid(n as i64) as usize;
        let z = (low + k).min(nz - 1);
        (at(x, i, nx) + nx * (at(y, j, ny) + ny * z), side(x.1, i) * side(y.1, j) * side(up, k))
    })
}

/// A straight way over the map, for a ray that climbs through the layer.
struct Way<'a> {
    levels: &'a [Map],
    looked: Option<Looked>,
    start_uv: DVec2,
    way_uv: DVec2,
    from_m: f64,
    rise_m: f64,
    /// Parts of the way from the viewer on: where steps begin, and the end.
    parts: Vec<f64>,
}

impl<'a> Way<'a> {
    fn new(frame: &Frame, levels: &'a [Map], ray: &ViewRay) -> Self {
        let (from_m, rise_m) = (ray.from_m, ray.rise_m);
        let straight = ray.way_uv;
        let start_uv = ray.base_uv + vec2(frame.place.offset_uv);
        let (way_uv, mut parts) = if let Some(Looked { level, steps, .. }) = ray.looked {
            (straight, path_lines(&levels[0], level, start_uv, straight, steps).collect::<Vec<_>>())
        } else {
            let crossed = straight.length() * levels[0].width.max(levels[0].height) as f64;
            let count = crossed.ceil().clamp(1.0, RAY_MOST_STEPS);
            // Of a plane's rays a shorter way stands for the whole way close to the horizon.
            let way_uv = straight / (crossed / RAY_MOST_STEPS).max(1.0);
            (way_uv, (1..=count as u32).map(|step| f64::from(step) / count).collect())
        };
        parts.insert(0, 0.0);
        if ray.from_above {
            parts.reverse();
        }
        Self { levels, looked: ray.looked, start_uv, way_uv, from_m, rise_m, parts }
    }

    fn uv(&self, part: f64) -> DVec2 {
        self.start_uv + self.way_uv * part
    }

    fn uv_at(&self, height_m: f64) -> DVec2 {
        self.uv((height_m - self.from_m) / self.rise_m)
    }

    fn height_m(&self, part: f64) -> f64 {
        self.from_m + part * self.rise_m
    }

    fn map(&self, part: f64) -> [f64; 4] {
        let uv = self.uv(part).to_array();
        match self.looked {
            Some(Looked { level, .. }) => Map::sample_level(self.levels, uv, level),
            None => self.levels[0].sample_periodic(uv),
        }
    }
}

/// What a part of a ray has of cloud: its depth, and its heights weighted with that.
#[derive(Clone, Copy, Default)]
struct Part {
    depth: f64,
    heights_m: f64,
}

impl Part {
    fn add(&mut self, depth: f64, height_m: f64) {
        self.depth += depth;
        self.heights_m += depth * height_m;
    }
}

/// Middles of the parts of a ray, from the viewer on: it is cut where it has scattered even shares of its light, and these where it comes from one cloud
/// to the next.
fn samples(frame: &Frame, light: &LatticeLight, ray: &ViewRay, way: &Way<'_>) -> Vec<Sample> {
    let kept: f64 = light.kept[1].into();
    let extinction = f64::from(frame.medium.extinction_550);
    let whole = -(-kept * extinction * ray.path_m).exp_m1();
    let count = if ray.few { FEW } else { SAMPLES };
    let until = |i: u32| {
        let share = f64::from(i) / f64::from(count);
        -(-whole * share.min(1.0 - LAST * whole / f64::from(count))).ln_1p() / kept
    };
    let ends: Vec<[f64; 2]> = (0..count).map(|i| [until(i), until(i + 1)]).collect();
    // Up to the first gap in each, and beyond it.
    let mut parts = vec![[Part::default(); 2]; ends.len()];
    let mut beyond = vec![0; ends.len()];
    let (mut near, mut before, mut last_m) = (way.map(way.parts[0]), 0.0, 0.0);
    for step in way.parts.windows(2) {
        let &[from, to] = step else { continue };
        let far = way.map(to);
        let (low, high) = if ray.from_above { (far, near) } else { (near, far) };
        near = far;
        let heights_m = [from.min(to), from.max(to)].map(|part| way.height_m(part));
        let inside = if is_ragged(frame) {
            column_piece(low, high, heights_m).map(|piece| (piece.ends, piece.density))
        } else {
            inside(low[0] - heights_m[0], high[0] - heights_m[1]).map(|ends| (ends, 1.0))
        };
        let Some((piece, density)) = inside else { continue };
        let [low_m, high_m] = piece.map(|end| heights_m[0] + end * (heights_m[1] - heights_m[0]));
        let [first_m, second_m] = if ray.from_above { [high_m, low_m] } else { [low_m, high_m] };
        let more = extinction / ray.cosine * density * (high_m - low_m);
        let gap = (first_m - last_m).abs() > GAP * f64::from(light.cell_m) * ray.cosine;
        for ((part, beyond), [since, until]) in parts.iter_mut().zip(&mut beyond).zip(&ends) {
            if gap && *since < before && before < *until {
                *beyond = 1;
            }
            let [first, last] = [since, until].map(|depth| ((depth - before) / more.max(1e-12)).clamp(0.0, 1.0));
            part[*beyond].add(more * (last - first), first_m + 0.5 * (first + last) * (second_m - first_m));
        }
        before += more;
        last_m = second_m;
    }
    let middles = parts.iter().zip(&ends).flat_map(|(part, [since, until])| {
        let all = (part[0].depth + part[1].depth).max(1e-12);
        let beyond = part[1].depth / all;
        [(part[0], 1.0 - beyond), (part[1], beyond)].into_iter().enumerate().filter_map(move |(i, (part, share))| {
            // By rounding the ray may end before its last part.
            let height_m = if part.depth > 1e-12 { part.heights_m / part.depth } else { last_m };
            let half = 0.5 * share * (until - since);
            let before = if i == 0 { since + half } else { until - half };
            let depth = share * whole / (f64::from(count) * kept * (-kept * before).exp());
            (i == 0 || share > 0.0).then_some(Sample { height_m, before, depth })
        })
    });
    middles.collect()
}

/// Where from 0 to 1 what goes evenly from one value to another is above 0.
fn inside(first: f64, last: f64) -> Option<[f64; 2]> {
    match (first > 0.0, last > 0.0) {
        (true, true) => Some([0.0, 1.0]),
        (false, false) => None,
        (true, false) => Some([0.0, first / (first - last)]),
        (false, true) => Some([first / (first - last), 1.0]),
    }
}

/// The sun's light of a layer by its lattice, per irradiance facing the sun: `of_slab` is that of a slab. `levels`: the layer's map.
pub fn sunlight<'a>(
    frame: &'a Frame,
    seen: LatticeSeen<'a>,
    levels: &'a [Map],
    of_slab: impl Fn(&ViewRay) -> DVec3 + Sync + 'a,
) -> Sunlight<'a> {
    Box::new(
        move |ray| if ray.path_m > 0.0 { relative(frame, &seen, levels, ray) * of_slab(ray) } else { of_slab(ray) },
    )
}

/// How much the light of cubes counts, and not its means over them: from below less from where a texel is as wide as a cube, none where it is as
/// wide as four.
fn sees_cubes(frame: &Frame, cell_m: f64, map: &Map, ray: &ViewRay) -> f64 {
    let Some(Looked { level, .. }) = ray.looked.filter(|_| !ray.from_above) else { return 1.0 };
    let cube = (cell_m * map.width.max(map.height) as f64 / f64::from(frame.place.extent_m)).log2().max(0.0);
    (1.0 - 0.5 * (level - cube)).clamp(0.0, 1.0)
}

/// What of a slab's sunlight reaches a ray: by cubes, and by `share` where they are too small to be seen.
pub fn reaches(frame: &Frame, seen: &LatticeSeen<'_>, levels: &[Map], ray: &ViewRay, share: DVec3) -> DVec3 {
    let cubes = sees_cubes(frame, seen.light.cell_m.into(), &levels[0], ray);
    if cubes <= 0.0 {
        return share;
    }
    let lit = if ray.from_above { DVec3::ONE } else { vec3(seen.light.in_air) };
    if ray.path_m > 0.0 { share.lerp(lit * relative(frame, seen, levels, ray), cubes) } else { lit }
}

/// Light of the sun along a ray over that of a slab as deep as the ray.
fn relative(frame: &Frame, seen: &LatticeSeen<'_>, levels: &[Map], ray: &ViewRay) -> DVec3 {
    let way = Way::new(frame, levels, ray);
    let (light, sun) = (seen.light, vec3(frame.sun.towards));
    let extinction = f64::from(frame.medium.extinction_550);
    let ratio = vec3(frame.medium.extinction) / extinction;
    let slant = f64::from(frame.sun.slant_cosine);
    let towards = -ray.seen;
    let angle = 2.0 * (towards - sun).length().atan2((towards + sun).length());
    let sun_way = dvec2(sun.x, -sun.y) / (slant * f64::from(frame.place.extent_m));
    let (kept, albedo, asymmetry) = (vec3(light.kept), vec3(light.albedo), vec3(light.asymmetry));
    let (density, cell_m) = (f64::from(light.density), f64::from(light.cell_m));
    let all_m = ray.path_m * ray.cosine;
    let rows = seen.slabs_size[1] / 2;
    let node = (all_m * extinction / f64::from(light.reach)).min(1.0).sqrt() * (rows - 1) as f64;
    let once = |path: f64| {
        let of = |c: usize| dressed_at(seen.dressed[c], angle, dressed::stretched(path));
        dvec3(of(0), of(1), of(2))
    };
    // Of a mean of each colour, and of the moment against the view.
    let more = |mean: DVec3, moment: f64| (mean * (1.0 - asymmetry * (moment / mean.y.max(DARK)))).max(DVec3::ZERO);
    let level = sun.truncate().length();
    let facing = if level > 1e-6 { towards.truncate().dot(sun.truncate()) / level } else { 0.0 };
    let count = seen.size[0] * seen.size[1] * seen.size[2];
    let (mut found, mut slab) = (DVec3::ZERO, DVec3::ZERO);
    for Sample { height_m, before, depth } in samples(frame, light, ray, &way) {
        let uv = way.uv_at(height_m);
        let share = depth * albedo * kept * ratio * (-kept * ratio * before).exp();
        let cubes = around(seen.size, uv, height_m / cell_m + 1.0);
        let around_it = |first: usize| {
            let of =
                |(cube, weight): (usize, f64)| weight * DVec4::from_array(seen.within[first + cube].map(f16::to_f64));
            cubes.into_iter().map(of).sum::<DVec4>().to_array()
        };
        let ([green, x, y, z], [red, blue, ..]) = (around_it(0), around_it(count));
        let scattered = more(dvec3(red, green, blue), dvec3(x, -y, z).dot(towards));
        let lines = around(seen.lines, uv - sun_way * height_m, height_m / f64::from(light.sun_step_m) + 0.5);
        let sun_depth = lines.into_iter().map(|(i, weight)| weight * seen.depths[i].to_f64()).sum::<f64>().max(0.0);
        found += once(before + sun_depth) * depth + share * scattered;
        // The same place of the slab.
        let passed_m = before * ray.cosine / extinction;
        let left_m = (all_m - passed_m).max(0.0);
        let (slab_m, above_m) = if ray.from_above { (left_m, passed_m) } else { (passed_m, left_m) };
        let [[green, along, _, z], [red, blue, ..]] =
            [0, rows].map(|first| slab_at(seen, slab_m / density / cell_m + 1.0, first, node));
        let scattered = more(dvec3(red, green, blue), along * facing + z * towards.z);
        slab += once(before + extinction * above_m / slant) * depth + share * scattered;
    }
    let of = |c: usize| if slab[c] > 1e-12 { (found[c] / slab[c]).min(MOST) } else { 1.0 };
    dvec3(of(0), of(1), of(2))
}

/// Light in a slab: at a height, of what begins at a row, by the node of its depth.
fn slab_at(seen: &LatticeSeen<'_>, height: f64, first: usize, node: f64) -> [f64; 4] {
    let [columns, _] = seen.slabs_size;
    let rows = seen.slabs_size[1] / 2;
    let place = (height - 0.5).clamp(0.0, (columns - 1) as f64);
    let (x, y) = ((place as usize).min(columns.saturating_sub(2)), (node as usize).min(rows - 2));
    let (right, down) = (place - x as f64, node - y as f64);
    let at =
        |x: usize, y: usize| DVec4::from_array(seen.slabs[x.min(columns - 1) + columns * (first + y)].map(f16::to_f64));
    at(x, y).lerp(at(x + 1, y), right).lerp(at(x, y + 1).lerp(at(x + 1, y + 1), right), down).to_array()
}
