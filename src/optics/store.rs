//! Channels as plain numbers, for caches on disk.

use super::channel::Channel;
use super::phase::PhaseFunction;

impl Channel {
    /// All numbers of the channel in a fixed order: cross-section, albedo, asymmetry, count and
    /// values of P, count and moments.
    #[must_use]
    pub fn to_f64s(&self) -> Vec<f64> {
        let values = self.phase.grid_values();
        let mut numbers = vec![self.cross_section_um2, self.albedo, self.asymmetry, values.len() as f64];
        numbers.extend_from_slice(values);
        numbers.push(self.moments.len() as f64);
        numbers.extend_from_slice(&self.moments);
        numbers
    }

    /// The channel whose [`Self::to_f64s`] these numbers are, bit by bit; None where they cannot be
    /// any channel's.
    #[must_use]
    pub fn from_f64s(numbers: &[f64]) -> Option<Self> {
        if !numbers.iter().all(|number| number.is_finite()) {
            return None;
        }
        let ([cross_section_um2, albedo, asymmetry], rest) = numbers.split_first_chunk::<3>()?;
        let (values, rest) = counted(rest)?;
        let (moments, rest) = counted(rest)?;
        let sensible = rest.is_empty()
            && *cross_section_um2 >= 0.0
            && (0.0..=1.0).contains(albedo)
            && (-1.0..=1.0).contains(asymmetry)
            && moments.first() == Some(&1.0);
        if !sensible {
            return None;
        }
        Some(Self {
            cross_section_um2: *cross_section_um2,
            albedo: *albedo,
            asymmetry: *asymmetry,
            phase: PhaseFunction::from_normalised(values)?,
            moments: moments.to_vec(),
        })
    }
}

/// A list that starts with its length, and what follows it.
fn counted(numbers: &[f64]) -> Option<(&[f64], &[f64])> {
    let (count, rest) = numbers.split_first()?;
    if *count < 0.0 || count.fract() != 0.0 || *count > rest.len() as f64 {
        return None;
    }
    rest.split_at_checked(*count as usize)
}
