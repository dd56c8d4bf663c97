//! The sun's light in a layer's columns by a lattice in three dimensions, and what makes it exact where the cloud is even.

use crate::cumulus::dressed::Scattering;
use crate::cumulus::lattice::{Columns, Fluxes, Lighting, SunDepths, Within};
use crate::gpu::HostMap;
use crate::gpu::layout::LatticeLight;
use crate::slab::fluxes::FluxTable;
use glam::{DVec3, Vec4};
use half::f16;
use rayon::prelude::*;

/// Optical depths at which the lattice is compared with a slab, by their root.
const NODES: usize = 32;
/// How far the sun of the factors is from that which falls on the faces of the cloud back to its own, in the logarithm of its cosine. A third, by fields
/// of which none is in the chart: with none of it the means are 9 % too high under a sun at 80 degrees, with half of it right, but what all
/// views from above and the ground have then misses 1.2 % of the light at 70 degrees.
const SHADED: f64 = 1.0 / 3.0;
/// What a factor may be: a slab that lets next to nothing by tells nothing.
const FACTORS: [f32; 2] = [0.1, 10.0];

/// A layer as a lattice takes it. Arrays are red, green, blue.
pub(crate) struct LatticeInputs<'a> {
    /// Its map on the device, as the host reads it.
    pub(crate) map: &'a HostMap,
    pub(crate) extent_m: f64,
    /// Mean extinction of its columns, relative to the droplets'.
    pub(crate) density: f64,
    /// From the base plane to the highest top at any time, metres, at most.
    pub(crate) room_m: f64,
    pub(crate) extinction_per_m: [f64; 3],
    pub(crate) scattering: [Scattering; 3],
    /// Towards the sun, a unit vector above the horizon: east, north, up.
    pub(crate) towards_sun: [f64; 3],
    /// Cosine of its zenith for slanted rays.
    pub(crate) slant_cosine: f64,
    pub(crate) fluxes: &'a [FluxTable; 3],
}

impl LatticeInputs<'_> {
    /// Whether all colours are scattered alike.
    fn is_grey(&self) -> bool {
        let of = |c: usize| (self.extinction_per_m[c], self.scattering[c]);
        of(0) == of(1) && of(2) == of(1)
    }
}

/// What a lattice has found of a layer.
#[derive(Debug, Clone, PartialEq)]
pub struct LatticeMaps {
    /// Scattered sunlight down through the base plane, and up; parts of what falls on a horizontal plane above. In the map's axes.
    pub down: HostMap,
    /// See `down`.
    pub up: HostMap,
    /// Exact light of a slab over that of the lattice, by the root of optical depth: transmitted, reflected.
    pub factors: HostMap,
    /// Cubes along x, y, z: the lowest ones lie below the base plane.
    pub size: [usize; 3],
    /// Scattered sunlight of irradiance 1 in the cubes: green mean radiance and its moments along x, y, z, then mean radiance of red,
    /// blue and green, and the moment along z, so that upright rays read these alone. Moments of red and blue are to their means as those of green.
    pub within: Vec<[f16; 4]>,
    /// Optical depths towards the sun.
    pub depths: SunDepths,
    /// The same light in slabs: a row each, by the root of optical depth, columns of heights as of the cubes. Green mean, moment towards the
    /// sun's side, across it and upwards; then as in cubes.
    pub slabs: Vec<[f16; 4]>,
    /// Columns and rows of those.
    pub slabs_size: [usize; 2],
    /// How it is read.
    pub light: LatticeLight,
}

impl LatticeMaps {
    /// The same, in air that leaves so much of light that comes through it.
    pub(crate) fn in_air(&self, in_air: [f32; 3]) -> Self {
        Self { light: LatticeLight { in_air, ..self.light }, ..self.clone() }
    }

    /// Solves the lattice of a layer; `None` where there is no cloud.
    ///
    /// # Errors
    ///
    /// Those of `look`, which is asked between all steps.
    pub(crate) fn new<E>(inputs: &LatticeInputs<'_>, look: &dyn Fn() -> Result<(), E>) -> Result<Option<Self>, E> {
        let Some(columns) = columns(inputs) else { return Ok(None) };
        let [x, y, _] = inputs.towards_sun;
        let lighting = Lighting {
            extinction_per_m: inputs.extinction_per_m,
            scattering: inputs.scattering,
            // Rows go south.
            towards_sun: DVec3::new(x, -y, inputs.slant_cosine),
            sun: [1.0; 3],
            above: [0.0; 3],
            below: [0.0; 3],
            returned: [0.0; 3],
        };
        let fluxes = Fluxes::solve(&columns, &lighting, look)?;
        let (iterations, change) = (fluxes.iterations, fluxes.change);
        tracing::debug!(iterations, change, cell_m = fluxes.cell_m, across = fluxes.across, "lattice of a layer");
        look()?;
        // A slab under a sun that is as steep to its face as this one is to those of the cloud.
        let cosine = columns.faced_cosine(lighting.towards_sun, fluxes.cell_m);
        // Part of what is bright towards a low sun lies in the shadow of what is before it.
        let own = lighting.towards_sun.z;
        let cosine = cosine * (own / cosine).powf(SHADED);
        let faced = Lighting { towards_sun: DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine), ..lighting };
        let deepest_m = columns.texels.iter().map(|texel| texel[0]).fold(0.0, f32::max);
        let path_m = |node: usize| {
            // The first factor is that of thin cloud.
            let root = (node as f64).max(0.25) / (NODES - 1) as f64;
            root * root * f64::from(deepest_m)
        };
        let nodes =
            (0..NODES).into_par_iter().map(|node| factors(inputs, &columns, &faced, path_m(node), fluxes.cell_m));
        let nodes: Vec<[[f32; 3]; 2]> = nodes.collect();
        let cosine = lighting.towards_sun.z;
        let level = Lighting { towards_sun: DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine), ..lighting };
        // Without its profile: after equal depths its light is the same, and heights are as depths.
        let slab = |node| Fluxes::even(path_m(node), columns.density, false, fluxes.cell_m, &level).within;
        let slabs: Vec<Within> = (0..NODES).into_par_iter().map(slab).collect();
        let rgba = |[r, g, b]: [f32; 3]| [r, g, b, 0.0];
        let map = |width: usize, texels: Vec<[f32; 3]>| HostMap {
            width: width as u32,
            height: (texels.len() / width) as u32,
            channels: 4,
            data: texels.into_iter().flat_map(rgba).collect(),
        };
        let rows = [0, 1].into_iter().flat_map(|which| nodes.iter().map(move |node| node[which])).collect();
        Ok(Some(Self {
            down: map(fluxes.across, fluxes.down),
            up: map(fluxes.across, fluxes.up),
            factors: map(NODES, rows),
            slabs: rows_of(&slabs, fluxes.within.size[2]),
            slabs_size: [fluxes.within.size[2], 2 * NODES],
            size: fluxes.within.size,
            within: [green, upwards]
                .into_iter()
                .flat_map(|of| fluxes.within.light.par_iter().map(of).collect::<Vec<_>>())
                .collect(),
            light: LatticeLight {
                kept: inputs.scattering.map(|scattering| scattering.kept as f32),
                reach: (inputs.extinction_per_m[1] * f64::from(deepest_m)) as f32,
                albedo: inputs.scattering.map(|scattering| scattering.albedo as f32),
                cell_m: fluxes.cell_m as f32,
                asymmetry: inputs.scattering.map(|scattering| 3.0 * scattering.asymmetry as f32),
                sun_step_m: fluxes.depths.step_m as f32,
                density: columns.density as f32,
                grey: inputs.is_grey().into(),
                ..LatticeLight::default()
            },
            depths: fluxes.depths,
        }))
    }
}

fn half(value: f32) -> f16 {
    f16::from_f32(value.clamp(-65504.0, 65504.0))
}

/// Green light in a cube.
fn green(parts: &[Vec4; 4]) -> [f16; 4] {
    parts.map(|part| half(part.y))
}

/// What upright rays read.
fn upwards([mean, .., up]: &[Vec4; 4]) -> [f16; 4] {
    [half(mean.x), half(mean.z), half(mean.y), half(up.y)]
}

/// Light in slabs, by height. Above its cubes a slab has what leaves it.
fn rows_of(slabs: &[Within], heights: usize) -> Vec<[f16; 4]> {
    let row = |slab: &Within, of: fn(&[Vec4; 4]) -> [f16; 4]| {
        (0..heights).map(|height| of(&slab.light[height.min(slab.light.len() - 1)])).collect::<Vec<_>>()
    };
    [green, upwards].into_iter().flat_map(|of| slabs.iter().flat_map(move |slab| row(slab, of))).collect()
}

/// The columns of a map.
fn columns(inputs: &LatticeInputs<'_>) -> Option<Columns> {
    let HostMap { width, height, channels, data } = inputs.map;
    let texels: Vec<[f32; 3]> = match channels {
        1 => data.iter().map(|&height_m| [height_m, height_m, 0.0]).collect(),
        _ => data.chunks(*channels as usize).map(|texel| [texel[0], texel[1], texel[2]]).collect(),
    };
    let top_m = texels.iter().filter(|texel| texel[0] > 0.0).map(|texel| texel[1]).fold(0.0, f32::max);
    (top_m > 0.0).then(|| Columns {
        size: [*width as usize, *height as usize],
        texels,
        extent_m: inputs.extent_m,
        room_m: inputs.room_m.max(top_m.into()),
        grows: *channels == 4 && data.get(3).is_some_and(|grows| *grows > 0.0),
        density: inputs.density.max(1e-6),
    })
}

/// Exact light of a slab over that of the lattice: transmitted, reflected.
fn factors(
    inputs: &LatticeInputs<'_>,
    columns: &Columns,
    lighting: &Lighting,
    path_m: f64,
    cell_m: f64,
) -> [[f32; 3]; 2] {
    let mu = lighting.towards_sun.z;
    let even = Fluxes::even(path_m, columns.density, columns.grows, cell_m, lighting);
    let (down, up) = (even.down[0], even.up[0]);
    let factor = |exact: f64, found: f64| {
        if found > 1e-9 { ((exact / found) as f32).clamp(FACTORS[0], FACTORS[1]) } else { 1.0 }
    };
    let depth = |c: usize| inputs.extinction_per_m[c] * path_m;
    let direct = |c: usize| (-lighting.scattering[c].kept * depth(c) / mu).exp();
    [
        [0, 1, 2].map(|c| factor(inputs.fluxes[c].transmittance(depth(c), mu), direct(c) + f64::from(down[c]))),
        [0, 1, 2].map(|c| factor(inputs.fluxes[c].reflectance(depth(c), mu), up[c].into())),
    ]
}
