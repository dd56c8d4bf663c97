//! The clouds of a job as the tracers take them: the one place that reads where they are.

use crate::cumulus::{self, Index};
use crate::gpu::HostMap;
use crate::ground::GroundMap;
use crate::job::{Job, RenderError};
use crate::moment::Moment;
use crate::reference::Map;
use crate::reference::monte_carlo::MAX_OPTICAL_DEPTH;
use crate::reference::monte_carlo::volume::{RgbPart, RgbVolume, Shape};
use crate::scene::FieldError;
use glam::{DVec2, DVec3};

/// Where the clouds are at a moment, and the ground's albedo.
pub(super) struct Clouds {
    /// Of each stratiform layer, metres; of a ragged one its columns.
    pub(super) thickness: Vec<Map>,
    cumulus: Option<(Index, DVec2)>,
    pub(super) ground: Map,
}

impl Clouds {
    /// `thickness` are the maps of the moment's stratiform layers.
    pub(super) fn new(job: &Job, moment: &Moment, thickness: &[HostMap]) -> Result<Self, RenderError> {
        let (scene, time_s) = (job.scene(), job.request().time_s);
        let (extent_m, texels) = (scene.extent_m(), scene.resolution());
        let cumulus = scene.cumulus.as_ref().map(|layer| {
            let body = cumulus::body(layer, extent_m, extent_m / f64::from(texels), time_s);
            (Index::new(&body), cumulus::drift_m(&layer.wind, time_s, extent_m))
        });
        let ground = GroundMap::new(&scene.ground.albedo, job.images())?.exact();
        let clouds = Self { thickness: thickness.iter().map(Map::from).collect(), cumulus, ground };
        clouds.check_depths(job, moment)?;
        Ok(clouds)
    }

    /// The layers, in the order of the job's tables.
    pub(super) fn parts<'a>(&'a self, job: &'a Job, moment: &Moment) -> Vec<RgbPart<'a>> {
        let sheets = moment.layers.iter().zip(&self.thickness).map(|(layer, map)| {
            let (base_m, offset_uv) = (layer.base_m, layer.offset_uv);
            let shape = match layer.ragged {
                true => Shape::Columns { base_m, columns: map, offset_uv },
                false => Shape::Layer { base_m, thickness: map, offset_uv },
            };
            (shape, layer.extinction_per_m)
        });
        let cumulus = self.cumulus.as_ref().zip(job.scene().cumulus.as_ref()).zip(job.tables().last());
        let cumulus = cumulus.map(|(((index, drift_m), layer), tables)| {
            let cross_sections = tables.channels.each_ref().map(|channel| channel.cross_section_um2);
            let shape = Shape::Cumulus { index, drift_m: *drift_m };
            (shape, layer.droplets.extinction_per_m(cross_sections))
        });
        let parts = sheets.chain(cumulus).zip(job.tables());
        let part = parts.map(|((shape, extinction_per_m), tables)| RgbPart {
            shape,
            extinction_per_m,
            albedo: tables.channels.each_ref().map(|channel| channel.albedo),
            phase: tables.channels.each_ref().map(|channel| &channel.phase),
        });
        part.collect()
    }

    /// All of a scene under a beam of this irradiance on a plane that faces the sun.
    pub(super) fn scene<'a>(&'a self, parts: &'a [RgbPart<'a>], moment: &Moment, beam: [f64; 3]) -> RgbVolume<'a> {
        RgbVolume {
            parts,
            ground_albedo: &self.ground,
            extent_m: moment.extent_m,
            towards_sun: DVec3::from_array(moment.illumination.towards_sun_seen()),
            sun_irradiance: beam,
            sky_radiance: moment.illumination.sky,
        }
    }

    /// The sun's beam above the clouds as they are seen: as the fast methods have it.
    pub(super) fn beam(&self, job: &Job, moment: &Moment) -> [f64; 3] {
        match &self.cumulus {
            Some((index, _)) if moment.layers.is_empty() => {
                let [low_m, high_m] = index.heights_m();
                moment.illumination.beam_at(job.air(), 0.5 * (low_m + high_m))
            }
            _ => moment.illumination.beam,
        }
    }

    /// Deeper clouds than the tracers take are the request's fault: other methods take them.
    fn check_depths(&self, job: &Job, moment: &Moment) -> Result<(), RenderError> {
        let height_m = |shape: &Shape<'_>| match shape {
            Shape::Cumulus { index, .. } => index.heights_m()[1] - index.heights_m()[0],
            Shape::Layer { thickness: map, .. } | Shape::Columns { columns: map, .. } => {
                map.texels.iter().map(|texel| texel[0]).fold(0.0, f64::max)
            }
        };
        let parts = self.parts(job, moment);
        let depth = |part: &RgbPart<'_>| part.extinction_per_m.into_iter().fold(0.0, f64::max) * height_m(&part.shape);
        let depths = parts.iter().map(depth).enumerate();
        let too_deep = depths.filter(|(_, depth)| *depth > MAX_OPTICAL_DEPTH).map(|(number, depth)| {
            let layer = job.scene().place(number);
            let detail = format!(
                "reference follows light through optical depths of 0 to {MAX_OPTICAL_DEPTH}; layer {layer} has {depth:.0}"
            );
            FieldError { pointer: "method".to_owned(), detail }
        });
        let errors: Vec<FieldError> = too_deep.collect();
        if errors.is_empty() { Ok(()) } else { Err(RenderError::Invalid(errors)) }
    }
}

/// Which of the parts a request shows, if it shows one alone.
pub(super) fn only(job: &Job) -> Option<usize> {
    let place = job.request().wanted.layer()? as usize;
    Some(job.scene().stratiform_index(place).unwrap_or(job.scene().stratiform_count()))
}
