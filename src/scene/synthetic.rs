//! Synthetic fields of cloud.

use super::quantity::{CellM, Coverage, DepthSpread, MeanThicknessM};

/// A synthetic, tiling stratocumulus field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stratocumulus {
    /// Kind of structure.
    pub pattern: Pattern,
    /// Mean over the cloudy part.
    pub mean_m: MeanThicknessM,
    /// Part of the domain with more than 1 m of cloud.
    pub coverage: Coverage,
    /// Size of a convective cell or of a head of cirrus, or distance of streets. The domain holds whole cells: between two such sizes, one pattern fades into the other.
    pub cell_m: CellM,
    /// Picks one field of many alike.
    pub seed: u32,
    /// How optical depth is distributed among its columns.
    pub law: DepthLaw,
}

/// How optical depth is distributed among the cloudy columns of a synthetic field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DepthLaw {
    /// Water path is lognormal above a threshold; one extinction and one flat edge.
    Lognormal,
    /// Optical depth is gamma distributed, with this spread; columns have bases, tops and extinctions of their own.
    Gamma(DepthSpread),
}

impl DepthLaw {
    pub(super) const LOGNORMAL: &'static str = "lognormal";
    pub(super) const GAMMA: &'static str = "gamma";
    pub(super) const WORDS: [&'static str; 2] = [Self::LOGNORMAL, Self::GAMMA];

    /// Size of the cells of a field that gives none, metres. Cells are 10 to 100 km wide where satellites see them (Agee 1987); the least of that
    /// is what the usual domain of 20 km holds. Rows are three times as far apart as the boundary layer is deep; heads of cirrus are 1 to 2 km wide (Heymsfield 1975). Fields without a law
    /// keep the cells that they had before there were two.
    pub(super) fn cell_m(self, pattern: Pattern) -> f64 {
        match (self, pattern) {
            (Self::Gamma(_), Pattern::Closed | Pattern::Open) => 10_000.0,
            (_, Pattern::Cirrus) => 1500.0,
            _ => 2500.0,
        }
    }
}

/// Structure of a synthetic field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pattern {
    /// Closed cells: thick centres, thin rims.
    Closed,
    /// Open cells: rings of cloud around clear centres.
    Open,
    /// No cells: a -5/3 spectrum alone.
    Fractal,
    /// Rows along the wind, at a distance of a cell: by the law of gamma alone.
    Streets,
    /// Trails of ice that fell from heads as wide as a cell, along the wind: by the law of gamma alone.
    Cirrus,
}

impl Pattern {
    pub(super) const ALL: [(&'static str, Self); 5] = [
        ("closed", Self::Closed),
        ("open", Self::Open),
        ("fractal", Self::Fractal),
        ("streets", Self::Streets),
        ("cirrus", Self::Cirrus),
    ];
    pub(super) const WORDS: [&'static str; 5] =
        [Self::ALL[0].0, Self::ALL[1].0, Self::ALL[2].0, Self::ALL[3].0, Self::ALL[4].0];
    /// Without those that need the law of gamma.
    pub(super) const LOGNORMAL_WORDS: [&'static str; 3] = [Self::WORDS[0], Self::WORDS[1], Self::WORDS[2]];

    /// Whether its parts lie along the layer's wind, whatever its speed.
    pub(crate) fn lies_along_the_wind(self) -> bool {
        matches!(self, Self::Streets | Self::Cirrus)
    }
}
