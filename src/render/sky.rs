//! The texels of a sky: what is made for it beside what other textures take, kept on the device, and its bands.

use super::bands::ground_suns;
use super::kept::{Kept, Results};
use super::keys::{AirKey, FieldKey, GroundKey};
use super::pipeline::Keep;
use super::stages::SkyStages;
use crate::air_map::{AirMap, Half};
use crate::atmosphere::End;
use crate::field::{self, Field, Levels};
use crate::frame;
use crate::gpu::layout::{SkyView, View};
use crate::gpu::{Gpu, GpuError, Target};
use crate::ground::GroundMap;
use crate::illumination::Illumination;
use crate::job::{Job, RenderError, Watch};
use crate::moment::{LayerMoment, Moment};
use crate::request::Sphere;
use crate::scene_air::CoverMoment;
use crate::shade::{
    self, CumulusInputs, DeviceAir, GroundLit, Inputs, LayerInputs, OnGround, SkyClouds, SkyCumulus, SkyInputs,
    SkyLayer, dip,
};
use std::sync::Arc;

/// Fields whose levels, and moments whose grounds, stay on the device.
const KEPT: usize = 8;
/// Maps of air: two for an eye, and two a layer.
const KEPT_AIRS: usize = 40;
/// Texels a side of the map of the ground, at least and at most.
const GROUND_TEXELS: [u32; 2] = [64, 512];
/// Cuts of a ray through a layer, on the mean over a sky: rays near the horizon are cut more often, on coarser maps.
const MEAN_CUTS: f64 = 100.0;

/// What of skies stays on the device.
pub(super) struct SkyKept {
    levels: Kept<FieldKey, Arc<Levels>>,
    grounds: Kept<GroundKey, Arc<GroundLit>>,
    airs: Kept<AirKey, Arc<DeviceAir>>,
}

/// A sky's job, and what the stages before made for it.
pub(super) struct SkyJob<'a> {
    pub(super) job: &'a Job,
    pub(super) moment: &'a Moment,
    pub(super) sphere: &'a Sphere,
    /// All layers, lowest first.
    pub(super) all: &'a Inputs<'a>,
    /// Those that are seen, with their numbers, lowest first.
    pub(super) seen: Vec<(usize, LayerInputs<'a>)>,
    /// Cumulus that is seen, and the number of those layers below it.
    pub(super) cumulus: Option<(usize, &'a CumulusInputs)>,
    /// Even light on the ground beside that of the layers' exchange.
    pub(super) added: [f32; 3],
    pub(super) watch: &'a Watch,
}

/// The eye of a sky, and what light comes to it without clouds.
struct Eye {
    height_m: f64,
    sun_cosine: f64,
    nearness: f64,
    sky: [f64; 3],
    cover: Option<Arc<CoverMoment>>,
    in_air: bool,
}

impl Eye {
    fn new(job: &Job, moment: &Moment, sphere: &Sphere) -> Self {
        let Illumination { towards_sun, sky, nearness, .. } = &moment.illumination;
        Self {
            height_m: sphere.eye[2],
            sun_cosine: towards_sun[2],
            nearness: *nearness,
            sky: *sky,
            cover: moment.illumination.cover.clone(),
            in_air: job.air().is_some(),
        }
    }

    /// Air on one side of the horizon. An eye within a layer has none before it.
    fn air(&self, job: &Job, half: Half, end: End) -> AirMap {
        let vacuum = |light| AirMap::vacuum(light, -dip(self.height_m, 0.0).asin());
        match (job.air(), half, end) {
            (None, Half::Above, End::Atmosphere) => vacuum(self.sky),
            (None, ..) => vacuum([0.0; 3]),
            (Some(_), Half::Above, End::Shell(base_m)) if self.height_m >= base_m => vacuum([0.0; 3]),
            (Some(_), Half::Below, End::Shell(top_m)) if self.height_m <= top_m => vacuum([0.0; 3]),
            (Some(air), ..) => {
                let sun = [self.sun_cosine, self.nearness];
                AirMap::new(air, self.cover.as_deref(), self.height_m, sun, half, end)
            }
        }
    }
}

impl SkyKept {
    pub(super) fn new() -> Self {
        Self {
            levels: Kept::sized(KEPT, |levels| levels.size()),
            grounds: Kept::sized(KEPT, |ground| ground.size()),
            airs: Kept::new(KEPT_AIRS),
        }
    }

    /// Those that may be large.
    pub(super) fn results(&mut self) -> [&mut dyn Results; 2] {
        [&mut self.levels, &mut self.grounds]
    }

    /// The levels of a layer's map.
    pub(super) fn levels(
        &mut self,
        gpu: &Gpu,
        job: &Job,
        number: usize,
        field: &Field,
        watch: &Watch,
    ) -> Result<Arc<Levels>, RenderError> {
        levels(&mut self.levels, gpu, job, number, field, watch)
    }

    /// Shades a sky in bands; with what lies between its passes, if that is to be kept.
    pub(super) fn texels(
        &mut self,
        gpu: &Gpu,
        sky: SkyJob<'_>,
        keep: Keep,
    ) -> Result<(Vec<f32>, Option<SkyStages>), RenderError> {
        let SkyJob { job, moment, sphere, all, seen, cumulus, added, watch } = sky;
        let ground = self.ground(gpu, job, moment, all, added, watch)?;
        let eye = Eye::new(job, moment, sphere);
        let mut air = |half, end| {
            self.airs.get_or_make(AirKey::new(job, [eye.height_m, eye.sun_cosine, eye.nearness], half, end), || {
                Arc::new(DeviceAir::new(gpu, &eye.air(job, half, end)))
            })
        };
        let far = [air(Half::Above, End::Atmosphere), air(Half::Below, End::Atmosphere)];
        let mut layers = Vec::with_capacity(seen.len());
        for (number, inputs) in seen {
            let levels = levels(&mut self.levels, gpu, job, number, inputs.field, watch)?;
            let LayerMoment { base_m, depth_m, .. } = moment.layers[number];
            let top_m = base_m + depth_m;
            let sinking = (eye.height_m > base_m).then(|| air(Half::Below, End::Shell(top_m)));
            // Rays that come up again beyond the horizon end in haze, where there is air.
            let rising = (eye.height_m < top_m || !eye.in_air).then(|| air(Half::Above, End::Shell(base_m)));
            layers.push(SkyLayer { inputs, levels, base_m, top_m, before: [sinking, rising] });
        }
        let cumulus = cumulus.map(|(below, inputs)| {
            let (low_m, top_m) = (f64::from(inputs.frame.low_m), f64::from(inputs.frame.top_m));
            let sinking = (eye.height_m > low_m).then(|| air(Half::Below, End::Shell(top_m)));
            let rising = (eye.height_m < top_m || !eye.in_air).then(|| air(Half::Above, End::Shell(low_m)));
            (below, SkyCumulus { inputs, before: [sinking, rising] })
        });
        let cuts = MEAN_CUTS * (layers.len() + usize::from(cumulus.is_some())) as f64;
        let backdrop = frame::backdrop(moment, far[0].horizon);
        let disc = (job.request().wanted.disc() == Some(true))
            .then(|| moment.illumination.disc(job.scene(), job.air().map(|air| &*air.clear), eye.height_m));
        let inputs = SkyInputs { sphere, layers, cumulus, ground, backdrop, air: far, disc };
        let (texels, drift) = (job.request().texels(job.scene()), frame::drift(job.scene(), sphere));
        let view = frame::sky_view(sphere, moment.plan.sky, texels, drift);
        let [across, down] = view.size;
        let rows = shade::band_rows(view.size, cuts);
        let mut data = Vec::with_capacity(3 * across as usize * down as usize);
        let mut kept = (keep == Keep::Stages).then(SkyClouds::default);
        for first_row in (0..down).step_by(rows as usize) {
            watch.look()?;
            let band = SkyView { first_row, rows: rows.min(down - first_row), ..view };
            data.extend(shade::sky_band(gpu, &inputs, &band, kept.as_mut(), watch.deadline)?);
        }
        let stages = kept.map(|clouds| stages(gpu, job, &inputs, view, clouds, watch)).transpose()?;
        Ok((data, stages))
    }

    fn ground(
        &mut self,
        gpu: &Gpu,
        job: &Job,
        moment: &Moment,
        all: &Inputs<'_>,
        added: [f32; 3],
        watch: &Watch,
    ) -> Result<Arc<GroundLit>, RenderError> {
        let texels = ground_texels(job);
        self.grounds.get_or(GroundKey::new(job, moment, texels), || {
            let albedo = GroundMap::new(&job.scene().ground.albedo, job.images())?.means(texels);
            let view = View { added, ..ground_view(texels) };
            let deadline = watch.deadline;
            let made = if all.layers.is_empty() && all.cumulus.is_none() {
                shade::ground_radiance(gpu, &OnGround::Even(moment.illumination.total()), &view, &albedo, deadline)
            } else {
                let suns = ground_suns(gpu, all, &[view], watch)?;
                let sun = suns.first().ok_or_else(|| GpuError::Failed("the ground has no sun".to_owned()))?;
                shade::ground_radiance(gpu, &OnGround::Through(all, sun), &view, &albedo, deadline)
            };
            Ok(Arc::new(made?))
        })
    }
}

fn levels(
    kept: &mut Kept<FieldKey, Arc<Levels>>,
    gpu: &Gpu,
    job: &Job,
    number: usize,
    field: &Field,
    watch: &Watch,
) -> Result<Arc<Levels>, RenderError> {
    kept.get_or(FieldKey::new(job, number), || Ok(Arc::new(field::levels(gpu, field, watch.deadline)?)))
}

/// Texels a side of the map of the ground: a power of two.
fn ground_texels(job: &Job) -> u32 {
    let [least, most] = GROUND_TEXELS;
    job.scene().resolution().clamp(least, most).next_power_of_two()
}

fn ground_view(texels: u32) -> View {
    View { size: [texels; 2], rows: texels, first: 1, peak: 1, ..View::default() }
}

/// Reads what the passes of a sky took and gave.
fn stages(
    gpu: &Gpu,
    job: &Job,
    inputs: &SkyInputs<'_>,
    view: SkyView,
    clouds: SkyClouds,
    watch: &Watch,
) -> Result<SkyStages, RenderError> {
    let read = |target: &Target| {
        let levels: Vec<_> = (0..target.levels.len()).map(|level| (target, level)).collect();
        gpu.read_maps(&levels, watch.deadline)
    };
    let texels = ground_texels(job);
    let irradiance = gpu.read(&inputs.ground.irradiance, 3 * (texels * texels) as usize, watch.deadline)?;
    let whole = |pass: SkyView| SkyView { first_row: 0, rows: view.rows, ..pass };
    Ok(SkyStages {
        view,
        backdrop: inputs.backdrop,
        levels: inputs.layers.iter().map(|layer| read(&layer.levels.map)).collect::<Result<_, _>>()?,
        ground_view: ground_view(texels),
        albedo: GroundMap::new(&job.scene().ground.albedo, job.images())?.means(texels),
        irradiance,
        ground: read(&inputs.ground.radiance)?,
        air: [inputs.air[0].read(gpu, watch.deadline)?, inputs.air[1].read(gpu, watch.deadline)?],
        clouds: SkyClouds { passes: clouds.passes.into_iter().map(whole).collect(), ..clouds },
    })
}
