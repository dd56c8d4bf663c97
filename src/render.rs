//! From a scene and a request to a texture: the stages in order, and what is kept between requests.

mod exact;
mod exact_light;
mod frame;
mod inspect;
mod kept;

pub use inspect::Stages;

use crate::encode::{self, EncodeError};
use crate::field::{self, Field, Source};
use crate::gpu::layout::{Frame, View};
use crate::gpu::{AdapterSummary, Gpu, GpuError, Target};
use crate::image::Image;
use crate::light::{self, Light, Lit};
use crate::plan::field_resolution;
use crate::request::{self, Format, Method, Request, Side, TextureKind, Viewer};
use crate::scene::quantity::Quantity as _;
use crate::scene::{FieldError, Scene};
use crate::shade::{self, GroundSun};
use crate::slice::{self, DeviceSlice, DeviceTables, HostSlice, HostTables};
use crate::tables::{Detail, MixTables};
use kept::Kept;
use std::collections::HashMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// How a renderer is opened.
#[derive(Debug, Clone)]
pub struct RendererOptions {
    /// Part of the wanted adapter's name; the best one when `None`.
    pub adapter: Option<String>,
    /// Let the device filter 32-bit floats if it can. Off, the slower path of devices that can't is used.
    pub filtering: bool,
}

impl Default for RendererOptions {
    fn default() -> Self {
        Self { adapter: None, filtering: true }
    }
}

/// One texture to make.
#[derive(Debug, Clone)]
pub struct Job {
    /// The scene.
    pub scene: Arc<Scene>,
    /// What is asked of it.
    pub request: Request,
    /// Tables of the scene's mixes, in the order of [`Scene::mixes`].
    pub tables: Vec<Arc<MixTables>>,
    /// The images that the scene names, by SHA-256.
    pub images: HashMap<String, Arc<Image>>,
}

/// How a running job is stopped: it is looked at between submissions to the device.
#[derive(Clone, Default)]
pub struct Watch {
    /// When the result is no longer wanted.
    pub deadline: Option<Instant>,
    /// Set from another thread to drop the job.
    pub cancelled: Arc<AtomicBool>,
    /// Hears how far long work is, 0 to 1.
    pub progress: Option<Arc<dyn Fn(f64) + Send + Sync>>,
}

impl std::fmt::Debug for Watch {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        out.debug_struct("Watch").field("deadline", &self.deadline).finish_non_exhaustive()
    }
}

impl Watch {
    fn report(&self, part: f64) {
        if let Some(progress) = &self.progress {
            progress(part);
        }
    }

    fn look(&self) -> Result<(), RenderError> {
        if self.cancelled.load(Ordering::Acquire) {
            return Err(RenderError::Cancelled);
        }
        match self.deadline {
            Some(deadline) if Instant::now() >= deadline => Err(RenderError::Deadline),
            _ => Ok(()),
        }
    }
}

/// Why a texture was not made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RenderError {
    /// Nobody waits for it any more.
    #[error("the request was cancelled")]
    Cancelled,
    /// It took too long.
    #[error("the deadline passed")]
    Deadline,
    /// The device is gone: drop the renderer and open a new one.
    #[error("the graphics device was lost: {0}")]
    DeviceLost(String),
    /// The driver failed.
    #[error("{0}")]
    Gpu(String),
    /// An image that the scene names was not handed over.
    #[error("the image {0} is missing")]
    MissingImage(String),
    /// The request, or an image, does not fit the scene.
    #[error("{}", .0.iter().map(|e| format!("{}: {}", e.pointer, e.detail)).collect::<Vec<_>>().join("; "))]
    Invalid(Vec<FieldError>),
}

impl From<GpuError> for RenderError {
    fn from(error: GpuError) -> Self {
        match error {
            GpuError::Lost(text) => Self::DeviceLost(text),
            GpuError::Late => Self::Deadline,
            // The device may still be busy with what was given up: a new one is needed.
            GpuError::Timeout => Self::DeviceLost(error.to_string()),
            GpuError::NoAdapter(text) | GpuError::Failed(text) => Self::Gpu(text),
        }
    }
}

/// A texture on the host.
#[derive(Debug, Clone, PartialEq)]
pub struct Texture {
    /// Texels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Names of the channels.
    pub channels: &'static [&'static str],
    /// Linear values, row 0 (north) first, channels interleaved.
    pub data: Vec<f32>,
    /// Method `reference`: standard errors of the channels but alpha in the order of the texels, as the data is scaled.
    pub standard_error: Option<Vec<f32>>,
    /// Value that a picture shows as white, before exposure.
    pub white: f32,
    /// Height of the plane that the texels lie in, metres.
    pub plane_m: f64,
    /// What each stage took; those that were kept from earlier requests are absent.
    pub timings: Vec<(&'static str, Duration)>,
}

/// The renderer: a device, and what it keeps between requests.
pub struct Renderer {
    gpu: Gpu,
    tables: Kept<(Arc<HostTables>, Arc<DeviceTables>)>,
    sources: Kept<Arc<Mutex<Source>>>,
    fields: Kept<Arc<Field>>,
    closures: Kept<Arc<Target>>,
    slices: Kept<Arc<DeviceSlice>>,
    lights: Kept<Arc<Light>>,
    beams: Kept<Arc<GroundSun>>,
}

impl std::fmt::Debug for Renderer {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        out.debug_struct("Renderer").field("gpu", &self.gpu).finish_non_exhaustive()
    }
}

/// Scenes, suns and moments whose results stay on the device.
const KEPT: usize = 8;
/// What moving fields are made from, which for the finest takes most of a gigabyte each: one scene of four layers.
const KEPT_SOURCES: usize = 4;
/// The same of the sun's beam on the ground, 16 MiB at most each: shadow and irradiance of a moment follow one another.
const KEPT_BEAMS: usize = 4;

impl Renderer {
    /// Opens the best adapter, compiles every shader, tests the driver and renders one small sky, so that the first
    /// request finds everything warm.
    ///
    /// # Errors
    /// [`GpuError::NoAdapter`] says what to install.
    pub fn new(options: &RendererOptions) -> Result<Self, GpuError> {
        let gpu = Gpu::open(options.adapter.as_deref(), options.filtering)?;
        let mut renderer = Self {
            gpu,
            tables: Kept::new(KEPT),
            sources: Kept::new(KEPT_SOURCES),
            fields: Kept::new(KEPT),
            closures: Kept::new(KEPT),
            slices: Kept::new(KEPT),
            lights: Kept::new(KEPT),
            beams: Kept::new(KEPT_BEAMS),
        };
        renderer.warm_up().map_err(|e| GpuError::Failed(e.to_string()))?;
        Ok(renderer)
    }

    /// The adapter in use.
    pub fn adapter(&self) -> &AdapterSummary {
        &self.gpu.summary
    }

    /// Drivers compile a shader at its first dispatch: each runs once on a tiny scene.
    fn warm_up(&mut self) -> Result<(), RenderError> {
        const SCENE: &[u8] = br#"{"domain": {"resolution": 4}, "layers": [{"thickness": {"kind": "stratocumulus"},
            "droplets": {"henyey_greenstein": 0, "extinction_per_m": 0.01}}]}"#;
        let scene = Scene::from_json(SCENE).map_err(|e| RenderError::Gpu(e.to_string()))?;
        let tables = scene.mixes().iter().map(|mix| MixTables::build(mix, &|_| ()).map(Arc::new)).collect();
        let tables = Result::<Vec<_>, _>::map_err(tables, |e| RenderError::Gpu(e.to_string()))?;
        let scene = Arc::new(scene);
        let cloud = |method| Request {
            method: Some(method),
            // The smallest tables will do.
            tolerance: 1.0,
            ..Request::new(TextureKind::Cloud, Format::F32)
        };
        let clouds = [Method::Analytic, Method::Tabulated].map(cloud);
        let rest = [TextureKind::Shadow, TextureKind::Irradiance, TextureKind::Thickness];
        for request in clouds.into_iter().chain(rest.map(|texture| Request::new(texture, Format::F32))) {
            let job = Job { scene: Arc::clone(&scene), request, tables: tables.clone(), images: HashMap::new() };
            self.render(&job, &Watch::default())?;
        }
        Ok(())
    }

    /// Makes a texture.
    ///
    /// # Errors
    /// See [`RenderError`]; after [`RenderError::DeviceLost`] the renderer is of no more use.
    pub fn render(&mut self, job: &Job, watch: &Watch) -> Result<Texture, RenderError> {
        job.request.check(&job.scene).map_err(RenderError::Invalid)?;
        let images = job.scene.check_images(&job.images);
        if !images.errors.is_empty() {
            return Err(RenderError::Invalid(images.errors));
        }
        let mut clock = Clock::default();
        let size = job.request.size.unwrap_or(job.scene.domain.resolution);
        let Shaded { data, standard_error, white, plane_m } = match job.scene.layers.len() {
            1.. if job.tables.len() == job.scene.layers.len() => self.with_clouds(job, watch, size, &mut clock)?,
            1.. => return Err(RenderError::Gpu("a layer came without its tables".to_owned())),
            0 => Shaded {
                data: frame::clear_sky(&job.scene, &job.request, size),
                standard_error: None,
                white: 1.0,
                plane_m: 0.0,
            },
        };
        let mut texture = Texture {
            width: size,
            height: size,
            channels: job.request.texture.channels(),
            data,
            standard_error,
            white: if job.request.texture == TextureKind::Thickness { white } else { self.white(job) },
            plane_m,
            timings: clock.timings,
        };
        finish(&mut texture, &job.request);
        self.gpu.check()?;
        Ok(texture)
    }

    fn with_clouds(&mut self, job: &Job, watch: &Watch, size: u32, clock: &mut Clock) -> Result<Shaded, RenderError> {
        watch.look()?;
        let needs = job.request.texture;
        let fields = clock.time("field", || self.fields(job, watch))?;
        let moment = frame::Moment::new(job, &fields);
        if matches!(needs, TextureKind::Shadow | TextureKind::Irradiance) && moment.plan.method == Method::Reference {
            return self.traced(job, watch, size, &fields, &moment, clock);
        }
        let by_monte_carlo = needs == TextureKind::Cloud && moment.plan.method == Method::Reference;
        // Monte Carlo adds the sun's light to texels that were shaded without it.
        let sun_light = |layer: &frame::LayerMoment| if by_monte_carlo { [0.0; 4] } else { layer.frame.sun_light };
        let frames: Vec<[wgpu::Buffer; 2]> = moment
            .layers
            .iter()
            .map(|layer| {
                let shaded = Frame { sun_light: sun_light(layer), ..layer.frame };
                [&layer.frame, &shaded].map(|frame| self.gpu.uniform("frame", frame))
            })
            .collect();
        watch.look()?;
        let tables = match needs {
            TextureKind::Thickness => Vec::new(),
            _ => clock.time("tables", || Ok::<_, RenderError>(self.device_tables(&moment, job)))?,
        };
        let light = match needs {
            TextureKind::Thickness | TextureKind::Shadow => None,
            TextureKind::Cloud | TextureKind::Irradiance => {
                Some(clock.time("light", || self.light(job, watch, &fields, &moment, &frames, &tables))?)
            }
        };
        let suns = match needs {
            TextureKind::Cloud => clock.time("slice", || Ok::<_, RenderError>(self.suns(job, &tables, &moment)))?,
            _ => Vec::new(),
        };
        let layer_inputs = |number: usize| shade::LayerInputs {
            frame: &frames[number][1],
            field: &fields[number],
            tables: tables.get(number).map(|(_, device)| &**device),
            method: suns.get(number).map(Sun::method),
            light: light.as_deref().and_then(|light| light.layers.get(number)),
        };
        let inputs = shade::Inputs {
            layers: drawn(job).into_iter().map(layer_inputs).collect(),
            gathered: light.as_deref().map(|light| &light.gathered),
        };
        let view = view(job, size, &moment)?;
        let mut data = clock.time("shade", || self.bands(job, &inputs, &view, &moment, watch))?;
        let mut standard_error = None;
        if by_monte_carlo {
            let thickness = self.gpu.read_map(&fields[0].thickness, 0, watch.deadline)?;
            let trace = || exact::add_sunlight(job, &moment.layers[0].frame, &view, &thickness, &mut data, watch);
            standard_error = Some(clock.time("reference", trace)?);
        }
        let plane_m = if needs == TextureKind::Cloud { moment.plane_m(&job.request) } else { 0.0 };
        let white = drawn(job).into_iter().map(|number| fields[number].depth_m).sum::<f32>().max(1.0);
        Ok(Shaded { data, standard_error, white, plane_m })
    }

    /// Light on the ground by Monte Carlo.
    fn traced(
        &self,
        job: &Job,
        watch: &Watch,
        size: u32,
        fields: &[Arc<Field>],
        moment: &frame::Moment,
        clock: &mut Clock,
    ) -> Result<Shaded, RenderError> {
        let read = |field: &Arc<Field>| self.gpu.read_map(&field.thickness, 0, watch.deadline);
        let thickness = fields.iter().map(read).collect::<Result<Vec<_>, _>>()?;
        let trace = || exact_light::trace_ground(job, moment, &thickness, size, watch);
        let exact_light::Traced { data, standard_error } = clock.time("reference", trace)?;
        Ok(Shaded { data, standard_error: Some(standard_error), white: 1.0, plane_m: 0.0 })
    }

    fn bands(
        &mut self,
        job: &Job,
        inputs: &shade::Inputs<'_>,
        view: &View,
        moment: &frame::Moment,
        watch: &Watch,
    ) -> Result<Vec<f32>, RenderError> {
        let texture = job.request.texture;
        let rows = shade::band_rows(view.size, moment.cuts(view, texture));
        let mut data = Vec::with_capacity(view.size as usize * view.size as usize * texture.channels().len());
        for first_row in (0..view.size).step_by(rows as usize) {
            watch.look()?;
            let band = View { first_row, rows: rows.min(view.size - first_row), ..*view };
            let make = || Ok::<_, RenderError>(Arc::new(shade::ground_sun(&self.gpu, inputs, &band, watch.deadline)?));
            let sun = match shade::is_on_the_ground(texture) {
                // Bands of larger textures would only push each other out.
                true if rows == view.size => {
                    let key = format!("{} {} {} {:?}", job.scene.id(), moment.time_key(job), view.size, drawn(job));
                    Some(self.beams.get_or(&key, make)?)
                }
                true => Some(make()?),
                false => None,
            };
            data.extend(shade::band(&self.gpu, texture, inputs, sun.as_deref(), &band, watch.deadline)?);
        }
        Ok(data)
    }

    /// The fields of all layers, lowest first.
    fn fields(&mut self, job: &Job, watch: &Watch) -> Result<Vec<Arc<Field>>, RenderError> {
        let time_s = job.request.time_s;
        let make = |number: usize| {
            self.fields.get_or(&frame::field_key(job, number), || {
                let source = source(&self.gpu, &mut self.sources, job, number, watch)?;
                let mut source = source.lock().unwrap_or_else(PoisonError::into_inner);
                let [offset_uv, _] = frame::offsets(job, number);
                Ok(Arc::new(source.at(&self.gpu, time_s, offset_uv, watch.deadline)?))
            })
        };
        (0..job.scene.layers.len()).map(make).collect()
    }

    fn device_tables(&mut self, moment: &frame::Moment, job: &Job) -> Vec<(Arc<HostTables>, Arc<DeviceTables>)> {
        let make = |(layer, tables): (&frame::LayerMoment, &Arc<MixTables>)| {
            let made = self.tables.get_or::<std::convert::Infallible>(&layer.mix_key(tables), || {
                let host = HostTables::new(tables, layer.extinction_per_m);
                let device = DeviceTables::new(&self.gpu, &host);
                Ok((Arc::new(host), Arc::new(device)))
            });
            match made {
                Ok(tables) => tables,
                Err(never) => match never {},
            }
        };
        moment.layers.iter().zip(&job.tables).map(make).collect()
    }

    fn closure(&mut self, tables: &MixTables, host: &HostTables, layer: &frame::LayerMoment) -> Arc<Target> {
        let cosine: f64 = layer.frame.sun[3].into();
        let key = format!("{} {cosine}", layer.mix_key(tables));
        let made = self.closures.get_or::<std::convert::Infallible>(&key, || {
            let map = slice::closure(tables, host.ratio, cosine);
            Ok(Arc::new(slice::upload(&self.gpu, "closure", &map)))
        });
        match made {
            Ok(closure) => closure,
            Err(never) => match never {},
        }
    }

    /// Radiance tables cut at the sun; made here if the caller brought none of the size that the plan wants.
    fn slice(
        &mut self,
        tables: &MixTables,
        host: &HostTables,
        layer: &frame::LayerMoment,
        detail: Detail,
    ) -> Arc<DeviceSlice> {
        let cosine: f64 = layer.frame.sun[3].into();
        let key = format!("{} {detail:?} {cosine}", layer.mix_key(tables));
        let made = self.slices.get_or::<std::convert::Infallible>(&key, || {
            let radiance = tables.radiance(detail, &|_| ());
            Ok(Arc::new(DeviceSlice::new(&self.gpu, &HostSlice::new(&radiance, host.ratio, cosine))))
        });
        match made {
            Ok(slice) => slice,
            Err(never) => match never {},
        }
    }

    /// What the plan's method needs for this sun, of each layer.
    fn suns(&mut self, job: &Job, tables: &[(Arc<HostTables>, Arc<DeviceTables>)], moment: &frame::Moment) -> Vec<Sun> {
        let layers = moment.layers.iter().zip(&job.tables).zip(tables);
        layers
            .map(|((layer, mix), (host, _))| match (moment.plan.method, moment.plan.detail) {
                (Method::Tabulated, detail) => Sun::Slice(self.slice(mix, host, layer, detail.unwrap_or(Detail::Fine))),
                // Monte Carlo adds its light to texels that were shaded without a sun, by either method.
                (Method::Analytic | Method::Reference, _) => Sun::Closure(self.closure(mix, host, layer)),
            })
            .collect()
    }

    fn light(
        &mut self,
        job: &Job,
        watch: &Watch,
        fields: &[Arc<Field>],
        moment: &frame::Moment,
        frames: &[[wgpu::Buffer; 2]],
        tables: &[(Arc<HostTables>, Arc<DeviceTables>)],
    ) -> Result<Arc<Light>, RenderError> {
        let key = format!("{} {} {}", job.scene.id(), moment.time_key(job), moment.plan.light_key());
        self.lights.get_or(&key, || Ok(Arc::new(lit(&self.gpu, job, watch, fields, moment, frames, tables)?.light)))
    }

    /// White of a picture: twice a white, diffuse surface above the clouds under the scene's light, so that the glare of
    /// a low sun and silver linings keep their shape.
    fn white(&self, job: &Job) -> f32 {
        let irradiance = 2.0 * frame::irradiance_above(&job.scene).into_iter().fold(0.0, f64::max);
        let white = match job.request.texture {
            TextureKind::Cloud => irradiance / std::f64::consts::PI,
            TextureKind::Irradiance => irradiance,
            TextureKind::Shadow | TextureKind::Thickness => 1.0,
        };
        if white > 0.0 { white as f32 } else { 1.0 }
    }
}

/// Texels before what a request asks of finished ones.
struct Shaded {
    data: Vec<f32>,
    standard_error: Option<Vec<f32>>,
    /// White of a picture of the thickness.
    white: f32,
    plane_m: f64,
}

/// Layers that a texture shows, in the order in which they are drawn: from the viewer on.
fn drawn(job: &Job) -> Vec<usize> {
    let mut layers: Vec<usize> = match job.request.layer {
        // Light knows all layers, and so does what reaches the ground.
        Some(layer) if matches!(job.request.texture, TextureKind::Cloud | TextureKind::Thickness) => {
            vec![layer as usize]
        }
        _ => (0..job.scene.layers.len()).collect(),
    };
    if job.request.side == Side::Above {
        layers.reverse();
    }
    layers
}

/// The light of a moment, and what lies on the way to it.
fn lit(
    gpu: &Gpu,
    job: &Job,
    watch: &Watch,
    fields: &[Arc<Field>],
    moment: &frame::Moment,
    frames: &[[wgpu::Buffer; 2]],
    tables: &[(Arc<HostTables>, Arc<DeviceTables>)],
) -> Result<Lit, RenderError> {
    let layer = |number: usize| light::LayerInputs {
        frame: &moment.layers[number].frame,
        uniform: &frames[number][0],
        field: &fields[number],
        tables: &tables[number].1,
        blur_texels: moment.blur_texels(&moment.layers[number]),
    };
    let layers: Vec<_> = (0..moment.layers.len()).map(layer).collect();
    let inputs = light::LightInputs {
        layers: &layers,
        sky: job.scene.light.sky.map(|value| value.get()),
        grids: &moment.grids,
        transport: moment.plan.transport,
        albedo: &moment.albedo(job)?,
        settled: moment.plan.exchange_change,
    };
    Ok(light::light(gpu, &inputs, watch.deadline)?)
}

/// What a layer's field is made from. Kept only where the field moves: a still one is made once.
fn source(
    gpu: &Gpu,
    kept: &mut Kept<Arc<Mutex<Source>>>,
    job: &Job,
    number: usize,
    watch: &Watch,
) -> Result<Arc<Mutex<Source>>, RenderError> {
    let layer = &job.scene.layers[number];
    let make = || {
        let image = frame::thickness_image(job, number)?;
        let resolution = field_resolution(&job.scene, &job.request);
        let source = Source::new(gpu, layer, resolution, job.scene.extent_m(), image, watch.deadline)?;
        Ok(Arc::new(Mutex::new(source)))
    };
    match field::moves(&layer.thickness, &layer.wind) {
        true => kept.get_or(&frame::source_key(job, number), make),
        false => make(),
    }
}

/// What a method keeps for one sun.
enum Sun {
    Closure(Arc<Target>),
    Slice(Arc<DeviceSlice>),
}

impl Sun {
    fn method(&self) -> shade::CloudMethod<'_> {
        match self {
            Self::Closure(closure) => shade::CloudMethod::Analytic(closure),
            Self::Slice(slice) => shade::CloudMethod::Tabulated(slice),
        }
    }
}

/// The host struct of a view, without its band.
fn view(job: &Job, size: u32, moment: &frame::Moment) -> Result<View, RenderError> {
    let request = &job.request;
    let (mut towards, mut eye) = ([0.0; 4], [0.0; 4]);
    match request.viewer {
        Viewer::Parallel(direction) => towards[..3].copy_from_slice(&direction.map(|part| part as f32)),
        Viewer::At(place) => {
            let plane_m = moment.plane_m(request);
            let (wrong_side, where_to) = match request.side {
                Side::Below => (place[2] >= plane_m, "below the cloud base"),
                Side::Above => (place[2] <= plane_m, "above the highest cloud top"),
            };
            if wrong_side {
                let detail = format!("z = {} m is not {where_to}, {plane_m} m", place[2]);
                return Err(RenderError::Invalid(vec![FieldError { pointer: "eye".to_owned(), detail }]));
            }
            towards[3] = 1.0;
            eye[..3].copy_from_slice(&place.map(|part| part as f32));
        }
    }
    Ok(View {
        towards,
        eye,
        size,
        first_row: 0,
        rows: size,
        from_above: (request.side == Side::Above).into(),
        part: match request.component {
            request::Component::Total => 0,
            request::Component::Direct => 1,
            request::Component::Diffuse => 2,
        },
        peak: request.peak.into(),
        plane_m: moment.plane_m(request) as f32,
        first: 1,
    })
}

/// Alpha that counts as none where colour is divided by it.
const LEAST_ALPHA: f32 = 1e-20;

/// What a request asks of finished texels: alpha, scale.
fn finish(texture: &mut Texture, request: &Request) {
    let (channels, scale) = (texture.channels.len(), request.scale as f32);
    let picture = request.format == Format::Png && request.encoding == request::Encoding::Srgb;
    for (i, texel) in texture.data.chunks_mut(channels).enumerate() {
        let (colour, alpha) = texel.split_at_mut(channels.min(3));
        // A picture's white goes with the light, so a scale would cancel.
        let mut factor = if picture { 1.0 } else { scale };
        if let (true, Some(alpha)) = (request.straight_alpha, alpha.first()) {
            // Below this there is nothing to see, and the quotient would be noise or overflow.
            factor = if *alpha > LEAST_ALPHA { factor / alpha } else { 0.0 };
        }
        let lit = colour.len();
        let errors = texture.standard_error.iter_mut().flat_map(|errors| errors.iter_mut().skip(lit * i).take(lit));
        colour.iter_mut().chain(errors).for_each(|value| *value = (*value * factor).min(f32::MAX));
    }
}

/// Stage times.
#[derive(Default)]
struct Clock {
    timings: Vec<(&'static str, Duration)>,
}

impl Clock {
    fn time<T, E>(&mut self, stage: &'static str, work: impl FnOnce() -> Result<T, E>) -> Result<T, E> {
        let start = Instant::now();
        let result = work()?;
        self.timings.push((stage, start.elapsed()));
        Ok(result)
    }
}

/// Channels of a texture with the standard errors of its light, those of colours as a layer of their own, as OpenEXR
/// names them.
fn with_errors(texture: TextureKind) -> &'static [&'static str] {
    match texture {
        TextureKind::Cloud => &["R", "G", "B", "A", "error.R", "error.G", "error.B"],
        TextureKind::Irradiance => &["R", "G", "B", "error.R", "error.G", "error.B"],
        TextureKind::Shadow | TextureKind::Thickness => &["R", "error"],
    }
}

/// The bytes of a file for a rendered texture, in the format that its request names.
///
/// # Errors
/// When a texel is not finite, which would be a fault of the renderer.
pub fn encode(texture: &Texture, job: &Job) -> Result<Vec<u8>, EncodeError> {
    let (scene, request) = (&job.scene, &job.request);
    let pixels = encode::Pixels {
        width: texture.width,
        height: texture.height,
        channels: texture.channels,
        data: &texture.data,
        alpha: if request.straight_alpha { encode::Alpha::Straight } else { encode::Alpha::Premultiplied },
    };
    match request.format {
        Format::F32 => encode::to_f32(&pixels),
        Format::Exr => {
            let depth = if request.depth == 32 { encode::Depth::Float } else { encode::Depth::Half };
            let metadata = frame::metadata(scene, request, texture);
            let Some(errors) = &texture.standard_error else { return encode::to_exr(&pixels, &metadata, depth) };
            let count = texture.channels.len();
            let texels = texture.data.chunks(count).zip(errors.chunks(count.min(3)));
            let data: Vec<f32> = texels.flat_map(|(texel, error)| texel.iter().chain(error)).copied().collect();
            encode::to_exr(
                &encode::Pixels { channels: with_errors(request.texture), data: &data, ..pixels },
                &metadata,
                depth,
            )
        }
        Format::Png => {
            let depth = if request.depth == 16 { encode::PictureDepth::Sixteen } else { encode::PictureDepth::Eight };
            let picture = match request.encoding {
                request::Encoding::Linear => encode::Picture::mask(depth),
                request::Encoding::Srgb => encode::Picture {
                    exposure_stops: request.exposure_stops,
                    white: texture.white,
                    // Shadow and thickness are parts of a whole, not light: a tone curve would bend them.
                    tonemap: match (request.tonemap, request.texture) {
                        (request::Tonemap::None, _) | (_, TextureKind::Shadow | TextureKind::Thickness) => {
                            encode::Tonemap::None
                        }
                        _ => encode::Tonemap::Filmic,
                    },
                    transfer: encode::Transfer::Srgb,
                    depth,
                },
            };
            encode::to_png(&pixels, &picture)
        }
    }
}
