//! Every stage's input and output for one request: what tests compare with the twins in `reference`.

use super::pipeline::{Pipeline, Run};
use crate::exchange::stack::LayerLight;
use crate::field::{self, FieldStages};
use crate::gpu::layout::{Backdrop, Disc, Frame, Share, SkyView, View};
use crate::gpu::{HostMap, PassRecord, Target};
use crate::job::{Job, RenderError, Watch};
use crate::light::{ColumnMaps, Energy, LatticeMaps};
use crate::shade::{SkyAir, SkyClouds};
use crate::slice::{self, HostSlab, HostTables};
use crate::sun_rays::SunRays;
use std::sync::{Arc, PoisonError};

/// Results of the stages of one layer: the request's, or the lowest.
#[derive(Debug, Clone)]
pub struct Stages {
    /// The layer at the moment.
    pub frame: Frame,
    /// Rays from the ground towards the sun's disc.
    pub disc: Disc,
    /// The same rays, each followed by itself.
    pub followed: Disc,
    /// The passes that made the thickness, if any did.
    pub field: Option<FieldStages>,
    /// Thickness, metres.
    pub thickness: HostMap,
    /// Least and greatest thickness of blocks of texels, metres.
    pub bounds: HostMap,
    /// How far entering light is blurred: standard deviation, texels of the maps of sunlight.
    pub blur_texels: f64,
    /// Irradiance of the cloud's top, relative.
    pub entry: HostMap,
    /// The same as light by entry takes it: blurred, where that is not narrower than a texel.
    pub entering: HostMap,
    /// What goes on from the layer above as the sun's light; one texel under the open sun.
    pub above: HostMap,
    /// And of it what is the beam on the ground; fourth channel: optical depth of transport of the layers above.
    pub above_beam: HostMap,
    /// What a lattice has found, where that is how sunlight is carried.
    pub lattice: Option<LatticeMaps>,
    /// What goes on at the base as the sun's light; fourth channel: red light sent up along slanted rays.
    pub beam: HostMap,
    /// What of it is the beam on the ground, where there are several layers.
    pub ground_beam: Option<HostMap>,
    /// Diffuse light at the base along slanted rays; fourth channel: green light sent up.
    pub tilted: HostMap,
    /// Diffuse light at the base by entry; fourth channel: blue light sent up.
    pub entered: HostMap,
    /// Light sent up by entry; fourth channel: what enters, relative.
    pub reflected: HostMap,
    /// Transmitted part of the sun's light by columns.
    pub column: HostMap,
    /// Transmitted part of even light.
    pub through: HostMap,
    /// Part of even light that the cloud does not send back.
    pub not_reflected: HostMap,
    /// Those of all layers that the host took, on the exchange grid, lowest first.
    pub columns: Vec<ColumnMaps>,
    /// How the maps are put together.
    pub share: Share,
    /// The sun's light relative to a slab's under the open sun, seen from below and from above; fourth channel: optical
    /// depth of transport of the layers above.
    pub shares: [HostMap; 2],
    /// Albedo of the ground on the exchange grid.
    pub albedo: HostMap,
    /// Light that arrives at the layer but for the sun's.
    pub light: LayerLight,
    /// Diffuse irradiance of the ground on the exchange grid.
    pub gathered: HostMap,
    /// Where the light goes.
    pub energy: Energy,
    /// Closure of the orders for this sun, whatever the method.
    pub closure: HostMap,
    /// What the plan's method of slab light keeps for this sun.
    pub slab: Option<HostSlab>,
    /// Tables of the mix.
    pub tables: Arc<HostTables>,
    /// The view.
    pub view: View,
    /// What the passes of a sky took and gave, if one was asked for.
    pub sky: Option<SkyStages>,
    /// The texture asked for, before what a request asks of finished texels.
    pub output: Vec<f32>,
    /// The passes that ran, in their order, each with its own time.
    pub passes: Vec<PassRecord>,
}

/// What the passes of a sky took and gave.
#[derive(Debug, Clone)]
pub struct SkyStages {
    /// The view, as all of its rows.
    pub view: SkyView,
    /// What lies behind the clouds.
    pub backdrop: Backdrop,
    /// Thickness of the layers that are seen, lowest first: all mip levels of each.
    pub levels: Vec<Vec<HostMap>>,
    /// The texels of the ground.
    pub ground_view: View,
    /// The ground's albedo at them.
    pub albedo: HostMap,
    /// Irradiance there, three colours.
    pub irradiance: Vec<f32>,
    /// Radiance of the ground, all mip levels.
    pub ground: Vec<HostMap>,
    /// Air from the eye to space, and to the ground.
    pub air: [SkyAir; 2],
    /// The clouds.
    pub clouds: SkyClouds,
}

fn whole(rays: &SunRays) -> Disc {
    rays.parts(usize::MAX).first().copied().unwrap_or_default()
}

/// Reads the stages of a run back.
pub(super) fn read(
    pipeline: &mut Pipeline,
    job: &Job,
    watch: &Watch,
    run: Run,
    passes: Vec<PassRecord>,
) -> Result<Stages, RenderError> {
    let number = job.request().wanted.layer().unwrap_or(0) as usize;
    let deadline = watch.deadline;
    let source = pipeline.source(job, number, watch)?;
    let gpu = &pipeline.gpu;
    let (scene, time_s) = (job.scene(), job.request().time_s);
    let offsets = field::offsets(&scene.layers[number], time_s, scene.extent_m());
    let field_stages = {
        let mut source = source.lock().unwrap_or_else(PoisonError::into_inner);
        source.inspect(gpu, time_s, offsets.made, deadline)?
    };
    let (moment, field, mix) = (&run.moment, &run.fields[number], &job.tables()[number]);
    let blur_texels = moment.layers[number].blur_texels;
    let tables = &run.tables[number].host;
    let cosine = moment.slant_cosine();
    let slab = |method| HostSlab::new(method, mix, tables.ratio, cosine);
    let lit = run.lit.ok_or(RenderError::Defect("the stages of the light were not kept"))?;
    let (maps, own) = (&lit.maps[number], &lit.light.layers[number]);
    let map = |target: &Target| gpu.read_map(target, 0, deadline);
    let colours = |target: &Target| {
        let texels = map(target)?.data;
        Ok::<_, RenderError>(texels.chunks(4).map(|texel| [texel[0], texel[1], texel[2]]).collect::<Vec<_>>())
    };
    let open = || HostMap { width: 1, height: 1, channels: 4, data: vec![1.0, 1.0, 1.0, 0.0] };
    Ok(Stages {
        frame: run.frames[number],
        disc: whole(&moment.layers[number].rays),
        followed: whole(&moment.layers[number].rays.followed()),
        field: field_stages,
        thickness: map(&field.thickness)?,
        bounds: map(&field.bounds)?,
        blur_texels,
        entry: map(&maps.entry)?,
        entering: map(maps.entering(blur_texels))?,
        above: lit.maps.get(number + 1).map_or_else(|| Ok(open()), |above| map(&above.beam))?,
        above_beam: lit.maps.get(number + 1).map_or_else(|| Ok(open()), |above| map(above.on_ground()))?,
        lattice: lit.lattices[number].as_deref().map(|lattice| lattice.maps.in_air(lit.shares[number].in_air)),
        beam: map(&maps.beam)?,
        ground_beam: maps.ground_beam.as_ref().map(map).transpose()?,
        tilted: map(&maps.tilted)?,
        entered: map(&maps.entered)?,
        reflected: map(&maps.reflected)?,
        column: map(&maps.column)?,
        through: map(&maps.through)?,
        not_reflected: map(&maps.not_reflected)?,
        share: lit.shares[number],
        shares: [map(&own.share[0])?, map(&own.share[1])?],
        albedo: lit.albedo,
        light: LayerLight { from_above: colours(&own.from_above[1])?, from_below: colours(&own.from_below)? },
        gathered: map(&lit.light.gathered)?,
        energy: lit.light.energy,
        closure: slice::closure(mix, tables.ratio, cosine),
        slab: moment.plan.slab.map(slab),
        tables: Arc::clone(tables),
        view: run.view,
        sky: run.sky,
        output: run.texels.data,
        passes,
        columns: lit.columns,
    })
}
