//! Numbers with a unit and a range: the only way into a scene, so what they hold needs no second check.

use std::ops::RangeInclusive;

/// A number of a scene: finite, inside [`Quantity::RANGE`], in [`Quantity::UNIT`].
pub trait Quantity: Copy + Sized + TryFrom<f64, Error = OutOfRange> {
    /// Allowed values, both ends included.
    const RANGE: RangeInclusive<f64>;
    /// Unit as written in messages; empty for pure numbers.
    const UNIT: &'static str;
    /// The number itself.
    fn get(self) -> f64;
}

/// What was given where a [`Quantity`] was expected.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{given} is outside {} to {}{}{unit}", range.start(), range.end(), if unit.is_empty() { "" } else { " " })]
pub struct OutOfRange {
    given: f64,
    range: RangeInclusive<f64>,
    unit: &'static str,
}

macro_rules! quantities {
    ($($(#[$doc:meta])+ $name:ident: $range:expr, $unit:literal $(, $normal:ident)?;)+) => {$(
        $(#[$doc])+
        #[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
        pub struct $name(f64);

        impl Quantity for $name {
            const RANGE: RangeInclusive<f64> = $range;
            const UNIT: &'static str = $unit;
            fn get(self) -> f64 {
                self.0
            }
        }

        impl TryFrom<f64> for $name {
            type Error = OutOfRange;
            fn try_from(given: f64) -> Result<Self, OutOfRange> {
                // `contains` is false for NaN.
                if !Self::RANGE.contains(&given) {
                    return Err(OutOfRange { given, range: Self::RANGE, unit: Self::UNIT });
                }
                $(let given = $normal(given);)?
                // Adding zero turns -0 into 0: one number, one scene id.
                Ok(Self(given + 0.0))
            }
        }
    )+};
}

quantities! {
    /// Side of the square, periodic domain.
    ExtentM: 1.0..=1e6, "m";
    /// Angle from straight up, towards the sun.
    ZenithDeg: 0.0..=180.0, "degrees";
    /// Clockwise from north; kept as 0 to below 360, as -90 and 270 are one direction.
    AzimuthDeg: -360.0..=360.0, "degrees", within_a_turn;
    /// Of a place, north positive.
    LatitudeDeg: -90.0..=90.0, "degrees";
    /// Of a place, east positive.
    LongitudeDeg: -180.0..=180.0, "degrees";
    /// Of a place above the sea.
    AltitudeM: -500.0..=11_000.0, "m";
    /// Angle across the sun's disc; 0 is parallel light.
    AngularDiameterDeg: 0.0..=10.0, "degrees";
    /// Irradiance of the sun on a plane that faces it, above the clouds: klx or the caller's own unit.
    SunIrradiance: 0.0..=1e6, "";
    /// Radiance of the uniform sky: kcd/m² or the caller's own unit.
    SkyRadiance: 0.0..=1e6, "";
    /// Vertical optical depth of aerosol at 550 nm: up to what the air's tables were measured for.
    AerosolDepth: 0.0..=1.0, "";
    /// Exponent of wavelength in the optical depth of aerosol.
    Angstrom: 0.0..=3.0, "";
    /// Asymmetry of aerosol: sharper forward peaks have more moments than the air's tables hold.
    AerosolAsymmetry: 0.0..=0.84, "";
    /// Effective radius of aerosol's particles.
    ParticleRadiusUm: 0.02..=20.0, "µm";
    /// Imaginary part of a refractive index: absorption.
    ImaginaryIndex: 0.0..=1.0, "";
    /// Height over which aerosol thins to 1/e.
    AerosolScaleM: 100.0..=10_000.0, "m";
    /// Column of ozone.
    OzoneDu: 0.0..=1000.0, "Dobson units";
    /// Column of molecules, relative to the standard one at sea level.
    RayleighColumn: 0.0..=2.0, "";
    /// Part of light that is not absorbed.
    Albedo: 0.0..=1.0, "";
    /// Height of a cloud base above ground.
    BaseM: 0.0..=20_000.0, "m";
    /// Height of a cloud top above ground.
    TopM: 0.0..=30_000.0, "m";
    /// Height that a sample of 0 of a map of heights stands for.
    OffsetM: -20_000.0..=30_000.0, "m";
    /// Optical depth of a column of cloud at 550 nm.
    OpticalDepth: 0.0..=1000.0, "";
    /// Optical depth for a sample of 1.
    DepthScale: 0.0..=100_000.0, "";
    /// A sample that stands for "no cloud": any single-precision number, about.
    FillValue: -3.4e38..=3.4e38, "";
    /// Geometric thickness of cloud.
    ThicknessM: 0.0..=100_000.0, "m";
    /// Mean thickness of the cloudy part of a synthetic field; its soft clip at 2.5 means keeps towers within 100 km.
    MeanThicknessM: 0.0..=40_000.0, "m";
    /// Part of the domain that has cloud.
    Coverage: 0.0..=1.0, "";
    /// Standard deviation of optical depth among cloudy columns, relative to its mean.
    DepthSpread: 0.2..=1.5, "";
    /// Part of the domain that has cumulus: beyond, clouds would merge into a deck.
    CumulusCoverage: 0.0..=0.6, "";
    /// Width of a full-grown cumulus.
    CloudWidthM: 50.0..=20_000.0, "m";
    /// Depth of the soft edge of cumulus.
    EdgeM: 0.0..=200.0, "m";
    /// East or north of the domain's middle; within the domain's side besides.
    SpherePlaceM: -1e6..=1e6, "m";
    /// Height of the centre of a sphere of cloud above ground.
    SphereHeightM: 0.0..=30_000.0, "m";
    /// Radius of a sphere of cloud.
    SphereRadiusM: 0.5..=20_000.0, "m";
    /// Size of a convective cell.
    CellM: 1.0..=1e6, "m";
    /// Extinction coefficient.
    ExtinctionPerM: 1e-4..=1.0, "per metre";
    /// Effective radius of droplets.
    EffectiveRadiusUm: 0.5..=50.0, "µm";
    /// Effective radius that a sample of 1 of its map stands for.
    RadiusScaleUm: 0.0..=1e6, "µm";
    /// Broadness of the modified gamma distribution.
    Broadness: 0.5..=20.0, "";
    /// Droplets per cubic centimetre.
    NumberPerCm3: 0.01..=10_000.0, "per cm³";
    /// Real part of a refractive index.
    RefractiveIndex: 1.01..=2.0, "";
    /// Asymmetry of the Henyey-Greenstein phase function. Backward peaks are not scaled away as forward ones are, so
    /// those narrower than the solver's directions resolve are refused.
    Asymmetry: -0.9..=0.98, "";
    /// Wind speed.
    SpeedMS: 0.0..=200.0, "m/s";
    /// Wind speed of eddies, root mean square per axis.
    TurbulenceMS: 0.0..=50.0, "m/s";
    /// Value of a phase function's table, in any scale.
    PhaseValue: 0.0..=1e12, "";
}

/// An angle in 0 to below 360 degrees. Whole turns are added in rounded steps: a tiny negative angle would become 360.
fn within_a_turn(degrees: f64) -> f64 {
    let turned = degrees.rem_euclid(360.0);
    if turned < 360.0 { turned } else { 0.0 }
}
