//! Light on a scene at a time: where the sun stands, its beam, and the sky. The only place that reads a scene's sun and light.

use crate::atmosphere::{Moments, diffuse_fluxes, geometry};
use crate::disc::Disc;
use crate::scene::quantity::Quantity as _;
use crate::scene::{Atmosphere, Scene, SunStand, direction};
use crate::scene_air::{AirBelow, CoverMoment, SceneAir};
use crate::spectrum::Spectrum;
use crate::sun::{self, Place, SunError, SunPosition, Utc};
use crate::tables::AirTables;
use std::f64::consts::PI;
use std::sync::Arc;

/// Sine of the elevation from which clouds are lit at least. The domain is flat and repeats: a level ray would cross clouds for ever, while on
/// the round Earth it leaves a layer half a kilometre deep after 80 km.
const LEAST_RISE: f64 = 0.006;

/// Light above the clouds at a moment.
#[derive(Debug, Clone, PartialEq)]
pub struct Illumination {
    /// Unit vector towards the sun (east, north, up).
    pub towards_sun: [f64; 3],
    /// Irradiance of the sun on a plane that faces it, above the clouds: red, green, blue; 0 below the horizon.
    pub beam: [f64; 3],
    /// Radiance of the sky, the same in all directions.
    pub sky: [f64; 3],
    /// Across the sun's disc, radians; 0 is parallel light.
    pub sun_diameter: f64,
    /// The sun's irradiance above the air relative to that at its mean distance.
    pub nearness: f64,
    /// What the air below that height makes of light.
    pub air_below: AirBelow,
    /// Light on, in and below the clouds in air, if there are any.
    pub cover: Option<Arc<CoverMoment>>,
}

impl Illumination {
    /// The light of a scene at a time, s since its start; `air` is that of its atmosphere, if it has air.
    pub fn new(scene: &Scene, air: Option<&SceneAir>, time_s: f64) -> Self {
        let (towards_sun, nearness) = sun(scene, time_s);
        // Light of one wavelength is counted in the sun's own above the air.
        let nearness = match air {
            Some(air) if air.clear.spectrum != Spectrum::Visible => 1.0,
            _ => nearness,
        };
        let sun_diameter = scene.sun.angular_diameter_deg.get().to_radians();
        let day = if towards_sun[2] > 0.0 { 1.0 } else { 0.0 };
        let light = match (&scene.atmosphere, air) {
            (Atmosphere::Given(light), _) => AirLight {
                beam: light.sun.map(|value| value.get()),
                sky: light.sky.map(|value| value.get()),
                below: AirBelow::NONE,
                cover: None,
            },
            (Atmosphere::Air(_), Some(air)) => AirLight::new(air, towards_sun[2], nearness),
            (Atmosphere::Air(_), None) => {
                AirLight { beam: [0.0; 3], sky: [0.0; 3], below: AirBelow::NONE, cover: None }
            }
        };
        let AirLight { beam, sky, below, cover } = light;
        let beam = beam.map(|value| day * value);
        Self { towards_sun, beam, sky, sun_diameter, nearness, air_below: below, cover }
    }

    /// The place that a scene's sun stands over, and when it is so long after the scene's start; `None` for a sun that stands in
    /// one direction.
    pub fn place(scene: &Scene, time_s: f64) -> Option<(Place, Result<Utc, SunError>)> {
        match scene.sun.stand {
            SunStand::Direction { .. } => None,
            SunStand::Over { place, start } => Some((place, start.after(time_s))),
        }
    }

    /// The sun's disc as an eye at a height sees it. In air it stands where refraction lifts it to; its light is the beam of the
    /// sun where it truly stands, as all other light of the scene is.
    pub(crate) fn disc(&self, scene: &Scene, air: Option<&AirTables>, eye_m: f64) -> Disc {
        let horizon = -geometry::sin_dip(eye_m, 0.0);
        let disc = Disc {
            towards: self.towards_sun,
            beam: self.beam,
            beam_sets: false,
            diameter: self.sun_diameter,
            through: [[1.0; 3]; Disc::LEVELS],
            horizon,
        };
        let Some(tables) = air else { return disc };
        let altitude_m = match scene.sun.stand {
            SunStand::Direction { .. } => 0.0,
            SunStand::Over { place, .. } => place.altitude_m(),
        };
        let towards = lifted(self.towards_sun, sun::Air::at_altitude(altitude_m + eye_m));
        let height_m = geometry::inside(eye_m, 0.0);
        let beam = tables.waves.each_ref().map(|wave| wave.air.disc_unscattered(height_m, self.towards_sun[2]));
        let through = |level: usize| {
            let elevation = Disc::level(towards[2].asin(), self.sun_diameter, level);
            let cosine = elevation.sin().max(horizon + 1e-9);
            let waves = tables.waves.each_ref();
            tables
                .spectrum
                .colour(waves.map(|wave| wave.air.whole_depth().transmittance(height_m, cosine)))
                .map(|value| value.max(0.0))
        };
        Disc {
            towards,
            beam: tables.spectrum.colour(beam).map(|value| self.nearness * value.max(0.0)),
            beam_sets: true,
            through: std::array::from_fn(through),
            ..disc
        }
    }

    /// The beam at a height on a plane that faces it: in air it is brighter above, and comes for some degrees more once the sun has set
    /// on the ground.
    pub(crate) fn beam_at(&self, air: Option<&SceneAir>, height_m: f64) -> [f64; 3] {
        let Some(air) = air else { return self.beam };
        let waves = air.clear.waves.each_ref();
        let beam = waves.map(|wave| wave.air.disc_transmittance(height_m, self.towards_sun[2]));
        air.clear.spectrum.colour(beam).map(|value| self.nearness * value.max(0.0))
    }

    /// Towards the sun as clouds of some extent see it, a unit vector: one that has set shines on their sides from the horizon.
    pub(crate) fn towards_sun_seen(&self) -> [f64; 3] {
        let [east, north, up] = self.towards_sun;
        if up >= LEAST_RISE {
            return self.towards_sun;
        }
        let level = (1.0 - LEAST_RISE * LEAST_RISE).sqrt() / east.hypot(north).max(f64::MIN_POSITIVE);
        [east * level, north * level, LEAST_RISE]
    }

    /// Cosine of the sun's zenith angle, at least 0.
    pub fn cosine(&self) -> f64 {
        self.towards_sun[2].max(0.0)
    }

    /// Whether the sun is above the horizon.
    pub fn is_day(&self) -> bool {
        self.cosine() > 0.0
    }

    /// Horizontal irradiance of the beam above the clouds.
    pub fn direct(&self) -> [f64; 3] {
        self.beam.map(|value| value * self.cosine())
    }

    /// Horizontal irradiance of beam and sky above the clouds.
    pub fn total(&self) -> [f64; 3] {
        let direct = self.direct();
        std::array::from_fn(|c| direct[c] + PI * self.sky[c])
    }
}

/// Light where it enters what lies below the air: the clouds at their top, or the ground.
struct AirLight {
    beam: [f64; 3],
    sky: [f64; 3],
    below: AirBelow,
    cover: Option<Arc<CoverMoment>>,
}

impl AirLight {
    /// The sun's beam on a plane facing it in klx, and the mean radiance of the sky in kcd/m². A colour beyond Rec.709, as
    /// that of the last light of a setting sun, comes to lie on its edge.
    fn new(air: &SceneAir, sun_cosine: f64, nearness: f64) -> Self {
        let colour = |waves: [f64; 4]| air.clear.spectrum.colour(waves).map(|value| nearness * value.max(0.0));
        let beam = |waves: &[Moments; 4], height_m: f64| {
            colour(waves.each_ref().map(|wave| wave.air.disc_transmittance(height_m, sun_cosine)))
        };
        let Some(covered) = &air.covered else {
            let waves = &air.clear.waves;
            // What coarse particles scatter straight on is the sky's: no cloud needs it in its beam.
            let straight = |wave: &Moments| wave.air.disc_unscattered(0.0, sun_cosine);
            let sky = |wave: &Moments| {
                let aureole = sun_cosine.max(0.0) * (wave.air.disc_transmittance(0.0, sun_cosine) - straight(wave));
                (diffuse_fluxes(wave, 0.0, sun_cosine).down + aureole.max(0.0)) / PI
            };
            let (sky, straight) = (waves.each_ref().map(sky), waves.each_ref().map(straight));
            return Self { beam: colour(straight), sky: colour(sky), below: AirBelow::NONE, cover: None };
        };
        let cover = covered.moment(sun_cosine);
        Self {
            beam: beam(&covered.waves, covered.covers[0].top_m()),
            sky: colour(cover.with.each_ref().map(|light| light.top.down / PI)),
            below: AirBelow::new(air, covered, &cover, [sun_cosine, nearness]),
            cover: Some(cover),
        }
    }
}

/// Where the sun appears through air, for a unit vector towards it (east, north, up).
fn lifted([east, north, up]: [f64; 3], air: sun::Air) -> [f64; 3] {
    let elevation_deg = up.clamp(-1.0, 1.0).asin().to_degrees();
    let (sine, cosine) = (elevation_deg + air.refraction_deg(elevation_deg)).min(90.0).to_radians().sin_cos();
    let level = east.hypot(north).max(f64::MIN_POSITIVE);
    [cosine * east / level, cosine * north / level, sine]
}

/// Unit vector towards the sun (east, north, up), without refraction, and its irradiance relative to that at its mean distance.
fn sun(scene: &Scene, time_s: f64) -> ([f64; 3], f64) {
    match scene.sun.stand {
        SunStand::Direction { zenith_deg, azimuth_deg } => (direction(zenith_deg.get(), azimuth_deg.get()), 1.0),
        SunStand::Over { place, start } => {
            let position = start.after(time_s).and_then(|utc| SunPosition::at(place, utc));
            // No scene and no request leads to an instant without a sun; if one did, it would be night.
            position.map_or(([0.0, 0.0, -1.0], 1.0), |sun| (sun.towards(), sun.irradiance_factor()))
        }
    }
}
