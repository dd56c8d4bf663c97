//! Tables of an atmosphere with a cover of cloud in it.

use super::air::{AirMix, memory, name, waves_to_parts};
use super::error::TableError;
use super::library::{Artefact, TableLibrary};
use super::mix::MixTables;
use crate::atmosphere::{Air, Boundary, Moments};
use crate::cover::{AirSlab, CloudLayer, Column, Cover};
use crate::field::{self, Profile};
use crate::scene_air::CoverMoment;
use crate::spectrum::CHANNELS;
use rayon::prelude::*;
use sha2::{Digest as _, Sha256};
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

/// Light of the air above a scene's clouds, and what the clouds make of it, at the four wavelengths.
#[derive(Debug)]
pub struct CoveredTables {
    /// Names it exactly.
    pub key: String,
    /// Above the clouds, which with what lies below them end the air.
    pub waves: [Moments; 4],
    /// The clouds with the air among and below them.
    pub covers: [Cover; 4],
    /// The same clouds without air.
    pub airless: [Cover; 4],
    /// Part of the sky that cloud takes, 0 to 1: thin cloud counts as far as it takes light from a beam.
    pub part: f64,
    /// Transmittance of the air from the clouds' top to the ground for even light.
    pub clearness: [f64; 4],
    /// Part of even light that each layer sends back.
    pub reflectances: Vec<[f64; 4]>,
    /// Base and mean top of each layer, m.
    pub heights_m: Vec<[f64; 2]>,
    /// Light of the last suns: textures of one moment follow one another.
    moments: Mutex<VecDeque<(f64, Arc<CoverMoment>)>>,
}

/// Suns whose light is kept.
const KEPT_MOMENTS: usize = 16;

impl CoveredTables {
    /// Light of a sun of this cosine at the clouds' top: it takes milliseconds to solve, and is the same for all textures of a moment.
    pub fn moment(&self, sun_cosine: f64) -> Arc<CoverMoment> {
        // The lock is not held while light is solved, so that nobody waits. What is in it is whole even where a thread that held it has panicked.
        let kept = || self.moments.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, moment)) = kept().iter().find(|(cosine, _)| cosine.to_bits() == sun_cosine.to_bits()) {
            return Arc::clone(moment);
        }
        let moment = Arc::new(CoverMoment::new(self, sun_cosine));
        let mut kept = kept();
        kept.truncate(KEPT_MOMENTS - 1);
        kept.push_front((sun_cosine, Arc::clone(&moment)));
        moment
    }
}

/// A layer of cloud as these tables depend on it.
#[derive(Debug, Clone)]
pub struct CoverLayer {
    /// Where it is, and how thick.
    pub profile: Profile,
    /// Extinction in red, green and blue, 1/m.
    pub extinction_per_m: [f64; 3],
    /// Tables of its droplets.
    pub droplets: Arc<MixTables>,
}

/// What the tables of an atmosphere with clouds depend on.
#[derive(Debug, Clone)]
pub struct CoveredMix {
    /// The air, and the ground.
    pub air: AirMix,
    /// The layers, lowest first, of which one at least has cloud.
    pub layers: Vec<CoverLayer>,
}

impl CoverLayer {
    /// Mean height of its top, m.
    fn top_m(&self) -> f64 {
        let Profile { base_m, own_thickness_m, columns } = &self.profile;
        base_m + own_thickness_m.unwrap_or_else(|| field::mean_m(columns))
    }

    /// Whether there is any cloud in it.
    pub fn has_cloud(&self) -> bool {
        self.part() > 0.0
    }

    /// Part of a beam from straight above that meets cloud in it.
    fn part(&self) -> f64 {
        let met = |c: &field::Column| c.part * -(-c.thickness_m * self.extinction_per_m[1]).exp_m1();
        self.profile.columns.iter().map(met).sum::<f64>().clamp(0.0, 1.0)
    }

    /// Part of even light that it sends back.
    fn reflectance(&self, channel: usize) -> f64 {
        let fluxes = &self.droplets.fluxes[channel];
        let depth = |column: &field::Column| column.thickness_m * self.extinction_per_m[channel];
        self.profile.columns.iter().map(|column| column.part * fluxes.reflectance_diffuse(depth(column))).sum()
    }

    fn cloud(&self, channel: usize) -> CloudLayer<'_> {
        let optics = &self.droplets.channels[channel];
        let columns = self.profile.columns.iter().map(|column| Column {
            weight: column.part,
            optical_depth: column.thickness_m * self.extinction_per_m[channel],
        });
        CloudLayer {
            base_m: self.profile.base_m,
            top_m: self.top_m(),
            columns: columns.collect(),
            albedo: optics.albedo,
            moments: &optics.moments,
        }
    }
}

impl CoveredMix {
    fn cover(&self, wave: usize, in_air: bool) -> Cover {
        let layers: Vec<CloudLayer<'_>> = self.layers.iter().map(|layer| layer.cloud(CHANNELS[wave])).collect();
        let mut medium = self.air.medium(wave);
        if !in_air {
            (medium.rayleigh_depth, medium.ozone_depth, medium.aerosol.depth) = (0.0, 0.0, 0.0);
        }
        Cover::new(&medium, &layers, self.air.ground_albedo[wave])
    }

    fn covers(&self) -> [[Cover; 4]; 2] {
        let all: Vec<Cover> = (0..8).into_par_iter().map(|i| self.cover(i % 4, i < 4)).collect();
        let (with, without) = all.split_at(4);
        [with, without].map(|four| std::array::from_fn(|wave| four[wave].clone()))
    }

    /// From the highest layer on, how much of the sky each takes that the ones above leave, and the part of it that all take.
    fn parts(&self) -> (Vec<f64>, f64) {
        let mut left = 1.0;
        let parts = self.layers.iter().rev().map(|layer| {
            let part = left * layer.part();
            left -= part;
            part
        });
        let parts = parts.collect();
        (parts, 1.0 - left)
    }

    /// What ends the air above. A broken cover does so at the mean height at which a beam meets cloud or ground, so that it
    /// goes over into the ground as the clouds get fewer or thinner.
    fn boundary(&self, cover: &Cover) -> Boundary {
        let (parts, _) = self.parts();
        let heights = self.layers.iter().rev().map(CoverLayer::top_m);
        let height_m: f64 = parts.iter().zip(heights).map(|(part, top_m)| part * top_m).sum();
        Boundary { height_m: height_m.min(cover.top_m()), ..cover.boundary() }
    }

    fn tables(&self, waves: [Moments; 4], covers: [Cover; 4], airless: [Cover; 4]) -> CoveredTables {
        let heights_m = self.layers.iter().map(|layer| [layer.profile.base_m, layer.top_m()]).collect();
        let clear =
            |wave: usize| AirSlab::new(&self.air.medium(wave), 0.0, covers[wave].top_m()).diffuse().transmittance;
        let clearness = [clear(0), clear(1), clear(2), clear(3)];
        let reflectances = self.layers.iter().map(|layer| CHANNELS.map(|channel| layer.reflectance(channel))).collect();
        let part = self.parts().1;
        CoveredTables {
            key: self.key(),
            waves,
            covers,
            airless,
            part,
            clearness,
            reflectances,
            heights_m,
            moments: Mutex::default(),
        }
    }

    fn airs(&self, covers: &[Cover; 4]) -> [Air; 4] {
        self.air.airs(covers.each_ref().map(|cover| self.boundary(cover)))
    }
}

impl Artefact for CoveredMix {
    type Value = CoveredTables;

    fn key(&self) -> String {
        let mut hash = Sha256::new();
        for layer in &self.layers {
            let CoverLayer { profile: Profile { base_m, own_thickness_m, columns }, extinction_per_m, droplets } =
                layer;
            hash.update(droplets.mix.key().as_bytes());
            hash.update([0]);
            let columns = columns.iter().flat_map(|column| [column.part, column.thickness_m]);
            for number in std::iter::once(*base_m).chain(*extinction_per_m).chain(columns).chain(*own_thickness_m) {
                hash.update(number.to_bits().to_le_bytes());
            }
        }
        format!("{}-under-{}", self.air.key(), name(hash))
    }

    fn describe(&self) -> String {
        let clouds = if self.layers.len() == 1 { "a layer" } else { "layers" };
        format!("{} over {clouds} of cloud", self.air.describe())
    }

    fn build(&self, progress: &(dyn Fn(f64) + Sync)) -> Result<CoveredTables, TableError> {
        let [covers, airless] = self.covers();
        let waves = self.air.solve(self.airs(&covers), self.air.alike(CHANNELS), progress);
        Ok(self.tables(waves, covers, airless))
    }

    fn to_parts(&self, tables: &CoveredTables) -> Vec<Vec<u8>> {
        waves_to_parts(&tables.waves)
    }

    fn read_parts(&self, parts: &[&[u8]]) -> Option<CoveredTables> {
        let [covers, airless] = self.covers();
        let waves = self.air.read_waves(self.airs(&covers), parts)?;
        Some(self.tables(waves, covers, airless))
    }

    fn bytes(&self, tables: &CoveredTables) -> usize {
        // A cover's matrices of 16 directions are small beside the tables of the air.
        memory(&tables.waves) + COVER_BYTES
    }
}

/// Memory of the covers of four wavelengths, bytes.
const COVER_BYTES: usize = 1 << 20;

impl TableLibrary {
    /// The tables of an atmosphere with clouds. Waits while they are made: seconds for what was never used before. `progress`
    /// gets 0 to 1 if it is this call that makes them.
    ///
    /// # Errors
    /// When somebody else was making them and panicked.
    pub fn covered(&self, mix: &CoveredMix, progress: &(dyn Fn(f64) + Sync)) -> Result<Arc<CoveredTables>, TableError> {
        self.artefact(mix, progress)
    }

    /// Whether the tables of an atmosphere with clouds are in memory.
    pub fn covered_ready(&self, mix: &CoveredMix) -> bool {
        self.has::<CoveredTables>(&mix.key())
    }
}
