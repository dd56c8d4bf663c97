//! Light between the layers and the ground, on the host: balances the maps of sunlight, adds the layers to one composite
//! column, and exchanges its light with the ground's.

use super::inputs::LightInputs;
use crate::exchange::stack::{Layer, LayerLight, Stack};
use crate::exchange::{Kernel, Problem, Solver, exchange};
use crate::gpu::layout::Share;
use crate::method::Transport;
use crate::periodic;
use std::f64::consts::PI;

/// Sine of the zenith angle of the sun from which on the blend is even: of 30 degrees.
const BLENDED_FROM: f64 = 0.5;

/// Maps of a layer on the exchange grid, relative to the sun's horizontal irradiance above all layers (see the shaders
/// `base_light` and `base_column`); fourth channels hold what the slanted ray sends up.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ColumnMaps {
    /// What goes on at the base as the sun's light; fourth channel: red light sent up along the slanted ray.
    pub beam: Vec<[f32; 4]>,
    /// Diffuse light at the base along the slanted ray; fourth channel: green light sent up.
    pub tilted: Vec<[f32; 4]>,
    /// Diffuse light at the base by entry; fourth channel: blue light sent up.
    pub entered: Vec<[f32; 4]>,
    /// Light sent up by entry; fourth channel: what enters, relative.
    pub reflected: Vec<[f32; 4]>,
    /// Transmitted part of even light.
    pub through: Vec<[f32; 4]>,
    /// Part of even light that is not sent back.
    pub not_reflected: Vec<[f32; 4]>,
    /// What of the light that goes on is the beam on the ground.
    pub ground_beam: Vec<[f32; 4]>,
}

/// Mean fluxes of a scene per square metre of ground, three colours: what enters is what leaves and what is absorbed.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Energy {
    /// From sun and sky onto the highest layer.
    pub entering: [f64; 3],
    /// Up from the highest layer.
    pub leaving: [f64; 3],
    /// Absorbed by the ground.
    pub ground: [f64; 3],
    /// Absorbed by the clouds.
    pub clouds: [f64; 3],
}

/// What the host found.
pub(super) struct Between {
    /// Lowest first: all, and that of sky and ground alone.
    pub(super) layers: Vec<[LayerLight; 2]>,
    pub(super) gathered: Vec<[f32; 3]>,
    pub(super) shares: Vec<Share>,
    pub(super) energy: Energy,
}

/// The cheapest way to any accuracy (chart "exchange").
const KERNEL: Kernel = Kernel::Fourier;
/// Snow under thick cloud in a wide domain takes 5 steps to 1 %; far more are never needed.
const SOLVER: Solver = Solver::ConjugateGradients { passes: 60 };

fn mean(map: &[[f32; 4]], channel: usize) -> f64 {
    map.iter().map(|texel| f64::from(texel[channel])).sum::<f64>() / map.len().max(1) as f64
}

fn colours(value: impl Fn(usize) -> f64) -> [f64; 3] {
    [value(0), value(1), value(2)]
}

/// Ratio of two means; 1 where there is nothing.
fn ratio(wanted: f64, found: f64) -> f64 {
    if found > 1e-30 { wanted / found } else { 1.0 }
}

/// What comes through of light; all where there is next to none. Both are means over texels that are shifted against each
/// other: around edges more than all may come through in one and less in the next.
fn passing_part(through: f32, light: f64) -> f64 {
    if light > 1e-30 { (f64::from(through) / light).min(2.0) } else { 1.0 }
}

/// A map as it is at other places.
fn shifted(side: usize, [u, v]: [f64; 2], value: impl Fn(usize) -> [f64; 3]) -> Vec<[f64; 3]> {
    let map: Vec<[f64; 3]> = (0..side * side).map(value).collect();
    let place = |at: usize, shift: f64| periodic::Between::new((at as f64 + 0.5) / side as f64 + shift, side);
    let across: Vec<periodic::Between> = (0..side).map(|x| place(x, u)).collect();
    let mut shifted = Vec::with_capacity(side * side);
    for y in (0..side).map(|y| place(y, v)) {
        let [north, south] = [y.low, y.high].map(|y| &map[y * side..][..side]);
        shifted.extend(across.iter().map(|x| {
            let row = |row: &[[f64; 3]]| colours(|c| row[x.low][c] + (row[x.high][c] - row[x.low][c]) * x.part);
            let (north, south) = (row(north), row(south));
            colours(|c| north[c] + (south[c] - north[c]) * y.part)
        }));
    }
    shifted
}

/// What layers turned by more than the ground's beam and by less than what goes on, and those below let by: it leaves the layer
/// that turned it, diffuse. Relative; the mean is nearly that of what comes through the lowest base.
fn wide(columns: &[ColumnMaps], inputs: &LightInputs<'_>) -> Vec<[f64; 3]> {
    let side = inputs.grids.exchange_texels as usize;
    let mut sum = vec![[0.0; 3]; side * side];
    if columns.len() < 2 {
        return sum;
    }
    // By ray and by entry, as all diffuse light; by entry half as much: what hardly turned stays near its ray.
    let weight = 0.5 * f64::from(entry_weight(inputs));
    let goes_on = |map: &[[f32; 4]], i: usize| colours(|c| map[i][c].into());
    let above = |number: usize, map: fn(&ColumnMaps) -> &[[f32; 4]]| match columns.get(number + 1) {
        Some(above) => shifted(side, inputs.layers[number].above_uv, |i| goes_on(map(above), i)),
        None => vec![[1.0; 3]; side * side],
    };
    let lit: Vec<_> = (0..columns.len()).map(|number| above(number, |maps| &maps.beam)).collect();
    let passing = |number: usize, i: usize| colours(|c| passing_part(columns[number].beam[i][c], lit[number][i][c]));
    for number in 1..columns.len() {
        let maps = &columns[number];
        let lit_beam = above(number, |maps| &maps.ground_beam);
        let own: Vec<[f64; 3]> = (0..side * side)
            .map(|i| {
                let part = passing(number, i);
                let wide = |c: usize| f64::from(maps.beam[i][c]) - f64::from(maps.ground_beam[i][c]);
                colours(|c| (wide(c) - part[c] * (lit[number][i][c] - lit_beam[i][c])).max(0.0))
            })
            .collect();
        let by_entry = colours(|c| {
            let mean_own = own.iter().map(|own| own[c]).sum::<f64>() / own.len() as f64;
            if mean(&maps.entered, c) > 1e-30 { mean_own / mean(&maps.entered, c) } else { 0.0 }
        });
        let leaving =
            |i: usize| colours(|c| (1.0 - weight) * own[i][c] + weight * by_entry[c] * f64::from(maps.entered[i][c]));
        let mut left: Vec<[f64; 3]> = (0..side * side).map(leaving).collect();
        let mut away = [0.0; 2];
        for below in (0..number).rev() {
            away = [0, 1].map(|axis| away[axis] - inputs.layers[below].above_uv[axis]);
            for (left, part) in left.iter_mut().zip(shifted(side, away, |i| passing(below, i))) {
                *left = colours(|c| left[c] * part[c]);
            }
        }
        sum.iter_mut().zip(left).for_each(|(sum, left)| *sum = colours(|c| sum[c] + left[c]));
    }
    sum
}

/// Part of diffuse light that is taken by entry; the rest is by slanted rays. Under an upright sun no side of a cloud is lit more than another, and
/// entry alone blurs.
fn entry_weight(inputs: &LightInputs<'_>) -> f32 {
    match inputs.transport {
        Transport::Columns | Transport::Tilted | Transport::Lattice => 0.0,
        Transport::Blended => (0.5 * (inputs.sun_sine / BLENDED_FROM).min(1.0)) as f32,
        Transport::Entry => 1.0,
    }
}

/// How light by entry, which goes where the sun really falls but is not conserved, is brought to the mean of light along
/// slanted rays, which is.
fn share(maps: &ColumnMaps, entry_weight: f32, in_air: [f64; 3]) -> Share {
    let sent_up = [&maps.beam, &maps.tilted, &maps.entered];
    let scale = |values: [f64; 3]| values.map(|value| value as f32);
    Share {
        entry_scale: scale(colours(|c| ratio(mean(&maps.tilted, c), mean(&maps.entered, c)))),
        reflect_scale: scale(colours(|c| ratio(mean(sent_up[c], 3), mean(&maps.reflected, c)))),
        entry_weight,
        in_air: scale(in_air),
        ..Share::default()
    }
}

/// Height of the one plane that stands for all layers in the exchange with the ground: the mean height at which light
/// from the ground first meets cloud. With one layer it is its base.
fn radiating_height_m(columns: &[ColumnMaps], inputs: &LightInputs<'_>) -> f64 {
    let (mut sum_m, mut met, mut left) = (0.0, 0.0, 1.0);
    for (maps, layer) in columns.iter().zip(inputs.layers) {
        let through = mean(&maps.through, 1);
        let share = left * (1.0 - through);
        sum_m += share * layer.base_m;
        met += share;
        left *= through;
    }
    if met > 1e-6 { sum_m / met } else { inputs.layers[0].base_m }
}

/// Solves light between the layers and the ground.
pub(super) fn solve(columns: &[ColumnMaps], inputs: &LightInputs<'_>) -> Between {
    let side = inputs.grids.exchange_texels as usize;
    let sun = inputs.sun;
    let sky = inputs.sky.map(|radiance| PI * radiance);
    let weight = entry_weight(inputs);
    let shares: Vec<Share> =
        columns.iter().zip(inputs.air.within).map(|(maps, air)| share(maps, weight, air)).collect();
    let rgb = |map: &[[f32; 4]], value: &dyn Fn(usize, &[f32; 4]) -> f64| -> Vec<[f32; 3]> {
        map.iter().map(|texel| [0, 1, 2].map(|c| value(c, texel) as f32)).collect()
    };
    let plain = |map: &[[f32; 4]]| rgb(map, &|c, texel| texel[c].into());
    let sources: Vec<[Vec<[f32; 3]>; 4]> = columns
        .iter()
        .zip(&shares)
        .rev()
        .map(|(maps, share)| {
            let weight = f64::from(share.entry_weight);
            let down = maps.tilted.iter().zip(&maps.entered).map(|(tilted, entered)| {
                [0, 1, 2].map(|c| {
                    let entered = f64::from(share.entry_scale[c]) * f64::from(entered[c]);
                    (sun[c] * ((1.0 - weight) * f64::from(tilted[c]) + weight * entered)) as f32
                })
            });
            let up = rgb(&maps.reflected, &|c, texel| sun[c] * f64::from(share.reflect_scale[c]) * f64::from(texel[c]));
            [down.collect(), up, plain(&maps.through), plain(&maps.not_reflected)]
        })
        .collect();
    let lowest = &columns[0];
    let at_base = |i: usize| colours(|c| f64::from((sun[c] * f64::from(lowest.ground_beam[i][c])) as f32));
    let beam: Vec<[f32; 3]> =
        shifted(side, inputs.shift_uv, at_base).into_iter().map(|texel| texel.map(|value| value as f32)).collect();
    let mut downs: Vec<Vec<[f32; 3]>> = sources.iter().map(|[down, ..]| down.clone()).collect();
    if let Some(down) = downs.last_mut() {
        let wide = wide(columns, inputs);
        let scale = colours(|c| {
            let found = wide.iter().map(|wide| wide[c]).sum::<f64>() / (side * side) as f64;
            sun[c] * ratio(mean(&lowest.beam, c) - mean(&lowest.ground_beam, c), found)
        });
        for (down, wide) in down.iter_mut().zip(wide) {
            *down = [0, 1, 2].map(|c| down[c] + (scale[c] * wide[c]) as f32);
        }
    }
    let layers: Vec<Layer<'_>> = sources
        .iter()
        .zip(&downs)
        .map(|([_, up, transmitted, not_reflected], down)| Layer { down, up, transmitted, not_reflected })
        .collect();
    let albedo: Vec<[f32; 3]> = inputs.albedo.data.chunks(4).map(|texel| [texel[0], texel[1], texel[2]]).collect();
    let angles: Vec<_> = inputs.layers.iter().rev().filter_map(|layer| layer.angles.clone()).collect();
    let stack = Stack::new(&layers, &angles, side * side, sky);
    let problem = Problem {
        side,
        height_texels: radiating_height_m(columns, inputs) / inputs.extent_m * side as f64,
        albedo: &albedo,
        beam: &beam,
        diffuse: stack.diffuse(),
        not_reflected: stack.not_reflected(),
    };
    let exchanged = exchange(&problem, KERNEL, SOLVER, inputs.settled);
    tracing::debug!(passes = exchanged.passes, texels = side, "light between cloud and ground");
    let lit = stack.light(&exchanged.upwelling);
    let count = (side * side) as f64;
    let absorbed = |c: usize| {
        let texels = exchanged.irradiance.iter().zip(&albedo);
        texels.map(|(light, albedo)| f64::from(light[c]) * (1.0 - f64::from(albedo[c]))).sum::<f64>() / count
    };
    let (entering, ground) = (colours(|c| sun[c] + sky[c]), colours(absorbed));
    let leaving = colours(|c| lit.escaping.iter().map(|texel| f64::from(texel[c])).sum::<f64>() / count);
    // Of the sun's light each layer keeps what neither goes on as a beam nor leaves it scattered.
    let suns = columns.iter().enumerate().zip(sources.iter().rev()).map(|((number, maps), [down, up, ..])| {
        let arriving = |c: usize| columns.get(number + 1).map_or(1.0, |above| mean(&above.beam, c));
        let scattered = |map: &[[f32; 3]], c: usize| map.iter().map(|texel| f64::from(texel[c])).sum::<f64>() / count;
        colours(|c| sun[c] * (arriving(c) - mean(&maps.beam, c)) - scattered(down, c) - scattered(up, c))
    });
    let clouds = suns.fold(lit.absorbed, |sum, layer| colours(|c| sum[c] + layer[c]));
    let energy = Energy { entering, leaving, ground, clouds };
    let layers = lit.layers.into_iter().zip(lit.of_sky_and_ground).rev().map(<[LayerLight; 2]>::from);
    Between { layers: layers.collect(), gathered: exchanged.gathered, shares, energy }
}
