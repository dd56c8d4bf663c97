//! Tables of a droplet mix.

use super::error::TableError;
use super::library::{Artefact, TableLibrary};
use crate::optics::{self, Channel, Mix};
use crate::slab::fluxes::FluxTable;
use crate::slab::phases::PhaseTables;
use crate::slab::radiance::{Aureole, RadianceTable, TableSize};
use std::sync::{Arc, OnceLock};

/// Everything that depends on the droplet mix alone. Radiance tables are made when a size of them is first asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct MixTables {
    /// The mix.
    pub mix: Mix,
    /// Optics in red, green and blue.
    pub channels: [Channel; 3],
    /// Fluxes of a slab in red, green and blue.
    pub fluxes: [FluxTable; 3],
    /// Phase functions as the shade pass reads them, in red, green and blue.
    pub phases: [PhaseTables; 3],
    /// Corrections near the sun, in red, green and blue.
    pub aureoles: [Aureole; 3],
    radiance: [OnceLock<Arc<Radiance>>; Detail::ALL.len()],
}

/// Radiance tables in red, green and blue.
pub type Radiance = [RadianceTable; 3];

/// How fine radiance tables are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Detail {
    /// 23 x 33 x 33 x 19 nodes: optical depth, sun, view, azimuth.
    Coarse,
    /// 35 x 33 x 33 x 37 nodes.
    Fine,
    /// 59 x 65 x 65 x 91 nodes.
    Finest,
}

impl Detail {
    /// Every size and its name.
    pub const ALL: [(&'static str, Self); 3] =
        [("coarse", Self::Coarse), ("fine", Self::Fine), ("finest", Self::Finest)];

    /// Its name.
    pub fn name(self) -> &'static str {
        Self::ALL[self as usize].0
    }

    /// Nodes of its tables.
    pub fn size(self) -> TableSize {
        match self {
            Self::Coarse => TableSize::COARSE,
            Self::Fine => TableSize::FINE,
            Self::Finest => TableSize::FINEST,
        }
    }
}

/// Shares of the work for the progress report: optics take nearly all of it.
const OPTICS_SHARE: f64 = 0.85;

impl MixTables {
    /// Makes the tables of a mix; seconds for droplets. `progress` gets 0 to 1.
    ///
    /// # Errors
    /// When the optics refuse the mix.
    pub fn build(mix: &Mix, progress: &(dyn Fn(f64) + Sync)) -> Result<Self, TableError> {
        let failed = |reason| TableError::Optics { mix: mix.describe(), reason };
        let channels = optics::channels(mix, &|part| progress(OPTICS_SHARE * part)).map_err(failed)?;
        let rest = |part: f64| progress(OPTICS_SHARE + (1.0 - OPTICS_SHARE) * part);
        let fluxes =
            each(&channels, &rest, |channel, progress| FluxTable::build(channel.albedo, &channel.moments, progress));
        let phases = each(&channels, &|_| (), |channel, _| PhaseTables::build(channel));
        let aureoles = each(&channels, &|_| (), |channel, _| Aureole::build(channel.albedo, &channel.moments));
        progress(1.0);
        Ok(Self { mix: mix.clone(), channels, fluxes, phases, aureoles, radiance: Default::default() })
    }

    /// Radiance tables of a size, made if they are not there yet: half a second for `Fine`. `progress` gets 0 to 1.
    pub fn radiance(&self, detail: Detail, progress: &(dyn Fn(f64) + Sync)) -> Arc<Radiance> {
        let build = || Arc::new(self.build_radiance(detail, progress));
        Arc::clone(self.radiance[detail as usize].get_or_init(build))
    }

    fn build_radiance(&self, detail: Detail, progress: &(dyn Fn(f64) + Sync)) -> Radiance {
        each(&self.channels, progress, |channel, progress| {
            RadianceTable::build(channel.albedo, &channel.moments, detail.size(), progress)
        })
    }
}

/// What is made of each channel; channels alike, as those of a given phase function, share the work.
fn each<T: Clone>(
    channels: &[Channel; 3],
    progress: &(dyn Fn(f64) + Sync),
    build: impl Fn(&Channel, &(dyn Fn(f64) + Sync)) -> T,
) -> [T; 3] {
    let made = |i: usize| build(&channels[i], &|part| progress((i as f64 + part) / 3.0));
    let red = made(0);
    let green = if channels[1] == channels[0] { red.clone() } else { made(1) };
    let blue = match () {
        () if channels[2] == channels[0] => red.clone(),
        () if channels[2] == channels[1] => green.clone(),
        () => made(2),
    };
    [red, green, blue]
}

/// A mix's own tables as an artefact.
struct OwnTables<'a>(&'a Mix);

impl Artefact for OwnTables<'_> {
    type Value = MixTables;

    fn key(&self) -> String {
        own_key(self.0)
    }

    fn describe(&self) -> String {
        self.0.describe()
    }

    fn build(&self, progress: &(dyn Fn(f64) + Sync)) -> Result<MixTables, TableError> {
        MixTables::build(self.0, progress)
    }

    fn to_parts(&self, tables: &MixTables) -> Vec<Vec<u8>> {
        let bytes = |numbers: Vec<f64>| numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
        let channel = |i: usize| {
            [
                bytes(tables.channels[i].to_f64s()),
                bytes(tables.fluxes[i].to_vec()),
                bytes(tables.phases[i].to_numbers()),
                tables.aureoles[i].to_bytes(),
            ]
        };
        (0..3).flat_map(channel).collect()
    }

    fn read_parts(&self, parts: &[&[u8]]) -> Option<MixTables> {
        let numbers = |bytes: &[u8]| {
            let (numbers, []) = bytes.as_chunks::<8>() else { return None };
            Some(numbers.iter().map(|number| f64::from_le_bytes(*number)).collect::<Vec<_>>())
        };
        let channel = |i: usize| {
            let [channel, fluxes, phases, aureole] = parts.get(4 * i..4 * i + 4)? else { return None };
            Some((
                Channel::from_f64s(&numbers(channel)?)?,
                FluxTable::from_vec(&numbers(fluxes)?)?,
                PhaseTables::from_numbers(&numbers(phases)?)?,
                Aureole::from_bytes(aureole)?,
            ))
        };
        let (r, g, b) = (channel(0)?, channel(1)?, channel(2)?);
        Some(MixTables {
            mix: self.0.clone(),
            channels: [r.0, g.0, b.0],
            fluxes: [r.1, g.1, b.1],
            phases: [r.2, g.2, b.2],
            aureoles: [r.3, g.3, b.3],
            radiance: Default::default(),
        })
    }

    fn bytes(&self, _: &MixTables) -> usize {
        MIX_BYTES
    }
}

/// Radiance tables of a mix as an artefact.
struct RadianceTables<'a> {
    tables: &'a MixTables,
    detail: Detail,
}

impl Artefact for RadianceTables<'_> {
    type Value = Radiance;

    fn key(&self) -> String {
        radiance_key(&self.tables.mix, self.detail)
    }

    fn describe(&self) -> String {
        format!("{}, {} radiance", self.tables.mix.describe(), self.detail.name())
    }

    fn build(&self, progress: &(dyn Fn(f64) + Sync)) -> Result<Radiance, TableError> {
        Ok(self.tables.build_radiance(self.detail, progress))
    }

    fn to_parts(&self, radiance: &Radiance) -> Vec<Vec<u8>> {
        radiance.iter().map(RadianceTable::to_bytes).collect()
    }

    fn read_parts(&self, parts: &[&[u8]]) -> Option<Radiance> {
        let [r, g, b] = parts else { return None };
        let table = |bytes| RadianceTable::from_bytes(bytes).filter(|table| table.size() == self.detail.size());
        Some([table(r)?, table(g)?, table(b)?])
    }

    fn bytes(&self, _: &Radiance) -> usize {
        let size = self.detail.size();
        3 * 2 * 4 * size.depths() * size.azimuths * size.zeniths * (size.zeniths + 1) / 2
    }
}

fn own_key(mix: &Mix) -> String {
    format!("{}.tables", mix.key())
}

fn radiance_key(mix: &Mix, detail: Detail) -> String {
    format!("{}.{}.radiance", mix.key(), detail.name())
}

/// Memory of a mix's own tables, bytes.
const MIX_BYTES: usize = 7 << 20;
/// Share of a mix's own tables in the work, where radiance tables are made too.
const MIX_SHARE: f64 = 0.7;

impl TableLibrary {
    /// The tables of a mix, with radiance tables of the given size if one is given. Waits while they are made: seconds
    /// for droplets that were never used before. `progress` gets 0 to 1 if it is this call that makes them.
    ///
    /// # Errors
    /// When the optics refuse the mix, or somebody else was making it and panicked.
    pub fn get(
        &self,
        mix: &Mix,
        detail: Option<Detail>,
        progress: &(dyn Fn(f64) + Sync),
    ) -> Result<Arc<MixTables>, TableError> {
        let share = if detail.is_some() { MIX_SHARE } else { 1.0 };
        let tables = self.artefact(&OwnTables(mix), &|part| progress(share * part))?;
        if let Some(detail) = detail {
            if tables.radiance[detail as usize].get().is_some() {
                self.note_use(&radiance_key(mix, detail));
                return Ok(tables);
            }
            let rest = |part: f64| progress(share + (1.0 - share) * part);
            let radiance = self.artefact(&RadianceTables { tables: &tables, detail }, &rest)?;
            tables.radiance[detail as usize].get_or_init(|| radiance);
        }
        Ok(tables)
    }

    /// Whether the tables of a mix are in memory.
    pub fn ready(&self, mix: &Mix) -> bool {
        self.has::<MixTables>(&own_key(mix))
    }

    /// How far the tables of a mix and their radiance tables are, 0 to 1, while some of them are being made.
    pub fn progress(&self, mix: &Mix) -> Option<f64> {
        let radiance = |(_, detail)| self.progress_of::<Radiance>(&radiance_key(mix, detail));
        let own = self.progress_of::<MixTables>(&own_key(mix)).map(|part| MIX_SHARE * part);
        own.or_else(|| Some(MIX_SHARE + (1.0 - MIX_SHARE) * Detail::ALL.into_iter().find_map(radiance)?))
    }
}
