//! The shape of one cloud: spheres upon spheres upon a few that rise one after the other over a flat base.

use super::body::Sphere;
use super::hash::{follow, uniform};
use crate::scene::Cumulus;
use glam::{DVec2, DVec3, dvec3};
use std::f64::consts::TAU;

/// Fewest of the spheres that the others sit on, and how many more there may be.
const ROOTS: [u32; 2] = [5, 3];
/// Radius of the first root, and of the others, widths of the cloud.
const FIRST: f64 = 0.27;
const OTHERS: [f64; 2] = [0.13, 0.22];
/// How far roots lie from the middle, widths.
const SPREAD: f64 = 0.34;
/// How much longer than wide a cloud is.
const ASPECT: [f64; 2] = [0.75, 1.25];
/// How high a root's middle is above the base, its radii.
const LIFT: [f64; 2] = [0.15, 0.6];
/// How high the first roots, which stand in the middle, rise above the others: widths.
const RAISED: [[f64; 2]; 3] = [[0.03, 0.07], [0.12, 0.36], [0.0, 0.2]];
/// Part of a life over which a root grows, over which roots begin to, and over which one shrinks.
const GROWS: f64 = 0.18;
const BEGIN: f64 = 0.2;
const SHRINKS: f64 = 0.2;
/// Spheres that sit on others.
#[derive(Debug, Clone, Copy)]
pub(super) struct Level {
    /// Their radius, relative to those that they sit on, at most.
    ratio: f64,
    /// How many sit on one.
    count: u32,
    /// How far their centres are from the centre of that, its radii.
    sits: f64,
    /// Below this radius they vanish, metres.
    least_m: f64,
}

/// Spheres of the last level vanish below this radius, metres: clouds less than about 1000 m wide have none.
pub(super) const LAST_LEVEL_M: f64 = 24.0;
/// Without the last, spheres of wide clouds would be seen as such.
pub(super) const LEVELS: [Level; Cumulus::MAX_LEVELS as usize] = [
    Level { ratio: 0.5, count: 28, sits: 0.92, least_m: 0.0 },
    Level { ratio: 0.42, count: 22, sits: 0.92, least_m: 0.0 },
    Level { ratio: 0.45, count: 20, sits: 0.88, least_m: LAST_LEVEL_M },
];
/// Radius within which a root and all that sits on it lie, its radii.
pub(super) fn reach(levels: u32) -> f64 {
    let (mut way, mut size, mut reach) = (0.0, 1.0, 1.0_f64);
    for level in LEVELS.iter().take(levels as usize) {
        way += size * level.sits;
        size *= level.ratio;
        reach = reach.max(way + size);
    }
    reach
}

/// Least radius of those, relative to the greatest.
const LEAST: f64 = 0.6;
/// Spheres fade away as they sink into others: from how deep on, and over what way, in greatest radii of their level.
const SUNK: f64 = 0.55;
const SINKS: f64 = 0.6;
/// So they do around the base's height.
const BASE_FADE: f64 = 0.6;
/// Least number of a sphere on which the last level sits.
const LAST: u32 = 32 * 32;
/// Angle between a direction and the next one around the vertical that spreads them evenly (Fibonacci's lattice).
const GOLDEN: f64 = 2.399_963_229_728_653;

/// A cloud at an age.
///
/// Where its spheres are and which of them are hidden follows from the cloud when it is full-grown. At other ages those of each
/// root are smaller by one factor, so that no radius changes faster than that of a root.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Cloud {
    /// All its numbers follow from this.
    pub(super) key: [u32; 3],
    /// Its middle.
    pub(super) centre: DVec2,
    /// Height of its base.
    pub(super) base_m: f64,
    /// Width when it is full-grown.
    pub(super) width_m: f64,
    /// Part of its life that has passed.
    pub(super) age: f64,
}

/// A sphere as others see it; from the middle of the base.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ball {
    /// What those that sit on it follow from, with its number.
    key: [u32; 3],
    /// Digits of base 32 that say which child of which child of which root of that key it is.
    number: u32,
    /// When it is full-grown.
    centre: DVec3,
    radius_m: f64,
    /// Now.
    here: DVec3,
    now_m: f64,
    /// How large its root is now, of its full radius.
    grown: f64,
}

impl Ball {
    /// A root that has its full size.
    pub(super) fn root(key: [u32; 3], Sphere { centre, radius_m }: Sphere) -> Self {
        Self { key, number: 1, centre, radius_m, here: centre, now_m: radius_m, grown: 1.0 }
    }

    /// What it is now.
    pub(super) fn sphere(&self) -> Sphere {
        Sphere { centre: self.here, radius_m: self.now_m }
    }

    /// The same, so much farther on.
    pub(super) fn shifted(&self, by: DVec3) -> Self {
        Self { centre: self.centre + by, here: self.here + by, ..*self }
    }
}

/// Lists that are used again from cloud to cloud.
#[derive(Debug, Default)]
pub(super) struct Scratch {
    balls: Vec<Ball>,
    grown: Vec<Ball>,
    near: Vec<Sphere>,
}

/// 0 up to 0, 1 from 1 on, and smooth between.
fn smooth(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

fn between([least, greatest]: [f64; 2], part: f64) -> f64 {
    least + (greatest - least) * part
}

impl Cloud {
    /// Gives all its spheres with their numbers. On the roots sit none that are much smaller than `least_m`.
    pub(super) fn spheres(&self, least_m: f64, scratch: &mut Scratch, mut give: impl FnMut(u32, Sphere)) {
        let Scratch { balls, grown, near } = scratch;
        balls.clear();
        self.roots(balls);
        grow(balls, grown, near, least_m);
        let middle = self.centre.extend(self.base_m);
        for ball in balls.iter().filter(|ball| ball.now_m > 0.0) {
            let Sphere { centre, radius_m } = ball.sphere();
            give(ball.number, Sphere { centre: middle + centre, radius_m });
        }
    }

    fn roots(&self, balls: &mut Vec<Ball>) {
        let [count, turn, aspect] = uniform(follow(self.key, 0));
        let count = ROOTS[0] + (count * f64::from(ROOTS[1] + 1)) as u32;
        let (aspect, turn) = (between(ASPECT, aspect).sqrt(), DVec2::from_angle(TAU * turn));
        let grown = |order: f64| {
            let left = smooth((1.0 - self.age - BEGIN * order) / SHRINKS);
            smooth((self.age - BEGIN * order) / GROWS).min(left)
        };
        for number in 0..count {
            let key = follow(self.key, number + 1);
            let ([angle, way, size], [lift, tower, _]) = (uniform(key), uniform(follow(key, 1)));
            // All rise and sink with the first.
            let (own, first) = (grown(f64::from(number) / f64::from(count)), grown(0.0));
            let size = if number == 0 { FIRST } else { between(OTHERS, size) };
            let radius_m = self.width_m * size;
            let way = ((f64::from(number) - 0.5 * way).max(0.0) / f64::from(count - 1)).sqrt();
            let way = SPREAD * way * if number == 1 { 0.4 } else { 1.0 };
            let flat = DVec2::from_angle(GOLDEN * f64::from(number) + angle - 0.5) * way;
            let flat = turn.rotate(flat * DVec2::new(1.25 * aspect, 1.0 / aspect)) * self.width_m;
            let raised = RAISED.get(number as usize).map_or(0.0, |&raised| between(raised, tower));
            let up_m = |own: f64, first: f64| own * radius_m * between(LIFT, lift) + first * raised * self.width_m;
            let (centre, here) = (flat.extend(up_m(1.0, 1.0)), flat.extend(up_m(own, first)));
            balls.push(Ball {
                key: self.key,
                number: number + 1,
                centre,
                radius_m,
                here,
                now_m: own * radius_m,
                grown: own,
            });
        }
    }
}

/// Adds what sits on the roots of a cloud, level upon level, but for what is much smaller than `least_m`.
fn grow(balls: &mut Vec<Ball>, grown: &mut Vec<Ball>, near: &mut Vec<Sphere>, least_m: f64) {
    let mut level = 0..balls.len();
    for kind in LEVELS {
        for parent in level {
            let others = balls.iter().enumerate().filter(|(other, _)| *other != parent).map(|(_, other)| *other);
            sits_on(&balls[parent], others, kind, least_m.max(kind.least_m), near, grown);
        }
        level = balls.len()..balls.len() + grown.len();
        balls.append(grown);
    }
}

/// Adds what sits on a ball: the others hide what sinks into them.
pub(super) fn sits_on(
    parent: &Ball,
    others: impl Iterator<Item = Ball>,
    Level { ratio, count, sits, .. }: Level,
    least_m: f64,
    near: &mut Vec<Sphere>,
    add: &mut Vec<Ball>,
) {
    let Ball { key, number, centre, radius_m, here, now_m, grown } = *parent;
    let greatest_m = ratio * radius_m;
    // What is not there now hides what comes after as if it were; the last level hides nothing.
    let needed_m = if number < LAST { greatest_m } else { grown * greatest_m };
    if visible(needed_m, least_m) <= 0.0 {
        return;
    }
    // How far from others a sphere shows wholly.
    let shows_m = (SINKS - SUNK) * greatest_m;
    near.clear();
    near.extend(others.filter_map(|other| {
        let reach_m = sits * radius_m + shows_m + other.radius_m;
        let is_near = other.centre.distance_squared(centre) < reach_m * reach_m;
        is_near.then_some(Sphere { centre: other.centre, radius_m: other.radius_m })
    }));
    let own = follow(key, number << 8);
    let [turn, ..] = uniform(own);
    for child in 1..=count {
        let [size, up, around] = uniform(follow(own, child));
        let size_m = greatest_m * between([LEAST, 1.0], size);
        let place = f64::from(child) - 0.5;
        let up = 1.0 - 2.0 * (place + 0.8 * (up - 0.5)) / f64::from(count);
        let height_m = centre.z + sits * radius_m * up;
        let over = smooth(height_m / (BASE_FADE * greatest_m) + 0.5);
        if visible(size_m * over, least_m) <= 0.0 {
            continue;
        }
        let angle = TAU * turn + GOLDEN * place + 0.5 * (around - 0.5);
        let flat = DVec2::from_angle(angle) * (1.0 - up * up).max(0.0).sqrt();
        let towards = sits * dvec3(flat.x, flat.y, up);
        let at = centre + radius_m * towards;
        let mut free_m = shows_m;
        for sphere in near.iter() {
            let whole_m = sphere.radius_m + shows_m;
            let distance = at.distance_squared(sphere.centre);
            if distance < whole_m * whole_m {
                free_m = free_m.min(distance.sqrt() - sphere.radius_m);
            }
        }
        let out_m = size_m * over * smooth((free_m / greatest_m + SUNK) / SINKS);
        let radius_m = visible(out_m, least_m);
        if radius_m > 0.0 {
            let (here, now_m) = (here + now_m * towards, visible(grown * out_m, least_m));
            add.push(Ball { key, number: number << 5 | child, centre: at, radius_m, here, now_m, grown });
        }
    }
}

/// Radius of a sphere that is to vanish at two thirds of the least: its own from the least on.
fn visible(radius_m: f64, least_m: f64) -> f64 {
    radius_m.min(3.0 * radius_m - 2.0 * least_m).max(0.0)
}
