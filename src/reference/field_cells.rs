//! Convective cells. Twin of `shaders/field_cells.wgsl`.

use super::frame::texel_centre;
use super::map::Map;
use super::noise::{GRADIENT_NOISE_STD, noise_cell_edge, noise_gradient};
use crate::gpu::layout::Cells;
use glam::{DVec2, dvec2};

/// Cells, brought to mean 0 and standard deviation 1 (constants measured over many lattices), in the first channel.
pub fn main(cells: &Cells) -> Map {
    let width = cells.width as usize;
    debug_assert!(cells.coarser >= 0.0 && cells.finer >= 0.0 && cells.kind < 2, "{cells:?}");
    Map::from_fn(width, width, |x, y| {
        let uv = texel_centre(x, y, [cells.width; 2]);
        let part = |weight: f32, count: u32| {
            if weight > 0.0 { f64::from(weight) * lattice(cells, uv, count as i32) } else { 0.0 }
        };
        [part(cells.coarser, cells.count) + part(cells.finer, cells.count + 1), 0.0, 0.0, 0.0]
    })
}

fn lattice(cells: &Cells, uv: DVec2, period: i32) -> f64 {
    let place = uv * f64::from(period);
    let bend = dvec2(warp(cells, place, period, 101), warp(cells, place, period, 202));
    let seed = cells.seed.wrapping_add(303);
    let edge = noise_cell_edge(place + 0.22 * bend, period, seed, f64::from(cells.turns));
    if cells.kind == 0 {
        return (smoothstep(0.0, 0.45, edge) - 0.529) / 0.382;
    }
    ((-(edge / 0.2).powi(2)).exp() - 0.385) / 0.371
}

/// Three smooth octaves that bend the cells, standard deviation 1.
fn warp(cells: &Cells, place: DVec2, period: i32, salt: u32) -> f64 {
    let seed = cells.seed.wrapping_add(salt);
    let sum = noise_gradient(place, period, seed)
        + 0.4 * noise_gradient(2.0 * place, 2 * period, seed.wrapping_add(1))
        + 0.16 * noise_gradient(4.0 * place, 4 * period, seed.wrapping_add(2));
    // 1.0888 = sqrt(1 + 0.4^2 + 0.16^2)
    sum / (1.0888 * GRADIENT_NOISE_STD)
}

fn smoothstep(low: f64, high: f64, value: f64) -> f64 {
    let t = ((value - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
