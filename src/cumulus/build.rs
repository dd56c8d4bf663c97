//! Builds the index of a body.

use super::body::{Body, Sphere};
use super::cells::{Ball, Cell};
use super::index::Index;
use super::relief::Relief;
use glam::{DVec3, dvec3};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Cells have about this side, metres: smaller ones take longer to walk through, larger ones hold too many spheres.
const CELL_M: f64 = 100.0;
/// Most cells along x and y: four bytes are needed for each column.
const MOST_CELLS: f64 = 1024.0;
/// Most cells along z.
const MOST_LAYERS: f64 = 256.0;

pub(super) fn build(body: &Body) -> Index {
    let spheres: Vec<Sphere> = body.spheres.iter().copied().filter(|sphere| sphere.radius_m > 0.0).collect();
    let lowest_m = spheres.iter().map(|sphere| sphere.centre.z - sphere.radius_m).fold(f64::INFINITY, f64::min);
    let highest_m = spheres.iter().map(|sphere| sphere.centre.z + sphere.radius_m).fold(f64::NEG_INFINITY, f64::max);
    let bottom_m = if spheres.is_empty() { body.base_m } else { body.base_m.max(lowest_m - body.relief_m) };
    let top_m = bottom_m.max(highest_m + body.relief_m);
    let side = (body.extent_m / CELL_M).round().clamp(2.0, MOST_CELLS);
    let layers = ((top_m - bottom_m) / CELL_M).ceil().min(MOST_LAYERS);
    let mut index = Index {
        base_m: body.base_m,
        edge_m: body.edge_m.max(0.0),
        relief_m: body.relief_m.max(0.0),
        extent_m: body.extent_m,
        side: side as usize,
        layers: layers as usize,
        cell_m: body.extent_m / side,
        layer_m: (top_m - bottom_m) / layers.max(1.0),
        bottom_m,
        top_m,
        columns: vec![0; side as usize * side as usize],
        cells: Vec::new(),
        balls: Vec::new(),
        relief: Relief::new(body.extent_m),
    };
    if index.layers > 0 {
        let columns: Vec<(usize, Vec<Sphere>)> = columns(&index, &spheres).into_iter().collect();
        let cells = |(column, spheres): &(usize, Vec<Sphere>)| {
            let mut balls = Vec::new();
            let cells = (0..index.layers).map(|layer| cell(&index, *column, layer, spheres, &mut balls));
            (cells.collect::<Vec<Cell>>(), balls)
        };
        let parts: Vec<(Vec<Cell>, Vec<Ball>)> = columns.par_iter().map(cells).collect();
        for (number, ((column, _), (cells, balls))) in columns.iter().zip(parts).enumerate() {
            let first = index.balls.len() as u32;
            index.columns[*column] = number as u32 + 1;
            index.cells.extend(cells.into_iter().map(|cell| Cell { first: first + cell.first, ..cell }));
            index.balls.extend(balls);
        }
    }
    index
}

/// The columns that have cloud, each with the spheres that matter in it, in the period of the column.
fn columns(index: &Index, spheres: &[Sphere]) -> BTreeMap<usize, Vec<Sphere>> {
    let (mut columns, side) = (BTreeMap::<usize, Vec<Sphere>>::new(), index.side as i64);
    for sphere in spheres {
        let reach_m = sphere.radius_m + index.edge_m + index.relief_m;
        let cells = |middle_m: f64| {
            let cell = |metres: f64| (metres / index.cell_m).floor() as i64;
            cell(middle_m - reach_m)..=cell(middle_m + reach_m)
        };
        for y in cells(sphere.centre.y) {
            for x in cells(sphere.centre.x) {
                let period = dvec3(x.div_euclid(side) as f64, y.div_euclid(side) as f64, 0.0);
                let moved = Sphere { centre: sphere.centre - period * index.extent_m, ..*sphere };
                let column = (y.rem_euclid(side) * side + x.rem_euclid(side)) as usize;
                let (low, high) = corners(index, column, 0);
                let nearest = dvec3(moved.centre.x.clamp(low.x, high.x), moved.centre.y.clamp(low.y, high.y), 0.0);
                if nearest.truncate().distance(moved.centre.truncate()) < reach_m {
                    columns.entry(column).or_default().push(moved);
                }
            }
        }
    }
    columns
}

/// The lowest and the highest corner of a cell.
fn corners(index: &Index, column: usize, layer: usize) -> (DVec3, DVec3) {
    let size = dvec3(index.cell_m, index.cell_m, index.layer_m);
    let place = dvec3((column % index.side) as f64, (column / index.side) as f64, layer as f64);
    let low = place * size + DVec3::Z * index.bottom_m;
    (low, low + size)
}

/// A cell whose spheres, of those of its column, are added to `all`.
fn cell(index: &Index, column: usize, layer: usize, spheres: &[Sphere], all: &mut Vec<Ball>) -> Cell {
    let (low, high) = corners(index, column, layer);
    let reach_m = index.edge_m + index.relief_m;
    let mut least_m = f64::NEG_INFINITY;
    let mut balls = Vec::new();
    for sphere in spheres {
        let (centre, radius_m) = (sphere.centre, sphere.radius_m);
        let most_m = radius_m - centre.distance(centre.clamp(low, high));
        let farthest = (centre - low).abs().max((centre - high).abs());
        if most_m > -reach_m {
            balls.push(Ball { centre, radius_m, most_m });
            least_m = least_m.max(radius_m - farthest.length());
        }
    }
    // Another one is the nearest everywhere in the cell.
    balls.retain(|ball| ball.most_m >= least_m);
    balls.sort_by(|a, b| b.most_m.total_cmp(&a.most_m));
    let most_m = balls.first().map_or(-reach_m, |ball| ball.most_m) + index.relief_m;
    let above_base_m = high.z - index.base_m;
    let risen = |inside_m: f64| {
        if index.edge_m > 0.0 { (inside_m / index.edge_m).clamp(0.0, 1.0) } else { inside_m.signum().max(0.0) }
    };
    let most_density = risen(most_m) * risen(above_base_m);
    let first = all.len() as u32;
    let cell = Cell {
        first,
        count: balls.len() as u32,
        // Rounding must not make it less.
        most_density: if most_m > 0.0 { (most_density as f32).next_up().min(1.0) } else { 0.0 },
        full: least_m >= reach_m && low.z >= index.base_m + index.edge_m,
    };
    all.extend(balls);
    cell
}
