//! The methods between which a plan picks and which a request can force. Each is a value: what a stage, a twin or a chart
//! knows of it is found by an exhaustive match, or by going through `ALL`.

use crate::cumulus::Surface;
use crate::projection::Side;
use crate::tables::Detail;

/// Names of an enum's values, cheap to exact, from one table.
macro_rules! named {
    ($type:ident: $first:ident = $first_name:literal $(, $variant:ident $(($of:expr))? = $name:literal)+) => {
        impl $type {
            /// Every method, by its name, cheap to exact.
            pub const ALL: [(&'static str, Self); [$first_name $(, $name)+].len()] =
                [($first_name, Self::$first) $(, ($name, Self::$variant $(($of))?))+];
            /// The names in a row.
            pub(crate) const WORDS: &'static str = concat!($first_name $(, " | ", $name)+);

            /// Its name.
            pub const fn name(self) -> &'static str {
                match self {
                    Self::$first { .. } => $first_name,
                    $(Self::$variant { .. } => $name,)+
                }
            }
        }
    };
}

/// How light that air scatters more than once is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum AirMethod {
    /// Not at all: light scattered once alone.
    Single,
    /// The same from all directions, in a closed sum (Hillaire 2020): what engines do.
    Isotropic,
    /// Light scattered twice, and no more (Nishita and others 1996).
    SecondOrder,
    /// All orders, by angular moments at every height and sun.
    Moments,
}

named! {
    AirMethod:
    Single = "single",
    Isotropic = "isotropic",
    SecondOrder = "second-order",
    Moments = "moments"
}

impl AirMethod {
    /// Relative error, root mean square over views of the sky for suns from the zenith to deep twilight: medians of docs/charts/air.csv.
    pub fn error(self) -> f64 {
        match self {
            Self::Single => 0.66,
            Self::Isotropic => 0.22,
            Self::SecondOrder => 0.3,
            Self::Moments => 0.006,
        }
    }

    /// What it does, in words.
    pub fn about(self) -> &'static str {
        match self {
            Self::Single => "light scattered once",
            Self::Isotropic => "light scattered again comes from everywhere",
            Self::SecondOrder => "two orders of scattering",
            Self::Moments => "all orders of scattering",
        }
    }
}

/// How slab light is computed, as a request asks for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// A veil that scatters sunlight once and the rest evenly: exact in flux, rough in radiance unless it is thin.
    Forward,
    /// The model of 2006, repaired: orders 0, 1, 2 in closed form; all higher orders isotropic, closed against the paper's
    /// fluxes for its own droplets (7 um, broadness 2), against exact ones for others.
    Analytic,
    /// Single scattering exact; all the rest from tables of the exact solution.
    Tabulated,
    /// Monte Carlo through all layers in three dimensions: minutes, for comparisons.
    Reference(Reference),
}

named! {
    Method:
    Forward = "forward",
    Analytic = "analytic",
    Tabulated = "tabulated",
    Reference(Reference { seed: Reference::SEED, orders: 0 }) = "reference"
}

/// Settings of the method "reference".
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reference {
    /// Of its random numbers: other seeds give other noise.
    pub seed: u32,
    /// Orders of scattering whose light is told apart, up to [`Reference::MOST_ORDERS`]; 0 for none.
    pub orders: u32,
}

impl Reference {
    /// Seed unless another is asked for.
    pub const SEED: u32 = 1;
    /// Most orders told apart.
    pub const MOST_ORDERS: u32 = 8;
}

impl Method {
    /// The methods that a device runs: all but Monte Carlo.
    pub fn fast() -> impl Iterator<Item = Self> {
        Self::ALL.into_iter().map(|(_, method)| method).filter(|method| method.reference().is_none())
    }

    /// Its settings, if it is the reference.
    pub fn reference(self) -> Option<Reference> {
        match self {
            Self::Reference(reference) => Some(reference),
            Self::Forward | Self::Analytic | Self::Tabulated => None,
        }
    }
}

/// Errors of the veil's radiance from below and from above, up to an optical depth each: root mean square over suns up to 88 degrees and
/// views up to 85. From above it is the low suns, whose light goes on along the layer.
const VEIL_BELOW: [(f64, f64); 6] = [(0.0625, 0.1), (0.125, 0.14), (0.25, 0.2), (0.353, 0.25), (0.5, 0.4), (0.7, 0.5)];
/// See [`VEIL_BELOW`].
const VEIL_ABOVE: [(f64, f64); 2] = [(0.044, 0.37), (0.0625, 0.45)];

/// A fast method of slab light with the size of its tables: what a plan settles on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SlabMethod {
    /// Light scattered once, and even light.
    Forward,
    /// Closed forms of the first orders.
    Analytic,
    /// Tables of the exact solution, of a size.
    Tabulated(Detail),
}

impl SlabMethod {
    /// Every one, cheap to exact.
    pub const ALL: [Self; 5] = [
        Self::Forward,
        Self::Analytic,
        Self::Tabulated(Detail::Coarse),
        Self::Tabulated(Detail::Fine),
        Self::Tabulated(Detail::Finest),
    ];

    /// What a request asks for to get it, in one of its sizes.
    pub fn asked_as(self) -> Method {
        match self {
            Self::Forward => Method::Forward,
            Self::Analytic => Method::Analytic,
            Self::Tabulated(_) => Method::Tabulated,
        }
    }

    /// Its name with its size.
    pub fn name(self) -> &'static str {
        match self {
            Self::Forward => "forward",
            Self::Analytic => "analytic",
            Self::Tabulated(Detail::Coarse) => "tabulated coarse",
            Self::Tabulated(Detail::Fine) => "tabulated fine",
            Self::Tabulated(Detail::Finest) => "tabulated finest",
        }
    }

    /// Expected relative error of radiance, root mean square; docs/charts/slab.csv, with a margin. Within 10 degrees of the
    /// sun the two finer sizes err by up to 2.5 times as much.
    pub fn error(self) -> f64 {
        match self {
            Self::Forward => 0.6,
            Self::Analytic => 0.9,
            Self::Tabulated(Detail::Coarse) => 0.03,
            Self::Tabulated(Detail::Fine) => 0.006,
            Self::Tabulated(Detail::Finest) => 0.002,
        }
    }

    /// The same where all cloud has an optical depth that is known, seen from a side: of the veil, which is right where it is thin;
    /// docs/charts/slab-validity.csv. A view of neither side alone, or of unknown depth, has the error of all.
    pub fn error_of(self, sheet: Option<(f64, Side)>) -> f64 {
        let known = match (self, sheet) {
            (Self::Forward, Some((depth, Side::Below))) => VEIL_BELOW.iter().find(|(most, _)| depth <= *most),
            (Self::Forward, Some((depth, Side::Above))) => VEIL_ABOVE.iter().find(|(most, _)| depth <= *most),
            _ => None,
        };
        known.map_or(self.error(), |(_, error)| *error)
    }

    /// Size of the radiance tables that it reads, if it does.
    pub fn detail(self) -> Option<Detail> {
        match self {
            Self::Forward | Self::Analytic => None,
            Self::Tabulated(detail) => Some(detail),
        }
    }

    /// The cheapest that errs by no more than a tolerance, or else the most exact; of those that a request asks for by `method`.
    /// `sheet`: the optical depth of all cloud and the side from which it is seen, if they are known.
    pub(crate) fn within(tolerance: f64, method: Option<Method>, sheet: Option<(f64, Side)>) -> Self {
        let asked: Vec<_> =
            Self::ALL.into_iter().filter(|slab| method.is_none_or(|method| slab.asked_as() == method)).collect();
        let fits = asked.iter().find(|slab| slab.error_of(sheet) <= tolerance);
        fits.or(asked.last()).copied().unwrap_or(Self::Analytic)
    }
}

/// What is told of a cloud beside the optical depths of its columns: least first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Told {
    /// Nothing.
    Depths,
    /// One of its edges, or how thick it is over a flat base.
    Heights,
    /// Base and top.
    Shapes,
}

/// How sunlight is carried through a cloud that is not the same everywhere.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Transport {
    /// Each column by itself, as if its neighbours were like it (independent columns): what most renderers do. For
    /// comparison.
    Columns,
    /// A column as deep as the slanted ray to the sun that ends at its base (tilted independent columns); seen from above,
    /// slopes without their shadows.
    Tilted,
    /// Columns lit by what enters around them: the sunlit parts of the cloud's top, blurred as light spreads.
    Entry,
    /// The mean of the two above: each errs where the other does not.
    Blended,
    /// Light scattered many times from a lattice of cubes, solved along 14 directions in three dimensions.
    Lattice,
}

named! { Transport: Columns = "columns", Tilted = "tilted", Entry = "entry", Blended = "blended", Lattice = "lattice" }

impl Transport {
    /// Relative error of light at the base of uneven cloud, root mean square over texels, against Monte Carlo in three
    /// dimensions: mean over a closed and a broken field and suns at 60 and 80 degrees, rounded up (docs/charts/light.csv).
    /// On the ground a kilometre below it is a fraction of that.
    pub fn error(self) -> f64 {
        match self {
            Self::Columns => 0.57,
            Self::Tilted => 0.43,
            Self::Entry => 0.60,
            Self::Blended => 0.34,
            Self::Lattice => 0.13,
        }
    }

    /// Relative error of the radiance of uneven cloud from a side, root mean square over rays and directions, against Monte Carlo in
    /// three dimensions: mean over suns at 40 and 60 degrees, rounded up, of broken cloud where there may be gaps and of an
    /// overcast where there are none (docs/charts/light.csv).
    pub fn radiance_error(self, side: Side, gaps: bool) -> f64 {
        match (self, side, gaps) {
            (Self::Columns, Side::Below, false) => 0.24,
            (Self::Columns, Side::Above, false) => 0.22,
            (Self::Columns, Side::Below, true) => 0.56,
            (Self::Columns, Side::Above, true) => 0.41,
            (Self::Tilted, Side::Below, false) => 0.19,
            (Self::Tilted, Side::Above, false) => 0.16,
            (Self::Tilted, Side::Below, true) => 0.49,
            (Self::Tilted, Side::Above, true) => 0.50,
            (Self::Entry, Side::Below, false) => 0.16,
            (Self::Entry | Self::Blended, Side::Above, false) => 0.15,
            (Self::Entry, Side::Below, true) => 0.61,
            (Self::Entry | Self::Blended, Side::Above, true) => 0.61,
            (Self::Blended, Side::Below, false) => 0.15,
            (Self::Blended, Side::Below, true) => 0.49,
            (Self::Lattice, Side::Below, false) => 0.04,
            (Self::Lattice, Side::Above, false) => 0.08,
            (Self::Lattice, Side::Below, true) => 0.16,
            (Self::Lattice, Side::Above, true) => 0.13,
        }
    }

    /// Relative errors of light in a stratocumulus with a flat top and a ragged base that is given by so much: transmitted flux, radiance from
    /// below and from above, root mean square over texels, against Monte Carlo of what it is; largest of suns at 0 and 60 degrees, rounded up
    /// (docs/method.md 5.3).
    pub fn format_errors(self, told: Told) -> [f64; 3] {
        match (self, told) {
            (Self::Columns, Told::Depths | Told::Heights) => [0.16, 0.08, 0.19],
            (Self::Columns, Told::Shapes) => [0.11, 0.08, 0.19],
            (Self::Tilted, Told::Depths) => [0.14, 0.25, 0.19],
            (Self::Tilted, Told::Heights) => [0.23, 0.35, 0.39],
            (Self::Tilted, Told::Shapes) => [0.21, 0.37, 0.19],
            (Self::Entry, Told::Depths) => [0.16, 0.09, 0.19],
            (Self::Entry, Told::Heights) => [0.42, 0.44, 0.45],
            (Self::Entry, Told::Shapes) => [0.11, 0.09, 0.19],
            (Self::Blended, Told::Depths) => [0.10, 0.15, 0.19],
            (Self::Blended, Told::Heights) => [0.26, 0.34, 0.45],
            (Self::Blended, Told::Shapes) => [0.12, 0.21, 0.19],
            (Self::Lattice, Told::Depths) => [0.12, 0.20, 0.34],
            (Self::Lattice, Told::Heights) => [0.37, 0.50, 0.41],
            (Self::Lattice, Told::Shapes) => [0.08, 0.04, 0.04],
        }
    }
}

/// How light in a layer of cumulus is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CumulusMethod {
    /// The shader of 2000 with its own constants.
    Shader3Published,
    /// The shader that followed it, repaired, with the constants of its pictures.
    ShaderPublished,
    /// The veil as it was published, which never darkens.
    ForwardPublished,
    /// The shader of 2000, its constants fitted to Monte Carlo: a surface with creases, and an edge that glows.
    Shader3,
    /// The shader that followed it, repaired and fitted in the same way.
    Shader,
    /// A veil that scatters forwards, by its thickness alone: right for thin cloud before the sun.
    Forward,
    /// Three octaves of light scattered once, each broader and deeper in the cloud than the one before.
    Octaves,
    /// Dressed single scattering, and all other light from a lattice that is solved along 14 directions in three dimensions.
    Lattice,
}

named! {
    CumulusMethod:
    Shader3Published = "shader3-published",
    ShaderPublished = "shader-published",
    ForwardPublished = "forward-published",
    Shader3 = "shader3",
    Shader = "shader",
    Forward = "forward",
    Octaves = "octaves",
    Lattice = "lattice"
}

impl CumulusMethod {
    /// Constants of the shaders that take a cloud for its surface.
    pub fn surface(self) -> Option<Surface> {
        match self {
            Self::Shader3Published => Some(Surface::PUBLISHED_3),
            Self::ShaderPublished => Some(Surface::PUBLISHED),
            Self::Shader3 => Some(Surface::REFITTED_3),
            Self::Shader => Some(Surface::REFITTED),
            Self::ForwardPublished | Self::Forward | Self::Octaves | Self::Lattice => None,
        }
    }

    /// Relative error, root mean square over pictures of clouds at many suns, before and behind them (docs/charts/cumulus.csv).
    pub fn error(self) -> f64 {
        match self {
            Self::Shader3Published => 1.2,
            Self::ShaderPublished => 0.95,
            Self::ForwardPublished => 0.8,
            Self::Shader3 => 0.55,
            Self::Shader => 0.55,
            Self::Forward => 0.64,
            Self::Octaves => 0.24,
            Self::Lattice => 0.07,
        }
    }

    /// What it does, in words.
    pub fn about(self) -> &'static str {
        match self {
            Self::Shader3Published | Self::Shader3 => "surface with creases by angle and a glowing edge",
            Self::ShaderPublished | Self::Shader => "surface with creases by distance and a glowing edge",
            Self::ForwardPublished => "veil that scatters forwards and never darkens",
            Self::Forward => "veil that scatters forwards",
            Self::Octaves => "3 octaves of single scattering",
            Self::Lattice => "14 directions, dressed single scattering",
        }
    }
}
