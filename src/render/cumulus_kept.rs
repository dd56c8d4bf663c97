//! The layer of cumulus of a job: what of it stays on the device.

use super::kept::Kept;
use crate::cumulus::dressed::{self, Scattering};
use crate::cumulus::lattice::{Lattice, Lighting};
use crate::cumulus::{self, Ray, Relief, Volume};
use crate::frame;
use crate::gpu::{Gpu, HostMap};
use crate::ground::GroundMap;
use crate::job::{Job, RenderError, Watch};
use crate::moment::Moment;
use crate::scene::CumulusShape;
use crate::scene::quantity::Quantity as _;
use crate::shade::{CumulusField, CumulusInputs, CumulusLit, Dressed};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::f64::consts::PI;
use std::sync::Arc;

/// Volumes and lattices that stay: each takes up to some 100 MB.
const KEPT: usize = 3;
/// Places a side of the ground at which the mean of what comes through is found.
const LOOKS: usize = 48;
/// Sun rays are no flatter than this: those of a setting sun would run around the domain for ever.
const LEAST_UP: f64 = 0.01;

/// What of cumulus stays on the device.
pub(super) struct CumulusKept {
    fields: Kept<FieldKey, Arc<CumulusField>>,
    lights: Kept<(FieldKey, Lighting), Arc<CumulusLit>>,
    dressed: Kept<String, Arc<Dressed>>,
}

/// Where the cloud is, but for the wind.
#[derive(PartialEq, Clone)]
struct FieldKey {
    extent_m: f64,
    texel_m: f64,
    base_m: f64,
    edge_m: f64,
    shape: CumulusShape,
    /// Where clouds grow.
    time_s: Option<f64>,
}

/// What comes through to the ground in the mean, as parts of the sun's light: all that goes on nearly straight, and what of it counts
/// as the beam.
struct Through {
    forward: [f64; 3],
    beam: [f64; 3],
}

impl CumulusKept {
    pub(super) fn new() -> Self {
        Self { fields: Kept::new(KEPT), lights: Kept::new(KEPT), dressed: Kept::new(KEPT) }
    }

    /// The job's layer of cumulus, with its light where that is wanted, and the even light that then falls on the ground beside that of
    /// other layers. `decks` are the numbers and thicknesses of the stratiform layers.
    pub(super) fn inputs(
        &mut self,
        gpu: &Gpu,
        job: &Job,
        moment: &Moment,
        decks: &[(usize, HostMap)],
        lit: bool,
        watch: &Watch,
    ) -> Result<Option<(CumulusInputs, [f64; 3])>, RenderError> {
        let scene = job.scene();
        let Some(layer) = &scene.cumulus else { return Ok(None) };
        let (extent_m, time_s) = (scene.extent_m(), job.request().time_s);
        let grows = matches!(layer.shape, CumulusShape::Field { .. });
        let key = FieldKey {
            extent_m,
            texel_m: extent_m / f64::from(scene.resolution()),
            base_m: layer.base_m.get(),
            edge_m: layer.edge_m.get(),
            shape: layer.shape.clone(),
            time_s: grows.then_some(time_s),
        };
        watch.look()?;
        let field = self.fields.get_or_make(key.clone(), || {
            Arc::new(CumulusField::new(gpu, Volume::new(&cumulus::body(layer, extent_m, key.texel_m, time_s))))
        });
        watch.look()?;
        let tables = &job.tables()[scene.layers.len()];
        let channels = &tables.channels;
        let extinction_per_m =
            layer.droplets.extinction_per_m(channels.each_ref().map(|channel| channel.cross_section_um2));
        let beam = [0, 1, 2].map(|c| 1.0 - channels[c].albedo * tables.phases[c].peak_fraction);
        let scattering = channels.each_ref().map(Scattering::new);
        let middle_m = 0.5 * (field.host.base_m.max(field.host.floor_m) + field.host.top_m);
        let light = &moment.illumination;
        let (towards_sun, sun) = (DVec3::from_array(light.towards_sun), light.beam_at(job.air(), middle_m));
        let mut lighting =
            Lighting { extinction_per_m, scattering, towards_sun, sun, above: light.sky, below: [0.0; 3] };
        let above = |number: usize| scene.place(number) > layer.place();
        for (number, map) in decks.iter().rev().filter(|(number, _)| above(*number)) {
            let deck = Deck::new(job, moment, *number, map);
            for c in 0..3 {
                let beam = light.cosine() * lighting.sun[c] * (deck.transmitted[c] - deck.beam[c]).max(0.0) / PI;
                lighting.above[c] = lighting.above[c] * deck.transmitted_even[c] + beam;
                lighting.sun[c] *= deck.beam[c];
            }
        }
        let through = through(&field.host, &lighting, beam);
        let albedo = GroundMap::new(&scene.ground.albedo, job.images())?.mean();
        let direct = [0, 1, 2].map(|c| lighting.sun[c] * light.cosine() * through.forward[c]);
        let mut reflected = albedo;
        let mut reflected_beam = albedo;
        for (number, map) in decks.iter().filter(|(number, _)| !above(*number)) {
            // What lies below a deck sends its light through it; what goes to and fro between them is left out.
            let deck = Deck::new(job, moment, *number, map);
            for c in 0..3 {
                let passed = deck.transmitted_even[c] * reflected[c];
                reflected[c] = deck.reflected_even[c] + deck.transmitted_even[c] * passed;
                reflected_beam[c] = deck.reflected[c] + deck.transmitted[c] * passed;
            }
        }
        lighting.below = [0, 1, 2].map(|c| direct[c] * reflected_beam[c] / PI + lighting.above[c] * reflected[c]);
        let drift = cumulus::drift_m(&layer.wind, time_s, extent_m);
        let made = match lit {
            false => None,
            true => Some(self.lights.get_or_make((key, lighting), || {
                Arc::new(CumulusLit::new(gpu, &Lattice::solve(&field.host, &lighting)))
            })),
        };
        let added = made.as_ref().map_or([0.0; 3], |made| {
            [0, 1, 2].map(|c| {
                let scattered = light.cosine() * lighting.sun[c] * (through.forward[c] - through.beam[c]).max(0.0);
                let sky = if scene.layers.is_empty() { PI * light.sky[c] } else { 0.0 };
                sky + made.added[0][c] + scattered
            })
        });
        let lattice = made.as_ref().map(|made| [made.cell_m, made.floor_m]);
        let relief_m = Relief::new(extent_m).tile_m();
        let frame = frame::cumulus(&field.host, &lighting, beam, lattice, drift, [relief_m, light.sun_diameter]);
        let seen = made.map(|made| {
            let dressed = self.dressed.get_or_make(tables.mix.key(), || {
                Arc::new(Dressed::new(gpu, &channels.each_ref().map(dressed::table)))
            });
            (made, dressed)
        });
        let bound = gpu.uniform("cumulus", &frame);
        Ok(Some((CumulusInputs { frame, bound, field, seen }, added)))
    }
}

/// What a stratiform layer makes of light in the mean over the domain: red, green, blue.
struct Deck {
    /// Part of the sun's beam that goes on nearly straight.
    beam: [f64; 3],
    /// All of it that goes on, and that goes back.
    transmitted: [f64; 3],
    reflected: [f64; 3],
    /// The same of even light.
    transmitted_even: [f64; 3],
    reflected_even: [f64; 3],
}

impl Deck {
    fn new(job: &Job, moment: &Moment, number: usize, thickness: &HostMap) -> Self {
        let (layer, tables) = (&moment.layers[number], &job.tables()[number]);
        let cosine = moment.slant_cosine();
        let channels = thickness.channels as usize;
        let texels = thickness.data.len() / channels;
        let every = texels.div_ceil(LOOKS * LOOKS).max(1) | 1;
        let looks: Vec<f64> =
            thickness.data.iter().step_by(every * channels).map(|&metres| f64::from(metres)).collect();
        let mean = |c: usize| {
            let flux = &tables.fluxes[c];
            let mut sums = [0.0; 5];
            for metres in &looks {
                let depth = metres * layer.extinction_per_m[c];
                let (slant, even) = (flux.beam(depth, cosine), flux.isotropic(depth));
                let beam = (-layer.forward[c] * depth / cosine).exp();
                let all = [beam, slant.transmittance, slant.reflectance, even.transmittance, even.reflectance];
                sums.iter_mut().zip(all).for_each(|(sum, part)| *sum += part);
            }
            sums.map(|sum| sum / looks.len() as f64)
        };
        let means = [mean(0), mean(1), mean(2)];
        let [beam, transmitted, reflected, transmitted_even, reflected_even] =
            [0, 1, 2, 3, 4].map(|which: usize| means.each_ref().map(|mean| mean[which]));
        Self { beam, transmitted, reflected, transmitted_even, reflected_even }
    }
}

/// Looks at a grid of places below the layer.
fn through(volume: &Volume, lighting: &Lighting, beam: [f64; 3]) -> Through {
    let mut towards = lighting.towards_sun;
    towards.z = towards.z.max(LEAST_UP);
    let towards = towards.normalize();
    let low_m = volume.base_m.max(volume.floor_m);
    let extinction = lighting.extinction_per_m;
    let rows = (0..LOOKS).into_par_iter().map(|row| {
        let mut sums = [[0.0; 3]; 2];
        for column in 0..LOOKS {
            let place = (DVec2::new(column as f64, row as f64) + 0.5) / LOOKS as f64 - 0.5;
            let from = (place * volume.extent_m).extend(low_m);
            let enough_m = 20.0 / (extinction[1] * lighting.scattering[1].kept);
            let length_m = volume.length_m(Ray { from, towards }, 4.0 * volume.extent_m, enough_m, volume.voxel_m);
            for c in 0..3 {
                sums[0][c] += (-extinction[c] * lighting.scattering[c].kept * length_m).exp();
                sums[1][c] += (-extinction[c] * beam[c] * length_m).exp();
            }
        }
        sums
    });
    let rows: Vec<[[f64; 3]; 2]> = rows.collect();
    let mean =
        |which: usize| [0, 1, 2].map(|c| rows.iter().map(|row| row[which][c]).sum::<f64>() / (LOOKS * LOOKS) as f64);
    Through { forward: mean(0), beam: mean(1) }
}
