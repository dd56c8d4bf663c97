//! Layers of uneven thickness as a photon meets them.

use glam::DVec3;

use super::air::{Air, Met};
use super::problem::{FieldProblem, Layer};
use crate::atmosphere::geometry::TOP_M;
use crate::periodic::Axis;
use crate::reference::monte_carlo::columns::Columns;
use crate::reference::monte_carlo::error::MonteCarloError;
use crate::reference::monte_carlo::random::Random;
use crate::reference::monte_carlo::surface::Surface;

/// Most cells along a side of the grid of greatest heights.
const MAX_CELLS: f64 = 32.0;
/// Cells no smaller than this part of the highest cloud: a flight is a few cells long then. Also what keeps flights in a
/// domain much smaller than its clouds are high from crossing it a million times.
const CELL_PART: f64 = 0.1;

/// A layer's extinction and shape.
#[derive(Debug)]
struct Cloud {
    base_m: f64,
    extinction_per_m: f64,
    form: Form,
    /// Height above the ground of the highest cloud in each cell.
    tops_m: Vec<f64>,
    /// Greatest extinction in each cell, 1/m.
    most_per_m: Vec<f64>,
}

/// How a layer's map tells its shape.
#[derive(Debug)]
enum Form {
    Sheet(Surface),
    Columns(Box<Columns>),
}

/// All that a photon can meet above the ground.
#[derive(Debug)]
pub(super) struct Medium {
    clouds: Vec<Cloud>,
    air: Option<Air>,
    /// Ground, bases, highest tops and the end of the air, if there is air, in ascending order: at least two heights.
    /// Between two of them, the same layers are present everywhere or nowhere.
    pub(super) edges_m: Vec<f64>,
    /// Which of the edges is the lowest base.
    pub(super) base_edge: usize,
    /// Which is the highest top; the last one without air.
    pub(super) top_edge: usize,
    /// The layers that reach each of the bands between edges.
    bands: Vec<Vec<usize>>,
    cells: usize,
    cell_m: f64,
}

/// How a flight ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Flight {
    /// By a collision in a layer.
    Collision(usize),
    /// By a collision in the air.
    Air(Met),
    /// At the edge above or below the band.
    Edge,
}

impl Medium {
    pub(super) fn new(problem: &FieldProblem<'_>) -> Result<Self, MonteCarloError> {
        let extent_m = problem.extent_m;
        let highest_m = problem.layers.iter().map(Layer::depth_m).fold(0.0, f64::max);
        let cells = (extent_m / (CELL_PART * highest_m)).clamp(1.0, MAX_CELLS) as usize;
        let cloud = |layer: &Layer<'_>| {
            let (base_m, extinction_per_m) = (layer.base_m, layer.extinction_per_m);
            let above = |heights: Vec<f64>| heights.into_iter().map(|height| base_m + height).collect();
            if layer.ragged {
                let columns = Columns::new(layer.thickness, layer.offset_uv, extent_m);
                let [tops, densest] = columns.greatest_in(cells);
                let most_per_m = densest.into_iter().map(|density| density * extinction_per_m).collect();
                return Cloud {
                    base_m,
                    extinction_per_m,
                    form: Form::Columns(Box::new(columns)),
                    tops_m: above(tops),
                    most_per_m,
                };
            }
            let thickness = Surface::new(layer.thickness, layer.offset_uv, extent_m);
            let tops_m = above(thickness.greatest_in(cells));
            let most_per_m = vec![extinction_per_m; cells * cells];
            Cloud { base_m, extinction_per_m, form: Form::Sheet(thickness), tops_m, most_per_m }
        };
        let top_m = |layer: &Layer<'_>| layer.base_m + layer.depth_m();
        let mut edges_m = vec![0.0];
        edges_m.extend(problem.layers.iter().flat_map(|layer| [layer.base_m, top_m(layer)]));
        edges_m.sort_by(f64::total_cmp);
        edges_m.dedup();
        if edges_m.len() == 1 {
            // No cloud, and its base on the ground. Any height will do.
            edges_m.push(1.0);
        }
        let top_edge = edges_m.len() - 1;
        if problem.air.is_some() {
            edges_m.push(TOP_M);
        }
        let lowest_m = problem.layers.first().map_or(0.0, |layer| layer.base_m);
        let reaching = |band: &[f64]| {
            let present =
                |layer: &Layer<'_>| layer.extinction_per_m > 0.0 && layer.base_m <= band[0] && band[1] <= top_m(layer);
            (0..problem.layers.len()).filter(|i| present(&problem.layers[*i])).collect()
        };
        Ok(Self {
            clouds: problem.layers.iter().map(cloud).collect(),
            air: problem.air.map(Air::new).transpose()?,
            base_edge: edges_m.partition_point(|edge| *edge < lowest_m),
            top_edge,
            bands: edges_m.windows(2).map(reaching).collect(),
            edges_m,
            cells,
            cell_m: extent_m / cells as f64,
        })
    }

    /// The air, if there is any.
    pub(super) fn air(&self) -> Option<&Air> {
        self.air.as_ref()
    }

    /// Flies from `place` (x east, y south, z up, metres) along the unit vector `direction`, whose z is not 0, inside a
    /// band between edges. Leaves `place` where the flight ends.
    pub(super) fn fly(&self, band: usize, place: &mut DVec3, direction: DVec3, random: &mut Random) -> Flight {
        let edge_m = self.edges_m[if direction.z > 0.0 { band + 1 } else { band }];
        let end_m = ((edge_m - place.z) / direction.z).max(0.0);
        // Whichever comes first: the two are independent.
        let in_air = self.air.as_ref().and_then(|air| air.fly(place.z, direction.z, end_m, random));
        let free_m = in_air.map_or(end_m, |(way_m, _)| way_m);
        let collision =
            if self.bands[band].is_empty() { None } else { self.collide(band, *place, direction, free_m, random) };
        match (collision, in_air) {
            (Some((way_m, layer)), _) => {
                *place += direction * way_m;
                Flight::Collision(layer)
            }
            (None, Some((way_m, met))) => {
                *place += direction * way_m;
                Flight::Air(met)
            }
            (None, None) => {
                *place += direction * end_m;
                place.z = edge_m;
                Flight::Edge
            }
        }
    }

    /// The way to the next collision and its layer, if there is one before `end_m`.
    fn collide(
        &self,
        band: usize,
        start: DVec3,
        direction: DVec3,
        end_m: f64,
        random: &mut Random,
    ) -> Option<(f64, usize)> {
        let mut x = Axis::new(start.x, direction.x, self.cell_m, self.cells);
        let mut y = Axis::new(start.y, direction.y, self.cell_m, self.cells);
        let mut optical = random.free_path();
        let mut way_m = 0.0;
        while way_m < end_m {
            let next_m = x.next_m.min(y.next_m).min(end_m);
            // Of this piece the lowest point: no layer is met whose top in this cell is below.
            let lowest_m = start.z + direction.z * if direction.z > 0.0 { way_m } else { next_m };
            let cell = y.cell * self.cells + x.cell;
            let met = |layer: &&usize| self.clouds[**layer].tops_m[cell] > lowest_m;
            let layers = || self.bands[band].iter().filter(met);
            let majorant: f64 = layers().map(|i| self.clouds[*i].most_per_m[cell]).sum();
            if majorant > 0.0 {
                loop {
                    let step_m = optical / majorant;
                    if way_m + step_m >= next_m {
                        optical -= (next_m - way_m) * majorant;
                        break;
                    }
                    way_m += step_m;
                    optical = random.free_path();
                    let hit = self.hit(layers(), cell, start + direction * way_m, majorant * random.uniform());
                    if let Some(layer) = hit {
                        return Some((way_m, layer));
                    }
                }
            }
            // Rounding above must not make it negative.
            optical = optical.max(0.0);
            way_m = next_m;
            x.pass(way_m);
            y.pass(way_m);
        }
        None
    }

    /// A collision with what would fill a cell up to its highest top: the layer it is in, `chosen` by the extinctions,
    /// unless `place` is outside its cloud.
    fn hit<'a>(
        &self,
        layers: impl Iterator<Item = &'a usize>,
        cell: usize,
        place: DVec3,
        mut chosen: f64,
    ) -> Option<usize> {
        for layer in layers {
            let cloud = &self.clouds[*layer];
            if chosen < cloud.most_per_m[cell] {
                let height_m = place.z - cloud.base_m;
                let inside = match &cloud.form {
                    Form::Sheet(thickness) => height_m < thickness.at(place.x, place.y),
                    // Among what fills a cell up, as much is cloud as the column is dense.
                    Form::Columns(columns) => {
                        chosen < cloud.extinction_per_m * columns.density_at(place.x, place.y, height_m)
                    }
                };
                return inside.then_some(*layer);
            }
            chosen -= cloud.most_per_m[cell];
        }
        None
    }
}
