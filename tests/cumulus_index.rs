//! The index of cumulus against the formula itself.
#![allow(clippy::print_stdout, reason = "what lines cost")]

use glam::{DVec3, dvec3};
use skyloom::cumulus::{Body, Index, Line, Ray, Relief, Sphere, Volume};
use std::cell::Cell;
use std::ops::ControlFlow;

/// Numbers from 0 to 1 without pattern.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn place(&mut self, size: DVec3) -> DVec3 {
        dvec3(self.next(), self.next(), self.next()) * size
    }

    fn direction(&mut self) -> DVec3 {
        let z = 2.0 * self.next() - 1.0;
        let (sine, cosine) = (std::f64::consts::TAU * self.next()).sin_cos();
        let across = (1.0 - z * z).sqrt();
        dvec3(across * cosine, across * sine, z)
    }
}

/// Clusters of spheres, also beyond the domain's edges; a few are large.
fn body(count: usize, extent_m: f64, edge_m: f64, relief_m: f64, seed: u64) -> Body {
    let mut numbers = Numbers(seed);
    let mut spheres = Vec::new();
    while spheres.len() < count {
        let middle = numbers.place(dvec3(extent_m, extent_m, 0.0)) - 0.5 * extent_m;
        let middle = dvec3(middle.x, middle.y, 850.0);
        for number in 0..count.min(300) {
            let offset = numbers.direction() * 350.0 * numbers.next().sqrt();
            let radius_m = if number == 0 { 150.0 } else { 8.0 + 70.0 * numbers.next().powi(3) };
            spheres.push(Sphere { centre: middle + dvec3(offset.x, offset.y, offset.z.abs()), radius_m });
        }
    }
    Body { spheres, base_m: 800.0, edge_m, relief_m, extent_m }
}

/// `max_i(R_i - |p - c_i|)` over all periods.
fn surface(body: &Body, place: DVec3) -> f64 {
    let periods = [-1.0, 0.0, 1.0];
    let wrapped = place - dvec3(place.x, place.y, 0.0).map(|m| (m / body.extent_m).round() * body.extent_m);
    let inside = |sphere: &Sphere| {
        let centre = sphere.centre
            - dvec3(sphere.centre.x, sphere.centre.y, 0.0).map(|m| (m / body.extent_m).round() * body.extent_m);
        let copies = periods.iter().flat_map(|x| periods.map(|y| dvec3(*x, y, 0.0) * body.extent_m));
        copies.map(|copy| sphere.radius_m - (centre + copy).distance(wrapped)).fold(f64::MIN, f64::max)
    };
    body.spheres.iter().map(inside).fold(f64::MIN, f64::max)
}

fn density(body: &Body, place: DVec3) -> f64 {
    let inside = surface(body, place) + body.relief_m * Relief::new(body.extent_m).at(place);
    if body.edge_m > 0.0 {
        (inside / body.edge_m).clamp(0.0, 1.0) * ((place.z - body.base_m) / body.edge_m).clamp(0.0, 1.0)
    } else {
        f64::from(u8::from(inside > 0.0 && place.z > body.base_m))
    }
}

#[test]
fn densities_are_those_of_the_formula() {
    for (edge_m, relief_m) in [(0.0, 0.0), (20.0, 0.0), (15.0, 25.0), (0.0, 10.0)] {
        let body = body(120, 1500.0, edge_m, relief_m, 3);
        let index = Index::new(&body);
        let mut numbers = Numbers(5);
        let (mut partly, mut cloudy, reach_m) = (0, 0, edge_m + relief_m);
        for _ in 0..10_000 {
            let place = numbers.place(dvec3(6000.0, 6000.0, 700.0)) + dvec3(-3000.0, -3000.0, 700.0);
            let (found, truth) = (index.density(place), density(&body, place));
            assert!((found - truth).abs() < 1e-9, "{found} {truth} at {place}");
            partly += i32::from(truth > 0.0 && truth < 1.0);
            cloudy += i32::from(truth > 0.0);
            if (body.base_m..index.heights_m()[1]).contains(&place.z) {
                let (found, truth) = (index.surface(place), surface(&body, place).max(-reach_m));
                assert!((found - truth).abs() < 1e-9, "{found} {truth} at {place}");
            }
        }
        assert!(cloudy > 150 && (partly > 50) == (edge_m > 0.0), "{cloudy} {partly}");
    }
}

#[test]
fn paths_between_spheres_are_exact() {
    let body = body(150, 1500.0, 0.0, 0.0, 11);
    let index = Index::new(&body);
    let mut numbers = Numbers(17);
    let mut worst = 0.0_f64;
    for number in 0..3000 {
        let origin = numbers.place(dvec3(1500.0, 1500.0, 1600.0));
        let direction = if number % 10 == 0 { dvec3(0.6, -0.8, 0.0) } else { numbers.direction() };
        let line = Line { origin, direction, from_m: 0.0, to_m: 2500.0 };
        let mut lengths = Vec::new();
        for sphere in &body.spheres {
            for x in -4..=4 {
                for y in -4..=4 {
                    let to = sphere.centre + dvec3(f64::from(x), f64::from(y), 0.0) * 1500.0 - origin;
                    let middle = to.dot(direction);
                    let square = sphere.radius_m.powi(2) - (to - direction * middle).length_squared();
                    if square > 0.0 {
                        lengths.push((middle - square.sqrt(), middle + square.sqrt()));
                    }
                }
            }
        }
        lengths.sort_by(|a, b| a.0.total_cmp(&b.0));
        let to_base = (body.base_m - origin.z) / direction.z;
        let (low, high) = match direction.z {
            z if z > 0.0 => (to_base.max(0.0), 2500.0),
            z if z < 0.0 => (0.0, to_base.min(2500.0)),
            _ => (0.0, if origin.z > body.base_m { 2500.0 } else { 0.0 }),
        };
        let (mut sum, mut end) = (0.0, low);
        for (from, to) in lengths {
            sum += (to.min(high) - from.max(end)).max(0.0);
            end = end.max(to);
        }
        worst = worst.max((index.path_m(&line, f64::INFINITY) - sum).abs());
    }
    println!("worst {worst:.1e} m");
    assert!(worst < 1e-7);
}

#[test]
fn pieces_of_soft_edges_come_in_order_and_add_up() {
    for (edge_m, relief_m) in [(10.0, 0.0), (20.0, 30.0)] {
        let body = body(80, 1500.0, edge_m, relief_m, 23);
        let index = Index::new(&body);
        let mut numbers = Numbers(29);
        let (mut errors, mut paths) = (0.0, 0.0);
        for _ in 0..60 {
            let line =
                Line { to_m: 2000.0, ..Line::from(numbers.place(dvec3(1500.0, 1500.0, 1600.0)), numbers.direction()) };
            let steps = 8000;
            let step = 2000.0 / f64::from(steps);
            let sum: f64 = (0..steps).map(|i| step * density(&body, line.at(step * (f64::from(i) + 0.5)))).sum();
            let (mut end, mut found) = (0.0, 0.0);
            index.pieces(&line, |from, to, density| {
                assert!(from >= end && to > from && density > 0.0 && density <= 1.0);
                end = to;
                found += (to - from) * density;
                ControlFlow::Continue(())
            });
            errors += (found - sum).abs();
            paths += sum;
        }
        println!("edge {edge_m}, relief {relief_m}: mean error of paths {:.1e}", errors / paths);
        assert!(errors / paths < 1e-3);
    }
}

#[test]
fn a_body_without_spheres_is_empty() {
    let body = Body { spheres: Vec::new(), base_m: 500.0, edge_m: 10.0, relief_m: 5.0, extent_m: 5000.0 };
    let index = Index::new(&body);
    assert_eq!(index.heights_m(), [500.0; 2]);
    assert_eq!(index.density(dvec3(1.0, 2.0, 505.0)), 0.0);
    assert_eq!(index.path_m(&Line::from(DVec3::ZERO, DVec3::Z), f64::INFINITY), 0.0);
    // A level line ends.
    assert_eq!(index.path_m(&Line::from(DVec3::Z * 500.0, DVec3::X), f64::INFINITY), 0.0);
}

/// Rays that look up from the ground, none very flat.
fn looking_up(extent_m: f64, count: usize) -> impl Iterator<Item = (DVec3, DVec3)> {
    let mut numbers = Numbers(37);
    (0..count).map(move |_| {
        let up = numbers.direction().abs().normalize();
        (numbers.place(dvec3(extent_m, extent_m, 0.0)), dvec3(up.x, up.y, up.z.max(0.2)).normalize())
    })
}

/// A hundred times the spheres over the same part of the ground: a ray visits no more than four times the cells of the index, and its march
/// through the volume takes no more than four times the steps. Both are counted: times go with the machine. (What a cell holds is counted
/// beside the index.)
#[test]
fn a_hundred_times_the_spheres_are_few_more_steps() {
    let found = [(600, 2000.0), (64_200, 20_000.0)].map(|(count, extent_m)| {
        let body = body(count, extent_m, 0.0, 0.0, 31);
        let (index, volume) = (Index::new(&body), Volume::new(&body));
        let (mut cells, mut path_m, steps) = (0, 0.0, Cell::new(0));
        let rays = 4000;
        for (from, towards) in looking_up(extent_m, rays) {
            let mut length_m = 0.0;
            index.walk(&Line::from(from, towards), |_| {
                cells += 1;
                ControlFlow::Continue(())
            });
            let look = |_: f64| {
                steps.set(steps.get() + 1);
                0.0
            };
            volume.march(Ray { from, towards }, 1e5, look, |step| {
                length_m += step.density * (step.to_m - step.from_m);
                length_m < 500.0
            });
            path_m += length_m;
        }
        let [cells, steps, path_m] = [f64::from(cells), f64::from(steps.get()), path_m].map(|sum| sum / rays as f64);
        println!("{count} spheres: {cells:.2} cells and {steps:.2} steps a ray, {path_m:.0} m of cloud");
        (cells, steps, path_m)
    });
    let [few, many] = found;
    assert!(many.0 < 4.0 * few.0 && many.1 < 4.0 * few.1, "{few:?} {many:?}");
    // They meet as much cloud.
    assert!(many.2 > 0.5 * few.2 && few.2 > 10.0, "{few:?} {many:?}");
}
