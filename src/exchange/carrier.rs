//! What carries light from plane to plane.

use super::fourier::Fourier;
use super::pair::Pair;
use super::rings::Rings;

/// How light is carried from plane to plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kernel {
    /// Three squares of sides h, 2h and 8h on mip levels, one bilinear sample each, with the weights 0.4, 0.38667, 0.21333:
    /// Bouthors et al. 2006, section 5.3.
    PaperRings,
    /// Squares of sides h, 2h, 4h, 8h on mip levels, four bilinear samples each; weights fitted to the exact kernel.
    FourTapRings,
    /// The exact kernel: waves of wave number k are multiplied by its Fourier transform, `kh K1(kh)`.
    Fourier,
}

/// A kernel on a grid.
pub(super) enum Carrier {
    Rings(Rings),
    Fourier(Fourier),
}

impl Carrier {
    pub(super) fn new(side: usize, height_texels: f64, kernel: Kernel) -> Self {
        assert!(side.is_power_of_two(), "{side} texels a side are no power of two");
        match kernel {
            Kernel::PaperRings => Self::Rings(Rings::paper(side, height_texels)),
            Kernel::FourTapRings => Self::Rings(Rings::four_taps(side, height_texels)),
            Kernel::Fourier => Self::Fourier(Fourier::new(side, height_texels)),
        }
    }

    /// `K field`.
    pub(super) fn gather(&self, field: &mut [Pair]) {
        match self {
            Self::Rings(rings) => rings.gather(field),
            Self::Fourier(fourier) => fourier.gather(field),
        }
    }

    /// What of the ground's exitance `field` does not come back to the ground: `(1 - K R K) field`. Written so that it is
    /// exact where next to nothing gets lost. `spare`: maps to work in.
    pub(super) fn lose(&self, field: &mut [Pair], not_reflected: &[Pair], spare: &mut [Vec<Pair>; 2]) {
        match self {
            Self::Rings(rings) => rings.lose(field, not_reflected),
            Self::Fourier(fourier) => fourier.lose(field, not_reflected, spare),
        }
    }
}
