//! The grid of a lattice.

use glam::{DVec3, dvec3};

/// Cubes that fill the domain.
#[derive(Debug, Clone, Copy)]
pub(super) struct Grid {
    /// Cubes along x, y, z.
    pub(super) size: [usize; 3],
    pub(super) cell_m: f64,
    /// Height of the lower face of the lowest cubes.
    pub(super) floor_m: f64,
    pub(super) extent_m: f64,
}

impl Grid {
    pub(super) fn count(&self) -> usize {
        self.size.iter().product()
    }

    pub(super) fn centre(&self, [x, y, z]: [u32; 3]) -> DVec3 {
        let corner = dvec3(-0.5 * self.extent_m, -0.5 * self.extent_m, self.floor_m);
        dvec3(f64::from(x) + 0.5, f64::from(y) + 0.5, f64::from(z) + 0.5) * self.cell_m + corner
    }

    pub(super) fn number(&self, [x, y, z]: [u32; 3]) -> usize {
        let [nx, ny, _] = self.size;
        x as usize + nx * (y as usize + ny * z as usize)
    }

    /// Along each axis: the cube before, its own, the one after. Beyond the domain's sides are those at the other one; above and below
    /// the nearest.
    pub(super) fn beside(&self, place: [u32; 3]) -> [[u32; 3]; 3] {
        let [nx, ny, nz] = self.size.map(|n| n as u32);
        let around = |at: u32, n: u32| [if at == 0 { n - 1 } else { at - 1 }, at, if at + 1 == n { 0 } else { at + 1 }];
        let [x, y, z] = place;
        [around(x, nx), around(y, ny), [z.saturating_sub(1), z, (z + 1).min(nz - 1)]]
    }

    /// Numbers of the cubes around one, and its own: along x, then y, then z.
    pub(super) fn around(&self, place: [u32; 3]) -> [usize; 27] {
        let [x, y, z] = self.beside(place);
        std::array::from_fn(|i| self.number([x[i % 3], y[i / 3 % 3], z[i / 9]]))
    }
}
