//! Every stage's input and output for one request: what tests compare with the twins in `reference`.

use super::{Job, RenderError, Renderer, Watch, frame, view};
use crate::exchange::stack::LayerLight;
use crate::field::FieldStages;
use crate::gpu::layout::{Frame, Share, View};
use crate::gpu::{HostMap, Target};
use crate::light::{ColumnMaps, Energy};
use crate::request::TextureKind;
use crate::shade;
use crate::slice::{HostSlice, HostTables};
use std::sync::{Arc, PoisonError};

/// Results of the stages of one layer: the request's, or the lowest.
#[derive(Debug, Clone)]
pub struct Stages {
    /// The layer at the moment.
    pub frame: Frame,
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
    /// Beam that the layer above leaves at its base; one texel under the open sun.
    pub above: HostMap,
    /// Beam at the base; fourth channel: red light sent up along slanted rays.
    pub beam: HostMap,
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
    /// The sun's light relative to a slab's under the open sun, seen from below and from above.
    pub shares: [HostMap; 2],
    /// Albedo of the ground on the exchange grid.
    pub albedo: HostMap,
    /// Light that arrives at the layer but for the sun's.
    pub light: LayerLight,
    /// Diffuse irradiance of the ground on the exchange grid.
    pub gathered: HostMap,
    /// Where the light goes.
    pub energy: Energy,
    /// Closure of the orders for this sun: method "analytic".
    pub closure: HostMap,
    /// Radiance tables cut at this sun: method "tabulated", where the request's plan uses it.
    pub slice: Option<HostSlice>,
    /// Tables of the mix.
    pub tables: Arc<HostTables>,
    /// The view.
    pub view: View,
    /// The texture asked for, of this layer alone.
    pub output: Vec<f32>,
}

impl Renderer {
    /// Renders the stages of a job one by one and reads every result back. For tests and charts; textures of at most a band
    /// (512 Ki texels).
    ///
    /// # Errors
    /// As [`Renderer::render`]; a scene without clouds has no stages.
    pub fn inspect(&mut self, job: &Job, watch: &Watch) -> Result<Stages, RenderError> {
        job.request.check(&job.scene).map_err(RenderError::Invalid)?;
        if job.scene.layers.is_empty() || job.tables.len() != job.scene.layers.len() {
            return Err(RenderError::Gpu("a scene without clouds has no stages".to_owned()));
        }
        let number = job.request.layer.unwrap_or(0) as usize;
        let deadline = watch.deadline;
        let fields = self.fields(job, watch)?;
        let field_stages = {
            let source = super::source(&self.gpu, &mut self.sources, job, number, watch)?;
            let mut source = source.lock().unwrap_or_else(PoisonError::into_inner);
            let [offset_uv, _] = frame::offsets(job, number);
            source.inspect(&self.gpu, job.request.time_s, offset_uv, deadline)?
        };
        let moment = frame::Moment::new(job, &fields);
        let (layer, mix, field) = (&moment.layers[number], &job.tables[number], &fields[number]);
        let uniform = |frame: &Frame| [(); 2].map(|()| self.gpu.uniform("frame", frame));
        let frames: Vec<_> = moment.layers.iter().map(|layer| uniform(&layer.frame)).collect();
        let all_tables = self.device_tables(&moment, job);
        let (tables, device_tables) = &all_tables[number];
        let closure_target = self.closure(mix, tables, layer);
        let suns = self.suns(job, &all_tables, &moment);
        let slice = moment
            .plan
            .detail
            .map(|detail| HostSlice::new(&mix.radiance(detail, &|_| ()), tables.ratio, layer.frame.sun[3].into()));
        let gpu = &self.gpu;
        let lit = super::lit(gpu, job, watch, &fields, &moment, &frames, &all_tables)?;
        let (maps, own) = (&lit.maps[number], &lit.light.layers[number]);
        let size = job.request.size.unwrap_or(job.scene.domain.resolution);
        let view = view(job, size, &moment)?;
        let map = |target: &Target| gpu.read_map(target, 0, deadline);
        let colours = |target: &Target| {
            let texels = map(target)?.data;
            Ok::<_, RenderError>(texels.chunks(4).map(|texel| [texel[0], texel[1], texel[2]]).collect::<Vec<_>>())
        };
        let blur_texels = moment.blur_texels(layer);
        let open = || HostMap { width: 1, height: 1, channels: 4, data: vec![1.0; 4] };
        let inputs = shade::LayerInputs {
            frame: &frames[number][0],
            field,
            tables: Some(device_tables),
            method: (job.request.texture == TextureKind::Cloud).then_some(suns[number].method()),
            light: Some(own),
        };
        let inputs = shade::Inputs { layers: vec![inputs], gathered: Some(&lit.light.gathered) };
        let texture = job.request.texture;
        let sun =
            shade::is_on_the_ground(texture).then(|| shade::ground_sun(gpu, &inputs, &view, deadline)).transpose()?;
        Ok(Stages {
            frame: layer.frame,
            field: field_stages,
            thickness: map(&field.thickness)?,
            bounds: map(&field.bounds)?,
            blur_texels,
            entry: map(&maps.entry)?,
            entering: map(maps.entering(blur_texels))?,
            above: lit.maps.get(number + 1).map_or_else(|| Ok(open()), |above| map(&above.beam))?,
            beam: map(&maps.beam)?,
            tilted: map(&maps.tilted)?,
            entered: map(&maps.entered)?,
            reflected: map(&maps.reflected)?,
            column: map(&maps.column)?,
            through: map(&maps.through)?,
            not_reflected: map(&maps.not_reflected)?,
            share: lit.shares[number],
            shares: [map(&own.share[0])?, map(&own.share[1])?],
            albedo: moment.albedo(job)?,
            light: LayerLight { from_above: colours(&own.from_above)?, from_below: colours(&own.from_below)? },
            gathered: map(&lit.light.gathered)?,
            energy: lit.light.energy,
            closure: map(&closure_target)?,
            slice,
            tables: Arc::clone(tables),
            output: shade::band(gpu, texture, &inputs, sun.as_ref(), &view, deadline)?,
            view,
            columns: lit.columns,
        })
    }
}
