//! Every stage's input and output for one request: what tests compare with the twins in `reference`.

use super::{Job, RenderError, Renderer, Watch, frame, view};
use crate::field::FieldStages;
use crate::gpu::HostMap;
use crate::gpu::layout::{Budget, Exchange, Frame, View};
use crate::light::Grid;
use crate::request::TextureKind;
use crate::shade;
use crate::slice::{self, HostSlice, HostTables};
use std::sync::{Arc, PoisonError};

/// Results of the stages, with one pass of the exchange between cloud and ground.
#[derive(Debug, Clone)]
pub struct Stages {
    /// The moment.
    pub frame: Frame,
    /// The exchange grid.
    pub exchange: Exchange,
    /// The passes that made the thickness, if any did.
    pub field: Option<FieldStages>,
    /// Thickness, metres.
    pub thickness: HostMap,
    /// Albedo of the ground on the exchange grid.
    pub albedo: HostMap,
    /// The sun's beam at the cloud base.
    pub beam: HostMap,
    /// Diffuse light at the cloud base, before any exchange.
    pub diffuse: HostMap,
    /// Part of light from below that the cloud does not send back.
    pub not_reflected: HostMap,
    /// Irradiance of the ground before any exchange.
    pub source: HostMap,
    /// Light leaving the ground, all mip levels.
    pub up: Vec<HostMap>,
    /// Light from the ground arriving at the cloud base, unbalanced.
    pub arriving: HostMap,
    /// The balance.
    pub budget: Budget,
    /// Diffuse light leaving the cloud base, all mip levels.
    pub down: Vec<HostMap>,
    /// Light from the ground arriving at the cloud base.
    pub upwelling: HostMap,
    /// Irradiance of the ground after the pass.
    pub irradiance: HostMap,
    /// Closure of the orders for this sun: method "analytic".
    pub closure: HostMap,
    /// Radiance tables cut at this sun: method "tabulated", where the request's plan uses it.
    pub slice: Option<HostSlice>,
    /// Tables of the mix.
    pub tables: Arc<HostTables>,
    /// The view.
    pub view: View,
    /// The texture asked for, made from the light after one pass.
    pub output: Vec<f32>,
}

impl Renderer {
    /// Renders the stages of a job one by one, with exactly one pass of the exchange, and reads every result back. For
    /// tests and charts; textures of at most a band (512 Ki texels).
    ///
    /// # Errors
    /// As [`Renderer::render`]; a scene without clouds has no stages.
    pub fn inspect(&mut self, job: &Job, watch: &Watch) -> Result<Stages, RenderError> {
        if job.scene.layers.is_empty() {
            return Err(RenderError::Gpu("a scene without clouds has no stages".to_owned()));
        }
        let deadline = watch.deadline;
        let field = self.field(job, watch)?;
        let field_stages = {
            let source = super::source(&self.gpu, &mut self.sources, job, watch)?;
            let mut source = source.lock().unwrap_or_else(PoisonError::into_inner);
            let [offset_uv, _] = frame::offsets(job);
            source.inspect(&self.gpu, job.request.time_s, offset_uv, deadline)?
        };
        let moment = frame::Moment::new(job, &field);
        let frame_uniform = self.gpu.uniform("frame", &moment.frame);
        let (tables, device_tables) = self.device_tables(&moment, job);
        let closure_target = self.closure(job, &tables, &moment);
        let sun = self.sun(job, &tables, &moment);
        let slice = moment.plan.detail.map(|detail| {
            let radiance = job.tables[0].radiance(detail, &|_| ());
            HostSlice::new(&radiance, tables.ratio, moment.frame.sun[3].into())
        });
        let albedo = moment.albedo(job)?;
        let gpu = &self.gpu;
        let exchange = moment.grid.exchange(&moment.frame);
        let grid = Grid::new(gpu, &exchange, slice::upload(gpu, "albedo", &albedo));
        grid.start(gpu, &frame_uniform, &field.thickness, &device_tables, deadline)?;
        let budget = grid.pass(gpu, &grid.source, &grid.even, &grid.irradiance[0], deadline)?;
        let size = job.request.size.unwrap_or(job.scene.domain.resolution);
        let view = view(job, size, &moment)?;
        let map = |target| gpu.read_map(target, 0, deadline);
        let mips = |target: &crate::gpu::Target| {
            (0..target.levels.len()).map(|level| gpu.read_map(target, level, deadline)).collect::<Result<Vec<_>, _>>()
        };
        let [irradiance, _] = &grid.irradiance;
        let mut stages = Stages {
            frame: moment.frame,
            exchange,
            field: field_stages,
            thickness: map(&field.thickness)?,
            albedo,
            beam: map(&grid.beam)?,
            diffuse: map(&grid.diffuse)?,
            not_reflected: map(&grid.not_reflected)?,
            source: map(&grid.source)?,
            up: mips(&grid.up)?,
            arriving: map(&grid.arriving)?,
            budget,
            down: mips(&grid.down)?,
            upwelling: map(&grid.upwelling)?,
            irradiance: map(irradiance)?,
            closure: map(&closure_target)?,
            slice,
            tables,
            view,
            output: Vec::new(),
        };
        let exchange_uniform = gpu.uniform("exchange", &exchange);
        let light = grid.finish();
        let inputs = shade::Inputs {
            frame: &frame_uniform,
            exchange: &exchange_uniform,
            field: &field,
            tables: Some(&device_tables),
            method: (job.request.texture == TextureKind::Cloud).then_some(sun.method()),
            light: Some(&light),
        };
        stages.output = shade::band(gpu, job.request.texture, &inputs, &view, deadline)?;
        Ok(stages)
    }
}
