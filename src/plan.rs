//! How much to do about a request: method, table size, march and exchange, from the tolerance and the scene.
//!
//! Every choice names the error that is expected of it: relative, root mean square, as measured by `skyloom chart`
//! (docs/charts/slab.csv) and the tests. Each stage takes its cheapest choice whose own error stays below the tolerance,
//! or its finest where none does; [`expected_error`] tells what they come to together.

use crate::field;
use crate::method::{Method, Reference, SlabMethod, Transport};
use crate::request::Request;
use crate::scene::quantity::Quantity as _;
use crate::scene::{GroundAlbedo, Layer, Scene};
use crate::spectrum::Spectrum;
use crate::tables::Detail;

/// Part of the tolerance that the exchange between cloud and ground may leave.
const EXCHANGE_SHARE: f64 = 0.05;
/// Tolerance from which the maps of sunlight have one texel per transport length. Twice as many cost twice the stage; against
/// Monte Carlo in three dimensions they change light on the ground by 1 % of its error, and that seen of broken cloud
/// from above by 10 % of its error.
const COARSE_MAPS: f64 = 0.02;
/// Tolerance from which the exchange grid may be half as fine.
const COARSE_GRID: f64 = 0.1;

/// Texels a side of a synthetic field per texel of the texture, at most: what lies between could not be shown.
const FIELD_TEXELS_PER_TEXEL: u32 = 2;
/// Texels a side of a synthetic field, at least, unless the scene has fewer: below this, coverage and mean would be those of
/// a handful of texels.
const LEAST_FIELD_TEXELS: u32 = 128;

/// Tolerance from which a field may lack what is too fine to be shown. A texel is a point of the sky: without the finest
/// waves it is another point's value, by up to a few percent.
const COARSE_FIELD: f64 = 0.1;

/// Texels a side of the scene's synthetic fields for a request: those of the scene, but where the tolerance allows it no finer
/// than the texture can show.
pub fn field_resolution(scene: &Scene, request: &Request) -> u32 {
    // The thickness itself is exact.
    if request.wanted.tolerance().is_none_or(|tolerance| tolerance < COARSE_FIELD) {
        return scene.resolution();
    }
    let shown = request.size.map_or(Scene::MAX_SIDE, |size| FIELD_TEXELS_PER_TEXEL * size);
    scene.resolution().min(shown.max(LEAST_FIELD_TEXELS))
}

/// A method of slab light in words.
fn in_words(slab: SlabMethod) -> String {
    let name = slab.asked_as().name();
    slab.detail().map_or_else(
        || name.to_owned(),
        |detail| {
            let size = detail.size();
            let nodes = format!("{} x {} x {}", size.depths(), size.zeniths, size.azimuths);
            format!("{name}, {} ({nodes})", detail.name())
        },
    )
}

/// How finely the clouds of a sky are looked at where many of them are one texel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SkyDetail {
    /// Rays of a texel, at most.
    pub rays: u32,
    /// Texels of a map along the ground for each of them.
    pub texels_per_ray: f64,
    /// Mip levels of the map beyond that whose texels are as wide as the picture's.
    pub coarseness: f64,
    /// Samples of the map for each of its texels that a ray crosses.
    pub steps: f64,
    /// Relative error of broken clouds within 10 km against point rays on the exact map, root mean square over a texel of a
    /// degree (tests/sky_view.rs); a good part of it is the mean over the texel, which is wanted.
    pub error: f64,
}

/// How a sky is looked at, from so large a tolerance on. A finer look is slower by a half each, and errs less only near the
/// horizon, where many clouds are one texel.
const SKY_DETAIL: [(SkyDetail, f64); 2] = [
    (SkyDetail { rays: 4, texels_per_ray: 8.0, coarseness: 1.0, steps: 0.5, error: 0.38 }, 0.1),
    (SkyDetail { rays: 4, texels_per_ray: 8.0, coarseness: 0.5, steps: 1.0, error: 0.17 }, 0.01),
];
/// The finest look.
const FINEST_SKY: SkyDetail = SkyDetail { rays: 8, texels_per_ray: 4.0, coarseness: 0.0, steps: 2.0, error: 0.12 };

/// Relative error of light in cumulus, root mean square over pictures of clouds at many suns (tests/cumulus.rs).
const CUMULUS_ERROR: f64 = 0.07;

/// What a request will use.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plan {
    /// Relative error that is acceptable; the default where the texture is exact.
    pub tolerance: f64,
    /// How slab light is computed, if the texture shows any. By Monte Carlo, what is not the sun's light is shaded by it.
    pub slab: Option<SlabMethod>,
    /// Monte Carlo, where it is asked for.
    pub reference: Option<Reference>,
    /// How sunlight is carried through uneven cloud.
    pub transport: Transport,
    /// Texels of the maps of sunlight per transport length of the cloud: light is spread by about as much.
    pub texels_per_length: f64,
    /// Grid texels per height of the cloud base.
    pub texels_per_height: f64,
    /// Relative change at which the exchange between cloud and ground is taken as settled.
    pub exchange_change: f64,
    /// Rays and levels of a sky.
    pub sky: SkyDetail,
    /// What light is made of.
    pub spectrum: Spectrum,
}

/// The error expected of a whole plan: its stages err independently.
pub fn expected_error(choices: &[Choice]) -> f64 {
    choices.iter().map(|choice| choice.error * choice.error).sum::<f64>().sqrt()
}

/// Whether the error expected of a whole plan is within its tolerance.
pub fn meets_tolerance(choices: &[Choice], plan: &Plan) -> bool {
    expected_error(choices) <= plan.tolerance
}

/// One stage of a plan, in words.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// The stage.
    pub stage: &'static str,
    /// What it will do.
    pub choice: String,
    /// Why.
    pub reason: String,
    /// Relative error expected of it, root mean square; 0 where it is exact.
    pub error: f64,
}

impl Plan {
    /// Plans a request. The tolerance alone decides, so that equal requests are equal on every machine.
    pub fn new(request: &Request) -> Self {
        let tolerance = request.wanted.tolerance().unwrap_or(Request::TOLERANCE);
        let slab = match request.wanted.method() {
            // What is not the sun's light takes no method.
            Some(Method::Reference(_)) => SlabMethod::Analytic,
            asked => SlabMethod::within(tolerance, asked),
        };
        Self {
            tolerance,
            slab: request.texture().needs().slab.then_some(slab),
            reference: request.wanted.reference(),
            transport: request.wanted.transport().unwrap_or(if tolerance >= Transport::Tilted.error() {
                Transport::Tilted
            } else {
                Transport::Blended
            }),
            texels_per_length: if tolerance >= COARSE_MAPS { 1.0 } else { 2.0 },
            texels_per_height: if tolerance >= COARSE_GRID { 2.0 } else { 4.0 },
            exchange_change: EXCHANGE_SHARE * tolerance,
            sky: SKY_DETAIL.iter().find(|(_, least)| tolerance >= *least).map_or(FINEST_SKY, |(detail, _)| *detail),
            spectrum: request.wanted.spectrum().unwrap_or(Spectrum::Visible),
        }
    }

    /// Size of the radiance tables, if any are used.
    pub fn detail(&self) -> Option<Detail> {
        self.slab?.detail()
    }

    /// The plan in words, stage by stage, for a scene.
    pub fn explain(&self, scene: &Scene, request: &Request) -> Vec<Choice> {
        let mut choices = Vec::new();
        let mut add =
            |stage, choice: String, reason: String, error| choices.push(Choice { stage, choice, reason, error });
        if !request.texture().shows_the_scene() {
            add("draw", "marks and a grid of degrees".to_owned(), "a test picture of directions".to_owned(), 0.0);
            return choices;
        }
        if self.reference.is_some() && request.wanted.sphere().is_some() {
            let choice = "reference (Monte Carlo on a round Earth)".to_owned();
            add("sky", choice, "asked for".to_owned(), 0.5 * self.tolerance);
            return choices;
        }
        if scene.layer_count() == 0 && request.wanted.sphere().is_some() {
            add("sky", "the ground and the sky".to_owned(), "there are no clouds".to_owned(), 0.0);
            return choices;
        }
        if scene.layer_count() == 0 {
            add("shade", "constant".to_owned(), "without clouds every texel is the same".to_owned(), 0.0);
            return choices;
        }
        if scene.cumulus.is_some() {
            let choice = "lattice: 14 directions, dressed single scattering".to_owned();
            let reason = "light in three dimensions; measured on clouds by Monte Carlo".to_owned();
            add("cumulus", choice, reason, CUMULUS_ERROR);
        }
        if scene.layers.is_empty() {
            return choices;
        }
        let is_uniform = |layer: &Layer| layer.shape.is_even();
        let uniform = scene.layers.iter().all(is_uniform);
        for layer in &scene.layers {
            let words = || field::octaves_in_words(&layer.shape, field_resolution(scene, request));
            let (choice, reason) = match (is_uniform(layer), field::moves(&layer.shape, &layer.wind)) {
                (true, _) => ("one texel".to_owned(), "the thickness is the same everywhere"),
                (_, true) => (
                    format!("map displaced by eddies, {}", words()),
                    "turbulence; at most a life of 64 steps, from a checkpoint fewer",
                ),
                (_, false) => {
                    (format!("map moved by the mean wind, {}", words()), "no turbulence: made once, for all times")
                }
            };
            add("field", choice, reason.to_owned(), 0.0);
        }
        let needs = request.texture().needs();
        if self.reference.is_some() && needs.ground_sun {
            let choice = "reference (Monte Carlo in three dimensions)".to_owned();
            add("light", choice, "asked for".to_owned(), 0.5 * self.tolerance);
            return choices;
        }
        let (march, error) = match uniform {
            true => ("closed form", 0.0),
            // Exact but for rounding.
            false => ("cut at every texel: exact up to 1024 cuts", 0.001),
        };
        add("march", march.to_owned(), "optical depth along sun and view rays".to_owned(), error);
        if needs.light {
            let dark =
                matches!(&scene.ground.albedo, GroundAlbedo::Uniform(albedo) if albedo.iter().all(|a| a.get() == 0.0));
            let even = uniform && matches!(scene.ground.albedo, GroundAlbedo::Uniform(_));
            let (choice, error) = match uniform {
                true => ("one column".to_owned(), 0.0),
                false => {
                    let maps =
                        format!("{}, {} texels per transport length", self.transport.name(), self.texels_per_length);
                    (maps, self.transport.error())
                }
            };
            let reason = match request.wanted.transport() {
                Some(_) => "asked for",
                None => "sunlight through uneven cloud; no method for every frame errs less",
            };
            add("sunlight", choice, reason.to_owned(), error);
            let (choice, reason, error) = match (dark, even) {
                (true, _) => ("no exchange".to_owned(), "the ground reflects nothing", 0.0),
                (_, true) => ("one texel".to_owned(), "cloud and ground are the same everywhere", 0.0),
                _ => (
                    format!(
                        "exact kernel, conjugate gradients to {:.1e}, {} texels per base height",
                        self.exchange_change, self.texels_per_height
                    ),
                    "light between cloud and ground",
                    self.exchange_change + if self.texels_per_height >= 4.0 { 0.002 } else { 0.01 },
                ),
            };
            add("exchange", choice, reason.to_owned(), error);
        }
        if request.wanted.sphere().is_some() {
            let SkyDetail { rays, steps, error, .. } = self.sky;
            let choice = format!("up to {rays} rays a texel, {steps} samples per texel of cloud");
            add(
                "sky",
                choice,
                "many clouds are one texel near the horizon".to_owned(),
                if uniform { 0.0 } else { error },
            );
        }
        if let Some(slab) = self.slab {
            let (choice, error) = match self.reference {
                Some(_) => ("reference (Monte Carlo)".to_owned(), 0.5 * self.tolerance),
                None => (in_words(slab), slab.error()),
            };
            let reason = match request.wanted.method() {
                Some(_) => "asked for".to_owned(),
                None if error <= self.tolerance => format!("the cheapest within the tolerance of {}", self.tolerance),
                None => format!("the finest there is; the tolerance is {}", self.tolerance),
            };
            add("shade", choice, reason, error);
        }
        choices
    }
}
