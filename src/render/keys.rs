//! What names the results that stay on the device between requests: each key holds all that its result depends on, and no
//! more.

use crate::air_map::Half;
use crate::atmosphere::End;
use crate::field;
use crate::gpu::layout::View;
use crate::job::Job;
use crate::method::{CumulusMethod, SlabMethod, Transport};
use crate::moment::Moment;
use crate::plan::field_resolution;
use crate::scene::quantity::Quantity as _;
use crate::scene::{Cumulus, CumulusShape, Droplets, Shape, Wind};
use crate::tables::MixTables;

/// What a layer's field is made from.
#[derive(PartialEq)]
pub(super) struct SourceKey {
    extent_m: f64,
    resolution: u32,
    shape: Shape,
    /// Of the droplets: what the optical depths of columns are measured by.
    extinction_550_per_m: Option<f64>,
    /// What columns of droplets of other sizes are held against.
    droplets: Option<Droplets>,
    turbulence_m_s: f64,
    rows_from_deg: Option<f64>,
}

/// A layer's field: one that nothing moves is the same at all times.
#[derive(PartialEq, Clone)]
pub(super) struct FieldKey {
    extent_m: f64,
    resolution: u32,
    shape: Shape,
    extinction_550_per_m: Option<f64>,
    droplets: Option<Droplets>,
    rows_from_deg: Option<f64>,
    /// Wind and time, where eddies move the field.
    moved: Option<(Wind, f64)>,
}

/// Fields of all layers, where the wind has carried them, and where the sun stands: a scene that nothing moves is the same at
/// all times.
#[derive(PartialEq, Clone)]
pub(super) struct MomentKey {
    scene: String,
    towards_sun: [f64; 3],
    /// Of the tables of its air: finer ones have other light.
    air: Option<String>,
    layers: Vec<([f64; 2], FieldKey)>,
    /// The time, and how its light is found, where there is cumulus.
    cumulus: Option<(f64, CumulusMethod)>,
}

/// Tables of a droplet mix at its ratios of extinction.
#[derive(PartialEq)]
pub(super) struct MixKey {
    mix: String,
    red_to_green: f64,
    blue_to_green: f64,
}

/// A method of slab light for a mix and a sun.
#[derive(PartialEq)]
pub(super) struct SlabKey {
    mix: MixKey,
    method: SlabMethod,
    cosine: f64,
}

/// The light of a layer's lattice: the wind carries it along.
#[derive(PartialEq)]
pub(super) struct LatticeKey {
    field: FieldKey,
    mix: MixKey,
    extinction_per_m: f64,
    towards_sun: [f64; 3],
}

/// Where cumulus is, but for the wind.
#[derive(PartialEq, Clone)]
pub(super) struct CumulusKey {
    extent_m: f64,
    texel_m: f64,
    base_m: f64,
    edge_m: f64,
    shape: CumulusShape,
    /// Where clouds grow.
    time_s: Option<f64>,
}

/// Light between cloud and ground.
#[derive(PartialEq)]
pub(super) struct LightKey {
    moment: MomentKey,
    transport: Transport,
    /// Texels per transport length and per height of the base, change at which the exchange is settled.
    fineness: [f64; 3],
}

/// The sun's beam on the ground, as the texels of some rows of a texture, as many as are made together.
#[derive(PartialEq)]
pub(super) struct BeamKey {
    moment: MomentKey,
    size: [u32; 2],
    first_row: u32,
    /// With its 5-degree peak.
    peak: bool,
}

/// Radiance of the ground, as a map of so many texels a side.
#[derive(PartialEq)]
pub(super) struct GroundKey {
    light: LightKey,
    texels: u32,
}

/// Air between an eye and what it sees.
#[derive(PartialEq)]
pub(super) struct AirKey {
    /// Of the tables; without air the sky's light is the scene's.
    air: String,
    /// Height, cosine of the sun's zenith, and its nearness.
    eye: [f64; 3],
    half: Half,
    end: End,
}

impl CumulusKey {
    pub(super) fn new(job: &Job, layer: &Cumulus) -> Self {
        let (scene, grows) = (job.scene(), matches!(layer.shape, CumulusShape::Field { .. }));
        Self {
            extent_m: scene.extent_m(),
            texel_m: scene.extent_m() / f64::from(scene.resolution()),
            base_m: layer.base_m.get(),
            edge_m: layer.edge_m.get(),
            shape: layer.shape.clone(),
            time_s: grows.then_some(job.request().time_s),
        }
    }

    /// Side of the texels of maps of the domain.
    pub(super) fn texel_m(&self) -> f64 {
        self.texel_m
    }
}

impl SourceKey {
    pub(super) fn new(job: &Job, number: usize) -> Self {
        let layer = &job.scene().layers[number];
        Self {
            extent_m: job.scene().extent_m(),
            resolution: field_resolution(job.scene(), job.request()),
            shape: layer.shape.clone(),
            extinction_550_per_m: layer.shape.has_maps().then(|| job.extinction_550_per_m(number)),
            droplets: layer.shape.effective_radius.as_ref().map(|_| layer.droplets.clone()),
            turbulence_m_s: layer.wind.turbulence_m_s.get(),
            rows_from_deg: field::rows_from_deg(&layer.shape, &layer.wind),
        }
    }
}

impl FieldKey {
    pub(super) fn new(job: &Job, number: usize) -> Self {
        let layer = &job.scene().layers[number];
        let moves = field::moves(&layer.shape, &layer.wind);
        let SourceKey { extent_m, resolution, shape, extinction_550_per_m, droplets, rows_from_deg, .. } =
            SourceKey::new(job, number);
        Self {
            extent_m,
            resolution,
            shape,
            extinction_550_per_m,
            droplets,
            rows_from_deg,
            moved: moves.then_some((layer.wind, job.request().time_s)),
        }
    }
}

impl MomentKey {
    pub(super) fn new(job: &Job, moment: &Moment) -> Self {
        let layers = moment.layers.iter().enumerate();
        let layers = layers.map(|(number, layer)| (layer.offset_uv, FieldKey::new(job, number))).collect();
        let air = job.air().map(|air| air.key().to_owned());
        let towards_sun = moment.illumination.towards_sun;
        let cumulus = job.scene().cumulus.as_ref().map(|_| (job.request().time_s, moment.plan.cumulus));
        Self { scene: job.scene_id().to_owned(), towards_sun, air, layers, cumulus }
    }
}

impl MixKey {
    pub(super) fn new(tables: &MixTables, [r, g, b]: [f64; 3]) -> Self {
        Self { mix: tables.mix.key(), red_to_green: r / g, blue_to_green: b / g }
    }
}

impl SlabKey {
    pub(super) fn new(mix: MixKey, method: SlabMethod, cosine: f64) -> Self {
        Self { mix, method, cosine }
    }
}

impl LatticeKey {
    pub(super) fn new(job: &Job, moment: &Moment, number: usize) -> Self {
        let layer = &moment.layers[number];
        Self {
            field: FieldKey::new(job, number),
            mix: MixKey::new(&job.tables()[number], layer.extinction_per_m),
            extinction_per_m: layer.extinction_per_m[1],
            towards_sun: moment.illumination.towards_sun,
        }
    }
}

impl LightKey {
    pub(super) fn new(job: &Job, moment: &Moment) -> Self {
        let plan = &moment.plan;
        Self {
            moment: MomentKey::new(job, moment),
            transport: plan.transport,
            fineness: [plan.texels_per_length, plan.texels_per_height, plan.exchange_change],
        }
    }
}

impl BeamKey {
    /// That of some bands of a texture, by the first of them.
    pub(super) fn new(job: &Job, moment: &Moment, first: &View) -> Self {
        Self {
            moment: MomentKey::new(job, moment),
            size: first.size,
            first_row: first.first_row,
            peak: first.peak == 1,
        }
    }
}

impl GroundKey {
    pub(super) fn new(job: &Job, moment: &Moment, texels: u32) -> Self {
        Self { light: LightKey::new(job, moment), texels }
    }
}

impl AirKey {
    pub(super) fn new(job: &Job, eye: [f64; 3], half: Half, end: End) -> Self {
        let air = job.air().map_or_else(|| job.scene_id().to_owned(), |air| air.key().to_owned());
        Self { air, eye, half, end }
    }
}
