//! The stages in order, and what of them stays on the device between requests. Every texture goes this one way; tests look at
//! the same run.

use super::bands::{Shading, bands};
use super::cumulus_kept::CumulusKept;
use super::drawn::{cumulus_place, drawn};
use super::file::check_eye;
use super::kept::{Kept, Results, shrink};
use super::keys::{BeamKey, FieldKey, LightKey, MixKey, SlabKey, SourceKey};
use super::lattices_kept::LatticesKept;
use super::shared::SharedClouds;
use super::sky::{SkyJob, SkyKept};
use super::stages::SkyStages;
use crate::encode::TexelLayer;
use crate::field::{self, ColumnMap, Field, Given, Source};
use crate::frame;
use crate::gpu::layout::{Frame, View};
use crate::gpu::{Gpu, HostMap};
use crate::ground::GroundMap;
use crate::image::MissingImage;
use crate::job::{Job, RenderError, Watch};
use crate::light::{self, LatticeLit, Light, LightInputs, Lit};
use crate::method::{Reference, SlabMethod};
use crate::moment::{Moment, has_flat_rays};
use crate::plan::field_resolution;
use crate::projection::Projection;
use crate::scene::{GroundAlbedo, Thickness};
use crate::shade::{self, GroundSun, SlabLight};
use crate::slab::angles::AngleSlice;
use crate::slice::{DeviceTables, HostSlab, HostTables};
use crate::traced::{self, Traced};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Scenes, suns and moments whose results stay on the device.
const KEPT: usize = 8;
/// What moving fields are made from, which for the finest takes most of a gigabyte each: one scene of four layers.
const KEPT_SOURCES: usize = 4;
/// The same of the sun's beam on the ground, 64 MiB at most each: shadow and irradiance of a moment follow one another, and four are the largest texture.
const KEPT_BEAMS: usize = 4;

/// Tables of a droplet mix, as textures.
#[derive(Clone)]
pub(super) struct Tables {
    pub(super) host: Arc<HostTables>,
    pub(super) device: Arc<DeviceTables>,
}

/// A device, and what is kept on it.
pub(super) struct Pipeline {
    pub(super) gpu: Gpu,
    tables: Kept<MixKey, Tables>,
    sources: Kept<SourceKey, Arc<Mutex<Source>>>,
    fields: Kept<FieldKey, Arc<Field>>,
    slabs: Kept<SlabKey, SlabLight>,
    lattices: LatticesKept,
    lights: Kept<LightKey, Arc<Light>>,
    beams: Kept<BeamKey, Arc<Vec<GroundSun>>>,
    skies: SkyKept,
    cumulus: CumulusKept,
    /// Thicknesses of layers above and below cumulus, as the host reads them.
    decks: Kept<FieldKey, Arc<HostMap>>,
}

/// What a run leaves behind: its texels, and the stages that led to them.
pub(super) struct Run {
    pub(super) texels: Texels,
    pub(super) fields: Vec<Arc<Field>>,
    pub(super) moment: Moment,
    pub(super) frames: Vec<Frame>,
    pub(super) view: View,
    /// One a layer, where they were needed.
    pub(super) tables: Vec<Tables>,
    /// The light with what lies between its passes, where that was to be kept.
    pub(super) lit: Option<Lit>,
    /// What lies between the passes of a sky, where that was to be kept.
    pub(super) sky: Option<SkyStages>,
}

/// Texels before what a request asks of finished ones.
pub(super) struct Texels {
    pub(super) data: Vec<f32>,
    pub(super) standard_error: Option<Vec<f32>>,
    pub(super) layers: Vec<TexelLayer>,
}

impl Texels {
    /// Without errors and layers.
    pub(super) fn plain(data: Vec<f32>) -> Self {
        Self { data, standard_error: None, layers: Vec::new() }
    }
}

impl From<Traced> for Texels {
    fn from(traced: Traced) -> Self {
        Self { data: traced.data, standard_error: Some(traced.standard_error), layers: traced.layers }
    }
}

/// Whether the results of all stages are wanted, or only what the texture takes.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Keep {
    Texels,
    Stages,
}

/// Stage times.
#[derive(Default)]
pub(super) struct Clock {
    pub(super) timings: Vec<(&'static str, Duration)>,
}

impl Clock {
    pub(super) fn time<T, E>(&mut self, stage: &'static str, work: impl FnOnce() -> Result<T, E>) -> Result<T, E> {
        let start = Instant::now();
        let result = work()?;
        self.timings.push((stage, start.elapsed()));
        Ok(result)
    }
}

impl Pipeline {
    pub(super) fn new(gpu: Gpu, shared: SharedClouds) -> Self {
        Self {
            gpu,
            tables: Kept::new(KEPT),
            sources: Kept::sized(KEPT_SOURCES, |source| source.lock().unwrap_or_else(PoisonError::into_inner).size()),
            fields: Kept::sized(KEPT, |field| field.size()),
            slabs: Kept::new(KEPT),
            lattices: LatticesKept::new(KEPT, shared.clone()),
            lights: Kept::sized(KEPT, |light| light.size()),
            beams: Kept::sized(KEPT_BEAMS, |suns| suns.iter().map(GroundSun::size).sum()),
            skies: SkyKept::new(),
            cumulus: CumulusKept::new(shared),
            decks: Kept::sized(KEPT_SOURCES, |map| size_of_val(map.data.as_slice()) as u64),
        }
    }

    /// Results of earlier runs that may be large.
    fn results(&mut self) -> Vec<&mut dyn Results> {
        let Self { sources, fields, lattices, lights, beams, skies, cumulus, decks, .. } = self;
        let mut all: Vec<&mut dyn Results> = vec![sources, fields, lights, beams, decks];
        all.extend(lattices.results().into_iter().chain(skies.results()).chain(cumulus.results()));
        all
    }

    /// Bytes of the results of earlier runs.
    pub(super) fn kept_bytes(&mut self) -> u64 {
        self.results().iter().map(|results| results.size()).sum()
    }

    /// Keeps no more of them than so many bytes.
    pub(super) fn shrink(&mut self, bytes: u64) {
        shrink(&mut self.results(), bytes);
    }

    /// Makes the texels of a job: of a sky, or of a scene that has clouds.
    pub(super) fn run(&mut self, job: &Job, watch: &Watch, keep: Keep, clock: &mut Clock) -> Result<Run, RenderError> {
        watch.look()?;
        let (request, needs, all) = (job.request(), job.request().texture().needs(), keep == Keep::Stages);
        let fields = clock.time("field", || self.fields(job, watch))?;
        let moment = Moment::new(job, &fields);
        check_eye(job, |side| moment.plane_m(side))?;
        let size = request.texels(job.scene());
        let view = frame::view(&moment, &request.wanted, size);
        let frames: Vec<Frame> = (0..moment.layers.len()).map(|number| frame::frame(&moment, number)).collect();
        let mut run = Run {
            texels: Texels::plain(Vec::new()),
            fields,
            moment,
            frames,
            view,
            tables: Vec::new(),
            lit: None,
            sky: None,
        };
        let (fields, moment) = (&run.fields, &run.moment);
        if let Some(Reference { seed, .. }) = moment.plan.reference {
            let thickness = fields.iter().map(|field| self.thickness(field, watch)).collect::<Result<Vec<_>, _>>()?;
            let trace = || match request.wanted.projection() {
                None => traced::trace_ground(job, seed, moment, &thickness, watch),
                Some(Projection::Plane(plane)) => traced::trace_cloud(job, seed, &plane, moment, &thickness, watch),
                Some(Projection::Sphere(sphere)) if job.air().is_some() => match has_one_ground(job) {
                    true => traced::trace_sky(job, seed, &sphere, watch),
                    false => traced::trace_sky_among_clouds(job, seed, &sphere, moment, &thickness, watch),
                },
                Some(Projection::Sphere(sphere)) => {
                    traced::trace_cloudy_sky(job, seed, &sphere, moment, &thickness, watch)
                }
            };
            run.texels = clock.time("reference", trace)?.into();
            return Ok(run);
        }
        watch.look()?;
        if needs.light || needs.slab || needs.ground_sun || all {
            run.tables = clock.time("tables", || Ok::<_, RenderError>(self.tables(job, moment)))?;
        }
        let lit_by: Vec<wgpu::Buffer> = run.frames.iter().map(|frame| self.gpu.uniform("frame", frame)).collect();
        let mut light = None;
        if (needs.light || all) && !lit_by.is_empty() {
            let make = || self.light(job, watch, &run, &lit_by, keep);
            let (made, lit) = clock.time("light", make)?;
            light = Some(made);
            run.lit = lit;
        }
        let slabs = match run.moment.plan.slab {
            Some(slab) => clock.time("slice", || Ok::<_, RenderError>(self.slabs(job, &run, slab)))?,
            None => Vec::new(),
        };
        let clear = self.gpu.uniform("frame", &frame::clear(&run.moment));
        let below = job.scene().cumulus.as_ref().map_or(0, |cumulus| cumulus_place(job, cumulus.place()));
        let cumulus = match job.scene().cumulus {
            Some(_) => clock.time("cumulus", || {
                let lit = needs.light || needs.slab;
                let mut decks = Vec::new();
                for (number, field) in run.fields.iter().enumerate().filter(|_| lit) {
                    let read =
                        || Ok::<_, RenderError>(Arc::new(self.gpu.read_map(&field.thickness, 0, watch.deadline)?));
                    decks.push((number, self.decks.get_or(FieldKey::new(job, number), read)?));
                }
                let method = lit.then_some(run.moment.plan.cumulus);
                self.cumulus.inputs(&self.gpu, job, &run.moment, &decks, method, watch)
            })?,
            None => None,
        };
        let cumulus = cumulus.map(|(inputs, added)| {
            run.view.added = added.map(|light| light as f32);
            (below, inputs)
        });
        let cumulus_seen = job
            .scene()
            .cumulus
            .as_ref()
            .is_some_and(|cumulus| request.wanted.layer().is_none_or(|layer| layer as usize == cumulus.place()));
        let mut levels = Vec::new();
        if request.wanted.plane().is_some_and(|plane| has_flat_rays(plane.towards())) {
            for (number, field) in run.fields.iter().enumerate() {
                levels.push(self.skies.levels(&self.gpu, job, number, field, watch)?);
            }
        }
        let layer = |number: usize| shade::LayerInputs {
            frame: &lit_by[number],
            field: &run.fields[number],
            tables: run.tables.get(number).map(|tables| &*tables.device),
            method: slabs.get(number),
            light: light.as_deref().and_then(|light| light.layers.get(number)),
            levels: levels.get(number).map(|levels| &**levels),
            rays: &run.moment.layers[number].rays,
        };
        let dark = self.gpu.texture_from("gathered", [1; 2], 4, &[0.0; 4]);
        let of = |layers: Vec<usize>, with_cumulus: bool| shade::Inputs {
            layers: layers.into_iter().map(layer).collect(),
            cumulus: cumulus.as_ref().filter(|_| with_cumulus),
            clear: &clear,
            gathered: Some(light.as_deref().map_or(&dark, |light| &light.gathered)),
        };
        if let Some(sphere) = request.wanted.sphere() {
            let all = of((0..run.fields.len()).collect(), true);
            let cumulus = cumulus.as_ref().filter(|_| cumulus_seen).map(|(below, inputs)| (*below, inputs));
            let added = run.view.added;
            let seen = drawn(job).into_iter().map(|number| (number, layer(number))).collect();
            let sky = SkyJob { job, moment: &run.moment, sphere, all: &all, seen, cumulus, added, watch };
            let (data, stages) = clock.time("shade", || self.skies.texels(&self.gpu, sky, keep))?;
            run.sky = stages;
            run.texels = Texels::plain(data);
            return Ok(run);
        }
        let inputs = of(drawn(job), cumulus_seen || needs.ground_sun);
        if !job.points().is_empty() {
            let shaded = || shade::points(&self.gpu, &inputs, &run.view, job.points(), watch.deadline);
            let data = clock.time("shade", shaded)?;
            run.texels = Texels::plain(data);
            return Ok(run);
        }
        let shading = Shading { job, moment: &run.moment, inputs, view: &run.view, watch };
        let data = clock.time("shade", || bands(&self.gpu, &mut self.beams, &shading))?;
        run.texels = Texels::plain(data);
        Ok(run)
    }

    fn thickness(&self, field: &Field, watch: &Watch) -> Result<HostMap, RenderError> {
        Ok(self.gpu.read_map(&field.thickness, 0, watch.deadline)?)
    }

    /// The fields of all layers, lowest first.
    fn fields(&mut self, job: &Job, watch: &Watch) -> Result<Vec<Arc<Field>>, RenderError> {
        let (scene, time_s) = (job.scene(), job.request().time_s);
        let make = |number: usize| {
            self.fields.get_or(FieldKey::new(job, number), || {
                let source = source(&self.gpu, &mut self.sources, job, number, watch)?;
                let mut source = source.lock().unwrap_or_else(PoisonError::into_inner);
                let offsets = field::offsets(&scene.layers[number], time_s, scene.extent_m());
                Ok(Arc::new(source.at(&self.gpu, time_s, offsets.made, watch.deadline)?))
            })
        };
        (0..scene.stratiform_count()).map(make).collect()
    }

    /// What a layer's field is made from.
    pub(super) fn source(
        &mut self,
        job: &Job,
        number: usize,
        watch: &Watch,
    ) -> Result<Arc<Mutex<Source>>, RenderError> {
        source(&self.gpu, &mut self.sources, job, number, watch)
    }

    fn tables(&mut self, job: &Job, moment: &Moment) -> Vec<Tables> {
        let layers = moment.layers.iter().zip(job.tables());
        let make = layers.map(|(layer, tables)| {
            self.tables.get_or_make(MixKey::new(tables, layer.extinction_per_m), || {
                let host = HostTables::new(tables, layer.extinction_per_m);
                let device = Arc::new(DeviceTables::new(&self.gpu, &host));
                Tables { host: Arc::new(host), device }
            })
        });
        make.collect()
    }

    /// What a method needs for this sun, of each layer.
    fn slabs(&mut self, job: &Job, run: &Run, method: SlabMethod) -> Vec<SlabLight> {
        let cosine = run.moment.slant_cosine();
        let layers = run.moment.layers.iter().zip(job.tables()).zip(&run.tables);
        let make = layers.map(|((layer, mix), tables)| {
            let key = SlabKey::new(MixKey::new(mix, layer.extinction_per_m), method, cosine);
            let make = || HostSlab::new(method, mix, tables.host.ratio, cosine);
            self.slabs.get_or_make(key, || SlabLight::new(&self.gpu, &make()))
        });
        make.collect()
    }

    /// Light at the run's moment, and what lies between its passes if that is to be kept.
    fn light(
        &mut self,
        job: &Job,
        watch: &Watch,
        run: &Run,
        frames: &[wgpu::Buffer],
        keep: Keep,
    ) -> Result<(Arc<Light>, Option<Lit>), RenderError> {
        let Self { gpu, lattices, lights, .. } = self;
        let mut lit =
            || lit(gpu, job, watch, run, frames, &lattices.of_layers(gpu, job, watch, &run.fields, &run.moment)?);
        match keep {
            Keep::Texels => {
                let light = lights.get_or(LightKey::new(job, &run.moment), || Ok::<_, RenderError>(lit()?.light))?;
                Ok::<_, RenderError>((light, None))
            }
            Keep::Stages => {
                let lit = lit()?;
                Ok((Arc::clone(&lit.light), Some(lit)))
            }
        }
    }
}

/// The light of a moment, and what lies on the way to it.
fn lit(
    gpu: &Gpu,
    job: &Job,
    watch: &Watch,
    run: &Run,
    frames: &[wgpu::Buffer],
    lattices: &[Option<Arc<LatticeLit>>],
) -> Result<Lit, RenderError> {
    let moment = &run.moment;
    let layer = |number: usize| light::LayerInputs {
        frame: &frames[number],
        base_m: moment.layers[number].radiating_m,
        above_uv: moment.layers[number].above_uv,
        field: &run.fields[number],
        tables: &run.tables[number].device,
        angles: (moment.layers.len() > 1).then(|| {
            let (fluxes, forward) = (&job.tables()[number].fluxes, moment.layers[number].forward);
            [0, 1, 2].map(|c| AngleSlice::new(&fluxes[c], moment.slant_cosine(), forward[c]))
        }),
        lattice: lattices[number].clone(),
        blur_texels: moment.layers[number].blur_texels,
    };
    let layers: Vec<_> = (0..moment.layers.len()).map(layer).collect();
    let ground = GroundMap::new(&job.scene().ground.albedo, job.images())?;
    let inputs = LightInputs {
        layers: &layers,
        sun: moment.illumination.direct(),
        sky: moment.illumination.sky,
        air: moment.illumination.air_below,
        extent_m: moment.extent_m,
        shift_uv: moment.layers[0].shift_uv,
        grids: &moment.grids,
        transport: moment.plan.transport,
        sun_sine: (1.0 - moment.slant_cosine().powi(2)).max(0.0).sqrt(),
        albedo: &ground.means(moment.grids.exchange_texels),
        settled: moment.plan.exchange_change,
    };
    Ok(light::light(gpu, &inputs, watch.deadline)?)
}

/// What a layer's field is made from. Kept only where the field moves: a still one is made once.
fn source(
    gpu: &Gpu,
    kept: &mut Kept<SourceKey, Arc<Mutex<Source>>>,
    job: &Job,
    number: usize,
    watch: &Watch,
) -> Result<Arc<Mutex<Source>>, RenderError> {
    let layer = &job.scene().layers[number];
    let make = || {
        let given = match &layer.shape.thickness {
            _ if layer.shape.has_maps() => {
                Given::Columns(ColumnMap::new(layer, job.images(), job.extinction_550_per_m(number))?)
            }
            Some(Thickness::Map { image, .. }) => {
                let found = job.images().get(&image.0);
                Given::Thickness(&**found.ok_or_else(|| MissingImage(image.0.clone()))?)
            }
            Some(Thickness::Uniform(_) | Thickness::Stratocumulus(_)) | None => Given::Nothing,
        };
        let resolution = field_resolution(job.scene(), job.request());
        let source = Source::new(gpu, layer, resolution, job.scene().extent_m(), given, watch.deadline)?;
        Ok(Arc::new(Mutex::new(source)))
    };
    match field::moves(&layer.shape, &layer.wind) {
        true => kept.get_or(SourceKey::new(job, number), make),
        false => make(),
    }
}

/// Whether a sky is that of clear air over ground that is the same everywhere.
fn has_one_ground(job: &Job) -> bool {
    job.scene().layer_count() == 0 && matches!(job.scene().ground.albedo, GroundAlbedo::Uniform(_))
}
