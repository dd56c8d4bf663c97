//! Light of layers by a lattice, kept by what it depends on: the wind carries it along.

use super::kept::{Kept, Results};
use super::keys::{LatticeKey, MixKey};
use super::shared::SharedClouds;
use crate::cumulus::dressed::{self, Scattering};
use crate::field::Field;
use crate::gpu::Gpu;
use crate::job::{Job, RenderError, Watch};
use crate::light::{Dressed, LatticeInputs, LatticeLit, LatticeMaps};
use crate::method::Transport;
use crate::moment::Moment;
use std::sync::Arc;

/// The lattices of some layers and suns.
pub(super) struct LatticesKept {
    lattices: Kept<LatticeKey, Option<Arc<LatticeLit>>>,
    dressed: Kept<MixKey, Arc<Dressed>>,
    shared: SharedClouds,
}

impl LatticesKept {
    pub(super) fn new(capacity: usize, shared: SharedClouds) -> Self {
        let size = |lattice: &Option<Arc<LatticeLit>>| lattice.as_ref().map_or(0, |lattice| lattice.size());
        Self { lattices: Kept::sized(capacity, size), dressed: Kept::new(capacity), shared }
    }

    /// Those that may be large.
    pub(super) fn results(&mut self) -> [&mut dyn Results; 1] {
        [&mut self.lattices]
    }

    /// The lattice of each layer that has one: an even layer is a slab, whose light is exact without.
    pub(super) fn of_layers(
        &mut self,
        gpu: &Gpu,
        job: &Job,
        watch: &Watch,
        fields: &[Arc<Field>],
        moment: &Moment,
    ) -> Result<Vec<Option<Arc<LatticeLit>>>, RenderError> {
        let wanted = moment.plan.transport == Transport::Lattice && moment.illumination.is_day();
        let Self { lattices, dressed, shared } = self;
        let of = |(number, field): (usize, &Arc<Field>)| {
            if !wanted || field.is_uniform() {
                return Ok(None);
            }
            let key = || LatticeKey::new(job, moment, number);
            lattices.get_or(key(), || {
                let tables = &job.tables()[number];
                let extinction_per_m = moment.layers[number].extinction_per_m;
                let maps = match shared.layers().of(&key()) {
                    Some(maps) => maps,
                    None => {
                        let inputs = LatticeInputs {
                            map: &gpu.read_map(&field.thickness, 0, watch.deadline)?,
                            extent_m: moment.extent_m,
                            density: field.density,
                            room_m: field.room_m.into(),
                            extinction_per_m,
                            scattering: tables.channels.each_ref().map(Scattering::new),
                            towards_sun: moment.illumination.towards_sun,
                            slant_cosine: moment.slant_cosine(),
                            fluxes: &tables.fluxes,
                        };
                        let Some(maps) = LatticeMaps::new(&inputs, &|| watch.look())? else { return Ok(None) };
                        let maps = Arc::new(maps);
                        shared.layers().add(key(), &maps);
                        maps
                    }
                };
                let dressed = dressed.get_or_make(MixKey::new(tables, extinction_per_m), || {
                    Arc::new(Dressed::new(gpu, &dressed::tables(&tables.channels, extinction_per_m)))
                });
                Ok(Some(Arc::new(LatticeLit::new(gpu, maps, dressed))))
            })
        };
        fields.iter().enumerate().map(of).collect()
    }
}
