//! Air above a lower boundary, and the sun's beam in it.

use std::f64::consts::PI;
use std::fmt;
use std::sync::Arc;

use super::depth::{DepthTable, SlantColumns};
use super::geometry::{TOP_M, sin_dip};
use super::peak::Peaked;
use super::profile::{Medium, Phase, Profile};

/// Angular radius of the sun's disc, radians (0.2666 degrees at one astronomical unit).
const SUN_RADIUS: f64 = 0.004_653;

/// Albedo for a beam by the cosine of its zenith angle.
pub type BeamAlbedo = Arc<dyn Fn(f64) -> f64 + Send + Sync>;

/// What ends the air below: the ground, or the top of a cloud layer. It reflects as a matt surface.
#[derive(Clone)]
pub struct Boundary {
    /// Height above sea level, m; 0 for the ground.
    pub height_m: f64,
    /// Albedo for the sun's beam, 0 to 1.
    pub beam_albedo: BeamAlbedo,
    /// Albedo for diffuse light, 0 to 1.
    pub diffuse_albedo: f64,
}

impl Boundary {
    /// Matt ground at sea level.
    #[must_use]
    pub fn ground(albedo: f64) -> Self {
        Self { height_m: 0.0, beam_albedo: Arc::new(move |_| albedo), diffuse_albedo: albedo }
    }
}

impl fmt::Debug for Boundary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Boundary")
            .field("height_m", &self.height_m)
            .field("diffuse_albedo", &self.diffuse_albedo)
            .finish_non_exhaustive()
    }
}

/// Air above a boundary with its table of optical depth.
#[derive(Clone, Debug)]
pub struct Air {
    /// What scatters and absorbs, without a forward peak of the aerosol that is too sharp for tables of moments.
    pub medium: Medium,
    /// Its coefficients by height.
    pub profile: Profile,
    /// What lies below.
    pub boundary: Boundary,
    /// Optical depth to the top.
    pub depth: DepthTable,
    /// The air with the peak, if one was taken away.
    peaked: Option<Peaked>,
}

impl Air {
    /// Tabulates the optical depth of a medium above a boundary.
    #[must_use]
    pub fn new(medium: Medium, boundary: Boundary) -> Self {
        let columns = SlantColumns::new(medium.aerosol.scale_height_m, boundary.height_m);
        Self::with(&columns, medium, boundary)
    }

    /// The same by amounts of air that are known already: of the aerosol's scale height and the boundary's height.
    #[must_use]
    pub fn with(columns: &SlantColumns, medium: Medium, boundary: Boundary) -> Self {
        let (peaked, medium) = match Peaked::split(&medium, columns) {
            Some((peaked, solved)) => (Some(peaked), solved),
            None => (None, medium),
        };
        let depth = DepthTable::new(&medium, columns);
        Self { profile: medium.profile(), medium, boundary, depth, peaked }
    }

    /// What scatters and absorbs, all of it.
    #[must_use]
    pub fn whole_medium(&self) -> &Medium {
        self.peaked.as_ref().map_or(&self.medium, |peaked| &peaked.medium)
    }

    /// Optical depth of all of that.
    #[must_use]
    pub fn whole_depth(&self) -> &DepthTable {
        self.peaked.as_ref().map_or(&self.depth, |peaked| &peaked.depth)
    }

    /// The phase function with which sunlight that the aerosol scattered once is seen from a height.
    #[must_use]
    pub fn seen_phase(&self, height_m: f64, sun_cosine: f64) -> Phase {
        let plain = || Arc::clone(&self.medium.aerosol.phase);
        self.peaked.as_ref().map_or_else(plain, |peaked| peaked.seen(self, height_m, sun_cosine))
    }

    /// Height of the boundary, m.
    #[must_use]
    pub fn floor_m(&self) -> f64 {
        self.boundary.height_m
    }

    /// Beam irradiance on the boundary per unit sun.
    #[must_use]
    pub fn beam_on_boundary(&self, sun_cosine: f64) -> f64 {
        if sun_cosine > 0.0 { sun_cosine * self.depth.transmittance(self.floor_m(), sun_cosine) } else { 0.0 }
    }

    /// Transmittance for the whole disc of the sun: within its radius of the horizon only a part of it is up. What the aerosol
    /// scatters within a peak too sharp for the tables counts as beam.
    ///
    /// The part's light is that of the middle of its height. No refraction.
    #[must_use]
    pub fn disc_transmittance(&self, height_m: f64, sun_cosine: f64) -> f64 {
        self.of_disc(&self.depth, height_m, sun_cosine)
    }

    /// The same of what is not scattered at all.
    #[must_use]
    pub fn disc_unscattered(&self, height_m: f64, sun_cosine: f64) -> f64 {
        self.of_disc(self.whole_depth(), height_m, sun_cosine)
    }

    fn of_disc(&self, depth: &DepthTable, height_m: f64, sun_cosine: f64) -> f64 {
        let horizon = -sin_dip(height_m, self.floor_m()).clamp(-1.0, 1.0).asin();
        let elevation = sun_cosine.clamp(-1.0, 1.0).asin() - horizon;
        let visible = visible_part(elevation / SUN_RADIUS);
        if visible <= 0.0 {
            return 0.0;
        }
        let middle = if elevation < SUN_RADIUS { 0.5 * (elevation + SUN_RADIUS) } else { elevation };
        visible * depth.transmittance(height_m, (horizon + middle).sin())
    }
}

/// Share of a disc above a straight horizon; `elevation` of its centre in radii.
fn visible_part(elevation: f64) -> f64 {
    let x = elevation.clamp(-1.0, 1.0);
    ((-x).acos() + x * (1.0 - x * x).max(0.0).sqrt()) / PI
}

/// Share of the light of twilight that is kept: 1 while the sun is less than 18 degrees below the horizon, 0 from 19
/// on.
///
/// Beyond, refraction and the air's own light, which are not modelled, matter more than scattered sunlight. An eye
/// above the air looks down on its edge, and sees it lit as much longer as that lies below the horizontal.
#[must_use]
pub fn twilight(height_m: f64, sun_cosine: f64) -> f64 {
    let edge = sin_dip(height_m, TOP_M).clamp(0.0, 1.0).asin();
    let below_deg = (-sun_cosine.clamp(-1.0, 1.0).asin() - edge).to_degrees();
    let t = (19.0 - below_deg).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
