//! Rays from the ground towards the sun's disc: how many, and which of them share what they meet of a layer.
//!
//! What is swept over a layer (`shaders/sun_sweep.wgsl`) is met by all rays of one direction. Places on the disc that are so close that their rays part
//! little within the layer, against what the whole disc blurs, are one direction there: they only cross it side by side.

use crate::gpu::layout::{Disc, DiscPlace, DiscWay, MIN_COSINE};
use glam::{DMat2, DVec2, DVec3, dvec2};

/// Places on the sun's disc that are looked at for one texel of its shadow, where its penumbra is seen: so many for each texel that it is wide,
/// so that the beam is within 0.01, root mean square (docs/method.md, section 5). Swept rays are blended, which fills what lies between places: of 1.7, 2.5 and 4
/// a texel the last is no nearer to all of the disc.
const PLACES: [f64; 2] = [8.0, Disc::MOST as f64];
const FOLLOWED_PLACES: f64 = 4.0;
const SWEPT_PLACES: f64 = 1.7;
/// Measured on a software device: what it costs to sweep over a column, to start a ray, and to read a ray from what was swept, in lines of a ray that is
/// followed by itself.
const SWEEP_LINES: f64 = 2.0;
const START_LINES: f64 = 0.6;
pub(crate) const SWEPT_LINES: f64 = 5.0;
/// So many swept rays are beside each other in the width that the disc blurs sideways of its rays, and 1.2 times as many one after the other in that along
/// them: then the beam is within 0.01 of that of rays from all over the disc, root mean square (docs/method.md, section 5).
const SWEEP_FINE: f64 = 4.4;
const START_FINE: f64 = 1.2;
/// Of a low sun, whose disc blurs far along its rays, as many rays start in a texel: the beam is curved between them.
const LEAST_STARTS: f64 = 3.0;
/// The same where the map is so fine that one row a texel is enough.
const LEAST_OF_FINE: f64 = 2.0;
/// Lines at which rows look at columns, for each texel of the map, where so many rays start in it: rays that cross the map aslant meet lines of texels
/// between those that they are named by. With two the preset `snow` errs by 0.0118 at 75 degrees, with three by 0.0067.
const SWEEP_COLUMNS: u32 = 3;
/// Two are enough where the disc blurs most of a texel, so that no more rows are needed than these, and the sun is so high that as many rays start.
const FEW_COLUMNS: u32 = 2;
const FINE_ROWS: u32 = 4;
const FINE_STARTS: u32 = 4;
/// Half the angle of the cone of the beam's 5-degree peak, which ends between 4 and 6 degrees, radians.
const BEAM_CONE: f64 = 0.104_719_755;
/// Metres between rays towards a sun that is a point, over synthetic fields: these are smooth enough at so small a scale, and no blur hides the rest. It is
/// worth it only where it is so many times cheaper.
const POINT_SPACING_M: f64 = 5.0;
const POINT_MARGIN: f64 = 4.0;
/// Denser rays cost more than marched ones.
const MOST_SWEPT_FINE: f64 = 16.0;
/// Rays a side of what is swept at most: their square of floats is what a device must bind at least, 128 MiB (`SWEPT_BYTES` in `shade/ground.rs`).
/// Wider maps, which only images have, are marched.
const MOST_SWEPT_SIDE: f64 = 5700.0;
/// How far rays of one direction part within the layer, of the width that the disc blurs sideways.
const APART: f64 = 0.9;
/// Height about which rays are turned to those of their direction, of the layer's depth: where most cloud is. Of 0.15, 0.3 and 0.5 of presets the latter errs
/// by a fifth more, the others alike.
const TURNED_AT: f64 = 0.2;

/// What rays cross, and from where they are looked for.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Crossed {
    /// Unit vector towards the middle of the sun (east, north, up), and the radius of its disc, radians.
    pub(crate) sun: [f64; 3],
    pub(crate) radius: f64,
    pub(crate) extent_m: f64,
    /// Height of the layer's base, and of its top above that.
    pub(crate) base_m: f64,
    pub(crate) depth_m: f64,
    /// Texels of the layer's map across and down.
    pub(crate) map: [f64; 2],
    /// How often a ray is cut at most.
    pub(crate) max_steps: f64,
    /// Whether the map is a synthetic field's, down to its texels.
    pub(crate) synthetic: bool,
    /// Lines between texels that a ray crosses, and for each texel that it goes over the map.
    pub(crate) lines: f64,
    pub(crate) lines_of_slope: f64,
    /// Texels of the ground a side; `None` where light is wanted at single places.
    pub(crate) ground_side: Option<f64>,
}

/// How dense rays are swept, for each texel of the map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Dense {
    /// Rows of rays, across.
    pub(crate) rows: u32,
    /// Lines at which rows look at columns, along, and rays that start from each line on to the next.
    lines: u32,
    between: u32,
}

impl Dense {
    /// Rays that start, along.
    pub(crate) fn starts(self) -> u32 {
        self.lines * self.between
    }

    /// What is kept of a row over so many texels.
    fn row_numbers(self, texels: usize) -> usize {
        self.starts() as usize * texels + 2
    }

    /// What is kept of the rays of one direction over a map of so many texels on its longer side.
    pub(crate) fn numbers(self, texels: usize) -> usize {
        (self.rows as usize * texels).next_multiple_of(Disc::STRIP as usize) * self.row_numbers(texels)
    }

    /// What it costs to sweep over a texel of the map, in lines of a ray that is followed by itself.
    fn cost(self) -> f64 {
        f64::from(self.rows) * (SWEEP_LINES * f64::from(self.lines) + START_LINES * f64::from(self.starts()))
    }
}

/// Rays towards the sun's disc.
#[derive(Debug, Clone)]
pub(crate) struct SunRays {
    /// How dense they are swept; `None` where each is followed by itself.
    pub(crate) swept: Option<Dense>,
    /// Directions, each with the places that share it.
    directions: Vec<(DVec3, Vec<DiscPlace>)>,
    crossed: Crossed,
}

fn slope(towards: DVec3) -> DVec2 {
    towards.truncate() / towards.z.max(MIN_COSINE.into())
}

/// Direction of a slope.
fn towards(slope: DVec2) -> DVec3 {
    slope.extend(1.0).normalize()
}

/// Places on the disc of a sun: a spiral of equal areas (Vogel 1979), moved so that its middle and its second moments are those of the disc, a quarter of its
/// radius squared along each axis; one is its middle. Those below the horizon give no light.
fn places_on(sun: DVec3, radius: f64, count: u32) -> Vec<DVec3> {
    let flat = dvec2(-sun.y, sun.x);
    let side = if flat.length() < 1e-6 { DVec3::X } else { flat.normalize().extend(0.0) };
    let on_spiral = |i: u32| {
        let part = (f64::from(i) + 0.5) / f64::from(count);
        part.sqrt() * DVec2::from_angle(2.399_963_2 * f64::from(i))
    };
    let mut places: Vec<DVec2> = if count > 1 { (0..count).map(on_spiral).collect() } else { vec![DVec2::ZERO] };
    let (middle, moments) = spread(&places);
    if moments.determinant() > 0.0 {
        let even = of_symmetric(moments, |value| 0.5 / value.sqrt());
        places.iter_mut().for_each(|place| *place = even * (*place - middle));
    }
    places
        .iter()
        .map(|place| (sun + radius * (place.x * side + place.y * sun.cross(side))).normalize())
        .enumerate()
        .filter(|(i, towards)| *i == 0 || towards.z > 0.0)
        .map(|(_, towards)| towards)
        .collect()
}

/// Middle and second moments of places.
fn spread(places: &[DVec2]) -> (DVec2, DMat2) {
    let count = places.len() as f64;
    let middle = places.iter().sum::<DVec2>() / count;
    let moments = |sum: DMat2, place: &DVec2| {
        let off = *place - middle;
        sum + DMat2::from_cols(off * off.x, off * off.y)
    };
    (middle, places.iter().fold(DMat2::ZERO, moments) * (1.0 / count))
}

/// Draws places together about their middle, so that their second moments are less by so much: what blurs beside them then blurs no
/// more in all. A tenth of them is left at least.
fn draw_together(places: &mut [DVec2], less: DMat2) {
    let (middle, moments) = spread(places);
    if moments.determinant() <= 0.0 {
        return;
    }
    let whole = of_symmetric(moments, f64::sqrt);
    let part = of_symmetric(moments, |value| 1.0 / value.sqrt());
    let drawn = whole * of_symmetric(part * less * part, |value| (1.0 - value).max(0.1).sqrt()) * part;
    for place in places {
        *place = middle + drawn * (*place - middle);
    }
}

/// A function of a symmetric matrix.
fn of_symmetric(matrix: DMat2, value: impl Fn(f64) -> f64) -> DMat2 {
    let [a, b, c] = [matrix.x_axis.x, matrix.x_axis.y, matrix.y_axis.y];
    let (mean, apart) = (0.5 * (a + c), (0.25 * (a - c) * (a - c) + b * b).sqrt());
    let [high, low] = [mean + apart, mean - apart].map(|root| value(root.max(0.0)));
    // The same function on both: by its values there, on the line between them.
    match apart > 1e-12 * mean {
        true => {
            DMat2::IDENTITY * (0.5 * (high + low)) + (matrix - DMat2::IDENTITY * mean) * (0.5 * (high - low) / apart)
        }
        false => DMat2::IDENTITY * high,
    }
}

impl Crossed {
    /// Texels on the longer side of the map.
    fn side(&self) -> f64 {
        self.map[0].max(self.map[1])
    }

    /// Rays of a direction, as they go over the map in rows.
    fn way(&self, towards: DVec3, dense: Dense) -> DiscWay {
        let texels = slope(towards) * DVec2::from_array(self.map) / self.extent_m;
        // As a marched ray does: a ray that would be cut too often goes a shorter way.
        let texels = texels / (self.depth_m * (texels.x.abs() + texels.y.abs()) / self.max_steps).max(1.0);
        // The map's rows go south.
        let texels = dvec2(texels.x, -texels.y);
        let flipped = texels.y.abs() > texels.x.abs();
        let [along, across] = if flipped { [texels.y, texels.x] } else { [texels.x, texels.y] };
        let per_metre = along.abs().max(1e-9);
        DiscWay {
            towards: towards.as_vec3().to_array(),
            across: (across / per_metre * f64::from(dense.rows) / f64::from(dense.lines)) as f32,
            per_metre: (per_metre * f64::from(dense.starts())) as f32,
            flipped: flipped.into(),
            backwards: (along < 0.0).into(),
            spare: 0,
        }
    }

    /// How far light of swept rays is blurred by being blended between them: second moments, square metres.
    fn blended(&self, towards: DVec3, dense: Dense) -> DMat2 {
        let texel_m = dvec2(self.extent_m / self.map[0], self.extent_m / self.map[1]);
        let slope = slope(towards);
        let texels = (slope / texel_m).abs();
        let (start, row) = match texels.y > texels.x {
            true => (slope / texels.y, DVec2::X * texel_m.x),
            false => (if texels.x > 1e-9 { slope / texels.x } else { DVec2::X * texel_m.x }, DVec2::Y * texel_m.y),
        };
        let moments = |step: DVec2| DMat2::from_cols(step * step.x, step * step.y) * (1.0 / 6.0);
        moments(start / f64::from(dense.starts())) + moments(row / f64::from(dense.rows))
    }

    /// Width of the penumbra of the layer's top on the ground, metres.
    fn penumbra_m(&self) -> f64 {
        let cosine = self.sun[2].max(0.01);
        2.0 * self.radius * (self.base_m + self.depth_m) / (cosine * cosine)
    }

    /// How far the disc blurs light sideways of its rays.
    fn blur_m(&self) -> f64 {
        self.penumbra_m() * self.sun[2].max(0.01)
    }

    /// Places for a penumbra, so many for each texel that it is wide: one where it is narrower than half a texel of the ground.
    fn places(&self, per_texel: f64) -> u32 {
        let texels = self.penumbra_m() * self.ground_side.unwrap_or(self.side()) / self.extent_m;
        if texels < 0.5 { 1 } else { (per_texel * texels).clamp(PLACES[0], PLACES[1]) as u32 }
    }

    /// How dense rays are swept towards so many places; `None` where that would not be enough.
    fn dense(&self, places: u32) -> Option<Dense> {
        let texel_m = self.extent_m / self.map[0].min(self.map[1]);
        let [rows, starts] = match places {
            // The wider the disc's blur, the less it matters how single rays are blended; along them it is wider than across. Rows run along an axis.
            2.. => {
                let texels = texel_m * SWEEP_FINE / self.blur_m();
                let along = DVec2::from_slice(&self.sun[..2]).normalize_or(DVec2::X).abs().max_element();
                let rows = texels * along;
                let least = if rows > 1.0 { LEAST_STARTS } else { LEAST_OF_FINE };
                [rows, (START_FINE * texels * self.sun[2].max(0.0) / along).max(least)]
            }
            _ if self.synthetic => [texel_m / POINT_SPACING_M; 2],
            _ => return None,
        };
        let most = (MOST_SWEPT_SIDE / self.side()).floor();
        if rows.ceil() > MOST_SWEPT_FINE || most < 1.0 {
            return None;
        }
        let [rows, starts] = [rows, starts].map(|dense| dense.ceil().clamp(1.0, most) as u32);
        let lines = if rows > FINE_ROWS || starts < FINE_STARTS { starts.min(SWEEP_COLUMNS) } else { FEW_COLUMNS };
        let between = starts / lines + u32::from((starts % lines) * 2 >= lines);
        // Rounded up they might take more memory than is promised.
        Some(Dense { rows, lines, between: between.min(most as u32 / lines) })
    }

    /// Groups places whose rays stay side by side within the layer: the number of each one's group.
    fn grouped(&self, slopes: &[DVec2]) -> (Vec<usize>, usize) {
        let scale = self.depth_m / (APART * self.blur_m()).max(1e-6);
        let along = DVec2::from_slice(&self.sun[..2]).normalize_or(DVec2::X);
        let parts = |axis: DVec2| {
            let at = move |slope: &DVec2| slope.dot(axis) * scale;
            let low = slopes.iter().map(at).fold(f64::INFINITY, f64::min);
            let wide = slopes.iter().map(at).fold(f64::NEG_INFINITY, f64::max) - low;
            let count = wide.ceil().clamp(1.0, f64::from(Disc::MOST));
            move |slope: &DVec2| (((at(slope) - low) / wide.max(1e-9) * count) as usize).min(count as usize - 1)
        };
        let (along, across) = (parts(along), parts(along.perp()));
        let cells: Vec<[usize; 2]> = slopes.iter().map(|slope| [along(slope), across(slope)]).collect();
        let mut named: Vec<[usize; 2]> = cells.clone();
        named.sort_unstable();
        named.dedup();
        (cells.iter().map(|cell| named.partition_point(|name| name < cell)).collect(), named.len())
    }

    /// The rays, swept where that is cheaper than to follow one from each texel of the ground towards each place.
    pub(crate) fn rays(&self) -> SunRays {
        let places = self.places(SWEPT_PLACES);
        let cheaper = |dense: &Dense| {
            let texels = self.ground_side.map_or(0.0, |side| side * side);
            let row = self.side() + self.lines / self.lines_of_slope;
            let (_, directions) = self.grouped(&self.slopes(places).1);
            let swept = dense.cost() * self.side() * row * directions as f64 + SWEPT_LINES * f64::from(places) * texels;
            let margin = if places > 1 { 1.0 } else { POINT_MARGIN };
            margin * swept < self.lines * f64::from(self.places(FOLLOWED_PLACES)) * texels
        };
        self.dense(places)
            .filter(cheaper)
            .map_or_else(|| self.followed(), |dense| self.towards_disc(places, Some(dense)))
    }

    /// The rays, each followed by itself.
    fn followed(&self) -> SunRays {
        self.towards_disc(self.places(FOLLOWED_PLACES), None)
    }

    /// Directions towards so many places on the disc, and their slopes.
    fn slopes(&self, places: u32) -> (Vec<DVec3>, Vec<DVec2>) {
        let towards = places_on(DVec3::from_array(self.sun), self.radius, places);
        let slopes = towards.iter().map(|towards| slope(*towards)).collect();
        (towards, slopes)
    }

    fn towards_disc(&self, places: u32, swept: Option<Dense>) -> SunRays {
        let (towards_sun, slopes) = self.slopes(places);
        let (groups, count) = match swept {
            Some(_) => self.grouped(&slopes),
            None => ((0..slopes.len()).collect(), slopes.len()),
        };
        let mut ways = vec![DVec2::ZERO; slopes.len()];
        let middles: Vec<DVec2> = (0..count)
            .map(|group| {
                let members: Vec<DVec2> =
                    (0..slopes.len()).filter(|i| groups[*i] == group).map(|i| slopes[i]).collect();
                members.iter().sum::<DVec2>() / members.len() as f64
            })
            .collect();
        for (i, way) in ways.iter_mut().enumerate() {
            *way = slopes[i] * self.base_m + (slopes[i] - middles[groups[i]]) * TURNED_AT * self.depth_m;
        }
        if let Some(dense) = swept {
            draw_together(&mut ways, self.blended(DVec3::from_array(self.sun), dense));
        }
        let direction = |group: usize| {
            let members: Vec<usize> = (0..slopes.len()).filter(|i| groups[*i] == group).collect();
            let alone = members.len() == 1;
            let middle = middles[group];
            let place = |i: &usize| {
                let way_m = ways[*i];
                // Brought to one tile in f64: at grazing sun it is thousands of tiles.
                let shift_uv = [way_m.x, -way_m.y].map(|way_m| (way_m / self.extent_m).rem_euclid(1.0) as f32);
                DiscPlace { shift_uv, cosine: towards_sun[*i].z.max(MIN_COSINE.into()) as f32, direction: group as u32 }
            };
            let own = if alone { towards_sun[members[0]] } else { towards(middle) };
            (own, members.iter().map(place).collect())
        };
        SunRays { swept, directions: (0..count).map(direction).collect(), crossed: *self }
    }
}

impl SunRays {
    /// Whether part of the beam's 5-degree cone points upwards, about some place on the disc.
    pub(crate) fn are_low(&self) -> bool {
        self.crossed.sun[2] < (BEAM_CONE + self.crossed.radius).sin()
    }

    /// Places on the disc.
    pub(crate) fn count(&self) -> usize {
        self.directions.iter().map(|(_, places)| places.len()).sum()
    }

    /// Bytes of what is swept at once of them, `most` at most but for one direction.
    pub(crate) fn swept_bytes(&self, most: u64) -> u64 {
        let one = self.swept.map_or(0, |dense| 4 * dense.numbers(self.crossed.side() as usize) as u64);
        one * (self.directions.len() as u64).min((most / one.max(1)).max(1))
    }

    /// The same rays, each followed by itself.
    pub(crate) fn followed(&self) -> Self {
        self.crossed.followed()
    }

    /// All of the rays, or those of so many directions at once.
    pub(crate) fn parts(&self, most: usize) -> Vec<Disc> {
        let mut parts = Vec::new();
        let mut first = 0;
        for directions in self.directions.chunks(most.max(1)) {
            let dense = self.swept.unwrap_or(Dense { rows: 0, lines: 1, between: 1 });
            let mut part = Disc {
                fine: dense.rows,
                lines: dense.lines,
                between: dense.between,
                row_numbers: dense.row_numbers(self.crossed.side() as usize) as u32,
                first: first as u32,
                total: self.count() as u32,
                ..Disc::default()
            };
            for (number, (towards, places)) in directions.iter().enumerate() {
                part.ways[number] = self.crossed.way(*towards, dense);
                part.directions += 1;
                for place in places {
                    part.places[part.count as usize] = DiscPlace { direction: number as u32, ..*place };
                    part.count += 1;
                }
            }
            first += part.count as usize;
            parts.push(part);
        }
        parts
    }
}
