//! From a job to a texture.
//!
//! [`Renderer`] opens a device and keeps it warm; `pipeline` is the one way from a job to texels, in the order of the stages;
//! `file` makes of a texture the bytes of a file; `stages` reads a run back for tests.

mod bands;
mod clear;
mod compass;
mod cumulus_kept;
mod drawn;
mod file;
mod kept;
mod keys;
mod lattices_kept;
mod pipeline;
mod shared;
mod sky;
mod stages;

pub use crate::job::{Fault, Images, Job, RenderError, Texture, Watch};
pub use crate::shade::SkyAir;
pub use file::{encode, encode_to};
pub use shared::SharedClouds;
pub use stages::{SkyStages, Stages};

use crate::cumulus;
use crate::encode::{Exposure, Picture, metered_white};
use crate::gpu::{AdapterSummary, Gpu, GpuError};
use crate::method::{CumulusMethod, Method};
use crate::projection::{Plane, Viewer};
use crate::request::{Cloud, Format, Request, Sky, TextureKind, Wanted};
use crate::scene::Scene;
use crate::scene::quantity::Quantity as _;
use crate::tables::TableLibrary;
use drawn::drawn;
use pipeline::{Clock, Keep, Pipeline, Texels};
use std::sync::Arc;

/// How a renderer is opened.
#[derive(Debug, Clone)]
pub struct RendererOptions {
    /// Part of the wanted adapter's name; the best one when `None`.
    pub adapter: Option<String>,
    /// Let the device filter 32-bit floats if it can. Off, the slower path of devices that can't is used.
    pub filtering: bool,
    /// Bytes of fields, light and the like of earlier renders that may stay for the next ones, on the device and the host together.
    pub kept_bytes: u64,
    /// Clouds that it shares with other renderers, which are all on the same adapter: others may have other bits.
    pub shared: SharedClouds,
}

/// Enough for all of one moving layer of the finest field, and for dozens of usual ones.
const KEPT_BYTES: u64 = 1 << 30;

impl Default for RendererOptions {
    fn default() -> Self {
        Self { adapter: None, filtering: true, kept_bytes: KEPT_BYTES, shared: SharedClouds::default() }
    }
}

/// The renderer: a device, and what it keeps between requests.
pub struct Renderer {
    pipeline: Pipeline,
    kept_bytes: u64,
}

impl std::fmt::Debug for Renderer {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        out.debug_struct("Renderer").field("gpu", &self.pipeline.gpu).finish_non_exhaustive()
    }
}

impl Renderer {
    /// Opens the best adapter, compiles every shader, tests the driver and renders one small sky, so that the first
    /// request finds everything warm.
    ///
    /// # Errors
    /// [`GpuError::NoAdapter`] says what to install.
    pub fn new(options: &RendererOptions) -> Result<Self, GpuError> {
        let gpu = Gpu::open(options.adapter.as_deref(), options.filtering)?;
        let mut renderer =
            Self { pipeline: Pipeline::new(gpu, options.shared.clone()), kept_bytes: options.kept_bytes };
        renderer.warm_up().map_err(|e| GpuError::Failed(e.to_string()))?;
        Ok(renderer)
    }

    /// The adapter in use.
    pub fn adapter(&self) -> &AdapterSummary {
        &self.pipeline.gpu.summary
    }

    /// Bytes of earlier renders that it keeps for the next ones: no more than its options allow.
    pub fn kept_bytes(&mut self) -> u64 {
        self.pipeline.kept_bytes()
    }

    /// Drivers compile a shader at its first dispatch: each runs once on a tiny scene, whose droplets are black, so that their tables are made
    /// at once.
    fn warm_up(&mut self) -> Result<(), RenderError> {
        const SCENE: &[u8] = br#"{"domain": {"extent_m": 64, "resolution": 4}, "layers": [
            {"thickness": {"kind": "stratocumulus"}, "droplets": {"henyey_greenstein": 0, "albedo": 0, "extinction_per_m": 0.01}},
            {"kind": "cumulus", "base_m": 1100, "spheres": [[0, 0, 1110, 16]],
             "droplets": {"henyey_greenstein": 0, "albedo": 0, "extinction_per_m": 0.01}},
            {"flat": "top", "top_m": 2000, "thickness": {"kind": "stratocumulus"},
             "droplets": {"henyey_greenstein": 0, "albedo": 0, "extinction_per_m": 0.01}}]}"#;
        let scene = Scene::from_json(SCENE).map_err(|_refused| RenderError::Defect("the scene to warm up with"))?;
        let scene = Arc::new(scene);
        let library = TableLibrary::new(None);
        let requests = TextureKind::ALL.into_iter().map(|kind| Request::new(kind, Format::F32));
        // Every fast method of slab light; the smallest tables will do.
        let by = |request: Request, method| {
            let wanted = match request.wanted {
                Wanted::Cloud(cloud) => Wanted::Cloud(Cloud { method: Some(method), tolerance: 1.0, ..cloud }),
                Wanted::Sky(sky) => Wanted::Sky(Sky { method: Some(method), tolerance: 1.0, ..sky }),
                other => other,
            };
            Request { wanted, ..request }
        };
        let (shaded, mut requests): (Vec<Request>, Vec<Request>) =
            requests.partition(|request| request.texture().needs().slab);
        for request in shaded {
            requests.extend(Method::fast().map(|method| by(request, method)));
        }
        // So that of light in cumulus.
        for method in CumulusMethod::ALL.map(|(_, method)| method) {
            let by = |wanted: Wanted| match wanted {
                Wanted::Cloud(cloud) => Wanted::Cloud(Cloud { cumulus: method, tolerance: 1.0, ..cloud }),
                Wanted::Sky(sky) => Wanted::Sky(Sky { cumulus: method, tolerance: 1.0, ..sky }),
                other => other,
            };
            let shown = [TextureKind::Cloud, TextureKind::Sky].map(|kind| {
                let request = Request::new(kind, Format::F32);
                Request { wanted: by(request.wanted), ..request }
            });
            requests.extend(shown);
            // These parallel rays look aside from the sun; those from a point take other shaders.
            if let Wanted::Cloud(cloud) = shown[0].wanted {
                let plane = Plane { viewer: Viewer::At([0.0, 0.0, 2.0]), ..cloud.plane };
                requests.push(Request { wanted: Wanted::Cloud(Cloud { plane, ..cloud }), ..shown[0] });
            }
        }
        for request in requests {
            let job = Job::prepare(Arc::clone(&scene), request, &Images::new(), &library, &|_| ())?;
            self.render(&job, &Watch::default())?;
        }
        Ok(())
    }

    /// Makes a texture.
    ///
    /// # Errors
    /// See [`RenderError`]; after [`RenderError::DeviceLost`], [`RenderError::OutOfMemory`] and [`RenderError::Driver`] the renderer is
    /// of no more use.
    pub fn render(&mut self, job: &Job, watch: &Watch) -> Result<Texture, RenderError> {
        let request = job.request();
        let illumination = job.illumination();
        let mut clock = Clock::default();
        let [width, height] = job.texels();
        let mut base_m = job.scene().base_m();
        let (texels, plane_m, deepest_m) = if let Wanted::Compass(sphere) = &request.wanted {
            let draw = || compass::texels(sphere, [width, height], illumination.towards_sun, watch);
            (Texels::plain(clock.time("draw", draw)?), 0.0, 0.0)
        } else if job.scene().layer_count() == 0 && request.wanted.sphere().is_none() {
            let data = if job.points().is_empty() {
                clear::texel(&request.wanted, illumination).repeat(width as usize * height as usize)
            } else {
                clear::point(illumination).repeat(height as usize)
            };
            (Texels::plain(data), 0.0, 0.0)
        } else {
            let run = self.pipeline.run(job, watch, Keep::Texels, &mut clock);
            self.pipeline.shrink(self.kept_bytes);
            let run = run?;
            base_m = run.moment.base_m;
            let plane_m = request.wanted.plane().map_or(0.0, |plane| run.moment.plane_m(plane.side));
            let deepest_m = drawn(job).into_iter().map(|number| run.fields[number].depth_m).sum::<f32>();
            let cumulus = job.scene().cumulus.as_ref();
            let rise_m = cumulus
                .map_or(0.0, |cumulus| cumulus::highest_m(cumulus, job.scene().extent_m()) - cumulus.base_m.get());
            (run.texels, plane_m, deepest_m + rise_m as f32)
        };
        let Texels { mut data, mut standard_error, mut layers } = texels;
        if let Some(parts) = job.plan().spectrum.parts() {
            data = one_channel(&data, parts);
            standard_error = standard_error.map(|errors| one_channel(&errors, parts));
        }
        let channels = request.wanted.channels();
        let mut beside: Vec<&mut [f32]> = standard_error.iter_mut().map(Vec::as_mut_slice).collect();
        beside.extend(layers.iter_mut().flat_map(|layer| [&mut layer.data[..], &mut layer.standard_error[..]]));
        request.output.finish(width, channels, &mut data, &mut beside)?;
        self.pipeline.gpu.check()?;
        let white = white(job, &data, deepest_m.into()) as f32;
        let timings = clock.timings;
        Ok(Texture { width, height, channels, data, standard_error, layers, white, plane_m, base_m, timings })
    }

    /// Renders a job as [`Renderer::render`] does and reads the result of every stage back, with the time of each pass. For
    /// tests and charts.
    ///
    /// # Errors
    /// As [`Renderer::render`]; a texture without clouds has no stages.
    pub fn inspect(&mut self, job: &Job, watch: &Watch) -> Result<Stages, RenderError> {
        if job.scene().stratiform_count() == 0 || !job.request().texture().shows_the_scene() {
            return Err(RenderError::Defect("a texture without clouds has no stages"));
        }
        self.pipeline.gpu.recording.begin();
        let run = self.pipeline.run(job, watch, Keep::Stages, &mut Clock::default());
        let passes = self.pipeline.gpu.recording.end();
        stages::read(&mut self.pipeline, job, watch, run?, passes)
    }
}

/// Light of one wavelength from three channels, of which each has a part.
fn one_channel(data: &[f32], parts: [f64; 3]) -> Vec<f32> {
    let sum = |texel: &[f32]| texel.iter().zip(parts).map(|(value, part)| f64::from(*value) * part).sum::<f64>() as f32;
    data.chunks_exact(3).map(sum).collect()
}

/// The value that a picture of a texture shows as white at exposure 0. `data` is finished.
fn white(job: &Job, data: &[f32], deepest_m: f64) -> f64 {
    let (request, light) = (job.request(), job.illumination());
    let kind = request.texture();
    // Of the scene's own light, in klx where there is air; light that a scene gives, and that of one wavelength, has no such unit.
    let is_luminous = job.air().is_some() && job.plan().spectrum.parts().is_none();
    let scene = || {
        let irradiance = light.total().into_iter().fold(0.0, f64::max);
        kind.white(irradiance, deepest_m) * if is_luminous { kind.white_of_dusk(irradiance) } else { 1.0 }
    };
    match request.output.picture() {
        Some(Picture::Display { exposure: Exposure::Ev100(ev100), .. }) => kind.white_of_camera(ev100),
        Some(Picture::Display { exposure: Exposure::Auto, .. }) => {
            metered_white(request.wanted.channels().len(), data).unwrap_or_else(scene)
        }
        _ => scene(),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test stops where it fails")]
mod tests {
    use super::*;

    /// A moving layer and a sky of layers: whatever a renderer keeps has a part in it.
    fn jobs() -> [Job; 3] {
        const SCENE: &[u8] = br#"{"domain": {"extent_m": 4000, "resolution": 64}, "layers": [
            {"thickness": {"kind": "stratocumulus"}, "droplets": {"henyey_greenstein": 0.8, "albedo": 1, "extinction_per_m": 0.02}}]}"#;
        let (scene, library) = (Arc::new(Scene::from_json(SCENE).unwrap()), TableLibrary::new(None));
        let job = |kind| {
            let request = Request::new(kind, Format::F32);
            Job::prepare(Arc::clone(&scene), request, &Images::new(), &library, &|_| ()).unwrap()
        };
        [TextureKind::Cloud, TextureKind::Sky, TextureKind::Shadow].map(job)
    }

    fn drawn_anew(jobs: &[Job]) -> Vec<Vec<u32>> {
        let mut renderer = Renderer::new(&RendererOptions::default()).unwrap();
        let bits = |job| {
            let texture = renderer.render(job, &Watch::default()).unwrap();
            texture.data.into_iter().map(f32::to_bits).collect()
        };
        jobs.iter().map(bits).collect()
    }

    #[test]
    fn memory_that_the_driver_refuses_is_told_and_a_new_device_draws_the_same_bits() {
        let (jobs, mut renderer) = (jobs(), Renderer::new(&RendererOptions::default()).unwrap());
        let before = drawn_anew(&jobs);
        // 256 GiB, by what every device allows.
        let refused = renderer.pipeline.gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("too much"),
            size: wgpu::Extent3d { width: 8192, height: 8192, depth_or_array_layers: 256 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba32Float,
            usage: wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        let failed = renderer.render(&jobs[0], &Watch::default()).unwrap_err();
        assert!(matches!(failed, RenderError::OutOfMemory(_)), "{failed}");
        assert_eq!(failed.fault(), Fault::Machine);
        drop((refused, renderer));
        assert_eq!(drawn_anew(&jobs), before);
    }

    #[test]
    fn a_lost_device_is_told_whatever_is_asked_of_it_and_a_new_one_draws_the_same_bits() {
        let (jobs, mut renderer) = (jobs(), Renderer::new(&RendererOptions::default()).unwrap());
        let before = drawn_anew(&jobs);
        renderer.render(&jobs[0], &Watch::default()).unwrap();
        renderer.pipeline.gpu.device.destroy();
        // What is kept on it is of no use either.
        for job in jobs.iter().chain(&jobs) {
            let failed = renderer.render(job, &Watch::default()).unwrap_err();
            assert!(matches!(failed, RenderError::DeviceLost(_)), "{failed}");
        }
        drop(renderer);
        assert_eq!(drawn_anew(&jobs), before);
    }
}
