//! What tracing gives.

use crate::reference::monte_carlo::Estimate;
use crate::reference::monte_carlo::volume::VolumeRadiance;

/// Texels and the standard errors of their light, channels interleaved.
#[derive(Default)]
pub(crate) struct Traced {
    pub(crate) data: Vec<f32>,
    /// Of all channels but alpha.
    pub(crate) standard_error: Vec<f32>,
}

impl Traced {
    /// Adds the light of a texel.
    pub(super) fn add(&mut self, light: &[VolumeRadiance; 3]) {
        light.iter().for_each(|light| self.add_value(light.total));
    }

    /// Adds a texel that shows nothing.
    pub(super) fn add_nothing(&mut self) {
        (0..3).for_each(|_| self.add_value(Estimate::default()));
    }

    pub(super) fn add_value(&mut self, Estimate { value, standard_error }: Estimate) {
        self.data.push(value as f32);
        self.standard_error.push(standard_error as f32);
    }
}
