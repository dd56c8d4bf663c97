//! A scene at one moment: where things are and how they are lit, in numbers of double precision. [`crate::frame`] makes of it
//! what the passes take; nothing comes back from there.

use crate::cumulus;
use crate::field::{self, Field};
use crate::gpu::layout::MIN_COSINE;
use crate::ground;
use crate::illumination::Illumination;
use crate::job::Job;
use crate::light::{Grids, LayerShape, SceneShape, grids, shift_uv};
use crate::plan::Plan;
use crate::projection::Side;
use crate::scene::quantity::Quantity as _;
use crate::scene::{Layer, Scene, Thickness};
use crate::slab::forward::{FORWARD_DEG, forward_albedo};
use crate::slice::without_peak;
use crate::sun_rays::{Crossed, SWEPT_LINES, SunRays};
use std::sync::Arc;

/// Cuts of a ray through a layer, at most: with half as many other steps and 32 places on the sun's disc a march stays below
/// the 65,535 iterations of an invocation at which a common software driver silently stops.
const MAX_STEPS: u32 = 1024;
/// Lines between texels that a ray crosses, for each texel that it goes over the map.
const LINES_OF_SLOPE: f64 = 1.5;
/// A layer at a moment. Arrays are red, green, blue.
#[derive(Debug, Clone)]
pub(crate) struct LayerMoment {
    /// Height of the base plane: the lowest base.
    pub(crate) base_m: f64,
    /// Height from which its light goes down to the ground: half-way between the lowest and the mean base, as what leaves a hollow
    /// of the base meets its sides.
    pub(crate) radiating_m: f64,
    /// Whether columns have bases, tops and extinctions of their own.
    pub(crate) ragged: bool,
    /// Of the highest cloud at any time.
    pub(crate) top_m: f64,
    /// No cloud is thicker.
    pub(crate) depth_m: f64,
    pub(crate) extinction_per_m: [f64; 3],
    /// Part of extinction that takes light out of the 5-degree beam.
    pub(crate) beam: [f64; 3],
    /// Part that takes light out of the beam by more than it may turn and still go on as the sun's ([`FORWARD_DEG`]).
    pub(crate) forward: [f64; 3],
    /// Extinction and single-scattering albedo of the medium without its forward peak, the former relative.
    pub(crate) smooth_part: [f64; 3],
    pub(crate) smooth_albedo: [f64; 3],
    /// 1 - asymmetry at 550 nm.
    pub(crate) transport_550: f64,
    /// Where the mean wind has carried the map.
    pub(crate) offset_uv: [f64; 2],
    /// From a point of the ground, and of the base, to where its sun ray crosses this base and that of the layer above.
    pub(crate) shift_uv: [f64; 2],
    pub(crate) above_uv: [f64; 2],
    /// Cuts of a ray.
    pub(crate) max_steps: u32,
    /// From the ground towards the sun's disc.
    pub(crate) rays: SunRays,
    /// Spread of light between where it enters and where it leaves: standard deviation, texels of the maps of sunlight.
    pub(crate) blur_texels: f64,
    /// Of the thickness map.
    texel_m: f64,
}

/// Cuts of a ray that is nearly level, in those of one at the least slope at which rays are flat: it ends where nothing more is seen.
const FLAT_CUTS: f64 = 1.5;
/// As in `shaders/shared/path_seen.wgsl` and `cloud_plane.wgsl`.
const FLAT_SLOPE: f64 = 8.0;
const MOST_RAYS: f64 = 8.0;
const RAY_SLOPE: f64 = 60.0;

/// How far the rays of a parallel view go over the map for each metre of height.
fn slope(towards: [f64; 3]) -> f64 {
    towards[0].hypot(towards[1]) / towards[2].abs().max(MIN_COSINE.into())
}

/// Whether a view has flat rays. That of an eye may have rays of all slopes.
pub(crate) fn has_flat_rays(towards: Option<[f64; 3]>) -> bool {
    towards.is_none_or(|towards| slope(towards) > FLAT_SLOPE)
}

/// A scene at a moment.
#[derive(Debug, Clone)]
pub(crate) struct Moment {
    pub(crate) illumination: Illumination,
    /// Lowest first, at least one.
    pub(crate) layers: Vec<LayerMoment>,
    pub(crate) plan: Plan,
    pub(crate) grids: Grids,
    pub(crate) extent_m: f64,
    /// Heights of the lowest base and of the highest top.
    pub(crate) base_m: f64,
    top_m: f64,
}

/// Cuts of a ray over a map of so many texels across and down.
fn most_steps(sides: [f64; 2]) -> u32 {
    if sides == [1.0; 2] { 1 } else { MAX_STEPS }
}

/// What rays towards a sun cross of a layer: a map of so many texels across and down, at the height of a base, of a depth.
fn crossed(
    scene: &Scene,
    layer: &Layer,
    map: [f64; 2],
    sun: [f64; 3],
    [base_m, depth_m]: [f64; 2],
    ground_side: Option<f64>,
) -> Crossed {
    let (extent_m, max_steps) = (scene.extent_m(), f64::from(most_steps(map)));
    Crossed {
        sun,
        radius: 0.5 * scene.sun.angular_diameter_deg.get().to_radians(),
        extent_m,
        base_m,
        depth_m,
        map,
        max_steps,
        synthetic: matches!(layer.shape.thickness, Some(Thickness::Stratocumulus(_))) && !layer.shape.has_maps(),
        lines: (LINES_OF_SLOPE * slope(sun) * depth_m * map[0].max(map[1]) / extent_m).clamp(1.0, max_steps),
        lines_of_slope: LINES_OF_SLOPE,
        ground_side,
    }
}

/// Bytes of what is swept over a layer's map of so many texels for a ground of so many texels a side, `most` at once.
pub(crate) fn swept_bytes(
    scene: &Scene,
    layer: &Layer,
    map: [u32; 2],
    sun: [f64; 3],
    heights_m: [f64; 2],
    side: u32,
    most: u64,
) -> u64 {
    crossed(scene, layer, map.map(f64::from), sun, heights_m, Some(side.into())).rays().swept_bytes(most)
}

/// A layer, and what the grids need of it.
fn layer(job: &Job, number: usize, fields: &[Arc<Field>], light: &Illumination) -> (LayerMoment, LayerShape) {
    let (field, above_m) = (&fields[number], fields.get(number + 1).map(|above| above.base_m));
    let (scene, tables) = (job.scene(), &job.tables()[number]);
    let layer = &scene.layers[number];
    let channels = &tables.channels;
    let extinction_per_m =
        layer.droplets.extinction_per_m(channels.each_ref().map(|channel| channel.cross_section_um2));
    let by_channel = |value: &dyn Fn(usize) -> f64| [value(0), value(1), value(2)];
    let smooth = |c: usize| without_peak(&channels[c], &tables.phases[c]);
    let (extent_m, base_m, depth_m) = (scene.extent_m(), field.base_m, f64::from(field.depth_m));
    let sun = light.towards_sun;
    // Light by entry is a matter of the smooth remainder of all scattering: its length is that of transport.
    let transport_550 = 1.0 - channels[1].asymmetry;
    let transport_length_m = 1.0 / (extinction_per_m[1] * field.density * transport_550).max(1e-9);
    let sides = [field.thickness.width, field.thickness.height].map(f64::from);
    let texels = sides[0].max(sides[1]);
    let max_steps = most_steps(sides);
    let ground_side = f64::from(job.request().size.unwrap_or(scene.resolution()));
    let crossed = crossed(scene, layer, sides, sun, [base_m, depth_m], job.points().is_empty().then_some(ground_side));
    let moment = LayerMoment {
        base_m,
        radiating_m: 0.5 * (base_m + field.mean_base_m),
        ragged: field.ragged,
        top_m: base_m + f64::from(field.top_m),
        depth_m,
        extinction_per_m,
        beam: by_channel(&|c| 1.0 - channels[c].albedo * tables.phases[c].peak_fraction),
        forward: by_channel(&|c| 1.0 - forward_albedo(&channels[c], FORWARD_DEG)),
        smooth_part: by_channel(&|c| smooth(c).0),
        smooth_albedo: by_channel(&|c| smooth(c).1),
        transport_550,
        offset_uv: field::offsets(layer, job.request().time_s, extent_m).read,
        shift_uv: shift_uv(sun, base_m, extent_m),
        above_uv: above_m.map_or([0.0; 2], |above_m| shift_uv(sun, above_m - base_m, extent_m)),
        max_steps,
        rays: crossed.rays(),
        blur_texels: 0.0,
        texel_m: extent_m / texels,
    };
    (moment, LayerShape { transport_length_m, depth_m })
}

impl LayerMoment {
    /// Cuts of a ray that climbs along `up`, at most.
    fn cuts(&self, up: [f64; 3]) -> f64 {
        self.lines_at(slope(up)).clamp(1.0, self.max_steps.into())
    }

    /// Cuts of the rays of a texel that is seen along `towards` and as wide as so many of the map's, about.
    fn view_cuts(&self, towards: [f64; 3], across: f64) -> f64 {
        let slope = slope(towards);
        let rays = (across * (slope / RAY_SLOPE).min(1.0)).ceil().clamp(1.0, MOST_RAYS);
        if slope > FLAT_SLOPE { rays * self.lines_at(FLAT_CUTS * FLAT_SLOPE).max(1.0) } else { self.cuts(towards) }
    }

    /// Lines between texels in each of two directions that a ray of a slope crosses.
    fn lines_at(&self, slope: f64) -> f64 {
        LINES_OF_SLOPE * slope * self.depth_m / self.texel_m
    }
}

impl Moment {
    /// `fields` are those of the job's layers, of which there is at least one.
    pub(crate) fn new(job: &Job, fields: &[Arc<Field>]) -> Self {
        let (scene, plan) = (job.scene(), *job.plan());
        let illumination = job.illumination().clone();
        let parts = (0..fields.len()).map(|number| layer(job, number, fields, &illumination));
        let (mut layers, shapes): (Vec<LayerMoment>, Vec<LayerShape>) = parts.unzip();
        let sides = fields.iter().map(|field| field.thickness.width.max(field.thickness.height));
        let (extent_m, lowest_m) = (scene.extent_m(), layers.first().map_or(0.0, |layer| layer.radiating_m));
        let shape = SceneShape {
            extent_m,
            base_m: lowest_m,
            layers: &shapes,
            thickness_texels: sides.max().unwrap_or(1),
            albedo_texels: ground::texels_a_side(&scene.ground.albedo, job.images()),
        };
        let grids = grids(&shape, &plan);
        for (layer, shape) in layers.iter_mut().zip(&shapes) {
            layer.blur_texels = shape.spread_m() / extent_m * f64::from(grids.sun_texels);
        }
        let cumulus = scene.cumulus.as_ref().map(|cumulus| cumulus.base_m.get());
        let bases = layers.iter().map(|layer| layer.base_m).chain(cumulus);
        let base_m = bases.reduce(f64::min).unwrap_or(0.0);
        let cumulus_m = scene.cumulus.as_ref().map_or(base_m, |cumulus| cumulus::highest_m(cumulus, extent_m));
        let top_m = layers.iter().map(|layer| layer.top_m).fold(cumulus_m, f64::max);
        Self { illumination, layers, plan, grids, extent_m, base_m, top_m }
    }

    /// Cosine of the sun's zenith for rays and tables: one that lies at the horizon or below is taken as just above it.
    pub(crate) fn slant_cosine(&self) -> f64 {
        self.illumination.cosine().max(MIN_COSINE.into())
    }

    /// Height of the plane that texels lie in.
    pub(crate) fn plane_m(&self, side: Side) -> f64 {
        match side {
            Side::Below => self.base_m,
            Side::Above => self.top_m,
        }
    }

    /// Cuts of the rays of a texel through all layers together, about; `towards` is the viewer of a parallel view: a perspective
    /// view has all slopes. The picture has so many texels a side.
    pub(crate) fn view_cuts(&self, towards: Option<[f64; 3]>, texels: u32) -> f64 {
        let texel_m = self.extent_m / f64::from(texels);
        let cuts = |layer: &LayerMoment| {
            towards.map_or(layer.max_steps.into(), |towards| layer.view_cuts(towards, texel_m / layer.texel_m))
        };
        self.layers.iter().map(cuts).sum::<f64>().max(1.0)
    }

    /// The same of the rays that look for the sun from a texel of the ground.
    pub(crate) fn sun_cuts(&self) -> f64 {
        let sun = self.illumination.towards_sun;
        let each = |layer: &LayerMoment| if layer.rays.swept.is_some() { SWEPT_LINES } else { layer.cuts(sun) };
        let cuts = |layer: &LayerMoment| layer.rays.count() as f64 * each(layer);
        self.layers.iter().map(cuts).sum::<f64>().max(1.0)
    }
}
