//! The sun's light at base and top of each layer, on the device.

use super::between::ColumnMaps;
use super::inputs::{LayerInputs, LightInputs};
use super::lattice::LatticeMaps;
use super::plan::Grids;
use crate::gpu::layout::{Blur, Share};
use crate::gpu::{Bind, Gpu, GpuError, HostMap, Pass, Target, binds, shaders};
use std::time::Instant;

/// Maps of a layer's sunlight. Those with mip levels are means over coarser texels there.
pub(crate) struct SunMaps {
    /// Irradiance of the cloud's top, relative, before and after blurring; and in between.
    pub(crate) entry: Target,
    pub(crate) blurred: Target,
    half_blurred: Target,
    /// What goes on at the base as the sun's light.
    pub(crate) beam: Target,
    /// What of it is the beam on the ground; of a single layer it is the same.
    pub(crate) ground_beam: Option<Target>,
    pub(crate) tilted: Target,
    pub(crate) entered: Target,
    pub(crate) reflected: Target,
    pub(crate) column: Target,
    pub(crate) through: Target,
    pub(crate) not_reflected: Target,
}

/// What goes on of the sun's light where no layer lies above, and their optical depth.
const OPEN_SUN: [f32; 4] = [1.0, 1.0, 1.0, 0.0];
/// A blur narrower than this, in texels, is none.
const LEAST_BLUR: f64 = 0.3;
/// Standard deviations from its middle at which a Gaussian ends.
const REACH: f64 = 3.0;
/// Taps to either side, at most.
const MOST_TAPS: i32 = 96;

impl SunMaps {
    fn new(gpu: &Gpu, grids: &Grids, alone: bool) -> Self {
        let size = [grids.sun_texels; 2];
        let single = |label| gpu.texture(label, size, 1, 1);
        let levels = grids.level() + 1;
        let colours = |label| gpu.texture(label, size, 4, levels as u32);
        Self {
            entry: single("entry"),
            blurred: single("blurred"),
            half_blurred: single("half_blurred"),
            beam: colours("beam"),
            ground_beam: (!alone).then(|| colours("ground_beam")),
            tilted: colours("tilted"),
            entered: colours("entered"),
            reflected: colours("reflected"),
            column: gpu.texture("column", size, 4, 1),
            through: colours("through"),
            not_reflected: colours("not_reflected"),
        }
    }

    /// The sun's beam on the ground below, as far as this layer and those above leave it.
    pub(crate) fn on_ground(&self) -> &Target {
        self.ground_beam.as_ref().unwrap_or(&self.beam)
    }

    /// Where blurred entry lies: a blur of nothing is not made.
    pub(crate) fn entering(&self, blur_texels: f64) -> &Target {
        if blur_texels < LEAST_BLUR { &self.entry } else { &self.blurred }
    }

    /// Those that the host reads.
    fn averaged(&self) -> [&Target; 7] {
        let Self { beam, tilted, entered, reflected, through, not_reflected, .. } = self;
        [beam, tilted, entered, reflected, through, not_reflected, self.on_ground()]
    }
}

/// A blur along one axis, (1, 0) or (0, 1), of a standard deviation above 0 in texels.
pub fn blur(axis: [i32; 2], sigma_texels: f64) -> Blur {
    let radius = ((REACH * sigma_texels).ceil() as i32).min(MOST_TAPS);
    Blur { axis, radius, sharpness: (0.5 / (sigma_texels * sigma_texels)) as f32 }
}

/// Maps of all layers, lowest first.
pub(crate) fn maps(gpu: &Gpu, inputs: &LightInputs<'_>, deadline: Option<Instant>) -> Result<Vec<SunMaps>, GpuError> {
    let open = gpu.texture_from("open sun", [1, 1], 4, &OPEN_SUN);
    let alone = inputs.layers.len() == 1;
    let maps: Vec<SunMaps> = inputs.layers.iter().map(|_| SunMaps::new(gpu, inputs.grids, alone)).collect();
    let mut all = Vec::new();
    for (i, layer) in inputs.layers.iter().enumerate().rev() {
        let above = maps.get(i + 1).map_or([&open; 2], |above| [&above.beam, above.on_ground()]);
        all.extend(passes(gpu, layer, &maps[i], above, inputs.grids));
    }
    gpu.run("sunlight", deadline, &all)?;
    Ok(maps)
}

/// What the light of a lattice is made from, and where it goes.
fn lattice_binds(
    gpu: &Gpu,
    layer: &LayerInputs<'_>,
    maps: &SunMaps,
    lattice: &LatticeMaps,
    above: &Target,
) -> Vec<Bind> {
    let upload = |label, map: &HostMap| gpu.texture_from(label, [map.width, map.height], map.channels, &map.data);
    binds![
        layer.frame,
        &gpu.uniform("lattice", &lattice.light),
        &layer.field.thickness,
        &layer.field.bounds,
        &layer.tables.transmittance,
        &layer.tables.reflectance,
        &upload("lattice_down", &lattice.down),
        &upload("lattice_up", &lattice.up),
        &upload("lattice_factors", &lattice.factors),
        &above.levels[0],
        &gpu.repeat,
        &gpu.clamp,
        &maps.beam.levels[0],
        &maps.tilted.levels[0],
        &maps.entered.levels[0],
        &maps.reflected.levels[0],
    ]
}

fn passes(gpu: &Gpu, layer: &LayerInputs<'_>, maps: &SunMaps, above: [&Target; 2], grids: &Grids) -> Vec<Pass> {
    let [above, above_beam] = above;
    let size = [grids.sun_texels; 2];
    let (frame, tables) = (layer.frame, layer.tables);
    let (thickness, bounds) = (&layer.field.thickness, &layer.field.bounds);
    let (repeat, clamp) = (&gpu.repeat, &gpu.clamp);
    let mut passes = Vec::new();
    let mut add = |shader, binds| passes.push(Pass::new(shader, size, binds));
    let of = |shaders| layer.field.shader(shaders);
    if let Some(lattice) = &layer.lattice {
        add(
            of([&shaders::LATTICE_LIGHT, &shaders::LATTICE_LIGHT_COLUMNS]),
            lattice_binds(gpu, layer, maps, &lattice.maps, above),
        );
    } else {
        add(
            of([&shaders::SUN_ENTRY, &shaders::SUN_ENTRY_COLUMNS]),
            binds![frame, thickness, bounds, repeat, &maps.entry.levels[0]],
        );
        if layer.blur_texels >= LEAST_BLUR {
            for (axis, from, to) in
                [([1, 0], &maps.entry, &maps.half_blurred), ([0, 1], &maps.half_blurred, &maps.blurred)]
            {
                let uniform = gpu.uniform("blur", &blur(axis, layer.blur_texels));
                add(&shaders::BLUR, binds![&uniform, from, &to.levels[0]]);
            }
        }
        let base_light = binds![
            frame,
            thickness,
            bounds,
            &tables.transmittance,
            &tables.reflectance,
            &maps.entry,
            maps.entering(layer.blur_texels),
            &above.levels[0],
            repeat,
            clamp,
            &maps.beam.levels[0],
            &maps.tilted.levels[0],
            &maps.entered.levels[0],
            &maps.reflected.levels[0],
        ];
        add(of([&shaders::BASE_LIGHT, &shaders::BASE_LIGHT_COLUMNS]), base_light);
    }
    if let Some(beam) = &maps.ground_beam {
        let transmittance = &tables.transmittance;
        let binds =
            binds![frame, thickness, bounds, transmittance, &above_beam.levels[0], repeat, clamp, &beam.levels[0]];
        add(of([&shaders::BASE_BEAM, &shaders::BASE_BEAM_COLUMNS]), binds);
    }
    let base_column = binds![
        frame,
        thickness,
        &tables.transmittance,
        &tables.diffuse,
        repeat,
        clamp,
        &maps.column.levels[0],
        &maps.through.levels[0],
        &maps.not_reflected.levels[0],
    ];
    add(&shaders::BASE_COLUMN, base_column);
    // The last is one of the others where there is one layer.
    let averaged = maps.averaged();
    for target in &averaged[..averaged.len() - usize::from(maps.ground_beam.is_none())] {
        for level in 1..target.levels.len() {
            let binds = binds![&target.levels[level - 1], &target.levels[level]];
            passes.push(Pass::new(&shaders::DOWNSAMPLE, target.level_size(level), binds));
        }
    }
    passes
}

/// The maps on the exchange grid.
pub(crate) fn read(
    gpu: &Gpu,
    maps: &[SunMaps],
    grids: &Grids,
    deadline: Option<Instant>,
) -> Result<Vec<ColumnMaps>, GpuError> {
    let level = grids.level();
    let wanted: Vec<(&Target, usize)> =
        maps.iter().flat_map(|maps| maps.averaged().map(|target| (target, level))).collect();
    let mut read = gpu.read_maps(&wanted, deadline)?.into_iter();
    let mut next = || read.next().map_or_else(Vec::new, |map: HostMap| texels(&map, grids));
    Ok(maps
        .iter()
        .map(|_| ColumnMaps {
            beam: next(),
            tilted: next(),
            entered: next(),
            reflected: next(),
            through: next(),
            not_reflected: next(),
            ground_beam: next(),
        })
        .collect())
}

/// Texels on the exchange grid; a map of one texel is the same everywhere.
fn texels(map: &HostMap, grids: &Grids) -> Vec<[f32; 4]> {
    let count = (grids.exchange_texels * grids.exchange_texels) as usize;
    let texels: Vec<[f32; 4]> = map.data.as_chunks().0.to_vec();
    match texels.first() {
        Some(only) if texels.len() == 1 => vec![*only; count],
        _ => texels,
    }
}

/// What each layer gets of the sun: seen from below, and from above.
pub(crate) fn shares(
    gpu: &Gpu,
    inputs: &LightInputs<'_>,
    maps: &[SunMaps],
    shares: &[Share],
    deadline: Option<Instant>,
) -> Result<Vec<[Target; 2]>, GpuError> {
    let open = gpu.texture_from("open sun", [1, 1], 4, &OPEN_SUN);
    let size = [inputs.grids.sun_texels; 2];
    let targets: Vec<[Target; 2]> =
        maps.iter().map(|_| ["share_below", "share_above"].map(|label| gpu.texture(label, size, 4, 1))).collect();
    let pass = |(i, (layer, own)): (usize, (&LayerInputs<'_>, &SunMaps))| {
        let above = maps.get(i + 1).map_or([&open; 2], |above| [&above.beam, above.on_ground()]);
        let binds = binds![
            layer.frame,
            &gpu.uniform("share", &shares[i]),
            &own.beam,
            &own.tilted,
            &own.entered,
            &own.column,
            &own.reflected,
            &above[0].levels[0],
            &above[1].levels[0],
            &gpu.repeat,
            &targets[i][0].levels[0],
            &targets[i][1].levels[0],
        ];
        Pass::new(&shaders::SUN_SHARE, size, binds)
    };
    gpu.run("sun_share", deadline, &inputs.layers.iter().zip(maps).enumerate().map(pass).collect::<Vec<_>>())?;
    Ok(targets)
}
