//! Rows of the chart "slab": the methods that a plan can pick, variations of them, and the reference.

use super::figure::{BLACK, BLUE, BROWN, GREEN, GREY, ORANGE, PURPLE, RED};
use super::medium::{Medium, Radiance};
use super::veil::PublishedVeil;
use crate::method::SlabMethod;
use crate::tables::Detail;
use plotters::style::RGBColor;

/// Largest tolerance of a frame whose shading is timed.
const LARGEST_TOLERANCE: f64 = 0.03;

/// A method of computing slab light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SlabRow {
    /// One that a plan can pick.
    Planned(SlabMethod),
    /// Method "forward" as it was published: see `src/slab/veil.rs`.
    ForwardPublished,
    /// Method "analytic" closed against exact fluxes for all droplets; as it is, it takes the paper's fluxes for the paper's
    /// droplets (Bouthors et al. 2006, repaired).
    AnalyticExact,
    /// Monte Carlo.
    Reference,
}

/// A method's radiance of one medium, given the cosine of the sun's zenith.
pub(super) type UnderSuns<'a> = Box<dyn Fn(f64) -> Box<dyn Radiance + 'a> + Sync + 'a>;

impl SlabRow {
    /// Every row, from the fastest to the most exact.
    #[must_use]
    pub fn all() -> Vec<Self> {
        let of = |method| match method {
            SlabMethod::Analytic => vec![Self::Planned(method), Self::AnalyticExact],
            SlabMethod::Forward => vec![Self::ForwardPublished, Self::Planned(method)],
            SlabMethod::Tabulated(_) => vec![Self::Planned(method)],
        };
        SlabMethod::ALL.into_iter().flat_map(of).chain([Self::Reference]).collect()
    }

    /// Its name in tables and pictures.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Planned(method) => method.name(),
            Self::ForwardPublished => "forward as published",
            Self::AnalyticExact => "analytic with exact fluxes",
            Self::Reference => "reference",
        }
    }

    pub(super) fn colour(self) -> RGBColor {
        match self {
            Self::ForwardPublished => GREY,
            Self::Planned(SlabMethod::Forward) => BLACK,
            Self::Planned(SlabMethod::Analytic) => ORANGE,
            Self::AnalyticExact => BROWN,
            Self::Planned(SlabMethod::Tabulated(Detail::Coarse)) => GREEN,
            Self::Planned(SlabMethod::Tabulated(Detail::Fine)) => BLUE,
            Self::Planned(SlabMethod::Tabulated(Detail::Finest)) => PURPLE,
            Self::Reference => RED,
        }
    }

    /// Method and tolerance of a request that takes it; `None` where a texture takes too long to be measured so.
    pub(super) fn query(self) -> Option<[(&'static str, String); 2]> {
        let method = match self {
            Self::Planned(method) => method,
            // They differ in a table's numbers, not in its size.
            Self::AnalyticExact => SlabMethod::Analytic,
            Self::ForwardPublished => SlabMethod::Forward,
            Self::Reference => return None,
        };
        let tolerance = method.error().min(LARGEST_TOLERANCE).to_string();
        Some([("method", method.asked_as().name().to_owned()), ("tolerance", tolerance)])
    }

    /// Its radiance in double precision; `None` where each value is a run of its own.
    pub(super) fn under_suns(self, medium: &Medium) -> Option<UnderSuns<'_>> {
        match self {
            Self::ForwardPublished => Some(Box::new(|mu_sun| Box::new(PublishedVeil { mu_sun }))),
            Self::Planned(SlabMethod::Forward) => Some(Box::new(|mu_sun| Box::new(medium.veil(mu_sun)))),
            Self::Planned(SlabMethod::Analytic) => Some(Box::new(|mu_sun| Box::new(medium.analytic(mu_sun)))),
            Self::AnalyticExact => Some(Box::new(|mu_sun| Box::new(medium.analytic_exact(mu_sun)))),
            Self::Planned(SlabMethod::Tabulated(detail)) => {
                let table = medium.table(detail.size());
                Some(Box::new(move |mu_sun| Box::new(medium.tabulated(&table, mu_sun))))
            }
            Self::Reference => None,
        }
    }
}
