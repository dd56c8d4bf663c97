//! Sunlight in columns of a stratiform layer, and what they scatter down through their base plane and up.

use super::columns::Columns;
use super::grid::Grid;
use super::lighting::Lighting;
use super::rays::SunDepths;
use super::settle::{Enough, settle};
use super::sweep::Border;
use super::within::Within;
use glam::Vec4;
use std::convert::Infallible;
use std::f64::consts::PI;

/// Scattered sunlight; fluxes are parts of what falls on a horizontal plane above the layer, red, green, blue.
#[derive(Debug, Clone, PartialEq)]
pub struct Fluxes {
    /// Cubes along a side of the domain.
    pub across: usize,
    /// Side of a cube, metres.
    pub cell_m: f64,
    /// Down through the base plane, by the place there: along x, then y.
    pub down: Vec<[f32; 3]>,
    /// Up, by the place of the last cube of cloud.
    pub up: Vec<[f32; 3]>,
    /// Light within, under a sun of irradiance 1 on a plane facing it.
    pub within: Within,
    /// How deep the sun's rays are.
    pub depths: SunDepths,
    /// Iterations that were taken, and the last one's change.
    pub iterations: usize,
    /// See `iterations`.
    pub change: f64,
}

impl Fluxes {
    /// Solves for the light in columns; stops where `look`, which is asked between all steps, fails. Of the lighting the light from above and
    /// below is not looked at.
    ///
    /// # Errors
    ///
    /// Those of `look`.
    pub fn solve<E>(columns: &Columns, lighting: &Lighting, look: &dyn Fn() -> Result<(), E>) -> Result<Self, E> {
        let grid = columns.grid(lighting.extinction_per_m[1]);
        let kept_per_m = lighting.extinction_per_m[1] * lighting.scattering[1].kept;
        let enough = Enough::of_layer(lighting, kept_per_m * columns.mean_path_m());
        solve(columns, &grid, lighting, enough, look)
    }

    /// Those of a slab of so much thickness by optical depth and a relative extinction, which grows with height or does not, in cubes of this side.
    pub fn even(path_m: f64, density: f64, grows: bool, cell_m: f64, lighting: &Lighting) -> Self {
        let columns = Columns::even(path_m, density, grows);
        let look: &dyn Fn() -> Result<(), Infallible> = &|| Ok(());
        match solve(&columns, &columns.with(1, cell_m), lighting, Enough::EXACT, look) {
            Ok(fluxes) => fluxes,
            Err(never) => match never {},
        }
    }
}

fn solve<E>(
    columns: &Columns,
    grid: &Grid,
    lighting: &Lighting,
    enough: Enough,
    look: &dyn Fn() -> Result<(), E>,
) -> Result<Fluxes, E> {
    look()?;
    let lighting = Lighting { above: [0.0; 3], below: [0.0; 3], returned: [0.0; 3], ..*lighting };
    let (cells, dense, depths) = columns.cells(&lighting, grid);
    look()?;
    let border = Border::new(&dense);
    let settled = settle(&cells, &dense, &border, enough, look)?;
    let (within, exits) = Within::new(&cells, &border, &settled.state);
    let sun = lighting.sun.map(|sun| (4.0 * PI / (sun * lighting.towards_sun.z)) as f32);
    let parts =
        |light: Vec<Vec4>| light.iter().map(|light| [light.x * sun[0], light.y * sun[1], light.z * sun[2]]).collect();
    let [down, up] = exits.map(parts);
    let (iterations, change) = (settled.iterations, settled.change);
    Ok(Fluxes { across: grid.size[0], cell_m: grid.cell_m, down, up, within, depths, iterations, change })
}
