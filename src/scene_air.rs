//! The light of a scene's air: which tables it takes, and what clouds and air make of each other's light at a moment.

use crate::atmosphere::{Moments, Shade, Sky, Under};
use crate::cover::{Cover, CoverLight, Level};
use crate::field;
use crate::ground::GroundMap;
use crate::image::{Image, MissingImage};
use crate::plan::Plan;
use crate::scene::{Atmosphere, Scene};
use crate::spectrum::Spectrum;
use crate::tables::{AirMix, AirTables, CoverLayer, CoveredMix, CoveredTables, MixTables, TableError, TableLibrary};
use std::collections::HashMap;
use std::f64::consts::PI;
use std::sync::Arc;

/// Why the air of a scene is not known.
#[derive(Debug, thiserror::Error)]
pub enum AirError {
    /// The image of the ground's albedo is missing.
    #[error(transparent)]
    Image(#[from] MissingImage),
    /// The aerosol has no optics.
    #[error(transparent)]
    Aerosol(#[from] TableError),
}

/// The air of a scene, if it has any, as its tables depend on it. `images` are those that the scene names. Waits for the optics
/// of its aerosol, which come from the library; `progress` gets 0 to 1 while they are made.
///
/// # Errors
/// The image of the ground's albedo is not among them, or its aerosol has no optics.
pub fn air_mix(
    scene: &Scene,
    images: &HashMap<String, Arc<Image>>,
    plan: &Plan,
    library: &TableLibrary,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<Option<AirMix>, AirError> {
    let Atmosphere::Air(column) = &scene.atmosphere else { return Ok(None) };
    let ground = GroundMap::new(&scene.ground.albedo, images)?.mean();
    let aerosol = library.aerosol(&column.aerosol, plan.spectrum.wavelengths_nm(), progress)?;
    Ok(Some(AirMix::new(plan.spectrum, column.clone(), aerosol, ground, plan.tolerance, plan.air)))
}

/// The air of a scene with its clouds in it, if it has both, as the tables of that depend on them. `air` is that of
/// [`air_mix`], `droplets` are the tables of its stratiform layers' droplets, lowest first,
/// and whatever follows them.
///
/// # Errors
/// An image of a layer is not among `images`.
pub fn covered_mix(
    scene: &Scene,
    images: &HashMap<String, Arc<Image>>,
    air: &AirMix,
    droplets: &[Arc<MixTables>],
) -> Result<Option<CoveredMix>, MissingImage> {
    let mut layers = Vec::new();
    for (layer, droplets) in scene.layers.iter().zip(droplets) {
        let cross_sections = droplets.channels.each_ref().map(|channel| channel.cross_section_um2);
        let extinction_per_m = layer.droplets.extinction_per_m(cross_sections);
        let droplets = Arc::clone(droplets);
        let profile = field::profile(layer, images, extinction_per_m[1])?;
        layers.push(CoverLayer { profile, extinction_per_m, droplets });
    }
    Ok(layers.iter().any(CoverLayer::has_cloud).then(|| CoveredMix { air: air.clone(), layers }))
}

/// The light of a scene's air.
#[derive(Debug, Clone)]
pub struct SceneAir {
    /// Over the ground, without clouds.
    pub clear: Arc<AirTables>,
    /// With the clouds in it, if there are any.
    pub covered: Option<Arc<CoveredTables>>,
}

impl SceneAir {
    /// Names it exactly.
    pub fn key(&self) -> &str {
        self.covered.as_ref().map_or(&self.clear.key, |covered| &covered.key)
    }
}

/// Light of the sun and of the air at a moment on, in and below the clouds, at the four wavelengths; per unit sun.
#[derive(Debug, Clone, PartialEq)]
pub struct CoverMoment {
    /// With the air among and below the clouds.
    pub with: [CoverLight; 4],
    /// Without it, under the same light but an even sky: what the stages that know no air make of it, in the mean.
    pub without: [CoverLight; 4],
}

impl CoverMoment {
    /// Light of a sun of this cosine at the clouds' top.
    pub fn new(tables: &CoveredTables, sun_cosine: f64) -> Self {
        let with: [CoverLight; 4] =
            std::array::from_fn(|wave| tables.covers[wave].light(&tables.waves[wave], sun_cosine));
        let even = |wave: usize, cover: &Cover| {
            let Level { direct, down, .. } = with[wave].top;
            cover.lit(sun_cosine, direct, [down / PI; _])
        };
        let without = std::array::from_fn(|wave| even(wave, &tables.airless[wave]));
        Self { with, without }
    }

    /// What the air makes of an irradiance: as much of it passes as of even light, if the rest is what the air adds of its own
    /// scattered beam. Under closed cloud in haze less may be left.
    fn change(&self, light: &Changed, irradiance: impl Fn(&CoverLight) -> f64) -> AirChange {
        let Changed { spectrum, clearness, nearness } = *light;
        let (with, without) = (self.with.each_ref().map(&irradiance), self.without.each_ref().map(&irradiance));
        let passing = |wave: usize| (clearness[wave] * without[wave]).min(with[wave]);
        let passed: [f64; 4] = std::array::from_fn(passing);
        let added = spectrum.colour(std::array::from_fn(|wave| with[wave] - passed[wave]));
        AirChange { factor: relative(spectrum, passed, without), added: added.map(|value| nearness * value.max(0.0)) }
    }

    /// What the air within a layer leaves of light that comes through it, in the mean. `reflectance` is the layer's for even
    /// light: what it sends back from below did not come through.
    fn within(&self, spectrum: Spectrum, base_m: f64, reflectance: [f64; 4]) -> [f64; 3] {
        let through = |lights: &[CoverLight; 4]| {
            std::array::from_fn(|wave| {
                let base = lights[wave].at(base_m);
                (base.down - reflectance[wave] * base.up).max(0.0)
            })
        };
        relative(spectrum, through(&self.with), through(&self.without))
    }
}

/// What light is changed by air.
struct Changed {
    spectrum: Spectrum,
    /// Transmittance of the air for even light.
    clearness: [f64; 4],
    /// The sun's irradiance relative to that at its mean distance.
    nearness: f64,
}

/// What air makes of light as it is without air: a part of it, and more. Red, green, blue.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AirChange {
    /// Part of the light.
    pub factor: [f64; 3],
    /// Irradiance that is added.
    pub added: [f64; 3],
}

impl AirChange {
    /// None.
    pub const NONE: Self = Self { factor: [1.0; 3], added: [0.0; 3] };

    /// Followed by a factor.
    pub fn times(self, factor: [f64; 3]) -> Self {
        let product = |values: [f64; 3]| std::array::from_fn(|c| values[c] * factor[c]);
        Self { factor: product(self.factor), added: product(self.added) }
    }
}

/// Less light than this, per unit sun, is none.
const DARK: f64 = 1e-30;

/// Ratio of two lights in red, green and blue, between the least and the greatest ratio of a wavelength; 1 in the dark.
fn relative(spectrum: Spectrum, with: [f64; 4], without: [f64; 4]) -> [f64; 3] {
    let ratios: [f64; 4] =
        std::array::from_fn(|wave| if without[wave] > DARK { with[wave] / without[wave] } else { 1.0 });
    let (least, greatest) = ratios.iter().fold((f64::MAX, 0.0_f64), |(a, b), &ratio| (a.min(ratio), b.max(ratio)));
    // Colours beyond Rec.709, as of the last light of a setting sun, have parts below 0: then the nearest wavelength counts.
    let near = [ratios[0], ratios[1], ratios[3]];
    let (with, without) = (spectrum.colour(with), spectrum.colour(without));
    std::array::from_fn(|c| {
        let ratio = if with[c] > 0.0 && without[c] > DARK { with[c] / without[c] } else { near[c] };
        ratio.clamp(least, greatest)
    })
}

/// What the air among and below the clouds makes of light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AirBelow {
    /// Part of the sun's beam at the clouds' top that reaches the ground; red, green, blue.
    pub ground_beam: [f64; 3],
    /// Of diffuse light on the ground.
    pub ground_diffuse: AirChange,
    /// Of light on each layer from below and from above, lowest layer first.
    pub layers: [[AirChange; 2]; Scene::MAX_LAYERS],
    /// Part of what comes through each layer that the air in it leaves; red, green, blue.
    pub within: [[f64; 3]; Scene::MAX_LAYERS],
}

impl AirBelow {
    /// None.
    pub const NONE: Self = Self {
        ground_beam: [1.0; 3],
        ground_diffuse: AirChange::NONE,
        layers: [[AirChange::NONE; 2]; Scene::MAX_LAYERS],
        within: [[1.0; 3]; Scene::MAX_LAYERS],
    };

    /// Of a moment's clouds. In the mean over the domain light then is that of the clouds as even layers in air; from place to
    /// place it varies as it does without air.
    /// Of the sun the cosine of its zenith, and its irradiance relative to that at its mean distance.
    pub fn new(air: &SceneAir, tables: &CoveredTables, moment: &CoverMoment, [sun_cosine, nearness]: [f64; 2]) -> Self {
        let mut below = Self::NONE;
        let spectrum = air.clear.spectrum;
        let light = Changed { spectrum, clearness: tables.clearness, nearness };
        let change = |irradiance: &dyn Fn(&CoverLight) -> f64| moment.change(&light, irradiance);
        // Along the sphere: a level layer of air lets nothing through from the horizon.
        let beam = |waves: &[Moments; 4], height_m: f64| {
            waves.each_ref().map(|wave| wave.air.disc_transmittance(height_m, sun_cosine))
        };
        below.ground_beam =
            relative(spectrum, beam(&air.clear.waves, 0.0), beam(&tables.waves, tables.covers[0].top_m()));
        below.ground_diffuse = change(&|light| light.ground.down);
        for (changes, [base_m, top_m]) in below.layers.iter_mut().zip(&tables.heights_m) {
            *changes = [change(&|light| light.at(*base_m).up), change(&|light| light.at(*top_m).down)];
        }
        // Once the sun has set below a layer it shines on its base, as far as no layer lies before it.
        let mut open = nearness * (-sun_cosine).max(0.0);
        for ([from_below, _], [base_m, _]) in below.layers.iter_mut().zip(&tables.heights_m) {
            let sun = spectrum.colour(beam(&air.clear.waves, *base_m));
            from_below.added = std::array::from_fn(|c| from_below.added[c] + open * sun[c].max(0.0));
            open *= 1.0 - tables.part;
        }
        let layers = tables.heights_m.iter().zip(&tables.reflectances);
        for (within, ([base_m, _], reflectance)) in below.within.iter_mut().zip(layers) {
            // The mean over a broken cover has the light of the gaps in it, whose air is not the clouds'.
            let mean = moment.within(spectrum, *base_m, *reflectance);
            *within = mean.map(|factor| 1.0 + tables.part * (factor - 1.0));
        }
        below
    }
}

/// The air of a wavelength below the top of the clouds.
#[derive(Debug)]
pub struct UnderCover<'a> {
    clear: &'a Moments,
    with: &'a CoverLight,
    without: &'a CoverLight,
    /// Part of the sky that cloud takes.
    part: f64,
}

impl<'a> UnderCover<'a> {
    /// Of a moment's clouds.
    pub fn new(air: &'a SceneAir, tables: &CoveredTables, moment: &'a CoverMoment, wave: usize) -> Self {
        let (with, without) = (&moment.with[wave], &moment.without[wave]);
        Self { clear: &air.clear.waves[wave], with, without, part: tables.part }
    }
}

impl Under for UnderCover<'_> {
    fn ceiling_m(&self) -> f64 {
        self.with.top.height_m
    }

    fn clear(&self) -> &Moments {
        self.clear
    }

    fn shade(&self, height_m: f64, _sun_cosine: f64) -> Shade {
        let (level, open) = (self.with.at(height_m), self.without.top.direct);
        let [mean, net] = level.moments();
        let beam = if open > DARK { self.without.at(height_m).direct / open } else { 1.0 - self.part };
        Shade { beam: beam.clamp(0.0, 1.0), clear: 1.0 - self.part, mean: self.part * mean, net: self.part * net }
    }
}

/// The whole air of a wavelength; `under` is what lies below the clouds' top, if there are any.
pub fn sky<'a>(air: &'a SceneAir, under: Option<&'a UnderCover<'a>>, wave: usize) -> Sky<'a> {
    match (&air.covered, under) {
        (Some(covered), Some(under)) => Sky { above: &covered.waves[wave], under: Some(under) },
        _ => Sky::from(&air.clear.waves[wave]),
    }
}
