//! The layer of cumulus of a job: what of it stays on the device.

use super::kept::{Kept, Results};
use super::keys::{CumulusKey, MixKey};
use super::shared::SharedClouds;
use crate::cumulus::dressed::{self, Scattering};
use crate::cumulus::lattice::{Lattice, Lighting};
use crate::cumulus::{self, BLOB, Coarse, Ray, Relief, Surface, Trap, Volume};
use crate::frame;
use crate::gpu::layout::CumulusSurface;
use crate::gpu::{Gpu, HostMap};
use crate::ground::GroundMap;
use crate::job::{Job, RenderError, Watch};
use crate::light::Dressed;
use crate::method::CumulusMethod;
use crate::moment::Moment;
use crate::shade::{CoarseNormals, CumulusField, CumulusInputs, CumulusLight, CumulusLit, SunDepth};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::f64::consts::PI;
use std::sync::Arc;

/// Volumes and lattices that stay: each takes up to some 100 MB.
const KEPT: usize = 3;
/// Places a side of the ground at which the mean of what comes through is found.
const LOOKS: usize = 48;
/// What of the light that is scattered falls down, where no lattice knows it.
const DOWN: f64 = 0.5;
/// Sun rays are no flatter than this: those of a setting sun would run around the domain for ever.
const LEAST_UP: f64 = 0.01;

/// What of cumulus stays on the device.
pub(super) struct CumulusKept {
    fields: Kept<CumulusKey, Arc<CumulusField>>,
    lights: Kept<(CumulusKey, Lighting), Arc<CumulusLit>>,
    sun_depths: Kept<(CumulusKey, [f64; 3], [f64; 2]), Arc<SunDepth>>,
    coarse: Kept<(CumulusKey, bool), Arc<CoarseNormals>>,
    dressed: Kept<MixKey, Arc<Dressed>>,
    through: Kept<(CumulusKey, Beam), Through>,
    relief: Option<wgpu::TextureView>,
    shared: SharedClouds,
}

/// What decides on what comes through: see [`Lighting`], and the part of extinction that takes light out of the beam.
#[derive(PartialEq, Clone, Copy)]
struct Beam {
    towards_sun: DVec3,
    extinction_per_m: [f64; 3],
    kept: [f64; 3],
    beam: [f64; 3],
}

/// What comes through to the ground in the mean, as parts of the sun's light: all that goes on nearly straight, and what of it counts
/// as the beam.
#[derive(Clone, Copy)]
struct Through {
    forward: [f64; 3],
    beam: [f64; 3],
}

impl CumulusKept {
    pub(super) fn new(shared: SharedClouds) -> Self {
        Self {
            fields: Kept::sized(KEPT, |field| field.size()),
            lights: Kept::sized(KEPT, |light| light.size()),
            sun_depths: Kept::sized(KEPT, |depth| depth.size()),
            coarse: Kept::sized(KEPT, |normals| normals.size()),
            dressed: Kept::new(KEPT),
            through: Kept::new(KEPT),
            relief: None,
            shared,
        }
    }

    /// Those that may be large.
    pub(super) fn results(&mut self) -> [&mut dyn Results; 4] {
        [&mut self.fields, &mut self.lights, &mut self.sun_depths, &mut self.coarse]
    }

    /// The job's layer of cumulus, with its light by a method where that is wanted, and the even light that then falls on the ground beside that of
    /// other layers. `decks` are the numbers and thicknesses of the stratiform layers.
    pub(super) fn inputs(
        &mut self,
        gpu: &Gpu,
        job: &Job,
        moment: &Moment,
        decks: &[(usize, Arc<HostMap>)],
        method: Option<CumulusMethod>,
        watch: &Watch,
    ) -> Result<Option<(CumulusInputs, [f64; 3])>, RenderError> {
        let scene = job.scene();
        let Some(layer) = &scene.cumulus else { return Ok(None) };
        let (extent_m, time_s) = (scene.extent_m(), job.request().time_s);
        let key = CumulusKey::new(job, layer);
        let look = || watch.look();
        look()?;
        let (relief, shared) = (&mut self.relief, &self.shared);
        let field = self.fields.get_or(key.clone(), || {
            let volume = shared.volumes().get_or(key.clone(), || {
                Volume::new_watched(&cumulus::body(layer, extent_m, key.texel_m(), time_s), &look)
            })?;
            let relief = relief.get_or_insert_with(|| CumulusField::relief(gpu)).clone();
            Ok::<_, RenderError>(Arc::new(CumulusField::new(gpu, volume, relief)))
        })?;
        look()?;
        let tables = &job.tables()[scene.layers.len()];
        let channels = &tables.channels;
        let extinction_per_m =
            layer.droplets.extinction_per_m(channels.each_ref().map(|channel| channel.cross_section_um2));
        let beam = [0, 1, 2].map(|c| 1.0 - channels[c].albedo * tables.phases[c].peak_fraction);
        let scattering = channels.each_ref().map(Scattering::new);
        let middle_m = 0.5 * (field.host.base_m.max(field.host.floor_m) + field.host.top_m);
        let light = &moment.illumination;
        let (towards_sun, sun) = (DVec3::from_array(light.towards_sun_seen()), light.beam_at(job.air(), middle_m));
        let mut lighting = Lighting {
            extinction_per_m,
            scattering,
            towards_sun,
            sun,
            above: light.sky,
            below: [0.0; 3],
            returned: [0.0; 3],
        };
        let above = |number: usize| scene.place(number) > layer.place();
        for (number, map) in decks.iter().rev().filter(|(number, _)| above(*number)) {
            let deck = Deck::new(job, moment, *number, map);
            for c in 0..3 {
                let beam = light.cosine() * lighting.sun[c] * (deck.transmitted[c] - deck.beam[c]).max(0.0) / PI;
                lighting.above[c] = lighting.above[c] * deck.transmitted_even[c] + beam;
                lighting.sun[c] *= deck.beam[c];
            }
        }
        let seen_by = Beam { towards_sun, extinction_per_m, kept: scattering.map(|scattering| scattering.kept), beam };
        let through = self.through.get_or_make((key.clone(), seen_by), || through(&field.host, &seen_by));
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
        // Where no lattice knows what the layer scatters down.
        let down = [0, 1, 2].map(|c| {
            DOWN * lighting.scattering[c].albedo * light.cosine() * lighting.sun[c] * (1.0 - through.forward[c])
        });
        if method == Some(CumulusMethod::Lattice) {
            lighting.returned = reflected;
        } else {
            lighting.below = [0, 1, 2].map(|c| lighting.below[c] + reflected[c] * down[c] / PI);
        }
        let drift = cumulus::drift_m(&layer.wind, time_s, extent_m);
        let field_of = &*field;
        let seen = match method {
            None => None,
            Some(method) => Some(match (method.surface(), method) {
                (Some(surface), _) => self.surface(gpu, key, field_of, &lighting, &surface),
                (None, CumulusMethod::Octaves) => {
                    let kept = [extinction_per_m[1], lighting.scattering[1].kept];
                    CumulusLight::Octaves(self.sun_depths.get_or_make((key, light.towards_sun, kept), || {
                        Arc::new(SunDepth::new(gpu, &Lattice::unlit(&field_of.host, &lighting)))
                    }))
                }
                (None, CumulusMethod::Forward | CumulusMethod::ForwardPublished) => CumulusLight::Forward,
                (None, _) => {
                    let lit = self.lights.get_or((key.clone(), lighting), || {
                        let lattice = shared
                            .cumulus()
                            .get_or((key, lighting), || Lattice::solve_watched(&field_of.host, &lighting, &look))?;
                        look()?;
                        Ok::<_, RenderError>(Arc::new(CumulusLit::new(gpu, lattice)))
                    })?;
                    let dressed = self.dressed.get_or_make(MixKey::new(tables, extinction_per_m), || {
                        Arc::new(Dressed::new(gpu, &dressed::tables(channels, extinction_per_m)))
                    });
                    CumulusLight::Lattice(lit, dressed)
                }
            }),
        };
        let added = seen.as_ref().map_or([0.0; 3], |seen| {
            [0, 1, 2].map(|c| {
                let sun = light.cosine() * lighting.sun[c];
                let straight = sun * (through.forward[c] - through.beam[c]).max(0.0);
                let sky = if scene.layers.is_empty() { PI * light.sky[c] } else { 0.0 };
                let scattered = match seen {
                    CumulusLight::Lattice(lit, _) => lit.added[0][c],
                    _ => down[c],
                };
                sky + scattered + straight
            })
        });
        if let Some(CumulusLight::Lattice(lit, _)) = &seen {
            lighting.below = lit.below;
        }
        let lattice = seen.as_ref().and_then(|seen| match seen {
            CumulusLight::Lattice(lit, _) => Some([lit.sun_depth.cell_m, lit.sun_depth.floor_m]),
            CumulusLight::Octaves(depth) => Some([depth.cell_m, depth.floor_m]),
            CumulusLight::Surface { coarse, .. } => Some([coarse.cell_m, coarse.floor_m]),
            CumulusLight::Forward => None,
        });
        let relief_m = Relief::new(extent_m).tile_m();
        let mut frame = frame::cumulus(&field.host, &lighting, beam, lattice, drift, [relief_m, light.sun_diameter]);
        frame.published = u32::from(method == Some(CumulusMethod::ForwardPublished));
        let bound = gpu.uniform("cumulus", &frame);
        Ok(Some((CumulusInputs { frame, bound, field, seen }, added)))
    }

    /// What a shader of surfaces takes.
    fn surface(
        &mut self,
        gpu: &Gpu,
        key: CumulusKey,
        field: &CumulusField,
        lighting: &Lighting,
        surface: &Surface,
    ) -> CumulusLight {
        let (extinction, scattering) = (lighting.extinction_per_m, &lighting.scattering);
        let traps = surface.has_traps(extinction[1], &scattering[1], field.host.root_m);
        let coarse = self.coarse.get_or_make((key, traps), || {
            Arc::new(CoarseNormals::new(gpu, traps.then(|| Coarse::new(&field.host)).as_ref()))
        });
        let (oldest, trap) = match surface.trap {
            Trap::Distance(metres) => (false, metres),
            Trap::Arctangent(sharpness) => (true, sharpness),
        };
        let constants = CumulusSurface {
            glow_m: [0, 1, 2].map(|c| surface.glow_m(extinction[c], &scattering[c]) as f32),
            blob_m: (BLOB * coarse.cell_m) as f32,
            ambient: surface.ambient as f32,
            diffuse: surface.diffuse as f32,
            bump: surface.bump as f32,
            corona: surface.corona as f32,
            reached_m: surface.reached_m(field.host.band_m, field.host.root_m) as f32,
            traps: if traps { surface.traps as f32 } else { 0.0 },
            trap: trap as f32,
            ..CumulusSurface::default()
        };
        CumulusLight::Surface { coarse, constants: gpu.uniform("surface", &constants), oldest }
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
fn through(volume: &Volume, by: &Beam) -> Through {
    let mut towards = by.towards_sun;
    towards.z = towards.z.max(LEAST_UP);
    let towards = towards.normalize();
    let low_m = volume.base_m.max(volume.floor_m);
    let extinction = by.extinction_per_m;
    let rows = (0..LOOKS).into_par_iter().map(|row| {
        let mut sums = [[0.0; 3]; 2];
        for column in 0..LOOKS {
            let place = (DVec2::new(column as f64, row as f64) + 0.5) / LOOKS as f64 - 0.5;
            let from = (place * volume.extent_m).extend(low_m);
            let enough_m = 20.0 / (extinction[1] * by.kept[1]);
            let length_m = volume.length_m(Ray { from, towards }, 4.0 * volume.extent_m, enough_m, volume.voxel_m);
            for c in 0..3 {
                sums[0][c] += (-extinction[c] * by.kept[c] * length_m).exp();
                sums[1][c] += (-extinction[c] * by.beam[c] * length_m).exp();
            }
        }
        sums
    });
    let rows: Vec<[[f64; 3]; 2]> = rows.collect();
    let mean =
        |which: usize| [0, 1, 2].map(|c| rows.iter().map(|row| row[which][c]).sum::<f64>() / (LOOKS * LOOKS) as f64);
    Through { forward: mean(0), beam: mean(1) }
}
