//! Droplets of other effective radii than that which the tables of a layer are made for.
//!
//! A slab of them is about a slab of the tables' droplets of another optical depth. What light does that is scattered often depends on `(1 - g) tau`
//! alone, g being the asymmetry (similarity: van de Hulst 1980, chapter 14); light that is scattered once, and the beam, depend on `tau` itself.

use std::collections::HashMap;
use std::ops::RangeInclusive;
use std::sync::{LazyLock, Mutex, PoisonError};

use rayon::prelude::*;

use super::ensemble::{Sampling, bulk};
use super::size::SizeDistribution;
use super::water;

/// Nodes for each doubling of the radius.
const NODES_PER_OCTAVE: f64 = 4.0;
/// Spheres of a node, a fifth of those of tables: `1 - g` is within 0.2 % of theirs, in some 50 milliseconds for droplets of 15 µm.
const SAMPLING: Sampling = Sampling { wavelengths: 9, radii: 300 };
/// Nodes kept at once, of all mixes: more than a hundred mixes over their usual radii.
const MOST_KEPT: usize = 2048;

/// Optics of droplets by their effective radius, beside those of one radius.
#[derive(Debug, Clone, PartialEq)]
pub struct Radii {
    /// Number of the first node.
    first: f64,
    /// Asymmetry, and extinction cross-section over the square of the effective radius.
    nodes: Vec<[f64; 2]>,
    own: [f64; 2],
}

impl Radii {
    /// Radii of a range (µm) beside that of droplets of these sizes, of water or another `real` refractive index, at a wavelength, nm. What is beyond the range
    /// is taken as at its end.
    #[must_use]
    pub fn new(
        sizes: &SizeDistribution,
        real: Option<f64>,
        wavelength_nm: f64,
        range_um: &RangeInclusive<f64>,
    ) -> Self {
        let own_um = sizes.effective_radius_um;
        let place = |radius_um: f64| NODES_PER_OCTAVE * radius_um.log2();
        let first = place(range_um.start().min(own_um)).floor();
        let last = place(range_um.end().max(own_um)).ceil().max(first + 1.0);
        let mix = NodeMix { broadness: sizes.broadness, real, wavelength_nm };
        let node = |number: usize| mix.kept_node(first as i64 + number as i64);
        let nodes = (0..=(last - first) as usize).into_par_iter().map(node).collect();
        let radii = Self { first, nodes, own: [0.0; 2] };
        Self { own: radii.at(own_um), ..radii }
    }

    /// Asymmetry of droplets of an effective radius, µm.
    #[must_use]
    pub fn asymmetry(&self, radius_um: f64) -> f64 {
        self.at(radius_um)[0]
    }

    /// Extinction of equally many droplets of an effective radius, µm, relative to those of the mix.
    #[must_use]
    pub fn relative_extinction(&self, radius_um: f64) -> f64 {
        self.at(radius_um)[1] / self.own[1]
    }

    /// The optical depth at which the droplets of the mix are most like those of an effective radius (µm) at the optical depth `depth`.
    #[must_use]
    pub fn counts_as(&self, depth: f64, radius_um: f64) -> f64 {
        let similar = (1.0 - self.asymmetry(radius_um)) / (1.0 - self.own[0]);
        // Scattered again: measured against slabs of these droplets, for both fluxes and radiances.
        let again = -(-depth).exp_m1();
        depth * (1.0 + (similar - 1.0) * again)
    }

    /// Between nodes both are nearly linear in the radius to the power of -2/3, by which large droplets near geometrical optics; the cross-section is
    /// kept over the square of the radius here.
    fn at(&self, radius_um: f64) -> [f64; 2] {
        let place = (NODES_PER_OCTAVE * radius_um.log2() - self.first).clamp(0.0, (self.nodes.len() - 1) as f64);
        let low = (place as usize).min(self.nodes.len().saturating_sub(2));
        let linear = |node: f64| ((self.first + node) / NODES_PER_OCTAVE).exp2().powf(-2.0 / 3.0);
        let (near, far) = (linear(low as f64), linear(low as f64 + 1.0));
        let part = ((linear(place) - near) / (far - near)).clamp(0.0, 1.0);
        let mixed = |which: usize| self.nodes[low][which] * (1.0 - part) + self.nodes[low + 1][which] * part;
        [mixed(0), mixed(1) * radius_um.powi(2)]
    }
}

/// What nodes are of, but for their radius.
struct NodeMix {
    broadness: f64,
    real: Option<f64>,
    wavelength_nm: f64,
}

impl NodeMix {
    /// A scene's images are looked at with every request, so nodes are kept.
    fn kept_node(&self, number: i64) -> [f64; 2] {
        type Key = (u64, Option<u64>, u64, i64);
        static KEPT: LazyLock<Mutex<HashMap<Key, [f64; 2]>>> = LazyLock::new(Mutex::default);
        let kept = || KEPT.lock().unwrap_or_else(PoisonError::into_inner);
        let key = (self.broadness.to_bits(), self.real.map(f64::to_bits), self.wavelength_nm.to_bits(), number);
        if let Some(found) = kept().get(&key) {
            return *found;
        }
        let made = self.node(number as f64);
        let mut all = kept();
        if all.len() >= MOST_KEPT {
            all.clear();
        }
        all.insert(key, made);
        made
    }

    fn node(&self, number: f64) -> [f64; 2] {
        let effective_radius_um = (number / NODES_PER_OCTAVE).exp2();
        let sizes = SizeDistribution { effective_radius_um, broadness: self.broadness };
        let index = |wavelength_nm: f64| water::index(wavelength_nm, self.real);
        let (cross_section_um2, asymmetry) = bulk(&sizes, self.wavelength_nm, &index, &SAMPLING);
        [asymmetry, cross_section_um2 / effective_radius_um.powi(2)]
    }
}
