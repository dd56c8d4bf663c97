//! Textures that are shaded in bands.

use super::kept::Kept;
use super::keys::BeamKey;
use crate::gpu::Gpu;
use crate::gpu::layout::View;
use crate::job::{Job, RenderError, Watch};
use crate::moment::Moment;
use crate::request::Component;
use crate::shade::{self, Beams, GroundSun, TowardsSun};
use std::sync::Arc;

/// Texels of bands whose beams are made together, of 16 bytes each, and kept for the next texture on the ground.
const BEAM_TEXELS: usize = 1 << 22;

/// What the shading of all bands of a texture takes.
pub(super) struct Shading<'a> {
    pub(super) job: &'a Job,
    pub(super) moment: &'a Moment,
    pub(super) inputs: shade::Inputs<'a>,
    pub(super) view: &'a View,
    pub(super) watch: &'a Watch,
}

/// Shades a texture in bands, so that a request can be dropped between them.
pub(super) fn bands(
    gpu: &Gpu,
    beams: &mut Kept<BeamKey, Arc<Vec<GroundSun>>>,
    shading: &Shading<'_>,
) -> Result<Vec<f32>, RenderError> {
    let Shading { job, moment, inputs, view, watch } = shading;
    let (kind, wanted) = (job.request().texture(), &job.request().wanted);
    let needs = kind.needs();
    let cuts = if needs.ground_sun {
        moment.sun_cuts()
    } else if needs.slab {
        moment.view_cuts(wanted.plane().and_then(|plane| plane.towards()), view.size[0])
    } else {
        1.0
    };
    let [across, down] = view.size;
    let rows = shade::band_rows(view.size, cuts);
    let band = |first_row: u32| View { first_row, rows: rows.min(down - first_row), ..**view };
    let bands: Vec<View> = (0..down).step_by(rows as usize).map(band).collect();
    let texels = across as usize * down as usize;
    // What is swept over a layer serves many bands.
    let together = BEAM_TEXELS / (across as usize * rows as usize);
    let mut data = Vec::with_capacity(texels * kind.channels().len());
    for bands in bands.chunks(together.max(1)) {
        let mut suns = |peak: bool| {
            let bands: Vec<View> = bands.iter().map(|band| View { peak: peak.into(), ..*band }).collect();
            match bands.first() {
                Some(first) if needs.ground_sun => {
                    beams.get_or(BeamKey::new(job, moment, first), || ground_suns(gpu, inputs, &bands, watch))
                }
                _ => Ok(Arc::default()),
            }
        };
        let peak = view.peak == 1;
        let beam = suns(peak)?;
        let all_light = matches!(wanted.component(), Some(Component::Total | Component::Diffuse { .. }));
        let with_peak = if all_light && !peak { suns(true)? } else { beam.clone() };
        for (number, band) in bands.iter().enumerate() {
            watch.look()?;
            let beams = with_peak.get(number).zip(beam.get(number));
            let beams = beams.map(|(with_peak, beam)| Beams { with_peak, beam });
            data.extend(shade::band(gpu, kind, inputs, beams, band, watch.deadline)?);
        }
    }
    Ok(data)
}

/// What is left of the sun's beam at the texels of some bands, with its peak where their views say so.
pub(super) fn ground_suns(
    gpu: &Gpu,
    inputs: &shade::Inputs<'_>,
    bands: &[View],
    watch: &Watch,
) -> Result<Arc<Vec<GroundSun>>, RenderError> {
    let TowardsSun { suns, steps } = shade::towards_sun(gpu, inputs, bands)?;
    for step in &steps {
        watch.look()?;
        gpu.run("ground_sun", watch.deadline, step)?;
    }
    Ok(Arc::new(suns))
}
