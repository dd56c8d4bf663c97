//! Tables as bytes, for caches on disk: little-endian counts (u32), constants (f64) and values (f32).

use super::aureole::{self, Aureole};
use super::scaling::Scaling;
use super::table::{RadianceTable, TableSize};

impl RadianceTable {
    /// All of the table.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        let size = self.size;
        let mut bytes = Vec::with_capacity(64 + 8 * size.values());
        for count in [size.depths_per_octave, size.zeniths, size.azimuths] {
            bytes.extend((count as u32).to_le_bytes());
        }
        let Scaling { depth_scale, order1_albedo, decay, extrapolation } = self.scaling;
        for number in [depth_scale, order1_albedo, decay, extrapolation] {
            bytes.extend(number.to_le_bytes());
        }
        for values in &self.values {
            bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        }
        bytes
    }

    /// The table of [`Self::to_bytes`]; `None` where the length is wrong or a value can be none of a table's.
    #[must_use]
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let (counts, bytes) = bytes.split_at_checked(12)?;
        let [depths_per_octave, zeniths, azimuths] = *counts.as_chunks::<4>().0 else { return None };
        let count = |bytes: [u8; 4]| u32::from_le_bytes(bytes) as usize;
        let size = TableSize {
            depths_per_octave: count(depths_per_octave),
            zeniths: count(zeniths),
            azimuths: count(azimuths),
        };
        let (numbers, bytes) = bytes.split_at_checked(32)?;
        let [depth_scale, order1_albedo, decay, extrapolation] = *numbers.as_chunks::<8>().0 else { return None };
        let scaling = Scaling {
            depth_scale: f64::from_le_bytes(depth_scale),
            order1_albedo: f64::from_le_bytes(order1_albedo),
            decay: f64::from_le_bytes(decay),
            extrapolation: f64::from_le_bytes(extrapolation),
        };
        if !size.is_sensible() || !scaling.is_sensible() || bytes.len() != 8 * size.values() {
            return None;
        }
        let (reflected, transmitted) = bytes.split_at(4 * size.values());
        let sides = [finite(reflected)?, finite(transmitted)?];
        sides.iter().flatten().all(|value| *value >= 0.0).then_some(Self { size, scaling, values: sides })
    }
}

impl Aureole {
    /// All of the table.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        let values = self.values.iter().flat_map(|value| value.to_le_bytes());
        self.depth_scale.to_le_bytes().into_iter().chain(values).collect()
    }

    /// The table of [`Self::to_bytes`]; `None` where the length is wrong or a value is not finite.
    #[must_use]
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let (depth_scale, values) = bytes.split_first_chunk::<8>()?;
        let depth_scale = f64::from_le_bytes(*depth_scale);
        let sensible = depth_scale > 0.0 && depth_scale <= 1.0 && values.len() == 4 * aureole::ROWS * aureole::COLUMNS;
        sensible.then(|| finite(values))?.map(|values| Self { depth_scale, values })
    }
}

/// Values from bytes, all of them finite.
fn finite(bytes: &[u8]) -> Option<Vec<f32>> {
    let values: Vec<f32> = bytes.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
    values.iter().all(|value| value.is_finite()).then_some(values)
}
