//! What tracing gives.

use crate::encode::TexelLayer;
use crate::reference::monte_carlo::volume::VolumeRadiance;
use crate::reference::monte_carlo::{Estimate, Orders};

/// Texels and the standard errors of their light, channels interleaved.
#[derive(Default)]
pub(crate) struct Traced {
    pub(crate) data: Vec<f32>,
    /// Of all channels but alpha.
    pub(crate) standard_error: Vec<f32>,
    /// Light of each order of scattering that was asked for, and of all above.
    pub(crate) layers: Vec<TexelLayer>,
    /// The first of these orders.
    first: usize,
}

/// Light of one colour or wavelength.
#[derive(Clone, Copy, Default)]
pub(super) struct Light {
    pub(super) total: Estimate,
    pub(super) orders: Orders,
}

impl From<&VolumeRadiance> for Light {
    fn from(light: &VolumeRadiance) -> Self {
        Self { total: light.total, orders: light.orders }
    }
}

impl Traced {
    /// Without orders.
    pub(super) fn plain(data: Vec<f32>, standard_error: Vec<f32>) -> Self {
        Self { data, standard_error, ..Self::default() }
    }

    /// For texels with the orders from `first` to `count` apart; without any if that is 0.
    pub(super) fn with_orders(first: usize, count: u32) -> Self {
        let names = (first..=count as usize).map(|order| format!("order{order}"));
        let names = names.chain(["higher".to_owned()]).filter(|_| count > 0);
        let layers = names.map(|name| TexelLayer { name, data: Vec::new(), standard_error: Vec::new() }).collect();
        Self { layers, first, ..Self::default() }
    }

    /// Adds the light of a texel.
    pub(super) fn add(&mut self, light: &[Light; 3]) {
        self.add_parts(
            light,
            |light| light.each_ref().map(|light| light.total),
            |orders, i| orders.each_ref().map(|orders| orders[i]),
        );
    }

    /// Adds the light of a texel of several wavelengths or colours: `whole` makes the three channels of them, `part` those of an order
    /// by its place in the lists that are given.
    pub(super) fn add_parts<const N: usize>(
        &mut self,
        light: &[Light; N],
        whole: impl Fn(&[Light; N]) -> [Estimate; 3],
        part: impl Fn(&[Vec<Estimate>; N], usize) -> [Estimate; 3],
    ) {
        whole(light).into_iter().for_each(|estimate| self.add_value(estimate));
        let (first, count) = (self.first, self.layers.len());
        if count == 0 {
            return;
        }
        let orders = light.each_ref().map(|light| light.orders.split(first, first + count - 2));
        for (i, layer) in self.layers.iter_mut().enumerate() {
            for Estimate { value, standard_error } in part(&orders, i) {
                layer.data.push(value as f32);
                layer.standard_error.push(standard_error as f32);
            }
        }
    }

    pub(super) fn add_value(&mut self, Estimate { value, standard_error }: Estimate) {
        self.data.push(value as f32);
        self.standard_error.push(standard_error as f32);
    }
}
