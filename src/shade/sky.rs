//! The whole sky from an eye: clouds along each ray, and what lies behind them.

use super::cumulus::CumulusInputs;
use super::ground::{Beams, GroundSun, on_the_ground};
use super::inputs::{DrawnOn, Inputs, LayerInputs, cloud_binds, early, held};
use super::tiles::{self, TILE};
use crate::air_map::AirMap;
use crate::disc::Disc;
use crate::field::Levels;
use crate::gpu::layout::{AirColours, Backdrop, SkyView, View};
use crate::gpu::shaders::Shader;
use crate::gpu::{Bind, Gpu, GpuError, HostMap, Pass, Target, binds, shaders};
use crate::projection::Sphere;
use crate::request::TextureKind;
use std::sync::Arc;
use std::time::Instant;

/// A layer that is seen.
pub(crate) struct SkyLayer<'a> {
    pub(crate) inputs: LayerInputs<'a>,
    pub(crate) levels: Arc<Levels>,
    pub(crate) base_m: f64,
    pub(crate) top_m: f64,
    /// Air between the eye and the layer, for rays that sink to it and that rise to it; `None` where air hides what such rays
    /// show.
    pub(crate) before: [Option<Arc<DeviceAir>>; 2],
}

/// Cumulus that is seen.
pub(crate) struct SkyCumulus<'a> {
    pub(crate) inputs: &'a CumulusInputs,
    /// As of a layer.
    pub(crate) before: [Option<Arc<DeviceAir>>; 2],
}

/// A map of air on the device.
pub(crate) struct DeviceAir {
    pub(crate) map: Target,
    /// How aerosol scatters, the same for all maps of an eye; and that on the device.
    pub(crate) colours: AirColours,
    bound_colours: wgpu::Buffer,
    /// Elevation of its horizon, radians.
    pub(crate) horizon: f64,
}

impl DeviceAir {
    pub(crate) fn new(gpu: &Gpu, air: &AirMap) -> Self {
        let HostMap { width, height, channels, data } = &air.map;
        let bound_colours = gpu.uniform("air colours", &air.colours);
        let map = gpu.texture_from("air", [*width, *height], *channels, data);
        Self { map, colours: air.colours, bound_colours, horizon: air.horizon }
    }

    /// What a pass made of it.
    pub(crate) fn read(&self, gpu: &Gpu, deadline: Option<Instant>) -> Result<SkyAir, GpuError> {
        Ok(SkyAir { map: gpu.read_map(&self.map, 0, deadline)?, colours: self.colours })
    }
}

/// What a sky is made from.
pub(crate) struct SkyInputs<'a> {
    pub(crate) sphere: &'a Sphere,
    /// The layers that are seen, lowest first.
    pub(crate) layers: Vec<SkyLayer<'a>>,
    /// With the number of layers that are seen below it.
    pub(crate) cumulus: Option<(usize, SkyCumulus<'a>)>,
    pub(crate) ground: Arc<GroundLit>,
    pub(crate) backdrop: Backdrop,
    /// Air from the eye to space, and to the ground.
    pub(crate) air: [Arc<DeviceAir>; 2],
    /// The sun's disc, where it is to be drawn.
    pub(crate) disc: Option<Disc>,
}

/// The ground, and what its radiance was made from.
pub(crate) struct GroundLit {
    /// Radiance, with mip levels.
    pub(crate) radiance: Target,
    /// Downward, three colours of each texel.
    pub(crate) irradiance: wgpu::Buffer,
}

impl GroundLit {
    /// Bytes on the device.
    pub(crate) fn size(&self) -> u64 {
        self.radiance.size() + self.irradiance.size()
    }
}

/// A map of air as a pass had it: for tests.
#[derive(Debug, Clone, PartialEq)]
pub struct SkyAir {
    /// The map.
    pub map: HostMap,
    /// How aerosol scatters.
    pub colours: AirColours,
}

/// What lies between the passes of a sky: for tests.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SkyClouds {
    /// The passes of the clouds in their order, each with the view that it took.
    pub passes: Vec<SkyView>,
    /// Air before the layer of each.
    pub air: Vec<SkyAir>,
    /// Radiance of all clouds, premultiplied, and alpha.
    pub texels: Vec<f32>,
}

/// Light that falls on the ground: through the clouds, or the same everywhere.
pub(crate) enum OnGround<'a> {
    Through(&'a Inputs<'a>, &'a GroundSun),
    Even([f64; 3]),
}

/// Radiance of the ground: a map of the domain with mip levels, as fine as `albedo`, whose side is a power of two.
pub(crate) fn ground_radiance(
    gpu: &Gpu,
    light: &OnGround<'_>,
    view: &View,
    albedo: &HostMap,
    deadline: Option<Instant>,
) -> Result<GroundLit, GpuError> {
    let [across, down] = view.size;
    let texels = across as usize * down as usize;
    let mut passes = Vec::new();
    let irradiance = match light {
        OnGround::Even(light) => gpu.storage_from("irradiance", &light.map(|value| value as f32).repeat(texels)),
        OnGround::Through(inputs, sun) => {
            let output = gpu.storage("irradiance", 3 * texels);
            let made = on_the_ground(gpu, TextureKind::Irradiance, inputs, Some(Beams::only(sun)), view, &output);
            passes.extend(made.ok_or_else(|| early("the ground"))?);
            output
        }
    };
    let levels = across.min(down).ilog2() + 1;
    let ground = gpu.texture("ground", view.size, 4, levels);
    let albedo = gpu.texture_from("albedo", [albedo.width, albedo.height], 4, &albedo.data);
    let binds = binds![&gpu.uniform("view", view), &albedo, &gpu.repeat, &irradiance, &ground.levels[0]];
    passes.push(Pass::new(&shaders::SKY_GROUND, view.size, binds));
    for (level, pair) in (1..).zip(ground.levels.windows(2)) {
        passes.push(Pass::new(&shaders::DOWNSAMPLE, ground.level_size(level), binds![&pair[0], &pair[1]]));
    }
    gpu.run("ground", deadline, &passes)?;
    Ok(GroundLit { radiance: ground, irradiance })
}

/// Makes one band of a sky: `view.rows` rows from `view.first_row`. What lies between its passes is added to `kept`.
pub(crate) fn sky_band(
    gpu: &Gpu,
    inputs: &SkyInputs<'_>,
    view: &SkyView,
    kept: Option<&mut SkyClouds>,
    deadline: Option<Instant>,
) -> Result<Vec<f32>, GpuError> {
    let texels = view.size[0] as usize * view.rows as usize;
    let (clouds, output) = (gpu.storage("clouds", 4 * texels), gpu.storage("output", 3 * texels));
    let together = inputs.layers.len() > 1;
    let held = held(gpu, together, texels);
    let tiles = tiles::tiles(inputs.sphere, view.size, view.first_row, view.rows);
    let eye_m = inputs.sphere.eye[2];
    let (mut passes, mut views) = (Vec::new(), Vec::new());
    // As a ray meets them: sinking from the highest layer to the lowest, then rising again.
    let mut upwards: Vec<Seen<'_, '_>> = inputs.layers.iter().map(Seen::Layer).collect();
    if let Some((below, cumulus)) = &inputs.cumulus {
        upwards.insert(*below, Seen::Cumulus(cumulus));
    }
    let sinking = upwards.iter().rev().map(|seen| (seen, false));
    for (seen, rising) in sinking.chain(upwards.iter().map(|seen| (seen, true))) {
        let layer = match seen {
            Seen::Layer(layer) => layer,
            Seen::Cumulus(cumulus) => {
                passes.extend(cumulus_pass(gpu, inputs, cumulus, rising, view, &tiles, [&clouds, &held])?);
                continue;
            }
        };
        let Some(before) = &layer.before[usize::from(rising)] else { continue };
        let look = look(inputs, layer, view, rising);
        let meets = |up: &_| tiles::meets(up, eye_m, layer.base_m, layer.top_m, rising);
        let shown = tiles::parted(&tiles, meets, |tile| look.is_plain(tile));
        let edge = -tiles::dip(eye_m, if rising { 0.0 } else { layer.top_m }) as f32;
        let horizon = before.horizon as f32;
        let view = SkyView { rising: rising.into(), edge, horizon, together: together.into(), ..*view };
        views.push((view, before));
        let last = if rising { inputs.layers.last() } else { inputs.layers.first() };
        let light = last.and_then(|last| last.inputs.light).ok_or_else(|| early("sky"))?;
        // With other layers below the eye their light is all that the eye gets of them by way of this one.
        let hidden = |other: &SkyLayer<'_>| other.base_m < layer.base_m && other.top_m > eye_m;
        let first = rising && !inputs.layers.iter().any(hidden);
        let drawn_on = DrawnOn { texels: &clouds, behind: light.beyond(!rising), held: &held, first };
        let pass = cloud_passes(gpu, layer, before, &gpu.uniform("view", &view), rising, &shown, &drawn_on);
        passes.extend(pass.ok_or_else(|| early("sky"))?);
    }
    let (backdrop, bound) = (gpu.uniform("backdrop", &inputs.backdrop), gpu.uniform("view", view));
    let rise = tiles::most_rise(inputs.sphere, view);
    let meets = |up: &_| tiles::meets_ground(up, eye_m);
    let below = tiles::parted(&tiles, meets, |tile| tiles::shows_ground(tile, eye_m, rise));
    passes.extend(over_parts(gpu, &shaders::SKY, &below, |tiles| {
        let mut binds = binds![&backdrop, &bound, &inputs.ground.radiance, &gpu.trilinear];
        binds.extend(binds![&inputs.air[0].map, &inputs.air[1].map, &gpu.clamp, &clouds, tiles, &output]);
        binds.extend(binds![&inputs.air[0].bound_colours]);
        binds
    }));
    let above = tiles::names(&tiles, |up| !tiles::meets_ground(up, eye_m));
    passes.extend(over(gpu, &shaders::SKY_ABOVE, &above, |tiles| {
        binds![
            &backdrop,
            &bound,
            &inputs.air[0].map,
            &gpu.clamp,
            &clouds,
            tiles,
            &output,
            &inputs.air[0].bound_colours,
        ]
    }));
    gpu.run("sky", deadline, &passes)?;
    if let Some(kept) = kept {
        kept.passes = views.iter().map(|(view, _)| *view).collect();
        let read = |(_, before): &(SkyView, &Arc<DeviceAir>)| before.read(gpu, deadline);
        kept.air = views.iter().map(read).collect::<Result<_, _>>()?;
        kept.texels.extend(gpu.read(&clouds, 4 * texels, deadline)?);
    }
    let mut light = gpu.read(&output, 3 * texels, deadline)?;
    let shown = |disc: &Disc| disc.texels(inputs.sphere, view.size, view.first_row, view.rows);
    let disc = inputs.disc.as_ref().map(shown).unwrap_or_default();
    if !disc.is_empty() {
        let clouds = gpu.read(&clouds, 4 * texels, deadline)?;
        for (texel, radiance) in disc {
            let left = 1.0 - f64::from(clouds[4 * texel + 3]);
            for (value, added) in light[3 * texel..3 * texel + 3].iter_mut().zip(radiance) {
                *value = (f64::from(*value) + left * added) as f32;
            }
        }
    }
    Ok(light)
}

/// What a ray meets.
enum Seen<'a, 'b> {
    Layer(&'a SkyLayer<'b>),
    Cumulus(&'a SkyCumulus<'b>),
}

fn cumulus_pass(
    gpu: &Gpu,
    inputs: &SkyInputs<'_>,
    cumulus: &SkyCumulus<'_>,
    rising: bool,
    view: &SkyView,
    tiles: &[tiles::Tile],
    [clouds, held]: [&wgpu::Buffer; 2],
) -> Result<Option<Pass>, GpuError> {
    let Some(before) = &cumulus.before[usize::from(rising)] else { return Ok(None) };
    let (frame, eye_m) = (&cumulus.inputs.frame, inputs.sphere.eye[2]);
    let (low_m, top_m) = (f64::from(frame.low_m), f64::from(frame.top_m));
    let shown = tiles::names(tiles, |up| tiles::meets(up, eye_m, low_m, top_m, rising));
    let view = SkyView {
        rising: rising.into(),
        horizon: before.horizon as f32,
        together: (inputs.layers.len() > 1).into(),
        ..*view
    };
    let (shader, mut binds) = cumulus.inputs.on_sky(gpu).ok_or_else(|| early("cumulus"))?;
    Ok(over(gpu, shader, &shown, |tiles| {
        binds.extend(binds![&gpu.uniform("view", &view), &before.map, &gpu.clamp, tiles, clouds, held]);
        binds.extend(binds![&before.bound_colours]);
        binds
    }))
}

/// A pass over some tiles, if there are any.
fn over(
    gpu: &Gpu,
    shader: &'static Shader,
    tiles: &[u32],
    binds: impl FnOnce(&wgpu::Buffer) -> Vec<Bind>,
) -> Option<Pass> {
    let size = [TILE * tiles.len() as u32, TILE];
    (!tiles.is_empty()).then(|| Pass::new(shader, size, binds(&gpu.storage_from("tiles", tiles))))
}

/// The passes over tiles that are plain, and over others.
fn over_parts(
    gpu: &Gpu,
    shader: &'static Shader,
    [plain, others]: &[Vec<u32>; 2],
    binds: impl Fn(&wgpu::Buffer) -> Vec<Bind>,
) -> Vec<Pass> {
    let plain = over(gpu, shader.plain().unwrap_or(shader), plain, &binds);
    plain.into_iter().chain(over(gpu, shader, others, &binds)).collect()
}

fn look(inputs: &SkyInputs<'_>, layer: &SkyLayer<'_>, view: &SkyView, rising: bool) -> tiles::Look {
    let map = &layer.levels.map;
    tiles::Look {
        eye_m: inputs.sphere.eye[2],
        base_m: layer.base_m,
        top_m: layer.top_m,
        rising,
        per_metre: f64::from(map.width.max(map.height)) / f64::from(inputs.backdrop.extent_m),
        texels_per_ray: view.texels_per_ray.into(),
        rise: tiles::most_rise(inputs.sphere, view),
        sun: inputs.backdrop.sun.map(f64::from).into(),
    }
}

fn cloud_passes(
    gpu: &Gpu,
    layer: &SkyLayer<'_>,
    air: &DeviceAir,
    view: &wgpu::Buffer,
    rising: bool,
    tiles: &[Vec<u32>; 2],
    drawn_on: &DrawnOn<'_>,
) -> Option<Vec<Pass>> {
    let (tables, method) = (layer.inputs.tables?, layer.inputs.method?);
    let shape = binds![&layer.levels.map, &gpu.trilinear];
    let shared = cloud_binds(gpu, &layer.inputs, view, shape, !rising, drawn_on)?;
    let (field, lattice) = (layer.inputs.field, layer.inputs.light.and_then(|light| light.lattice.as_ref()));
    let shader = lattice.map_or_else(|| method.sky_shader(field), |_| method.sky_lattice_shader(field));
    Some(over_parts(gpu, shader, tiles, |tiles| {
        let mut shared = shared.clone();
        shared.extend(binds![tiles, &air.map, &air.bound_colours]);
        shared.extend(method.binds(gpu, tables, !rising));
        shared.extend(lattice.map(|lattice| lattice.binds(gpu)).into_iter().flatten());
        shared
    }))
}
