//! Angular moments of diffuse light at nodes of height and sun.

use super::axes::Axes;
use super::harmonics::{count, index};

/// Components of the coherency tensor that are stored: xx, yy, zz, xz.
pub const TENSOR: usize = 4;
/// Mean radiance that counts as none, per unit sun: its logarithm is finite, and no display shows it.
const DARK: f64 = 1e-40;

/// Moments as the quadrature gives them: `I_lm`, then the tensor, then the downward flux, per node.
#[derive(Clone, Debug)]
pub struct Sums {
    /// Number of `I_lm`.
    pub moments: usize,
    /// Values, heights outermost, [`Sums::stride`] per node.
    pub values: Vec<f64>,
}

impl Sums {
    /// All zero.
    #[must_use]
    pub fn zero(axes: Axes, degree: usize) -> Self {
        let moments = count(degree);
        Self { moments, values: vec![0.0; axes.heights * axes.suns * (moments + TENSOR + 1)] }
    }

    /// Values per node.
    #[must_use]
    pub fn stride(&self) -> usize {
        self.moments + TENSOR + 1
    }

    /// Adds `factor` times another set.
    pub fn add(&mut self, factor: f64, other: &Self) {
        for (sum, value) in self.values.iter_mut().zip(&other.values) {
            *sum += factor * value;
        }
    }

    /// Sum of the mean radiance over all nodes: how much light an order has left.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.values.chunks_exact(self.stride()).map(|node| node[0]).sum()
    }

    /// The downward flux at a node.
    #[must_use]
    pub fn down(&self, node: usize) -> f64 {
        self.values[node * self.stride() + self.moments + TENSOR]
    }
}

/// The table that is interpolated: logarithm of the mean radiance, all else relative to it.
///
/// Across the terminator light falls by orders of magnitude from node to node; interpolated linearly it would be three
/// times too bright, while ratios hardly change.
#[derive(Clone, Debug)]
pub struct Field {
    /// Nodes.
    pub axes: Axes,
    /// Degree of the moments.
    pub degree: usize,
    /// `ln I_00`, heights outermost.
    pub ln_mean: Vec<f64>,
    /// `I_lm / I_00` (l outermost), then the tensor over `I_00`, [`Field::stride`] per node.
    pub ratios: Vec<f64>,
}

impl Field {
    /// Ratios per node of a given degree.
    #[must_use]
    pub fn stride(&self) -> usize {
        count(self.degree) + TENSOR
    }

    /// Forms logarithms and ratios.
    #[must_use]
    pub fn new(axes: Axes, degree: usize, sums: &Sums) -> Self {
        let moments = sums.moments;
        let mut ln_mean = Vec::with_capacity(axes.heights * axes.suns);
        let mut ratios = Vec::with_capacity(ln_mean.capacity() * (moments + TENSOR));
        for node in sums.values.chunks_exact(sums.stride()) {
            let mean = node[0];
            ln_mean.push(mean.max(DARK).ln());
            if mean > DARK {
                ratios.extend(node[..moments + TENSOR].iter().map(|value| value / mean));
            } else {
                let isotropic = [1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0, 0.0];
                ratios.push(1.0);
                ratios.extend(std::iter::repeat_n(0.0, moments - 1).chain(isotropic));
            }
        }
        let mut field = Self { axes, degree, ln_mean, ratios };
        field.mend_zenith_sun();
        field
    }

    /// With the sun at the zenith the moments of m >= 1 are quotients of noise; their limit is that of the node before.
    fn mend_zenith_sun(&mut self) {
        let (stride, suns) = (self.stride(), self.axes.suns);
        for height in 0..self.axes.heights {
            let last = (height * suns + suns - 1) * stride;
            for l in 1..=self.degree {
                let azimuthal = index(l, 1)..index(l + 1, 0);
                self.ratios.copy_within(
                    last - stride + azimuthal.start..last - stride + azimuthal.end,
                    last + azimuthal.start,
                );
            }
        }
    }
}

/// A positive function of the sun's cosine on the table's nodes.
#[derive(Clone, Debug)]
pub struct SunSeries {
    axes: Axes,
    ln: Vec<f64>,
}

impl SunSeries {
    /// From values at the sun nodes.
    #[must_use]
    pub fn new(axes: Axes, values: impl Iterator<Item = f64>) -> Self {
        Self { axes, ln: values.map(|value| value.max(DARK).ln()).collect() }
    }

    /// Logarithms at the sun nodes.
    #[must_use]
    pub fn logarithms(&self) -> &[f64] {
        &self.ln
    }

    /// From logarithms at the sun nodes.
    #[must_use]
    pub fn from_logarithms(axes: Axes, ln: Vec<f64>) -> Self {
        Self { axes, ln }
    }

    /// Value at a sun; 0 in the dark.
    #[must_use]
    pub fn at(&self, sun_cosine: f64) -> f64 {
        let Some(place) = self.axes.sun(sun_cosine) else { return 0.0 };
        let (lower, upper) = (self.ln[place.index], self.ln[place.index + 1]);
        let value = (lower + (upper - lower) * place.fraction).exp();
        if value > 2.0 * DARK { value } else { 0.0 }
    }
}
