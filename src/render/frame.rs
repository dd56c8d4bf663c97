//! What a scene is at one moment, in the numbers that the passes take.

use super::{Job, RenderError, Texture};
use crate::encode::Metadata;
use crate::field::{self, Field, wind_offset};
use crate::gpu::HostMap;
use crate::gpu::layout::{Frame, MIN_COSINE, View};
use crate::ground::{self, GroundMap};
use crate::image::Image;
use crate::light::{Grids, LayerShape, SceneShape, grids, shift_uv};
use crate::plan::{Plan, field_resolution};
use crate::request::{Component, Request, Side, TextureKind, Transport};
use crate::scene::quantity::Quantity as _;
use crate::scene::{Scene, Thickness};
use crate::slice::without_peak;
use crate::tables::MixTables;
use std::sync::Arc;

/// Cuts of a ray through a layer, at most: with half as many other steps and 32 places on the sun's disc a march stays below
/// the 65,535 iterations of an invocation at which a common software driver silently stops.
const MAX_STEPS: u32 = 1024;

/// A layer at a moment.
pub(super) struct LayerMoment {
    pub(super) frame: Frame,
    pub(super) extinction_per_m: [f64; 3],
    shape: LayerShape,
    top_m: f64,
    /// Of the thickness map.
    texel_m: f64,
}

/// A scene at a moment.
pub(super) struct Moment {
    /// Lowest first.
    pub(super) layers: Vec<LayerMoment>,
    pub(super) plan: Plan,
    pub(super) grids: Grids,
    /// Heights of the lowest base and of the highest top, metres.
    base_m: f64,
    top_m: f64,
    extent_m: f64,
}

/// Cosine of the sun's zenith, 0 below the horizon.
fn sun_cosine(scene: &Scene) -> f64 {
    scene.sun_direction()[2].max(0.0)
}

/// Horizontal irradiance above the clouds.
pub(super) fn irradiance_above(scene: &Scene) -> [f64; 3] {
    let (sun, sky) = (scene.light.sun.map(|v| v.get()), scene.light.sky.map(|v| v.get()));
    std::array::from_fn(|c| sun[c] * sun_cosine(scene) + std::f64::consts::PI * sky[c])
}

fn rgb(channels: [f64; 3], fourth: f64) -> [f32; 4] {
    [channels[0] as f32, channels[1] as f32, channels[2] as f32, fourth as f32]
}

/// Places on the sun's disc that are looked at for one texel of its shadow: fewer show as steps.
const DISCS: [f64; 2] = [16.0, 32.0];

/// Places on the sun's disc for a penumbra of so many texels: one where it is narrower than half a texel.
fn discs(scene: &Scene, height_m: f64, texel_m: f64) -> u32 {
    let diameter = scene.sun.angular_diameter_deg.get().to_radians();
    let cosine = sun_cosine(scene).max(0.01);
    let texels = height_m * diameter / (cosine * cosine) / texel_m;
    if texels < 0.5 { 1 } else { (4.0 * texels).clamp(DISCS[0], DISCS[1]) as u32 }
}

impl LayerMoment {
    fn new(job: &Job, number: usize, field: &Field, plan: &Plan, above_m: Option<f64>) -> Self {
        let (scene, tables) = (&job.scene, &job.tables[number]);
        let layer = &scene.layers[number];
        let extinction_per_m =
            layer.droplets.extinction_per_m(tables.channels.each_ref().map(|channel| channel.cross_section_um2));
        let by_channel = |value: &dyn Fn(usize) -> f64| [value(0), value(1), value(2)];
        let beam = by_channel(&|c| 1.0 - tables.channels[c].albedo * tables.phases[c].peak_fraction);
        let smooth = |c: usize| without_peak(&tables.channels[c], &tables.phases[c]);
        let (extent_m, base_m) = (scene.extent_m(), layer.base_m.get());
        let (direction, cosine) = (scene.sun_direction(), sun_cosine(scene));
        let day = if cosine > 0.0 { 1.0 } else { 0.0 };
        let texel_m = extent_m / f64::from(field.thickness.width.max(field.thickness.height));
        let output_m = extent_m / f64::from(job.request.size.unwrap_or(scene.domain.resolution));
        let [_, offset] = offsets(job, number);
        // Light by entry is a matter of the smooth remainder of all scattering: its length is that of transport.
        let transport_length_m = 1.0 / (extinction_per_m[1] * (1.0 - tables.channels[1].asymmetry)).max(1e-9);
        let frame = Frame {
            sun: rgb(direction, cosine.max(f64::from(MIN_COSINE))),
            sun_light: rgb(scene.light.sun.map(|value| day * value.get()), cosine),
            extinction: rgb(extinction_per_m, extinction_per_m[1]),
            beam: rgb(beam, beam[1]),
            smooth_part: rgb(by_channel(&|c| smooth(c).0), 1.0 - tables.channels[1].asymmetry),
            smooth_albedo: rgb(by_channel(&|c| smooth(c).1), 0.0),
            offset_uv: offset.map(|part| part as f32),
            shift_uv: shift_uv(direction, base_m, extent_m),
            above_uv: above_m.map_or([0.0; 2], |above_m| shift_uv(direction, above_m - base_m, extent_m)),
            extent_m: extent_m as f32,
            base_m: base_m as f32,
            depth_m: field.depth_m,
            max_steps: if field.is_uniform() { 1 } else { MAX_STEPS },
            // Set when the grids are planned, for all layers together.
            texels: 1,
            sample_at: [0.0; 2],
            columns: match plan.transport {
                // No sun, no rays to follow.
                _ if cosine <= 0.0 => 1,
                Transport::Columns => 1,
                Transport::Tilted => 2,
                Transport::Entry | Transport::Blended => 0,
            },
            discs: discs(scene, base_m + f64::from(field.depth_m), output_m),
            sun_radius: (0.5 * scene.sun.angular_diameter_deg.get()).to_radians() as f32,
        };
        let shape = LayerShape { transport_length_m, depth_m: field.depth_m.into() };
        Self { frame, extinction_per_m, shape, top_m: base_m + f64::from(field.top_m), texel_m }
    }

    fn cuts(&self, view: &View, texture: TextureKind) -> f64 {
        let most = f64::from(self.frame.max_steps);
        let (up, rays) = match texture {
            TextureKind::Thickness => return 1.0,
            TextureKind::Shadow | TextureKind::Irradiance => (self.frame.sun, f64::from(self.frame.discs)),
            TextureKind::Cloud if view.towards[3] > 0.5 => return most,
            TextureKind::Cloud => (view.towards, 1.0),
        };
        let slope = f64::from(up[0]).hypot(up[1].into()) / f64::from(up[2].abs().max(MIN_COSINE));
        // A line between texels in each of two directions.
        let lines = 1.5 * slope * f64::from(self.frame.depth_m) / self.texel_m;
        rays * lines.clamp(1.0, most)
    }

    /// Names the tables of the layer's mix at its ratio of extinctions.
    pub(super) fn mix_key(&self, tables: &MixTables) -> String {
        let [r, g, b] = self.extinction_per_m;
        format!("{} {:x} {:x}", tables.mix.key(), (r / g).to_bits(), (b / g).to_bits())
    }
}

impl Moment {
    /// `job` has layers and their tables; `fields` are those of the layers.
    pub(super) fn new(job: &Job, fields: &[Arc<Field>]) -> Self {
        let scene = &job.scene;
        let plan = Plan::new(&job.request);
        let base_of = |number: usize| scene.layers.get(number).map(|layer| layer.base_m.get());
        let mut layers: Vec<LayerMoment> = fields
            .iter()
            .enumerate()
            .map(|(number, field)| LayerMoment::new(job, number, field, &plan, base_of(number + 1)))
            .collect();
        let shapes: Vec<LayerShape> = layers.iter().map(|layer| layer.shape).collect();
        let albedo_texels = ground::texels_a_side(&scene.ground.albedo, &job.images);
        let sides = fields.iter().map(|field| field.thickness.width.max(field.thickness.height));
        let (extent_m, base_m) = (scene.extent_m(), scene.base_m());
        let shape =
            SceneShape { extent_m, base_m, layers: &shapes, thickness_texels: sides.max().unwrap_or(1), albedo_texels };
        let grids = grids(&shape, &plan);
        for layer in &mut layers {
            layer.frame.texels = grids.sun_texels;
            layer.frame.sample_at = grids.sample_at.map(|part| part as f32);
        }
        let top_m = layers.iter().map(|layer| layer.top_m).fold(base_m, f64::max);
        Self { layers, plan, grids, base_m, top_m, extent_m }
    }

    /// Height of the plane that a view's texels lie in.
    pub(super) fn plane_m(&self, request: &Request) -> f64 {
        match request.side {
            Side::Below => self.base_m,
            Side::Above => self.top_m,
        }
    }

    /// Cuts of a marched ray of all layers together, at most: a perspective view has all slopes.
    pub(super) fn cuts(&self, view: &View, texture: TextureKind) -> f64 {
        self.layers.iter().map(|layer| layer.cuts(view, texture)).sum::<f64>().max(1.0)
    }

    /// How far light is spread in a layer, texels of the maps of sunlight.
    pub(super) fn blur_texels(&self, layer: &LayerMoment) -> f64 {
        layer.shape.spread_m() / self.extent_m * f64::from(self.grids.sun_texels)
    }

    /// Names the moment: a scene that nothing moves is the same at all times.
    pub(super) fn time_key(&self, job: &Job) -> String {
        let layer =
            |(number, layer): (usize, &LayerMoment)| format!("{:?} {}", layer.frame.offset_uv, field_key(job, number));
        self.layers.iter().enumerate().map(layer).collect::<Vec<_>>().join(" ")
    }

    /// The ground's albedo on the exchange grid, mean over each texel.
    pub(super) fn albedo(&self, job: &Job) -> Result<HostMap, RenderError> {
        Ok(ground_map(job)?.means(self.grids.exchange_texels))
    }
}

/// The ground's albedo as the scene gives it.
pub(super) fn ground_map(job: &Job) -> Result<GroundMap, RenderError> {
    GroundMap::new(&job.scene.ground.albedo, &job.images).map_err(RenderError::MissingImage)
}

fn image_of<'a>(job: &'a Job, name: &str) -> Result<&'a Image, RenderError> {
    job.images.get(name).map(|image| &**image).ok_or_else(|| RenderError::MissingImage(name.to_owned()))
}

/// Where the mean wind has carried a layer: as its map is made, and as it is read. A map that is made anew for each time has
/// its texels in the domain's, so that it is read where it was calibrated; one for all times is read between its texels.
pub(super) fn offsets(job: &Job, layer: usize) -> [[f64; 2]; 2] {
    let layer = &job.scene.layers[layer];
    let offset = wind_offset(&layer.wind, job.request.time_s, job.scene.extent_m());
    if field::moves(&layer.thickness, &layer.wind) { [offset, [0.0; 2]] } else { [[0.0; 2], offset] }
}

fn domain_key(job: &Job) -> String {
    format!("{:?} {}", job.scene.domain.extent_m, field_resolution(&job.scene, &job.request))
}

/// Names what a layer's field is made from.
pub(super) fn source_key(job: &Job, layer: usize) -> String {
    let layer = &job.scene.layers[layer];
    format!("{} {:?} {:?}", domain_key(job), layer.thickness, layer.wind.turbulence_m_s)
}

/// Names a layer's field: one that nothing moves is the same at all times.
pub(super) fn field_key(job: &Job, number: usize) -> String {
    let layer = &job.scene.layers[number];
    match field::moves(&layer.thickness, &layer.wind) {
        true => format!("{} {:?} {:x}", source_key(job, number), layer.wind, job.request.time_s.to_bits()),
        false => format!("{} {:?}", domain_key(job), layer.thickness),
    }
}

/// The image of a layer's thickness, if it has one.
pub(super) fn thickness_image(job: &Job, layer: usize) -> Result<Option<&Image>, RenderError> {
    match &job.scene.layers[layer].thickness {
        Thickness::Map { image, .. } => image_of(job, &image.0).map(Some),
        _ => Ok(None),
    }
}

/// Textures of a scene without clouds: the same everywhere.
pub(super) fn clear_sky(scene: &Scene, request: &Request, size: u32) -> Vec<f32> {
    let cosine = sun_cosine(scene);
    let texel: Vec<f32> = match request.texture {
        TextureKind::Cloud => vec![0.0; 4],
        TextureKind::Thickness => vec![0.0],
        TextureKind::Shadow => vec![if cosine > 0.0 { 1.0 } else { 0.0 }],
        TextureKind::Irradiance => {
            let total = irradiance_above(scene);
            let direct = scene.light.sun.map(|value| value.get() * cosine);
            let channel = |c: usize| match request.component {
                Component::Total => total[c],
                Component::Direct => direct[c],
                Component::Diffuse => total[c] - direct[c],
            };
            (0..3).map(|c| channel(c) as f32).collect()
        }
    };
    texel.repeat(size as usize * size as usize)
}

/// What an EXR file tells besides its texels.
pub(super) fn metadata(scene: &Scene, request: &Request, texture: &Texture) -> Metadata {
    let meaning = match request.texture {
        TextureKind::Cloud => "radiance leaving the cloud towards the viewer, and alpha",
        TextureKind::Shadow => "part of the sun's beam that reaches the ground, 550 nm",
        TextureKind::Irradiance => "downward irradiance on the ground",
        TextureKind::Thickness => "geometric thickness of cloud, metres",
    };
    Metadata {
        domain_extent_m: scene.extent_m(),
        origin: [0.0, 0.0, texture.plane_m],
        sun_direction: scene.sun_direction(),
        base_height_m: scene.base_m(),
        time_s: request.time_s,
        axes: "enu".to_owned(),
        texture: request.texture.name().to_owned(),
        comments: meaning.to_owned(),
        scene: scene.id(),
        software: format!("skyloom {}", *crate::VERSION),
        // The scene gives its own light: whether its unit is kcd/m² is the caller's knowledge.
        white_luminance: None,
        periodic: true,
        place: None,
    }
}
