//! Methods that a request can force; the plan picks them otherwise.

/// How slab light is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// The model of 2006, repaired: orders 0, 1, 2 in closed form; all higher orders isotropic, closed against the paper's
    /// fluxes for its own droplets (7 um, broadness 2), against exact ones for others.
    Analytic,
    /// Single scattering exact; all the rest from tables of the exact solution.
    Tabulated,
    /// Monte Carlo: minutes, for comparisons. A slab for every texel of a cloud; all layers in three dimensions for light
    /// on the ground.
    Reference(Reference),
}

/// Settings of the method "reference".
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reference {
    /// Of its random numbers: other seeds give other noise.
    pub seed: u32,
}

impl Reference {
    /// Seed unless another is asked for.
    pub const SEED: u32 = 1;
}

impl Method {
    /// Every method, by its name, cheap to exact.
    pub const ALL: [(&'static str, Self); 3] = [
        ("analytic", Self::Analytic),
        ("tabulated", Self::Tabulated),
        ("reference", Self::Reference(Reference { seed: Reference::SEED })),
    ];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Analytic => "analytic",
            Self::Tabulated => "tabulated",
            Self::Reference(_) => "reference",
        }
    }

    /// Its settings, if it is the reference.
    pub fn reference(self) -> Option<Reference> {
        match self {
            Self::Reference(reference) => Some(reference),
            Self::Analytic | Self::Tabulated => None,
        }
    }
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
}

impl Transport {
    /// Every method and its name, cheap to exact.
    pub const ALL: [(&'static str, Self); 4] =
        [("columns", Self::Columns), ("tilted", Self::Tilted), ("entry", Self::Entry), ("blended", Self::Blended)];

    /// Its name.
    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|(_, method)| *method == self).map_or("", |(name, _)| name)
    }
}
